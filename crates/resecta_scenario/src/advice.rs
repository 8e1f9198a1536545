//! What to do better: a sentence for each metric that lost points, the dearest first. All that is said stands in one table.

use crate::{
    metrics::{MetricId, Metrics},
    score::ScoreCard,
};

/// Share of a line's points that may go without a word.
const FINE: f64 = 0.1;

/// What to change where a metric lost points.
const ADVICE: &[(MetricId, &str)] = &[
    (
        MetricId::Elapsed,
        "Take full strokes: a loop drawn back over its whole length removes three times what a short one does, in the same time.",
    ),
    (
        MetricId::MarkedRemoved,
        "Go on until the dye is gone: what is dyed is what is asked for.",
    ),
    (
        MetricId::MarkedRemovedShare,
        "Go on until the dye is gone: work in layers from the bladder neck back, each of a stroke in the middle and one to either side.",
    ),
    (
        MetricId::AdenomaRemovedShare,
        "Leave no adenoma behind: go once round the clock face before you stop, and look for pale, granular tissue.",
    ),
    (
        MetricId::LateralLobeRemoved,
        "More of the lateral lobes has to go: roll the loop to 3 and 9 o'clock and work from the top down.",
    ),
    (
        MetricId::MiddleLobeRemoved,
        "More of the middle lobe has to go: begin at 6 o'clock at the bladder neck.",
    ),
    (
        MetricId::PeripheralRemoved,
        "You went past the adenoma: where granular tissue gives way to fibres, stop.",
    ),
    (
        MetricId::UnmarkedShare,
        "You cut much beside the dye: sink the loop in no deeper than the dyed layer, and lay strokes where it is left.",
    ),
    (
        MetricId::HealthyRemoved,
        "You took healthy tissue: keep to the adenoma, and stay above the verumontanum.",
    ),
    (
        MetricId::CapsuleTouches,
        "Stay off the capsule: make the last strokes of a place shallow ones, and raise the tip before the loop comes near its fibres.",
    ),
    (
        MetricId::CapsuleTouchTime,
        "Let go of the pedal at once when the loop meets the capsule, then raise the tip.",
    ),
    (
        MetricId::CapsuleCut,
        "You cut the capsule: lower the tip less towards the end of a stroke, and look for whitish fibres before each one.",
    ),
    (
        MetricId::CapsuleCutShare,
        "You cut through the capsule: stop where pale granular tissue gives way to fibres that run across.",
    ),
    (
        MetricId::SphincterInjuries,
        "Never press a pedal below the verumontanum: find it before each stroke, and let go of the pedal in front of it.",
    ),
    (
        MetricId::FalsePassages,
        "Never force the sheath: where tissue holds it, draw back, find the dark of the lumen, and follow it with the tip.",
    ),
    (
        MetricId::CurrentWithoutContact,
        "Press a pedal only while the loop is in tissue: sink it in first, let go as soon as the chip is free.",
    ),
    (
        MetricId::TipPath,
        "Move the sheath less: bring it where you work once, then let the loop do the travelling.",
    ),
    (
        MetricId::MassPerStroke,
        "Sink the loop in deeper and draw it over its whole length: fewer, larger chips.",
    ),
    (
        MetricId::RemovalRate,
        "Waste no way between strokes: lay the next one beside the last, and clear the view before it is gone.",
    ),
    (
        MetricId::CoagulationPrecision,
        "Coagulate vessels, not surfaces: bring the loop to where the blood comes from, then press until it stops, and no longer.",
    ),
    (
        MetricId::BleedersClosed,
        "Close every vessel that bleeds: go along the whole bed, the loop drawn in, and look at each side of it before you end.",
    ),
    (
        MetricId::IrrigatedPerGram,
        "Use less water for what you remove: turn the inflow down while the view is clear.",
    ),
    (
        MetricId::LargestContactDepth,
        "Push the sheath less hard into the wall: follow the lumen with the tip.",
    ),
    (
        MetricId::BloodLost,
        "Stop a vessel when it opens: touch it with the loop under the coagulating current before the next stroke.",
    ),
    (
        MetricId::BloodInAll,
        "Stop a vessel when it opens, and look for what still bleeds before you end: a vessel that is left open goes on.",
    ),
    (
        MetricId::Irrigated,
        "Use less water: a clear view does not get clearer with the tap wide open.",
    ),
    (
        MetricId::Absorbed,
        "Keep the bladder's pressure low while veins are open: let water out in time, and close veins at once.",
    ),
    (
        MetricId::Vaporised,
        "Cut full, long strokes: of thin and short ones much vaporises.",
    ),
    (
        MetricId::ChipsInBladder,
        "Flush before you end: with the loop drawn in, close the inflow and let the chips leave with the water.",
    ),
    (
        MetricId::ChipsFlushed,
        "Flush out more of what you cut: hold the sheath in the bladder, where the chips lie, with the outflow wide open.",
    ),
    (
        MetricId::StepsDone,
        "Do the steps to the end: each waits until you have done what it says.",
    ),
    (
        MetricId::BlindTime,
        "Do not go on blind: stop, close the vessel that clouds the water, and let it clear.",
    ),
    (
        MetricId::HiddenShare,
        "Keep water before the lens: where tissue fills the picture, draw the sheath back or turn it away.",
    ),
];

/// Harm that is told first, also where no line scores it or its line waits for something else: what is practised without care for it
/// is unlearnt later.
const HARM: [MetricId; 3] = [
    MetricId::SphincterInjuries,
    MetricId::FalsePassages,
    MetricId::CapsuleTouches,
];

/// What counts where tissue is to be cut away: where none of it does, nobody is told how to cut faster.
const REMOVAL: [MetricId; 8] = [
    MetricId::RemovedMass,
    MetricId::MarkedRemoved,
    MetricId::MarkedRemovedShare,
    MetricId::AdenomaRemovedShare,
    MetricId::LateralLobeRemoved,
    MetricId::MiddleLobeRemoved,
    MetricId::RemovalRate,
    MetricId::MassPerStroke,
];
const SLOW: &str = "Lose no time between one thing and the next: know where you go before you move, and go there once.";

fn sentence(told: MetricId, card: &ScoreCard) -> Option<&'static str> {
    match told {
        MetricId::Elapsed if !card.lines.iter().any(|line| REMOVAL.contains(&line.metric)) => Some(SLOW),
        MetricId::Extension(metric) => metric.advice(),
        _ => (ADVICE.iter().find(|(metric, _)| *metric == told)).map(|&(_, sentence)| sentence),
    }
}

/// What to do better, and what it was about.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// A whole sentence.
    pub sentence: &'static str,
    /// What it is about.
    pub metric: MetricId,
    /// Points that lines lost by it; 0 for harm that no line scores.
    pub lost: f64,
}

impl Advice {
    /// What it cost, in words; none where it cost nothing to speak of.
    pub fn cost(&self) -> Option<String> {
        let points = self.lost.round();
        let unit = if points == 1.0 { "point" } else { "points" };
        (points >= 1.0).then(|| format!("{}: {points:.0} {unit} lost", self.metric.info().title))
    }
}

/// At most `most` sentences: for harm that was done, then for what lost most points, the dearest first; none for lines that lost
/// nothing to speak of. What a line lost because something else was not done counts for that. A metric that the table lacks
/// is passed over.
pub fn advice(card: &ScoreCard, metrics: &Metrics, most: usize) -> Vec<Advice> {
    let mut lost: Vec<(MetricId, f64)> = Vec::new();
    for line in &card.lines {
        let points = line.out_of - line.points;
        if points <= FINE * line.out_of {
            continue;
        }
        let to_blame = line.waits_for.map_or(line.metric, |needed| needed.metric);
        match lost.iter_mut().find(|(metric, _)| *metric == to_blame) {
            Some((_, sum)) => *sum += points,
            None => lost.push((to_blame, points)),
        }
    }
    // Stable: of equals the first in the file comes first.
    lost.sort_by(|a, b| b.1.total_cmp(&a.1));
    let is_forgiven = |metric: &MetricId| {
        let mut lines = card.lines.iter().filter(|line| line.metric == *metric);
        lines.any(|line| line.waits_for.is_none() && line.out_of - line.points <= FINE * line.out_of)
    };
    let harm = (HARM.into_iter()).filter(|metric| metrics.value(*metric) > 0.0 && !is_forgiven(metric));
    let lost_by = |metric| {
        lost.iter()
            .find(|(other, _)| *other == metric)
            .map_or(0.0, |(_, points)| *points)
    };
    let mut said: Vec<Advice> = Vec::new();
    for metric in harm.chain(lost.iter().map(|(metric, _)| *metric)) {
        if let Some(sentence) = sentence(metric, card)
            && said.iter().all(|other| other.sentence != sentence)
        {
            let lost = lost_by(metric);
            said.push(Advice { sentence, metric, lost });
        }
    }
    said.truncate(most);
    said
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{exercise::Condition, metrics::Better, score::ScoreLine};

    fn line(metric: MetricId, points: f64, out_of: f64) -> ScoreLine {
        let info = metric.info();
        ScoreLine {
            metric,
            part: None,
            title: info.title,
            unit: info.unit,
            value: 0.0,
            points,
            out_of,
            waits_for: None,
            formula: String::new(),
            basis: String::new(),
            pars: None,
            medal: None,
        }
    }

    #[test]
    fn every_metric_that_can_be_better_has_a_sentence_and_only_one() {
        for &metric in MetricId::ALL {
            let count = ADVICE.iter().filter(|(other, _)| *other == metric).count();
            let wanted = usize::from(metric.info().better != Better::Neither);
            assert_eq!(count, wanted, "{metric}");
        }
        assert!(ADVICE.iter().all(|(_, sentence)| sentence.ends_with('.')));
    }

    #[test]
    fn the_dearest_loss_is_told_first_and_a_small_one_not_at_all() {
        let card = ScoreCard {
            lines: vec![
                line(MetricId::Elapsed, 10.0, 15.0),
                line(MetricId::RemovalRate, 9.5, 10.0),
                line(MetricId::BlindTime, 9.5, 10.0),
                line(MetricId::BloodLost, 5.0, 30.0),
            ],
            ..Default::default()
        };
        let said = advice(&card, &Metrics::default(), 3);
        assert_eq!(said.len(), 2);
        assert!(
            said[0].sentence.contains("vessel") && said[1].sentence.contains("strokes"),
            "{said:?}"
        );
        assert_eq!(said[0].cost().as_deref(), Some("Blood lost: 25 points lost"));
        assert_eq!(advice(&card, &Metrics::default(), 1), said[..1]);
    }

    #[test]
    fn whoever_is_to_cut_nothing_is_not_told_how_to_cut_faster() {
        let mut card = ScoreCard {
            lines: vec![line(MetricId::Elapsed, 0.0, 15.0)],
            ..Default::default()
        };
        assert_eq!(advice(&card, &Metrics::default(), 3)[0].sentence, SLOW);
        card.lines.push(line(MetricId::RemovedMass, 10.0, 10.0));
        assert!(
            advice(&card, &Metrics::default(), 3)[0]
                .sentence
                .contains("full strokes")
        );
    }

    #[test]
    fn a_line_that_waits_for_something_else_blames_that() {
        let needed = Condition {
            metric: MetricId::AdenomaRemovedShare,
            at_least: 0.3,
        };
        let waiting = |metric, out_of| ScoreLine {
            waits_for: Some(needed),
            ..line(metric, 0.0, out_of)
        };
        let card = ScoreCard {
            lines: vec![
                line(MetricId::Elapsed, 0.0, 25.0),
                line(MetricId::MassPerStroke, 5.0, 5.0),
                waiting(MetricId::BloodLost, 20.0),
                waiting(MetricId::CapsuleTouches, 10.0),
            ],
            ..Default::default()
        };
        let said = advice(&card, &Metrics::default(), 3);
        assert_eq!(said.len(), 2);
        assert!(
            said[0].sentence.contains("adenoma") && said[1].sentence.contains("strokes"),
            "{said:?}"
        );
        assert_eq!(said[0].lost, 30.0, "what waits for it counts for it");
    }

    #[test]
    fn harm_is_told_first_also_where_no_line_scores_it_yet() {
        let mut metrics = Metrics::default();
        metrics.capsule.touches = 2;
        let needed = Condition {
            metric: MetricId::MarkedRemovedShare,
            at_least: 0.4,
        };
        let mut card = ScoreCard {
            lines: vec![
                line(MetricId::MarkedRemovedShare, 0.0, 50.0),
                ScoreLine {
                    waits_for: Some(needed),
                    ..line(MetricId::CapsuleTouches, 0.0, 20.0)
                },
            ],
            ..Default::default()
        };
        let said = advice(&card, &metrics, 3);
        assert!(
            said.len() == 2 && said[0].sentence.contains("capsule") && said[1].sentence.contains("dye"),
            "{said:?}"
        );

        card.lines.clear();
        let said = advice(&card, &metrics, 3);
        assert!(
            said.len() == 1 && said[0].sentence.contains("capsule") && said[0].cost().is_none(),
            "{said:?}"
        );
        // A line that scores it has lost nothing.
        card.lines.push(line(MetricId::CapsuleTouches, 10.0, 10.0));
        assert!(advice(&card, &metrics, 3).is_empty());
    }
}
