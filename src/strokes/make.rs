//! A stroke made by the hands of a player, and the chip that it cuts out.

use std::sync::Arc;

use bevy::prelude::*;
use resecta_instrument::{InstrumentSource, InstrumentState, LoopPose, Resectoscope};
use resecta_scenario::{Library, headless, metrics::StepObservation};
use resecta_tissue::{Chip, Tissue, TissueChip, TissueDiagnostics, TissueResected};

use super::{
    catalogue::StandardStroke,
    measure::{self, Trough},
    surface::{TissueSurface, View},
};
use crate::{measured::MeasuredError, players};

/// The exercise whose settings all strokes share: dry, and with nothing that ends a run early.
const EXERCISE: &str = "first_cuts";
/// Steps after the last current until the trough is looked at: the loop comes in, and tissue that it dragged comes back; chips are made by
/// then.
const RESTING_STEPS: usize = 30;
/// How far the loop is out when the tissue is looked at as it was before: it is not lowered yet, mm.
const OUT_MM: f32 = 1.0;
/// No set of strokes takes as many steps.
const MOST_STEPS: usize = 60 * 60;

/// What a stroke left.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Stroked {
    /// The gland's name among the shipped cases.
    pub case: String,
    /// What held the lumen open, cmH2O.
    pub pressure_cmh2o: f64,
    /// The stroke's name.
    pub stroke: &'static str,
    /// Whether nothing was cut before it.
    pub is_first: bool,
    /// Its trough, seen from the organ: the bed's motion since the wire passed is not in it.
    pub trough: Trough,
    /// Its trough as it lies in space when the stroke is over.
    pub trough_in_space: Trough,
    /// Its chip.
    pub chip: ChipSize,
    /// Most pentahedra inside out in a step, those strokes before it included.
    pub most_inverted: usize,
    /// How deep tissue lay in the sheath at most, mm, those strokes before it included.
    pub overlap_mm: f32,
}

/// A chip and what it left out. Volumes at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct ChipSize {
    /// What the gland lost by the stroke, mm³.
    pub missing_mm3: f64,
    /// What of that tore off, mm³.
    pub torn_mm3: f64,
    /// What of that vaporised, mm³.
    pub vaporised_mm3: f64,
    /// What of that was thin tissue beside the wall, mm³.
    pub thin_mm3: f64,
    /// The largest chip of it, mm³.
    pub chip_mm3: f64,
    /// Its mass, g.
    pub mass_g: f64,
    /// Its length along the stroke, mm.
    pub length_mm: f64,
    /// Its width across, mm.
    pub width_mm: f64,
    /// Chips of the stroke, crumbs included.
    pub chips: usize,
}

impl ChipSize {
    /// Share of the largest chip in what did not vaporise, 0 to 1.
    pub fn share(&self) -> f64 {
        self.chip_mm3 / (self.missing_mm3 - self.vaporised_mm3)
    }

    /// Takes in the chips of a stroke.
    fn take(&mut self, chips: &[Arc<Chip>], density_g_per_mm3: f64, middle: LoopPose) {
        self.chips = chips.len();
        self.vaporised_mm3 = chips.iter().map(|chip| chip.vaporised_mm3).sum();
        self.thin_mm3 = chips.iter().map(|chip| chip.thin_mm3).sum();
        let Some(largest) = (chips.iter()).max_by(|a, b| a.rest_volume_mm3.total_cmp(&b.rest_volume_mm3)) else {
            return;
        };
        let extent = |axis: Vec3| {
            let along = largest.vertices.iter().map(|vertex| vertex.dot(axis));
            let (low, high) = along.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)));
            f64::from(high - low).max(0.0)
        };
        self.chip_mm3 = largest.rest_volume_mm3;
        self.mass_g = largest.rest_volume_mm3 * density_g_per_mm3;
        self.length_mm = extent(middle.travel);
        self.width_mm = extent(middle.travel.cross(middle.down));
    }
}

/// The surface before a stroke and the wire's path, both in one frame.
struct Seen {
    from: View,
    /// The tissue's surface before it.
    before: Option<TissueSurface>,
    /// The loop's poses where it cut.
    path: Vec<LoopPose>,
}

impl Seen {
    fn from(from: View) -> Self {
        Self {
            from,
            before: None,
            path: Vec::new(),
        }
    }

    /// Looks at the tissue once the stroke begins, and at the loop where it cuts.
    fn look(&mut self, tissue: &Tissue, begins: bool, cutting: Option<LoopPose>) {
        if begins && self.before.is_none() {
            self.before = TissueSurface::of(tissue, self.from);
        }
        self.path.extend(cutting.map(|pose| self.from.pose(tissue, pose)));
    }

    /// The trough, compared with the path. `None` if the loop met no tissue.
    fn trough(&self, tissue: &Tissue, size_mm: [f32; 2]) -> Option<Trough> {
        let surface = TissueSurface::of(tissue, self.from)?;
        let before = self.before.as_ref().filter(|_| !self.path.is_empty())?;
        Some(measure::trough(before, &surface, &self.path, size_mm))
    }
}

/// Makes a standard stroke on a gland that the library ships, the lumen held open by a pressure, cmH2O. `None` if the loop met no tissue.
///
/// # Errors
///
/// [`MeasuredError`] when the exercise or the case cannot be loaded.
pub fn stroke(
    library: &Library,
    case: &str,
    standard: &StandardStroke,
    pressure_cmh2o: f64,
) -> Result<Option<Stroked>, MeasuredError> {
    let mut loaded = library.load(EXERCISE)?.on_case(case, library.load_case(case)?);
    loaded.exercise.models.water_pressure_cmh2o = Some(pressure_cmh2o);
    loaded.exercise.goals.clear();
    let prepared = loaded.prepare()?;
    let density = prepared.material.density_g_per_mm3;
    let mut app = headless::app(None);
    app.add_plugins(players::PlayersPlugin);
    headless::finish_plugins(&mut app);
    app.update();
    let active = headless::start(&mut app, prepared, InstrumentSource::Requests);
    players::seat_for_strokes(app.world_mut(), standard.strokes.clone());

    let mut resected = app.world().resource::<Messages<TissueResected>>().get_cursor();
    let mut chipped = app.world().resource::<Messages<TissueChip>>().get_cursor();
    let mut seen = [View::Organ, View::Space].map(Seen::from);
    let (mut chips, mut chip) = (Vec::new(), ChipSize::default());
    let (mut most_inverted, mut overlap_mm) = (0, 0.0_f32);
    let mut steps_after = 0;
    for _ in 0..MOST_STEPS {
        app.update();
        let world = app.world();
        let number = players::stroke_number(world);
        let Some((state, scope)) =
            (world.get::<InstrumentState>(active.instrument)).zip(world.get::<Resectoscope>(active.instrument))
        else {
            break;
        };
        let is_last = number + 1 == standard.strokes.len();
        let cuts_last = is_last && state.cut && world.resource::<StepObservation>().loop_in_tissue;
        if let Some(tissue) = world.get::<Tissue>(active.tissue) {
            let begins = is_last && state.stroke_mm > OUT_MM;
            let cutting = cuts_last.then(|| scope.loop_pose(state));
            for seen in &mut seen {
                seen.look(tissue, begins, cutting);
            }
        }
        // Chips of the stroke before come some steps after its end.
        let is_measured = !seen[0].path.is_empty();
        for message in resected.read(world.resource()).filter(|_| is_measured) {
            chip.missing_mm3 += message.volume_mm3;
            chip.torn_mm3 += if message.tool.is_none() {
                message.volume_mm3
            } else {
                0.0
            };
        }
        chips.extend(
            chipped
                .read(world.resource())
                .filter(|_| is_measured)
                .map(|told| told.chip.clone()),
        );
        let diagnostics = world.resource::<TissueDiagnostics>();
        most_inverted = most_inverted.max(diagnostics.inverted);
        overlap_mm = overlap_mm.max(diagnostics.overlap.deepest_mm);
        steps_after += usize::from(number >= standard.strokes.len());
        if steps_after == RESTING_STEPS {
            break;
        }
    }
    let world = app.world();
    let middle = (seen[0].path).get(seen[0].path.len() / 2).copied();
    let scope = world.get::<Resectoscope>(active.instrument);
    let geometry = scope.map(|scope| scope.geometry).unwrap_or_default();
    // To the outer edge of the wire.
    let wire_mm = geometry.wire_diameter_mm;
    let size_mm = [geometry.loop_width_mm + wire_mm, geometry.loop_depth_mm + 0.5 * wire_mm];
    let left = seen.map(|seen| seen.trough(world.get(active.tissue)?, size_mm));
    let ([Some(trough), Some(trough_in_space)], Some(middle)) = (left, middle) else {
        return Ok(None);
    };
    chip.take(&chips, density, middle);
    Ok(Some(Stroked {
        case: case.into(),
        pressure_cmh2o,
        stroke: standard.name,
        is_first: standard.is_first,
        trough,
        trough_in_space,
        chip,
        most_inverted,
        overlap_mm,
    }))
}
