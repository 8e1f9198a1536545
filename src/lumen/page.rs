//! `lumen.md`: how far water opens the lumen, and what the lens then sees.

use std::path::Path;

use resecta_methods::{Chart, Series, plain, table};
use resecta_scenario::Library;

use crate::measured::{MeasuredError, write_page};

use super::{
    opening::{Opening, openings},
    way::{Look, Sights, sights},
};

/// The gland that is looked at.
const CASE: &str = "medium";
/// Pressures that open its lumen, cmH2O: the first is none, from which the closed form starts.
const PRESSURES_CMH2O: [f64; 7] = [0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 60.0];
/// How far the taps are open: both, and with the inflow closed.
const TAPS: [[f32; 2]; 2] = [[1.0, 1.0], [0.0, 1.0]];

/// What was measured.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Lumen {
    /// By pressure.
    pub openings: Vec<Opening>,
    /// By taps.
    pub sights: Vec<Sights>,
}

/// Opens the lumen of the medium gland and looks along it, and writes `lumen.md`, its chart and `lumen.json` into a folder.
///
/// # Errors
///
/// [`MeasuredError`] names the file.
pub fn write_lumen(library: &Library, out: &Path) -> Result<Lumen, MeasuredError> {
    let openings = openings(library, CASE, &PRESSURES_CMH2O)?;
    let sights: Result<_, _> = TAPS.into_iter().map(|taps| sights(library, taps)).collect();
    let lumen = Lumen {
        openings,
        sights: sights?,
    };
    write_page(out, "lumen", page(&lumen), &lumen)?;
    chart(&lumen.openings).draw(&out.join("lumen.svg"))?;
    Ok(lumen)
}

/// The axes are logarithmic: no pressure is not shown.
fn chart(openings: &[Opening]) -> Chart {
    let series = |name: &str, area: fn(&Opening) -> f64| Series {
        name: name.into(),
        points: (openings.iter().filter(|opening| opening.pressure_cmh2o > 0.0))
            .map(|opening| (opening.pressure_cmh2o, area(opening)))
            .collect(),
    };
    Chart {
        caption: "Area of the lumen between verumontanum and bladder neck".into(),
        axes: ["pressure, cmH2O", "area, mm²"],
        marks: PRESSURES_CMH2O[1..].to_vec(),
        series: vec![
            series("gland, mean", |opening| opening.area_mm2),
            series("gland, narrowest", |opening| opening.least_mm2),
            series("round tube, closed form", |opening| opening.tube_mm2),
        ],
    }
}

fn page(lumen: &Lumen) -> String {
    let mut text = String::from(
        "# What water does to the lumen

The medium gland, uncut, with the settings of `first_cuts`: its lumen after 4 s under a pressure, the instrument out of the way. Areas
are those that the mucosa encloses in seven planes across the gland, over the middle three fifths of the way from the verumontanum to
the bladder neck. The *tube* is round, of the same material on the same bed, with the areas of lumen and gland that are measured
without pressure: Lamé's closed form, for small strains. A lumen whose lobes meet is not round: they part where a tube would have to
stretch. Tissue bears no more than some 0.4 times its modulus; what is above that does not act (`crates/resecta_fluid/src/lumen.rs`).

In men with an obstructed outlet it is the pressure that first opens the prostatic urethra that is raised, about equally along it
(Graversen et al., J Urol 155:267-270, 1996, by their abstract: we have no numbers of theirs to compare with).

![area of the lumen against pressure](lumen.svg)

",
    );
    text += &table(
        &["cmH2O", "area, mm²", "narrowest, mm²", "tube, mm²", "inside out"],
        lumen.openings.iter().map(|opening| {
            vec![
                plain(opening.pressure_cmh2o),
                format!("{:.1}", opening.area_mm2),
                format!("{:.1}", opening.least_mm2),
                format!("{:.1}", opening.tube_mm2),
                opening.inverted.to_string(),
            ]
        }),
    );
    text += "\n## What the lens sees

Ten poses on the way from the verumontanum to 8 mm below the bladder neck. The sheath goes from one to the next as in the demonstration of
`orientation`. There the tip is raised until the neck is 4 degrees within the field, and kept so for 2 s, in the water of `middle_lobe`
(60 cm of water, an empty bladder that fills). *Lumen*: the pressure there. *Neck*: whether its middle, which the gland takes along as it
gives way, is seen, hidden by tissue, or outside of the field. *Sees*: how far it is to tissue in the furthest of five directions, 45 mm at
most.

";
    for sights in &lumen.sights {
        text += &of_taps(sights);
    }
    text += "To repeat: `cargo run --release -- accuracy --only lumen`. Raw numbers: [lumen.json](lumen.json).\n";
    text
}

fn of_taps(sights: &Sights) -> String {
    let count = |is_so: fn(&Look) -> bool| sights.looks.iter().filter(|look| is_so(look)).count();
    let inflow = if sights.taps[0] > 0.0 { "open" } else { "closed" };
    let mut text = format!(
        "### Inflow {inflow}, outflow open

The neck is seen in {} of {} poses. Tissue less than 4 mm from the lens hides most of the picture in {}. Pressure in the bladder at the end: {:.1} cmH2O.

",
        count(|look| look.neck == "seen"),
        sights.looks.len(),
        count(|look| look.is_hidden),
        sights.bladder_cmh2o,
    );
    text += &table(
        &["insertion, mm", "pitch, °", "lumen, cmH2O", "neck", "sees, mm"],
        sights.looks.iter().map(|look| {
            vec![
                format!("{:.0}", look.insertion_mm),
                format!("{:.1}", look.pitch_deg),
                format!("{:.1}", look.pressure_cmh2o),
                look.neck.into(),
                format!("{:.1}", look.sees_mm),
            ]
        }),
    );
    text + "\n"
}
