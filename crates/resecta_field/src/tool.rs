//! What cuts: a volume given by its signed distance, negative inside.

use glam::{DVec3, Vec3};
use resecta_solver::LoopSweep;

use crate::FieldError;
use crate::lanes;
use crate::stroke::Swept;
use crate::sublattice::{LANES, Lanes};

/// A volume that is cut away, in the tissue's current coordinates.
#[derive(Debug, Clone, PartialEq)]
pub enum Tool {
    /// A ball.
    Sphere {
        /// Its middle, mm.
        centre: DVec3,
        /// Its radius, mm, above 0.
        radius_mm: f64,
    },
    /// Half a cylinder with flat ends: a half disc moved along a straight line.
    HalfCylinder {
        /// Middle of the half disc's straight side at the start, mm.
        from: DVec3,
        /// The same at the end, mm.
        to: DVec3,
        /// Direction from the straight side to the deepest point; what of it is along the line is taken off.
        down: DVec3,
        /// Radius of the half disc, mm, above 0.
        radius_mm: f64,
    },
    /// What a cutting loop sweeps over in a step. [`crate::LoopStroke`] makes these from poses.
    Loop {
        /// The step.
        sweep: LoopSweep,
        /// How far the same stroke had come before this step, mm; 0 for its first step. Behind the start of a step of a
        /// stroke under way there is no end face, and so no ridge.
        run_mm: f64,
        /// How thick the outermost layer of it is that vaporises instead of becoming part of a chip, mm; 0 or more. Where there is no wire,
        /// at the open side and at both ends, nothing does.
        kerf_mm: f64,
        /// Tissue thinner than this that the step would leave beside its wall vaporises, too, mm; 0 or more. More than twice the field's
        /// spacing counts as twice.
        thin_mm: f64,
    },
}

/// A box with its own axes that holds a tool.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    pub middle: DVec3,
    /// Orthonormal.
    pub axes: [DVec3; 3],
    pub half: DVec3,
}

/// A tool made ready for many points.
pub enum Prepared {
    Sphere(DVec3, f64),
    Swept(Box<Swept>),
}

impl Tool {
    /// Checks the numbers and makes ready; `reach_mm` is how far inside what is gone values matter. None for a tool
    /// that has no volume: a loop or half disc that does not move.
    pub(crate) fn prepare(&self, reach_mm: f64) -> Result<Option<Prepared>, FieldError> {
        Ok(match self {
            Tool::Sphere { centre, radius_mm } => {
                finite("sphere", "centre", *centre)?;
                positive("sphere", "radius", *radius_mm)?;
                Some(Prepared::Sphere(*centre, *radius_mm))
            }
            &Tool::HalfCylinder {
                from,
                to,
                down,
                radius_mm,
            } => {
                const NAME: &str = "half cylinder";
                finite(NAME, "from", from)?;
                finite(NAME, "to", to)?;
                finite(NAME, "down", down)?;
                positive(NAME, "radius", radius_mm)?;
                let Some(travel) = (to - from).try_normalize() else {
                    return Ok(None);
                };
                let down = direction(NAME, "down", down.reject_from_normalized(travel))?;
                let swept = Swept::straight(from, to, travel, down, radius_mm);
                Some(Prepared::Swept(Box::new(swept)))
            }
            Tool::Loop {
                sweep,
                run_mm,
                kerf_mm,
                thin_mm,
            } => {
                const NAME: &str = "loop";
                for pose in [&sweep.from, &sweep.to] {
                    finite(NAME, "centre", pose.centre)?;
                    finite(NAME, "travel", pose.travel)?;
                    finite(NAME, "down", pose.down)?;
                    let travel = direction(NAME, "travel", pose.travel)?;
                    direction(NAME, "down", pose.down.reject_from_normalized(travel))?;
                }
                positive(NAME, "width", sweep.width_mm)?;
                positive(NAME, "depth", sweep.depth_mm)?;
                for (field, length) in [("run", *run_mm), ("kerf", *kerf_mm), ("thin", *thin_mm)] {
                    if !length.is_finite() || length < 0.0 {
                        return Err(refused(NAME, field, length, "a finite length of 0 or more"));
                    }
                }
                let lengths = [*run_mm, reach_mm, *kerf_mm, *thin_mm];
                (sweep.from != sweep.to).then(|| Prepared::Swept(Box::new(Swept::new(sweep, lengths))))
            }
        })
    }
}

impl Prepared {
    /// What places are given relative to, so that single precision holds near the tool.
    pub fn origin(&self) -> DVec3 {
        match self {
            Prepared::Sphere(centre, _) => *centre,
            Prepared::Swept(swept) => swept.origin,
        }
    }

    /// How thick the outermost layer of what goes is that vaporises, mm.
    pub fn kerf_mm(&self) -> f32 {
        match self {
            Prepared::Sphere(..) => 0.0,
            Prepared::Swept(swept) => swept.kerf_mm(),
        }
    }

    /// Signed distances of eight places, mm; those that hold where tissue is gone already: less where a face of this
    /// volume is only where one step of a stroke ends and the next begins; and of these, those from the part of it that does not vaporise.
    #[inline(always)]
    pub fn distances(&self, places: &[Lanes; 3]) -> [Lanes; 3] {
        match self {
            Prepared::Sphere(_, radius) => {
                let squares = lanes::dot(places, places);
                [lanes::map(&squares, |square| square.sqrt() - *radius as f32); 3]
            }
            Prepared::Swept(swept) => swept.distances(places),
        }
    }

    /// Tissue thinner than this beside a wall that a current leaves vaporises, mm.
    pub fn thin_mm(&self) -> f32 {
        match self {
            Prepared::Sphere(..) => 0.0,
            Prepared::Swept(swept) => swept.thin_mm(),
        }
    }

    /// Signed distance of a place, mm, from the wall that the tool leaves there, negative inside, and the unit normal of that wall, out of
    /// the tool. `None` if the loop's plane does not pass the place in this step. `place`: mm, relative to the tool's origin.
    pub fn wall(&self, place: Vec3) -> Option<(f32, Vec3)> {
        match self {
            Prepared::Sphere(..) => None,
            Prepared::Swept(swept) => swept.wall(place),
        }
    }

    /// What no place within `radius` of these is nearer to the tool than, mm; of no matter where it is below 0.
    #[inline(always)]
    pub fn floors(&self, places: &[Lanes; 3], radius: &Lanes) -> Lanes {
        match self {
            Prepared::Sphere(..) => {
                let mut floors = self.distances(places)[0];
                (0..LANES).for_each(|l| floors[l] -= radius[l]);
                floors
            }
            Prepared::Swept(swept) => swept.floors(places, radius),
        }
    }

    pub fn bounds(&self) -> Bounds {
        match self {
            Prepared::Sphere(centre, radius) => Bounds {
                middle: *centre,
                axes: DVec3::AXES,
                half: DVec3::splat(*radius),
            },
            Prepared::Swept(swept) => swept.bounds(),
        }
    }
}

fn refused(tool: &'static str, field: &'static str, value: f64, expected: &'static str) -> FieldError {
    FieldError::Tool {
        tool,
        field,
        value,
        expected,
    }
}

/// Largest coordinate or length of a tool, mm: 100 m, where single precision still tells a hundredth of a millimetre.
const LARGEST_MM: f64 = 1e5;
/// Smallest length of a tool, mm.
const SMALLEST_MM: f64 = 1e-6;

pub fn finite(tool: &'static str, field: &'static str, value: DVec3) -> Result<(), FieldError> {
    let is_good = |component: f64| component.abs() <= LARGEST_MM;
    match value.to_array().into_iter().find(|&component| !is_good(component)) {
        Some(component) => Err(refused(tool, field, component, "a finite vector of at most 1e5 mm")),
        None => Ok(()),
    }
}

pub fn positive(tool: &'static str, field: &'static str, value: f64) -> Result<(), FieldError> {
    if (SMALLEST_MM..=LARGEST_MM).contains(&value) {
        return Ok(());
    }
    Err(refused(tool, field, value, "a length of 1e-6 to 1e5 mm"))
}

fn direction(tool: &'static str, field: &'static str, value: DVec3) -> Result<DVec3, FieldError> {
    value
        .try_normalize()
        .ok_or_else(|| refused(tool, field, value.length(), "a direction, `down` not along `travel`"))
}
