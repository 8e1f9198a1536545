//! Room for a tool that is in the tissue from the beginning.
//!
//! A tool that appears inside of tissue finds nodes on all sides of its axis, and which way each should go cannot be told from where
//! it lies: pushed each its own way, they turn elements inside out and may come to lie a centimetre away. So the tissue is led there: along a way on which the tool is where tissue can give way from the start.

use std::time::Duration;

use bevy::prelude::*;
use resecta_solver::{Contact, StepError};

use super::{
    find,
    search::Before,
    sweep::{PartSweep, ToolMotion},
};
use crate::{
    components::Tissue,
    tool::{TissueTool, ToolPart, ToolPlacement},
};

impl Tissue {
    /// Moves the tissue out of the way of a tool that goes from shape to shape, a step each of that length; parts in the world, mm. All
    /// shapes have as many parts. Nothing is told and nothing cut. Without two shapes nothing is done.
    ///
    /// # Errors
    /// What [`resecta_solver::Tissue::advance`] refuses; the tissue is then where it was before that step.
    pub fn make_room(&mut self, shapes: &[Vec<ToolPart>], step: Duration) -> Result<(), StepError> {
        let mut before = Before::default();
        for pair in shapes.windows(2) {
            let mut tool = TissueTool::new(pair[1].clone(), Isometry3d::IDENTITY);
            tool.previous = Some(ToolPlacement {
                parts: pair[0].clone(),
                ..default()
            });
            let motion = ToolMotion::new(Entity::PLACEHOLDER, &tool);
            let parts: Vec<PartSweep> = motion.parts().collect();
            let mut found = Vec::new();
            find(
                self,
                (std::slice::from_ref(&motion), &before),
                |_, _| true,
                step.as_secs_f32(),
                &mut found,
            );
            let contacts: Vec<Contact> = found
                .iter()
                .map(|found| found.contact(&parts[found.part as usize]))
                .collect();
            self.solver.advance(step.as_secs_f64(), &contacts)?;
            before.clear();
            for (found, touch) in found.iter().zip(self.solver.touches()) {
                before.add(found, &touch);
            }
        }
        Ok(())
    }
}
