//! What happened to the exercise's tissue and instrument in one fixed step, gathered once for all who measure.

use bevy::prelude::*;
use resecta_instrument::InstrumentState;
use resecta_solver::NodeKind;
use resecta_tissue::{Overlap, TissueContact, TissueResected, ToolPartKind};

use super::{ChipMasses, WaterStep};
use crate::{region::MarkedRegion, sight::LandmarkObservation};

/// One fixed step of a run, rewritten every step.
#[derive(Resource, Debug, Clone, PartialEq, Default)]
pub struct StepObservation {
    /// Length of the step, s.
    pub step_s: f64,
    /// The instrument at the end of the step.
    pub instrument: InstrumentState,
    /// The middle of the sheath's tip at the end of the step, mm.
    pub tip: Vec3,
    /// Triangles that the instrument touched.
    pub contacts: u32,
    /// Deepest overlap among the contacts, mm; 0 without contacts.
    pub largest_depth_mm: f64,
    /// Force of the tissue on the instrument, N: mean over the step.
    pub force_n: f64,
    /// On the part of it, a diameter long, that is pressed hardest: N.
    pub patch_force_n: f64,
    /// How much tissue lay inside the instrument when the step began.
    pub overlap: Overlap,
    /// Pentahedra without volume or turned inside out.
    pub inverted: u32,
    /// How often the instrument was pushed through tissue.
    pub false_passages: u32,
    /// Whether the loop touched tissue or removed some.
    pub loop_in_tissue: bool,
    /// Whether current flowed through the loop into tissue that it touched or removed. One that is drawn in delivers none.
    pub current_in_tissue: bool,
    /// Whether the loop touched or cut the capsule while current flowed.
    pub current_on_capsule: bool,
    /// Whether the loop touched or cut tissue below the verumontanum while current flowed.
    pub current_below_verumontanum: bool,
    /// Whether the coagulating loop touched tissue within reach of a vessel that bled until then.
    pub coagulates_vessel: bool,
    /// Volume at rest removed, mm³, by zone (`Zone::index`).
    pub removed_by_zone_mm3: [f64; resecta_anatomy::Zone::COUNT],
    /// The same, all zones together.
    pub removed_mm3: f64,
    /// Of it, inside the marked region.
    pub marked_removed_mm3: f64,
    /// What vaporised of the strokes whose chips were made in this step, mm³ at rest. They were removed some steps before.
    pub vaporised_mm3: f64,
    /// Area of capsule removed, mm².
    pub capsule_cut_mm2: f64,
    /// The landmark that the present step is about; none in a step about none.
    pub landmark: Option<LandmarkObservation>,
    /// The way from the loop's wire to the nearest middle of a marked pentahedron that is left, mm: right, up and back as the sheath
    /// is held. None in a step that counts anywhere, and where nothing marked is left.
    pub marked_way: Option<Vec3>,
    /// How far the lens sees where it sees furthest, mm, 45 at most. None in a step that counts for the blind, too.
    pub sees_mm: Option<f64>,
    /// Whether tissue less than 4 mm from the lens hides most of what it looks at, when this was last measured: each tenth of a second.
    pub is_hidden: bool,
    /// Blood and water.
    pub water: WaterStep,
    /// Where the cut tissue is, where it floats.
    pub chips: ChipMasses,
}

impl StepObservation {
    /// A step in which nothing was touched.
    pub fn idle(step_s: f64, instrument: InstrumentState, tip: Vec3) -> Self {
        Self {
            step_s,
            instrument,
            tip,
            ..default()
        }
    }

    /// Whether any current flows.
    pub fn current(&self) -> bool {
        self.instrument.cut || self.instrument.coagulate
    }

    /// Adds a contact of the exercise's instrument with its tissue, of which `distal` lies below the verumontanum.
    pub fn add_contact(&mut self, contact: &TissueContact, distal: &MarkedRegion) {
        self.contacts += 1;
        self.largest_depth_mm = self.largest_depth_mm.max(f64::from(contact.depth_mm));
        if contact.part == ToolPartKind::Loop {
            self.loop_in_tissue = true;
            self.current_in_tissue |= contact.current;
            self.current_on_capsule |= contact.current && contact.kind == NodeKind::Capsule;
            self.current_below_verumontanum |= contact.current && distal.contains(contact.pentahedron);
        }
    }

    /// Adds a resection of the exercise's tissue. `by_loop` says whether the exercise's instrument made it; tissue that
    /// some other system removed counts as removed, but not as the player's touch. Of the tissue `distal` lies below the
    /// verumontanum.
    pub fn add_resection(
        &mut self,
        resection: &TissueResected,
        marked: &MarkedRegion,
        distal: &MarkedRegion,
        by_loop: bool,
    ) {
        self.removed_mm3 += resection.volume_mm3;
        for (sum, volume) in self.removed_by_zone_mm3.iter_mut().zip(resection.by_zone_mm3) {
            *sum += volume;
        }
        let of_marked = resection.taken_mm3.iter().filter(|(index, _)| marked.contains(*index));
        self.marked_removed_mm3 += of_marked.map(|(_, volume)| volume).sum::<f64>();
        self.capsule_cut_mm2 += resection.capsule_area_mm2;
        if by_loop {
            (self.loop_in_tissue, self.current_in_tissue) = (true, true);
            self.current_on_capsule |= resection.capsule_area_mm2 > 0.0;
            self.current_below_verumontanum |= (resection.taken_mm3.iter()).any(|&(index, _)| distal.contains(index));
        }
    }
}
