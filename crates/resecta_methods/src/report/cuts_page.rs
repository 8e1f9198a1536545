//! `cuts.md`: targets and what was measured. What it says of results is computed.

use std::fmt::Write;

use super::{
    Cuts,
    machine::processor,
    tables::{number, plain, table},
};
use crate::cuts::{
    TARGET_SPACING_MM,
    errors::{Errors, WholeElements, order},
    gland::{Gland, STEP_MM, Steps, Untouched},
    solids::CUBE_MM,
};

/// Targets at [`TARGET_SPACING_MM`].
const VOLUME: f64 = 0.01;
const MEAN_MM: f64 = 0.1;
const LARGEST_MM: f64 = 0.5;
const MOVING_MS: f64 = 0.5;
const MOST_MB: f64 = 128.0;
const IMBALANCE: f64 = 1e-6;
/// A fitted order that counts as falling with the square of the spacing.
const SQUARE: f64 = 1.9;

const INTRODUCTION: &str = "# How exactly tissue is cut, and what it costs

A cut is a signed distance on a sub-lattice inside the pentahedra that it touches (`resecta_field`). Its one setting is the
spacing: no part of an edge is longer. Here it is measured against exact solids and over a whole resection.

**Solids**, inside a block of 7 x 7 x 11 cubes of 2 mm, two pentahedra each, all askew to its faces: a ball of 4 mm radius, half
a cylinder of 3.5 mm radius and 15 mm length, and a stroke of the loop (half an ellipse, 6.5 mm wide and 4.5 mm deep) over 15 mm
in 18 steps; cut from the block at rest, and from the block stretched by 20 % across. Edges of 2 mm have a whole number of
parts, so spacings of 0.7 and 0.35 mm are 0.67 and 0.33 there.

**The gland** is a tube, its lattice as fine as the game's, cut by pulls of the same loop over its whole length, round after
round from the lining to near the capsule. What every fifth pull takes is lost to heat, the others make chips. A step is one
call of `Field::cut`; those in which the loop met no tissue are left out. The gland is cut five times over by the same steps,
and a step's time is the median of its five; nothing is the best of several.

To repeat: `cargo run --release -- accuracy --only cuts`. ";

/// The whole page.
pub fn page(cuts: &Cuts) -> String {
    let mut text = INTRODUCTION.to_string();
    let _ = write!(text, "Times are CPU times of one thread of this: {}.\n\n", processor());
    targets(&mut text, cuts);
    errors(&mut text, cuts);
    orders(&mut text, cuts);
    whole(&mut text, cuts);
    glands(&mut text, cuts);
    history(&mut text, cuts);
    rounds(&mut text, cuts);
    text.trim_end().to_string() + "\n"
}

fn percent(share: f64) -> String {
    format!("{:.3}", 100.0 * share)
}

fn block(stretch: f64) -> &'static str {
    if stretch == 1.0 { "at rest" } else { "stretched" }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// Orders of the volume's error and of the mean distance.
fn fitted(rows: &[Errors]) -> [Option<f64>; 2] {
    let order = |value: fn(&Errors) -> f64| order(rows.iter().map(|row| (row.spacing_mm, value(row))));
    [order(|row| row.volume), order(|row| row.mean_mm)]
}

/// Targets and whether they are met; nothing where their spacing was not measured.
fn targets(text: &mut String, cuts: &Cuts) {
    let at_target: Vec<&Errors> = (cuts.errors.iter())
        .filter(|row| row.spacing_mm == TARGET_SPACING_MM)
        .collect();
    let Some(gland) = cuts.glands.iter().find(|gland| gland.spacing_mm == TARGET_SPACING_MM) else {
        return;
    };
    let _ = write!(
        text,
        "## Targets\n\nAt a spacing of {TARGET_SPACING_MM} mm; the worst of all solids. Steps are compared with the very first, \
         which only enters the tissue, and with those of the first pull, all of whose way is uncut.\n\n"
    );
    let mut lines = errors_met(cuts, &at_target);
    lines.extend(costs_met(gland));
    let imbalance = largest(cuts.glands.iter().map(Gland::imbalance));
    lines.push(met(
        "chips, lost to heat and what is left, at any spacing",
        "conserved to 1e-6",
        number(imbalance),
        imbalance <= IMBALANCE,
    ));
    *text += &table(&["what", "target", "measured", ""], lines);
}

/// A line of the targets' table.
fn met(what: &str, target: &str, measured: String, is_met: bool) -> Vec<String> {
    let verdict = if is_met { "met" } else { "**missed**" };
    vec![what.to_string(), target.to_string(), measured, verdict.to_string()]
}

fn errors_met(cuts: &Cuts, at_target: &[&Errors]) -> Vec<Vec<String>> {
    let volume = largest(at_target.iter().map(|row| row.volume.abs()));
    let mean = largest(at_target.iter().map(|row| row.mean_mm));
    let far = largest(at_target.iter().map(|row| row.largest_mm));
    let mut lines = vec![
        met(
            "removed volume against the exact one",
            "1 %",
            format!("{} %", percent(volume)),
            volume <= VOLUME,
        ),
        met(
            "distance of the new surface, mean",
            "0.1 mm",
            format!("{} mm", plain(mean)),
            mean <= MEAN_MM,
        ),
        met(
            "the same, largest",
            "0.5 mm",
            format!("{} mm", plain(far)),
            far <= LARGEST_MM,
        ),
    ];
    let orders = cuts.groups().filter_map(|rows| fitted(rows)[0]);
    if let Some(least) = orders.min_by(f64::total_cmp) {
        let falls = met(
            "how it falls with the spacing",
            "with the square",
            format!("with an order of {least:.2} or more"),
            least >= SQUARE,
        );
        lines.insert(1, falls);
    }
    lines
}

fn costs_met(gland: &Gland) -> Vec<Vec<String>> {
    let rounds = &gland.rounds;
    let first = rounds.first().map_or(0.0, |round| round.steps.times.median);
    let slowest = largest(rounds.iter().skip(1).map(|round| round.steps.times.median));
    let (first_pull, later) = (gland.first_pull.times, gland.later.times);
    let longer = gland.longer_than_first;
    vec![
        vec![
            format!("a step of a stroke, {} nodes", gland.nodes),
            "none, to be told".into(),
            format!(
                "median {} ms, 99th percentile {} ms",
                plain(gland.steps.times.median),
                plain(gland.steps.times.most)
            ),
            String::new(),
        ],
        met(
            "moving 100,000 vertices with the lattice",
            "under 0.5 ms",
            format!("{} ms", plain(gland.moving_many())),
            gland.moving_many() < MOVING_MS,
        ),
        met(
            "memory of a gland cut from end to end",
            "under 128 MB",
            format!("{} MB", plain(gland.most_mb)),
            gland.most_mb < MOST_MB,
        ),
        met(
            "no step slower than the very first",
            &format!("{} ms", plain(gland.first_step_ms)),
            format!(
                "{} ms; {} of {} steps took longer",
                plain(gland.steps.times.largest),
                gland.longer_than_first_step,
                gland.steps.count - 1
            ),
            gland.longer_than_first_step == 0,
        ),
        met(
            "no later step slower than the slowest of the first pull",
            &format!("{} ms", plain(first_pull.largest)),
            format!(
                "{} ms; {longer} of {} steps took longer",
                plain(later.largest),
                gland.later.count
            ),
            longer == 0,
        ),
        met(
            "the same by their medians",
            &format!("{} ms", plain(first_pull.median)),
            format!("{} ms", plain(later.median)),
            later.median <= first_pull.median,
        ),
        met(
            "no round slower than the first, by their median steps",
            &format!("{} ms", plain(first)),
            format!("{} ms", plain(slowest)),
            slowest <= first,
        ),
    ]
}

fn errors(text: &mut String, cuts: &Cuts) {
    *text += "## Errors\n\n![error of the volume against spacing](cuts_volume.svg)\n\n\
              ![distance of the new surface against spacing](cuts_distance.svg)\n\n\
              A cut takes too little: between the points its wall is straight, and the solid's edges are rounded. `slivers` is the part of what it took that went \
              because less than 0.1 % of a pentahedron would have been left; it makes pits in the wall, and they, not the \
              spacing, set the largest distance of the ball.\n\n";
    let line = |row: &Errors| {
        vec![
            row.solid.to_string(),
            block(row.stretch).to_string(),
            row.spacing_mm.to_string(),
            percent(row.volume),
            percent(row.slivers),
            plain(row.mean_mm),
            plain(row.largest_mm),
            plain(row.mb),
        ]
    };
    *text += &table(
        &[
            "solid",
            "block",
            "spacing, mm",
            "error of the volume, %",
            "slivers, %",
            "mean distance, mm",
            "largest, mm",
            "MB",
        ],
        cuts.errors.iter().map(line),
    );
}

fn orders(text: &mut String, cuts: &Cuts) {
    *text += "Orders: slopes of straight lines through the logarithms, over all spacings. The mean distance falls a \
              little more slowly than the volume's error: the pits do not shrink, and where faces of the solid meet in an edge \
              the distance falls with the spacing, not with its square.\n\n";
    let line = |rows: &[Errors]| {
        let mut line = vec![rows[0].solid.to_string(), block(rows[0].stretch).to_string()];
        line.extend(fitted(rows).map(|order| order.map_or(String::new(), |order| format!("{order:.2}"))));
        line
    };
    *text += &table(
        &["solid", "block", "order of the volume", "order of the mean distance"],
        cuts.groups().map(line),
    );
}

fn whole(text: &mut String, cuts: &Cuts) {
    let _ = write!(
        text,
        "## Without a field\n\nThe same block of {CUBE_MM} mm, from which the pentahedra go whole of which the solid holds the \
         middle. How well the volume is met is a matter of luck: RMS and largest over 27 places of the block, apart by thirds \
         of a cube. Distances are those of the nodes between what goes and what stays.\n\n"
    );
    let line = |row: &WholeElements| {
        vec![
            row.solid.to_string(),
            block(row.stretch).to_string(),
            percent(row.volume[0]),
            percent(row.volume[1]),
            plain(row.mean_mm),
            plain(row.largest_mm),
        ]
    };
    *text += &table(
        &[
            "solid",
            "block",
            "error of the volume, % RMS",
            "largest, %",
            "mean distance, mm",
            "largest, mm",
        ],
        cuts.whole.iter().map(line),
    );
}

fn glands(text: &mut String, cuts: &Cuts) {
    let size = cuts.glands.first();
    let _ = write!(
        text,
        "## Costs\n\n![CPU time against spacing](cuts_time.svg)\n\nThe gland of {} nodes, {} pentahedra and {:.0} ml; a step is {STEP_MM:.2} mm, 50 mm/s at 60 Hz. A chip is that of a whole pull, 35 mm long. \
         Moving is in proportion, from the round that ends with most nearly 100,000 slots. `missing` is by how much \
         chips, heat and what is left do not make the whole.\n\n",
        size.map_or(0, |gland| gland.nodes),
        size.map_or(0, |gland| gland.pentahedra),
        size.map_or(0.0, |gland| 1e-3 * gland.initial_mm3),
    );
    let line = |gland: &Gland| {
        vec![
            gland.spacing_mm.to_string(),
            gland.steps.count.to_string(),
            plain(gland.steps.times.median),
            plain(gland.steps.times.most),
            plain(gland.steps.times.largest),
            plain(gland.chip.median),
            plain(gland.chip.most),
            plain(gland.moving_many()),
            plain(gland.most_mb),
            percent(gland.chips_mm3 / gland.initial_mm3),
            percent(gland.heat_mm3 / gland.initial_mm3),
            percent(gland.kept_mm3 / gland.initial_mm3),
            number(gland.imbalance()),
        ]
    };
    *text += &table(
        &[
            "spacing, mm",
            "steps",
            "a step, ms median",
            "99th percentile",
            "largest",
            "a chip, ms median",
            "99th percentile",
            "moving 100,000 vertices, ms",
            "most MB",
            "chips, %",
            "heat, %",
            "left, %",
            "missing, share",
        ],
        cuts.glands.iter().map(line),
    );
}

/// Nanoseconds for every slot that steps write.
fn ns_a_slot(steps: &Steps) -> f64 {
    1e6 * steps.times.sum / (steps.slots * steps.count as f64).max(1.0)
}

fn history(text: &mut String, cuts: &Cuts) {
    let left = (cuts.glands.iter().map(|gland| gland.untouched.left)).fold(1.0, f64::min);
    let _ = write!(
        text,
        "### Does a step cost more, the more was cut before?\n\nThe first pull goes through uncut tissue all the way; later ones \
         meet less of it, and write less of the surface anew. So the work is counted: slots written, of vertices and \
         triangles. And one and the same pull, through tissue that nothing touched, is made in the uncut gland and when only \
         {} % of it is left, all else being gone far from the pull. It must then do the same work; what it costs more is the \
         cost of what was cut before, wider ways through memory included.\n\n",
        plain(100.0 * left),
    );
    let line = |gland: &Gland| {
        let Untouched { fresh, late, .. } = gland.untouched;
        vec![
            gland.spacing_mm.to_string(),
            plain(gland.first_pull.times.largest),
            plain(gland.later.times.largest),
            format!("{} of {}", gland.longer_than_first, gland.later.count),
            plain(ns_a_slot(&gland.first_pull)),
            plain(ns_a_slot(&gland.later)),
            plain(fresh.slots * fresh.count as f64),
            plain(late.slots * late.count as f64),
            plain(fresh.times.sum),
            plain(late.times.sum),
            format!("{:+.1}", 100.0 * (late.times.sum / fresh.times.sum - 1.0)),
        ]
    };
    *text += &table(
        &[
            "spacing, mm",
            "slowest step of the first pull, ms",
            "of all later ones",
            "steps slower than that",
            "first pull, ns a slot",
            "later, ns a slot",
            "slots written by the pull, early",
            "late",
            "the pull, ms, early",
            "late",
            "more, %",
        ],
        cuts.glands.iter().map(line),
    );
}

fn rounds(text: &mut String, cuts: &Cuts) {
    *text += "Round by round, the loop's middle at `radius`:\n\n";
    let lines = (cuts.glands.iter()).flat_map(|gland| {
        gland.rounds.iter().map(move |round| {
            vec![
                gland.spacing_mm.to_string(),
                plain(round.radius_mm),
                round.steps.count.to_string(),
                plain(round.steps.times.median),
                plain(round.steps.times.most),
                plain(round.steps.times.largest),
                plain(round.steps.pentahedra),
                plain(round.steps.slots),
                plain(ns_a_slot(&round.steps)),
                plain(round.mb),
                round.vertices.to_string(),
                plain(round.moving.median),
            ]
        })
    });
    *text += &table(
        &[
            "spacing, mm",
            "radius, mm",
            "steps",
            "a step, ms median",
            "99th percentile",
            "largest",
            "pentahedra cut, mean",
            "slots written, mean",
            "ns a slot",
            "MB at its end",
            "slots of vertices",
            "moving them, ms",
        ],
        lines,
    );
}
