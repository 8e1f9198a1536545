//! Chips in an app: told by tissue, moved in fixed steps, shown as entities.

use std::sync::Arc;

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use resecta_fluid::{Bladder, FluidSystems};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_tissue::{Chip, TissueChip, TissueProbe, TissueSystems};

use crate::{
    flow::Flow,
    pool::{ChipTotals, HeldReason, Pool, Surroundings},
    settings::{ChipError, ChipSettings},
    sound::sound,
    walls::{Cavity, Sheath, TissueNear},
};

/// A tip that comes further in a step was placed anew and pushes nothing, mm.
const PLACED_ANEW_MM: f32 = 15.0;
/// How deep in tissue a chip is taken to be where no surface is near, mm.
const DEEP_MM: f32 = 3.0;
/// Cosine between a way out of tissue and the way to the channel below which it is the wrong one.
const AWAY: f32 = -0.3;

/// The stages of a step, in this order, after [`FluidSystems::Last`] in the schedule that the plugin was given. They run while
/// the app has [`Chips`].
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChipSystems {
    /// Empty, for users.
    First,
    /// What strokes cut free becomes chips.
    Take,
    /// They move, and leave.
    Move,
    /// Empty, for users: everything of this step is there to be read.
    Last,
}

/// Lets what strokes cut free float. Costs nothing without [`Chips`].
#[derive(Debug, Clone)]
pub struct ChipsPlugin {
    schedule: InternedScheduleLabel,
}

impl ChipsPlugin {
    /// Runs in another schedule, which must be that of tissue and fluid.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for ChipsPlugin {
    /// Runs in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl Plugin for ChipsPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<ChipHeld>()
            .add_message::<TissueChip>()
            .register_type::<FloatingChip>()
            .configure_sets(
                self.schedule,
                (
                    ChipSystems::First,
                    ChipSystems::Take,
                    ChipSystems::Move,
                    ChipSystems::Last,
                )
                    .chain()
                    .after(TissueSystems::Last)
                    .after(FluidSystems::Last)
                    .run_if(resource_exists::<Chips>),
            )
            .add_systems(
                self.schedule,
                (take.in_set(ChipSystems::Take), move_on.in_set(ChipSystems::Move)),
            );
    }
}

/// The chips of one tissue and its bladder. Without it, what is cut free is gone.
#[derive(Resource, Debug)]
pub struct Chips {
    pool: Pool,
    tissue: Entity,
    instrument: Entity,
    /// The entity of each body.
    entities: Vec<Entity>,
    sheath: Option<Isometry3d>,
}

impl Chips {
    /// No chip yet, of a tissue of this density, with the instrument that is in the cavity.
    ///
    /// # Errors
    /// [`ChipError`] names the first setting that is out of range, or the density.
    pub fn new(
        settings: ChipSettings,
        cavity: Cavity,
        density_g_per_mm3: f64,
        tissue: Entity,
        instrument: Entity,
    ) -> Result<Self, ChipError> {
        Ok(Self {
            pool: Pool::new(settings, cavity, density_g_per_mm3)?,
            tissue,
            instrument,
            entities: Vec::new(),
            sheath: None,
        })
    }

    /// Masses of all chips.
    pub fn totals(&self) -> ChipTotals {
        self.pool.totals()
    }

    /// The chips themselves.
    pub fn pool(&self) -> &Pool {
        &self.pool
    }

    /// Their entities, each a [`FloatingChip`].
    pub fn entities(&self) -> &[Entity] {
        &self.entities
    }
}

/// A chip in the water.
#[derive(Component, Reflect, Debug, Clone)]
#[reflect(from_reflect = false)]
#[require(TissueProbe)]
pub struct FloatingChip {
    /// Its number: they count up.
    pub id: u64,
    /// Mass, g.
    pub mass_g: f64,
    /// Pose at the beginning of the last step: the chip's centre, and its turn since it was cut free.
    pub before: Isometry3d,
    /// Pose at the end of the last step.
    pub now: Isometry3d,
    /// Its surface, where it was cut free, without what was drawn out to needles: mm in the world, not about its centre.
    #[reflect(ignore)]
    pub chip: Arc<Chip>,
}

/// A chip is kept where it is from now on.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChipHeld {
    /// The entity of the chip.
    pub chip: Entity,
    /// Why.
    pub reason: HeldReason,
}

fn take(mut told: MessageReader<TissueChip>, mut chips: ResMut<Chips>, mut commands: Commands) {
    let chips = &mut *chips;
    for told in told.read().filter(|told| told.tissue == chips.tissue) {
        let chip = sound(&told.chip);
        let Some(id) = chips.pool.add(&chip) else { continue };
        let Some(body) = chips.pool.bodies().last() else {
            continue;
        };
        let floating = FloatingChip {
            id,
            mass_g: body.mass_g,
            before: body.isometry(),
            now: body.isometry(),
            chip,
        };
        let probe = TissueProbe {
            point: body.place(),
            ..default()
        };
        chips
            .entities
            .push(commands.spawn((Name::new(format!("Chip {id}")), floating, probe)).id());
    }
}

fn move_on(
    time: Res<Time>,
    mut chips: ResMut<Chips>,
    bladder: Option<Res<Bladder>>,
    instruments: Query<(&Resectoscope, &InstrumentState)>,
    mut shown: Query<(&mut FloatingChip, &mut TissueProbe)>,
    mut held: MessageWriter<ChipHeld>,
    mut commands: Commands,
) {
    let seconds = time.delta_secs();
    let chips = &mut *chips;
    if seconds <= 0.0 {
        return;
    }
    let sheath = instruments.get(chips.instrument).ok().map(|(scope, state)| {
        let now = scope.sheath_pose(state);
        let before = chips
            .sheath
            .filter(|before| before.translation.distance(now.translation) < PLACED_ANEW_MM);
        chips.sheath = Some(now);
        Sheath::new(&scope.geometry, before.unwrap_or(now), now)
    });
    let ml_per_s = |flow: fn(&Bladder) -> f64| bladder.as_deref().map_or(0.0, flow).max(0.0);
    let (inflow, outflow) = (ml_per_s(Bladder::inflow_ml_per_s), ml_per_s(Bladder::outflow_ml_per_s));
    let volume_ml = bladder.as_deref().map_or(0.0, Bladder::volume_ml);
    let surroundings = Surroundings {
        flow: Flow {
            mouth: sheath.as_ref().map(|sheath| sheath.mouth),
            inflow: inflow as f32,
            outflow: outflow as f32,
            open_from: chips.pool.settings().flush_ml_per_s as f32,
        },
        turnover: outflow * f64::from(seconds) / volume_ml.max(1.0),
        sheath,
    };

    let entities = chips.entities.clone();
    let cavity = chips.pool.cavity().clone();
    let near = |index: usize| -> Option<TissueNear> {
        let (_, probe) = shown.get(*entities.get(index)?).ok()?;
        tissue_near(probe, &cavity)
    };
    // What was told in this step was not asked about yet.
    let ids: Vec<u64> = chips.pool.bodies().iter().map(|body| body.id).collect();
    let happened = chips.pool.step(seconds, &surroundings, near);
    let entity_of = |id: u64| {
        ids.binary_search(&id)
            .ok()
            .and_then(|index| entities.get(index).copied())
    };

    for (id, reason) in happened.held {
        if let Some(chip) = entity_of(id) {
            held.write(ChipHeld { chip, reason });
        }
    }
    for entity in happened.flushed.into_iter().filter_map(entity_of) {
        chips.entities.retain(|other| *other != entity);
        commands.entity(entity).try_despawn();
    }
    for (body, &entity) in chips.pool.bodies().iter().zip(&chips.entities) {
        let Ok((mut shown, mut probe)) = shown.get_mut(entity) else {
            continue;
        };
        if shown.before != shown.now || shown.now != body.isometry() {
            shown.before = shown.now;
            shown.now = body.isometry();
        }
        // Far from tissue nothing is asked.
        let asks = body.moves() && !cavity.is_past_tissue(body.place());
        let point = if asks { body.place() } else { Vec3::INFINITY };
        if probe.point != point {
            *probe = TissueProbe { point, ..default() };
        }
    }
}

/// What a probe at a chip's centre tells.
fn tissue_near(probe: &TissueProbe, cavity: &Cavity) -> Option<TissueNear> {
    if !probe.point.is_finite() {
        return None;
    }
    match (probe.nearest, probe.inside) {
        (Some(nearest), false) => {
            let away = probe.point - nearest;
            Some(TissueNear {
                out: away.try_normalize()?,
                distance: away.length(),
            })
        }
        (Some(nearest), true) => {
            let towards = nearest - probe.point;
            let out = towards.try_normalize()?;
            let to_channel = (cavity.channel.nearest(probe.point) - probe.point).normalize_or(out);
            // A way out that leads away from the channel ends outside of the organ.
            let out = if out.dot(to_channel) < AWAY { to_channel } else { out };
            Some(TissueNear {
                out,
                distance: -towards.length(),
            })
        }
        // Too deep for a way out: back to the channel.
        (None, true) => {
            let middle = cavity.channel.nearest(probe.point);
            Some(TissueNear {
                out: (middle - probe.point).normalize_or(cavity.channel.direction()),
                distance: -DEEP_MM,
            })
        }
        (None, false) => None,
    }
}
