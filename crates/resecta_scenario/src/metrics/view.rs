//! How long tissue hid what the lens looks at.

use bevy::prelude::*;

use super::StepObservation;

/// What the lens saw so far.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub struct View {
    /// Time in which tissue less than 4 mm from it hid most of what it looks at, s.
    pub hidden_s: f64,
}

impl View {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        if step.is_hidden {
            self.hidden_s += step.step_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_counts_while_the_lens_is_hidden() {
        let mut view = View::default();
        for is_hidden in [false, true, true, false] {
            view.observe(&StepObservation {
                step_s: 0.25,
                is_hidden,
                ..StepObservation::default()
            });
        }
        assert_eq!(view.hidden_s, 0.5);
    }
}
