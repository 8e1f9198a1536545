//! `strokes.md`: what the standard strokes left on the shipped glands.

use std::path::Path;

use resecta_methods::{plain, table};
use resecta_scenario::Library;

use crate::measured::{MeasuredError, write_page};

use super::{Stroked, THIN_MM, Trough, standard_strokes, stroke};

/// The shipped glands that are cut.
const CASES: [&str; 3] = ["small", "medium", "large"];
/// What holds the lumen open, cmH2O: nothing, and about what a running bag gives at the tip.
const PRESSURES_CMH2O: [f64; 2] = [0.0, 10.0];

/// Makes all standard strokes on the shipped glands, and writes `strokes.md` and `strokes.json` into a folder. `progress` is told how
/// many are done, of how many, and what comes next.
///
/// # Errors
///
/// [`MeasuredError`] names the file.
pub fn write_strokes(
    library: &Library,
    out: &Path,
    mut progress: impl FnMut(usize, usize, &str),
) -> Result<Vec<Stroked>, MeasuredError> {
    let mut wanted = Vec::new();
    for pressure in PRESSURES_CMH2O {
        for case in CASES {
            let strokes = standard_strokes(&library.load_case(case)?);
            wanted.extend(strokes.into_iter().map(|stroke| (pressure, case, stroke)));
        }
    }
    let (mut done, mut missed) = (Vec::new(), Vec::new());
    for (number, (pressure, case, standard)) in wanted.iter().enumerate() {
        progress(number, wanted.len(), standard.name);
        match stroke(library, case, standard, *pressure)? {
            Some(stroked) => done.push(stroked),
            None => missed.push(format!("{case}, {pressure} cmH2O: {}", standard.name)),
        }
    }
    write_page(out, "strokes", page(&done, &missed), &done)?;
    Ok(done)
}

fn introduction() -> String {
    format!(
        "# What a stroke leaves

Twelve standard strokes of the loop on each shipped gland, made by the hands of the careful player: 30 mm/s, the loop's deepest point
3.8 mm below the wall of the urethra, 24 mm long where the gland is. The settings are those of `first_cuts`, dry and with 10 cmH2O of
water. Half a second after the current the trough is looked at, the instrument in place and tissue as it lies then. Water opens it: what it is
deeper and wider then is how tissue lies, not how it was cut.

The sheath moves the organ as a whole by millimetres, also after the wire has passed. The wire's path and the trough are therefore compared in
the organ's frame: the motion of its bed (`Tissue::bed_moves`) is taken out of both. *In space* leaves it in.

- *deeper*, *wider*: the floor beyond the deepest point of the wire's outer edge, and the width half-way down beyond that edge; medians
  over the middle three fifths of the way, where tissue was beyond the wire before (on one side only, the width is twice what that is
  wider). The current vaporises 0.1 mm beyond the wire; *in space*: both with the motion of the bed;
- *off*: RMS distance of the floor, within 45 degrees of the deepest point, from where the wire's outer edge passed; rays that met no wall
  within 3 mm are *missed*;
- *rough*: RMS distance of that floor from the nearest quadratic surface;
- *sheets*: tissue thinner than {THIN_MM} mm within 8 mm of the way, further than 0.8 mm from all that is thicker, one side; all of it, and
  the largest piece;
- *inside out*: most elements in a step; *overlap*: how deep tissue lay in the sheath at most;
- *missing*: what the gland lost, at rest; *torn*: what of it tore off; *vapour*, *thin*: the share of it that vaporised, and of
  thin tissue in it; *chip*: the largest chip's share of what did not.

To repeat: `cargo run --release -- accuracy --only strokes`. Raw numbers: [strokes.json](strokes.json).

"
    )
}

fn page(done: &[Stroked], missed: &[String]) -> String {
    let mut text = introduction();
    for pressure in PRESSURES_CMH2O {
        let of_pressure = || done.iter().filter(move |stroked| stroked.pressure_cmh2o == pressure);
        text += &match pressure {
            0.0 => "## Dry\n\n".to_string(),
            pressure => format!("## With {pressure} cmH2O\n\n"),
        };
        text += &targets(&of_pressure().collect::<Vec<_>>());
        for case in CASES {
            let lines = of_pressure().filter(|stroked| stroked.case == case).map(line);
            text += &format!("### The {case} gland\n\n");
            text += &table(&HEADS, lines);
        }
    }
    if !missed.is_empty() {
        text += &format!("Strokes that met no tissue: {}.\n", missed.join("; "));
    }
    text.trim_end().to_string() + "\n"
}

const HEADS: [&str; 19] = [
    "stroke",
    "way, mm",
    "deeper, mm",
    "wider, mm",
    "in space, mm",
    "off, mm",
    "missed, %",
    "rough, mm",
    "sheets, mm2",
    "largest, mm2",
    "missing, mm3",
    "torn, mm3",
    "vapour, thin, %",
    "chip, %",
    "g",
    "long, wide, mm",
    "chips",
    "inside out",
    "overlap, mm",
];

fn line(stroked: &Stroked) -> Vec<String> {
    let Stroked {
        stroke,
        trough,
        trough_in_space: in_space,
        chip,
        ..
    } = stroked;
    let share = |mm3: f64| 100.0 * mm3 / chip.missing_mm3;
    vec![
        (*stroke).into(),
        plain(trough.length_mm),
        signed(trough.deeper_mm),
        signed(trough.wider_mm),
        format!("{}, {}", signed(in_space.deeper_mm), signed(in_space.wider_mm)),
        format!("{:.2}", trough.off_mm),
        format!("{:.0}", 100.0 * trough.missed),
        format!("{:.2}", trough.roughness_mm),
        format!("{:.1}", trough.sheets_mm2),
        format!("{:.1}", trough.largest_sheet_mm2),
        format!("{:.0}", chip.missing_mm3),
        format!("{:.0}", chip.torn_mm3),
        format!("{:.0}, {:.0}", share(chip.vaporised_mm3), share(chip.thin_mm3)),
        format!("{:.0}", 100.0 * chip.share()),
        format!("{:.2}", chip.mass_g),
        format!("{:.0}, {:.1}", chip.length_mm, chip.width_mm),
        chip.chips.to_string(),
        stroked.most_inverted.to_string(),
        format!("{:.2}", stroked.overlap_mm),
    ]
}

/// What could not be measured, as no ray met a wall, is a dash.
fn signed(mm: f64) -> String {
    if mm.is_finite() {
        format!("{mm:+.2}")
    } else {
        "–".into()
    }
}

fn targets(done: &[&Stroked]) -> String {
    let share = |holds: &dyn Fn(&Stroked) -> bool, of: &dyn Fn(&Stroked) -> bool| {
        let of: Vec<_> = done.iter().filter(|stroked| of(stroked)).collect();
        format!("{} of {}", of.iter().filter(|stroked| holds(stroked)).count(), of.len())
    };
    let worst = |value: &dyn Fn(&Stroked) -> f64| done.iter().map(|stroked| value(stroked)).fold(0.0, f64::max);
    let all = |_: &Stroked| true;
    let first = |stroked: &Stroked| stroked.is_first;
    let off_wire = |trough: &Trough| trough.deeper_mm.abs().max(trough.wider_mm.abs());
    let off = |stroked: &Stroked| off_wire(&stroked.trough);
    let off_in_space = |stroked: &Stroked| off_wire(&stroked.trough_in_space);
    let parted = |stroked: &Stroked| (1.0 - stroked.chip.share()).abs();
    let lines = [
        (
            "roughness of the floor",
            "0.25 mm at most",
            share(&|s| s.trough.roughness_mm <= 0.25, &all),
            format!("{:.2} mm", worst(&|s| s.trough.roughness_mm)),
        ),
        (
            "depth and width against the wire's outer edge",
            "within 0.5 mm",
            share(&|s| off(s) <= 0.5, &all),
            format!("{:.2} mm", worst(&off)),
        ),
        (
            "the same in space, where the organ moves, too",
            "within 0.5 mm",
            share(&|s| off_in_space(s) <= 0.5, &all),
            format!("{:.2} mm", worst(&off_in_space)),
        ),
        (
            "largest sheet",
            "4 mm2 at most",
            share(&|s| s.trough.largest_sheet_mm2 <= 4.0, &all),
            format!("{:.1} mm2", worst(&|s| s.trough.largest_sheet_mm2)),
        ),
        (
            "chip against what is missing and did not vaporise",
            "within 5 %",
            share(&|s| parted(s) <= 0.05, &all),
            format!("{:.0} %", 100.0 * worst(&parted)),
        ),
        (
            "mass of a full stroke's chip (through tissue that nothing cut)",
            "0.3 to 0.5 g",
            share(&|s| (0.3..=0.5).contains(&s.chip.mass_g), &first),
            String::new(),
        ),
    ];
    table(
        &["what", "target", "met by", "worst"],
        lines.map(|(what, target, met, worst)| vec![what.into(), target.into(), met, worst]),
    )
}
