//! `resecta solve`: a scene of nodes and springs, stepped by our solver as a runner beside others.

use std::{path::PathBuf, time::Instant};

use clap::{Args, ValueEnum};
use cpu_time::ProcessTime;
use resecta::{
    solver::{DEFAULT_ERROR_AIM_MM, StepReport, Tissue},
    spring_scene,
};
use resecta_gpu::{Gpu, GpuError, GpuTissue};
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
    /// Threads it may use; small scenes are faster with one, and the result is the same
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// Who chooses the steps
    #[arg(long, value_enum, default_value_t = Method::Leapfrog)]
    method: Method,
    /// With --method to-aim: the error to aim for, mm, root mean square over the nodes
    #[arg(long, default_value_t = DEFAULT_ERROR_AIM_MM)]
    aim: f32,
}

/// Ways to get to the end.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Method {
    /// Leapfrog with the steps given, true masses and springs
    Leapfrog,
    /// Leapfrog over the same time with steps, inertias and softened springs as the aim allows
    ToAim,
    /// Leapfrog with the steps given on a graphics processor: worth it for large scenes, if at all
    Gpu,
}

impl Solve {
    pub fn run(self) -> Result<(), Failure> {
        let failed = |problem: String| Failure::Solve {
            scene: self.scene.clone(),
            problem,
        };
        let network = spring_scene::read(&self.scene)?;
        let mut tissue = Tissue::from_network(&network).map_err(|error| failed(error.to_string()))?;
        tissue
            .set_error_aim_mm(self.aim)
            .map_err(|error| failed(format!("--aim: {error}")))?;
        let threads = tissue.set_threads(self.threads.into());
        // A graphics processor is opened once, whatever it then does.
        let gpu = (self.method == Method::Gpu).then(Gpu::open).transpose();
        let gpu = gpu.map_err(|error| failed(error.to_string()))?;
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        let (mut told_mm, mut adapter) = (None, None);
        let made = match (self.method, &gpu) {
            (Method::ToAim, _) => tissue.advance_to_aim(self.dt * self.steps as f64).map(|report| {
                told_mm = Some(report.error_mm);
                report.steps
            }),
            (_, None) => tissue.advance_steps(self.dt, self.steps),
            (_, Some(gpu)) => {
                adapter = Some(gpu.adapter());
                let made = self.advance_on(gpu, &mut tissue);
                Ok(made.map_err(|error| failed(error.to_string()))?)
            }
        };
        let report = made.map_err(|error| failed(error.to_string()))?;
        let (wall, cpu) = (wall.elapsed(), cpu.elapsed());
        files::write(&self.out, spring_scene::positions_to_bytes(&tissue))?;
        println!(
            "{}",
            json!({
                "wall_s": wall.as_secs_f64(),
                "cpu_s": cpu.as_secs_f64(),
                "method": self.method.to_possible_value().map(|value| value.get_name().to_owned()),
                "adapter": adapter,
                "threads": threads,
                "nodes": tissue.node_count(),
                "springs": tissue.spring_count(),
                "substeps": report.substeps,
                "substeps_repeated": report.substeps_repeated,
                "substeps_beside": report.substeps_beside,
                "error_told_mm": told_mm,
                "springs_softened": tissue.softened_springs(),
                "substep_s": report.substep_s,
                "bound_s": report.bound_s,
                "put_aside": report.put_aside.iter().map(|aside| aside.node).collect::<Vec<u32>>(),
            })
        );
        Ok(())
    }

    /// Makes the steps on a graphics processor: there, and back again.
    fn advance_on(&self, gpu: &Gpu, tissue: &mut Tissue) -> Result<StepReport, GpuError> {
        let mut moving = GpuTissue::new(gpu, tissue)?;
        let report = moving.advance_steps(self.dt, self.steps)?;
        *tissue = moving.tissue()?;
        Ok(report)
    }
}
