//! What every screen is made of: size by the window's height, buttons that the keyboard reaches, frames.

use bevy::{asset::AssetEventSystems, prelude::*, window::PrimaryWindow};
use bevy_egui::{
    EguiContexts, EguiPostUpdateSet, EguiPrimaryContextPass,
    egui::{self, Align2, Color32, Context, CornerRadius, FontId, RichText, Stroke, Ui},
};
use egui_plot::Plot;

use super::{
    flow::{GameFlow, Phase, Wish},
    palette,
    settings::SettingsPage,
};

/// The window that screens are laid out for, points; larger ones show the same larger.
const LAID_OUT_FOR: [f32; 2] = [1280.0, 720.0];

/// For so long after a run that ended by itself keys press nothing, s: those that moved the instrument are still held. Where one
/// stays down, not for longer than this.
const HANDS_OFF_S: [f32; 2] = [0.7, 3.0];

pub fn plugin(app: &mut App) {
    app.init_resource::<UiZoom>()
        .init_resource::<MenuFocus>()
        .init_resource::<SettingsPage>()
        .add_systems(First, follow_window)
        .add_systems(EguiPrimaryContextPass, prepare.in_set(MenuSystems::Prepare))
        .configure_sets(
            EguiPrimaryContextPass,
            (MenuSystems::Prepare, MenuSystems::Show).chain(),
        )
        // Names over the views lie where these are drawn in the same frame, and the renderer hears of a letter that is new to egui's
        // texture in the frame that first shows it. Nobody else orders the two: either came a frame late.
        .configure_sets(
            PostUpdate,
            (
                EguiPostUpdateSet::EndPass.after(TransformSystems::Propagate),
                EguiPostUpdateSet::PostProcessOutput.before(AssetEventSystems),
            ),
        );
}

/// The order in which screens are made.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MenuSystems {
    /// Style and focus.
    Prepare,
    /// The screens.
    Show,
}

/// Logical pixels of the window to a point of the screens.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct UiZoom(pub f32);

impl Default for UiZoom {
    fn default() -> Self {
        Self(1.0)
    }
}

/// Which screen the keyboard was last led into.
#[derive(Resource, Debug, Default)]
pub struct MenuFocus {
    screen: Option<Screen>,
    /// Whether the first button is to have the focus in this frame.
    pub lead: bool,
    /// How long ago a run ended whose keys may still be held, s.
    hands_off_s: Option<f32>,
}

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Screen {
    phase: Phase,
    help: bool,
    settings: bool,
    asks: bool,
}

fn follow_window(windows: Query<&Window, With<PrimaryWindow>>, mut zoom: ResMut<UiZoom>) {
    let Ok(window) = windows.single() else { return };
    let fits = zoom_for(window.width(), window.height());
    if zoom.0 != fits {
        zoom.0 = fits;
    }
}

/// As large as fits, but still readable in a small window.
fn zoom_for(width: f32, height: f32) -> f32 {
    let fits = (width / LAID_OUT_FOR[0]).min(height / LAID_OUT_FOR[1]);
    // In steps, so that a window that is dragged does not make all letters anew in every frame.
    ((fits * 20.0).floor() / 20.0).clamp(0.75, 4.0)
}

fn prepare(
    mut contexts: EguiContexts,
    zoom: Res<UiZoom>,
    (flow, settings): (Res<GameFlow>, Res<SettingsPage>),
    time: Res<Time<Real>>,
    mut focus: ResMut<MenuFocus>,
    mut styled: Local<bool>,
) -> Result {
    let context = contexts.ctx_mut()?;
    if context.zoom_factor() != zoom.0 {
        context.set_zoom_factor(zoom.0);
    }
    if !*styled {
        style(context);
        *styled = true;
    }
    let screen = Some(Screen {
        phase: flow.phase,
        help: flow.help,
        settings: settings.open,
        asks: flow.doubt.is_some(),
    });
    let was = focus.screen.map(|screen| screen.phase);
    if (was, flow.phase) == (Some(Phase::Playing), Phase::Result) {
        focus.hands_off_s = Some(0.0);
    }
    focus.hands_off_s = focus.hands_off_s.filter(|_| flow.phase == Phase::Result);
    if let Some(since_s) = focus.hands_off_s {
        context.input_mut(|input| {
            input.events.retain(|event| !matches!(event, egui::Event::Key { .. }));
            let [least, most] = HANDS_OFF_S;
            let is_over = since_s >= most || since_s >= least && input.keys_down.is_empty();
            focus.hands_off_s = (!is_over).then_some(since_s + time.delta_secs());
        });
    }
    let focused = context.memory(|memory| memory.focused());
    if flow.is_live() {
        // Space, arrows and Enter are the instrument's.
        if let Some(id) = focused {
            context.memory_mut(|memory| memory.surrender_focus(id));
        }
    }
    // A click takes the focus from where it was: `Enter` is to do after it what it did before.
    let is_asked_for = focused.is_none()
        && context.input(|input| {
            use egui::Key::{ArrowDown, ArrowLeft, ArrowRight, ArrowUp, Enter};
            let keys = [ArrowDown, ArrowLeft, ArrowRight, ArrowUp, Enter];
            keys.into_iter().any(|key| input.key_pressed(key)) || input.pointer.any_released()
        });
    focus.lead = focus.screen != screen || is_asked_for || focus.hands_off_s.is_some();
    focus.screen = screen;
    Ok(())
}

fn style(context: &Context) {
    context.set_theme(egui::Theme::Dark);
    context.all_styles_mut(|style| {
        use egui::TextStyle::{Body, Button, Heading, Monospace, Small};
        for (text, size) in [
            (Small, 12.0),
            (Body, 14.5),
            (Button, 15.5),
            (Heading, 24.0),
            (Monospace, 13.5),
        ] {
            style.text_styles.insert(text, FontId::proportional(size));
        }
        style.spacing.button_padding = egui::vec2(14.0, 7.0);
        style.spacing.item_spacing = egui::vec2(8.0, 7.0);
        let visuals = &mut style.visuals;
        visuals.panel_fill = palette::GROUND;
        visuals.window_fill = palette::GROUND;
        visuals.window_stroke = Stroke::new(1.0, palette::LINE);
        visuals.window_corner_radius = CornerRadius::same(10);
        visuals.extreme_bg_color = Color32::from_rgb(9, 11, 14);
        visuals.faint_bg_color = palette::CARD;
        visuals.selection.bg_fill = palette::MARK;
        let widgets = &mut visuals.widgets;
        widgets.noninteractive.fg_stroke.color = palette::TEXT;
        widgets.noninteractive.bg_stroke.color = palette::LINE;
        for (widget, fill, frame) in [
            (&mut widgets.inactive, palette::BUTTON, Stroke::new(1.0, palette::LINE)),
            (
                &mut widgets.hovered,
                palette::BUTTON_HOVERED,
                Stroke::new(1.0, palette::WEAK),
            ),
            (
                &mut widgets.active,
                palette::BUTTON_HOVERED,
                Stroke::new(2.5, palette::FOCUS),
            ),
        ] {
            widget.weak_bg_fill = fill;
            widget.bg_fill = fill;
            widget.bg_stroke = frame;
            widget.fg_stroke.color = palette::TEXT;
            widget.corner_radius = CornerRadius::same(6);
            widget.expansion = 0.0;
        }
    });
}

/// A button. `lead` gives it the keyboard's focus.
pub fn button(ui: &mut Ui, text: impl Into<String>, lead: bool) -> egui::Response {
    sized_button(ui, text, [0.0, 34.0], lead)
}

/// A button of at least this size, points.
pub fn sized_button(ui: &mut Ui, text: impl Into<String>, size: [f32; 2], lead: bool) -> egui::Response {
    let button = egui::Button::new(RichText::new(text.into())).min_size(size.into());
    let response = ui.add(button);
    if lead {
        response.request_focus();
    }
    response
}

/// A box to check: square, where what is to be chosen from is round.
pub fn check_box(ui: &mut Ui, is_on: &mut bool, words: &str) {
    ui.scope(|ui| {
        let widgets = &mut ui.visuals_mut().widgets;
        for widget in [&mut widgets.inactive, &mut widgets.hovered, &mut widgets.active] {
            widget.corner_radius = CornerRadius::same(2);
        }
        ui.checkbox(is_on, words);
    });
}

/// A button that asks for something.
pub fn wish(ui: &mut Ui, text: &str, wish: Wish, lead: bool, flow: &mut GameFlow) {
    if button(ui, text, lead).clicked() {
        flow.wish(wish);
    }
}

/// The whole window as one screen, with this ground.
pub fn full_screen(context: &Context, name: &str, ground: Color32, contents: impl FnOnce(&mut Ui)) {
    let area = context.viewport_rect();
    let builder = egui::UiBuilder::new()
        .layer_id(egui::LayerId::background())
        .max_rect(area.shrink2(egui::vec2(40.0, 28.0)));
    let mut ui = Ui::new(context.clone(), egui::Id::new(name), builder);
    ui.set_clip_rect(area);
    ui.painter().rect_filled(area, 0.0, ground);
    contents(&mut ui);
}

/// A window in the middle of the screen, moved to the left by half of `beside`, points.
pub fn window(context: &Context, title: &str, width: f32, beside: f32, contents: impl FnOnce(&mut Ui)) {
    let area = context.viewport_rect();
    let width = width.min(area.width() - beside - 60.0).max(160.0);
    let highest = area.height() - 110.0;
    egui::Window::new(title)
        .id(egui::Id::new(title))
        .anchor(Align2::CENTER_CENTER, [-beside / 2.0, 0.0])
        .fixed_size([width, 0.0])
        .frame(
            egui::Frame::window(&context.global_style())
                .inner_margin(20)
                .fill(palette::GROUND),
        )
        .title_bar(false)
        .collapsible(false)
        .resizable(false)
        .show(context, |ui| {
            ui.label(RichText::new(title).size(24.0).strong());
            ui.add_space(4.0);
            egui::ScrollArea::vertical()
                .max_height(highest)
                .min_scrolled_height(highest)
                .show(ui, contents)
        });
}

/// A part of a screen of this size, points, filled from the top down.
pub fn part<R>(ui: &mut Ui, size: [f32; 2], contents: impl FnOnce(&mut Ui) -> R) -> R {
    let layout = egui::Layout::top_down(egui::Align::Min);
    ui.allocate_ui_with_layout(size.into(), layout, |ui| {
        ui.set_width(size[0]);
        contents(ui)
    })
    .inner
}

/// A framed part of a screen.
pub fn card<R>(ui: &mut Ui, contents: impl FnOnce(&mut Ui) -> R) -> R {
    egui::Frame::new()
        .fill(palette::CARD)
        .corner_radius(8)
        .inner_margin(14)
        .show(ui, contents)
        .inner
}

/// A number on an axis, with as many decimals as its step has: egui's own rounds a step of 0.5 to whole numbers.
fn axis_number(value: f64, step: f64) -> String {
    // Steps are 1, 2 or 5 of some power of ten; a little less than none for what roundings leave.
    let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

/// A plot to be read, not to be moved: `id` is its own among those of the page.
pub fn plot(id: &str, height: f32) -> Plot<'_> {
    Plot::new(id)
        .height(height)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
        .y_axis_formatter(|mark, _| axis_number(mark.value, mark.step_size))
        // Nothing in it is pressed: the focus passes over it.
        .sense(egui::Sense::hover())
}

/// A caption above a part of a screen.
pub fn caption(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).size(13.0).strong().color(palette::ACCENT));
}

/// Space beside the letters of a key cap, points.
pub const KEY_MARGIN: f32 = 7.0;

/// A key's name as on a key cap, whole: where it has no room left it begins a row.
pub fn key_cap(ui: &mut Ui, name: &str) {
    let padding = std::mem::replace(&mut ui.spacing_mut().button_padding, egui::vec2(KEY_MARGIN, 2.0));
    let cap = egui::Button::new(RichText::new(name).color(palette::TEXT).strong())
        .fill(palette::BUTTON)
        .stroke(Stroke::new(1.0, palette::WEAK))
        .corner_radius(4)
        .wrap_mode(egui::TextWrapMode::Extend)
        .sense(egui::Sense::hover());
    ui.add(cap);
    ui.spacing_mut().button_padding = padding;
}

#[cfg(test)]
mod tests {
    use bevy::{
        asset::{AssetEvent, AssetId},
        time::TimeUpdateStrategy,
    };
    use bevy_egui::{EguiManagedTextures, EguiPlugin, PrimaryEguiContext, input::EguiInputEvent};

    use super::*;
    use crate::game::without_display;

    /// An app that shows words.
    fn app() -> App {
        let mut app = App::new();
        app.add_plugins((without_display(), EguiPlugin::default(), plugin))
            .init_resource::<GameFlow>()
            .world_mut()
            .spawn((PrimaryEguiContext, Camera2d));
        app.finish();
        app.cleanup();
        app
    }

    #[derive(Resource)]
    struct Words(&'static str);

    #[derive(Resource, Default)]
    struct Told(Vec<AssetId<Image>>);

    #[test]
    fn the_renderer_hears_of_a_new_letter_in_the_frame_that_shows_it() {
        let mut app = app();
        let write = |mut contexts: EguiContexts, words: Res<Words>| -> Result {
            let painter = contexts.ctx_mut()?.layer_painter(egui::LayerId::background());
            let font = FontId::proportional(20.0);
            painter.text(egui::Pos2::ZERO, Align2::LEFT_TOP, words.0, font, Color32::WHITE);
            Ok(())
        };
        let hear = |mut events: MessageReader<AssetEvent<Image>>, mut told: ResMut<Told>| {
            let changed = events.read().filter_map(|event| match event {
                AssetEvent::Added { id } | AssetEvent::Modified { id } => Some(*id),
                _ => None,
            });
            told.0 = changed.collect();
        };
        app.insert_resource(Words("a"))
            .init_resource::<Told>()
            .add_systems(EguiPrimaryContextPass, write.in_set(MenuSystems::Show))
            .add_systems(Last, hear);
        let letters = |app: &App| -> Vec<AssetId<Image>> {
            let textures = app.world().resource::<EguiManagedTextures>();
            textures.0.values().map(|texture| texture.handle.id()).collect()
        };
        for (words, is_new) in [("a", true), ("a", false), ("a", false), ("a7", true), ("a7", false)] {
            app.insert_resource(Words(words));
            app.update();
            let told = &app.world().resource::<Told>().0;
            let is_told = letters(&app).iter().any(|letters| told.contains(letters));
            assert_eq!(is_told, is_new, "{words}");
        }
    }

    #[test]
    fn screens_know_where_things_are_drawn_in_the_same_frame() {
        #[derive(Resource, Default)]
        struct Seen(Vec<[f32; 2]>);
        let mut app = app();
        let thing = app.world_mut().spawn(Transform::default()).id();
        let go = move |mut things: Query<&mut Transform>| -> Result {
            things.get_mut(thing)?.translation.x += 1.0;
            Ok(())
        };
        let look = move |things: Query<(&Transform, &GlobalTransform)>, mut seen: ResMut<Seen>| -> Result {
            let (place, drawn) = things.get(thing)?;
            seen.0.push([place.translation.x, drawn.translation().x]);
            Ok(())
        };
        app.init_resource::<Seen>()
            .add_systems(Update, go)
            .add_systems(EguiPrimaryContextPass, look.in_set(MenuSystems::Show));
        (0..3).for_each(|_| app.update());
        assert_eq!(app.world().resource::<Seen>().0, [[1.0; 2], [2.0; 2], [3.0; 2]]);
    }

    #[test]
    fn keys_that_are_held_when_a_run_ends_by_itself_press_nothing() {
        #[derive(Resource, Default)]
        struct Clicks(u32);
        let mut app = app();
        let step = std::time::Duration::from_millis(100);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(step))
            .init_resource::<Clicks>();
        let shown = |mut contexts: EguiContexts, focus: Res<MenuFocus>, mut clicks: ResMut<Clicks>| -> Result {
            full_screen(contexts.ctx_mut()?, "result", palette::GROUND, |ui| {
                clicks.0 += u32::from(button(ui, "Again", focus.lead).clicked());
            });
            Ok(())
        };
        app.add_systems(EguiPrimaryContextPass, shown.in_set(MenuSystems::Show));
        let context = (app.world_mut().query_filtered::<Entity, With<PrimaryEguiContext>>())
            .single(app.world())
            .unwrap();
        // Holds a key down, or lets it go, for some frames; the clicks that came of it.
        let hold = |app: &mut App, pressed: bool, frames: u32| {
            let before = app.world().resource::<Clicks>().0;
            for _ in 0..frames {
                let event = egui::Event::Key {
                    key: egui::Key::Space,
                    physical_key: None,
                    pressed,
                    repeat: false,
                    modifiers: egui::Modifiers::NONE,
                };
                app.world_mut().write_message(EguiInputEvent { context, event });
                app.update();
            }
            app.world().resource::<Clicks>().0 - before
        };
        let go = |app: &mut App, phase| app.world_mut().resource_mut::<GameFlow>().phase = phase;

        go(&mut app, Phase::Playing);
        hold(&mut app, true, 3);
        go(&mut app, Phase::Result);
        assert_eq!(hold(&mut app, true, 15), 0, "held");
        assert_eq!(hold(&mut app, false, 2), 0);
        assert!(hold(&mut app, true, 1) > 0, "pressed anew");
        // Whoever comes back to the debriefing presses at once.
        go(&mut app, Phase::Progress);
        hold(&mut app, false, 2);
        go(&mut app, Phase::Result);
        hold(&mut app, false, 2);
        assert!(hold(&mut app, true, 1) > 0);
        // Nobody is locked out by a key that never comes up.
        go(&mut app, Phase::Playing);
        hold(&mut app, true, 2);
        go(&mut app, Phase::Result);
        assert!(hold(&mut app, true, 40) > 0);
    }

    #[test]
    fn screens_are_laid_out_for_one_size_and_fit_every_other() {
        assert_eq!(zoom_for(1280.0, 720.0), 1.0);
        assert_eq!(zoom_for(2560.0, 1440.0), 2.0);
        for width in (900..4000).step_by(173) {
            for height in (560..2400).step_by(91) {
                let (width, height) = (width as f32, height as f32);
                let zoom = zoom_for(width, height);
                let fits = zoom * 1280.0 <= width && zoom * 720.0 <= height;
                assert!(fits || zoom == 0.75, "{width} {height} {zoom}");
            }
        }
    }

    #[test]
    fn numbers_of_an_axis_have_the_decimals_of_its_steps() {
        let numbers = |step: f64| [0, 1, 2, 3].map(|number| axis_number(f64::from(number) * step, step));
        assert_eq!(numbers(0.5), ["0.0", "0.5", "1.0", "1.5"]);
        assert_eq!(numbers(0.05), ["0.00", "0.05", "0.10", "0.15"]);
        assert_eq!(numbers(0.1), ["0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(numbers(1.0), ["0", "1", "2", "3"]);
        assert_eq!(numbers(500.0), ["0", "500", "1000", "1500"]);
    }
}
