//! The standard strokes leave troughs as a loop does in a patient (`resecta accuracy --only strokes` has the numbers of all glands).

use resecta::{
    assets,
    scenario::Library,
    strokes::{Stroked, standard_strokes, stroke},
};

/// The strokes of the small gland, whose urethra is the narrowest: nowhere is a loop without current pressed in harder.
fn on_the_small_gland(pressure_cmh2o: f64) -> Vec<Stroked> {
    let library = Library::new(assets::find().expect("assets"));
    let case = library.load_case("small").expect("a shipped case");
    let strokes = standard_strokes(&case);
    assert_eq!(strokes.len(), 12);
    let made = strokes.iter().map(|standard| {
        let made = stroke(&library, "small", standard, pressure_cmh2o).expect("a shipped exercise");
        made.unwrap_or_else(|| panic!("{} meets no tissue", standard.name))
    });
    made.collect()
}

/// The stroke so shallow that more than 45 % of it vaporises.
const SHALLOWEST: (f64, &str) = (10.0, "beside the first, 2.5 mm");
/// What the wire vaporises along itself, mm: its width and 0.1 mm beyond.
const KERF_MM: f64 = 0.45;
/// Half an ellipse as wide and twice as deep as the loop: the length of its wire, mm.
const WIRE_MM: f64 = 12.3;

fn is_clean(stroked: &Stroked) {
    let Stroked { trough, chip, .. } = stroked;
    let name = format!("{}: {stroked:?}", stroked.stroke);
    let is_the = |(pressure, stroke)| stroked.pressure_cmh2o == pressure && stroked.stroke == stroke;
    // The targets that a surgeon's trough is to meet.
    assert!(trough.roughness_mm <= 0.25 && trough.missed < 0.05, "{name}");
    assert!(trough.largest_sheet_mm2 <= 4.0, "{name}");
    assert!((chip.share() - 1.0).abs() <= 0.05, "{name}");
    // Beside thin tissue the wire vaporises no more than its kerf: a sixth of a full stroke and up to two fifths of a shallow one.
    let of_kerf_mm3 = chip.vaporised_mm3 - chip.thin_mm3;
    assert!(of_kerf_mm3 <= KERF_MM * WIRE_MM * trough.length_mm, "{name}");
    // Thin tissue is what a trough's two rims have of it.
    assert!(chip.thin_mm3 <= 0.05 * chip.missing_mm3, "{name}");
    let vaporised = of_kerf_mm3 / chip.missing_mm3;
    assert!(vaporised > 0.15 && (vaporised > 0.45) == is_the(SHALLOWEST), "{name}");
    // The wire takes what it sweeps: no more tears off beside it than crumbs.
    assert!(chip.torn_mm3 <= 0.1 * chip.missing_mm3, "{name}");
    // 5 of 10,000 pentahedra, of which the gland has some 7,000; never more than 1.5 mm in the steel.
    assert!(stroked.most_inverted <= 3 && stroked.overlap_mm <= 1.5, "{name}");
}

#[test]
fn strokes_leave_smooth_troughs_whole_chips_and_no_sheets() {
    on_the_small_gland(0.0).iter().for_each(is_clean);
}

#[test]
fn water_in_the_lumen_makes_them_no_worse() {
    on_the_small_gland(10.0).iter().for_each(is_clean);
}
