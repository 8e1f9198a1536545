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
    walls::{Cavity, Sheath, TissueAt, TissueNear},
};

/// A tip that comes further in a step was placed anew and pushes nothing, mm.
const PLACED_ANEW_MM: f32 = 15.0;
/// Range of a probe, mm. A chip in tissue without a surface in that range is taken to be this deep.
const DEEP_MM: f32 = 3.0;
/// Tissue closer than this may act on a chip in the next step, mm: it keeps chips a millimetre away.
const ACTS_MM: f32 = 1.5;
/// A resting chip probes for tissue once in this many steps.
const ASKS_EVERY: u64 = 15;
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
    /// What stands for each body.
    shown: Vec<Shown>,
    sheath: Option<Isometry3d>,
    steps: u64,
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
            shown: Vec::new(),
            sheath: None,
            steps: 0,
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
    pub fn entities(&self) -> impl Iterator<Item = Entity> {
        self.shown.iter().map(|shown| shown.entity)
    }
}

/// What stands for a body in the world.
#[derive(Debug, Clone, Copy)]
struct Shown {
    entity: Entity,
    /// Where it last probed for tissue, and how far from there it could go before tissue acts on it, mm.
    asked_at: Vec3,
    free_mm: f32,
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
        let entity = commands.spawn((Name::new(format!("Chip {id}")), floating, probe)).id();
        chips.shown.push(Shown {
            entity,
            asked_at: body.place(),
            free_mm: 0.0,
        });
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

    let cavity = chips.pool.cavity().clone();
    let answers: Vec<TissueAt> = (chips.shown.iter_mut())
        .map(|known| {
            let probe = shown.get(known.entity).ok().map(|(_, probe)| *probe);
            // A chip of this step has not probed yet.
            let Some(probe) = probe.filter(|probe| probe.point.is_finite()) else {
                return TissueAt::Unknown;
            };
            let tissue = tissue_at(&probe, &cavity);
            let distance = tissue.near().map_or(DEEP_MM, |tissue| tissue.distance);
            (known.asked_at, known.free_mm) = (probe.point, distance - ACTS_MM);
            tissue
        })
        .collect();
    let tissue = |index: usize| answers.get(index).copied().unwrap_or(TissueAt::Unknown);
    let ids: Vec<u64> = chips.pool.bodies().iter().map(|body| body.id).collect();
    let happened = chips.pool.step(seconds, &surroundings, tissue);
    let entity_of = |id: u64| {
        ids.binary_search(&id)
            .ok()
            .and_then(|index| Some(chips.shown.get(index)?.entity))
    };

    for (id, reason) in happened.held {
        if let Some(chip) = entity_of(id) {
            held.write(ChipHeld { chip, reason });
        }
    }
    let flushed: Vec<Entity> = happened.flushed.into_iter().filter_map(entity_of).collect();
    for entity in flushed {
        chips.shown.retain(|other| other.entity != entity);
        commands.entity(entity).try_despawn();
    }
    chips.steps += 1;
    for (body, known) in chips.pool.bodies().iter().zip(&chips.shown) {
        let Ok((mut shown, mut probe)) = shown.get_mut(known.entity) else {
            continue;
        };
        if shown.before != shown.now || shown.now != body.isometry() {
            shown.before = shown.now;
            shown.now = body.isometry();
        }
        // Far from tissue no chip probes. Elsewhere a resting chip probes by turns, and so does one that has gone less than half of its free
        // way: tissue may have come the other half.
        let has_turn = body.held.is_none() && (chips.steps + body.id).is_multiple_of(ASKS_EVERY);
        let has_gone = body.moves() && body.place().distance(known.asked_at) >= 0.5 * known.free_mm;
        let asks = (has_gone || has_turn) && !cavity.is_past_tissue(body.place());
        let point = if asks { body.place() } else { Vec3::INFINITY };
        if probe.point != point {
            *probe = TissueProbe { point, ..default() };
        }
    }
}

/// The answer of a probe at a chip's centre.
fn tissue_at(probe: &TissueProbe, cavity: &Cavity) -> TissueAt {
    match (probe.nearest, probe.inside) {
        (None, false) => TissueAt::Far,
        (nearest, inside) => {
            tissue_near(probe.point, nearest, inside, cavity).map_or(TissueAt::Unknown, TissueAt::Near)
        }
    }
}

/// The tissue near a point, given its nearest surface point or that the point lies inside; `None` if no way out can be computed.
fn tissue_near(point: Vec3, nearest: Option<Vec3>, inside: bool, cavity: &Cavity) -> Option<TissueNear> {
    let Some(nearest) = nearest else {
        // Too deep for a way out: back to the channel.
        let middle = cavity.channel.nearest(point);
        return Some(TissueNear {
            out: (middle - point).normalize_or(cavity.channel.direction()),
            distance: -DEEP_MM,
        });
    };
    let away = point - nearest;
    if !inside {
        return Some(TissueNear {
            out: away.try_normalize()?,
            distance: away.length(),
        });
    }
    let out = (-away).try_normalize()?;
    let to_channel = (cavity.channel.nearest(point) - point).normalize_or(out);
    // A way out that leads away from the channel ends outside of the organ.
    let out = if out.dot(to_channel) < AWAY { to_channel } else { out };
    Some(TissueNear {
        out,
        distance: -away.length(),
    })
}
