//! The systems of a run: observe the step, measure it, record it, judge it.

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use resecta_chips::{ChipSystems, Chips};
use resecta_fluid::{
    Bladder, Circulation, ClosedBy, FluidSystems, Irrigation, RedOut, Turbidity, VesselClosed, Vessels,
};
use resecta_instrument::{
    InstrumentPlayback, InstrumentState, InstrumentStopped, InstrumentSystems, InstrumentTore, Resectoscope, TissueLoad,
};
use resecta_tissue::{
    TissueChip, TissueContact, TissueDiagnostics, TissueResected, TissueSystems, ToolLoad, ToolPartKind,
};

use crate::{
    active::ActiveExercise,
    begun,
    clearance::{self, LoopClearance},
    confine,
    extension::{self, Extensions},
    false_passage, marked_way,
    metrics::{ChipMasses, Metrics, StepObservation, WaterStep},
    run_log::RunLog,
    score::ScoreCard,
    sight,
    state::{CapsulePerforated, EndReason, RunState},
    steps::StepProgress,
    trace::{Trace, TraceRow},
    water,
};

/// Measures and scores the exercise in play. Without an [`ActiveExercise`] nothing runs.
pub struct ScenarioPlugin {
    schedule: InternedScheduleLabel,
}

impl ScenarioPlugin {
    /// Runs in `schedule`, which must be the one of the tissue.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for ScenarioPlugin {
    /// Runs in `FixedPostUpdate`.
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

/// The order of a step, all after [`TissueSystems::Last`].
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ScenarioSystems {
    /// Empty, for your systems: before anything is observed.
    First,
    /// Contacts, resections and the instrument are gathered into [`StepObservation`]. Runs in every state of the run, so
    /// that nothing from a briefing is counted later.
    Observe,
    /// [`Metrics`] take the step into account; [`CapsulePerforated`] is triggered. Only while running, as all below.
    Measure,
    /// Empty, for systems of extensions that bring their metrics and goals up to date: [`Metrics`] has this step already.
    Extend,
    /// What extensions measured is taken into [`Metrics`], and the present step of the exercise may end.
    Follow,
    /// A row is added to [`Trace`], where there is one, and a sample to [`RunLog`].
    Record,
    /// [`ScoreCard`] is brought up to date, and the run may end.
    Judge,
    /// Empty, for your systems: everything about the step is known. Runs in every state.
    Last,
}

impl Plugin for ScenarioPlugin {
    fn build(&self, app: &mut App) {
        use ScenarioSystems::{Extend, First, Follow, Judge, Last, Measure, Observe, Record};
        app.init_resource::<RunState>()
            .init_resource::<Metrics>()
            .init_resource::<StepObservation>()
            .init_resource::<ScoreCard>()
            .init_resource::<StepProgress>()
            .init_resource::<Extensions>()
            .register_type::<RunState>()
            .register_type::<Metrics>()
            .register_type::<LoopClearance>()
            .add_message::<TissueContact>()
            .add_message::<TissueResected>()
            .add_message::<TissueChip>()
            .add_message::<VesselClosed>()
            .configure_sets(
                self.schedule,
                (
                    First,
                    Observe,
                    Measure.run_if(running),
                    Extend.run_if(running),
                    Follow.run_if(running),
                    Record.run_if(running),
                    Judge.run_if(running),
                    Last,
                )
                    .chain()
                    .after(TissueSystems::Last)
                    .after(FluidSystems::Last)
                    .after(ChipSystems::Last)
                    .run_if(resource_exists::<ActiveExercise>),
            )
            .configure_sets(
                self.schedule,
                (
                    FluidSystems::Prepare,
                    FluidSystems::Vessels,
                    FluidSystems::Demand,
                    FluidSystems::Flow,
                    FluidSystems::Account,
                    FluidSystems::View,
                    ChipSystems::Take,
                    ChipSystems::Move,
                )
                    .run_if(water_runs),
            )
            .add_message::<InstrumentStopped>()
            .add_message::<InstrumentTore>()
            .add_systems(
                FixedUpdate,
                confine::hold_hands
                    .after(InstrumentSystems::Sample)
                    .before(InstrumentSystems::Apply)
                    .run_if(resource_exists::<ActiveExercise>),
            )
            .add_systems(Startup, extension::tell_refused.run_if(any_registered))
            .add_systems(
                self.schedule,
                (
                    false_passage::bleed
                        .in_set(FluidSystems::First)
                        .after(TissueSystems::Last)
                        .before(First)
                        .run_if(resource_exists::<ActiveExercise>),
                    water::follow_lens.in_set(FluidSystems::First),
                    water::follow_taps
                        .in_set(FluidSystems::First)
                        .run_if(resource_exists::<Irrigation>.and_then(resource_exists::<ActiveExercise>)),
                    (
                        observe,
                        observe_water,
                        observe_vessels,
                        observe_chips,
                        sight::observe_landmark.after(clearance::measure),
                        sight::observe_seen,
                        sight::observe_hidden,
                        marked_way::observe_marked_way,
                    )
                        .chain()
                        .in_set(Observe),
                    begun::tear_before.in_set(First).after(water::follow_taps),
                    clearance::measure.in_set(Observe).run_if(clearance::any_clearance),
                    measure.in_set(Measure),
                    // Who may read any component is in conflict with all who write one. Those that it reads are written in
                    // `Extend`, before it.
                    (take_extensions.run_if(any_extension).ambiguous_with_all(), follow_steps)
                        .chain()
                        .in_set(Follow),
                    record.in_set(Record).run_if(resource_exists::<Trace>),
                    log.in_set(Record).run_if(resource_exists::<RunLog>),
                    judge.in_set(Judge),
                ),
            );
    }
}

fn running(state: Res<RunState>) -> bool {
    *state == RunState::Running
}

/// Whether water runs: not while an exercise waits for its player, who may read its briefing as long as they like.
fn water_runs(state: Res<RunState>, active: Option<Res<ActiveExercise>>) -> bool {
    active.is_none() || running(state)
}

fn observe(
    time: Res<Time>,
    active: Res<ActiveExercise>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    loads: Query<(&ToolLoad, &TissueLoad)>,
    diagnostics: Option<Res<TissueDiagnostics>>,
    mut contacts: MessageReader<TissueContact>,
    mut resections: MessageReader<TissueResected>,
    mut chips: MessageReader<TissueChip>,
    mut tore: MessageReader<InstrumentTore>,
    mut step: ResMut<StepObservation>,
) {
    *step = match instruments.get(active.instrument) {
        Ok((state, resectoscope)) => StepObservation::idle(time.delta_secs_f64(), *state, resectoscope.tip(state)),
        // Despawned by someone: time goes on, and the tip stays where it was.
        Err(_) => StepObservation::idle(time.delta_secs_f64(), InstrumentState::default(), step.tip),
    };
    if let Ok((load, patches)) = loads.get(active.instrument) {
        step.force_n = load.force_n.length().into();
        step.patch_force_n = patches.hardest().map_or(0.0, |patch| patch.force_n.length().into());
    }
    if let Some(diagnostics) = diagnostics {
        (step.overlap, step.inverted) = (diagnostics.overlap, diagnostics.inverted as u32);
    }
    for contact in contacts.read() {
        if contact.tissue == active.tissue && contact.tool == active.instrument {
            step.add_contact(contact, &active.distal);
        }
    }
    let torn = tore.read().filter(|tear| tear.instrument == active.instrument);
    step.false_passages = torn.count() as u32;
    for TissueChip { chip, .. } in chips.read().filter(|chip| chip.tissue == active.tissue) {
        step.vaporised_mm3 += chip.vaporised_mm3;
    }
    for resection in resections.read() {
        if resection.tissue == active.tissue {
            let by_loop = resection.tool == Some(active.instrument);
            step.add_resection(resection, &active.marked, &active.distal, by_loop);
        }
    }
}

/// What blood and water did since the last step: their books run from the start of the exercise.
fn observe_water(
    (bladder, circulation, turbidity): (Option<Res<Bladder>>, Option<Res<Circulation>>, Option<Res<Turbidity>>),
    (red_outs, vessels): (Query<&RedOut>, Query<&Vessels>),
    active: Res<ActiveExercise>,
    mut closed: MessageReader<VesselClosed>,
    mut before: Local<[f64; 3]>,
    mut step: ResMut<StepObservation>,
) {
    let (bladder_ml, pressure_cmh2o) =
        (bladder.as_ref()).map_or((0.0, 0.0), |bladder| (bladder.volume_ml(), bladder.pressure_cmh2o()));
    let totals = bladder.map(|bladder| *bladder.totals()).unwrap_or_default();
    let blood_ml = circulation.map_or(0.0, |circulation| circulation.blood_loss_ml());
    let now = [blood_ml, totals.irrigated_ml, totals.absorbed_ml];
    // Books that begin anew begin at 0.
    let [blood_ml, irrigated_ml, absorbed_ml] =
        std::array::from_fn(|n| if now[n] < before[n] { now[n] } else { now[n] - before[n] });
    *before = now;
    let open = vessels.get(active.tissue).ok().into_iter().flat_map(Vessels::open);
    let (bleeders, to_come_ml) = open.fold((0, 0.0), |(count, sum), vessel| (count + 1, sum + vessel.to_come_ml()));
    let (mut coagulated, mut clotted) = (0, 0);
    for closed in closed.read().filter(|closed| closed.tissue == active.tissue) {
        match closed.by {
            ClosedBy::Coagulation(_) => coagulated += 1,
            ClosedBy::Clot => clotted += 1,
        }
    }
    let clear = 1.0 - red_outs.get(active.instrument).map_or(0.0, |red_out| red_out.covered);
    step.water = WaterStep {
        blood_ml,
        irrigated_ml,
        absorbed_ml,
        bladder_ml,
        pressure_cmh2o,
        visibility: clear * turbidity.map_or(1.0, |turbidity| turbidity.visibility()),
        bleeders,
        // Metrics are finite, a vessel that never clots is not.
        to_come_ml: to_come_ml.min(f64::MAX),
        coagulated,
        clotted,
    };
}

/// Whether the coagulating loop is at a vessel that bleeds, or that it has closed in this very step.
fn observe_vessels(
    active: Res<ActiveExercise>,
    circulation: Option<Res<Circulation>>,
    vessels: Query<&Vessels>,
    mut contacts: MessageReader<TissueContact>,
    mut closed: MessageReader<VesselClosed>,
    mut step: ResMut<StepObservation>,
) {
    let coagulates = step.instrument.coagulate && !step.instrument.cut;
    let mut points = (contacts.read())
        .filter(|contact| contact.tissue == active.tissue && contact.tool == active.instrument)
        .filter(|contact| contact.part == ToolPartKind::Loop && coagulates)
        .map(|contact| contact.point)
        .peekable();
    let (Some(circulation), true) = (circulation, points.peek().is_some()) else {
        points.for_each(drop);
        closed.clear();
        return;
    };
    let just_closed = (closed.read())
        .filter(|closed| closed.tissue == active.tissue && closed.by == ClosedBy::Coagulation(active.instrument))
        .map(|closed| closed.place);
    let open = vessels.get(active.tissue).ok().into_iter().flat_map(Vessels::open);
    let places: Vec<Vec3> = open.map(|vessel| vessel.place).chain(just_closed).collect();
    let reach_mm = circulation.settings.coagulation_radius_mm;
    let is_near = |point: Vec3| places.iter().any(|place| f64::from(place.distance(point)) <= reach_mm);
    // Every message is read, or it would count in a later step.
    step.coagulates_vessel = points.fold(false, |near, point| near | is_near(point));
}

/// Where what was cut free is now.
fn observe_chips(chips: Option<Res<Chips>>, mut step: ResMut<StepObservation>) {
    let totals = chips.map(|chips| chips.totals()).unwrap_or_default();
    step.chips = ChipMasses {
        in_body_g: totals.in_body_g,
        flushed_g: totals.flushed_g,
    };
}

fn measure(
    mut commands: Commands,
    step: Res<StepObservation>,
    active: Res<ActiveExercise>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    mut metrics: ResMut<Metrics>,
) {
    metrics.count_step(&step);
    metrics.removal.observe(&step);
    metrics.capsule.observe(&step);
    metrics.sphincter.observe(&step);
    metrics.current.observe(&step);
    metrics.motion.observe(&step);
    metrics.water.observe(&step);
    metrics.view.observe(&step);
    metrics.chips.observe(&step);
    metrics.contact_error.observe(&step);
    if step.current_on_capsule
        && step.capsule_cut_mm2 > 0.0
        && let Ok((state, resectoscope)) = instruments.get(active.instrument)
    {
        let the_loop = resectoscope.loop_pose(state);
        commands.trigger(CapsulePerforated {
            tissue: active.tissue,
            area_mm2: step.capsule_cut_mm2,
            point: the_loop.centre + the_loop.down * resectoscope.geometry.loop_depth_mm,
        });
    }
}

fn any_registered(extensions: Res<Extensions>) -> bool {
    !extensions.is_empty()
}

fn any_extension(metrics: Res<Metrics>) -> bool {
    !metrics.extensions.is_empty()
}

/// Takes what extensions measured, in the order of their names.
fn take_extensions(
    active: Res<ActiveExercise>,
    mut access: ParamSet<(Query<EntityRef, With<Resectoscope>>, ResMut<Metrics>)>,
) {
    let mut extensions = std::mem::take(&mut access.p1().extensions);
    if let Ok(instrument) = access.p0().get(active.instrument) {
        for (metric, value) in &mut extensions {
            *value = metric.measure(&instrument).unwrap_or(*value);
        }
    }
    access.p1().extensions = extensions;
}

fn follow_steps(
    active: Res<ActiveExercise>,
    step: Res<StepObservation>,
    mut progress: ResMut<StepProgress>,
    mut metrics: ResMut<Metrics>,
) {
    if active.exercise.steps.is_empty() {
        return;
    }
    progress.observe(&active.exercise.steps, &step, &metrics);
    metrics.steps_done = progress.done_at_s.len() as u32;
}

fn log(step: Res<StepObservation>, metrics: Res<Metrics>, mut log: ResMut<RunLog>) {
    log.observe(&step, &metrics);
}

fn record(step: Res<StepObservation>, metrics: Res<Metrics>, mut trace: ResMut<Trace>) {
    trace.rows.push(TraceRow::new(&step, &metrics));
}

fn judge(
    active: Res<ActiveExercise>,
    metrics: Res<Metrics>,
    playbacks: Query<&InstrumentPlayback>,
    mut card: ResMut<ScoreCard>,
    mut state: ResMut<RunState>,
) {
    *card = ScoreCard::new(&active.exercise, &metrics);
    let input_over = playbacks.get(active.instrument).is_ok_and(|playback| playback.over);
    let reason = if card.goals_reached() {
        EndReason::GoalsReached
    } else if let Some(reason) = active.exercise.limits.reached(|metric| metrics.value(metric)) {
        reason
    } else if input_over {
        EndReason::InputEnded
    } else {
        return;
    };
    *state = RunState::Ended(reason);
}
