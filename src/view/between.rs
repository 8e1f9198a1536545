//! What is drawn between two steps: the instrument and its lens.
//!
//! Steps come at a fixed rate and frames when they can. With [`DrawBetweenSteps`] all that moves is drawn where it was at the
//! time of the frame less one step: tissue (the plugin's [`DrawnBetweenSteps`]), chips, instrument and cameras by the same
//! share, so that nothing slides against anything else. Pictures without a clock show the last step itself.

use bevy::{
    ecs::{query::QueryData, system::SystemParam},
    prelude::*,
};
use resecta_instrument::{InstrumentState, InstrumentSystems, Resectoscope};
use resecta_tissue::{DrawnBetweenSteps, Tissue};

use super::ViewSystems;

pub fn plugin(app: &mut App) {
    app.add_systems(
        FixedUpdate,
        remember
            .after(InstrumentSystems::Sample)
            .before(InstrumentSystems::Apply),
    )
    .add_systems(
        Update,
        (
            draw_tissue_between.run_if(resource_exists::<DrawBetweenSteps>),
            place_instruments,
        )
            .in_set(ViewSystems::Place),
    );
}

/// Draws everything between the last two steps instead of where the last one left it.
#[derive(Resource, Reflect, Debug, Default, Clone, Copy)]
#[reflect(Resource, Default)]
pub struct DrawBetweenSteps;

/// How far a frame is from the step before last to the last one: 1 without [`DrawBetweenSteps`].
#[derive(SystemParam)]
pub(super) struct FrameShare<'w> {
    fixed: Res<'w, Time<Fixed>>,
    is_between: Option<Res<'w, DrawBetweenSteps>>,
}

impl FrameShare<'_> {
    pub fn get(&self) -> f32 {
        match self.is_between {
            Some(_) => self.fixed.overstep_fraction().clamp(0.0, 1.0),
            None => 1.0,
        }
    }
}

/// Where an instrument was a step ago, and where it is drawn.
#[derive(Component)]
pub(super) struct InstrumentDrawn {
    before: InstrumentState,
    drawn: InstrumentState,
}

/// An instrument as it is drawn.
#[derive(QueryData)]
pub(super) struct Drawn {
    scope: &'static Resectoscope,
    state: &'static InstrumentState,
    drawn: Option<&'static InstrumentDrawn>,
}

impl DrawnItem<'_, '_> {
    /// The instrument, and the state that it is drawn in.
    pub fn get(&self) -> (&Resectoscope, &InstrumentState) {
        (self.scope, self.drawn.map_or(self.state, |drawn| &drawn.drawn))
    }
}

/// Takes down where instruments are before they move; those that were just placed are already there.
fn remember(mut instruments: Query<(Entity, &InstrumentState, Option<&mut InstrumentDrawn>)>, mut commands: Commands) {
    for (instrument, state, drawn) in &mut instruments {
        match drawn {
            Some(mut drawn) => drawn.before = *state,
            None => {
                let drawn = InstrumentDrawn {
                    before: *state,
                    drawn: *state,
                };
                commands.entity(instrument).insert(drawn);
            }
        }
    }
}

fn place_instruments(
    share: FrameShare,
    mut instruments: Query<(&Resectoscope, &InstrumentState, &mut InstrumentDrawn, &mut Transform)>,
) {
    let share = share.get();
    for (scope, state, mut drawn, mut transform) in &mut instruments {
        drawn.drawn = drawn.before.towards(state, share);
        transform.set_if_neq(Transform::from_isometry(scope.sheath_pose(&drawn.drawn)));
    }
}

fn draw_tissue_between(tissues: Query<Entity, (With<Tissue>, Without<DrawnBetweenSteps>)>, mut commands: Commands) {
    for tissue in &tissues {
        commands.entity(tissue).insert(DrawnBetweenSteps::default());
    }
}
