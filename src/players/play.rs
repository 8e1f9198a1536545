//! The course of a scripted operation: stroke after stroke, and what comes between them.

use std::sync::Arc;

use bevy::{math::DVec3, prelude::*};
use resecta_anatomy::Case;
use resecta_instrument::{InstrumentPlayback, InstrumentRequest, InstrumentState, Resectoscope};
use resecta_scenario::{Exercise, LoopClearance, RunState};

use super::{
    hand::{approach, hold, is_at},
    lumen::Lumen,
    plan::{Manner, Outlines, Stroke, strokes, towards},
    senses::Senses,
};

/// How far the loop is held off the tissue while it is brought somewhere, mm.
const LIFT_MM: f32 = 4.0;
/// Steps without tissue after which a careful foot leaves the pedal.
const LET_GO_STEPS: u32 = 3;
/// How long a bleeder is pressed at most in one go, s, and how far the loop may sink in before it is given up, mm.
const PRESS_S: f32 = 1.5;
/// How long it is pressed at least, s: a vessel closes after half a second of current, and what follows burns what no longer bleeds.
const PRESS_LEAST_S: f32 = 0.53;
const SINK_MM: f32 = 5.0;
/// How fast it sinks in, mm/s: until it meets tissue where the bleeder was seen, and from there on, while it still bleeds.
const SINK_MM_PER_S: f32 = 12.0;
const PRESS_MM_PER_S: f32 = 3.0;
/// How deep it is pressed in, mm: about the radius of the wire's contacts.
const PRESSED_MM: f32 = 0.4;
/// How far the loop is out while it presses a bleeder, so that the lens sees it, mm.
const PRESS_STROKE_MM: f32 = 12.0;
/// Two bleeders nearer than this are one to a player, mm; it is tried so many times.
const SAME_MM: f32 = 3.0;
const TRIES: usize = 4;
/// How far a bleeder may have moved with its tissue while the loop came to it, mm.
const MOVED_MM: f32 = 8.0;
/// How far above the verumontanum a bleeder has to be for whoever operates on the gland to close it: heat spreads, and below
/// lies the sphincter, mm.
const SPARED_MM: f64 = 1.0;
/// A view below this is poor: whoever closes bleeders looks for one that they do not see. Below the second nobody careful cuts.
const CLEAR: f64 = 0.5;
const DIM: f64 = 0.35;
/// By how much a view grows worse over a stroke that opened a vessel.
const DIMMED: f64 = 0.1;
/// How long water is given to clear after every search, s, and how many searches may find nothing before the operation goes on,
/// without another until the view was clear again, a stroke opens a vessel or the next sector begins: what was not found by then is
/// not found after every stroke. The last of them, the widest, is what whoever has nothing else to do begins with.
const WAIT_S: f32 = 10.0;
const SEARCHES: u32 = 3;
/// Strokes whose beds the first search goes along; every further one goes along three times as many.
const SEARCHED_STROKES: usize = 3;
/// The view in which nothing can bleed, and beds that are looked at once more where it is not that clear when all is cut: who leaves
/// a vessel open has not finished.
const SPOTLESS: f64 = 0.99;
const LAST_LOOK_STROKES: usize = 40;
/// Distance between places that a search looks at, mm, and how far the loop is held off them: nearer than elsewhere, so that the lens sees
/// over the edge at which a trench ends.
const SEARCH_STEP_MM: usize = 7;
const SEARCH_LIFT_MM: f32 = 1.0;
/// Pressure at which the inflow is shut, and at which it is opened again, cmH2O: absorption begins at 20.
const HIGH_CMH2O: f64 = 15.0;
const LOW_CMH2O: f64 = 8.0;
/// How long the bladder is flushed when a part of the gland is done, s, and how far beyond the neck, mm.
const FLUSH_S: f32 = 5.0;
const FLUSH_MM: f64 = 8.0;

/// What a player is about.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doing {
    /// The sheath goes to where the next stroke begins, the loop drawn in as far as the manner has it.
    Reach,
    /// The loop goes out over the tissue.
    Extend,
    /// The loop is sunk in.
    Lower,
    /// The loop is drawn back; how far, in places of the way.
    Pull(f32),
    /// Looks, waits for a clear view, decides.
    Look(f32),
    /// Goes along the beds of the last strokes, near enough to see through the murk; how many places are behind.
    Search(usize),
    /// The loop goes to a bleeder, held off it.
    Seek(Vec3),
    /// The loop is on it: how long it pressed without a break, s (one lets the vessel bleed on), and how far it sank, mm.
    Press(Vec3, f32, f32),
    /// In the bladder until chips are out; for how long yet, s.
    Flush(f32),
    /// Everything was cut.
    Done,
}

/// A scripted player at an instrument.
#[derive(Component, Debug, Clone)]
pub(crate) struct Play {
    manner: Manner,
    /// Whether it cuts: else the strokes are only where it looks for bleeders.
    cuts: bool,
    strokes: Vec<(usize, Stroke)>,
    next: usize,
    /// How far the tissue along the next one's way has moved, mm; empty until it is looked at.
    moved: Vec<Vec3>,
    /// How often they are yet to be gone through.
    rounds: u32,
    doing: Doing,
    /// Bleeders that were pressed.
    tried: Vec<Vec3>,
    /// Bleeders below this are left alone, z in mm.
    spared_below: f32,
    /// How far the verumontanum lies above the external sphincter, mm.
    verumontanum_mm: f32,
    /// Searches in vain: since the last bleeder was found, the view was clear after a stroke or much worse than before it, or a sector
    /// was begun.
    searches: u32,
    /// How clear the view was when the present stroke began, 0 to 1.
    view_before: f64,
    /// When all is cut, the place that the last look about has come to.
    last_look: Option<usize>,
    steps_without_tissue: u32,
    is_inflow_shut: bool,
    lumen: Arc<Lumen>,
    neck: Vec3,
}

impl Play {
    pub fn new(manner: Manner, case: &Case, exercise: &Exercise) -> Self {
        let outlines = Outlines::new(case);
        let heights = match (case.slices.first(), case.slices.last()) {
            (Some(first), Some(last)) if case.slices.len() > 1 => first.z as i32..last.z as i32 + 1,
            _ => 0..0,
        };
        // Whoever minds no marks cuts whatever is asked for.
        let cuts = exercise.asks_for_tissue() || !manner.keeps_to_marks;
        let strokes = strokes(case, &exercise.marked, &manner);
        let middle = |z: i32| outlines.centre(z.into()).extend(z.into());
        Self {
            manner,
            cuts,
            next: if cuts { 0 } else { strokes.len() },
            strokes,
            moved: Vec::new(),
            rounds: manner.rounds,
            doing: if cuts { Doing::Reach } else { Doing::Look(0.0) },
            tried: Vec::new(),
            spared_below: case
                .landmarks
                .verumontanum
                .filter(|_| cuts)
                .map_or(f32::NEG_INFINITY, |verumontanum| (verumontanum.z + SPARED_MM) as f32),
            verumontanum_mm: (case.landmarks.verumontanum)
                .zip(case.landmarks.external_sphincter)
                .map_or(f32::NEG_INFINITY, |(upper, lower)| (upper.z - lower.z) as f32),
            searches: 0,
            view_before: 1.0,
            last_look: None,
            steps_without_tissue: 0,
            is_inflow_shut: false,
            lumen: Arc::new(Lumen {
                middles: heights.map(middle).collect(),
            }),
            neck: case
                .landmarks
                .bladder_neck
                .map_or(Vec3::ZERO, |neck| (neck + DVec3::Z * FLUSH_MM).as_vec3()),
        }
    }

    /// Who makes these strokes, one after the other, and minds nothing else.
    pub fn of_strokes(case: &Case, exercise: &Exercise, strokes: Vec<Stroke>) -> Self {
        let manner = Manner {
            coagulates: false,
            minds_water: false,
            trims: false,
            rounds: 1,
            lets_go_at_capsule_mm: None,
            lets_go_above_verumontanum_mm: None,
            ..Manner::careful()
        };
        Self {
            cuts: true,
            strokes: strokes.into_iter().map(|stroke| (0, stroke)).collect(),
            next: 0,
            doing: Doing::Reach,
            ..Self::new(manner, case, exercise)
        }
    }

    /// The stroke that it is at, or how many there were.
    pub fn stroke_number(&self) -> usize {
        self.next
    }

    /// From the middle of the urethra to a place, across.
    fn outwards(&self, place: Vec3) -> Vec3 {
        let nearest = self.lumen.middles.iter().map(|middle| middle.as_vec3());
        let nearest = nearest.min_by(|a, b| (a.z - place.z).abs().total_cmp(&(b.z - place.z).abs()));
        nearest.map_or(Vec3::Y, |middle| (place - middle).with_z(0.0).normalize_or(Vec3::Y))
    }

    /// Where the deepest point of the loop is on the next stroke's way.
    fn way_point(&self, at: f32) -> Option<(Vec3, Vec3, f32)> {
        let (_, stroke) = self.strokes.get(self.next)?;
        let last = stroke.way.len() - 1;
        let (from, to) = ((at as usize).min(last), (at as usize + 1).min(last));
        let place = stroke.way[from].lerp(stroke.way[to], f64::from(at.fract())).as_vec3();
        let moved = |index: usize| self.moved.get(index).copied().unwrap_or_default();
        let place = place + moved(from).lerp(moved(to), at.fract());
        let outwards = towards(stroke.hour).extend(0.0);
        let left_mm = stroke.way[last].distance(stroke.way[0]) as f32;
        Some((place, outwards.as_vec3(), left_mm))
    }

    /// Before the loop is out: it would push along what it is to cut.
    fn look_where_tissue_is(&mut self, senses: &Senses) {
        if let Some((_, stroke)) = self.strokes.get(self.next).filter(|_| self.manner.follows_tissue) {
            let places: Vec<Vec3> = stroke.way.iter().map(|place| place.as_vec3()).collect();
            self.moved = senses.moved(&places);
        }
    }

    /// A step: where the hands go from here, pedals and taps included.
    fn step(
        &mut self,
        now: &InstrumentState,
        scope: &Resectoscope,
        clearance: Option<&LoopClearance>,
        senses: &mut Senses,
        step_s: f32,
    ) -> InstrumentState {
        let manner = self.manner;
        self.steps_without_tissue = if senses.loop_in_tissue() {
            0
        } else {
            self.steps_without_tissue + 1
        };
        let released = InstrumentState {
            cut: false,
            coagulate: false,
            ..*now
        };
        let lumen = Arc::clone(&self.lumen);
        let go = |to: &InstrumentState| {
            let pace = [manner.haste, step_s];
            match manner.follows_lumen {
                true => lumen.follow(scope, &released, to, manner.carried_out_mm, pace),
                false => approach(scope, &released, to, manner.haste, step_s),
            }
        };
        let next = match self.doing {
            Doing::Reach | Doing::Extend | Doing::Lower => match self.way_point(0.0) {
                None => {
                    self.doing = Doing::Done;
                    released
                }
                Some((place, outwards, way_mm)) => {
                    let lift = if self.doing == Doing::Lower { 0.0 } else { LIFT_MM };
                    let mut to = hold(scope, now, place - outwards * lift, outwards, way_mm);
                    if self.doing == Doing::Reach {
                        to.stroke_mm = manner.carried_out_mm;
                    }
                    let mut next = go(&to);
                    // A heavy foot is down on the whole way.
                    next.cut = !manner.current_in_tissue;
                    if is_at(scope, now, &to) {
                        self.doing = match self.doing {
                            Doing::Reach => {
                                self.look_where_tissue_is(senses);
                                Doing::Extend
                            }
                            Doing::Extend => Doing::Lower,
                            _ => Doing::Pull(0.0),
                        };
                        self.view_before = senses.visibility();
                    }
                    next
                }
            },
            Doing::Pull(at) => {
                let at = at + manner.pull_mm_per_s * step_s;
                let length = self.strokes.get(self.next).map_or(0, |(_, stroke)| stroke.way.len()) as f32;
                let sheath_mm = now.insertion_mm;
                let Some((place, outwards, _)) = self.way_point(at).filter(|_| at < length) else {
                    let sector = self.strokes.get(self.next).map(|(sector, _)| *sector);
                    self.next += 1;
                    self.moved.clear();
                    if self.next == self.strokes.len() && self.rounds > 1 {
                        (self.next, self.rounds) = (0, self.rounds - 1);
                    }
                    let following = self.strokes.get(self.next).map(|(sector, _)| *sector);
                    let view = senses.visibility();
                    if sector != following || view >= CLEAR || view < self.view_before - DIMMED {
                        self.searches = 0;
                    }
                    self.doing = match manner.minds_water && sector != following {
                        true => Doing::Flush(FLUSH_S),
                        false => Doing::Look(0.0),
                    };
                    return self.turn_taps(released, senses);
                };
                self.doing = Doing::Pull(at);
                // The sheath stays while the loop comes in, and is drawn back for what is left of the way.
                let tight = hold(scope, now, place, outwards, 0.0);
                let stroke_mm = (tight.insertion_mm - sheath_mm).clamp(0.0, scope.limits.stroke_mm.max);
                let mut next = approach(
                    scope,
                    &released,
                    &hold(scope, now, place, outwards, stroke_mm),
                    1.0,
                    step_s,
                );
                let capsule_mm = clearance.and_then(|clearance| clearance.capsule_mm);
                let limit = manner.lets_go_at_capsule_mm.zip(capsule_mm);
                let is_off_capsule = limit.is_none_or(|(least_mm, capsule_mm)| capsule_mm > least_mm);
                let is_wanted = !manner.current_in_tissue || self.steps_without_tissue < LET_GO_STEPS;
                next.cut = is_wanted && is_off_capsule && self.is_off_sphincter(clearance);
                next
            }
            Doing::Look(waited_s) => {
                self.doing = self.decide(now, scope, senses, waited_s, step_s);
                let drawn_in_mm = scope.limits.stroke_mm.max_speed * manner.haste * step_s;
                InstrumentState {
                    stroke_mm: (now.stroke_mm - drawn_in_mm).max(manner.carried_out_mm),
                    ..released
                }
            }
            Doing::Search(behind) => match self.searched_place(behind) {
                Some((place, outwards)) => {
                    let to = hold(scope, now, place - outwards * SEARCH_LIFT_MM, outwards, PRESS_STROKE_MM);
                    self.last_look = self.last_look.map(|_| behind);
                    self.doing = match self.nearest_bleeder(scope.tip(now), senses) {
                        Some(bleeder) => self.seek(bleeder),
                        None if is_at(scope, now, &to) => Doing::Search(behind + 1),
                        None => Doing::Search(behind),
                    };
                    go(&to)
                }
                None => {
                    if !self.cuts {
                        // Nothing else is to be done: what was tried in vain is tried again.
                        self.tried.clear();
                    }
                    self.last_look = self.last_look.map(|_| behind);
                    self.doing = Doing::Look(0.0);
                    released
                }
            },
            Doing::Seek(place) => {
                let outwards = self.outwards(place);
                let to = hold(scope, now, place - outwards * LIFT_MM, outwards, PRESS_STROKE_MM);
                if is_at(scope, now, &to) {
                    // The sheath moves tissue on the way: the bleeder is where it is seen from here.
                    self.doing = match self.nearest_bleeder(place, senses) {
                        Some(seen) if seen.distance(place) < SAME_MM => Doing::Press(seen, 0.0, -LIFT_MM),
                        Some(seen) if seen.distance(place) < MOVED_MM => self.seek(seen),
                        // The loop may hide it.
                        _ => Doing::Press(place, 0.0, -LIFT_MM),
                    };
                }
                go(&to)
            }
            Doing::Press(place, pressed_s, sunk_mm) => {
                let is_on = senses.loop_in_tissue();
                // Loop and water move the bleeder with its tissue.
                let nearest = |a: &Vec3, b: &Vec3| a.distance(place).total_cmp(&b.distance(place));
                let seen = senses.bleeders().into_iter().min_by(nearest);
                let seen = seen.filter(|seen| seen.distance(place) < SAME_MM);
                let (still_bleeds, place) = (seen.is_some(), seen.unwrap_or(place));
                // Tissue may be met on the way; the bleeder is where it was seen.
                let is_there = is_on && sunk_mm >= 0.0;
                let sinks_mm_per_s = match is_there {
                    // A wire under current sinks into tissue as into nothing: past the vessel it closes none.
                    true if sunk_mm > PRESSED_MM => 0.0,
                    true => PRESS_MM_PER_S,
                    false => SINK_MM_PER_S,
                };
                let sunk_mm = sunk_mm + sinks_mm_per_s * step_s;
                let pressed_s = if is_there { pressed_s + step_s } else { 0.0 };
                // The loop, or tissue that it folds, may hide the bleeder: a short press tells nothing.
                let is_closed = pressed_s > PRESS_LEAST_S && !still_bleeds;
                let is_over = pressed_s > PRESS_S || sunk_mm > SINK_MM || is_closed;
                self.doing = if is_over {
                    Doing::Look(0.0)
                } else {
                    Doing::Press(place, pressed_s, sunk_mm)
                };
                let outwards = self.outwards(place);
                let mut next = go(&hold(scope, now, place + outwards * sunk_mm, outwards, PRESS_STROKE_MM));
                next.coagulate = is_there && !is_over && self.is_off_sphincter(clearance);
                next
            }
            Doing::Flush(left_s) => {
                let to = hold(
                    scope,
                    now,
                    self.neck + Vec3::Y * scope.geometry.loop_depth_mm,
                    Vec3::Y,
                    0.0,
                );
                let left_s = if is_at(scope, now, &to) {
                    left_s - step_s
                } else {
                    left_s
                };
                self.doing = if left_s > 0.0 {
                    Doing::Flush(left_s)
                } else {
                    Doing::Look(0.0)
                };
                go(&to)
            }
            Doing::Done => released,
        };
        self.turn_taps(next, senses)
    }

    /// Whether the tissue about the wire lay far enough above the verumontanum, as the panel tells it.
    fn is_off_sphincter(&self, clearance: Option<&LoopClearance>) -> bool {
        let above_mm = clearance.and_then(|clearance| clearance.sphincter_mm);
        let limit = (self.manner.lets_go_above_verumontanum_mm).zip(above_mm);
        limit.is_none_or(|(least_mm, above_mm)| above_mm - self.verumontanum_mm > least_mm)
    }

    /// What to do after a stroke or a bleeder.
    fn decide(
        &mut self,
        now: &InstrumentState,
        scope: &Resectoscope,
        senses: &mut Senses,
        waited_s: f32,
        step_s: f32,
    ) -> Doing {
        let manner = &self.manner;
        // The loop comes in first: it hides what is behind it.
        if now.stroke_mm > manner.carried_out_mm && waited_s == 0.0 {
            return Doing::Look(0.0);
        }
        if manner.coagulates
            && let Some(place) = self.nearest_bleeder(scope.tip(now), senses)
        {
            return self.seek(place);
        }
        if !self.cuts {
            // Wherever something was cut, again and again: the exercise ends when nothing bleeds.
            self.searches = SEARCHES;
            return Doing::Search(0);
        }
        if manner.coagulates && self.next == self.strokes.len() {
            if self.last_look.is_none() && senses.visibility() < SPOTLESS {
                self.last_look = Some(0);
            }
            let goes_on = self.last_look.filter(|behind| self.searched_place(*behind).is_some());
            return goes_on.map_or(Doing::Reach, Doing::Search);
        }
        let searches_on = self.searches < SEARCHES;
        let wanted = if searches_on { CLEAR } else { DIM };
        if manner.minds_water && senses.visibility() < wanted {
            if self.searches > 0 && waited_s < WAIT_S {
                return Doing::Look(waited_s + step_s);
            }
            if searches_on {
                self.searches += 1;
                return Doing::Search(0);
            }
        }
        Doing::Reach
    }

    /// The bleeder in view that is nearest to a place, of those that are to be closed and were not yet tried in vain.
    fn nearest_bleeder(&self, to: Vec3, senses: &mut Senses) -> Option<Vec3> {
        let tries = |place: &Vec3| {
            let same = self.tried.iter().filter(|tried| tried.distance(*place) < SAME_MM);
            same.count()
        };
        let to_close = |place: &Vec3| place.z >= self.spared_below && tries(place) < TRIES;
        let untried = senses.bleeders().into_iter().filter(to_close);
        untried.min_by(|a, b| a.distance(to).total_cmp(&b.distance(to)))
    }

    fn seek(&mut self, bleeder: Vec3) -> Doing {
        self.tried.push(bleeder);
        self.searches = 0;
        Doing::Seek(bleeder)
    }

    /// The place that a search looks at after so many others, and which way it is out: along the beds of the strokes before
    /// this one, the last first; in the end along beds of all of them, evenly chosen.
    fn searched_place(&self, behind: usize) -> Option<(Vec3, Vec3)> {
        let (strokes, every) = match self.last_look {
            Some(_) => (self.next, self.next.div_ceil(LAST_LOOK_STROKES).max(1)),
            None => (SEARCHED_STROKES * 3_usize.pow(self.searches.saturating_sub(1)), 1),
        };
        let last = self.strokes[..self.next].iter().rev().take(strokes).step_by(every);
        let mut places = last.enumerate().flat_map(|(number, (_, stroke))| {
            let outwards = towards(stroke.hour).extend(0.0).as_vec3();
            let mut along: Vec<Vec3> = (stroke.way.iter().rev().step_by(SEARCH_STEP_MM))
                .map(|place| place.as_vec3())
                .collect();
            // Up one bed and down the next is half the way.
            if number % 2 == 1 {
                along.reverse();
            }
            along.into_iter().map(move |place| (place, outwards))
        });
        places.nth(behind)
    }

    /// Taps as the water asks for: clear water through both, little inflow while the view is clear, none while the bladder presses. They stay
    /// while the loop is on its way to something or at it: the water's pressure moves the tissue.
    fn turn_taps(&mut self, next: InstrumentState, senses: &mut Senses) -> InstrumentState {
        let (inflow_tap, outflow_tap) = if !self.manner.minds_water {
            (1.0, 1.0)
        } else {
            let pressure = senses.pressure_cmh2o();
            self.is_inflow_shut = pressure > HIGH_CMH2O || (self.is_inflow_shut && pressure > LOW_CMH2O);
            let is_flushing = matches!(self.doing, Doing::Flush(_));
            let is_aiming = matches!(
                self.doing,
                Doing::Extend | Doing::Lower | Doing::Pull(_) | Doing::Seek(_) | Doing::Press(..)
            );
            let inflow = match senses.visibility() {
                _ if self.is_inflow_shut => 0.0,
                _ if is_aiming => next.inflow_tap,
                visibility if visibility > 0.8 && !is_flushing => 0.4,
                _ => 1.0,
            };
            (inflow, 1.0)
        };
        InstrumentState {
            inflow_tap,
            outflow_tap,
            ..next
        }
    }
}

/// Moves every instrument that a player sits at.
pub(super) fn play(
    time: Res<Time>,
    state: Res<RunState>,
    mut senses: Senses,
    mut players: Query<(
        &mut Play,
        &Resectoscope,
        &InstrumentState,
        Option<&LoopClearance>,
        &mut InstrumentRequest,
        &mut InstrumentPlayback,
    )>,
) {
    if *state != RunState::Running {
        return;
    }
    for (mut play, scope, now, clearance, mut request, mut playback) in &mut players {
        request.0 = play.step(now, scope, clearance, &mut senses, time.delta_secs());
        playback.over = play.doing == Doing::Done;
    }
}
