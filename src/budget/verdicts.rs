//! What the budget comes to: every part over all scenes, and whether it is finer than it needs to be.
//!
//! Two runs that hardly differ end up apart, too. This noise is subtracted by squares: errors that have nothing to do
//! with each other add up so.

use super::{Apart, Budget, PARTS, PartResult, RunResult, SceneResult};

/// Parts may differ by this factor: "no part ten times more accurate than the worst".
pub const FACTOR: f64 = 10.0;

/// A setting over all scenes in which a part was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Over {
    /// The setting in words.
    pub setting: String,
    /// Root mean square over scenes of the scenes' RMS, mm; 0 for the finest.
    pub rms_mm: f64,
    /// The same beyond noise.
    pub beyond_mm: f64,
    /// The largest of the scenes' 95th percentiles, mm.
    pub p95_mm: f64,
    /// CPU time of 1/60 s over that as shipped, mean over scenes.
    pub cost: f64,
    /// The slowest step of all scenes, ms.
    pub slowest_ms: f64,
    /// Most elements inside out in a step of any scene.
    pub inverted: usize,
}

/// A part over all scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its name, and what its setting is.
    pub name: String,
    /// As shipped.
    pub shipped: Over,
    /// The next coarser setting.
    pub coarser: Option<Over>,
    /// The next finer setting, and whether it is the one that all are measured against.
    pub finer: Option<(Over, bool)>,
    /// How many times more accurate it is than the worst part.
    pub times: f64,
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// How far apart runs of a scene end up that hardly differ, mm RMS.
pub fn noise_of(scene: &SceneResult) -> f64 {
    let apart = scene.noise.iter().filter_map(|run| run.apart);
    mean(apart.map(|apart| apart.rms_mm.powi(2))).sqrt()
}

/// The same moment by moment.
pub fn noise_by_look(scene: &SceneResult) -> Vec<f64> {
    let of_look = |look: usize| {
        let apart = scene.noise.iter().filter_map(|run| *run.by_look.get(look)?);
        mean(apart.map(|apart| apart.rms_mm.powi(2))).sqrt()
    };
    (0..scene.looks.len()).map(of_look).collect()
}

/// What a distance in a scene has beyond noise, mm RMS.
pub fn beyond(apart: &Apart, scene: &SceneResult) -> f64 {
    (apart.rms_mm.powi(2) - noise_of(scene).powi(2)).max(0.0).sqrt()
}

/// Runs, each of a scene, as one.
fn over<'a>(setting: &str, runs: &[(&'a RunResult, &'a SceneResult)]) -> Over {
    let apart = || runs.iter().filter_map(|(run, scene)| Some((run.apart?, *scene)));
    let cost = |(run, scene): &(&RunResult, &SceneResult)| {
        run.cost.frame_ms / scene.shipped.cost.frame_ms.max(f64::MIN_POSITIVE)
    };
    Over {
        setting: setting.into(),
        rms_mm: mean(apart().map(|(apart, _)| apart.rms_mm.powi(2))).sqrt(),
        beyond_mm: mean(apart().map(|(apart, scene)| beyond(&apart, scene).powi(2))).sqrt(),
        p95_mm: largest(apart().map(|(apart, _)| apart.p95_mm)),
        cost: mean(runs.iter().map(cost)),
        slowest_ms: largest(runs.iter().map(|(run, _)| run.cost.slowest_ms)),
        inverted: runs.iter().map(|(run, _)| run.over_steps.inverted).max().unwrap_or(0),
    }
}

/// The settings of a part over all scenes, from coarse to fine. A setting that not every scene has is over those that do.
pub fn settings(budget: &Budget, key: &str) -> Vec<Over> {
    let of_part = |part: &&PartResult| part.key == key;
    let parts: Vec<(&PartResult, &SceneResult)> = (budget.scenes.iter())
        .filter_map(|scene| Some((scene.parts.iter().find(of_part)?, scene)))
        .collect();
    // The scene with most settings has all of them.
    let Some((longest, _)) = parts.iter().max_by_key(|(part, _)| part.runs.len()) else {
        return Vec::new();
    };
    let of_setting = |run: &RunResult| {
        let same = |other: &&RunResult| other.setting == run.setting;
        let runs: Vec<_> = (parts.iter())
            .filter_map(|(part, scene)| Some((part.runs.iter().find(same)?, *scene)))
            .collect();
        over(&run.setting, &runs)
    };
    longest.runs.iter().map(of_setting).collect()
}

/// The distance between runs that hardly differ.
pub fn noise(budget: &Budget) -> Over {
    let runs = budget
        .scenes
        .iter()
        .flat_map(|scene| scene.noise.iter().map(move |run| (run, scene)));
    over("", &runs.collect::<Vec<_>>())
}

/// How deep the surface lies in a part of the instrument, as shipped, over all moments: the error of contact.
fn contact(budget: &Budget, part: usize) -> Over {
    let standing = || budget.scenes.iter().flat_map(|scene| &scene.shipped.standing);
    let depths = || standing().filter_map(|standing| standing.parts[part].surface);
    let shipped: Vec<_> = budget.scenes.iter().map(|scene| (&scene.shipped, scene)).collect();
    let rms_mm = mean(depths().map(|depth| depth.rms_mm.powi(2))).sqrt();
    Over {
        rms_mm,
        // Steel does not get apart from itself.
        beyond_mm: rms_mm,
        p95_mm: largest(depths().map(|depth| depth.p95_mm)),
        ..over("as shipped", &shipped)
    }
}

/// Every part, and how many times more accurate it is than the worst.
pub fn lines(budget: &Budget) -> Vec<Line> {
    let Some(scene) = budget.scenes.first() else {
        return Vec::new();
    };
    let of_part = |part: &PartResult| {
        let mut settings = settings(budget, part.key).into_iter();
        let (coarser, shipped) = (settings.next(), settings.next()?);
        let finer = settings.next();
        let is_last = settings.next().is_none();
        Some(Line {
            name: format!("{}: {}", part.name, part.unit),
            shipped,
            coarser,
            finer: finer.map(|finer| (finer, is_last)),
            times: 1.0,
        })
    };
    let mut lines: Vec<Line> = scene.parts.iter().filter_map(of_part).collect();
    lines.extend(PARTS.iter().enumerate().map(|(part, name)| Line {
        name: format!("contact of the {name}"),
        shipped: contact(budget, part),
        coarser: None,
        finer: None,
        times: 1.0,
    }));
    let worst = largest(lines.iter().map(|line| line.shipped.beyond_mm));
    for line in &mut lines {
        line.times = worst / line.shipped.beyond_mm.max(f64::MIN_POSITIVE);
    }
    lines
}

/// A frame, ms.
const FRAME_MS: f64 = 1e3 / 60.0;
/// Errors that differ by less than this share of the noise are not told apart.
const TOLD_APART: f64 = 0.2;
/// A finer setting is worth it that costs so many times as much at most, and a coarser one that saves this share at least. Ours.
pub const WORTH: (f64, f64) = (1.15, 0.1);

/// What the numbers support for a part. Nothing follows from it by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advice {
    /// As it is.
    Keep,
    /// The next finer setting.
    Finer,
    /// The next coarser setting.
    Coarser,
}

impl Line {
    /// What the finer setting gains, mm; `None` where that is no more than noise.
    pub fn gain_mm(&self, noise: &Over) -> Option<f64> {
        let (finer, is_reference) = self.finer.as_ref()?;
        let finer_mm = if *is_reference { 0.0 } else { finer.beyond_mm };
        told_apart(self.shipped.beyond_mm - finer_mm, noise)
    }

    /// What the coarser setting loses, mm; `None` where that is no more than noise.
    pub fn loss_mm(&self, noise: &Over) -> Option<f64> {
        told_apart(self.coarser.as_ref()?.beyond_mm - self.shipped.beyond_mm, noise)
    }

    /// Elements that the coarser setting turns inside out and the shipped one does not, if more than one.
    pub fn coarser_inverts(&self) -> Option<usize> {
        let coarser = self.coarser.as_ref()?.inverted;
        (coarser > self.shipped.inverted + 1).then_some(coarser)
    }

    /// The slowest step of the coarser setting, ms, if it is longer than a frame and none of the shipped one is.
    pub fn coarser_stalls_ms(&self) -> Option<f64> {
        let coarser = self.coarser.as_ref()?.slowest_ms;
        (coarser > FRAME_MS && self.shipped.slowest_ms < FRAME_MS).then_some(coarser)
    }

    /// What the numbers support.
    pub fn advice(&self, noise: &Over) -> Advice {
        let (most_cost, least_saved) = WORTH;
        let is_cheap = (self.finer.as_ref()).is_some_and(|(finer, _)| finer.cost <= most_cost);
        let saves = (self.coarser.as_ref()).is_some_and(|coarser| 1.0 - coarser.cost >= least_saved);
        let is_needless = self.loss_mm(noise).is_none() || self.times > FACTOR;
        let is_sound = self.coarser_inverts().is_none() && self.coarser_stalls_ms().is_none();
        if is_cheap && self.gain_mm(noise).is_some() {
            Advice::Finer
        } else if saves && is_needless && is_sound {
            Advice::Coarser
        } else {
            Advice::Keep
        }
    }
}

fn told_apart(mm: f64, noise: &Over) -> Option<f64> {
    (mm > TOLD_APART * noise.rms_mm).then_some(mm)
}

/// What contact costs, as a share of the CPU time: what a run without it saves.
pub fn share_of_contact(budget: &Budget) -> f64 {
    let runs: Vec<_> = budget.scenes.iter().map(|scene| (&scene.no_contact, scene)).collect();
    1.0 - over("", &runs).cost
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(beyond_mm: f64, cost: f64) -> Over {
        Over {
            setting: String::new(),
            rms_mm: beyond_mm,
            beyond_mm,
            p95_mm: beyond_mm,
            cost,
            slowest_ms: 5.0,
            inverted: 0,
        }
    }

    /// A part between a coarser and a finer setting: errors, mm, and costs.
    fn line(coarser: (f64, f64), finer: (f64, f64)) -> Line {
        Line {
            name: String::new(),
            shipped: setting(0.2, 1.0),
            coarser: Some(setting(coarser.0, coarser.1)),
            finer: Some((setting(finer.0, finer.1), false)),
            times: 2.0,
        }
    }

    #[test]
    fn advice_follows_gain_loss_and_cost() {
        let noise = setting(0.1, 1.0);
        let advice = |coarser, finer| line(coarser, finer).advice(&noise);
        assert_eq!(
            advice((0.3, 0.5), (0.1, 2.0)),
            Advice::Keep,
            "finer is dear, coarser errs"
        );
        assert_eq!(advice((0.3, 0.5), (0.1, 1.1)), Advice::Finer, "much for little");
        assert_eq!(
            advice((0.3, 0.5), (0.19, 1.1)),
            Advice::Keep,
            "too little to be told from noise"
        );
        assert_eq!(
            advice((0.21, 0.5), (0.1, 2.0)),
            Advice::Coarser,
            "saves and loses nothing"
        );
        assert_eq!(advice((0.21, 0.95), (0.1, 2.0)), Advice::Keep, "saves too little");
        let mut stalls = line((0.21, 0.5), (0.1, 2.0));
        stalls.coarser = stalls.coarser.map(|coarser| Over {
            slowest_ms: 40.0,
            ..coarser
        });
        assert_eq!(stalls.advice(&noise), Advice::Keep, "a step is longer than a frame");
        let mut too_fine = line((0.3, 0.5), (0.1, 2.0));
        too_fine.times = 2.0 * FACTOR;
        assert_eq!(
            too_fine.advice(&noise),
            Advice::Coarser,
            "far finer than the worst part"
        );
    }
}
