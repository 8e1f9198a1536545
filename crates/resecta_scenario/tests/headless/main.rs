//! Exercises in headless apps, fed with messages by the tests: no solver, no tissue.

mod bench;
mod metrics;
mod report;
