//! Names of metrics and goals of extensions, each with what it takes to measure it.

use std::{
    any::TypeId,
    borrow::Cow,
    cmp::Ordering,
    fmt,
    hash::{Hash, Hasher},
};

use bevy::prelude::*;
use resecta_instrument::InstrumentAction;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{GoalExtension, MetricExtension, known_goal};
use crate::metrics::{Better, MetricId, MetricInfo};

/// A metric or goal of an extension. Two are equal when their names are: names are unique in an app.
#[derive(Clone, Copy, Reflect)]
#[reflect(opaque, Clone)]
pub struct ExtensionMetric(&'static Row);

/// What is known of a metric's type.
struct Row {
    info: MetricInfo,
    advice: Option<&'static str>,
    actions: &'static [InstrumentAction],
    type_id: fn() -> TypeId,
    /// Puts the component there, where it is not yet.
    insert: fn(&mut EntityWorldMut),
    value: fn(&EntityRef) -> Option<f64>,
}

/// Where each type has its row.
trait HasRow {
    const ROW: &'static Row;
}

struct OfMetric<M>(M);

impl<M: MetricExtension> HasRow for OfMetric<M> {
    const ROW: &'static Row = &Row {
        info: M::INFO,
        advice: M::ADVICE,
        actions: &[],
        type_id: TypeId::of::<Self>,
        insert: insert::<M>,
        value: |entity| Some(entity.get::<M>()?.value()),
    };
}

struct OfGoal<G>(G);

impl<G: GoalExtension> HasRow for OfGoal<G> {
    const ROW: &'static Row = &Row {
        info: MetricInfo {
            id: G::NAME,
            title: G::WORDS,
            unit: "1",
            better: Better::More,
            doc: "How far the goal is reached; 1 is all of it.",
        },
        advice: None,
        actions: G::ACTIONS,
        type_id: TypeId::of::<Self>,
        insert: insert::<G>,
        value: |entity| Some(entity.get::<G>()?.share().clamp(0.0, 1.0)),
    };
}

fn insert<C: Component + Default>(entity: &mut EntityWorldMut) {
    // A type may be a metric and a goal at once.
    entity.insert_if_new(C::default());
}

impl MetricId {
    /// The metric of an extension.
    pub const fn of<M: MetricExtension>() -> Self {
        Self::Extension(ExtensionMetric::of::<M>())
    }
}

impl ExtensionMetric {
    /// The metric of this type.
    pub const fn of<M: MetricExtension>() -> Self {
        Self(OfMetric::<M>::ROW)
    }

    /// Its row in the table of metrics.
    pub const fn info(self) -> MetricInfo {
        self.0.info
    }

    /// What to do better where it lost points.
    pub fn advice(self) -> Option<&'static str> {
        self.0.advice
    }

    /// Whether it is the same extension, not only of the same name.
    pub(super) fn is_same(self, other: Self) -> bool {
        (self.0.type_id)() == (other.0.type_id)()
    }

    pub(crate) fn insert(self, instrument: &mut EntityWorldMut) {
        (self.0.insert)(instrument);
    }

    /// The value now; none where there is none that is finite.
    pub(crate) fn measure(self, instrument: &EntityRef) -> Option<f64> {
        (self.0.value)(instrument).filter(|value| value.is_finite())
    }
}

impl PartialEq for ExtensionMetric {
    fn eq(&self, other: &Self) -> bool {
        self.0.info.id == other.0.info.id
    }
}

impl Eq for ExtensionMetric {}

impl PartialOrd for ExtensionMetric {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for ExtensionMetric {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.info.id.cmp(other.0.info.id)
    }
}

impl Hash for ExtensionMetric {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.info.id.hash(state);
    }
}

impl fmt::Debug for ExtensionMetric {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.info.id.fmt(formatter)
    }
}

/// A goal of an extension; written in files by its name, `Extension("its_name")`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GoalId(ExtensionMetric);

impl GoalId {
    /// The goal of this type.
    pub const fn of<G: GoalExtension>() -> Self {
        Self(ExtensionMetric(OfGoal::<G>::ROW))
    }

    /// Its name in files.
    pub const fn name(self) -> &'static str {
        self.0.info().id
    }

    /// What is to be done.
    pub const fn words(self) -> &'static str {
        self.0.info().title
    }

    /// What the player does it with.
    pub fn actions(self) -> &'static [InstrumentAction] {
        self.0.0.actions
    }

    /// The metric that tells how far it is reached; 1 is all of it.
    pub const fn metric(self) -> ExtensionMetric {
        self.0
    }
}

impl Serialize for GoalId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl JsonSchema for GoalId {
    fn schema_name() -> Cow<'static, str> {
        "GoalId".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "description": "A goal of an extension, by name."})
    }
}

impl<'de> Deserialize<'de> for GoalId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        known_goal(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}
