//! Steps on what is drawn on the images of a stack, and the way back.

use crate::outlines::Drawing;

/// Most steps that can be undone.
const MAX_STEPS: usize = 500;

/// What a step was on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// One image, by index.
    Image(usize),
    /// All images with an outline.
    Gland,
}

/// What images get by a step. One that was taken holds what they had before it: either way it is done by exchanging.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    pub part: Part,
    /// By image.
    pub drawings: Vec<(usize, Drawing)>,
}

impl Step {
    fn exchange(mut self, images: &mut [Drawing]) -> Self {
        for (image, drawing) in &mut self.drawings {
            std::mem::swap(&mut images[*image], drawing);
        }
        self
    }
}

/// The steps that were taken, and those that were undone.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
    changes: u64,
}

impl History {
    /// Takes a step, as part of the one before if it is joined and that was on the same part.
    pub fn take(&mut self, images: &mut [Drawing], step: Step, joined: bool) {
        let is_part = joined && self.done.last().is_some_and(|before| before.part == step.part);
        let before = step.exchange(images);
        if !is_part {
            self.done.push(before);
            if self.done.len() > MAX_STEPS {
                self.done.remove(0);
            }
        }
        self.undone.clear();
        self.changes += 1;
    }

    /// Undoes the last step. What it was on.
    pub fn undo(&mut self, images: &mut [Drawing]) -> Option<Part> {
        let step = self.done.pop()?.exchange(images);
        self.changes += 1;
        let part = step.part;
        self.undone.push(step);
        Some(part)
    }

    /// Does the step again that was undone last. What it is on.
    pub fn redo(&mut self, images: &mut [Drawing]) -> Option<Part> {
        let step = self.undone.pop()?.exchange(images);
        self.changes += 1;
        let part = step.part;
        self.done.push(step);
        Some(part)
    }

    /// Whether there is a step to undo, and one to do again.
    pub fn steps(&self) -> [bool; 2] {
        [!self.done.is_empty(), !self.undone.is_empty()]
    }

    /// How often something changed, by undoing, too.
    pub fn changes(&self) -> u64 {
        self.changes
    }
}
