//! Bleeding: vessels open where tissue is cut, bleed, clot, and are closed by a current.
//!
//! - A vessel **opens** when half of the pentahedron that carries it has been cut away
//!   ([`TissueResected`] says what lost tissue): the cut then passes through its middle. In tissue that was cut before its
//!   vessels came into the app they bleed from their first step. Veins open no other way; that they do
//!   so only near the capsule is because they lie there ([`Vessels::generate`]).
//! - It **bleeds** as `circulation.rs` says. Veins bleed into the bladder through ports of `balance.rs`, so that they stop at
//!   the very moment at which its pressure passes theirs; what passed in a step is shared among them by what each would have
//!   lost against no pressure. Within one step, what a clot leaves of a vein or a pulse of an artery counts with its mean: the
//!   totals of a vein then depend on the length of steps by (step / clotting time)², times how much the pressure changes in
//!   one, and not at all where it does not.
//! - A **current** closes it after a dwell: in every step of it a loop under coagulating (not cutting) current touched tissue
//!   within a radius of where the vessel is ([`TissueContact`]). A step without that starts the dwell anew.
//! - It **follows** the surface that the cut laid bare: `carrier.rs`.
//!
//! A closed vessel stays closed. Cutting deeper meets other vessels.

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use resecta_tissue::{Tissue, TissueContact, TissueResected, TissueTool};

use crate::{
    balance::Port,
    circulation::{Circulation, CirculationSettings, LEAST_SHARE},
    irrigation,
    plugin::{self, FluidSystems, Step, time_passes},
    refused::{FluidError, FluidRefused},
    vessels::{ClosedBy, Course, Vessel, VesselClosed, VesselKind, VesselOpened, VesselState, Vessels, is_cut},
};

/// Bleeding of tissues with [`Vessels`]: with a [`Circulation`] in the app.
#[derive(Debug, Clone)]
pub struct BleedingPlugin {
    schedule: InternedScheduleLabel,
}

impl BleedingPlugin {
    /// Runs in another schedule, which must be that of the tissue and of the other plugins of this crate.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for BleedingPlugin {
    /// Runs in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl Plugin for BleedingPlugin {
    fn build(&self, app: &mut App) {
        plugin::add_core(app, self.schedule);
        app.init_resource::<ListCount>()
            .add_message::<TissueResected>()
            .add_message::<TissueContact>()
            .add_message::<VesselOpened>()
            .add_message::<VesselClosed>()
            .register_type::<Vessels>()
            .register_type::<Vessel>()
            .register_type::<Circulation>()
            .register_type::<CirculationSettings>()
            .add_systems(
                self.schedule,
                (
                    (adopt, open, follow, coagulate).chain().in_set(FluidSystems::Vessels),
                    demand
                        .in_set(FluidSystems::Demand)
                        .after(irrigation::open_taps)
                        .run_if(time_passes),
                    account.in_set(FluidSystems::Account).run_if(time_passes),
                )
                    .run_if(resource_exists::<Circulation>),
            );
    }
}

/// How many lists of vessels the app has had: the next one's ordinal.
#[derive(Resource, Default)]
struct ListCount(u64);

/// Lists in the order in which they came into the app.
fn ordered<'a>(lists: impl Iterator<Item = (Entity, Mut<'a, Vessels>)>) -> Vec<(Entity, Mut<'a, Vessels>)> {
    let mut lists: Vec<_> = lists.filter(|(_, vessels)| vessels.ordinal.is_some()).collect();
    lists.sort_unstable_by_key(|(_, vessels)| vessels.ordinal);
    lists
}

/// Gives new lists their ordinal, looks for vessels that are nowhere, and opens those in tissue that was cut before they came.
fn adopt(
    mut lists: Query<(Entity, &mut Vessels, &Tissue)>,
    mut count: ResMut<ListCount>,
    mut refused: MessageWriter<FluidRefused>,
    mut opened: MessageWriter<VesselOpened>,
) {
    for (entity, mut vessels, tissue) in &mut lists {
        if vessels.ordinal.is_some() {
            continue;
        }
        vessels.ordinal = Some(count.0);
        count.0 += 1;
        let solver = tissue.solver();
        for (index, (vessel, course)) in vessels.list.iter_mut().enumerate() {
            if course.state == VesselState::Intact && is_cut(solver, course.carrier) {
                opened.write(course.open(entity, index, vessel, tissue));
            }
            if vessel.pentahedron as usize >= solver.pentahedron_count() {
                course.state = VesselState::PutAside;
                refused.write(FluidRefused {
                    what: "Vessels",
                    entity: Some(entity),
                    error: FluidError {
                        field: "pentahedron",
                        value: vessel.pentahedron.into(),
                        expected: "the index of a pentahedron of the tissue",
                    },
                });
            }
        }
    }
}

/// Opens the vessels that cuts have reached, or tears.
fn open(
    mut lists: Query<(Entity, &mut Vessels)>,
    tissues: Query<&Tissue>,
    mut cuts: MessageReader<TissueResected>,
    mut opened: MessageWriter<VesselOpened>,
) {
    let cuts: Vec<&TissueResected> = cuts.read().collect();
    let has_torn = |vessels: &Vessels| vessels.list.iter().any(|(_, course)| course.tears());
    if cuts.is_empty() && !lists.iter().any(|(_, vessels)| has_torn(vessels)) {
        return;
    }
    for (entity, mut vessels) in ordered(lists.iter_mut()) {
        let Ok(tissue) = tissues.get(entity) else {
            continue;
        };
        let solver = tissue.solver();
        for (index, (vessel, course)) in vessels.list.iter_mut().enumerate() {
            let lost_tissue = |cut: &&TissueResected| {
                let of = |&(pentahedron, _): &(u32, f64)| pentahedron;
                cut.tissue == entity && cut.taken_mm3.binary_search_by_key(&course.carrier, of).is_ok()
            };
            let lost_some = course.is_at_stake() && cuts.iter().any(lost_tissue);
            if lost_some {
                course.mouth = None;
            }
            let is_reached = lost_some && is_cut(solver, course.carrier);
            if course.tears() || course.state == VesselState::Intact && is_reached {
                opened.write(course.open(entity, index, vessel, tissue));
            }
        }
    }
}

impl Course {
    /// Whether a cut changes anything for it.
    fn is_at_stake(&self) -> bool {
        matches!(self.state, VesselState::Intact | VesselState::Open)
    }

    /// Begins to bleed.
    fn open(&mut self, entity: Entity, index: usize, vessel: &Vessel, tissue: &Tissue) -> VesselOpened {
        self.state = VesselState::Open;
        self.follow(vessel, tissue);
        VesselOpened {
            tissue: entity,
            vessel: index,
            kind: vessel.kind,
            place: self.place,
        }
    }
}

/// Brings open vessels to where the tissue is.
fn follow(mut lists: Query<(&mut Vessels, &Tissue)>) {
    for (mut vessels, tissue) in &mut lists {
        let open = vessels.list.iter_mut();
        for (vessel, course) in open.filter(|(_, course)| course.state == VesselState::Open) {
            course.follow(vessel, tissue);
        }
    }
}

/// Closes vessels that a coagulating loop has been near for long enough.
fn coagulate(
    mut lists: Query<(Entity, &mut Vessels)>,
    tools: Query<&TissueTool>,
    circulation: Res<Circulation>,
    step: Res<Step>,
    mut contacts: MessageReader<TissueContact>,
    mut closed: MessageWriter<VesselClosed>,
) {
    let coagulates = |contact: &&TissueContact| {
        let tool = tools.get(contact.tool);
        contact.current && tool.is_ok_and(|tool| tool.coagulating && !tool.cutting)
    };
    let contacts: Vec<&TissueContact> = contacts.read().filter(coagulates).collect();
    if step.seconds <= 0.0 {
        return;
    }
    let CirculationSettings {
        coagulation_radius_mm: radius_mm,
        coagulation_dwell_s,
        ..
    } = circulation.settings;
    for (entity, mut vessels) in ordered(lists.iter_mut()) {
        for (index, (vessel, course)) in vessels.list.iter_mut().enumerate() {
            if course.state != VesselState::Open {
                continue;
            }
            let near = contacts.iter().find(|contact| {
                contact.tissue == entity && f64::from(contact.point.distance(course.place)) <= radius_mm
            });
            let Some(contact) = near else {
                course.dwell_s = 0.0;
                continue;
            };
            course.dwell_s += step.seconds;
            // Steps are not whole parts of the dwell: half of one is no reason to take another.
            if course.dwell_s + 0.5 * step.seconds < coagulation_dwell_s {
                continue;
            }
            closed.write(course.close(entity, index, vessel, ClosedBy::Coagulation(contact.tool)));
        }
    }
}

impl Course {
    fn close(&mut self, tissue: Entity, index: usize, vessel: &Vessel, by: ClosedBy) -> VesselClosed {
        self.state = match by {
            ClosedBy::Coagulation(_) => VesselState::Coagulated,
            ClosedBy::Clot => VesselState::Clotted,
        };
        self.rate_ml_per_s = 0.0;
        VesselClosed {
            tissue,
            vessel: index,
            kind: vessel.kind,
            place: self.place,
            by,
            lost_ml: self.lost_ml,
        }
    }

    /// How long it still bleeds before its clot closes it, s.
    fn left_s(&self, vessel: &Vessel) -> f64 {
        (-LEAST_SHARE.ln() * vessel.clotting_s - self.age_s).max(0.0)
    }
}

/// Asks what all vessels would lose in the step.
pub(crate) fn demand(mut lists: Query<(Entity, &mut Vessels)>, circulation: Res<Circulation>, mut step: ResMut<Step>) {
    let seconds = step.seconds;
    let [mut arteries_ml, mut veins_ml] = [0.0; VesselKind::COUNT];
    for (_, mut vessels) in ordered(lists.iter_mut()) {
        let open = vessels.list.iter_mut();
        for (vessel, course) in open.filter(|(_, course)| course.state == VesselState::Open) {
            let lasts = course.left_s(vessel).min(seconds);
            let rate = vessel.rate_ml_per_s * course.share(vessel);
            course.due_ml = circulation.bleeds_ml(vessel.kind, rate, vessel.clotting_s, lasts);
            match vessel.kind {
                VesselKind::Arterial => arteries_ml += course.due_ml,
                VesselKind::Venous => {
                    veins_ml += course.due_ml;
                    step.open_veins += lasts / seconds;
                }
            }
        }
    }
    let pressure = circulation.settings.venous_pressure_cmh2o;
    step.veins_due_ml = veins_ml;
    step.ports.arteries = arteries_ml / seconds;
    step.ports.veins = Port {
        conductance: veins_ml / seconds / pressure,
        pressure,
    };
}

/// Puts what flowed down to the vessels, and closes those that have clotted.
fn account(
    mut lists: Query<(Entity, &mut Vessels)>,
    mut circulation: ResMut<Circulation>,
    step: Res<Step>,
    mut closed: MessageWriter<VesselClosed>,
) {
    let let_through = if step.veins_due_ml > 0.0 {
        step.passed.veins / step.veins_due_ml
    } else {
        0.0
    };
    for (entity, mut vessels) in ordered(lists.iter_mut()) {
        let vessels = &mut *vessels;
        for (index, (vessel, course)) in vessels.list.iter_mut().enumerate() {
            if course.state != VesselState::Open {
                continue;
            }
            let lost_ml = match vessel.kind {
                VesselKind::Arterial => course.due_ml,
                VesselKind::Venous => course.due_ml * let_through,
            };
            course.lost_ml += lost_ml;
            vessels.lost_ml[vessel.kind as usize] += lost_ml;
            circulation.lose(vessel.kind, lost_ml);
            course.rate_ml_per_s = lost_ml / step.seconds;
            let over = course.left_s(vessel) <= step.seconds;
            course.age_s += step.seconds;
            if over {
                closed.write(course.close(entity, index, vessel, ClosedBy::Clot));
            }
        }
    }
    circulation.beat_on(step.seconds);
}
