//! The trace of a run: one row a step, for plots and for a close look at what happened.

use std::io::{self, Write};

use bevy::prelude::*;
use resecta_instrument::InstrumentState;
use resecta_tissue::Overlap;

use crate::metrics::{MetricId, Metrics, StepObservation};

/// The rows of a run. Insert it to have a run recorded; it is emptied when an exercise is spawned.
#[derive(Resource, Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// One row a step, in order.
    pub rows: Vec<TraceRow>,
}

/// What one step was like.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TraceRow {
    /// Number of the step, from 1.
    pub step: u64,
    /// Simulated time at its end, s.
    pub time_s: f64,
    /// The instrument at its end.
    pub instrument: InstrumentState,
    /// The middle of the sheath's tip, mm.
    pub tip: Vec3,
    /// Triangles that the instrument touched.
    pub contacts: u32,
    /// Deepest overlap among them at the end of the step, mm.
    pub largest_depth_mm: f64,
    /// Force of the tissue on the instrument, N.
    pub force_n: f64,
    /// On the part of it, a diameter long, that is pressed hardest: N.
    pub patch_force_n: f64,
    /// How much tissue lay inside the instrument when the step began.
    pub overlap: Overlap,
    /// Pentahedra without volume or turned inside out.
    pub inverted: u32,
    /// Whether tissue close before the lens hid most of what it looks at.
    pub is_hidden: bool,
    /// Whether the loop was on the capsule with current on.
    pub current_on_capsule: bool,
    /// Volume removed since the start, mm³ at rest.
    pub removed_mm3: f64,
    /// Removed share of the marked region.
    pub marked_removed_share: f64,
    /// Steps of the exercise that are done.
    pub steps_done: u32,
}

/// The columns of [`Trace::write_csv`].
pub const COLUMNS: &str = "step,time_s,insertion_mm,pitch_deg,yaw_deg,roll_deg,stroke_mm,inflow_tap,outflow_tap,cut,coagulate,\
    tip_x_mm,tip_y_mm,tip_z_mm,contacts,largest_depth_mm,force_n,patch_force_n,overlap_mm,thin_overlap_mm,overlap_mm3,inverted,hidden,current_on_capsule,\
    removed_mm3,marked_removed_share,steps_done";

impl TraceRow {
    /// The row of a step that `metrics` has already taken into account.
    pub fn new(step: &StepObservation, metrics: &Metrics) -> Self {
        Self {
            step: metrics.steps,
            time_s: metrics.elapsed_s(),
            instrument: step.instrument,
            tip: step.tip,
            contacts: step.contacts,
            largest_depth_mm: step.largest_depth_mm,
            force_n: step.force_n,
            patch_force_n: step.patch_force_n,
            overlap: step.overlap,
            inverted: step.inverted,
            is_hidden: step.is_hidden,
            current_on_capsule: step.current_on_capsule,
            removed_mm3: metrics.value(MetricId::Removed),
            marked_removed_share: metrics.value(MetricId::MarkedRemovedShare),
            steps_done: metrics.steps_done,
        }
    }
}

impl Trace {
    /// Writes a header and the rows as comma-separated values. Numbers are the shortest that read back to the same bits,
    /// pedals and flags are 0 or 1.
    pub fn write_csv(&self, mut out: impl Write) -> io::Result<()> {
        writeln!(out, "{COLUMNS}")?;
        for row in &self.rows {
            let TraceRow {
                step,
                time_s,
                instrument,
                tip,
                contacts,
                largest_depth_mm,
                force_n,
                patch_force_n,
                inverted,
                ..
            } = row;
            let TraceRow {
                is_hidden,
                current_on_capsule,
                removed_mm3,
                marked_removed_share,
                steps_done,
                ..
            } = row;
            let InstrumentState {
                insertion_mm,
                pitch_deg,
                yaw_deg,
                roll_deg,
                stroke_mm,
                inflow_tap,
                outflow_tap,
                cut,
                coagulate,
            } = instrument;
            let Vec3 { x, y, z } = tip;
            let Overlap {
                deepest_mm,
                deepest_in_thin_mm,
                volume_mm3,
            } = row.overlap;
            let [cut, coagulate, is_hidden, current_on_capsule] =
                [*cut, *coagulate, *is_hidden, *current_on_capsule].map(u8::from);
            writeln!(
                out,
                "{step},{time_s},{insertion_mm},{pitch_deg},{yaw_deg},{roll_deg},{stroke_mm},{inflow_tap},{outflow_tap},\
                 {cut},{coagulate},{x},{y},{z},{contacts},{largest_depth_mm},{force_n},{patch_force_n},{deepest_mm},{deepest_in_thin_mm},{volume_mm3},{inverted},{is_hidden},\
                 {current_on_capsule},{removed_mm3},{marked_removed_share},{steps_done}"
            )?;
        }
        out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_a_value_a_column() {
        let trace = Trace {
            rows: vec![TraceRow::default(); 3],
        };
        let mut bytes = Vec::new();
        trace.write_csv(&mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [27; 4], "{text}");
        assert!(
            text.lines()
                .all(|line| line.split(',').all(|field| !field.trim().is_empty())),
            "{text}"
        );
    }
}
