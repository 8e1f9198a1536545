//! What to cut, in which order, from a case's slices and landmarks.

use std::f64::consts::TAU;

use bevy::math::{DVec2, DVec3};
use resecta_anatomy::{Case, Slice};
use resecta_scenario::Marked;

/// How a player operates. Lengths mm, times s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manner {
    /// How much deeper each layer goes than the one before.
    pub layer_mm: f64,
    /// Distance between neighbouring strokes at the bottom of a layer.
    pub beside_mm: f64,
    /// How far the strokes stay inside the adenoma's outline; negative goes past it.
    pub inside_adenoma_mm: f64,
    /// How far they stay inside the capsule; negative goes through it.
    pub inside_capsule_mm: f64,
    /// How far above the verumontanum they end, by sector; negative is below. Tissue of the sphincter is drawn along everywhere
    /// but beside the mound, furthest in front.
    pub above_verumontanum_mm: [f64; SECTORS.len()],
    /// How near to the capsule, as the game tells it, the wire is when the foot leaves the pedal; none where nobody minds.
    pub lets_go_at_capsule_mm: Option<f32>,
    /// How far above the verumontanum tissue has to have lain at rest for current to meet it, mm; none where nobody minds.
    pub lets_go_above_verumontanum_mm: Option<f32>,
    /// Whether strokes keep to the heights and the depth that the exercise marks, and to exercises that ask for tissue.
    pub keeps_to_marks: bool,
    /// How many sectors of the gland are operated, of four: the front comes last.
    pub sectors: usize,
    /// How often all of it is gone through: what is finished is cut again in every round but the first.
    pub rounds: u32,
    /// Whether what strokes left at the end of their layers is cut off in the end, once around.
    pub trims: bool,
    /// Speed of a pull, mm/s.
    pub pull_mm_per_s: f32,
    /// Speed of everything else, as a share of what the instrument allows.
    pub haste: f32,
    /// Whether strokes go where the tissue that is to be cut has moved, or where it lay at rest.
    pub follows_tissue: bool,
    /// Whether the sheath is brought along the lumen, or straight to where it is wanted.
    pub follows_lumen: bool,
    /// How far the loop is left out while it is brought somewhere, mm: one that is drawn in delivers no current.
    pub carried_out_mm: f32,
    /// Whether the pedal goes down only in tissue, or on the whole way.
    pub current_in_tissue: bool,
    /// Whether bleeders are closed.
    pub coagulates: bool,
    /// Whether taps follow the pressure and the view, and whether to wait for a clear one.
    pub minds_water: bool,
}

impl Manner {
    pub(super) fn careful() -> Self {
        Self {
            layer_mm: 3.8,
            beside_mm: 4.5,
            inside_adenoma_mm: -1.5,
            inside_capsule_mm: 1.5,
            above_verumontanum_mm: [2.0, 4.0, 4.0, 6.0],
            lets_go_at_capsule_mm: Some(0.5),
            lets_go_above_verumontanum_mm: Some(1.5),
            keeps_to_marks: true,
            sectors: 4,
            rounds: 1,
            trims: true,
            pull_mm_per_s: 30.0,
            haste: 0.6,
            follows_tissue: true,
            follows_lumen: true,
            carried_out_mm: 0.0,
            current_in_tissue: true,
            coagulates: true,
            minds_water: true,
        }
    }

    pub(super) fn careless() -> Self {
        Self {
            layer_mm: 7.0,
            beside_mm: 14.0,
            inside_adenoma_mm: -4.0,
            inside_capsule_mm: -3.0,
            above_verumontanum_mm: [-5.0; SECTORS.len()],
            lets_go_at_capsule_mm: None,
            lets_go_above_verumontanum_mm: None,
            keeps_to_marks: false,
            sectors: 3,
            rounds: 2,
            trims: false,
            pull_mm_per_s: 30.0,
            haste: 0.7,
            follows_tissue: false,
            follows_lumen: false,
            carried_out_mm: 3.0,
            current_in_tissue: false,
            coagulates: false,
            minds_water: false,
        }
    }
}

/// A stroke: the way of the loop's deepest point, from the bladder's side to the operator's.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// Hour on the clock face.
    pub hour: f64,
    /// Places, each further out than the one before it.
    pub way: Vec<DVec3>,
}

/// Sectors of the clock in the order of an operation, each with the hour that it begins and the one that it ends at: the middle
/// lobe, then either side downwards, then the front.
const SECTORS: [(f64, f64); 4] = [(5.0, 7.0), (1.5, 5.0), (10.5, 7.0), (10.5, 13.5)];
/// Longest way of one stroke: less than the loop's.
const LONGEST_MM: f64 = 26.0;
/// Shortest that is worth one.
const SHORTEST_MM: f64 = 4.0;
/// Distance between places on a way.
const STEP_MM: f64 = 1.0;

/// Unit vector of an hour in the transverse plane: 12 is anterior (-y), 3 the patient's left (+x).
pub(crate) fn towards(hour: f64) -> DVec2 {
    let angle = hour / 12.0 * TAU;
    DVec2::new(angle.sin(), -angle.cos())
}

/// What a case's slices say at a height.
pub(crate) struct Outlines<'a> {
    case: &'a Case,
}

impl<'a> Outlines<'a> {
    pub fn new(case: &'a Case) -> Self {
        Self { case }
    }

    /// Middle of the urethra.
    pub fn centre(&self, z: f64) -> DVec2 {
        self.mix(z, middle)
    }

    /// Distance from the middle of the urethra to its wall, to the adenoma's outline and to the capsule, towards an hour.
    pub fn radii(&self, z: f64, hour: f64) -> [f64; 3] {
        let radii = |slice: &Slice| {
            let from = middle(slice);
            let to = |contour: &[DVec2]| radius(contour, from, towards(hour));
            let capsule = to(&slice.capsule);
            let urethra = slice.urethra.as_deref().map_or(0.0, to);
            // A slice without adenoma has nothing to cut.
            let adenoma = slice.transition_zone.as_deref().map_or(urethra, to);
            DVec3::new(urethra, adenoma, capsule)
        };
        self.mix(z, radii).to_array()
    }

    fn mix<T: std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>>(
        &self,
        z: f64,
        of: impl Fn(&Slice) -> T,
    ) -> T {
        let slices = &self.case.slices;
        let upper = slices
            .partition_point(|slice| slice.z <= z)
            .clamp(1, slices.len().max(2) - 1);
        let (below, above) = (&slices[upper - 1], &slices[upper.min(slices.len() - 1)]);
        let share = ((z - below.z) / (above.z - below.z)).clamp(0.0, 1.0);
        let share = if share.is_finite() { share } else { 0.0 };
        of(below) * (1.0 - share) + of(above) * share
    }
}

fn middle(slice: &Slice) -> DVec2 {
    let contour = slice.urethra.as_ref().unwrap_or(&slice.capsule);
    contour.iter().sum::<DVec2>() / contour.len().max(1) as f64
}

/// How far a ray from inside of a contour goes to it; 0 where it never does.
fn radius(contour: &[DVec2], from: DVec2, ray: DVec2) -> f64 {
    let next = contour.iter().cycle().skip(1);
    let crossing = |(&a, &b): (&DVec2, &DVec2)| {
        let (a, b) = (a - from, b - from);
        let (before, after) = (ray.perp_dot(a), ray.perp_dot(b));
        let along = a.lerp(b, before / (before - after)).dot(ray);
        ((before <= 0.0) != (after <= 0.0) && along > 0.0).then_some(along)
    };
    contour.iter().zip(next).filter_map(crossing).fold(0.0, f64::max)
}

/// All strokes of an operation on what an exercise marks, in order, each with the number of its sector; of those that trim, one
/// more than there are sectors.
pub(super) fn strokes(case: &Case, marked: &Marked, manner: &Manner) -> Vec<(usize, Stroke)> {
    let Some(verumontanum) = case.landmarks.verumontanum.filter(|_| case.slices.len() > 1) else {
        return Vec::new();
    };
    let outlines = Outlines::new(case);
    let top_z = case.slices.last().map_or(verumontanum.z, |slice| slice.z);
    let mut strokes = Vec::new();
    let mut add = |sector: usize, number: usize, layer: Layer| {
        let heights = [verumontanum.z + manner.above_verumontanum_mm[sector], top_z];
        let of_layer = of_layer(&outlines, marked, manner, SECTORS[sector], layer, heights);
        let any = !of_layer.is_empty();
        strokes.extend(of_layer.into_iter().map(|stroke| (number, stroke)));
        any
    };
    for sector in 0..manner.sectors {
        for layer in 1..20 {
            if !add(sector, sector, Layer::Number(layer)) {
                break;
            }
        }
    }
    if manner.trims {
        for sector in 0..manner.sectors {
            add(sector, SECTORS.len(), Layer::Deepest);
        }
    }
    strokes
}

/// How deep strokes go.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Layer {
    /// So many layers below the wall of the urethra, where that is new.
    Number(u32),
    /// As deep as the manner allows, everywhere.
    Deepest,
}

/// The strokes of a layer in a sector (hours that it begins and ends at), between two heights.
fn of_layer(
    outlines: &Outlines,
    marked: &Marked,
    manner: &Manner,
    (begin, end): (f64, f64),
    layer: Layer,
    heights: [f64; 2],
) -> Vec<Stroke> {
    let mut strokes = Vec::new();
    let mut hour = begin;
    while (hour - begin).abs() <= (end - begin).abs() + 1e-9 {
        let clock = hour % 12.0;
        let is_marked = marked.clock.is_none_or(|range| range.contains(clock));
        let (ways, widest_mm) = match is_marked {
            true => ways(outlines, marked, manner, clock, layer, heights),
            false => {
                let [urethra, adenoma, _] = outlines.radii(0.5 * (heights[0] + heights[1]), clock);
                let radius = match layer {
                    Layer::Number(layer) => urethra + f64::from(layer) * manner.layer_mm,
                    Layer::Deepest => adenoma,
                };
                (Vec::new(), radius)
            }
        };
        strokes.extend(ways.into_iter().map(|way| Stroke { hour: clock, way }));
        let apart = manner.beside_mm / widest_mm.max(manner.beside_mm) * 12.0 / TAU;
        hour += apart * (end - begin).signum();
    }
    strokes
}

/// The ways of a layer towards an hour, none longer than a stroke, and the largest radius among them.
fn ways(
    outlines: &Outlines,
    marked: &Marked,
    manner: &Manner,
    hour: f64,
    layer: Layer,
    [bottom, top]: [f64; 2],
) -> (Vec<Vec<DVec3>>, f64) {
    let mut ways = vec![Vec::new()];
    let mut widest_mm: f64 = 0.0;
    let mut z = top;
    while z >= bottom {
        let [urethra, adenoma, capsule] = outlines.radii(z, hour);
        let most = (adenoma - manner.inside_adenoma_mm).min(capsule - manner.inside_capsule_mm);
        // No deeper than what is marked, and nowhere above or below it.
        let is_marked = (marked.height).is_none_or(|height| height.contains(z, &outlines.case.landmarks));
        let deepest = marked.depth_mm.map_or(f64::INFINITY, |depth| urethra + depth.to);
        let most = match manner.keeps_to_marks {
            true if is_marked => most.min(deepest),
            true => 0.0,
            false => most,
        };
        let (before, there) = match layer {
            Layer::Number(layer) => {
                let depth_mm = f64::from(layer) * manner.layer_mm;
                (urethra + depth_mm - manner.layer_mm, (urethra + depth_mm).min(most))
            }
            Layer::Deepest => (urethra, most),
        };
        let way = ways.last_mut().expect("never empty");
        // Nothing new to reach here: the layer before went as far.
        if there < before + 0.2 * manner.layer_mm {
            if !way.is_empty() {
                ways.push(Vec::new());
            }
        } else {
            widest_mm = widest_mm.max(there);
            way.push((outlines.centre(z) + towards(hour) * there).extend(z));
            if way.len() as f64 * STEP_MM >= LONGEST_MM {
                ways.push(Vec::new());
            }
        }
        z -= STEP_MM;
    }
    ways.retain(|way| way.len() as f64 * STEP_MM >= SHORTEST_MM);
    (ways, widest_mm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_anatomy::Zone;
    use resecta_scenario::{ClockRange, HeightRange, Range};

    fn medium() -> Case {
        let file = crate::assets::find().unwrap().join("cases/medium.case.ron");
        Case::load(&file).unwrap()
    }

    fn adenoma() -> Marked {
        Marked {
            zones: vec![Zone::LateralLobe, Zone::MiddleLobe],
            clock: None,
            height: None,
            depth_mm: None,
            dyed: false,
        }
    }

    /// The least height of all ways, and the least distance by which they stay inside the capsule.
    fn nearest(case: &Case, manner: &Manner) -> (f64, f64) {
        let outlines = Outlines::new(case);
        let plan = strokes(case, &adenoma(), manner);
        assert!(plan.len() > 20, "{} strokes", plan.len());
        let mut nearest = (f64::INFINITY, f64::INFINITY);
        for (_, stroke) in &plan {
            for place in &stroke.way {
                let [_, _, capsule] = outlines.radii(place.z, stroke.hour);
                let radius = place.truncate().distance(outlines.centre(place.z));
                nearest = (nearest.0.min(place.z), nearest.1.min(capsule - radius));
            }
        }
        nearest
    }

    #[test]
    fn only_the_careful_stay_above_the_verumontanum_and_inside_the_capsule() {
        let case = medium();
        let verumontanum_z = case.landmarks.verumontanum.unwrap().z;
        let (lowest, inside_mm) = nearest(&case, &Manner::careful());
        assert!(
            lowest >= verumontanum_z + 1.0 && inside_mm > Manner::careful().inside_capsule_mm - 0.1,
            "{lowest}, {inside_mm}"
        );
        let (lowest, inside_mm) = nearest(&case, &Manner::careless());
        assert!(lowest < verumontanum_z && inside_mm < 0.0, "{lowest}, {inside_mm}");
    }

    #[test]
    fn strokes_of_each_sector_end_as_far_from_the_sphincter_as_the_manner_says() {
        let (case, manner) = (medium(), Manner::careful());
        let verumontanum_z = case.landmarks.verumontanum.unwrap().z;
        let plan = strokes(&case, &adenoma(), &manner);
        for (sector, above_mm) in manner.above_verumontanum_mm.into_iter().enumerate() {
            let strokes = plan.iter().filter(|(of, _)| *of == sector);
            let ends = strokes.filter_map(|(_, stroke)| Some(stroke.way.last()?.z - verumontanum_z));
            let lowest_mm = ends.fold(f64::INFINITY, f64::min);
            assert!(
                (above_mm..above_mm + STEP_MM).contains(&lowest_mm),
                "sector {sector}: {lowest_mm} for {above_mm}"
            );
        }
    }

    #[test]
    fn who_trims_goes_once_around_as_deep_as_the_layers_went_and_no_lower() {
        let (case, manner) = (medium(), Manner::careful());
        let outlines = Outlines::new(&case);
        let verumontanum_z = case.landmarks.verumontanum.unwrap().z;
        let plan = strokes(&case, &adenoma(), &manner);
        let (layers, trims): (Vec<_>, Vec<_>) = plan.iter().partition(|(sector, _)| *sector < SECTORS.len());
        assert!(
            20 < trims.len() && trims.len() < layers.len(),
            "{} and {}",
            trims.len(),
            layers.len()
        );
        let least_mm = manner.above_verumontanum_mm.into_iter().fold(f64::INFINITY, f64::min);
        let places = |strokes: &[&(usize, Stroke)]| {
            let mut places = Vec::new();
            for (_, stroke) in strokes {
                places.extend(stroke.way.iter().map(|place| (stroke.hour, *place)));
            }
            places
        };
        let most = |(hour, place): (f64, DVec3)| {
            let [_, adenoma, capsule] = outlines.radii(place.z, hour);
            (adenoma - manner.inside_adenoma_mm).min(capsule - manner.inside_capsule_mm)
        };
        let radius = |place: DVec3| place.truncate().distance(outlines.centre(place.z));
        for (hour, place) in places(&trims) {
            assert!((radius(place) - most((hour, place))).abs() < 1e-9);
            assert!(place.z >= verumontanum_z + least_mm);
        }
        assert!(
            places(&layers)
                .into_iter()
                .all(|(hour, place)| radius(place) <= most((hour, place)) + 1e-9)
        );
        let hasty = Manner { trims: false, ..manner };
        assert_eq!(strokes(&case, &adenoma(), &hasty).len(), layers.len());
    }

    #[test]
    fn only_what_is_marked_is_cut() {
        let case = medium();
        let marked = Marked {
            clock: Some(ClockRange { from: 1.0, to: 4.0 }),
            height: Some(HeightRange::AboveVerumontanum {
                from_mm: 5.0,
                to_mm: 30.0,
            }),
            depth_mm: Some(Range { from: 0.0, to: 9.0 }),
            ..adenoma()
        };
        let plan = strokes(&case, &marked, &Manner::careful());
        assert!(plan.len() > 4, "{} strokes", plan.len());
        let outlines = Outlines::new(&case);
        let verumontanum_z = case.landmarks.verumontanum.unwrap().z;
        for (_, stroke) in &plan {
            assert!((1.0..4.0).contains(&stroke.hour));
            for place in &stroke.way {
                assert!((5.0..30.0).contains(&(place.z - verumontanum_z)));
                let [urethra, ..] = outlines.radii(place.z, stroke.hour);
                assert!(place.truncate().distance(outlines.centre(place.z)) <= urethra + 9.0 + 1e-9);
            }
        }
    }

    #[test]
    fn the_middle_lobe_comes_first_and_the_front_last() {
        let plan = strokes(&medium(), &adenoma(), &Manner::careful());
        assert_eq!(plan[0].1.hour, 5.0);
        assert!(plan.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        let last = &plan.last().unwrap().1;
        assert!(last.hour > 10.0 || last.hour < 2.0, "{}", last.hour);
        assert!(
            plan.iter()
                .all(|(_, stroke)| stroke.way.first().unwrap().z > stroke.way.last().unwrap().z)
        );
    }
}
