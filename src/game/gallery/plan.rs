//! What the gallery shows, in order.

use std::collections::VecDeque;

use super::{Guidance, Phase, ViewLayout, Wish};

/// Names and sizes of the windows, pixels.
const SIZES: [(&str, [u32; 2]); 2] = [("1280x720", [1280, 720]), ("2560x1440", [2560, 1440])];

/// Through the urethra into the bladder and back; strokes, coagulation.
const OPERATION: &str = include_str!("operation.ron");
/// The first steps of the tutorial.
const TUTORIAL: &str = include_str!("../../../assets/scripts/tutorial.ron");

/// Something that leads to the next picture.
#[derive(Debug, Clone, Copy)]
pub enum Deed {
    /// Sizes the window; its pictures go to a folder of this name.
    Size(&'static str, [u32; 2]),
    /// Presses a button.
    Wish(Wish),
    /// Looks at an exercise in the catalogue.
    Select(&'static str),
    /// Waits until the player is there.
    Await(Phase),
    /// Gives the instrument to a script.
    Script(&'static str),
    /// Lets simulated time hurry on to there, s.
    PlayTo(f64),
    /// Arranges the views.
    Views(ViewLayout),
    /// Sets the guidance.
    Guide(Guidance),
    /// Opens or closes the settings.
    Settings(bool),
    /// Lets some frames pass.
    Settle,
    /// Takes a picture of the window.
    Picture(&'static str),
}

/// Pictures during the operation: when, s, which views, and the name.
const OPERATION_PICTURES: [(f64, ViewLayout, Guidance, &str); 15] = {
    use Guidance::{All, Off};
    use ViewLayout::{Both, Endoscope, Outside};
    [
        (1.0, Endoscope, Off, "urethra"),
        (2.4, Endoscope, Off, "verumontanum"),
        (4.8, Endoscope, Off, "bladder_neck"),
        (5.7, Endoscope, Off, "bladder"),
        (7.4, Endoscope, Off, "loop_out"),
        (8.2, Endoscope, Off, "cutting"),
        (8.7, Both, Off, "cutting_both"),
        (11.0, Endoscope, Off, "chip"),
        (15.4, Endoscope, Off, "cut_surface"),
        (15.5, Both, All, "guidance"),
        (17.5, Endoscope, Off, "coagulating"),
        (19.0, Endoscope, Off, "coagulated"),
        (29.0, Endoscope, Off, "bed"),
        (29.1, Outside, Off, "outside"),
        (31.0, Endoscope, Off, "lens_at_wall"),
    ]
};

/// Everything, at every size.
pub fn deeds() -> VecDeque<Deed> {
    use Deed::*;
    let mut deeds = VecDeque::new();
    let picture = |name| [Settle, Picture(name), Settle];
    for (name, size) in SIZES {
        deeds.extend([
            Size(name, size),
            Wish(self::Wish::Title),
            Guide(Guidance::Off),
            Views(ViewLayout::Both),
        ]);
        deeds.extend(picture("title"));
        deeds.push_back(Wish(self::Wish::Choose));
        deeds.extend(picture("choose"));
        deeds.push_back(Settings(true));
        deeds.extend(picture("settings"));
        deeds.push_back(Settings(false));

        deeds.extend([Select("tutorial"), Wish(self::Wish::Open), Await(Phase::Briefing)]);
        deeds.extend(picture("tutorial_briefing"));
        deeds.extend([Script(TUTORIAL), Wish(self::Wish::Play), PlayTo(5.0)]);
        deeds.extend(picture("tutorial"));
        deeds.extend([
            Wish(self::Wish::Pause),
            Wish(self::Wish::End),
            Await(Phase::Result),
            Wish(self::Wish::Choose),
        ]);

        deeds.extend([Select("middle_lobe"), Wish(self::Wish::Open), Await(Phase::Briefing)]);
        deeds.extend(picture("briefing"));
        deeds.extend([Script(OPERATION), Wish(self::Wish::Play)]);
        for (time_s, views, guidance, name) in OPERATION_PICTURES {
            deeds.extend([Views(views), Guide(guidance), PlayTo(time_s)]);
            deeds.extend(picture(name));
        }
        deeds.push_back(Views(ViewLayout::Both));
        deeds.push_back(Wish(self::Wish::Help));
        deeds.extend(picture("help"));
        deeds.extend([Wish(self::Wish::Help), Settle, Wish(self::Wish::Pause)]);
        deeds.extend(picture("pause"));
        deeds.extend([Wish(self::Wish::End), Await(Phase::Result)]);
        deeds.extend(picture("debriefing"));
        deeds.push_back(Wish(self::Wish::Choose));
        deeds.push_back(Await(Phase::Choosing));
    }
    deeds
}
