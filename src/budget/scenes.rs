//! The standard scenes: what the instrument does in them, and when the tissue is looked at.
//!
//! A scene is a shipped exercise and a script. The script is the same for every variant of a scene, so that states at equal times can be
//! compared; where tissue holds the instrument, it may be elsewhere than the script says.

use std::{fmt::Write, path::Path};

use bevy::prelude::*;
use resecta_anatomy::Zone;
use resecta_instrument::{InstrumentLimits, InstrumentScript, InstrumentState, ScriptError};
use resecta_scenario::{Exercise, ExerciseError, Goal, Library, Marked};

/// What a pull of the loop through tissue is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pull {
    /// Pitch above the tissue and in it, degrees.
    pitch_deg: [f32; 2],
    /// Yaw where the pull begins and where it ends, degrees.
    yaw_deg: [f32; 2],
    /// How far the loop is out where it begins, mm.
    reach_mm: f32,
}

const fn pull(pitch_deg: [f32; 2], yaw_deg: [f32; 2], reach_mm: f32) -> Pull {
    Pull {
        pitch_deg,
        yaw_deg,
        reach_mm,
    }
}

/// The first pull of `first_cuts`, over the top of the middle lobe.
const MIDDLE: Pull = pull([-0.5, -3.0], [0.0, 0.0], 27.2);
/// The one beside it, a little deeper.
const BESIDE: Pull = pull([-0.5, -4.0], [-3.5, -3.5], 24.0);
/// One that crosses the first, from left to right.
const ACROSS: Pull = pull([-0.5, -4.0], [-6.0, 6.0], 24.0);
/// Three layers of the middle lobe in twelve pulls, and a thirteenth into the bed that they left.
const LATE: [Pull; 13] = [
    pull([-0.5, -3.0], [0.0, 0.0], 27.2),
    pull([-0.5, -4.0], [-3.5, -3.5], 24.0),
    pull([-0.5, -4.0], [3.5, 3.5], 24.0),
    pull([-0.5, -4.5], [-7.0, -7.0], 22.0),
    pull([-0.5, -4.5], [7.0, 7.0], 22.0),
    pull([-2.0, -6.0], [0.0, 0.0], 23.5),
    pull([-2.0, -6.0], [-4.0, -4.0], 23.0),
    pull([-2.0, -6.0], [4.0, 4.0], 23.0),
    pull([-4.5, -8.5], [0.0, 0.0], 21.5),
    pull([-4.5, -8.5], [-4.5, -4.5], 20.5),
    pull([-4.5, -8.5], [4.5, 4.5], 20.5),
    pull([-7.0, -11.0], [-5.5, -5.5], 17.5),
    pull([-7.0, -11.0], [0.0, 0.0], 18.0),
];

/// How deep the sheath goes in, mm, and how it is held there, degrees: over the verumontanum, as in `first_cuts`.
const IN_PLACE: (f32, f32) = (34.0, -6.0);
/// Where its tip is before and after, mm: outside of the gland.
const OUTSIDE_MM: f32 = -10.0;
/// Speeds of the loop on its way out and in the pull, mm/s, and of the sheath on its way back.
const OUT_MM_PER_S: f32 = 40.0;
const PULL_MM_PER_S: f32 = 30.0;
const BACK_MM_PER_S: f32 = 100.0;

/// A moment at which the surface is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// What the moment is.
    pub name: &'static str,
    /// When, s.
    pub time_s: f64,
    /// When the instrument was where its surroundings are looked at, s.
    pub about_s: f64,
    /// Whether it counts in the budget.
    pub counts: bool,
}

/// A standard scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Short name.
    pub key: &'static str,
    /// What happens.
    pub words: &'static str,
    /// The shipped exercise that it is made from.
    pub exercise: &'static str,
    /// The case that it is played on.
    pub case: &'static str,
    /// What is looked at along the sheath's axis: from so far behind the tip to so far ahead of it, mm.
    pub along_mm: [f32; 2],
    /// When it is looked at, ascending.
    pub looks: Vec<Look>,
    /// Where the instrument is at what time, s.
    keys: Vec<(f64, InstrumentState)>,
}

/// Every scene, in the order of the page.
pub fn all() -> Vec<Scene> {
    vec![
        urethra(),
        of_pulls("stroke", "a stroke over the middle lobe", &[MIDDLE]),
        of_pulls("adjacent", "two strokes side by side", &[MIDDLE, BESIDE]),
        of_pulls("across", "a stroke, and another that crosses it", &[MIDDLE, ACROSS]),
        of_pulls(
            "late",
            "twelve strokes in three layers, and one more into their bed",
            &LATE,
        ),
    ]
}

/// The hands on their way through a script.
struct Hands {
    time_s: f64,
    now: InstrumentState,
    keys: Vec<(f64, InstrumentState)>,
}

impl Hands {
    fn outside() -> Hands {
        let now = InstrumentState {
            insertion_mm: OUTSIDE_MM,
            pitch_deg: -18.0,
            ..default()
        };
        Hands {
            time_s: 0.0,
            now,
            keys: vec![(0.0, now)],
        }
    }

    /// Goes on to a state in so many seconds.
    fn to(&mut self, after_s: f32, change: impl Fn(&mut InstrumentState)) {
        // Tenths of milliseconds: a script is text.
        self.time_s = ((self.time_s + f64::from(after_s)) * 1e4).round() / 1e4;
        change(&mut self.now);
        self.keys.push((self.time_s, self.now));
    }

    /// In through the urethra at less than 20 mm/s, as `first_cuts` does it.
    fn insert(&mut self) {
        self.to(1.5, |now| now.insertion_mm = 16.0);
        self.to(1.5, |now| (now.insertion_mm, now.pitch_deg) = IN_PLACE);
    }

    fn rest(&mut self, for_s: f32) {
        self.to(for_s, |_| {});
    }

    /// The loop out over the tissue, into it with current on, and back through it.
    /// Returns when the loop was out, before the current, s.
    fn pull(&mut self, pull: &Pull) -> f64 {
        let [above, within] = pull.pitch_deg;
        let [from, to] = pull.yaw_deg;
        self.to(0.4, |now| (now.pitch_deg, now.yaw_deg) = (above, from));
        self.to(pull.reach_mm / OUT_MM_PER_S, |now| now.stroke_mm = pull.reach_mm);
        self.rest(0.1);
        let out_s = self.time_s;
        self.to(0.1, |now| now.cut = true);
        self.to(0.2, |now| now.pitch_deg = within);
        let way_mm = pull.reach_mm - 1.0;
        self.to(way_mm / PULL_MM_PER_S, |now| (now.stroke_mm, now.yaw_deg) = (1.0, to));
        self.to(0.05, |now| now.cut = false);
        self.rest(0.3);
        out_s
    }

    fn withdraw(&mut self) {
        let way_mm = self.now.insertion_mm - OUTSIDE_MM;
        self.to(0.1, |now| now.stroke_mm = 0.0);
        self.to(way_mm / BACK_MM_PER_S, |now| now.insertion_mm = OUTSIDE_MM);
    }
}

fn urethra() -> Scene {
    let mut hands = Hands::outside();
    hands.insert();
    let arrived_s = hands.time_s;
    hands.rest(1.0);
    let rested_s = hands.time_s;
    hands.withdraw();
    hands.rest(1.1);
    let look = |name, time_s, about_s, counts| Look {
        name,
        time_s,
        about_s,
        counts,
    };
    Scene {
        key: "urethra",
        words: "the sheath through the narrow urethra of a gland of 30 ml, and out again",
        exercise: "first_cuts",
        case: "small",
        along_mm: [30.0, 6.0],
        looks: vec![
            look("before", 0.1, rested_s, false),
            look("sheath in", arrived_s, rested_s, true),
            look("a second later", rested_s, rested_s, true),
            look("a second after withdrawal", hands.time_s - 0.1, rested_s, true),
        ],
        keys: hands.keys,
    }
}

/// A scene of pulls, looked at before the last of them, after the last two and when the instrument is out.
fn of_pulls(key: &'static str, words: &'static str, pulls: &[Pull]) -> Scene {
    let mut hands = Hands::outside();
    hands.insert();
    let in_s = hands.time_s;
    let mut looks = vec![Look {
        name: "before",
        time_s: 0.1,
        about_s: in_s,
        counts: false,
    }];
    for (number, pull) in pulls.iter().enumerate() {
        let out_s = hands.pull(pull);
        let time_s = hands.time_s;
        let mut look = |name, time_s, counts| {
            looks.push(Look {
                name,
                time_s,
                about_s: time_s,
                counts,
            });
        };
        match pulls.len() - number {
            1 => {
                // On its way out the loop catches tissue or slips over it: which of the two hangs on anything.
                look("loop out, before the last stroke", out_s, false);
                look("after the last stroke", time_s, true);
            }
            2 => look("after the stroke before it", time_s, true),
            _ => {}
        }
    }
    let about_s = hands.time_s;
    hands.withdraw();
    hands.rest(1.1);
    looks.push(Look {
        name: "a second after withdrawal",
        time_s: hands.time_s - 0.1,
        about_s,
        counts: true,
    });
    Scene {
        key,
        words,
        exercise: "first_cuts",
        case: "medium",
        along_mm: [5.0, 24.0],
        looks,
        keys: hands.keys,
    }
}

impl Scene {
    /// How long it takes, s.
    pub fn duration_s(&self) -> f64 {
        self.keys.last().map_or(0.0, |(time_s, _)| *time_s)
    }

    /// Pulls of the loop with current on.
    pub fn strokes(&self) -> usize {
        let pairs = self.keys.windows(2);
        pairs.filter(|pair| pair[1].1.cut && !pair[0].1.cut).count()
    }

    /// The script's text, as in a file.
    fn script_text(&self) -> String {
        let mut text = String::from("(keys: [\n");
        for (time_s, state) in &self.keys {
            let InstrumentState {
                insertion_mm,
                pitch_deg,
                yaw_deg,
                stroke_mm,
                cut,
                ..
            } = state;
            // Writing to a text cannot fail.
            let _ = writeln!(
                text,
                "(time_s: {time_s}, insertion_mm: {insertion_mm}, pitch_deg: {pitch_deg}, yaw_deg: {yaw_deg}, \
                 stroke_mm: {stroke_mm}, cut: {cut}),"
            );
        }
        text + "])"
    }

    /// The script, checked as one from a file.
    ///
    /// # Errors
    /// [`ScriptError`] names the key.
    pub fn script(&self) -> Result<InstrumentScript, ScriptError> {
        let name = format!("scene {}", self.key);
        InstrumentScript::from_ron(&self.script_text(), Path::new(&name), &InstrumentLimits::default())
    }

    /// Its exercise, which neither a goal nor what was removed ends.
    ///
    /// # Errors
    /// [`ExerciseError`].
    pub fn exercise(&self, library: &Library) -> Result<Exercise, ExerciseError> {
        let mut exercise = library.load(self.exercise)?.exercise;
        exercise.case = self.case.into();
        exercise.shown_by = None;
        exercise.goals = vec![Goal::RemoveMarked { share: 1.0 }];
        exercise.limits.sphincter_injuries = None;
        exercise.limits.capsule_cut_share = None;
        exercise.instrument.start = self.keys.first().map(|(_, state)| *state);
        // Not every case has a middle lobe, and an exercise has to mark something.
        exercise.marked = Marked {
            zones: vec![Zone::LateralLobe],
            clock: None,
            height: None,
            depth_mm: None,
            dyed: false,
        };
        Ok(exercise)
    }
}
