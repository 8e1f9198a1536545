//! Exercises, metrics, scores and the record of a run.
