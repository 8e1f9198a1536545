//! A report holds what another run is compared by, and nothing else.

use std::{thread::sleep, time::Duration};

use crate::bench::Bench;
use resecta_scenario::{ActiveExercise, MetricId, Metrics, Report, ScoreCard, StepProgress, Trace};
use resecta_solver::NodeKind;
use resecta_tissue::ToolPartKind;

/// A little run; `pause` takes wall time between its steps. Returns report and trace.
fn run(pause: Duration) -> (String, Vec<u8>) {
    let mut bench = Bench::new();
    bench.app.init_resource::<Trace>();
    for step in 0..40 {
        bench.state.insertion_mm = 20.0 + step as f32 * 0.37;
        bench.state.cut = step % 8 > 3;
        if bench.state.cut {
            bench.contact(ToolPartKind::Loop, NodeKind::Inner, 0.01 * step as f32);
            bench.resect(step..step + 1);
        }
        bench.step(1);
        sleep(pause);
    }
    let world = bench.app.world();
    let report = Report::new(
        world.resource::<ActiveExercise>(),
        bench.run_state(),
        world.resource::<Metrics>(),
        world.resource::<ScoreCard>(),
        world.resource::<StepProgress>(),
        7,
    );
    let mut csv = Vec::new();
    world.resource::<Trace>().write_csv(&mut csv).unwrap();
    (report.to_json(), csv)
}

#[test]
fn equal_runs_give_equal_bytes_however_long_they_took() {
    let quick = run(Duration::ZERO);
    assert_eq!(quick, run(Duration::from_millis(3)));
    assert_eq!(quick, run(Duration::ZERO));
}

#[test]
fn the_score_can_be_computed_again_from_the_report() {
    let (json, _) = run(Duration::ZERO);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let metrics = report["metrics"].as_array().unwrap();
    let value = |id: &str| {
        metrics.iter().find(|metric| metric["id"] == id).unwrap()["value"]
            .as_f64()
            .unwrap()
    };
    let mut total = 0.0;
    for line in report["score"]["lines"].as_array().unwrap() {
        assert_eq!(line["value"].as_f64().unwrap(), value(line["metric"].as_str().unwrap()));
        assert!(line["formula"].as_str().unwrap().contains("clamp"));
        assert!(!line["basis"].as_str().unwrap().is_empty());
        total += line["points"].as_f64().unwrap();
    }
    assert_eq!(report["score"]["total"].as_f64().unwrap(), total);
}

#[test]
fn every_metric_is_reported_with_its_unit_in_the_order_of_the_table() {
    let (json, _) = run(Duration::ZERO);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let metrics = report["metrics"].as_array().unwrap();
    assert_eq!(metrics.len(), MetricId::ALL.len());
    for (metric, id) in metrics.iter().zip(MetricId::ALL) {
        assert_eq!(metric["id"], id.info().id);
        assert_eq!(metric["unit"], id.info().unit);
        assert!(metric["value"].is_f64());
    }
}
