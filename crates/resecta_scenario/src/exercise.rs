//! The exercise: what a `*.exercise.ron` file says.

use resecta_anatomy::Zone;
use resecta_chips::ChipSettings;
use resecta_instrument::InstrumentState;
use resecta_solver::{CollapseLaw, ShearResistance};
use resecta_tissue::{CutDetail, CuttingRule};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    begun::Begun, extension::GoalId, limits::Limits, metrics::MetricId, pars::Pars, shown::ShownBy, steps::Step,
    trigger::Trigger, water::Water,
};

/// One exercise, as its author wrote it. Absent optional fields take the default stated beside them; `Some(..)` may be
/// left out around a value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exercise {
    /// Name shown to the player.
    pub title: String,
    /// What to do, shown before the start.
    pub briefing: String,
    /// The gland: the name of a shipped case (`"medium"` is `cases/medium.case.ron` among the assets) or of one of the exercise's own
    /// mod, `"mod/name"` of a mod that it needs, or the path of a `*.case.ron` file, relative to the exercise file.
    pub case: String,
    /// Angle between two rays of the lattice, 2 to 60 degrees; the one knob of resolution. Default 14. (A lattice of 2
    /// degrees has about 300 times the nodes of one of 14: far from playable, still within memory.)
    #[serde(default = "default_alpha_deg")]
    #[schemars(range(min = 2.0, max = 60.0))]
    pub alpha_deg: f64,
    /// Material preset, in place of the case's own.
    #[serde(default)]
    pub material: Option<String>,
    /// Which parts of the tissue model are on.
    #[serde(default)]
    pub models: Models,
    /// How far the operation has come when the exercise begins. Default: nothing was cut.
    #[serde(default)]
    pub begun: Option<Begun>,
    /// Where the instrument enters and how it starts.
    #[serde(default)]
    pub instrument: InstrumentSetup,
    /// The tissue that the exercise is about.
    pub marked: Marked,
    /// What to do one after the other, in an exercise that teaches by doing. Default: none.
    #[serde(default)]
    pub steps: Vec<Step>,
    /// What must be reached; the run ends when all are. At least one.
    #[schemars(length(min = 1))]
    pub goals: Vec<Goal>,
    /// What ends a run early.
    pub limits: Limits,
    /// Lines of the score; the sum of their points is the best total. At least one.
    #[schemars(length(min = 1))]
    pub scoring: Vec<ScoreRule>,
    /// Totals that earn bronze, silver and gold. Default: none.
    #[serde(default)]
    pub total_pars: Option<Pars>,
    /// Who shows how it is done, to whoever asks at the briefing: `Careful`, a scripted player, or `Script("name")`. Default: nobody.
    #[serde(default)]
    pub shown_by: Option<ShownBy>,
}

/// With 8 degrees instead the same script takes three times as long, and as much tissue lies inside the sheath.
pub(crate) fn default_alpha_deg() -> f64 {
    14.0
}

impl Exercise {
    /// Whether a goal, or a step, is that tissue goes.
    pub fn asks_for_tissue(&self) -> bool {
        let removes = |goal: &Goal| matches!(goal, Goal::RemoveMarked { .. });
        let cuts = |step: &Step| {
            matches!(
                step.until,
                Trigger::Cut { .. } | Trigger::MarkedRemoved { .. } | Trigger::ZoneRemoved { .. }
            )
        };
        self.goals.iter().any(removes) || self.steps.iter().any(cuts)
    }
}

/// Which parts of the tissue model are on; what is off costs nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Models {
    /// How the wall answers a cut: `CompressionForce(share: 0.05)` (default; share 0 to 1 of the papers' force),
    /// `HydraulicPressure(resistance_un: 200)` (µN for each whole volume element lost, 0 or more) or `None`.
    pub collapse: Option<CollapseLaw>,
    /// How the lattice resists shear, in place of the material's own way.
    pub shear: Option<ShearResistance>,
    /// Poisson's ratio: 0.25 to 0.49 with diagonals, default 0.45; 0 to 0.49 without, default what the springs have. With diagonals, 0.25
    /// leaves it to the springs, which takes half the time and lets elements turn inside out: see `docs/materials.md`.
    #[schemars(range(min = 0.0, max = 0.49))]
    pub poisson_ratio: Option<f64>,
    /// Whether the sheath and the loop meet tissue. Default on; off, nothing can be cut by hand.
    pub collision: bool,
    /// What a cut takes: `Sweep`, the volume swept by the loop (default), or `Sphere(radius_mm: 5.0)`, the papers' rule.
    #[serde(with = "CuttingRuleText")]
    pub cutting: CuttingRule,
    /// How finely: `Field(spacing_mm: 0.5)`, a boundary inside the volume elements with points no further apart (default), or
    /// `Elements`, whole ones as in the papers.
    #[serde(with = "CutDetailText")]
    pub detail: CutDetail,
    /// Blood and water. Default: none, a dry scene.
    pub water: Option<Water>,
    /// Pressure that the lumen is held open with where `water` is absent, which has a pressure of its own: cmH2O, -100 to 100. Default: none.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub water_pressure_cmh2o: Option<f64>,
    /// What is cut free floats and gathers in the bladder: fields of [`ChipSettings`]; absent, it vanishes.
    pub chips: Option<ChipSettings>,
}

impl Default for Models {
    fn default() -> Self {
        Self {
            collapse: Some(CollapseLaw::default()),
            shear: None,
            poisson_ratio: None,
            collision: true,
            cutting: CuttingRule::Sweep,
            detail: CutDetail::default(),
            water: None,
            water_pressure_cmh2o: None,
            chips: None,
        }
    }
}

/// [`CuttingRule`] as it is written in a file: the tissue crate reads no files.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "CuttingRule", deny_unknown_fields)]
#[schemars(rename = "CuttingRule")]
enum CuttingRuleText {
    /// The volume swept by the loop.
    Sweep,
    /// A sphere about the loop's middle, the papers' rule.
    Sphere {
        /// Its radius, mm; above 0.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_mm: f32,
    },
}

/// [`CutDetail`] as it is written in a file.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(remote = "CutDetail", deny_unknown_fields)]
#[schemars(rename = "CutDetail")]
enum CutDetailText {
    /// Whole volume elements, as in the papers.
    Elements,
    /// A boundary inside the volume elements.
    Field {
        /// The farthest that its points are apart, mm; 0.2 to 2.
        #[schemars(range(min = 0.2, max = 2.0))]
        spacing_mm: f32,
    },
}

/// Where the instrument enters and how it starts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct InstrumentSetup {
    /// The point that the sheath turns about, case coordinates in mm. Default: the centre of the external sphincter.
    pub pivot_mm: Option<[f32; 3]>,
    /// Direction of the sheath at pitch and yaw 0, of any length. Default: from the pivot to the bladder neck.
    pub axis: Option<[f32; 3]>,
    /// Inclination of the telescope's view towards the loop, degrees: 0, 12 or 30. Default: 12.
    pub optic_deg: Option<f32>,
    /// State at the start, within the limits of the instrument; fields left out are 0, and the taps are left out
    /// (`models.water.irrigation` has them). Default: on the axis with the tip
    /// at the height of the verumontanum, loop drawn in, pedals up.
    pub start: Option<InstrumentState>,
}

/// A region of the gland in a surgeon's terms. Tissue is inside when the centroid of its volume element, at rest, meets
/// every condition. All ranges contain their lower end and not their upper end, so adjoining regions share nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Marked {
    /// The zones that it covers, at least one: `LateralLobe`, `MiddleLobe`, `Peripheral`, `Other`.
    #[schemars(length(min = 1))]
    pub zones: Vec<Zone>,
    /// Hours on the clock face about the middle of the urethra at the same height, as seen from the apex towards the
    /// bladder: 12 anterior, 3 patient's left, 6 posterior. Default: all around.
    #[serde(default)]
    pub clock: Option<ClockRange>,
    /// Heights along the axis. Default: all.
    #[serde(default)]
    pub height: Option<HeightRange>,
    /// Distances from the wall of the urethra in the transverse plane, mm. Default: all.
    #[serde(default)]
    pub depth_mm: Option<Range>,
    /// Whether it is dyed in the views. Default true.
    #[serde(default = "yes")]
    pub dyed: bool,
}

impl Marked {
    /// What it is called in goals: all of both lobes is the adenoma, whose edge a player has to see undyed; all else is marked.
    pub fn words(&self) -> &'static str {
        let is_whole = self.clock.is_none() && self.height.is_none() && self.depth_mm.is_none();
        let lobes = [Zone::LateralLobe, Zone::MiddleLobe];
        let is_adenoma = lobes.iter().all(|lobe| self.zones.contains(lobe)) && self.zones.len() == lobes.len();
        if is_whole && is_adenoma && !self.dyed {
            "adenoma"
        } else {
            "marked tissue"
        }
    }
}

fn yes() -> bool {
    true
}

/// Hours from `from` clockwise to `to`, each 0 to 12; `(from: 10, to: 2)` passes 12. Equal ends are refused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClockRange {
    /// First hour.
    #[schemars(range(min = 0.0, max = 12.0), extend("x-unit" = "h"))]
    pub from: f64,
    /// Hour where it ends.
    #[schemars(range(min = 0.0, max = 12.0), extend("x-unit" = "h"))]
    pub to: f64,
}

/// Numbers from `from` up to `to`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Lower end, inside.
    pub from: f64,
    /// Upper end, outside.
    pub to: f64,
}

/// Heights along the axis of the gland, from a landmark, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum HeightRange {
    /// From the bladder neck towards the apex; negative above the neck, in the bladder.
    BelowBladderNeck {
        /// Smaller distance below the neck.
        from_mm: f64,
        /// Larger distance below the neck.
        to_mm: f64,
    },
    /// From the verumontanum towards the bladder; negative below it, where nothing should be cut.
    AboveVerumontanum {
        /// Smaller distance above the verumontanum.
        from_mm: f64,
        /// Larger distance above the verumontanum.
        to_mm: f64,
    },
}

/// Something to reach.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Goal {
    /// Remove at least this share of the marked region, above 0 and at most 1.
    RemoveMarked {
        /// Share of its volume at rest.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        share: f64,
    },
    /// Do every one of the exercise's steps.
    FinishSteps,
    /// Reach a goal of an extension, `Extension("its_name")`.
    Extension(GoalId),
}

/// One line of the score: `points * clamp((metric - from) / (to - from), 0, 1)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScoreRule {
    /// The metric, by id.
    pub metric: MetricId,
    /// The part of the score that it belongs to, for subtotals. Default: none.
    #[serde(default)]
    pub part: Option<Part>,
    /// Points at best, 0 or more.
    #[schemars(range(min = 0.0))]
    pub points: f64,
    /// The value that earns nothing.
    pub from: f64,
    /// The value that earns all points. Below `from` where less is better.
    pub to: f64,
    /// Where the two values come from.
    pub basis: String,
    /// Values that earn bronze, silver and gold, better each than the one before. They earn no points. Default: none.
    #[serde(default)]
    pub pars: Option<Pars>,
    /// A line may count only once something else is done, so that doing nothing earns nothing.
    #[serde(default)]
    pub needs: Option<Condition>,
}

/// A part of a score with a subtotal of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Part {
    /// What was removed.
    Resection,
    /// Blood, and what was done against it.
    Bleeding,
    /// What must stay whole.
    Safety,
    /// Time, ways, water and current.
    Economy,
}

impl Part {
    /// Every part, in the order of reports.
    pub const ALL: [Part; 4] = [Part::Resection, Part::Bleeding, Part::Safety, Part::Economy];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Part::Resection => "Resection",
            Part::Bleeding => "Bleeding",
            Part::Safety => "Safety",
            Part::Economy => "Economy",
        }
    }
}

/// A metric that must have reached a value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// The metric, by id.
    pub metric: MetricId,
    /// The least value.
    pub at_least: f64,
}
