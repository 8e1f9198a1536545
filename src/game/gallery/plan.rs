//! What the gallery shows, in order.

use std::collections::VecDeque;

use super::{Guidance, Phase, ViewLayout, Wish};
use crate::game::debrief::Page;

/// The middle lobe taken away in layers, with nobody who stops bleeding.
const LOBE: &str = "first_cuts.ron";
/// Through the urethra into the bladder and back; strokes to the capsule and through arteries, both currents.
const OPERATION: &str = "gallery.ron";
/// The first steps of the tutorial.
const TUTORIAL: &str = "tutorial.ron";

/// Something that leads to the next picture.
#[derive(Debug, Clone, Copy)]
pub enum Deed {
    /// Presses a button.
    Wish(Wish),
    /// Waits until the gland behind the title is there.
    AwaitTitleGland,
    /// Opens all levels, or only what was earned.
    Levels { all_open: bool },
    /// Looks at an exercise in the catalogue.
    Select(&'static str),
    /// Waits until the player is there.
    Await(Phase),
    /// Gives the instrument to a shipped script.
    Script(&'static str),
    /// Gives it to whoever shows the exercise, as if a player sat there.
    Shown,
    /// Lets simulated time hurry on to there, s, or to the end of the run.
    PlayTo(f64),
    /// Arranges the views.
    Views(ViewLayout),
    /// Sets the guidance.
    Guide(Guidance),
    /// Opens or closes the settings.
    Settings(bool),
    /// Opens the synthetic images, and waits until their gland is found.
    Outline,
    /// Turns to a page of the debriefing.
    Debrief(Page),
    /// Draws the views between pictures, too: the debriefing shows some of what was seen.
    Watch(bool),
    /// Lets the screen settle and takes a picture of the window at every size.
    Picture(&'static str),
}

/// Pictures during play: when, s, which views, and the name.
type PlayPictures = [(f64, ViewLayout, Guidance, &'static str)];

/// Of the middle lobe.
const LOBE_PICTURES: &PlayPictures = {
    use Guidance::{All, Off};
    use ViewLayout::Both;
    &[(8.2, Both, Off, "play"), (11.0, Both, All, "guidance")]
};

/// Of the operation.
const OPERATION_PICTURES: &PlayPictures = {
    use Guidance::Off;
    use ViewLayout::{Both, Endoscope, Outside};
    &[
        (0.7, Endoscope, Off, "sphincter"),
        (1.45, Endoscope, Off, "urethra"),
        (2.2, Endoscope, Off, "verumontanum"),
        (4.4, Endoscope, Off, "bladder_neck"),
        (5.85, Endoscope, Off, "bladder"),
        (9.3, Endoscope, Off, "dent"),
        (10.9, Endoscope, Off, "cutting"),
        (12.4, Endoscope, Off, "chip"),
        (13.4, Endoscope, Off, "loop_out"),
        (19.8, Endoscope, Off, "cut_surface"),
        (21.0, Endoscope, Off, "chips_in_bladder"),
        (29.0, Endoscope, Off, "coagulating"),
        (31.0, Endoscope, Off, "coagulated"),
        (34.9, Endoscope, Off, "jets"),
        (44.6, Both, Off, "bleeding"),
        (45.1, Outside, Off, "outside"),
        (46.3, Endoscope, Off, "red_out"),
        (50.4, Endoscope, Off, "lens_in_tissue"),
    ]
};

/// Of what is shown.
const SHOWN_PICTURES: &PlayPictures = &[(6.6, ViewLayout::Both, Guidance::All, "shown")];

/// Everything.
pub fn deeds() -> VecDeque<Deed> {
    let mut deeds = VecDeque::from([
        Deed::Wish(Wish::Title),
        Deed::Guide(Guidance::Off),
        Deed::AwaitTitleGland,
        Deed::Picture("title"),
    ]);
    deeds.extend([Deed::Settings(true), Deed::Picture("settings"), Deed::Settings(false)]);
    deeds.push_back(Deed::Levels { all_open: true });

    deeds.extend(open("tutorial"));
    deeds.push_back(Deed::Picture("tutorial_briefing"));
    deeds.extend(begin(Deed::Script(TUTORIAL)));
    deeds.extend([Deed::PlayTo(5.0), Deed::Picture("tutorial")]);
    deeds.extend(end());

    deeds.extend(open("full_operation"));
    deeds.push_back(Deed::Picture("operation_briefing"));
    deeds.extend(begin(Deed::Script(OPERATION)));
    deeds.extend(play(OPERATION_PICTURES));
    deeds.extend(end());
    deeds.extend([Deed::Debrief(Page::Score), Deed::Picture("operation_debriefing")]);

    deeds.extend(open("middle_lobe"));
    deeds.extend(begin(Deed::Script(LOBE)));
    deeds.extend(play(LOBE_PICTURES));
    deeds.extend([Deed::Wish(Wish::Help), Deed::Picture("help"), Deed::Wish(Wish::Help)]);
    deeds.extend([Deed::Wish(Wish::Pause), Deed::Picture("pause"), Deed::Wish(Wish::Play)]);
    deeds.extend(end());

    // Somebody shows how a vessel is closed.
    deeds.extend(open("haemostasis"));
    deeds.extend([Deed::Wish(Wish::Watch), Deed::Await(Phase::Playing)]);
    deeds.extend(play(SHOWN_PICTURES));
    deeds.extend(end());

    // A run to its end, for the debriefing.
    deeds.extend(open("middle_lobe"));
    deeds.extend(begin(Deed::Shown));
    deeds.extend([Deed::Watch(true), Deed::PlayTo(f64::INFINITY), Deed::Watch(false)]);
    deeds.push_back(Deed::Await(Phase::Result));
    for (page, name) in [
        (Page::Score, "debriefing"),
        (Page::Course, "debriefing_course"),
        (Page::Map, "debriefing_map"),
    ] {
        deeds.extend([Deed::Debrief(page), Deed::Picture(name)]);
    }
    deeds.extend([
        Deed::Wish(Wish::Choose),
        Deed::Select("middle_lobe"),
        Deed::Picture("choose"),
    ]);
    deeds.push_back(Deed::Levels { all_open: false });
    deeds.extend([Deed::Wish(Wish::Progress), Deed::Picture("progress")]);
    deeds.extend([Deed::Wish(Wish::Outlines), Deed::Picture("outlines_door")]);
    deeds.extend([Deed::Outline, Deed::Picture("outlines")]);
    deeds
}

/// Opens an exercise, up to its briefing.
fn open(exercise: &'static str) -> [Deed; 4] {
    [
        Deed::Wish(Wish::Choose),
        Deed::Select(exercise),
        Deed::Wish(Wish::Open),
        Deed::Await(Phase::Briefing),
    ]
}

/// Begins it, with these hands at the instrument.
fn begin(hands: Deed) -> [Deed; 2] {
    [hands, Deed::Wish(Wish::Play)]
}

/// Plays from picture to picture.
fn play(pictures: &'static PlayPictures) -> impl Iterator<Item = Deed> {
    pictures.iter().flat_map(|&(time_s, views, guidance, name)| {
        [
            Deed::Views(views),
            Deed::Guide(guidance),
            Deed::PlayTo(time_s),
            Deed::Picture(name),
        ]
    })
}

/// Ends the run, wherever it is.
fn end() -> [Deed; 3] {
    [
        Deed::Wish(Wish::Pause),
        Deed::Wish(Wish::End),
        Deed::Await(Phase::Result),
    ]
}
