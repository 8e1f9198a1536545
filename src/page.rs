//! The report of a run as one page: an HTML file that holds all it shows, to be read in any browser and printed. Equal runs give
//! equal bytes, as of the other files of a run.

use std::fmt::Write;

use bevy::prelude::World;
use plotters::prelude::*;
use resecta_scenario::{ActiveExercise, Advice, CutMap, LogSample, Medal, MetricId, Report, RunLog, advice};
use resecta_tissue::Tissue;

use crate::key_pictures::KeyPicture;

/// Height of a row of the map, mm, and its columns: a quarter of an hour each.
const ROW_MM: f64 = 2.0;
/// As of [`ROW_MM`].
const COLUMNS: usize = 48;

/// Most sentences of advice.
const ADVICE: usize = 5;
/// Width and height of a curve and of the map, px.
const CURVE: (u32, u32) = (760, 180);
const MAP: (u32, u32) = (760, 420);

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:50em;margin:2em auto;padding:0 1em;color:#1c2226}\
    h1{margin-bottom:0}h2{margin:1.6em 0 .4em}table{border-collapse:collapse;width:100%}\
    th,td{text-align:left;padding:.25em .8em .25em 0;border-bottom:1px solid #d8dde0;vertical-align:top}\
    td.n{text-align:right;white-space:nowrap}small{color:#5a646b}svg{width:100%;height:auto}\
    .pictures{display:flex;flex-wrap:wrap;gap:.8em}figure{margin:0;width:16em}figure img{width:100%;border-radius:6px}\
    figcaption{font-size:13px;color:#5a646b}\
    @media print{body{margin:0;max-width:none}h2,tr,svg,figure{break-inside:avoid}}";

/// The map of what was cut, as the page shows it.
pub fn map_of(active: &ActiveExercise, tissue: &Tissue) -> CutMap {
    CutMap::of_exercise(active, tissue.solver(), ROW_MM, COLUMNS)
}

/// The page of the exercise in a world; none where its tissue is gone.
pub fn page_of(world: &World, report: &Report, pictures: &[KeyPicture]) -> Option<String> {
    let active = world.resource::<ActiveExercise>();
    let map = map_of(active, world.get::<Tissue>(active.tissue)?);
    let said = advice(world.resource(), world.resource(), ADVICE);
    Some(page(report, world.resource(), &map, &said, pictures))
}

/// A value over time.
struct Curve {
    title: &'static str,
    value: fn(&LogSample) -> f64,
    colour: RGBColor,
}

const CURVES: [Curve; 4] = [
    Curve {
        title: "Tissue removed, ml",
        value: |sample| sample.removed_ml,
        colour: RGBColor(31, 119, 180),
    },
    Curve {
        title: "Blood lost, ml",
        value: |sample| sample.blood_ml,
        colour: RGBColor(200, 30, 40),
    },
    Curve {
        title: "Pressure in the bladder, cmH2O",
        value: |sample| sample.pressure_cmh2o,
        colour: RGBColor(148, 103, 189),
    },
    Curve {
        title: "View, share of the light",
        value: |sample| sample.visibility,
        colour: RGBColor(44, 120, 44),
    },
];

/// The page of a run: its score line by line, what to do better, pictures of key moments where there are any, its course, what was cut, every metric and the settings.
pub fn page(report: &Report, log: &RunLog, map: &CutMap, advice: &[Advice], pictures: &[KeyPicture]) -> String {
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}: report of a run</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n",
        title = escaped(&report.exercise.title)
    );
    // Nothing fails that writes to a text.
    head(&mut html, report).ok();
    score(&mut html, report).ok();
    if !advice.is_empty() {
        let sentences: String = advice
            .iter()
            .map(|said| {
                let cost = said.cost().map(|cost| format!("<br><small>{}</small>", escaped(&cost)));
                format!("<li>{}{}</li>", escaped(said.sentence), cost.unwrap_or_default())
            })
            .collect();
        write!(html, "<h2>What to do better</h2>\n<ul>{sentences}</ul>\n").ok();
    }
    steps(&mut html, report).ok();
    if !pictures.is_empty() {
        html += "<h2>Key moments</h2>\n<div class=\"pictures\">\n";
        for picture in pictures {
            picture.write_html(&mut html).ok();
        }
        html += "</div>\n";
    }
    html += "<h2>Over time</h2>\n";
    for curve in CURVES.iter().filter(|curve| varies(curve, log)) {
        html += &drawn(CURVE, |area| draw_curve(area, curve, log));
    }
    html += "<h2>What was cut</h2>\n<p>Unrolled: hours on the clock about the urethra and height along the axis, the bladder above \
             and the patient's left (3 o'clock) on the right, as the operator sees it. The darker, the more is gone of what was there; \
             red where the capsule was cut.</p>\n";
    html += &drawn(MAP, |area| draw_map(area, map));
    metrics(&mut html, report).ok();
    html += "</body></html>\n";
    html
}

fn head(html: &mut String, report: &Report) -> std::fmt::Result {
    let ended = report.run.ended.map_or("it still runs", |reason| reason.words());
    let medal = match (report.score.medal, report.score.harm) {
        (Some(earned), _) => medal(earned),
        (None, Some(_)) => "no medal after such harm",
        (None, None) => "no medal",
    };
    writeln!(
        html,
        "<p><strong>{:.1} of {:.0} points</strong>, {medal}. {:.1} s; it ended because {ended}.<br><small>{}</small></p>",
        report.score.total,
        report.score.out_of,
        report.run.elapsed_s,
        escaped(report.note),
    )
}

fn score(html: &mut String, report: &Report) -> std::fmt::Result {
    html.push_str("<h2>Score</h2>\n<table><tr><th>Line<th>Value<th>Points<th>Medal</tr>\n");
    for line in &report.score.lines {
        writeln!(
            html,
            "<tr><td>{}<br><small>{}. {}</small><td class=\"n\">{}<td class=\"n\">{:.1} of {:.0}<td>{}</tr>",
            escaped(line.title),
            escaped(&line.formula),
            escaped(&line.basis),
            with_unit(line.metric, line.value),
            line.points,
            line.out_of,
            line.medal.map_or("", medal),
        )?;
    }
    for part in &report.score.parts {
        writeln!(
            html,
            "<tr><td><strong>{}</strong><td><td class=\"n\">{:.1} of {:.0}<td></tr>",
            part.part.name(),
            part.points,
            part.out_of
        )?;
    }
    html.push_str("</table>\n");
    for goal in &report.score.goals {
        let reached = if goal.reached { "reached" } else { "not reached" };
        writeln!(html, "<p>Goal: {} ({reached}).</p>", escaped(&goal.goal))?;
    }
    Ok(())
}

fn steps(html: &mut String, report: &Report) -> std::fmt::Result {
    if report.steps.is_empty() {
        return Ok(());
    }
    html.push_str("<h2>Steps</h2>\n<table><tr><th>What to do<th>Done</tr>\n");
    for step in &report.steps {
        let done = step.done_at_s.map_or_else(|| "no".into(), |at| format!("{at:.1} s"));
        writeln!(html, "<tr><td>{}<td class=\"n\">{done}</tr>", escaped(&step.say))?;
    }
    html.push_str("</table>\n");
    Ok(())
}

fn metrics(html: &mut String, report: &Report) -> std::fmt::Result {
    html.push_str("<h2>Every metric</h2>\n<table>\n");
    for metric in &report.metrics {
        writeln!(
            html,
            "<tr><td>{}<br><small>{}</small><td class=\"n\">{}</tr>",
            escaped(metric.title),
            escaped(metric.doc),
            with_unit(metric.id, metric.value)
        )?;
    }
    html.push_str("</table>\n<h2>Settings</h2>\n<table>\n");
    let (case, lattice) = (&report.case, &report.lattice);
    for (name, value) in [
        ("Exercise", report.exercise.name.clone()),
        ("Case", format!("{}: {} ({})", case.name, case.source, case.licence)),
        ("Material", case.material.clone()),
        (
            "Lattice",
            format!(
                "{} nodes, {} springs, {:.1} degrees",
                lattice.nodes, lattice.springs, lattice.angle_deg
            ),
        ),
        ("Time limit", format!("{} s", report.exercise.time_limit_s)),
        ("Version", report.resecta_version.into()),
        ("State at the end", report.state_hash.clone()),
    ] {
        writeln!(html, "<tr><td>{name}<td>{}</tr>", escaped(&value))?;
    }
    html.push_str("</table>\n");
    Ok(())
}

fn medal(medal: Medal) -> &'static str {
    match medal {
        Medal::Bronze => "bronze",
        Medal::Silver => "silver",
        Medal::Gold => "gold",
    }
}

/// A value as it is read: shares in per cent, counts without a unit.
fn with_unit(metric: MetricId, value: f64) -> String {
    let info = metric.info();
    let digits = if value.fract() == 0.0 { 0 } else { 2 };
    match info.unit {
        "1" if metric.is_share() => format!("{:.1} %", 100.0 * value),
        "1" => format!("{value:.digits$}"),
        unit => format!("{value:.digits$} {unit}"),
    }
}

/// Text that HTML takes as text.
pub(crate) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            other => escaped.push(other),
        }
    }
    escaped
}

/// Whether a curve says anything: in a dry scene pressure and view stay what they are.
fn varies(curve: &Curve, log: &RunLog) -> bool {
    let mut values = log.samples.iter().map(curve.value);
    let first = values.next();
    values.any(|value| Some(value) != first)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Drawing = Result<(), Box<dyn std::error::Error>>;

/// A drawing as SVG; where it fails, what plotters says in its place.
fn drawn(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawing) -> String {
    let mut svg = String::new();
    let outcome = {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&area).and_then(|()| Ok(area.present()?))
    };
    match outcome {
        Ok(()) => svg,
        Err(error) => format!("<p>No drawing: {}</p>\n", escaped(&error.to_string())),
    }
}

fn draw_curve(area: &Area, curve: &Curve, log: &RunLog) -> Drawing {
    let points = || log.samples.iter().map(|sample| (sample.time_s, (curve.value)(sample)));
    let (last_s, most) = points().fold((1.0_f64, 0.0_f64), |(last, most), (time, value)| {
        (last.max(time), most.max(value))
    });
    let mut chart = ChartBuilder::on(area)
        .caption(curve.title, ("sans-serif", 15))
        .margin(6)
        .x_label_area_size(28)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..last_s, 0.0..1.05 * most.max(1e-3))?;
    chart
        .configure_mesh()
        .x_labels(10)
        .y_labels(5)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(222, 226, 228))
        .x_label_formatter(&|time| format!("{time:.0} s"))
        .label_style(("sans-serif", 12))
        .draw()?;
    chart.draw_series(LineSeries::new(points(), curve.colour.stroke_width(2)))?;
    // Marks below the axis: where the loop met the capsule.
    let touches = log.samples.iter().filter(|sample| sample.capsule);
    chart.draw_series(touches.map(|sample| Circle::new((sample.time_s, 0.0), 3, RED.filled())))?;
    Ok(())
}

fn draw_map(area: &Area, map: &CutMap) -> Drawing {
    let hours = 12.0 / map.columns.max(1) as f64;
    let height = |row: usize| map.from_mm + row as f64 * map.row_mm;
    let mut chart = ChartBuilder::on(area)
        .margin(6)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..12.0, map.from_mm..height(map.rows))?;
    let cells = (0..map.rows).flat_map(|row| (0..map.columns).map(move |column| (row, column)));
    let drawn = cells.filter_map(|(row, column)| {
        let cell = map.cell(row, column).filter(|cell| cell.whole_mm3 > 0.0)?;
        let gone = (cell.removed_mm3 / cell.whole_mm3).clamp(0.0, 1.0);
        let colour = match cell.capsule_mm {
            Some(0.0) => RGBColor(200, 30, 40).to_rgba(),
            _ => HSLColor(0.58, 0.5, 0.93 - 0.63 * gone).to_rgba(),
        };
        // Hours fall from left to right, as through the lens.
        let (left, low) = (12.0 - (column + 1) as f64 * hours, height(row));
        Some(Rectangle::new(
            [(left, low), (left + hours, low + map.row_mm)],
            colour.filled(),
        ))
    });
    chart.draw_series(drawn)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_labels(13)
        .x_desc("hour")
        .y_desc("height, mm")
        .x_label_formatter(&|across| format!("{:.0}", 12.0 - across))
        .label_style(("sans-serif", 12))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Trial;

    fn of(trial: &Trial) -> String {
        let picture = KeyPicture {
            words: "First <cut>".into(),
            time_s: 2.0,
            png: b"picture".to_vec(),
        };
        page_of(trial.app.world(), &trial.report(), &[picture]).unwrap()
    }

    #[test]
    fn it_holds_all_that_it_shows_and_is_the_same_for_the_same_run() {
        let played = || {
            let mut trial = Trial::new(());
            trial.app.init_resource::<RunLog>();
            let mut loaded = trial.library().unwrap().load("middle_lobe").unwrap();
            loaded.exercise.alpha_deg = 20.0;
            loaded.exercise.title = "Lobe <b> & \"more\"".into();
            trial.start(loaded).unwrap();
            trial.steps_by(90, |step, instrument| {
                instrument.insertion_mm = 34.0;
                instrument.stroke_mm = 24.0 - 0.2 * step as f32;
                instrument.pitch_deg = -9.0;
                instrument.cut = step > 20;
            });
            of(&trial)
        };
        let html = played();
        assert!(html.contains("Lobe &lt;b&gt; &amp; &quot;more&quot;"));
        assert!(!html.contains("<b>") && !html.contains("No drawing"));
        // Tissue went and water ran: curves and the map.
        assert!(html.matches("<svg").count() >= 3, "{}", html.matches("<svg").count());
        // Nothing is fetched from anywhere.
        assert_eq!(html.matches("src=").count(), html.matches("src=\"data:").count());
        assert!(!html.contains("href="));
        let picture = "<figure><img alt=\"First &lt;cut&gt;\" src=\"data:image/png;base64,cGljdHVyZQ==\">";
        assert!(html.contains(picture));
        for metric in MetricId::ALL {
            assert!(html.contains(&escaped(metric.info().title)), "{metric}");
        }
        assert_eq!(html, played());
    }
}
