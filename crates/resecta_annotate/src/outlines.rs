//! Outlines in somebody's hands: what was found in a stack, mended slice by slice, with every step to be undone.

use glam::DVec2;
use resecta_anatomy::{Case, CaseRuleError, CaseSource, Contour, contour};

use crate::annotate::volume_ml;
use crate::history::{History, Part, Step};
use crate::landmarks::{LANDMARKS, landmarks};
use crate::outline::{Origin, Outline, noted};
use crate::outlined_case::{Beside, CaseSlice, case_of, is_drawn};
use crate::{AnnotateError, Annotation, Gland, Model, Stack, Zone, annotate_slice};

/// Landmarks to either side that follow one that is dragged, less and less.
const FOLLOWING: usize = 4;

/// The outlines of a stack, one or none an image, and the way back.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outlines {
    images: Vec<Drawing>,
    /// What the case that was opened says beside its slices.
    beside: Beside,
    history: History,
}

/// What is drawn on an image.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Drawing {
    outline: Option<Outline>,
    /// Where the urethra passes, mm, where somebody knows.
    urethra: Option<DVec2>,
    /// Its lumen and the transition zone, mm, where the case that was opened has them drawn.
    lumen: Option<Contour>,
    transition_zone: Option<Contour>,
}

impl Outlines {
    /// None yet.
    pub fn none(stack: &Stack) -> Outlines {
        Outlines {
            images: vec![Drawing::default(); stack.slices().len()],
            ..Outlines::default()
        }
    }

    /// What was found in the stack.
    pub fn found(stack: &Stack, annotation: Annotation) -> Outlines {
        let mut outlines = Outlines::none(stack);
        for slice in annotation.slices {
            if let Some(place) = outlines.images.get_mut(slice.image) {
                place.outline = Some(slice.into());
            }
        }
        outlines
    }

    /// Those of a case made from the stack before: each goes to the image nearest in height. What else is drawn in the case
    /// (transition zone, lumen, landmarks) is kept as it is. Also how many outlines of the case no image is near to; these are
    /// left out.
    pub fn of_case(stack: &Stack, case: &Case) -> (Outlines, usize) {
        let mut outlines = Outlines::none(stack);
        outlines.beside = Beside::of(case);
        let mut left_out = 0;
        for (index, slice) in case.slices.iter().enumerate() {
            let place = stack.image_at(slice.z).filter(|image| outlines.of(*image).is_none());
            match (place, landmarks(&slice.capsule)) {
                (Some(image), Some(capsule)) => {
                    let drawn = |what: &str, contour: &Option<Contour>| {
                        let is_drawn = is_drawn(case, &format!("slices[{index}].{what}"));
                        contour.clone().filter(|_| is_drawn)
                    };
                    let lumen = drawn("urethra", &slice.urethra);
                    outlines.images[image] = Drawing {
                        outline: Some(noted(case, index, capsule)),
                        urethra: lumen.as_deref().map(contour::centroid),
                        lumen,
                        transition_zone: drawn("transition_zone", &slice.transition_zone),
                    };
                }
                _ => left_out += 1,
            }
        }
        (outlines, left_out)
    }

    /// The outline of an image.
    pub fn of(&self, image: usize) -> Option<&Outline> {
        self.images.get(image)?.outline.as_ref()
    }

    /// Images with an outline, by rising height.
    pub fn outlined(&self) -> impl DoubleEndedIterator<Item = (usize, &Outline)> {
        let all = self.images.iter().enumerate();
        all.filter_map(|(image, drawing)| Some((image, drawing.outline.as_ref()?)))
    }

    /// The zone of an image by where it lies between the lowest and the highest outline.
    pub fn zone(&self, image: usize) -> Zone {
        let mut all = self.outlined().map(|(image, _)| image);
        let first = all.next().unwrap_or(image);
        let last = all.next_back().unwrap_or(first);
        Zone::at((image as f64 - first as f64 + 0.5) / (last - first + 1) as f64)
    }

    /// Puts an outline on an image, or takes it away, as one step. `joined` makes it part of the step before if that was on
    /// the same image: a drag is one step.
    pub fn set(&mut self, image: usize, outline: Option<Outline>, joined: bool) {
        let Some(drawing) = self.images.get(image).cloned() else {
            return;
        };
        self.draw(image, Drawing { outline, ..drawing }, joined);
    }

    /// Where the urethra passes in an image, mm, where somebody marked it.
    pub fn urethra(&self, image: usize) -> Option<DVec2> {
        self.images.get(image)?.urethra
    }

    /// Marks where the urethra passes in an image, mm, or takes the mark away. Between marks it runs straight; without any it
    /// is put in by rule. Whether it was taken: a place outside the image's outline is not.
    pub fn mark_urethra(&mut self, image: usize, place: Option<DVec2>) -> bool {
        let Some(outline) = self.of(image) else {
            return false;
        };
        if place.is_some_and(|place| !contour::contains(&outline.capsule, place)) {
            return false;
        }
        let drawing = Drawing {
            urethra: place,
            lumen: None,
            ..self.images[image].clone()
        };
        self.draw(image, drawing, false);
        true
    }

    fn draw(&mut self, image: usize, drawing: Drawing, joined: bool) {
        let step = Step {
            part: Part::Image(image),
            drawings: vec![(image, drawing)],
        };
        self.history.take(&mut self.images, step, joined);
    }

    /// Moves a landmark to a place, mm, and its neighbours with it, less the farther they are. A place that is no number
    /// does nothing.
    pub fn drag(&mut self, image: usize, landmark: usize, to: DVec2, joined: bool) {
        self.mend(image, joined, |capsule| {
            let by = to - *capsule.get(landmark)?;
            let count = capsule.len();
            for away in -(FOLLOWING as isize)..=FOLLOWING as isize {
                let share = 0.5 + 0.5 * (std::f64::consts::PI * away as f64 / (FOLLOWING + 1) as f64).cos();
                let neighbour = (landmark as isize + away).rem_euclid(count as isize) as usize;
                capsule[neighbour] += share * by;
            }
            Some(())
        });
    }

    /// Moves the whole outline, mm.
    pub fn shift(&mut self, image: usize, by: DVec2, joined: bool) {
        self.mend(image, joined, |capsule| {
            capsule.iter_mut().for_each(|place| *place += by);
            Some(())
        });
    }

    /// Makes the whole outline larger about its middle.
    pub fn scale(&mut self, image: usize, factor: f64, joined: bool) {
        self.mend(image, joined, |capsule| {
            let middle = capsule.iter().sum::<DVec2>() / capsule.len() as f64;
            capsule
                .iter_mut()
                .for_each(|place| *place = middle + factor * (*place - middle));
            Some(())
        });
    }

    /// Adds to the weight of a mode of the section model, in its standard deviations. What the model cannot say of the
    /// outline stays as it is.
    pub fn nudge(&mut self, image: usize, model: &Model, mode: usize, by: f64, joined: bool) {
        // Where the image lies shifts the pose, not what a mode does.
        let centre = DVec2::ZERO;
        self.mend(image, joined, |capsule| {
            let section = &model.section;
            let mut weights = section.weights_of(capsule, centre);
            let before = section.at(&weights, centre);
            *weights.get_mut(crate::section::SECTION_POSE + mode)? += by;
            for (place, (before, after)) in capsule.iter_mut().zip(before.iter().zip(section.at(&weights, centre))) {
                *place += after - *before;
            }
            Some(())
        });
    }

    /// How far the outlines together are along each mode of the whole gland's model, in standard deviations from -3 to 3; none
    /// where fewer than three images have one.
    pub fn gland_weights(&self, stack: &Stack, model: &Model) -> Option<Vec<f64>> {
        model.gland.plane_weights(&self.gland(stack)?)
    }

    /// Adds to the weight of a mode of the whole gland's model, in its standard deviations: the outline of every image changes
    /// as the gland does at its height. What the model cannot say of them stays as it is, and so do the gland's ends: how much
    /// longer a mode makes it is left out. Nothing happens where there is no such mode, or fewer than three outlines. Those that
    /// are flagged stay so: nobody has looked at each.
    pub fn nudge_gland(&mut self, stack: &Stack, model: &Model, mode: usize, by: f64, joined: bool) {
        let Some(gland) = self.gland(stack) else { return };
        let Some(shaped) = model.gland.shaped(&gland, mode, by) else {
            return;
        };
        let mut drawings = Vec::new();
        for (image, outline) in self.outlined() {
            let share = gland.share_of(stack.slices()[image].z_mm).clamp(0.0, 1.0);
            let (before, after) = (gland.at_share(share), shaped.at_share(share));
            let places = outline.capsule.iter().zip(before.iter().zip(&after));
            let capsule: Vec<DVec2> = places
                .map(|(place, (before, after))| *place + *after - *before)
                .collect();
            if !capsule.iter().all(|place| place.is_finite()) {
                return;
            }
            let mended = Outline {
                capsule,
                origin: match outline.flags.is_empty() {
                    true => Origin::Drawn,
                    false => outline.origin,
                },
                flags: outline.flags.clone(),
            };
            let drawing = Drawing {
                outline: Some(mended),
                ..self.images[image].clone()
            };
            drawings.push((image, drawing));
        }
        let part = Part::Gland;
        self.history.take(&mut self.images, Step { part, drawings }, joined);
    }

    fn gland(&self, stack: &Stack) -> Option<Gland> {
        let outlines = self.outlined().filter_map(|(image, outline)| {
            let z = stack.slices().get(image)?.z_mm;
            Some((z, outline.capsule.clone()))
        });
        Gland::of_outlines(&outlines.collect::<Vec<_>>())
    }

    /// Copies the outline of another image; nothing happens where that has none.
    pub fn copy(&mut self, image: usize, from: usize) {
        let Some(outline) = self.of(from) else { return };
        let copied = Outline {
            capsule: outline.capsule.clone(),
            origin: Origin::Copied { from },
            flags: Vec::new(),
        };
        self.set(image, Some(copied), false);
    }

    /// Takes the flags off an outline: somebody looked at it and found it right.
    pub fn accept(&mut self, image: usize) {
        let Some(outline) = self.of(image).filter(|outline| !outline.flags.is_empty()) else {
            return;
        };
        let accepted = Outline {
            flags: Vec::new(),
            ..outline.clone()
        };
        self.set(image, Some(accepted), false);
    }

    /// Searches one image anew from the outline it has, or from the mean section where it has none.
    ///
    /// # Errors
    ///
    /// [`AnnotateError::NoImage`].
    pub fn search(&self, image: usize, stack: &Stack, model: &Model, seed: u64) -> Result<Outline, AnnotateError> {
        let start = self.of(image).map(|outline| outline.capsule.as_slice());
        Ok(annotate_slice(stack, image, self.zone(image), start, model, seed)?.into())
    }

    /// How often something changed, by undoing, too: as long as it is the same, everything is.
    pub fn changes(&self) -> u64 {
        self.history.changes()
    }

    /// Whether there is a step to undo, and one to do again.
    pub fn steps(&self) -> [bool; 2] {
        self.history.steps()
    }

    /// Undoes the last step. What it was on.
    pub fn undo(&mut self) -> Option<Part> {
        self.history.undo(&mut self.images)
    }

    /// Does the step again that was undone last. What it is on.
    pub fn redo(&mut self) -> Option<Part> {
        self.history.redo(&mut self.images)
    }

    /// Volume within the outlines, ml.
    pub fn volume_ml(&self, stack: &Stack) -> f64 {
        volume_ml(self.outlined().map(|(image, outline)| {
            let z = stack.slices().get(image).map_or(0.0, |slice| slice.z_mm);
            (z, contour::signed_area(&outline.capsule).abs())
        }))
    }

    /// The case of the outlines: everything but the capsule, and what a case that was opened has drawn, by the rules of
    /// [`Case::complete`]. Where an outline was not drawn by anybody, [`Case::approximated`] says so, and where a transition zone is
    /// left out since it reaches beyond the capsule that was mended.
    ///
    /// # Errors
    ///
    /// The rule that the outlines break.
    pub fn to_case(&self, stack: &Stack, name: &str, source: CaseSource) -> Result<Case, CaseRuleError> {
        let slices = self.outlined().filter_map(|(image, outline)| {
            let z = stack.slices().get(image)?.z_mm;
            Some(CaseSlice {
                z_mm: z,
                capsule: &outline.capsule,
                rule: outline.rule(image),
                urethra: self.urethra(image),
                lumen: self.images[image].lumen.as_ref(),
                transition_zone: self.images[image].transition_zone.as_ref(),
            })
        });
        case_of(slices, &self.beside, stack, name, source)
    }

    /// Changes the outline of an image by hand; one that comes out with a place that is no number is not taken.
    fn mend(&mut self, image: usize, joined: bool, change: impl FnOnce(&mut Vec<DVec2>) -> Option<()>) {
        let Some(outline) = self.of(image) else { return };
        let mut capsule = outline.capsule.clone();
        let is_changed = change(&mut capsule).is_some() && capsule.len() == LANDMARKS;
        if !is_changed || !capsule.iter().all(|place| place.is_finite()) {
            return;
        }
        let mended = Outline {
            capsule,
            origin: Origin::Drawn,
            flags: Vec::new(),
        };
        self.set(image, Some(mended), joined);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Flag, Image, ImageSlice};

    fn stack() -> Stack {
        let image = || {
            let grey = (0..40 * 40).map(|pixel| (pixel % 7) as f32 / 7.0).collect();
            Image::new([40, 40], [1.0; 2], [-20.0; 2], grey).expect("an image")
        };
        let slices = (0..5).map(|index| ImageSlice {
            z_mm: 5.0 * f64::from(index),
            image: image(),
        });
        Stack::new(slices.collect()).expect("a stack")
    }

    fn ring(radius: f64) -> Outline {
        let corner =
            |index: usize| radius * DVec2::from_angle(std::f64::consts::TAU * (index as f64 / LANDMARKS as f64 - 0.25));
        Outline {
            capsule: (0..LANDMARKS).map(corner).collect(),
            origin: Origin::Found { error_mm: 1.25 },
            flags: vec![Flag::PoorFit],
        }
    }

    fn ringed() -> Outlines {
        let mut outlines = Outlines::none(&stack());
        for (image, radius) in [8.0, 12.0, 13.0, 12.0, 9.0].into_iter().enumerate() {
            outlines.images[image].outline = Some(ring(radius));
        }
        outlines
    }

    #[test]
    fn a_drag_takes_the_neighbours_along_and_is_undone_as_one_step() {
        let mut outlines = ringed();
        let before = outlines.clone();
        let at = outlines.of(2).unwrap().capsule[8];
        for step in 1..=10 {
            outlines.drag(2, 8, at + DVec2::X * 0.3 * f64::from(step), step > 1);
        }
        let dragged = outlines.of(2).unwrap();
        assert!((dragged.capsule[8] - at - DVec2::X * 3.0).length() < 1e-9);
        let moved = |landmark: usize| dragged.capsule[landmark].distance(before.of(2).unwrap().capsule[landmark]);
        assert!(moved(8) > moved(9) && moved(9) > moved(10) && moved(10) > moved(12) && moved(12) > 0.0);
        assert_eq!(moved(8 + FOLLOWING + 1), 0.0);
        assert_eq!((dragged.origin, dragged.flags.len()), (Origin::Drawn, 0));
        let after = outlines.images.clone();
        assert_eq!(outlines.undo(), Some(Part::Image(2)));
        assert_eq!((outlines.undo(), &outlines.images), (None, &before.images));
        assert_eq!((outlines.redo(), &outlines.images), (Some(Part::Image(2)), &after));
        outlines.undo();
        outlines.shift(1, DVec2::Y, false);
        assert_eq!(
            outlines.redo(),
            None,
            "what was undone is gone once something else was done"
        );
    }

    #[test]
    fn places_that_are_no_numbers_change_nothing() {
        let mut outlines = ringed();
        let before = outlines.clone();
        outlines.drag(2, 8, DVec2::new(f64::NAN, 0.0), false);
        outlines.drag(2, 99, DVec2::ZERO, false);
        outlines.scale(2, f64::INFINITY, false);
        outlines.shift(9, DVec2::X, false);
        outlines.copy(1, 9);
        assert_eq!(outlines, before);
    }

    #[test]
    fn sizes_scale_the_area_by_their_square() {
        let mut outlines = ringed();
        let area = |outlines: &Outlines| contour::signed_area(&outlines.of(2).unwrap().capsule);
        let before = area(&outlines);
        outlines.scale(2, 1.1, false);
        assert!((area(&outlines) / before - 1.21).abs() < 1e-9);
    }

    fn model() -> Model {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/models/prostate.pdm");
        Model::load(&file).expect("the shipped model")
    }

    #[test]
    fn a_mode_of_the_gland_changes_every_outline_by_what_it_says_and_is_one_step() {
        let (stack, model) = (stack(), model());
        let mut outlines = ringed();
        outlines.accept(1);
        let before = outlines.images.clone();
        let weights = outlines.gland_weights(&stack, &model).expect("five outlines");
        for part in 0..4 {
            outlines.nudge_gland(&stack, &model, 0, 0.25, part > 0);
        }
        let capsule =
            |images: &[Drawing], image: usize| images[image].outline.as_ref().map(|o| o.capsule.clone()).unwrap();
        for image in 0..5 {
            let (old, new) = (capsule(&before, image), capsule(&outlines.images, image));
            let moved = old.iter().zip(&new).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!((0.1..6.0).contains(&moved), "image {image}: {moved} mm");
        }
        let nudged = outlines.gland_weights(&stack, &model).expect("five outlines");
        assert!(
            (nudged[0] - weights[0] - 1.0).abs() < 0.1,
            "{} {}",
            weights[0],
            nudged[0]
        );
        for (mode, (before, after)) in weights.iter().zip(&nudged).enumerate().skip(1) {
            assert!((after - before).abs() < 0.3, "mode {mode}: {before} {after}");
        }
        let accepted = outlines.of(1).unwrap();
        assert_eq!((accepted.origin, accepted.flags.len()), (Origin::Drawn, 0));
        let flagged = outlines.of(2).unwrap();
        assert_eq!(
            (flagged.origin, flagged.flags.len()),
            (Origin::Found { error_mm: 1.25 }, 1)
        );

        let after = outlines.images.clone();
        assert_eq!((outlines.undo(), &outlines.images), (Some(Part::Gland), &before));
        assert_eq!((outlines.redo(), &outlines.images), (Some(Part::Gland), &after));
        // There and back again.
        for _ in 0..4 {
            outlines.nudge_gland(&stack, &model, 0, -0.25, false);
        }
        for image in 0..5 {
            let mean = crate::compare::mean_distance_mm(&capsule(&before, image), &capsule(&outlines.images, image));
            assert!(mean < 0.2, "image {image}: {mean} mm");
        }
    }

    #[test]
    fn a_mode_that_is_not_there_or_a_gland_of_two_outlines_changes_nothing() {
        let (stack, model) = (stack(), model());
        let mut outlines = ringed();
        let before = outlines.clone();
        outlines.nudge_gland(&stack, &model, 999, 1.0, false);
        outlines.nudge_gland(&stack, &model, 0, f64::NAN, false);
        assert_eq!(outlines, before);
        for image in 0..3 {
            outlines.set(image, None, false);
        }
        let before = outlines.clone();
        outlines.nudge_gland(&stack, &model, 0, 1.0, false);
        assert_eq!((&outlines, outlines.gland_weights(&stack, &model)), (&before, None));
    }

    #[test]
    fn a_case_tells_what_nobody_drew_and_comes_back_as_it_was_saved() {
        let mut outlines = ringed();
        outlines.drag(1, 0, DVec2::new(0.0, -14.0), false);
        outlines.copy(3, 2);
        let source = CaseSource {
            description: "test".into(),
            licence: "CC0-1.0".into(),
        };
        let case = outlines.to_case(&stack(), "rings", source).expect("a case");
        let rule = |slice: usize| {
            let what = format!("slices[{slice}].capsule");
            case.approximated
                .iter()
                .find(|note| note.what == what)
                .map(|note| note.rule.clone())
        };
        assert!(rule(0).is_some_and(|rule| rule.contains("1.2 mm") && rule.contains("poor fit")));
        assert_eq!(rule(1), None);
        assert!(rule(3).is_some_and(|rule| rule.contains("image 2")));
        let (back, left_out) = Outlines::of_case(&stack(), &case);
        assert_eq!(left_out, 0);
        for (image, outline) in outlines.outlined() {
            // To a tenth of a millimetre; of a copy only that it is to be looked at.
            let said = back.of(image).unwrap();
            let expected = match outline.origin {
                Origin::Found { .. } => (Origin::Found { error_mm: 1.2 }, 1),
                Origin::Copied { .. } => (Origin::Drawn, 1),
                Origin::Drawn => (Origin::Drawn, 0),
            };
            assert_eq!((said.origin, said.flags.len()), expected, "{image}");
            let mean = crate::compare::mean_distance_mm(&outline.capsule, &back.of(image).unwrap().capsule);
            assert!(mean < 0.05, "{image}: {mean}");
        }
        let volume = outlines.volume_ml(&stack());
        assert!((back.volume_ml(&stack()) / volume - 1.0).abs() < 0.01);
    }

    #[test]
    fn an_outline_that_was_looked_at_keeps_its_error_and_loses_its_flags() {
        let mut outlines = ringed();
        outlines.accept(2);
        let accepted = outlines.of(2).unwrap();
        assert_eq!(
            (accepted.origin, accepted.flags.len()),
            (Origin::Found { error_mm: 1.25 }, 0)
        );
        outlines.accept(2);
        outlines.undo();
        assert_eq!(
            (outlines.of(2).unwrap().flags.len(), outlines.steps()),
            (1, [false, true])
        );
    }

    #[test]
    fn a_marked_urethra_is_in_the_case_and_one_outside_is_not_taken() {
        let mut outlines = ringed();
        assert!(!outlines.mark_urethra(1, Some(DVec2::new(30.0, 0.0))));
        assert_eq!(outlines.urethra(1), None);
        let (low, high) = (DVec2::new(1.0, 2.0), DVec2::new(-1.0, -3.0));
        outlines.mark_urethra(1, Some(low));
        outlines.mark_urethra(3, Some(high));
        outlines.mark_urethra(4, Some(DVec2::ZERO));
        assert_eq!(outlines.undo(), Some(Part::Image(4)));
        let source = CaseSource {
            description: "test".into(),
            licence: "CC0-1.0".into(),
        };
        let case = outlines.to_case(&stack(), "marked", source).expect("a case");
        let centre = |slice: usize| contour::centroid(case.slices[slice].urethra.as_ref().unwrap());
        assert!(centre(1).distance(low) < 0.01 && centre(3).distance(high) < 0.01);
        assert!(
            centre(2).distance(0.5 * (low + high)) < 0.01,
            "straight between marks: {}",
            centre(2)
        );
        let (back, _) = Outlines::of_case(&stack(), &case);
        assert_eq!((back.urethra(2), back.urethra(1).is_some()), (None, true));
    }

    #[test]
    fn what_is_drawn_beside_the_outlines_of_a_case_that_is_opened_stays() {
        let source = CaseSource {
            description: "test".into(),
            licence: "CC0-1.0".into(),
        };
        let made = ringed().to_case(&stack(), "rings", source.clone()).expect("a case");
        let at = |radius: f64| -> Contour {
            let corners = (0..24).map(|corner| DVec2::from_angle(std::f64::consts::TAU * f64::from(corner) / 24.0));
            corners.map(|corner| radius * corner).collect()
        };
        let mut drawn = made.clone();
        for slice in &mut drawn.slices[1..4] {
            slice.transition_zone = Some(at(9.0));
        }
        drawn.slices[2].urethra = Some(at(2.5));
        let known = glam::DVec3::new(0.0, 3.0, 6.0);
        drawn.landmarks.verumontanum = Some(known);
        drawn.material = "some_other".into();
        drawn.approximated.retain(|note| {
            let is_known = ["slices[2].urethra", "landmarks.verumontanum"].contains(&note.what.as_str());
            !is_known && !note.what.ends_with(".transition_zone")
        });
        let (mut outlines, _) = Outlines::of_case(&stack(), &drawn);
        outlines.scale(2, 1.1, false);
        let saved = outlines.to_case(&stack(), "again", source.clone()).expect("a case");
        for slice in [1, 2, 3] {
            assert_eq!(saved.slices[slice].transition_zone, Some(at(9.0)));
        }
        assert_eq!(saved.slices[0].transition_zone, None, "left empty on purpose");
        assert_eq!(saved.slices[2].urethra, Some(at(2.5)));
        assert_eq!(saved.landmarks.verumontanum, Some(known));
        assert_eq!(saved.material, "some_other");
        let by_rule = |case: &Case, what: &str| case.approximated.iter().any(|note| note.what == what);
        assert!(!by_rule(&saved, "landmarks.verumontanum") && by_rule(&saved, "landmarks.bladder_neck"));

        // Beyond the capsule it would be no transition zone; a place that is marked is the urethra's from then on.
        outlines.scale(2, 0.5, false);
        outlines.mark_urethra(2, Some(DVec2::X));
        let saved = outlines.to_case(&stack(), "again", source).expect("a case");
        assert_eq!(saved.slices[2].transition_zone, None);
        assert!(by_rule(&saved, "slices[2].transition_zone") && !by_rule(&saved, "slices[1].transition_zone"));
        assert!(contour::centroid(saved.slices[2].urethra.as_ref().unwrap()).distance(DVec2::X) < 0.01);
    }

    #[test]
    fn too_few_outlines_are_no_case() {
        let mut outlines = ringed();
        for image in [0, 1, 2, 3] {
            outlines.set(image, None, false);
        }
        let source = CaseSource {
            description: "test".into(),
            licence: "CC0-1.0".into(),
        };
        assert!(outlines.to_case(&stack(), "few", source).is_err());
        assert_eq!(outlines.zone(4), Zone::Middle);
    }
}
