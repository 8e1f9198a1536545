//! Pictures of the key moments of a run, for its report: which moments those are, and how a picture gets into the page.

use std::fmt::{self, Write};

use data_encoding::BASE64;
use resecta_scenario::RunLog;

use crate::page::escaped;

/// Blood lost in a second from which bleeding is a moment of its own, ml.
pub(crate) const BLEEDING_ML_PER_S: f64 = 0.05;
/// Share of the light that comes back to the lens below which the view is bad.
const BAD_VIEW: f64 = 0.5;

/// A moment worth a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyMoment {
    /// What it is called in names of files.
    pub name: &'static str,
    /// What it shows.
    pub words: String,
    /// Simulated time, s.
    pub time_s: f64,
}

/// A picture of a moment.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPicture {
    /// What it shows.
    pub words: String,
    /// Simulated time, s.
    pub time_s: f64,
    /// The picture, a whole PNG file.
    pub png: Vec<u8>,
}

/// The key moments of a run by its log, in the order of time: the first cut, the first touch of the capsule with current, the second
/// that cost most blood, and the worst view.
pub fn key_moments(log: &RunLog) -> Vec<KeyMoment> {
    let samples = &log.samples;
    let moment = |name, words, time_s| KeyMoment { name, words, time_s };
    let first_cut = samples.iter().find(|sample| sample.removed_ml > 0.0);
    let capsule = samples.iter().find(|sample| sample.capsule);
    let seconds = samples.iter().scan((0.0, 0.0), |(from_s, was_ml), sample| {
        let time_s: f64 = sample.time_s - *from_s;
        if time_s < 1.0 {
            return Some(None);
        }
        let ml_per_s = (sample.blood_ml - *was_ml) / time_s;
        (*from_s, *was_ml) = (sample.time_s, sample.blood_ml);
        Some(Some((sample.time_s, ml_per_s)))
    });
    let worst = seconds.flatten().max_by(|(_, a), (_, b)| a.total_cmp(b));
    let worst = worst.filter(|(_, ml_per_s)| *ml_per_s > BLEEDING_ML_PER_S);
    let blind = samples.iter().min_by(|a, b| a.visibility.total_cmp(&b.visibility));
    let blind = blind.filter(|sample| sample.visibility < BAD_VIEW);
    let mut moments: Vec<KeyMoment> = [
        first_cut.map(|sample| moment("first_cut", "First cut".into(), sample.time_s)),
        capsule.map(|sample| moment("capsule", "The loop at the capsule, current on".into(), sample.time_s)),
        worst.map(|(time_s, rate)| moment("bleeding", format!("Worst bleeding: {rate:.1} ml/s"), time_s)),
        blind.map(|sample| {
            let words = format!("Worst view: {:.0} % of the light comes back", 100.0 * sample.visibility);
            moment("view", words, sample.time_s)
        }),
    ]
    .into_iter()
    .flatten()
    .collect();
    moments.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    moments
}

impl KeyPicture {
    /// The picture in HTML, with nothing outside of it.
    pub(crate) fn write_html(&self, html: &mut String) -> fmt::Result {
        writeln!(
            html,
            "<figure><img alt=\"{words}\" src=\"data:image/png;base64,{}\"><figcaption>{words}, {:.1} s</figcaption></figure>",
            BASE64.encode(&self.png),
            self.time_s,
            words = escaped(&self.words),
        )
    }
}

#[cfg(test)]
mod tests {
    use resecta_scenario::LogSample;

    use super::*;

    /// Samples of ten a second: time, removed, blood, visibility, capsule.
    fn log(of: impl Fn(f64) -> (f64, f64, f64, bool)) -> RunLog {
        let samples = (1..=100).map(|tenth| {
            let time_s = f64::from(tenth) / 10.0;
            let (removed_ml, blood_ml, visibility, capsule) = of(time_s);
            LogSample {
                time_s,
                removed_ml,
                blood_ml,
                visibility,
                capsule,
                ..LogSample::default()
            }
        });
        RunLog {
            samples: samples.collect(),
        }
    }

    #[test]
    fn a_run_in_which_nothing_happens_has_none() {
        assert_eq!(key_moments(&log(|_| (0.0, 0.0, 1.0, false))), []);
        assert_eq!(key_moments(&RunLog::default()), []);
    }

    #[test]
    fn they_come_in_the_order_of_time_and_are_the_first_or_the_worst() {
        let eventful = log(|time_s| {
            let blood_ml = 0.1 * time_s + 0.4 * (time_s - 7.0).clamp(0.0, 1.0);
            let visibility = if (4.05..4.15).contains(&time_s) { 0.2 } else { 0.9 };
            ((time_s - 2.95).max(0.0), blood_ml, visibility, time_s > 5.0)
        });
        let moments = key_moments(&eventful);
        let names: Vec<&str> = moments.iter().map(|moment| moment.name).collect();
        assert_eq!(names, ["first_cut", "view", "capsule", "bleeding"]);
        let times: Vec<f64> = moments.iter().map(|moment| moment.time_s).collect();
        assert!(
            times
                .iter()
                .zip([3.0, 4.1, 5.1, 8.0])
                .all(|(a, b)| (a - b).abs() < 0.11),
            "{times:?}"
        );
        assert_eq!(moments[3].words, "Worst bleeding: 0.5 ml/s");
    }
}
