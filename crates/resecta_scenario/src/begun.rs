//! What was done before an exercise begins: trenches that somebody cut, and whether they bleed.

use std::collections::BTreeMap;

use bevy::{math::DVec3, prelude::*};
use resecta_anatomy::Landmarks;
use resecta_solver::LoopPose;
use resecta_tissue::{LoopStroke, Tissue, TissueResected, Tool};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    active::ActiveExercise,
    errors::RuleError,
    exercise::{HeightRange, Models},
    rules::{Faults, of_height},
    state::RunState,
    walls::Walls,
};

/// Most trenches.
const TRENCHES: usize = 32;

/// How far inside the wall of the urethra the open side of a trench's profile is, mm: nothing of the wall is left over it.
const INSIDE_MM: f64 = 2.0;
/// Longest way from one profile to the next, mm: the wall is straight enough between them.
const STEP_MM: f64 = 2.0;

/// How far the operation has come when the exercise begins. What is gone then counts for no metric, and shares are shares of what
/// is left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Begun {
    /// Trenches in the wall of the urethra, at most 32. Default: none.
    #[serde(default)]
    #[schemars(length(max = 32))]
    pub trenches: Vec<Trench>,
    /// Whether the vessels that they opened bleed, or were closed. Default true. Without `models.water.bleeding` there are none.
    #[serde(default = "yes")]
    pub bleeding: bool,
    /// Share of blood in the water, 0 to 1. Default 0; more needs `models.water.turbidity`.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub blood_in_water: f64,
}

fn yes() -> bool {
    true
}

/// A trench along the urethra, half an ellipse across.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Trench {
    /// Hour on the clock face at which it is deepest, 0 to 12.
    #[schemars(range(min = 0.0, max = 12.0), extend("x-unit" = "h"))]
    pub hour: f64,
    /// Heights from its end nearer to the apex to the other.
    pub height: HeightRange,
    /// Depth below the wall of the urethra, mm, 1 to 40.
    #[schemars(range(min = 1.0, max = 40.0))]
    pub depth_mm: f64,
    /// Width at the wall, mm, 2 to 40.
    #[schemars(range(min = 2.0, max = 40.0))]
    pub width_mm: f64,
}

/// Counts what tears off during the briefing as gone before the start: nobody has touched it.
pub(crate) fn tear_before(
    mut active: ResMut<ActiveExercise>,
    mut resections: MessageReader<TissueResected>,
    state: Res<RunState>,
) {
    for resection in resections.read() {
        if *state == RunState::Briefing && resection.tissue == active.tissue {
            for &(pentahedron, volume_mm3) in &resection.taken_mm3 {
                *active.gone_mm3.entry(pentahedron).or_default() += volume_mm3;
            }
        }
    }
}

impl Begun {
    /// Checks every rule that needs no gland.
    pub(crate) fn check(&self, models: &Models, faults: &mut Faults) {
        faults.require(!self.trenches.is_empty() || self.blood_in_water != 0.0, || {
            RuleError::new(
                "begun",
                "empty",
                "trenches, or blood in the water, or no `begun` at all",
            )
        });
        faults.require(self.trenches.len() <= TRENCHES, || {
            let count = format!("{} trenches", self.trenches.len());
            RuleError::new("begun.trenches", count, format!("at most {TRENCHES}"))
        });
        let blood = self.blood_in_water;
        faults.require((0.0..=1.0).contains(&blood), || {
            RuleError::new("begun.blood_in_water", blood, "a share from 0 to 1")
        });
        let is_murky = models.water.as_ref().is_some_and(|water| water.turbidity.is_some());
        faults.require(blood == 0.0 || is_murky, || {
            RuleError::new(
                "begun.blood_in_water",
                blood,
                "0, or `models.water.turbidity` to see it by",
            )
        });
        for (index, trench) in self.trenches.iter().enumerate() {
            let field = |name: &str| format!("begun.trenches[{index}].{name}");
            faults.require((0.0..=12.0).contains(&trench.hour), || {
                RuleError::new(field("hour"), trench.hour, "an hour from 0 to 12")
            });
            of_height(&field("height"), trench.height, faults);
            faults.require((1.0..=40.0).contains(&trench.depth_mm), || {
                RuleError::new(field("depth_mm"), trench.depth_mm, "1 to 40 mm")
            });
            faults.require((2.0..=40.0).contains(&trench.width_mm), || {
                RuleError::new(field("width_mm"), trench.width_mm, "2 to 40 mm")
            });
        }
    }

    /// Cuts the trenches into a gland, and returns what each of its pentahedra lost, mm³ at rest.
    pub(crate) fn cut(
        &self,
        gland: &mut Tissue,
        models: &Models,
        walls: &Walls,
        landmarks: &Landmarks,
    ) -> Result<BTreeMap<u32, f64>, RuleError> {
        let mut gone_mm3 = BTreeMap::new();
        for (index, trench) in self.trenches.iter().enumerate() {
            let cuts = trench.cuts(walls, landmarks);
            let gone = gland.begin(&cuts, models.detail, models.collapse).map_err(|error| {
                let field = format!("begun.trenches[{index}]");
                RuleError::new(field, error, "a trench that can be cut into this gland")
            })?;
            if gone.is_empty() {
                let expected = "tissue where it is: another height or hour, or more depth";
                return Err(RuleError::new(
                    format!("begun.trenches[{index}]"),
                    "empty on this gland",
                    expected,
                ));
            }
            for (pentahedron, gone) in gone {
                *gone_mm3.entry(pentahedron).or_default() += gone;
            }
        }
        Ok(gone_mm3)
    }
}

impl Trench {
    /// What a loop sweeps over that cuts it; none in a gland without walls or the landmark.
    pub(crate) fn cuts(&self, walls: &Walls, landmarks: &Landmarks) -> Vec<Tool> {
        let ends = self.height.ends_mm(landmarks).zip(walls.heights_mm());
        let Some(((low, high), (first, last))) = ends else {
            return Vec::new();
        };
        let (low, high) = (low.max(first), high.min(last));
        if low >= high {
            return Vec::new();
        }
        let steps = ((high - low) / STEP_MM).ceil();
        let poses = (0..=steps as u32).filter_map(|step| {
            let z = low + (high - low) * f64::from(step) / steps;
            let (wall, outwards) = walls.urethra_at(z, self.hour)?;
            Some(LoopPose {
                centre: (wall - outwards * INSIDE_MM).extend(z),
                travel: DVec3::Z,
                down: outwards.extend(0.0),
            })
        });
        let mut stroke: Option<LoopStroke> = None;
        let mut cuts = Vec::new();
        for pose in poses {
            match &mut stroke {
                Some(stroke) => cuts.push(stroke.step_to(pose)),
                None => stroke = Some(LoopStroke::new(pose, self.width_mm, self.depth_mm + INSIDE_MM)),
            }
        }
        cuts
    }
}
