//! How time and memory of a run change in its course: minute by minute of simulated time.

use std::time::Duration;

use cpu_time::ProcessTime;
use resecta::STEP_HZ;
use serde::Serialize;

/// Steps of a simulated minute.
const STEPS: usize = (60.0 * STEP_HZ) as usize;

/// What one simulated minute took; the last one may be shorter.
#[derive(Debug, Serialize)]
pub struct MinuteTime {
    /// Wall time of a step, mean and largest.
    mean_ms: f64,
    largest_ms: f64,
    /// CPU time of a step, of all threads, mean.
    cpu_ms: f64,
    /// Memory of the process at its end, MB; `None` where the system has no `/proc`.
    memory_mb: Option<f64>,
}

/// Collects the minutes of a run.
pub struct Minutes {
    done: Vec<MinuteTime>,
    /// Of the minute under way.
    steps: usize,
    wall: Duration,
    longest: Duration,
    begun: ProcessTime,
}

impl Minutes {
    pub fn start() -> Self {
        Self {
            done: Vec::new(),
            steps: 0,
            wall: Duration::ZERO,
            longest: Duration::ZERO,
            begun: ProcessTime::now(),
        }
    }

    /// Adds a step by its wall time.
    pub fn step(&mut self, wall: Duration) {
        self.steps += 1;
        self.wall += wall;
        self.longest = self.longest.max(wall);
        if self.steps == STEPS {
            self.end();
        }
    }

    /// All minutes, the one under way included.
    pub fn finish(mut self) -> Vec<MinuteTime> {
        if self.steps > 0 {
            self.end();
        }
        self.done
    }

    fn end(&mut self) {
        let steps = self.steps as f64;
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let minute = MinuteTime {
            mean_ms: ms(self.wall) / steps,
            largest_ms: ms(self.longest),
            cpu_ms: ms(self.begun.elapsed()) / steps,
            memory_mb: memory_mb(),
        };
        self.done.push(minute);
        *self = Self {
            done: std::mem::take(&mut self.done),
            ..Self::start()
        };
    }
}

/// Memory that the process has at the moment (resident), MB.
fn memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_falls_into_minutes_and_what_is_left() {
        let mut minutes = Minutes::start();
        for step in 0..STEPS + 10 {
            minutes.step(Duration::from_millis(if step == 5 { 9 } else { 2 }));
        }
        let minutes = minutes.finish();
        assert_eq!(minutes.len(), 2);
        assert_eq!([minutes[0].largest_ms, minutes[1].largest_ms], [9.0, 2.0]);
        assert!((minutes[1].mean_ms - 2.0).abs() < 1e-9);
        assert!(Minutes::start().finish().is_empty());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_holds_what_is_taken() {
        // Only memory that something may read is really taken.
        let taken = std::hint::black_box(vec![1_u8; 64 << 20]);
        let memory_mb = memory_mb().expect("Linux has /proc");
        assert!(memory_mb > 64.0, "{memory_mb} MB for {} bytes", taken.len());
    }
}
