//! The score of a record, computed anew: the formula of its exercise at the metrics of its report.

use std::{collections::BTreeMap, path::Path};

use resecta_scenario::{Extensions, ScoreCard};

use crate::{
    error::{Damage, RecordError},
    record::RunRecord,
};

/// The score by the formula in the record, at the metrics in the record. `file` is named in errors.
///
/// # Errors
/// [`RecordError`]: the exercise is refused, or the report lacks a metric that the formula names.
pub fn rescore(record: &RunRecord, file: &Path, extensions: &Extensions) -> Result<ScoreCard, RecordError> {
    let exercise = record.exercise(file, extensions)?.exercise;
    let metrics = record.results().metrics;
    let values: BTreeMap<&str, f64> = metrics
        .iter()
        .map(|metric| (metric.id.as_str(), metric.value))
        .collect();
    let lacked = (exercise.scoring.iter())
        .flat_map(|rule| [Some(rule.metric), rule.needs.map(|needs| needs.metric)])
        .flatten()
        .find(|metric| !values.contains_key(metric.info().id));
    if let Some(metric) = lacked {
        return Err(RecordError::Damaged {
            file: file.into(),
            damage: Damage::Contents {
                what: format!("its report has no {metric}, which the score is made of"),
            },
        });
    }
    // Goals may name others, which earn nothing.
    let value = |metric: resecta_scenario::MetricId| values.get(metric.info().id).copied().unwrap_or_default();
    Ok(ScoreCard::of_values(&exercise, value))
}
