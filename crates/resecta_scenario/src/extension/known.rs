//! The extensions whose names the text that is being read may use.
//!
//! Serde hands a field nothing but its text, so the names are kept beside it for as long as a text is read: then an unknown
//! name is told with its line and column, as any other slip.

use std::cell::RefCell;

use super::{Extensions, GoalId};
use crate::{errors::nearest, metrics::MetricId};

thread_local! {
    static KNOWN: RefCell<Extensions> = RefCell::default();
}

/// Reads with the names of these extensions known.
pub(crate) fn while_known<T>(extensions: &Extensions, read: impl FnOnce() -> T) -> T {
    /// Puts back what was known before, after a panic too.
    struct Before(Extensions);
    impl Drop for Before {
        fn drop(&mut self) {
            KNOWN.replace(std::mem::take(&mut self.0));
        }
    }
    let _before = Before(KNOWN.replace(extensions.clone()));
    read()
}

/// The metric of this id, built in or known.
pub(crate) fn known_metric(id: &str) -> Result<MetricId, String> {
    KNOWN.with_borrow(|known| {
        let built_in = MetricId::from_id(id);
        built_in.or_else(|| known.metric(id)).ok_or_else(|| {
            let ids = MetricId::ALL.iter().map(|metric| metric.info().id);
            unknown("metric", id, ids.chain(known.metric_names()))
        })
    })
}

/// The known goal of this name.
pub(crate) fn known_goal(name: &str) -> Result<GoalId, String> {
    KNOWN.with_borrow(|known| {
        let names = || known.goal_names();
        (known.goal(name)).ok_or_else(|| unknown("goal of an extension", name, names()))
    })
}

fn unknown<'a>(what: &str, name: &str, valid: impl Iterator<Item = &'a str>) -> String {
    let hint = nearest(name, valid).map(|name| format!("; did you mean `{name}`?"));
    format!("unknown {what} \"{name}\"{}", hint.unwrap_or_default())
}
