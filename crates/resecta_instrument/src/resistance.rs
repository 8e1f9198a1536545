//! What tissue does to the hand: it gives way, then holds the instrument, then tears.
//!
//! The force of the tissue is looked at patch by patch, each a sheath's diameter long ([`TissueLoad`]): a shaft that is levered against a
//! whole wall presses far less on any of it than a tip that is pushed into one. Where a patch bears more than [`Resectoscope::holds_n`], the instrument is
//! let no further against it than at a creep; along the wall and back it is free. Where one bears [`Resectoscope::tears_n`], the instrument
//! stays and tissue tears; [`InstrumentTore`] reports it.
//!
//! What presses on a loop and its arms holds nothing up: they bend. Nor does what the loop presses against the tip.
//!
//! A recording is not held again: it is the motion that was left after tissue had held it.

use bevy::prelude::*;
use resecta_tissue::{TissueContact, ToolPartKind};

use crate::{InstrumentState, Resectoscope, ResectoscopeGeometry};

/// How fast the instrument goes against tissue that holds it, mm/s: tissue creeps. Ours: some seconds' push becomes the force that tears.
pub const CREEP_MM_PER_S: f32 = 4.0;
/// The force on a patch that tears tissue, over that which holds the instrument. Ours: where up to 10 elements of 10,000 turn inside out.
const TEARS_AT: f32 = 1.5;
/// Time over which forces are averaged, s. Ours: a knock tears nothing.
const MEAN_S: f32 = 0.1;
/// What is pressed further ahead of the sheath's cap than this is pressed by the loop's arms, mm.
const AHEAD_MM: f32 = 0.2;
/// Patches that the tip is part of.
const OF_TIP: usize = 2;
/// A patch with a shorter lever than this share of the tip's cannot be held by it: the pivot bears what presses there.
const LEAST_LEVER: f32 = 0.3;
/// Where tissue tears, it moves aside at most so far for each millimetre away, mm. Back it may always go.
const MOST_ASIDE: f32 = 2.0;
/// How often every patch holds what others left of a way.
const PASSES: usize = 4;

/// A part of an instrument that tissue presses on.
#[derive(Reflect, Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// The force of the tissue on it, N.
    pub force_n: Vec3,
    /// Where its hardest contact is, mm.
    pub place: Vec3,
    /// The pentahedron of that contact.
    pub pentahedron: u32,
    /// The tissue of that contact.
    pub tissue: Entity,
    /// The force of that contact in the last step, N.
    hardest_n: f32,
    /// What pressed in the last step, N.
    now_n: Vec3,
}

/// With what tissue presses on an instrument, patch by patch: a mean over the last tenth of a second.
#[derive(Component, Reflect, Debug, Clone, Default, PartialEq)]
#[reflect(Component, Default)]
pub struct TissueLoad {
    /// Of the sheath, from its tip backwards. Each begins in the middle of the one before.
    pub patches: Vec<Patch>,
    /// Whether tissue tore since all patches last bore less than [`Resectoscope::holds_n`].
    pub has_torn: bool,
    /// What pressed on the loop and its arms in the last step, N.
    on_loop_n: Vec3,
}

/// An instrument was pushed through tissue: a false passage.
#[derive(Message, Reflect, Debug, Clone, Copy, PartialEq)]
pub struct InstrumentTore {
    /// The instrument.
    pub instrument: Entity,
    /// The tissue.
    pub tissue: Entity,
    /// The pentahedron that was pressed hardest.
    pub pentahedron: u32,
    /// Where, mm.
    pub place: Vec3,
    /// Unit direction in which the instrument pressed.
    pub towards: Vec3,
    /// With what, N.
    pub force_n: f32,
}

impl Resectoscope {
    /// The force on a patch of the sheath, a diameter long, that tears tissue, N.
    pub fn tears_n(&self) -> f32 {
        TEARS_AT * self.holds_n
    }
}

impl Patch {
    fn new(contact: &TissueContact) -> Patch {
        Patch {
            force_n: Vec3::ZERO,
            place: contact.point,
            pentahedron: contact.pentahedron,
            tissue: contact.tissue,
            hardest_n: 0.0,
            now_n: Vec3::ZERO,
        }
    }

    /// Which way of the tip presses the patch less, times by how much: what the patch moves against the force is this times the tip's.
    fn relief(&self, scope: &Resectoscope, tip: Vec3) -> Option<Vec3> {
        let arm = tip - scope.pivot();
        let (axis, length) = (arm.normalize_or_zero(), arm.length());
        let force = self.force_n.normalize_or_zero();
        let along = axis * force.dot(axis);
        let lever = (self.place - scope.pivot()).dot(axis) / length;
        let relief = along + (force - along) * lever;
        (relief.length() > LEAST_LEVER).then_some(relief)
    }
}

impl TissueLoad {
    /// Begins a step.
    pub(crate) fn begin(&mut self) {
        self.on_loop_n = Vec3::ZERO;
        for patch in &mut self.patches {
            (patch.now_n, patch.hardest_n) = (Vec3::ZERO, 0.0);
        }
    }

    /// Takes in a contact of the instrument.
    pub(crate) fn add(&mut self, scope: &Resectoscope, state: &InstrumentState, contact: &TissueContact) {
        let behind_mm = (scope.sheath_pose(state).inverse() * contact.point).z + ResectoscopeGeometry::CAP_MM;
        let force_n = -contact.normal * contact.force_n;
        if contact.part == ToolPartKind::Loop || behind_mm < -AHEAD_MM {
            self.on_loop_n += force_n;
            return;
        }
        let half_mm = 0.5 * scope.geometry.sheath_diameter_mm;
        let half = (behind_mm.max(0.0) / half_mm) as usize;
        for index in half.saturating_sub(1)..=half {
            if self.patches.len() <= index {
                self.patches.resize(index + 1, Patch::new(contact));
            }
            let patch = &mut self.patches[index];
            patch.now_n += force_n;
            if contact.force_n > patch.hardest_n {
                (patch.place, patch.hardest_n) = (contact.point, contact.force_n);
                (patch.tissue, patch.pentahedron) = (contact.tissue, contact.pentahedron);
            }
        }
    }

    /// Ends a step: the patch by which tissue tears in it.
    pub(crate) fn end(&mut self, scope: &Resectoscope, step_s: f32) -> Option<Patch> {
        let share = 1.0 - (-step_s / MEAN_S).exp();
        for (index, patch) in self.patches.iter_mut().enumerate() {
            let with_loop_n = patch.now_n + self.on_loop_n;
            if index < OF_TIP && with_loop_n.length() < patch.now_n.length() {
                // What the loop presses against the tip it bears itself.
                patch.now_n = with_loop_n;
            }
            patch.force_n += share * (patch.now_n - patch.force_n);
        }
        let hardest = self.hardest().copied();
        let force_n = hardest.map_or(0.0, |patch| patch.force_n.length());
        let tears = force_n >= scope.tears_n() && !self.has_torn;
        self.has_torn = force_n >= scope.holds_n && (self.has_torn || tears);
        hardest.filter(|_| tears)
    }

    /// The patch that bears most.
    pub fn hardest(&self) -> Option<&Patch> {
        let by_force = |a: &&Patch, b: &&Patch| a.force_n.length().total_cmp(&b.force_n.length());
        self.patches.iter().max_by(by_force)
    }

    /// The state that tissue allows on the way between two states, in a step of `step_s` seconds; `None` if it allows all of it.
    pub(crate) fn hold(
        &self,
        scope: &Resectoscope,
        from: &InstrumentState,
        to: &InstrumentState,
        step_s: f32,
    ) -> Option<InstrumentState> {
        let tip = scope.tip(from);
        let wanted = scope.tip(to) - tip;
        let back = (scope.pivot() - tip).normalize_or_zero();
        let mut way = wanted;
        let holding = self
            .patches
            .iter()
            .filter(|patch| patch.force_n.length() > scope.holds_n);
        let holding: Vec<(Vec3, bool)> = holding
            .filter_map(|patch| Some((patch.relief(scope, tip)?, patch.force_n.length() >= scope.tears_n())))
            .collect();
        for _ in 0..PASSES {
            for (relief, is_torn) in &holding {
                let free_mm = if *is_torn { 0.0 } else { CREEP_MM_PER_S * step_s };
                let too_far_mm = -way.dot(*relief) - free_mm;
                if too_far_mm > 0.0 {
                    way += relief * (too_far_mm / relief.length_squared());
                }
                if *is_torn && way.dot(back) <= 0.0 {
                    // What piles up beside it as it slides on tears, too.
                    let off = way.project_onto(*relief);
                    way = off + (way - off).clamp_length_max(MOST_ASIDE * off.length());
                }
            }
        }
        if way == wanted {
            return None;
        }
        let arm = tip + way - scope.pivot();
        let [pitch_deg, yaw_deg] = scope.turned_to(arm);
        let held = InstrumentState {
            insertion_mm: arm.length(),
            pitch_deg,
            yaw_deg,
            ..*to
        };
        // Where tissue turns the sheath aside, no faster than hands: a recording of it plays again as it was.
        scope.limits.advance(from, &held, step_s).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f32 = 1.0 / 60.0;
    const AT: InstrumentState = InstrumentState {
        insertion_mm: 40.0,
        pitch_deg: 0.0,
        yaw_deg: 0.0,
        roll_deg: 0.0,
        stroke_mm: 0.0,
        inflow_tap: 0.0,
        outflow_tap: 0.0,
        cut: false,
        coagulate: false,
    };

    fn scope() -> Resectoscope {
        Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).expect("a valid placement")
    }

    /// The load after a number of steps with the same contacts (part, place in mm, force of the tissue in N), and the patches that tore.
    fn pressed(contacts: &[(ToolPartKind, Vec3, Vec3)], steps: usize) -> (TissueLoad, Vec<Patch>) {
        let (scope, mut load) = (scope(), TissueLoad::default());
        let mut torn = Vec::new();
        for _ in 0..steps {
            load.begin();
            for &(part, point, force_n) in contacts {
                let contact = TissueContact {
                    tissue: Entity::PLACEHOLDER,
                    tool: Entity::PLACEHOLDER,
                    part,
                    pentahedron: 7,
                    point,
                    normal: -force_n.normalize(),
                    depth_mm: 0.0,
                    force_n: force_n.length(),
                    kind: resecta_solver::NodeKind::Mucosa,
                    current: false,
                };
                load.add(&scope, &AT, &contact);
            }
            torn.extend(load.end(&scope, STEP_S));
        }
        (load, torn)
    }

    /// The tip pressed straight back.
    fn rammed(force_n: f32) -> [(ToolPartKind, Vec3, Vec3); 1] {
        [(ToolPartKind::Sheath, Vec3::Z * 42.0, Vec3::NEG_Z * force_n)]
    }

    #[test]
    fn tissue_holds_what_goes_against_it_and_lets_go_what_does_not() {
        let (scope, (load, torn)) = (scope(), pressed(&rammed(0.6), 60));
        assert_eq!(torn, [], "it holds, and does not tear");
        let to = |change: fn(&mut InstrumentState)| {
            let mut to = AT;
            change(&mut to);
            load.hold(&scope, &AT, &to, STEP_S)
        };
        let held = to(|to| to.insertion_mm += 1.0).expect("held");
        assert!(
            (held.insertion_mm - 40.0 - CREEP_MM_PER_S * STEP_S).abs() < 1e-4,
            "{held:?}"
        );
        assert!(held.pitch_deg.abs() < 1e-3 && held.yaw_deg.abs() < 1e-3);
        for free in [
            to(|to| to.insertion_mm -= 1.0),
            to(|to| to.insertion_mm += 0.9 * CREEP_MM_PER_S * STEP_S),
            to(|to| to.pitch_deg = 1.0),
            to(|to| to.stroke_mm = 5.0),
            to(|to| (to.roll_deg, to.cut) = (90.0, true)),
        ] {
            assert_eq!(free, None);
        }
        // Along the wall at once with into it: along it.
        let held = to(|to| (to.insertion_mm, to.yaw_deg) = (41.0, 1.0)).expect("held");
        assert!((scope.tip(&held).x - scope.tip(&InstrumentState { yaw_deg: 1.0, ..AT }).x).abs() < 0.05);
    }

    #[test]
    fn what_is_held_is_turned_aside_no_faster_than_hands_are() {
        let scope = scope();
        let at = |insertion_mm: f32| InstrumentState { insertion_mm, ..AT };
        // Along a wall that lies aslant, as far aside as on: near the pivot that is more than hands turn in a step.
        for aside in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y] {
            let way = (aside + Vec3::NEG_Z) * 0.45;
            let press = [(ToolPartKind::Sheath, Vec3::Z * 21.0, way)];
            let (load, _) = pressed(&press, 60);
            let held = load.hold(&scope, &at(20.0), &at(22.0), STEP_S).expect("held");
            assert!(held.pitch_deg.abs().max(held.yaw_deg.abs()) > 0.5, "{held:?}");
            assert_eq!(scope.limits.advance(&at(20.0), &held, STEP_S), Ok(held), "{way}");
        }
    }

    #[test]
    fn what_tears_is_told_once_and_goes_no_further() {
        let (load, torn) = pressed(&rammed(1.0), 60);
        let [tear] = torn[..] else { panic!("{torn:?}") };
        assert_eq!((tear.pentahedron, tear.place), (7, Vec3::Z * 42.0));
        let on = InstrumentState {
            insertion_mm: 41.0,
            yaw_deg: 2.0,
            ..AT
        };
        let held = load.hold(&scope(), &AT, &on, STEP_S).expect("held");
        assert!(scope().tip(&held).distance(scope().tip(&AT)) < 0.1, "{held:?}");
        let back = InstrumentState {
            insertion_mm: 39.0,
            yaw_deg: 2.0,
            ..AT
        };
        assert_eq!(load.hold(&scope(), &AT, &back, STEP_S), None);
        // A knock of a step is none.
        assert_eq!(pressed(&rammed(3.0), 1).1, []);
    }

    #[test]
    fn a_shaft_that_is_pressed_all_along_bears_more_than_a_tip() {
        let along = |force_n: f32| {
            let place = |n: usize| Vec3::new(0.0, 4.0, 40.0 - 2.0 * n as f32);
            let press = move |n| (ToolPartKind::Sheath, place(n), Vec3::NEG_Y * force_n / 16.0);
            std::array::from_fn::<_, 16, _>(press)
        };
        let lower = InstrumentState { pitch_deg: -1.0, ..AT };
        let (load, torn) = pressed(&along(1.5), 60);
        assert!(torn.is_empty() && load.hold(&scope(), &AT, &lower, STEP_S).is_none());
        let (load, torn) = pressed(&along(4.0), 60);
        assert_eq!(torn.len(), 1);
        let held = load.hold(&scope(), &AT, &lower, STEP_S).expect("held");
        assert!(held.pitch_deg.abs() < 0.1, "{held:?}");
    }

    #[test]
    fn what_the_loop_presses_against_the_tip_holds_nothing() {
        let [rammed] = rammed(2.0);
        let by_loop = (ToolPartKind::Loop, Vec3::Z * 45.0, Vec3::Z * 2.0);
        let (load, torn) = pressed(&[rammed, by_loop], 60);
        assert!(torn.is_empty() && load.hardest().is_none_or(|patch| patch.force_n.length() < 1e-3));
        // Nor does a loop that is pushed out.
        let (load, torn) = pressed(&[(ToolPartKind::Loop, Vec3::Z * 45.0, Vec3::NEG_Z * 2.0)], 60);
        assert!(torn.is_empty() && load.hardest().is_none());
    }
}
