//! The rules that an exercise must keep: each names the field, the value and what was expected.

use resecta_anatomy::Zone;
use resecta_instrument::{FieldLimit, InstrumentField, InstrumentLimits, ResectoscopeGeometry};
use resecta_solver::{CollapseLaw, Material, ShearResistance};
use resecta_tissue::{CutDetail, CuttingRule};

use crate::{
    chips,
    errors::RuleError,
    exercise::{Condition, Exercise, Goal, HeightRange, InstrumentSetup, Marked, Models, ScoreRule},
    metrics::Better,
    pars::Pars,
    steps,
};

/// The spacings that a field may have, mm: below, a stroke is no longer cut in real time; above, elements are as fine.
const FINEST_MM: f32 = 0.2;
const COARSEST_MM: f32 = 2.0;

pub(crate) type Checked = Result<(), RuleError>;

impl Exercise {
    /// Checks every rule that needs nothing but the exercise itself; the first that is broken is returned.
    pub fn validate(&self) -> Checked {
        for (field, text) in [
            ("title", &self.title),
            ("briefing", &self.briefing),
            ("case", &self.case),
        ] {
            if text.trim().is_empty() {
                return Err(RuleError::new(field, "empty", "some text"));
            }
        }
        if !(2.0..=60.0).contains(&self.alpha_deg) {
            return Err(RuleError::new("alpha_deg", self.alpha_deg, "2 to 60 degrees"));
        }
        if let Some(material) = &self.material
            && Material::preset(material).is_none()
        {
            let names: Vec<&str> = Material::preset_names().collect();
            let expected = format!("a material preset ({})", names.join(", "));
            return Err(RuleError::unknown_name("material", material, expected, names));
        }
        models(&self.models)?;
        instrument(&self.instrument)?;
        marked(&self.marked)?;
        if self.goals.is_empty() {
            return Err(RuleError::new("goals", "empty", "at least one goal"));
        }
        steps::check(self)?;
        for (index, goal) in self.goals.iter().enumerate() {
            match goal {
                Goal::RemoveMarked { share } if !(*share > 0.0 && *share <= 1.0) => {
                    let field = format!("goals[{index}].RemoveMarked.share");
                    return Err(RuleError::new(field, share, "a share above 0 and at most 1"));
                }
                Goal::FinishSteps if self.steps.is_empty() => {
                    let field = format!("goals[{index}]");
                    return Err(RuleError::new(
                        field,
                        "FinishSteps",
                        "another goal, or `steps: [..]` to finish",
                    ));
                }
                Goal::RemoveMarked { .. } | Goal::FinishSteps | Goal::Extension(_) => {}
            }
        }
        self.limits.check(&self.models)?;
        if self.scoring.is_empty() {
            return Err(RuleError::new("scoring", "empty", "at least one line"));
        }
        if let Some(pars) = &self.total_pars {
            check_pars("total_pars", pars, true)?;
        }
        self.scoring
            .iter()
            .enumerate()
            .try_for_each(|(index, rule)| score_rule(&format!("scoring[{index}]"), rule))
    }
}

fn models(models: &Models) -> Checked {
    match models.collapse {
        Some(CollapseLaw::CompressionForce { share }) if !(0.0..=1.0).contains(&share) => {
            return Err(RuleError::new(
                "models.collapse.CompressionForce.share",
                share,
                "a share from 0 to 1",
            ));
        }
        Some(CollapseLaw::HydraulicPressure { resistance_un })
            if !(resistance_un >= 0.0 && resistance_un.is_finite()) =>
        {
            return Err(RuleError::new(
                "models.collapse.HydraulicPressure.resistance_un",
                resistance_un,
                "a finite number of µN, 0 or more",
            ));
        }
        _ => {}
    }
    if let CuttingRule::Sphere { radius_mm } = models.cutting {
        positive("models.cutting.Sphere.radius_mm", radius_mm.into(), "mm")?;
    }
    if let CutDetail::Field { spacing_mm } = models.detail
        && !(FINEST_MM..=COARSEST_MM).contains(&spacing_mm)
    {
        return Err(RuleError::new(
            "models.detail.Field.spacing_mm",
            spacing_mm,
            "0.2 to 2 mm",
        ));
    }
    if let Some(water) = &models.water {
        water.check()?;
    }
    if let Some(settings) = &models.chips {
        chips::check(settings)?;
    }
    // The material's own way to resist shear is known with the case; none at all allows the most.
    let material = Material {
        shear: models.shear.unwrap_or(ShearResistance::None),
        poisson_ratio: models.poisson_ratio,
        ..Material::default()
    };
    of_material(&material)
}

/// Names what an exercise has asked of a material that cannot be.
pub(crate) fn of_material(material: &Material) -> Checked {
    match material.out_of_range() {
        Some(("poisson_ratio", value, expected)) => Err(RuleError::new("models.poisson_ratio", value, expected)),
        Some((_, value, expected)) => Err(RuleError::new("models.shear", value, expected)),
        None => Ok(()),
    }
}

fn instrument(setup: &InstrumentSetup) -> Checked {
    for (field, vector) in [("instrument.pivot_mm", setup.pivot_mm), ("instrument.axis", setup.axis)] {
        if let Some(vector) = vector
            && !vector.iter().all(|part| part.is_finite())
        {
            return Err(RuleError::new(
                field,
                format_args!("{vector:?}"),
                "three finite numbers",
            ));
        }
    }
    if let Some(axis) = setup.axis
        && axis.iter().map(|part| part * part).sum::<f32>() < 1e-12
    {
        return Err(RuleError::new(
            "instrument.axis",
            format_args!("{axis:?}"),
            "a direction, not zero",
        ));
    }
    if let Some(optic) = setup.optic_deg
        && !ResectoscopeGeometry::OPTICS_DEG.contains(&optic)
    {
        let expected = "0, 12 or 30 degrees, the telescopes that there are";
        return Err(RuleError::new("instrument.optic_deg", optic, expected));
    }
    let Some(start) = setup.start else { return Ok(()) };
    if let Some(tap) = InstrumentField::TAPS.into_iter().find(|&tap| start.get(tap) != 0.0) {
        let field = format!("instrument.start.{}", tap.name());
        let expected = "nothing: `models.water.irrigation` says how far the taps are open";
        return Err(RuleError::new(field, start.get(tap), expected));
    }
    let limits = InstrumentLimits::default();
    match InstrumentField::ALL
        .into_iter()
        .find(|&field| !limits.of(field).contains(start.get(field)))
    {
        Some(field) => {
            let FieldLimit { min, max, .. } = limits.of(field);
            let expected = format!("{min} to {max}, the limits of the instrument");
            Err(RuleError::new(
                format!("instrument.start.{}", field.name()),
                start.get(field),
                expected,
            ))
        }
        None => Ok(()),
    }
}

fn marked(marked: &Marked) -> Checked {
    if marked.zones.is_empty() {
        let names = Zone::ALL.map(Zone::name).join(", ");
        return Err(RuleError::new(
            "marked.zones",
            "empty",
            format!("at least one of {names}"),
        ));
    }
    if let Some(clock) = marked.clock {
        for (field, hour) in [("marked.clock.from", clock.from), ("marked.clock.to", clock.to)] {
            if !(0.0..=12.0).contains(&hour) {
                return Err(RuleError::new(field, hour, "an hour from 0 to 12"));
            }
        }
        if clock.from == clock.to {
            return Err(RuleError::new(
                "marked.clock.to",
                clock.to,
                "another hour than `from` (all around is 0 to 12)",
            ));
        }
    }
    if let Some(height) = marked.height {
        let (variant, from_mm, to_mm) = match height {
            HeightRange::BelowBladderNeck { from_mm, to_mm } => ("BelowBladderNeck", from_mm, to_mm),
            HeightRange::AboveVerumontanum { from_mm, to_mm } => ("AboveVerumontanum", from_mm, to_mm),
        };
        let field = format!("marked.height.{variant}");
        rising(&format!("{field}.from_mm"), from_mm, &format!("{field}.to_mm"), to_mm)?;
    }
    match marked.depth_mm {
        Some(depth) => rising("marked.depth_mm.from", depth.from, "marked.depth_mm.to", depth.to),
        None => Ok(()),
    }
}

fn score_rule(field: &str, rule: &ScoreRule) -> Checked {
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
    if !(points >= 0.0 && points.is_finite()) {
        return Err(RuleError::new(format!("{field}.points"), points, "0 or more"));
    }
    finite(&format!("{field}.from"), from)?;
    finite(&format!("{field}.to"), to)?;
    let expected = match metric.info().better {
        Better::More if to <= from => format!("more than `from` ({from}): more {metric} is better"),
        Better::Less if to >= from => format!("less than `from` ({from}): less {metric} is better"),
        Better::Neither if to == from => format!("another value than `from` ({from})"),
        _ => String::new(),
    };
    if !expected.is_empty() {
        return Err(RuleError::new(format!("{field}.to"), to, expected));
    }
    if basis.trim().is_empty() {
        return Err(RuleError::new(
            format!("{field}.basis"),
            "empty",
            "where the two values come from",
        ));
    }
    if let Some(pars) = pars {
        check_pars(&format!("{field}.pars"), pars, to > from)?;
    }
    match needs {
        Some(Condition { at_least, .. }) => finite(&format!("{field}.needs.at_least"), at_least),
        None => Ok(()),
    }
}

/// Pars must get better as the line's points do.
fn check_pars(field: &str, pars: &Pars, more_is_better: bool) -> Checked {
    let Pars {
        bronze,
        silver,
        gold,
        ref basis,
    } = *pars;
    finite(&format!("{field}.bronze"), bronze)?;
    for (name, value, before, par) in [("silver", silver, "bronze", bronze), ("gold", gold, "silver", silver)] {
        let field = format!("{field}.{name}");
        finite(&field, value)?;
        let (is_better, than) = if more_is_better {
            (value > par, "more")
        } else {
            (value < par, "less")
        };
        if !is_better {
            return Err(RuleError::new(field, value, format!("{than} than `{before}` ({par})")));
        }
    }
    if basis.trim().is_empty() {
        return Err(RuleError::new(
            format!("{field}.basis"),
            "empty",
            "where the three values come from",
        ));
    }
    Ok(())
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
