//! Two scripted players for whole operations, one careful and one careless: to see that a score tells them apart, and to play an
//! operation from start to debriefing where nobody sits at the instrument. The careful one shows exercises, too, where their files
//! say so.
//!
//! They know what a person at the game knows, and no more: the case's slices and landmarks (the plan in `plan.rs` is made of them
//! before the run), where their own hands hold the instrument, whether the loop is in tissue and how far it is
//! from the capsule and from the sphincter, the pressure on the panel, how clear the view is, and the bleeders that the lens has
//! before it (`senses.rs`).
//! They move the instrument through
//! [`InstrumentRequest`](resecta_instrument::InstrumentRequest), as anybody's system may. What sets them apart are the numbers of
//! a [`Manner`]. They are no model of a surgeon.
//!
//! Deterministic: no chance, no wall time.

mod hand;
mod lumen;
mod plan;
mod play;
mod senses;

use bevy::prelude::*;
use resecta_instrument::{InstrumentSource, InstrumentSystems};
use resecta_scenario::{ActiveExercise, Demonstration, LoopClearance};

pub use plan::{Manner, Stroke};
pub(crate) use plan::{Outlines, towards};
pub(crate) use play::Play;

/// Who plays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Player {
    /// Layer by layer, lobe by lobe, above the verumontanum and off the capsule; closes bleeders, minds the water.
    Careful,
    /// Deep and long strokes past both, the pedal down on the way, the outflow shut; closes nothing.
    Careless,
}

impl Player {
    /// How they operate.
    pub fn manner(self) -> Manner {
        match self {
            Player::Careful => Manner::careful(),
            Player::Careless => Manner::careless(),
        }
    }
}

/// Lets scripted players move their instruments. Without a seated one nothing runs.
#[derive(Debug, Default, Clone, Copy)]
pub struct PlayersPlugin;

impl Plugin for PlayersPlugin {
    fn build(&self, app: &mut App) {
        let between = (play::play.after(InstrumentSystems::Sample)).before(InstrumentSystems::Apply);
        app.add_systems(FixedUpdate, between.run_if(resource_exists::<ActiveExercise>));
    }
}

/// Seats a player at the instrument of the exercise in play, in place of its source of input. The run ends when they are done.
/// Nothing happens without an exercise.
pub fn seat(world: &mut World, player: Player) {
    let Some(active) = world.get_resource::<ActiveExercise>() else {
        return;
    };
    let (instrument, manner) = (active.instrument, player.manner());
    let play = Play::new(manner, &active.case, &active.exercise);
    let mut instrument = world.entity_mut(instrument);
    instrument.insert((InstrumentSource::Requests, play));
    // Measured in every step: only for who minds.
    if manner.lets_go_at_capsule_mm.is_some() {
        instrument.insert(LoopClearance::default());
    }
}

/// Seats a player who makes some strokes and nothing else. Nothing happens without an exercise.
pub(crate) fn seat_for_strokes(world: &mut World, strokes: Vec<Stroke>) {
    let Some(active) = world.get_resource::<ActiveExercise>() else {
        return;
    };
    let (instrument, play) = (
        active.instrument,
        Play::of_strokes(&active.case, &active.exercise, strokes),
    );
    world.entity_mut(instrument).insert((InstrumentSource::Requests, play));
}

/// Which stroke the player of the exercise in play is at, or how many there were; 0 where nobody plays.
pub(crate) fn stroke_number(world: &World) -> usize {
    let active = world.get_resource::<ActiveExercise>();
    let play = active.and_then(|active| world.get::<Play>(active.instrument));
    play.map_or(0, Play::stroke_number)
}

/// Hands the instrument of the exercise in play to what shows it; false where nothing does. The run ends when it is done.
pub fn show(world: &mut World) -> bool {
    let Some(active) = world.get_resource::<ActiveExercise>() else {
        return false;
    };
    let instrument = active.instrument;
    match active.demonstration.clone() {
        None => return false,
        Some(Demonstration::Careful) => seat(world, Player::Careful),
        Some(Demonstration::Script(script)) => {
            world.entity_mut(instrument).insert(InstrumentSource::Script(script));
        }
    }
    true
}
