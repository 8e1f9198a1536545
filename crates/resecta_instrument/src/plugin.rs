//! The plugin: each fixed step asks the source where the instrument is to go, moves it there within its limits and tells
//! the tissue.

use bevy::input::InputSystems;
use bevy::prelude::*;
use resecta_tissue::{TissueContact, TissueTool};

use crate::live::gather_live_input;
use crate::{
    InstrumentBindings, InstrumentField, InstrumentLimits, InstrumentPlayback, InstrumentRecording, InstrumentRefused,
    InstrumentRequest, InstrumentSource, InstrumentState, InstrumentStopped, InstrumentTore, LiveInput, Resectoscope,
    ResectoscopeGeometry, StoppedBy, TissueLoad,
};

/// What runs in a fixed step, in this order, in [`FixedUpdate`]: before the tissue, whose default schedule is
/// `FixedPostUpdate`.
#[derive(SystemSet, Debug, Clone, PartialEq, Eq, Hash)]
pub enum InstrumentSystems {
    /// Empty: for systems that come before the instrument.
    First,
    /// Sources write [`InstrumentRequest`]; a source that was just set places the instrument at its start.
    Sample,
    /// [`InstrumentState`] moves towards the request within the limits; `TissueTool` and `Transform` follow, and
    /// [`InstrumentRecording`] takes the state down.
    Apply,
    /// Empty: for systems that come after the instrument.
    Last,
}

/// Adds resectoscopes: entities with a [`Resectoscope`].
///
/// Works with or without Bevy's input plugin and window; without them the live source holds still.
#[derive(Debug, Default, Clone, Copy)]
pub struct InstrumentPlugin;

impl Plugin for InstrumentPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Resectoscope>()
            .register_type::<ResectoscopeGeometry>()
            .register_type::<InstrumentLimits>()
            .register_type::<InstrumentField>()
            .register_type::<InstrumentState>()
            .register_type::<InstrumentRequest>()
            .register_type::<InstrumentSource>()
            .register_type::<InstrumentPlayback>()
            .register_type::<InstrumentRecording>()
            .register_type::<InstrumentBindings>()
            .register_type::<LiveInput>()
            .register_type::<TissueLoad>()
            .init_resource::<InstrumentBindings>()
            .init_resource::<LiveInput>()
            .add_message::<InstrumentRefused>()
            .add_message::<InstrumentStopped>()
            .add_message::<InstrumentTore>()
            // The tissue's plugin may come later, or not at all.
            .add_message::<TissueContact>()
            .configure_sets(
                FixedUpdate,
                (
                    InstrumentSystems::First,
                    InstrumentSystems::Sample,
                    InstrumentSystems::Apply,
                    InstrumentSystems::Last,
                )
                    .chain(),
            )
            .add_systems(PreUpdate, gather_live_input.after(InputSystems))
            .add_systems(
                FixedUpdate,
                (
                    (place, sample).chain().in_set(InstrumentSystems::Sample),
                    (press, apply).chain().in_set(InstrumentSystems::Apply),
                ),
            );
    }
}

/// Puts instruments whose source, pivot, limits or geometry was just set where their source starts.
fn place(
    time: Res<Time>,
    mut instruments: Query<
        (
            Entity,
            &Resectoscope,
            &InstrumentSource,
            &mut InstrumentState,
            &mut InstrumentRequest,
            &mut InstrumentPlayback,
            (&mut TissueTool, &mut TissueLoad),
            Option<&mut InstrumentRecording>,
        ),
        Or<(Changed<Resectoscope>, Changed<InstrumentSource>)>,
    >,
    mut refused: MessageWriter<InstrumentRefused>,
) {
    for row in &mut instruments {
        let (instrument, scope, source, mut state, mut request, mut playback, (mut tool, mut load), recording) = row;
        match scope.limits.clamp(&source.start(&state)) {
            Ok(start) => *state = start,
            Err(reason) => {
                refused.write(InstrumentRefused { instrument, reason });
                *state = InstrumentState::default();
            }
        }
        request.0 = *state;
        *playback = InstrumentPlayback::default();
        scope.write_tool(&state, &mut tool);
        tool.previous = None;
        *load = TissueLoad::default();
        if let Some(mut recording) = recording {
            *recording = InstrumentRecording {
                step_s: time.delta_secs_f64(),
                start: *state,
                ..default()
            };
        }
        if let InstrumentSource::Recording(replayed) = source
            && replayed.step_s != time.delta_secs_f64()
        {
            warn!(
                "the recording's steps of {} s are replayed as steps of {} s",
                replayed.step_s,
                time.delta_secs_f64()
            );
        }
    }
}

/// Asks every source where its instrument is to go.
fn sample(
    time: Res<Time>,
    mut live: ResMut<LiveInput>,
    bindings: Res<InstrumentBindings>,
    mut instruments: Query<(
        Entity,
        &Resectoscope,
        &InstrumentSource,
        &InstrumentState,
        &mut InstrumentRequest,
        &mut InstrumentPlayback,
    )>,
    mut refused: MessageWriter<InstrumentRefused>,
    mut stopped: MessageWriter<InstrumentStopped>,
) {
    let step_s = time.delta_secs_f64();
    let command = live.take_step(&bindings, step_s as f32);
    for (instrument, scope, source, state, mut request, mut playback) in &mut instruments {
        playback.steps += 1;
        playback.over = source.is_over(playback.steps, step_s);
        let wanted = match source {
            InstrumentSource::Live => command.wanted(&request.0),
            _ => request.0,
        };
        if matches!(source, InstrumentSource::Live | InstrumentSource::Requests) {
            let past_ends = scope.limits.past_ends(&wanted, step_s as f32);
            stopped.write_batch(past_ends.map(|(field, past, push)| InstrumentStopped {
                instrument,
                field,
                above: past > 0.0,
                push,
                by: StoppedBy::Limits,
            }));
        }
        request.0 = match source {
            InstrumentSource::Requests => request.0,
            InstrumentSource::Script(script) => script.sample(playback.steps as f64 * step_s, state),
            InstrumentSource::Recording(recording) => match recording.state(playback.steps) {
                Some(recorded) => recording.completed(recorded, state),
                None => InstrumentState {
                    cut: false,
                    coagulate: false,
                    ..*state
                },
            },
            InstrumentSource::Live => match command.apply(&request.0, state, &scope.limits) {
                Ok(next) => next,
                Err(reason) => {
                    refused.write(InstrumentRefused { instrument, reason });
                    *state
                }
            },
        };
    }
}

/// Sums the forces that tissue exerted on each instrument in the last step, and reports where it tore.
fn press(
    time: Res<Time>,
    mut instruments: Query<(Entity, &Resectoscope, &InstrumentState, &mut TissueLoad)>,
    mut contacts: MessageReader<TissueContact>,
    mut tore: MessageWriter<InstrumentTore>,
) {
    for (.., mut load) in &mut instruments {
        load.begin();
    }
    for contact in contacts.read() {
        if let Ok((_, scope, state, mut load)) = instruments.get_mut(contact.tool) {
            load.add(scope, state, contact);
        }
    }
    for (instrument, scope, _, mut load) in &mut instruments {
        if let Some(patch) = load.end(scope, time.delta_secs()) {
            let force_n = patch.force_n.length();
            tore.write(InstrumentTore {
                instrument,
                tissue: patch.tissue,
                pentahedron: patch.pentahedron,
                place: patch.place,
                towards: -patch.force_n / force_n,
                force_n,
            });
        }
    }
}

/// Moves every instrument towards its request, as far as tissue allows, and updates its tool.
fn apply(
    time: Res<Time>,
    mut instruments: Query<(
        Entity,
        &Resectoscope,
        &InstrumentSource,
        &TissueLoad,
        &mut InstrumentState,
        &mut InstrumentRequest,
        &mut TissueTool,
        &mut Transform,
        Option<&mut InstrumentRecording>,
    )>,
    mut refused: MessageWriter<InstrumentRefused>,
    mut stopped: MessageWriter<InstrumentStopped>,
) {
    let step_s = time.delta_secs();
    for row in &mut instruments {
        let (instrument, scope, source, load, mut state, mut request, mut tool, mut transform, recording) = row;
        let before = *state;
        match scope.limits.advance(&before, &request.0, step_s) {
            Ok(next) => {
                *state = next;
                let is_recorded = matches!(source, InstrumentSource::Recording(_));
                if let Some(held) = load.hold(scope, &before, &next, step_s).filter(|_| !is_recorded) {
                    stopped.write_batch(scope.limits.held(&next, &held, step_s).map(|(field, above, push)| {
                        InstrumentStopped {
                            instrument,
                            field,
                            above,
                            push,
                            by: StoppedBy::Tissue,
                        }
                    }));
                    *state = held;
                    if matches!(source, InstrumentSource::Live) {
                        // The hand does not get ahead of what holds it.
                        for field in [InstrumentField::Insertion, InstrumentField::Pitch, InstrumentField::Yaw] {
                            request.0.set(field, held.get(field));
                        }
                    }
                }
            }
            Err(reason) => {
                refused.write(InstrumentRefused { instrument, reason });
                // The next request starts from a number again.
                request.0 = before;
            }
        }
        scope.write_tool(&state, &mut tool);
        *transform = Transform::from_isometry(tool.pose);
        if let Some(mut recording) = recording {
            if recording.states.is_empty() {
                recording.start = before;
                recording.step_s = time.delta_secs_f64();
            }
            recording.states.push(*state);
        }
    }
}
