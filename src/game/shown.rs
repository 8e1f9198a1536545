//! What the hands do that show an exercise: each movement with the key that makes it, so that whoever watches can do it, too.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, RichText},
};
use resecta_instrument::{
    BoundInput, InstrumentAction, InstrumentBindings, InstrumentField, InstrumentState, InstrumentSystems, Resectoscope,
};
use resecta_scenario::ActiveExercise;

use super::{
    flow::GameFlow,
    menu::{self, MenuSystems, UiZoom},
    palette,
};
use crate::view::EndoscopeCamera;

/// Slower movements are no movements: hands correct their aim by little all the time. mm/s, degrees/s, shares/s.
const LEAST_PER_S: f32 = 2.0;
const LEAST_TAP_PER_S: f32 = 0.1;
/// What was done stays to be read for so long, s of the demonstration.
const READ_S: f32 = 0.35;
/// No more than this is shown at once: what was done last, then the fastest.
const MOST: usize = 3;
/// Where it stands: below the upper edge of the endoscope's view, points.
const BELOW: f32 = 34.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Doing>()
        .add_systems(FixedUpdate, notice.in_set(InstrumentSystems::Last))
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

/// What was done of late.
#[derive(Resource, Debug, Default)]
struct Doing {
    before: Option<InstrumentState>,
    /// Actions, and for how long each is still shown, s; in the order of [`InstrumentAction::ALL`].
    shown: Vec<(InstrumentAction, f32)>,
}

/// What leads from one state to the next.
fn actions(before: &InstrumentState, now: &InstrumentState, step_s: f32) -> impl Iterator<Item = InstrumentAction> {
    InstrumentAction::ALL.into_iter().filter(move |action| match action {
        InstrumentAction::Cut => now.cut,
        InstrumentAction::Coagulate => now.coagulate && !now.cut,
        _ => action.movement().is_some_and(|(field, sign)| {
            let least = if InstrumentField::TAPS.contains(&field) {
                LEAST_TAP_PER_S
            } else {
                LEAST_PER_S
            };
            sign * (now.get(field) - before.get(field)) > least * step_s
        }),
    })
}

/// Whether two actions move the same the other way.
fn are_opposite(one: InstrumentAction, other: InstrumentAction) -> bool {
    let field = |action: InstrumentAction| action.movement().map(|(field, _)| field);
    one != other && field(one).is_some() && field(one) == field(other)
}

fn notice(
    flow: Res<GameFlow>,
    time: Res<Time>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    mut doing: ResMut<Doing>,
) {
    let held = active.and_then(|active| instruments.get(active.instrument).ok());
    let Some((&now, Resectoscope { limits, .. })) = held.filter(|_| flow.watches) else {
        *doing = Doing::default();
        return;
    };
    let step_s = time.delta_secs();
    let before = doing.before.replace(now).unwrap_or(now);
    let done: Vec<_> = actions(&before, &now, step_s).collect();
    let left_s = |action: InstrumentAction| {
        let shown = doing.shown.iter().find(|(shown, _)| *shown == action);
        match done.contains(&action) {
            true => READ_S,
            false => shown.map_or(0.0, |(_, left_s)| left_s - step_s),
        }
    };
    let shown = InstrumentAction::ALL.into_iter().map(|action| (action, left_s(action)));
    let mut shown: Vec<_> = shown.filter(|(_, left_s)| *left_s > 0.0).collect();
    // Turned the other way: the way before is over.
    shown.retain(|(action, left_s)| *left_s >= READ_S || !done.iter().any(|other| are_opposite(*action, *other)));
    let speed = |action: InstrumentAction| match action.movement() {
        Some((field, _)) => (now.get(field) - before.get(field)).abs() / limits.of(field).max_speed,
        // A pedal is what it is about.
        None => f32::INFINITY,
    };
    shown.sort_by(|a, b| b.1.total_cmp(&a.1).then(speed(b.0).total_cmp(&speed(a.0))));
    shown.truncate(MOST);
    shown.sort_by_key(|(action, _)| *action);
    doing.shown = shown;
}

fn show(
    mut contexts: EguiContexts,
    flow: Res<GameFlow>,
    doing: Res<Doing>,
    bindings: Res<InstrumentBindings>,
    zoom: Res<UiZoom>,
    endoscopes: Query<&Camera, With<EndoscopeCamera>>,
) -> Result {
    if !(flow.watches && flow.is_live()) || doing.shown.is_empty() {
        return Ok(());
    }
    let mut cameras = endoscopes.iter().filter(|camera| camera.is_active);
    let Some(view) = cameras.find_map(Camera::logical_viewport_rect) else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    // Cameras reckon in the window's logical pixels.
    let place = egui::pos2(view.center().x / zoom.0, view.min.y / zoom.0 + BELOW);
    // Hands change what they do faster than an area fades in.
    let area = egui::Area::new(egui::Id::new("shown"))
        .interactable(false)
        .fade_in(false);
    area.pivot(Align2::CENTER_TOP).fixed_pos(place).show(context, |ui| {
        let frame = egui::Frame::new()
            .fill(palette::GROUND.gamma_multiply(0.8))
            .corner_radius(8);
        frame.inner_margin(6.0).show(ui, |ui| {
            ui.horizontal(|ui| {
                for (action, _) in &doing.shown {
                    let row = bindings.rows.iter().find(|row| row.action == *action);
                    let mut inputs = row.into_iter().flat_map(|row| &row.inputs);
                    if let Some(input) = inputs.find(|input| !input.is_pad()) {
                        menu::key_cap(ui, &BoundInput::to_string(input));
                    }
                    ui.label(RichText::new(action.label()).size(13.0).color(palette::TEXT));
                }
            });
        });
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn movements_and_pedals_are_told_and_what_hardly_moves_is_not() {
        let before = InstrumentState {
            stroke_mm: 20.0,
            inflow_tap: 1.0,
            ..default()
        };
        let told = |now: InstrumentState| actions(&before, &now, 0.1).collect::<Vec<_>>();
        assert_eq!(told(before), []);
        let stroke = InstrumentState {
            stroke_mm: 18.0,
            cut: true,
            ..before
        };
        assert_eq!(told(stroke).len(), 2);
        assert!(told(stroke).contains(&InstrumentAction::Cut) && told(stroke).contains(&InstrumentAction::LoopIn));
        // Cutting goes before.
        let both = InstrumentState {
            cut: true,
            coagulate: true,
            ..before
        };
        assert_eq!(told(both), [InstrumentAction::Cut]);
        let trembles = InstrumentState {
            pitch_deg: 0.1,
            stroke_mm: 20.1,
            ..before
        };
        assert_eq!(told(trembles), []);
        assert!(are_opposite(InstrumentAction::TipUp, InstrumentAction::TipDown));
        assert!(!are_opposite(InstrumentAction::TipUp, InstrumentAction::TipLeft));
        assert!(!are_opposite(InstrumentAction::Cut, InstrumentAction::Coagulate));
        let closes = InstrumentState {
            inflow_tap: 0.9,
            ..before
        };
        assert_eq!(told(closes), [InstrumentAction::InflowClose]);
    }
}
