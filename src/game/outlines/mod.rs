//! Outlines on ultrasound images: found by the model, mended slice by slice, saved as a case and played.
//!
//! | to find | look in |
//! |---|---|
//! | what takes longer than a frame | `work.rs` |
//! | the image and dragging on it | `image.rs` |
//! | the gland beside it | `gland.rs` |
//! | buttons, modes, saving | `tools.rs` |
//!
//! What the steps do to outlines is `resecta_annotate`'s (`Outlines`); here is only what is seen and pressed.

mod gland;
mod image;
mod tools;
mod work;

use std::{path::PathBuf, sync::Arc};

use bevy::{
    prelude::*,
    window::{FileDragAndDrop, WindowCloseRequested},
};
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, RichText, Ui},
};
use resecta_anatomy::CaseSource;
use resecta_annotate::{Model, Outlines, Stack};
use resecta_scenario::Metrics;

use self::{
    gland::Turn,
    image::Shown,
    work::{Finished, Opened, Work},
};
use super::{
    flow::{GameFlow, Phase, Wish},
    menu::{self, MenuFocus, MenuSystems},
    palette,
};

pub use self::work::{ImageFiles, Images};

/// Side of the image, points.
const IMAGE: [f32; 2] = [640.0, 560.0];
/// Height of the gland's picture, points.
const GLAND_HEIGHT: f32 = 250.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Editor>()
        .add_systems(Update, (take_dropped, finish_work, close))
        .add_systems(EguiPrimaryContextPass, show.in_set(MenuSystems::Show));
}

/// The images that are open, and what is being done with them.
#[derive(Resource, Default)]
pub struct Editor {
    open: Option<Open>,
    work: Option<Work>,
    /// A path that is being written.
    path: String,
    told: Option<Told>,
}

/// A stack with its outlines.
struct Open {
    stack: Arc<Stack>,
    model: Arc<Model>,
    outlines: Outlines,
    /// The image that is shown.
    image: usize,
    shown: Shown,
    turn: Turn,
    /// Whether the modes that are nudged are those of the whole gland, not of the image's section.
    shapes_gland: bool,
    /// Name of the case.
    name: String,
    /// Where the case goes.
    file: String,
    /// What the case says of where it comes from.
    source: CaseSource,
    /// Whether something changed since it was saved.
    is_unsaved: bool,
    /// Whether leaving without saving was asked for once.
    is_leaving: bool,
}

impl Open {
    /// Whether somebody's work would be lost.
    fn is_mended(&self) -> bool {
        self.is_unsaved && self.outlines.changes() > 0
    }
}

/// Something to be told, and whether it is bad.
struct Told {
    words: String,
    is_bad: bool,
}

impl Editor {
    /// Opens images in place of those that are open.
    pub fn begin(&mut self, images: Images) {
        self.told = None;
        self.work = Some(Work::open(images));
    }

    /// Whether images are open or being opened.
    pub fn has_begun(&self) -> bool {
        self.open.is_some() || self.work.is_some()
    }

    /// Whether images are open and nothing is being done.
    pub fn is_ready(&self) -> bool {
        self.open.is_some() && self.work.is_none()
    }

    /// Whether nobody's work would be lost with the game: at the second time of asking, it may be.
    fn may_close(&mut self) -> bool {
        let Some(open) = self.open.as_mut().filter(|open| open.is_mended() && !open.is_leaving) else {
            return true;
        };
        open.is_leaving = true;
        let words = "These outlines are not saved. Close the window again to leave without them.";
        self.tell(words, true);
        false
    }

    fn tell(&mut self, words: impl Into<String>, is_bad: bool) {
        self.told = Some(Told {
            words: words.into(),
            is_bad,
        });
    }

    fn take(&mut self, opened: Opened) {
        let Opened {
            stack,
            model,
            outlines,
            name,
            file,
            source,
            note,
        } = opened;
        let count = outlines.outlined().count();
        let middle = outlines.outlined().nth(count / 2).map(|(image, _)| image);
        let image = middle.unwrap_or(stack.slices().len() / 2);
        self.told = note.map(|words| Told { words, is_bad: true });
        self.open = Some(Open {
            stack,
            model,
            outlines,
            image,
            shown: Shown::default(),
            turn: Turn::default(),
            shapes_gland: false,
            name,
            file,
            source,
            is_unsaved: true,
            is_leaving: false,
        });
    }
}

/// A folder or file that is dropped on the window is opened.
fn take_dropped(mut dropped: MessageReader<FileDragAndDrop>, flow: Res<GameFlow>, mut editor: ResMut<Editor>) {
    for event in dropped.read() {
        if let FileDragAndDrop::DroppedFile { path_buf, .. } = event
            && flow.phase == Phase::Outlines
            && editor.work.is_none()
        {
            match editor.open.as_ref().is_some_and(Open::is_mended) {
                true => editor.tell(
                    "Other images would put these away: save them, or close them first",
                    true,
                ),
                false => editor.begin(of_path(path_buf.clone())),
            }
        }
    }
}

fn of_path(path: PathBuf) -> Images {
    Images::Files(Box::new(ImageFiles {
        path,
        ..ImageFiles::default()
    }))
}

fn finish_work(mut editor: ResMut<Editor>) {
    let Some(finished) = editor.work.as_mut().and_then(Work::poll) else {
        return;
    };
    editor.work = None;
    match finished {
        Finished::Opened(Ok(opened)) => editor.take(*opened),
        Finished::Opened(Err(error)) | Finished::Searched { found: Err(error), .. } => editor.tell(error, true),
        Finished::Searched {
            image,
            found: Ok(outline),
        } => {
            if let Some(open) = &mut editor.open {
                open.outlines.set(image, Some(outline), false);
                open.is_unsaved = true;
            }
        }
    }
}

fn show(
    mut contexts: EguiContexts,
    focus: Res<MenuFocus>,
    mut editor: ResMut<Editor>,
    mut flow: ResMut<GameFlow>,
) -> Result {
    if flow.help || flow.phase != Phase::Outlines {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    let mut is_writing = false;
    menu::full_screen(context, "outlines", palette::GROUND, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Outlines").size(30.0).strong());
            if let Some(open) = &editor.open {
                ui.label(RichText::new(&open.name).size(30.0).color(palette::ACCENT));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                leave(ui, &mut editor, &mut flow);
            });
        });
        ui.add_space(8.0);
        let editor = editor.as_mut();
        if editor.work.is_none() && editor.open.is_none() {
            is_writing = door(ui, editor, focus.lead);
        } else if let Some(open) = &mut editor.open {
            is_writing = tools::show_all(ui, open, &mut editor.work, &mut editor.told, &mut flow);
        }
        if let Some(work) = &editor.work {
            let (words, share) = work.told();
            waiting(ui, words, share);
        }
    });
    flow.is_writing = is_writing;
    Ok(())
}

/// Closes the game when that is asked for, but asks first about a run in play, and shows outlines first that are not saved.
fn close(
    mut asked: MessageReader<WindowCloseRequested>,
    metrics: Option<Res<Metrics>>,
    mut editor: ResMut<Editor>,
    mut flow: ResMut<GameFlow>,
    mut exit: MessageWriter<AppExit>,
) {
    if asked.read().count() == 0 {
        return;
    }
    let is_run_lost = metrics.is_some_and(|metrics| flow.would_lose(&metrics));
    // Asked again, or by the button below that question.
    let is_sure = flow.doubt == Some(Wish::Quit);
    if is_run_lost && !is_sure {
        flow.wish(Wish::Pause);
        flow.wish(Wish::Quit);
    } else if editor.may_close() {
        exit.write(AppExit::Success);
    } else {
        flow.wish(Wish::Outlines);
    }
}

/// The way out: outlines that are not saved are lost at the second time of asking only.
fn leave(ui: &mut Ui, editor: &mut Editor, flow: &mut GameFlow) {
    menu::wish(ui, "Title (Esc)", Wish::Title, false, flow);
    let Some(open) = &mut editor.open else { return };
    let words = match open.is_leaving {
        true => "Not saved: press again to close",
        false => "Other images",
    };
    if editor.work.is_none() && menu::button(ui, words, false).clicked() {
        if open.is_mended() && !open.is_leaving {
            open.is_leaving = true;
        } else {
            editor.open = None;
            editor.told = None;
        }
    }
}

/// Where no images are open: how to open some. Whether somebody writes.
fn door(ui: &mut Ui, editor: &mut Editor, lead: bool) -> bool {
    let words = "From transrectal ultrasound to a gland to operate on. A model of the prostate finds its outline in every image; \
                 what it is unsure of is marked, and you mend it here. The urethra, which ultrasound hardly shows, is put in by rule.";
    ui.set_max_width(760.0);
    ui.label(RichText::new(words).size(17.0).color(palette::WEAK));
    ui.add_space(18.0);
    menu::caption(ui, "Images of your own");
    let mut is_writing = false;
    let mut is_asked = false;
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut editor.path)
            .hint_text("a folder of pictures, a .nii.gz volume or a DICOM file")
            .desired_width(560.0);
        let field = ui.add(field);
        is_writing = field.has_focus();
        is_asked = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        is_asked |= menu::button(ui, "Open", false).clicked();
    });
    let words = "Or drop them on this window. What the files do not tell (distance of pixels and images, axes) goes into a file \
                 stack.ron beside them; what is missing is told by name.";
    ui.label(RichText::new(words).size(13.5).color(palette::WEAK));
    ui.add_space(18.0);
    menu::caption(ui, "No images at hand");
    if menu::button(ui, "Synthetic ultrasound of a shipped gland", lead).clicked() {
        editor.begin(Images::Example);
    }
    if is_asked && !editor.path.trim().is_empty() {
        editor.begin(of_path(editor.path.trim().into()));
    }
    if let Some(told) = &editor.told {
        ui.add_space(18.0);
        tell(ui, told);
    }
    is_writing
}

fn tell(ui: &mut Ui, told: &Told) {
    let colour = if told.is_bad { palette::CAREFUL } else { palette::GOOD };
    ui.label(RichText::new(&told.words).size(14.0).color(colour));
}

fn waiting(ui: &Ui, words: &str, share: Option<f32>) {
    let area = egui::Rect::from_center_size(ui.ctx().viewport_rect().center(), egui::vec2(420.0, 84.0));
    let painter = ui.painter();
    painter.rect_filled(area, 10.0, palette::CARD);
    let text = egui::FontId::proportional(17.0);
    painter.text(
        area.center_top() + egui::vec2(0.0, 30.0),
        egui::Align2::CENTER_CENTER,
        words,
        text,
        palette::TEXT,
    );
    let bar = egui::Rect::from_min_max(
        area.left_bottom() + egui::vec2(24.0, -30.0),
        area.right_bottom() - egui::vec2(24.0, 20.0),
    );
    painter.rect_filled(bar, 4.0, palette::BUTTON);
    if let Some(share) = share {
        let done = egui::Rect::from_min_size(bar.min, egui::vec2(bar.width() * share.clamp(0.0, 1.0), bar.height()));
        painter.rect_filled(done, 4.0, palette::ACCENT);
    }
    ui.ctx().request_repaint();
}

#[cfg(test)]
mod tests {
    use bevy::math::DVec2;
    use resecta_annotate::{Image, ImageSlice, Origin, Outline};

    use super::*;

    /// Grey images with outlines on them, nothing mended yet.
    fn opened() -> Opened {
        let grey: Vec<f32> = (0..32 * 32).map(|pixel| pixel as f32 / 1024.0).collect();
        let slice = |number: u32| ImageSlice {
            z_mm: 5.0 * f64::from(number),
            image: Image::new([32, 32], [1.0; 2], [-16.0; 2], grey.clone()).unwrap(),
        };
        let stack = Stack::new((0..4).map(slice).collect()).unwrap();
        let model = crate::assets::find().unwrap().join(crate::assets::PROSTATE_MODEL);
        Opened {
            outlines: Outlines::none(&stack),
            stack: Arc::new(stack),
            model: Arc::new(Model::load(&model).unwrap()),
            name: "Grey".into(),
            file: "grey.case.ron".into(),
            source: CaseSource::default(),
            note: None,
        }
    }

    #[test]
    fn the_window_closes_at_once_but_for_outlines_that_are_not_saved() {
        let mut app = App::new();
        app.add_message::<WindowCloseRequested>()
            .add_message::<AppExit>()
            .init_resource::<Editor>()
            .init_resource::<GameFlow>()
            .add_systems(Update, close);
        let window = app.world_mut().spawn_empty().id();
        let mut is_closed = |change: fn(&mut Editor)| {
            change(&mut app.world_mut().resource_mut::<Editor>());
            app.world_mut().write_message(WindowCloseRequested { window });
            app.update();
            let shows = std::mem::take(&mut *app.world_mut().resource_mut::<GameFlow>()).is_asked(Wish::Outlines);
            let closed = app.world_mut().resource_mut::<Messages<AppExit>>().drain().count() == 1;
            assert_ne!(closed, shows);
            closed
        };
        assert!(is_closed(|_| ()), "nothing is open");
        assert!(is_closed(|editor| editor.take(opened())), "nothing is mended");
        let mend = |editor: &mut Editor| {
            let open = editor.open.as_mut().unwrap();
            let ring = |corner: u32| 10.0 * DVec2::from_angle(0.2 * f64::from(corner));
            let outline = Outline {
                capsule: (0..32).map(ring).collect(),
                origin: Origin::Drawn,
                flags: Vec::new(),
            };
            open.outlines.set(1, Some(outline), false);
            (open.is_unsaved, open.is_leaving) = (true, false);
        };
        assert!(!is_closed(mend));
        assert!(is_closed(|_| ()), "asked for once more");
        assert!(is_closed(|editor| editor.open.as_mut().unwrap().is_unsaved = false));
    }

    #[test]
    fn the_window_closes_on_a_run_only_when_asked_again() {
        let mut app = App::new();
        let played = Metrics {
            steps: 6000,
            step_s: 1.0 / 60.0,
            ..default()
        };
        app.add_message::<WindowCloseRequested>()
            .add_message::<AppExit>()
            .init_resource::<Editor>()
            .insert_resource(played)
            .init_resource::<GameFlow>()
            .add_systems(Update, close);
        app.world_mut().resource_mut::<GameFlow>().phase = Phase::Playing;
        let window = app.world_mut().spawn_empty().id();
        let mut is_closed = || {
            app.world_mut().write_message(WindowCloseRequested { window });
            app.update();
            let mut flow = app.world_mut().resource_mut::<GameFlow>();
            let asks = flow.is_asked(Wish::Pause) && flow.is_asked(Wish::Quit);
            (flow.phase, flow.doubt) = (Phase::Paused, Some(Wish::Quit));
            let closed = app.world_mut().resource_mut::<Messages<AppExit>>().drain().count() == 1;
            (closed, asks)
        };
        assert_eq!(is_closed(), (false, true));
        assert!(is_closed().0);
    }
}
