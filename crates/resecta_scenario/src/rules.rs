//! The rules that an exercise must keep: each names the field, the value and what was expected.

use std::ops::RangeInclusive;

use resecta_anatomy::Zone;
use resecta_instrument::{FieldLimit, InstrumentField, InstrumentLimits, ResectoscopeGeometry};
use resecta_solver::{CollapseLaw, Material, ShearResistance};
use resecta_tissue::{CutDetail, CuttingRule};

use crate::{
    chips,
    errors::RuleError,
    exercise::{Condition, Exercise, Goal, HeightRange, InstrumentSetup, Marked, Models, ScoreRule},
    metrics::{Better, MetricId},
    pars::Pars,
    steps,
};

/// The spacings that a field may have, mm: below, a stroke is no longer cut in real time; above, elements are as fine.
const FINEST_MM: f32 = 0.2;
const COARSEST_MM: f32 = 2.0;

pub(crate) type Checked = Result<(), RuleError>;

/// The rules that are broken, in the order in which they were looked at.
#[derive(Debug, Default)]
pub(crate) struct Faults(Vec<RuleError>);

impl Faults {
    /// Takes note of a rule, if it is broken.
    pub(crate) fn note(&mut self, checked: Checked) {
        self.0.extend(checked.err());
    }

    /// Takes note of a broken rule unless it is kept.
    pub(crate) fn require(&mut self, is_kept: bool, broken: impl FnOnce() -> RuleError) {
        if !is_kept {
            self.0.push(broken());
        }
    }
}

impl Exercise {
    /// Checks every rule that needs nothing but the exercise itself; the first that is broken is returned.
    pub fn validate(&self) -> Result<(), RuleError> {
        self.faults().into_iter().next().map_or(Ok(()), Err)
    }

    /// Every rule that is broken, of those that need nothing but the exercise itself.
    pub fn faults(&self) -> Vec<RuleError> {
        let mut faults = Faults::default();
        for (field, text) in [
            ("title", &self.title),
            ("briefing", &self.briefing),
            ("case", &self.case),
        ] {
            faults.require(!text.trim().is_empty(), || RuleError::new(field, "empty", "some text"));
        }
        faults.require((2.0..=60.0).contains(&self.alpha_deg), || {
            RuleError::new("alpha_deg", self.alpha_deg, "2 to 60 degrees")
        });
        if let Some(material) = &self.material
            && Material::preset(material).is_none()
        {
            let names: Vec<&str> = Material::preset_names().collect();
            let expected = format!("a material preset ({})", names.join(", "));
            faults.note(Err(RuleError::unknown_name("material", material, expected, names)));
        }
        models(&self.models, &mut faults);
        if let Some(begun) = &self.begun {
            begun.check(&self.models, &mut faults);
        }
        instrument(&self.instrument, &mut faults);
        marked(&self.marked, &mut faults);
        steps::check(self, &mut faults);
        goals(self, &mut faults);
        self.limits.check(&self.models, &mut faults);
        faults.require(!self.scoring.is_empty(), || {
            RuleError::new("scoring", "empty", "at least one line")
        });
        if let Some(pars) = &self.total_pars {
            let out_of: f64 = self.scoring.iter().map(|rule| rule.points).sum();
            let range = (0.0..=out_of, format!("0 to {out_of}, the points of all lines"));
            check_pars("total_pars", pars, true, range, &mut faults);
        }
        for (index, rule) in self.scoring.iter().enumerate() {
            score_rule(&format!("scoring[{index}]"), rule, &mut faults);
        }
        faults.0
    }
}

fn goals(exercise: &Exercise, faults: &mut Faults) {
    faults.require(!exercise.goals.is_empty(), || {
        RuleError::new("goals", "empty", "at least one goal")
    });
    for (index, goal) in exercise.goals.iter().enumerate() {
        match goal {
            Goal::RemoveMarked { share } => faults.require(*share > 0.0 && *share <= 1.0, || {
                let field = format!("goals[{index}].RemoveMarked.share");
                RuleError::new(field, share, "a share above 0 and at most 1")
            }),
            Goal::FinishSteps => faults.require(!exercise.steps.is_empty(), || {
                let expected = "another goal, or `steps: [..]` to finish";
                RuleError::new(format!("goals[{index}]"), "FinishSteps", expected)
            }),
            // Its name was known when it was read.
            Goal::Extension(_) => {}
        }
    }
}

fn models(models: &Models, faults: &mut Faults) {
    match models.collapse {
        Some(CollapseLaw::CompressionForce { share }) => faults.require((0.0..=1.0).contains(&share), || {
            let field = "models.collapse.CompressionForce.share";
            RuleError::new(field, share, "a share from 0 to 1")
        }),
        Some(CollapseLaw::HydraulicPressure { resistance_un }) => {
            faults.require(resistance_un >= 0.0 && resistance_un.is_finite(), || {
                let field = "models.collapse.HydraulicPressure.resistance_un";
                RuleError::new(field, resistance_un, "a finite number of µN, 0 or more")
            });
        }
        None => {}
    }
    if let CuttingRule::Sphere { radius_mm } = models.cutting {
        faults.note(positive("models.cutting.Sphere.radius_mm", radius_mm.into(), "mm"));
    }
    if let CutDetail::Field { spacing_mm } = models.detail {
        faults.require((FINEST_MM..=COARSEST_MM).contains(&spacing_mm), || {
            RuleError::new("models.detail.Field.spacing_mm", spacing_mm, "0.2 to 2 mm")
        });
    }
    if let Some(water) = &models.water {
        faults.note(water.check());
    }
    if let Some(pressure) = models.water_pressure_cmh2o {
        faults.require((-100.0..=100.0).contains(&pressure), || {
            RuleError::new("models.water_pressure_cmh2o", pressure, "-100 to 100 cmH2O")
        });
        faults.require(models.water.is_none(), || {
            let expected = "no such pressure beside `models.water`, which has its own";
            RuleError::new("models.water_pressure_cmh2o", pressure, expected)
        });
    }
    if let Some(settings) = &models.chips {
        faults.note(chips::check(settings));
    }
    // The material's own way to resist shear is known with the case; none at all allows the most.
    let material = Material {
        shear: models.shear.unwrap_or(ShearResistance::None),
        poisson_ratio: models.poisson_ratio,
        ..Material::default()
    };
    faults.note(of_material(&material));
}

/// Names what an exercise has asked of a material that cannot be.
pub(crate) fn of_material(material: &Material) -> Checked {
    match material.out_of_range() {
        Some(("poisson_ratio", value, expected)) => Err(RuleError::new("models.poisson_ratio", value, expected)),
        Some((_, value, expected)) => Err(RuleError::new("models.shear", value, expected)),
        None => Ok(()),
    }
}

fn instrument(setup: &InstrumentSetup, faults: &mut Faults) {
    for (field, vector) in [("instrument.pivot_mm", setup.pivot_mm), ("instrument.axis", setup.axis)] {
        let Some(vector) = vector else { continue };
        faults.require(vector.iter().all(|part| part.is_finite()), || {
            RuleError::new(field, format_args!("{vector:?}"), "three finite numbers")
        });
    }
    if let Some(axis) = setup.axis {
        let is_zero = axis.iter().map(|part| part * part).sum::<f32>() < 1e-12;
        faults.require(!is_zero, || {
            RuleError::new("instrument.axis", format_args!("{axis:?}"), "a direction, not zero")
        });
    }
    if let Some(optic) = setup.optic_deg {
        faults.require(ResectoscopeGeometry::OPTICS_DEG.contains(&optic), || {
            let expected = "0, 12 or 30 degrees, the telescopes that there are";
            RuleError::new("instrument.optic_deg", optic, expected)
        });
    }
    let Some(start) = setup.start else { return };
    for tap in InstrumentField::TAPS {
        faults.require(start.get(tap) == 0.0, || {
            let expected = "nothing: `models.water.irrigation` says how far the taps are open";
            RuleError::new(format!("instrument.start.{}", tap.name()), start.get(tap), expected)
        });
    }
    let limits = InstrumentLimits::default();
    let others = InstrumentField::ALL.into_iter();
    for field in others.filter(|field| !InstrumentField::TAPS.contains(field)) {
        let FieldLimit { min, max, .. } = limits.of(field);
        faults.require(limits.of(field).contains(start.get(field)), || {
            let expected = format!("{min} to {max}, the limits of the instrument");
            RuleError::new(format!("instrument.start.{}", field.name()), start.get(field), expected)
        });
    }
}

fn marked(marked: &Marked, faults: &mut Faults) {
    faults.require(!marked.zones.is_empty(), || {
        let names = Zone::ALL.map(Zone::name).join(", ");
        RuleError::new("marked.zones", "empty", format!("at least one of {names}"))
    });
    if let Some(clock) = marked.clock {
        for (field, hour) in [("marked.clock.from", clock.from), ("marked.clock.to", clock.to)] {
            faults.require((0.0..=12.0).contains(&hour), || {
                RuleError::new(field, hour, "an hour from 0 to 12")
            });
        }
        faults.require(clock.from != clock.to, || {
            let expected = "another hour than `from` (all around is 0 to 12)";
            RuleError::new("marked.clock.to", clock.to, expected)
        });
    }
    if let Some(height) = marked.height {
        of_height("marked.height", height, faults);
    }
    if let Some(depth) = marked.depth_mm {
        faults.note(rising(
            "marked.depth_mm.from",
            depth.from,
            "marked.depth_mm.to",
            depth.to,
        ));
    }
}

/// Heights must rise.
pub(crate) fn of_height(field: &str, height: HeightRange, faults: &mut Faults) {
    let (variant, from_mm, to_mm) = match height {
        HeightRange::BelowBladderNeck { from_mm, to_mm } => ("BelowBladderNeck", from_mm, to_mm),
        HeightRange::AboveVerumontanum { from_mm, to_mm } => ("AboveVerumontanum", from_mm, to_mm),
    };
    let field = format!("{field}.{variant}");
    faults.note(rising(
        &format!("{field}.from_mm"),
        from_mm,
        &format!("{field}.to_mm"),
        to_mm,
    ));
}

fn score_rule(field: &str, rule: &ScoreRule, faults: &mut Faults) {
    let &ScoreRule {
        metric,
        part: _,
        points,
        from,
        to,
        ref basis,
        ref pars,
        needs,
    } = rule;
    faults.require(points >= 0.0 && points.is_finite(), || {
        RuleError::new(format!("{field}.points"), points, "0 or more")
    });
    let range = range_of(metric);
    faults.note(within(&format!("{field}.from"), from, &range));
    faults.note(within(&format!("{field}.to"), to, &range));
    let expected = match metric.info().better {
        Better::More if to <= from => format!("more than `from` ({from}): more {metric} is better"),
        Better::Less if to >= from => format!("less than `from` ({from}): less {metric} is better"),
        Better::Neither if to == from => format!("another value than `from` ({from})"),
        _ => String::new(),
    };
    faults.require(expected.is_empty(), || {
        RuleError::new(format!("{field}.to"), to, expected)
    });
    faults.require(!basis.trim().is_empty(), || {
        RuleError::new(format!("{field}.basis"), "empty", "where the two values come from")
    });
    if let Some(pars) = pars {
        let more_is_better = match metric.info().better {
            Better::More => true,
            Better::Less => false,
            Better::Neither => to > from,
        };
        check_pars(&format!("{field}.pars"), pars, more_is_better, range, faults);
    }
    if let Some(Condition { metric, at_least }) = needs {
        let field = format!("{field}.needs.at_least");
        faults.note(within(&field, at_least, &range_of(metric)));
    }
}

/// What a value can be, and that in words.
type Allowed = (RangeInclusive<f64>, String);

fn range_of(metric: MetricId) -> Allowed {
    let range = metric.range();
    let words = match (*range.start(), *range.end()) {
        (0.0, 1.0) => format!("0 to 1: {metric} is a share"),
        (0.0, _) => format!("a finite number, 0 or more, as {metric} always is"),
        _ => "a finite number".into(),
    };
    (range, words)
}

/// Pars must get better as the line's points do.
fn check_pars(field: &str, pars: &Pars, more_is_better: bool, allowed: Allowed, faults: &mut Faults) {
    let Pars {
        bronze,
        silver,
        gold,
        ref basis,
    } = *pars;
    for (name, value) in [("bronze", bronze), ("silver", silver), ("gold", gold)] {
        faults.note(within(&format!("{field}.{name}"), value, &allowed));
    }
    for (name, value, before, par) in [("silver", silver, "bronze", bronze), ("gold", gold, "silver", silver)] {
        let (is_worse, than) = if more_is_better {
            (value <= par, "more")
        } else {
            (value >= par, "less")
        };
        faults.require(!is_worse, || {
            let expected = format!("{than} than `{before}` ({par})");
            RuleError::new(format!("{field}.{name}"), value, expected)
        });
    }
    faults.require(!basis.trim().is_empty(), || {
        RuleError::new(format!("{field}.basis"), "empty", "where the three values come from")
    });
}

fn within(field: &str, value: f64, (range, words): &Allowed) -> Checked {
    finite(field, value)?;
    if range.contains(&value) {
        Ok(())
    } else {
        Err(RuleError::new(field, value, words.as_str()))
    }
}

fn finite(field: &str, value: f64) -> Checked {
    if value.is_finite() {
        Ok(())
    } else {
        Err(RuleError::new(field, value, "a finite number"))
    }
}

fn positive(field: &str, value: f64, unit: &str) -> Checked {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(RuleError::new(
            field,
            value,
            format!("a finite number of {unit} above 0"),
        ))
    }
}

fn rising(lower: &str, from: f64, upper: &str, to: f64) -> Checked {
    finite(lower, from)?;
    finite(upper, to)?;
    if from < to {
        Ok(())
    } else {
        Err(RuleError::new(upper, to, format!("more than `{lower}` ({from})")))
    }
}
