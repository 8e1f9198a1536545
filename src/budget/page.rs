//! `budget.md`: what was measured. What it says of results is computed.

use std::fmt::Write;

use resecta_methods::{Chart, Series, plain, processor, table};

use super::{
    Apart, Budget, PARTS, RunResult, SceneResult, WITHIN_MM,
    verdicts::{self, Advice, FACTOR, Line, Over, WORTH},
};

const INTRODUCTION: &str = "# The error of each part of the model, and its cost

Five scenes of an operation are played with the shipped settings. Then one part of the model at a time is made coarser or finer, with all else as shipped.
The error of a setting is the distance between its visible surface and that of the finest setting of the same part, at the same time.
All errors are in mm of what a trainee sees, so parts can be compared with each other and with their cost.

";

/// The whole page.
pub fn page(budget: &Budget) -> String {
    let mut text = INTRODUCTION.to_string();
    let _ = write!(
        text,
        "To repeat: `cargo run --release -- accuracy --only budget`, some 20 minutes. Times are CPU times of the whole app \
         without a window, on one thread of this: {}. All numbers are in [budget.json](budget.json).\n\n",
        processor()
    );
    verdict(&mut text, budget);
    method(&mut text);
    scenes(&mut text, budget);
    contact(&mut text, budget);
    parts(&mut text, budget);
    text.trim_end().to_string() + "\n"
}

/// Charts with the names of their files.
pub fn charts(budget: &Budget) -> Vec<(&'static str, Chart)> {
    vec![
        ("budget_parts.svg", of_parts(budget)),
        ("budget_lattice.svg", of_lattice(budget)),
    ]
}

/// Error against cost, a line a part.
fn of_parts(budget: &Budget) -> Chart {
    let parts = budget.scenes.first().map_or(&[][..], |scene| &scene.parts);
    let series = parts.iter().map(|part| Series {
        name: part.name.into(),
        points: (verdicts::settings(budget, part.key).iter())
            .filter(|over| over.beyond_mm > 0.0)
            .map(|over| (over.cost, over.beyond_mm))
            .collect(),
    });
    Chart {
        caption: "Error of each part against its cost, from its coarser setting to finer ones".into(),
        axes: ["CPU time over that as shipped", "error, mm RMS beyond noise"],
        marks: vec![0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0],
        series: series.collect(),
    }
}

/// Error against the lattice's angle, a line a scene.
fn of_lattice(budget: &Budget) -> Chart {
    let series = budget.scenes.iter().map(|scene| {
        let runs = scene.parts.iter().find(|part| part.key == "lattice");
        let runs = runs.map_or(&[][..], |part| &part.runs);
        Series {
            name: scene.key.into(),
            points: (runs.iter())
                .filter_map(|run| Some((run.number?, run.apart?.rms_mm)))
                .collect(),
        }
    });
    Chart {
        caption: "Error of the lattice, against the finest one of the scene".into(),
        axes: ["angle between rays, degrees", "distance of the surface, mm RMS"],
        marks: vec![6.0, 8.0, 10.0, 14.0, 18.0],
        series: series.collect(),
    }
}

fn percent(share: f64) -> String {
    format!("{:.0}", 100.0 * share)
}

/// The table that the budget is for.
fn verdict(text: &mut String, budget: &Budget) {
    let noise = verdicts::noise(budget);
    let _ = write!(
        text,
        "## The budget\n\nErrors over all scenes.\n\n\
         - Noise: runs that differ only by a micrometre or two of the instrument's place end up {} mm apart (RMS).\n\
         - `error`: the distance less the noise, as the root of the difference of their squares. `95 %` includes noise and is that of the worst \
         scene.\n\
         - `share`: what the coarser setting saves of the CPU time.\n\
         - `times`: how many times smaller the error is than that of the worst part. Parts may differ by {FACTOR}.\n\
         - `coarser` and `finer`: the next settings that were measured, with their error and their CPU time relative to the shipped one.\n\
         - `advice` follows from these numbers alone. Finer: it costs at most {:.0} % more and gains more than noise. Coarser: it saves at \
         least {:.0} %, loses no more than noise (or the part is finer than it needs to be), turns no elements inside out and has no step \
         longer than a frame.\n\n",
        plain(noise.rms_mm),
        100.0 * (WORTH.0 - 1.0),
        100.0 * WORTH.1
    );
    let setting = |over: &Over, is_reference: bool| {
        let error = if is_reference {
            "reference".into()
        } else {
            format!("{} mm", plain(over.beyond_mm))
        };
        format!("{}: {error}, {} x", over.setting, plain(over.cost))
    };
    let heads = [
        "part",
        "shipped",
        "error, mm RMS",
        "95 %, mm",
        "share, %",
        "coarser",
        "finer",
        "times",
        "advice",
        "verdict",
    ];
    let line = |line: &Line| {
        let coarser = line.coarser.as_ref();
        let finer = line.finer.as_ref();
        vec![
            line.name.clone(),
            line.shipped.setting.clone(),
            plain(line.shipped.beyond_mm),
            plain(line.shipped.p95_mm),
            coarser.map_or(String::new(), |over| percent(1.0 - over.cost)),
            coarser.map_or(String::new(), |over| setting(over, false)),
            finer.map_or(String::new(), |(over, is_reference)| setting(over, *is_reference)),
            // An error below the noise is no number to divide by.
            if line.shipped.beyond_mm > 0.0 {
                plain(line.times)
            } else {
                "below noise".into()
            },
            advice(line, &noise),
            sentence(line, &noise),
        ]
    };
    *text += &table(&heads, verdicts::lines(budget).iter().map(line));
    let _ = write!(
        text,
        "Contact and the motion of the tissue together take {} % of the CPU time.\n\n\
         ![error of each part against its cost](budget_parts.svg)\n\nThe same scene by scene, mm RMS beyond noise, as shipped:\n\n",
        percent(verdicts::share_of_contact(budget))
    );
    by_scene(text, budget);
    loop_out(text, budget);
}

/// The moment that does not count because anything decides what happens.
fn loop_out(text: &mut String, budget: &Budget) {
    *text += "While the loop goes out over tissue without current, it either catches tissue or slips over it, and the smallest difference \
              decides which. There the noise begins. So the moment before the current of the last stroke is left out above. Its \
              distances, noise included, mm RMS:\n\n";
    let parts = budget.scenes.first().map_or(&[][..], |scene| &scene.parts);
    let names = parts.iter().map(|part| part.name);
    let heads: Vec<&str> = ["scene, loop out", "noise"].into_iter().chain(names).collect();
    let line = |scene: &SceneResult| {
        // The first moment does not count either.
        let look = scene.counts.iter().skip(1).position(|counts| !counts)? + 1;
        let noise = verdicts::noise_by_look(scene).get(look).copied()?;
        let mut line = vec![format!("`{}`", scene.key), plain(noise)];
        line.extend(scene.parts.iter().map(|part| {
            let apart = part.runs.get(1).and_then(|run| *run.by_look.get(look)?);
            apart.map_or(String::new(), |apart| plain(apart.rms_mm))
        }));
        Some(line)
    };
    *text += &table(&heads, budget.scenes.iter().filter_map(line));
}

/// The error of every part in every scene.
fn by_scene(text: &mut String, budget: &Budget) {
    let heads = ["scene", "noise"].into_iter().map(String::from);
    let parts = budget.scenes.first().map_or(&[][..], |scene| &scene.parts);
    let heads: Vec<String> = heads.chain(parts.iter().map(|part| part.name.into())).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let line = |scene: &SceneResult| {
        let mut line = vec![format!("`{}`", scene.key), plain(verdicts::noise_of(scene))];
        line.extend(scene.parts.iter().map(|part| {
            // The shipped setting is the second.
            let apart = part.runs.get(1).and_then(|run| run.apart);
            apart.map_or(String::new(), |apart| plain(verdicts::beyond(&apart, scene)))
        }));
        line
    };
    *text += &table(&heads, budget.scenes.iter().map(line));
}

/// What the numbers say of a part.
fn sentence(line: &Line, noise: &Over) -> String {
    let mut text = String::from(if line.times <= 1.0 {
        "The worst part"
    } else if line.times <= FACTOR {
        "Within ten times of the worst"
    } else {
        "More than ten times as accurate as the worst"
    });
    // Writing to a text cannot fail.
    if let Some((finer, _)) = &line.finer {
        let cost = plain(finer.cost);
        let _ = match line.gain_mm(noise) {
            Some(gain) => write!(text, "; finer gains {} mm for {cost} times the cost", plain(gain)),
            None => write!(text, "; finer gains no more than noise, for {cost} times the cost"),
        };
    }
    if let Some(coarser) = &line.coarser {
        let saves = match 1.0 - coarser.cost {
            saves if saves > 0.0 => format!("saves {} %", percent(saves)),
            saves => format!("costs {} % more", percent(-saves)),
        };
        let _ = match line.loss_mm(noise) {
            Some(loss) => write!(text, "; coarser adds {} mm and {saves}", plain(loss)),
            None => write!(text, "; coarser adds no more than noise and {saves}"),
        };
        if let Some(inverted) = line.coarser_inverts() {
            let _ = write!(text, ", but turns up to {inverted} elements inside out");
        }
        if let Some(stalls_ms) = line.coarser_stalls_ms() {
            let _ = write!(text, ", but has a step of {} ms", plain(stalls_ms));
        }
    }
    text + "."
}

/// What the numbers support for a part, and the setting that it names.
fn advice(line: &Line, noise: &Over) -> String {
    let named =
        |way: &str, over: Option<&Over>| over.map_or(way.to_string(), |over| format!("{way}: {}", over.setting));
    match line.advice(noise) {
        _ if line.finer.is_none() => "no setting".into(),
        Advice::Keep => "keep".into(),
        Advice::Finer => named("finer", line.finer.as_ref().map(|(finer, _)| finer)),
        Advice::Coarser => named("coarser", line.coarser.as_ref()),
    }
}

fn method(text: &mut String) {
    let _ = write!(
        text,
        "## How it is measured\n\n\
         - The visible surface is the tissue's fine surface without the capsule, before it is smoothed for a picture.\n\
         - Points at most half a millimetre apart are spread over the part of each surface within {WITHIN_MM} mm of the sheath's end or of the \
         way of the loop. The distance of each point from the other surface is weighted by the area that the point stands for.\n\
         - The moments are in the table of scenes. At each of them the instrument is at rest. The RMS of a scene is over its moments; the \
         95th percentile and the largest distance are those of the worst moment. Two moments are left out: `before`, and `loop out`, which \
         has a table of its own.\n\
         - The script is the same for all settings. A sheath that tissue holds back stops short of it, so instruments may end up apart: \
         `tips` gives the largest difference.\n\
         - Noise is assumed to be the same for every setting and independent of the error.\n\
         - Contact is measured against the steel itself: tissue must not lie in it, and what presses on tissue must touch it.\n\n\
         Not measured: errors that all settings of a part share, such as the difference between springs and an elastic solid \
         (docs/materials.md) and the order of the integrator; errors of two parts together; the inside of the tissue. A flap that falls to \
         the other side, or a thin bridge that breaks a step sooner, moves the surface by millimetres at once. Such places decide the largest \
         distances, so compare RMS and 95th percentiles. The finest setting is only the best that was tried.\n\n",
    );
}

fn scenes(text: &mut String, budget: &Budget) {
    *text += "## Scenes\n\nIn every scene the sheath starts outside the gland and goes in through the urethra, as in `first_cuts`. The late \
              scene is scripted, since a whole operation takes minutes: three layers of the middle lobe, two seconds a stroke. `noise` is \
              from four runs that differ from the shipped one by a micrometre or two of the instrument's place.\n\n";
    let line = |scene: &SceneResult| {
        let apart = || scene.noise.iter().filter_map(|run| run.apart);
        let most = |value: fn(&Apart) -> f64| apart().map(|apart| value(&apart)).fold(0.0, f64::max);
        vec![
            format!("`{}`: {}", scene.key, scene.words),
            format!("{:.1}", scene.seconds),
            scene.looks.join("; "),
            plain(scene.shipped.removed_mm3),
            scene.shipped.cost.nodes.to_string(),
            plain(scene.shipped.cost.frame_ms),
            plain(scene.shipped.cost.slowest_ms),
            verdicts::noise_by_look(scene)
                .into_iter()
                .map(plain)
                .collect::<Vec<_>>()
                .join("; "),
            plain(most(|apart| apart.p95_mm)),
            plain(most(|apart| apart.largest_mm)),
        ]
    };
    *text += &table(
        &[
            "scene",
            "s",
            "moments",
            "removed, mm³",
            "nodes",
            "CPU, ms per 1/60 s",
            "slowest step, ms",
            "noise at these moments, mm RMS",
            "95 %, mm",
            "largest, mm",
        ],
        budget.scenes.iter().map(line),
    );
    *text += "The scenes are dry. Water at 60 cmH2O in the lumen would move the surface by:\n\n";
    let line = |scene: &SceneResult| {
        vec![format!("`{}`", scene.key)]
            .into_iter()
            .chain(errors(&scene.water))
            .collect()
    };
    let heads = [&["scene"][..], &ERRORS].concat();
    *text += &table(&heads, budget.scenes.iter().map(line));
}

const ERRORS: [&str; 10] = [
    "mm RMS",
    "95 %, mm",
    "largest, mm",
    "tips, mm",
    "removed, mm³",
    "CPU, ms per 1/60 s",
    "slowest step, ms",
    "substeps",
    "most inside out",
    "torn",
];

/// The cells of [`ERRORS`].
fn errors(run: &RunResult) -> [String; 10] {
    let apart = |value: fn(&Apart) -> f64| {
        run.apart
            .as_ref()
            .map_or("reference".into(), |apart| plain(value(apart)))
    };
    [
        apart(|apart| apart.rms_mm),
        apart(|apart| apart.p95_mm),
        apart(|apart| apart.largest_mm),
        plain(run.tips_mm.into()),
        plain(run.removed_mm3),
        plain(run.cost.frame_ms),
        plain(run.cost.slowest_ms),
        plain(run.cost.substeps),
        run.over_steps.inverted.to_string(),
        run.over_steps.torn.to_string(),
    ]
}

fn contact(text: &mut String, budget: &Budget) {
    *text += "## Contact\n\nWith the shipped settings, computed from positions alone. `surface`: how deep the tissue's surface lies in a \
              part, over the area that lies in it. `nodes in it`: nodes at least half a millimetre deep, inner ones included. `filled`: the share \
              of the part's volume in the gland that tissue fills. Thin parts keep tissue 0.4 mm from their axis by design, more than the \
              radius of a wire.\n\n";
    let mut lines = Vec::new();
    for scene in &budget.scenes {
        for (look, standing) in scene.looks.iter().zip(&scene.shipped.standing) {
            for (name, part) in PARTS.iter().zip(&standing.parts).filter(|(_, part)| part.of_mm3 > 0.0) {
                let surface = part.surface.unwrap_or_default();
                lines.push(vec![
                    format!("`{}`, {look}", scene.key),
                    name.to_string(),
                    plain(surface.rms_mm),
                    plain(surface.p95_mm),
                    plain(surface.largest_mm),
                    plain(part.node_mm.into()),
                    part.nodes.to_string(),
                    plain(part.volume_mm3.into()),
                    format!("{:.1}", 100.0 * part.volume_mm3 / part.of_mm3.max(f32::MIN_POSITIVE)),
                ]);
            }
        }
    }
    *text += &table(
        &[
            "scene and moment",
            "part",
            "surface, mm RMS",
            "95 %, mm",
            "deepest, mm",
            "deepest node, mm",
            "nodes in it",
            "tissue in it, mm³",
            "filled, %",
        ],
        lines,
    );
    *text += "Over all steps: the deepest overlap and the largest volume, from the diagnostics; and the gaps between a part and the points that \
              it presses on, as a mean weighted by force and the largest. Large gaps are single points that the loop caught on its way out, \
              without current, and that sprang off within a step.\n\n";
    let mut heads = vec!["scene", "overlap, mm", "in thin parts, mm", "overlap, mm³"];
    let gaps: Vec<String> = PARTS
        .iter()
        .map(|part| format!("gap at the {part}, mean and largest, mm"))
        .collect();
    heads.extend(gaps.iter().map(String::as_str));
    let line = |scene: &SceneResult| {
        let over = &scene.shipped.over_steps;
        let mut line = vec![
            format!("`{}`", scene.key),
            plain(over.overlap_mm.into()),
            plain(over.thin_overlap_mm.into()),
            plain(over.overlap_mm3.into()),
        ];
        let gaps = over.gaps.mean_mm.iter().zip(over.gaps.largest_mm);
        line.extend(gaps.map(|(mean, largest)| format!("{}; {}", plain(*mean), plain(largest.into()))));
        line
    };
    *text += &table(&heads, budget.scenes.iter().map(line));
    *text += "Contact has no finer setting: the spacing of its points and its margin are constants. More passes refine it (`passes` below).\n\n\
              ## Elements inside out\n\nThree counts: elements of negative volume, as the solver measures it; elements whose three \
              tetrahedra, by a fixed division, have a negative sum; and elements of which any of these three is negative. Moments as above; \
              `most` is over all steps.\n\n";
    let mut lines = Vec::new();
    for scene in &budget.scenes {
        for (look, standing) in scene.looks.iter().zip(&scene.shipped.standing) {
            let inverted = standing.inverted;
            lines.push(vec![
                format!("`{}`, {look}", scene.key),
                inverted.of.to_string(),
                inverted.by_solver.to_string(),
                inverted.otherwise.to_string(),
                inverted.in_part.to_string(),
                scene.shipped.over_steps.inverted.to_string(),
            ]);
        }
    }
    *text += &table(
        &[
            "scene and moment",
            "elements",
            "negative volume",
            "by a fixed division",
            "in part",
            "most of negative volume",
        ],
        lines,
    );
}

fn parts(text: &mut String, budget: &Budget) {
    let parts = budget.scenes.first().map_or(&[][..], |scene| &scene.parts);
    for part in parts {
        let _ = write!(text, "## {}: {}\n\n", capital(part.name), part.unit);
        if part.key == "inertia" {
            *text += "More inertia and less stiffness keep all frequencies below this share of that of the usual node. Below 1 tissue also \
                      has internal viscosity, so the step from there to more changes more than inertia.\n\n";
        }
        if part.key == "lattice" {
            *text += "A finer lattice also has a slightly different shape: a coarse one cuts the corners of the urethra's wall. `before` is the \
                      distance of the surfaces before anything touched them. If the error is proportional to the angle, that of 14 \
                      degrees is 14/9 of its distance from 5 degrees.\n\n![error of the lattice](budget_lattice.svg)\n\n";
        }
        let mut lines = Vec::new();
        for scene in &budget.scenes {
            let runs = scene
                .parts
                .iter()
                .filter(|other| other.key == part.key)
                .flat_map(|part| &part.runs);
            for run in runs {
                let mut line = vec![format!("`{}`", scene.key), run.setting.clone()];
                if part.key == "lattice" {
                    let before = run.by_look.first().copied().flatten();
                    line.push(before.map_or(String::new(), |before| plain(before.rms_mm)));
                }
                line.extend(errors(run));
                lines.push(line);
            }
        }
        let before: &[&str] = if part.key == "lattice" {
            &["before, mm RMS"]
        } else {
            &[]
        };
        let heads = [&["scene", "setting"][..], before, &ERRORS].concat();
        *text += &table(&heads, lines);
    }
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
