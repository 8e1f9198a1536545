//! The vessels of a tissue: data, and what has become of each.

use bevy::prelude::*;
use resecta_solver::TissuePoint;
use serde::{Deserialize, Serialize};

use crate::{
    circulation::LEAST_SHARE,
    refused::{FluidError, check},
};

/// Share of a pentahedron that must be left for its vessel to stay closed.
const INTACT_SHARE: f64 = 0.5;

/// What a vessel carries.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VesselKind {
    /// Bleeds in a pulsing jet, whatever the bladder's pressure.
    Arterial,
    /// Oozes, the less the fuller the bladder, and lets irrigant in where the bladder's pressure is high.
    Venous,
}

impl VesselKind {
    /// How many kinds there are.
    pub const COUNT: usize = 2;
}

/// A vessel where it can be cut. Its data go with the tissue at rest.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Vessel {
    /// The pentahedron that carries it.
    pub pentahedron: u32,
    /// Where it opens, mm, in the tissue at rest: in or near the pentahedron.
    pub place: Vec3,
    /// Unit direction in which it bleeds, in the tissue at rest.
    pub direction: Vec3,
    /// What it carries.
    pub kind: VesselKind,
    /// Diameter, mm; above 0, to 20. For the picture: bleeding follows from the rate.
    pub diameter_mm: f32,
    /// Mean rate when it has just been opened, against no pressure in the bladder, ml/s; 0 to 100.
    pub rate_ml_per_s: f64,
    /// Time in which a clot lowers the rate to 1/e, s; 0.001 or more, infinite for one that never clots.
    pub clotting_s: f64,
}

impl Vessel {
    /// What it loses in all against no pressure if nobody closes it, ml.
    pub fn yield_ml(&self) -> f64 {
        self.rate_ml_per_s * self.clotting_s * (1.0 - LEAST_SHARE)
    }

    fn check(&self) -> Result<(), FluidError> {
        let finite = |field, vector: Vec3| {
            let offending = vector.to_array().into_iter().find(|component| !component.is_finite());
            offending.map_or(Ok(()), |value| {
                Err(FluidError {
                    field,
                    value: value.into(),
                    expected: "finite components",
                })
            })
        };
        finite("place", self.place)?;
        finite("direction", self.direction)?;
        if !self.direction.is_normalized() {
            return Err(FluidError {
                field: "length of direction",
                value: self.direction.length().into(),
                expected: "1",
            });
        }
        check("diameter_mm", self.diameter_mm.into(), 1e-6..=20.0, "above 0, to 20 mm")?;
        check("rate_ml_per_s", self.rate_ml_per_s, 0.0..=100.0, "0 to 100 ml/s")?;
        check("clotting_s", self.clotting_s, 1e-3..=f64::INFINITY, "0.001 s or more")
    }
}

/// What has become of a vessel.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VesselState {
    /// Not yet cut.
    #[default]
    Intact,
    /// Cut, and bleeding.
    Open,
    /// Closed by a current, for good.
    Coagulated,
    /// Closed by its own clot, for good.
    Clotted,
    /// It named no pentahedron of its tissue, and never opens.
    PutAside,
}

/// A vessel that bleeds, as it is now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenVessel<'a> {
    /// Its index in the list.
    pub index: usize,
    /// Its data.
    pub vessel: &'a Vessel,
    /// Where it bleeds now, mm, world.
    pub place: Vec3,
    /// Unit direction in which it bleeds now.
    pub direction: Vec3,
    /// Mean rate in the last step, with pulse, clot and the bladder's pressure, ml/s.
    pub rate_ml_per_s: f64,
    /// What its clot has left of it, 0.01 to 1.
    pub share: f64,
    /// For how long a coagulating loop has been near enough to close it, s; 0 for none.
    pub dwell_s: f64,
}

impl OpenVessel<'_> {
    /// What it would go on to lose against no pressure, on the mean of beats, if nobody closes it, ml: the integral of
    /// r exp(-t / τ) until its clot does. Infinite for one that never clots.
    pub fn to_come_ml(&self) -> f64 {
        let Vessel {
            rate_ml_per_s,
            clotting_s,
            ..
        } = *self.vessel;
        // Infinity times nothing would be no number.
        match rate_ml_per_s {
            0.0 => 0.0,
            rate => rate * clotting_s * (self.share - LEAST_SHARE).max(0.0),
        }
    }
}

/// Why a vessel closed.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClosedBy {
    /// The coagulating current of the tool of this entity.
    Coagulation(Entity),
    /// Its own clot.
    Clot,
}

/// A vessel was cut and bleeds from now on. Ordered by tissue (as they came into the app) and index.
#[derive(Message, Debug, Clone, Copy, PartialEq)]
pub struct VesselOpened {
    /// The tissue.
    pub tissue: Entity,
    /// Index in its [`Vessels`].
    pub vessel: usize,
    /// What it carries.
    pub kind: VesselKind,
    /// Where, mm, world.
    pub place: Vec3,
}

/// A vessel bleeds no more. Ordered as [`VesselOpened`].
#[derive(Message, Debug, Clone, Copy, PartialEq)]
pub struct VesselClosed {
    /// The tissue.
    pub tissue: Entity,
    /// Index in its [`Vessels`].
    pub vessel: usize,
    /// What it carries.
    pub kind: VesselKind,
    /// Where, mm, world.
    pub place: Vec3,
    /// Why.
    pub by: ClosedBy,
    /// What it lost in all, ml.
    pub lost_ml: f64,
}

/// The vessels of a tissue: on the entity with the [`Tissue`](resecta_tissue::Tissue).
#[derive(Component, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Component, from_reflect = false)]
pub struct Vessels {
    #[reflect(ignore)]
    pub(crate) list: Vec<(Vessel, Course)>,
    /// Ordinal of the list in its app: decides the order of sums and messages, since entity ids may not.
    #[reflect(ignore)]
    pub(crate) ordinal: Option<u64>,
    #[reflect(ignore)]
    pub(crate) lost_ml: [f64; VesselKind::COUNT],
}

/// What has become of a vessel so far.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Course {
    pub state: VesselState,
    /// The pentahedron that carries it now.
    pub carrier: u32,
    /// Whether it opens without a cut: what carries it tore.
    pub is_torn: bool,
    /// Where the surface bleeds; none until it is looked for.
    pub mouth: Option<TissuePoint>,
    pub place: Vec3,
    pub direction: Vec3,
    /// Since it was opened, s.
    pub age_s: f64,
    /// How long a coagulating loop has been near, s.
    pub dwell_s: f64,
    /// What it loses in the present step against no pressure, ml.
    pub due_ml: f64,
    pub rate_ml_per_s: f64,
    pub lost_ml: f64,
}

impl Vessels {
    /// Vessels of a tissue, none of them cut.
    ///
    /// # Errors
    /// [`VesselError`] names the first vessel with a value that makes no sense. Whether the pentahedra exist shows in the first
    /// step: a vessel that names none is put aside and told.
    pub fn new(vessels: Vec<Vessel>) -> Result<Self, VesselError> {
        for (vessel, data) in vessels.iter().enumerate() {
            data.check().map_err(|error| VesselError::Vessel { vessel, error })?;
        }
        Ok(Self {
            list: vessels
                .into_iter()
                .map(|vessel| (vessel, Course::of(&vessel)))
                .collect(),
            ..default()
        })
    }

    /// Closes those that a cut has reached already and that have bled in no app yet: somebody coagulated them.
    pub fn close_cut(&mut self, tissue: &resecta_solver::Tissue) {
        for (_, course) in &mut self.list {
            if course.state == VesselState::Intact && is_cut(tissue, course.carrier) {
                course.state = VesselState::Coagulated;
            }
        }
    }

    /// Adds a vessel that bleeds from the next step on: what carries it was torn, not cut.
    ///
    /// # Errors
    /// [`VesselError::Vessel`] names it, by the index that it would have had, if a value makes no sense.
    pub fn tear(&mut self, vessel: Vessel) -> Result<(), VesselError> {
        let index = self.list.len();
        vessel
            .check()
            .map_err(|error| VesselError::Vessel { vessel: index, error })?;
        let course = Course {
            is_torn: true,
            ..Course::of(&vessel)
        };
        self.list.push((vessel, course));
        Ok(())
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All of them, with what has become of each.
    pub fn iter(&self) -> impl Iterator<Item = (&Vessel, VesselState)> {
        self.list.iter().map(|(vessel, course)| (vessel, course.state))
    }

    /// What has become of one; none past the end.
    pub fn state(&self, vessel: usize) -> Option<VesselState> {
        self.list.get(vessel).map(|(_, course)| course.state)
    }

    /// Those that bleed, by index.
    pub fn open(&self) -> impl Iterator<Item = OpenVessel<'_>> {
        let open = self.list.iter().enumerate();
        open.filter(|(_, (_, course))| course.state == VesselState::Open)
            .map(|(index, (vessel, course))| OpenVessel {
                index,
                vessel,
                place: course.place,
                direction: course.direction,
                rate_ml_per_s: course.rate_ml_per_s,
                share: course.share(vessel),
                dwell_s: course.dwell_s,
            })
    }

    /// Blood lost through vessels of a kind, ml.
    pub fn lost_ml(&self, kind: VesselKind) -> f64 {
        self.lost_ml[kind as usize]
    }

    /// Blood lost through one, ml; 0 past the end.
    pub fn lost_by_ml(&self, vessel: usize) -> f64 {
        self.list.get(vessel).map_or(0.0, |(_, course)| course.lost_ml)
    }
}

/// Whether so much of a pentahedron has been cut away that its vessel lies open.
pub(crate) fn is_cut(tissue: &resecta_solver::Tissue, pentahedron: u32) -> bool {
    (pentahedron as usize) < tissue.pentahedron_count() && tissue.fill(pentahedron) <= INTACT_SHARE
}

impl Course {
    /// That of a vessel that nothing has happened to.
    fn of(vessel: &Vessel) -> Self {
        Course {
            state: VesselState::Intact,
            carrier: vessel.pentahedron,
            is_torn: false,
            mouth: None,
            place: vessel.place,
            direction: vessel.direction,
            age_s: 0.0,
            dwell_s: 0.0,
            due_ml: 0.0,
            rate_ml_per_s: 0.0,
            lost_ml: 0.0,
        }
    }

    /// Whether it bleeds from now on, by a tear.
    pub fn tears(&self) -> bool {
        self.is_torn && self.state == VesselState::Intact
    }

    /// What the clot has left of the rate.
    pub fn share(&self, vessel: &Vessel) -> f64 {
        (-self.age_s / vessel.clotting_s).exp()
    }
}

/// Why there are no vessels.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VesselError {
    /// A value of a vessel makes no sense.
    #[error("vessel {vessel}: {error}")]
    Vessel {
        /// Which one.
        vessel: usize,
        /// What is wrong with it.
        error: FluidError,
    },
    /// An option of the generator makes no sense.
    #[error("{0}")]
    Option(#[from] FluidError),
    /// More vessels than a gland has pentahedra to carry them.
    #[error("{wanted} vessels are too many for {places} pentahedra")]
    TooMany {
        /// How many were asked for.
        wanted: usize,
        /// How many pentahedra there are for them.
        places: usize,
    },
}
