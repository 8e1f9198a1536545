//! `resecta solve`: a scene of nodes and springs, stepped by our solver as a runner beside others.

use std::{path::PathBuf, time::Instant};

use clap::Args;
use cpu_time::ProcessTime;
use resecta::{solver::Tissue, spring_scene};
use serde_json::json;

use super::{Failure, files};

/// Step a scene of nodes and springs, write where the nodes end, and print what it took as a line of JSON
#[derive(Args)]
pub struct Solve {
    /// The scene (MSSCENE1)
    scene: PathBuf,
    /// File for x, y, z of every node in metres, f64; an existing one is replaced
    out: PathBuf,
    /// Length of a step, s; divided where it is above the bound of stability
    #[arg(long)]
    dt: f64,
    /// Steps to make
    #[arg(long)]
    steps: u64,
    /// Threads it may use; one tissue is stepped by one so far
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    threads: u32,
}

impl Solve {
    pub fn run(self) -> Result<(), Failure> {
        let failed = |problem: String| Failure::Solve {
            scene: self.scene.clone(),
            problem,
        };
        let network = spring_scene::read(&self.scene)?;
        let mut tissue = Tissue::from_network(&network).map_err(|error| failed(error.to_string()))?;
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        let report = tissue
            .advance_steps(self.dt, self.steps)
            .map_err(|error| failed(error.to_string()))?;
        let (wall, cpu) = (wall.elapsed(), cpu.elapsed());
        files::write(&self.out, spring_scene::positions_to_bytes(&tissue))?;
        println!(
            "{}",
            json!({
                "wall_s": wall.as_secs_f64(),
                "cpu_s": cpu.as_secs_f64(),
                "method": "verlet",
                "threads": 1,
                "nodes": tissue.node_count(),
                "springs": tissue.spring_count(),
                "substeps": report.substeps,
                "substeps_repeated": report.substeps_repeated,
                "substep_s": report.substep_s,
                "bound_s": report.bound_s,
                "put_aside": report.put_aside.iter().map(|aside| aside.node).collect::<Vec<u32>>(),
            })
        );
        Ok(())
    }
}
