//! The score line by line against its pars, views at key moments, and what to do better.

use bevy_egui::egui::{self, RichText, Sense, Stroke, Ui};
use resecta_scenario::{
    ActiveExercise, Condition, Medal, MetricId, Metrics, PartScore, ScoreCard, ScoreLine, ScoreRule, advice,
};

use super::{
    super::{
        history::History,
        menu,
        moments::{Kept, Moments},
        palette,
    },
    clock,
};

/// Sentences of advice at most.
const SENTENCES: usize = 3;
/// Runs of one's own that are compared with.
const RUNS: usize = 6;
/// Where pictures below the lines were smaller than this, points, they go below the runs.
const LEAST_BELOW_LINES: f32 = 150.0;
/// The least side of a picture, points.
const LEAST_VIEW: f32 = 64.0;

/// Shows the page. A run that somebody else showed asks for no advice and is none of the player's own.
pub fn show(
    ui: &mut Ui,
    active: &ActiveExercise,
    (card, metrics): (&ScoreCard, &Metrics),
    (history, is_own): (&History, bool),
    moments: &Moments,
) {
    let width = ui.available_width();
    let kept: Vec<&Kept> = moments.kept().collect();
    ui.horizontal_top(|ui| {
        let shows_views = menu::part(ui, [width * 0.66, ui.available_height()], |ui| {
            lines(ui, card, &active.exercise.scoring);
            if let Some(note) = not_done(active, metrics) {
                ui.label(RichText::new(note).size(14.0).color(palette::CAREFUL));
            }
            if let Some(note) = left_open(card, metrics) {
                ui.label(RichText::new(note).size(14.0).color(palette::CAREFUL));
            }
            ui.add_space(6.0);
            let note = "The exercise file states what a line is worth. Bronze, silver and gold beside a line say how good its value \
                        is; the medal of the run goes by all points together. Point at a line for what it measures, what earns points \
                        and where that comes from.";
            ui.label(RichText::new(note).size(12.5).color(palette::WEAK));
            ui.add_space(6.0);
            let has_room = Views::within(ui.available_size(), kept.len()).side >= LEAST_BELOW_LINES;
            if has_room {
                views(ui, &kept);
            }
            has_room
        });
        ui.add_space(14.0);
        ui.vertical(|ui| {
            if is_own {
                menu::card(ui, |ui| {
                    ui.set_width(ui.available_width());
                    menu::caption(ui, "What to do better");
                    let said = advice(card, metrics, SENTENCES);
                    if said.is_empty() {
                        let next = if active.exercise.steps.is_empty() {
                            "Try it on another gland."
                        } else {
                            "Go on with the next exercise."
                        };
                        ui.label(format!("Nothing lost points to speak of. {next}"));
                    }
                    for (number, advice) in said.iter().enumerate() {
                        let words = format!("{}. {}", number + 1, advice.sentence);
                        ui.label(RichText::new(words).size(15.5));
                        if let Some(cost) = advice.cost() {
                            ui.label(RichText::new(cost).size(12.5).color(palette::WEAK));
                        }
                    }
                });
                ui.add_space(8.0);
            }
            if is_own || history.of_exercise(&active.name).next().is_some() {
                menu::card(ui, |ui| {
                    ui.set_width(ui.available_width());
                    own_runs(ui, &active.name, history, is_own);
                });
            }
            // The many lines of a whole operation leave no room below them in a small window.
            if !shows_views {
                ui.add_space(8.0);
                views(ui, &kept);
            }
        });
    });
}

fn lines(ui: &mut Ui, card: &ScoreCard, rules: &[ScoreRule]) {
    egui::Grid::new("lines")
        .num_columns(5)
        .striped(true)
        // Many lines must leave room for what follows.
        .spacing([20.0, if card.lines.len() > 6 { 5.0 } else { 15.0 }])
        .show(ui, |ui| {
            let has_pars = card.lines.iter().any(|line| line.pars.is_some());
            let medals = if has_pars { "Bronze, silver, gold" } else { "" };
            for title in ["", "Value", medals, "", "Points"] {
                ui.label(RichText::new(title).size(13.0).color(palette::WEAK));
            }
            ui.end_row();
            // A line for each rule, in the order of the file.
            for (line, rule) in card.lines.iter().zip(rules) {
                let points = in_proportion(rule);
                let mut basis = format!("{}\n{points}\n{}", line.metric.info().doc.trim(), line.basis);
                if let Some(pars) = &line.pars {
                    basis.push_str(&format!("\nBronze, silver, gold: {}", pars.basis));
                }
                ui.label(RichText::new(line.title).size(17.0)).on_hover_text(basis);
                ui.label(RichText::new(value(line.metric, line.value)).size(17.0));
                pars(ui, line);
                bar(ui, line);
                ui.label(
                    RichText::new(format!("{:.1} of {:.0}", line.points, line.out_of))
                        .size(17.0)
                        .strong(),
                );
                ui.end_row();
            }
        });
    ui.add_space(4.0);
    for note in waiting(card) {
        ui.label(RichText::new(note).size(14.0).color(palette::CAREFUL));
    }
    if !card.parts.is_empty() {
        let part = |part: &PartScore| format!("{} {:.0} of {:.0}", part.part.name(), part.points, part.out_of);
        let parts: Vec<String> = card.parts.iter().map(part).collect();
        ui.label(RichText::new(parts.join("   ")).strong());
    }
    if let Some(harm) = card.harm {
        let note = format!("No medal for the total: {}.", harm.words());
        ui.label(RichText::new(note).size(14.0).color(palette::CAREFUL));
    }
    for goal in &card.goals {
        let (sign, colour) = if goal.reached {
            ("✔", palette::GOOD)
        } else {
            ("✖", palette::CAREFUL)
        };
        ui.label(RichText::new(format!("{sign} {}", goal.goal)).color(colour));
    }
}

/// The first step that was not done, and how many there are.
fn not_done(active: &ActiveExercise, metrics: &Metrics) -> Option<String> {
    let steps = &active.exercise.steps;
    let done = metrics.steps_done as usize;
    let step = steps.get(done)?;
    Some(format!("✖ Step {} of {}: {}", done + 1, steps.len(), step.say))
}

/// What was left to bleed where blood counts, and how much of it is still to come where that is scored: nobody sees it in the curve of
/// what was lost.
fn left_open(card: &ScoreCard, metrics: &Metrics) -> Option<String> {
    let counts = |metric| card.lines.iter().any(|line| line.metric == metric);
    let is_to_come = counts(MetricId::BloodInAll);
    let (open, to_come_ml) = (metrics.water.bleeders, metrics.water.to_come_ml);
    if open == 0 || !(is_to_come || counts(MetricId::BloodLost)) {
        return None;
    }
    let vessels = if open == 1 {
        "1 vessel was"
    } else {
        &format!("{open} vessels were")
    };
    Some(if is_to_come && to_come_ml >= 0.5 {
        format!("{vessels} left open: {to_come_ml:.0} ml of the blood is still to come.")
    } else {
        format!("{vessels} left open.")
    })
}

/// For everything that lines wait for, a sentence that says which: they show good values and no points.
fn waiting(card: &ScoreCard) -> Vec<String> {
    let mut groups: Vec<(Condition, Vec<&str>)> = Vec::new();
    for line in &card.lines {
        let Some(needed) = line.waits_for else { continue };
        match groups.iter_mut().find(|(other, _)| *other == needed) {
            Some((_, titles)) => titles.push(line.title),
            None => groups.push((needed, vec![line.title])),
        }
    }
    let sentence = |(needed, titles): (Condition, Vec<&str>)| {
        let needed = condition(needed);
        match titles[..] {
            [one] => format!("{one} counts once {needed}."),
            _ => format!("{} count once {needed}.", titles.join(", ")),
        }
    };
    groups.into_iter().map(sentence).collect()
}

/// What a line waits for, in words.
pub fn condition(Condition { metric, at_least }: Condition) -> String {
    format!("{} is {} or more", metric.info().title, value(metric, at_least))
}

/// A value of a metric with its unit; shares as percentages. A digit behind the point only where it says something.
pub fn value(metric: MetricId, value: f64) -> String {
    let info = metric.info();
    match info.unit {
        "1" if metric.is_share() => format!("{:.0} %", 100.0 * value),
        "1" => format!("{value:.0}"),
        unit => {
            let is_whole = (10.0 * value).round() % 10.0 == 0.0;
            let digits = usize::from(value.abs() < 100.0 && !is_whole);
            format!("{value:.digits$} {unit}")
        }
    }
}

/// What earns points by a rule, in words.
fn in_proportion(rule: &ScoreRule) -> String {
    let [none, all] = [rule.from, rule.to].map(|at| value(rule.metric, at));
    let [worse, better] = if rule.to > rule.from {
        ["less", "more"]
    } else {
        ["more", "less"]
    };
    format!(
        "None at {none} or {worse}, all {} points at {all} or {better}, in proportion between.",
        rule.points
    )
}

/// The three pars, the best one earned filled in.
fn pars(ui: &mut Ui, line: &ScoreLine) {
    let Some(pars) = &line.pars else {
        ui.label("");
        return;
    };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        for medal in Medal::ALL {
            let is_earned = line.medal.is_some_and(|earned| earned >= medal);
            let colour = palette::medal(medal);
            let (fill, text) = if is_earned {
                (colour, palette::GROUND)
            } else {
                (palette::GROUND, palette::WEAK)
            };
            let sign = if is_earned { "✔ " } else { "" };
            egui::Frame::new()
                .fill(fill)
                .stroke(Stroke::new(1.5, if is_earned { colour } else { palette::LINE }))
                .corner_radius(10)
                .inner_margin(egui::Margin::symmetric(8, 2))
                .show(ui, |ui| {
                    let words = format!("{sign}{}", value(line.metric, pars.of(medal)));
                    ui.label(RichText::new(words).size(13.0).color(text))
                        .on_hover_text(medal.name());
                });
        }
    });
}

/// Points earned as a bar.
fn bar(ui: &mut Ui, line: &ScoreLine) {
    let (area, _) = ui.allocate_exact_size(egui::vec2(130.0, 12.0), Sense::hover());
    let share = if line.out_of > 0.0 {
        line.points / line.out_of
    } else {
        0.0
    };
    let mut filled = area;
    filled.set_width(area.width() * share.clamp(0.0, 1.0) as f32);
    ui.painter().rect_filled(area, 6.0, palette::BUTTON);
    ui.painter().rect_filled(filled, 6.0, palette::ACCENT);
}

/// How pictures are arranged.
struct Views {
    /// How many go beside each other.
    columns: usize,
    /// How wide and high each is, points.
    side: f32,
}

impl Views {
    /// So many pictures, as large as a place of this size allows.
    fn within(size: egui::Vec2, count: usize) -> Views {
        let arranged = |columns: usize| {
            let wide = size.x / columns as f32 - 12.0;
            // Beside a narrow picture's neighbours its words take two lines.
            let words = if wide < 220.0 { 42.0 } else { 26.0 };
            let high = size.y / count.div_ceil(columns) as f32 - words;
            Views {
                columns,
                side: wide.min(high),
            }
        };
        let all = (1..=count.max(1)).map(arranged);
        all.max_by(|one, other| one.side.total_cmp(&other.side))
            .unwrap_or(arranged(1))
    }
}

/// What was seen at key moments, as large as there is room for.
fn views(ui: &mut Ui, kept: &[&Kept]) {
    let Views { columns, side } = Views::within(ui.available_size(), kept.len());
    let side = side.max(LEAST_VIEW);
    for row in kept.chunks(columns) {
        ui.horizontal_top(|ui| {
            for kept in row {
                ui.vertical(|ui| {
                    ui.set_width(side);
                    let words = format!("{}, {}", clock(kept.time_s), kept.words);
                    ui.label(RichText::new(words).size(12.5).color(palette::WEAK));
                    ui.image((kept.texture, egui::vec2(side, side)));
                });
            }
        });
    }
}

/// The player's own runs, the latest first: this one, or the last before what was shown.
fn own_runs(ui: &mut Ui, exercise: &str, history: &History, is_own: bool) {
    menu::caption(ui, "Your runs");
    let best = history.best(exercise);
    egui::Grid::new("own runs")
        .num_columns(4)
        .spacing([18.0, 4.0])
        .show(ui, |ui| {
            for (number, run) in history.of_exercise(exercise).rev().take(RUNS).enumerate() {
                let is_best = run.score > 0.0 && best.is_some_and(|best| std::ptr::eq(best, run));
                let name = match number {
                    0 if is_own => "This run".to_owned(),
                    0 => "The last".to_owned(),
                    number => format!("{number} before"),
                };
                ui.label(RichText::new(name).color(if number == 0 { palette::TEXT } else { palette::WEAK }));
                ui.label(RichText::new(format!("{:.0} of {:.0}", run.score, run.out_of)).color(palette::ACCENT));
                ui.label(clock(run.elapsed_s));
                ui.label(RichText::new(if is_best { "best" } else { "" }).color(palette::GOOD));
                ui.end_row();
            }
        });
    if let Some(trouble) = &history.trouble {
        ui.label(RichText::new(trouble).color(palette::CAREFUL));
    }
    if let Some(record) = &history.record {
        ui.add_space(4.0);
        let words = format!("Kept as {}", record.display());
        ui.label(RichText::new(words).size(12.5).color(palette::WEAK));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_stay_within_their_place_and_are_as_large_as_it_allows() {
        for (width, height, columns) in [(800.0, 280.0, 3), (360.0, 340.0, 2), (200.0, 700.0, 1)] {
            let views = Views::within(egui::vec2(width, height), 3);
            assert_eq!(views.columns, columns, "{width} by {height}");
            let rows = 3_usize.div_ceil(columns);
            assert!(views.side * columns as f32 <= width && views.side * rows as f32 <= height);
        }
    }

    #[test]
    fn values_are_as_long_as_they_say_something() {
        let blood = |ml| value(MetricId::BloodLost, ml);
        let shown = [0.0, 0.5, 36.04, 59.96, 99.96, 312.7, 2000.0].map(blood);
        assert_eq!(
            shown,
            ["0 ml", "0.5 ml", "36 ml", "60 ml", "100 ml", "313 ml", "2000 ml"]
        );
        assert_eq!(value(MetricId::MarkedRemovedShare, 0.5), "50 %");
        // 40.2 s are no 40: the par that they miss stands beside them.
        assert_eq!(value(MetricId::BlindTime, 40.2), "40.2 s");
        assert_eq!(value(MetricId::BlindTime, 269.4), "269 s");
    }

    #[test]
    fn what_earns_points_is_told_from_the_worse_end_to_the_better() {
        let rule = |metric, from, to| ScoreRule {
            metric,
            part: None,
            points: 30.0,
            from,
            to,
            basis: String::new(),
            pars: None,
            needs: None,
        };
        assert_eq!(
            in_proportion(&rule(MetricId::BloodLost, 80.0, 15.0)),
            "None at 80 ml or more, all 30 points at 15 ml or less, in proportion between."
        );
        assert_eq!(
            in_proportion(&rule(MetricId::MarkedRemovedShare, 0.0, 0.9)),
            "None at 0 % or less, all 30 points at 90 % or more, in proportion between."
        );
    }

    #[test]
    fn lines_that_wait_for_the_same_are_told_together() {
        let needed = |metric, at_least| Some(Condition { metric, at_least });
        let line = |metric: MetricId, waits_for| ScoreLine {
            metric,
            part: None,
            title: metric.info().title,
            unit: metric.info().unit,
            value: 0.0,
            points: 0.0,
            out_of: 10.0,
            waits_for,
            formula: String::new(),
            basis: String::new(),
            pars: None,
            medal: None,
        };
        let half = needed(MetricId::MarkedRemovedShare, 0.5);
        let card = ScoreCard {
            lines: vec![
                line(MetricId::MarkedRemovedShare, None),
                line(MetricId::BloodLost, half),
                line(MetricId::RemovalRate, needed(MetricId::RemovedMass, 2.0)),
                line(MetricId::BlindTime, half),
            ],
            ..ScoreCard::default()
        };
        assert_eq!(
            waiting(&card),
            [
                "Blood lost, Time without a view count once Marked tissue removed is 50 % or more.",
                "Removal rate counts once Tissue removed is 2 g or more.",
            ]
        );
    }
}
