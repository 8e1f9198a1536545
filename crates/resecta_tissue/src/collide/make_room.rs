//! Room for a tool that is in the tissue from the beginning.
//!
//! A tool that appears inside tissue has nodes on all sides of its axis, and their positions do not show in which direction each should
//! move. Pushed along the gradient, elements turn inside out and nodes may end up a centimetre away. So the tool starts in a shape and
//! place where tissue can give way, and changes from there to its own.

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
    /// Moves the tissue out of the way of a tool that changes from each shape to the next, in one step of the given length each. A shape is a
    /// list of parts in world coordinates, mm; all shapes have the same number of parts. Nothing is cut, and no message is written. With fewer
    /// than two shapes it does nothing.
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
            let modulus_pa = self.solver.spring_modulus_pa();
            let contacts: Vec<Contact> = found
                .iter()
                .map(|found| found.contact(&parts[found.part as usize], modulus_pa))
                .collect();
            self.solver.advance(step.as_secs_f64(), &contacts)?;
            before.renew(&found, self.solver.touches());
        }
        Ok(())
    }
}
