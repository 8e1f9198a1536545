//! The unit of a field, from its name.

/// Parts of names that are units, and how they are written.
const UNITS: [(&str, &str); 14] = [
    ("cm2", "cm²"),
    ("cmh2o", "cmH2O"),
    ("deg", "degrees"),
    ("g", "g"),
    ("min", "min"),
    ("ml", "ml"),
    ("mm", "mm"),
    ("mm3", "mm³"),
    ("mpa", "mPa"),
    ("pa", "Pa"),
    ("s", "s"),
    ("share", "1"),
    ("tap", "1"),
    ("un", "µN"),
];

/// The unit that a name ends in, as `ml/s` of `rate_ml_per_s`; none of a name without.
pub fn of_name(name: &str) -> Option<String> {
    let parts: Vec<&str> = name.split('_').collect();
    let written = |part: &str| UNITS.iter().find(|(name, _)| *name == part).map(|(_, unit)| *unit);
    let is_part = |part: &&&str| **part == "per" || written(part).is_some();
    let count = parts.iter().rev().take_while(is_part).count();
    let mut unit = String::new();
    let mut is_below = false;
    for part in &parts[parts.len() - count..] {
        match written(part) {
            None => is_below = true,
            Some(part) if is_below => {
                unit += if unit.is_empty() { "1/" } else { "/" };
                unit += part;
                is_below = false;
            }
            Some(part) => {
                if !unit.is_empty() {
                    unit.push(' ');
                }
                unit += part;
            }
        }
    }
    (!unit.is_empty()).then_some(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_end_in_their_units() {
        for (name, unit) in [
            ("time_s", "s"),
            ("mm", "mm"),
            ("vein_rate_ml_per_s", "ml/s"),
            ("conductance_ml_per_s_per_cmh2o", "ml/s/cmH2O"),
            ("extinction_per_mm", "1/mm"),
            ("water_viscosity_mpa_s", "mPa s"),
            ("capsule_cut_share", "1"),
            ("bag_height_cmh2o", "cmH2O"),
        ] {
            assert_eq!(of_name(name).as_deref(), Some(unit), "{name}");
        }
        assert_eq!(of_name("title"), None);
        assert_eq!(of_name("seed"), None);
    }
}
