//! The visible mesh between two steps.
//!
//! A frame seldom comes just when a step ends. [`DrawnBetweenSteps`] keeps where the vertices of a tissue's mesh were after
//! the last two steps, and each frame draws them as far from the one towards the other as time has gone on since: motion is
//! even at any rate of frames, and shown one step late.

use bevy::{mesh::VertexAttributeValues, prelude::*};

/// Draws a tissue's mesh between its last two steps, by [`Time<Fixed>`]; without it the mesh is where the last step left the
/// tissue. Optional beside [`Tissue`](crate::Tissue); for a tissue that steps in the fixed schedules.
///
/// Normals and colours are those of the last step. Vertices that a cut made are drawn where they are.
#[derive(Component, Reflect, Debug, Clone, Default)]
#[reflect(Component, Default)]
pub struct DrawnBetweenSteps {
    #[reflect(ignore)]
    before: Vec<[f32; 3]>,
    #[reflect(ignore)]
    now: Vec<[f32; 3]>,
    /// Whether the last step moved nothing.
    is_still: bool,
    /// The share that was drawn last; none since a step.
    drawn: Option<f32>,
}

/// Vertices of a mesh that were not there, or were others, before the step.
pub(crate) enum Fresh {
    All,
    /// By number.
    Some(Vec<u32>),
}

impl DrawnBetweenSteps {
    /// Takes down where a step left the vertices.
    pub(crate) fn step(&mut self, mesh: &Mesh, fresh: &Fresh) {
        let Some(VertexAttributeValues::Float32x3(places)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
            return;
        };
        (self.is_still, self.drawn) = (false, None);
        std::mem::swap(&mut self.before, &mut self.now);
        self.now.clone_from(places);
        match fresh {
            Fresh::All => self.before.clone_from(places),
            Fresh::Some(fresh) => {
                let known = self.before.len().min(places.len());
                self.before.truncate(known);
                self.before.extend_from_slice(&places[known..]);
                for &number in fresh {
                    if let (Some(before), Some(now)) =
                        (self.before.get_mut(number as usize), self.now.get(number as usize))
                    {
                        *before = *now;
                    }
                }
            }
        }
    }

    /// Takes down that a step moved nothing.
    pub(crate) fn rest(&mut self) {
        if !self.is_still {
            self.before.clone_from(&self.now);
            (self.is_still, self.drawn) = (true, None);
        }
    }
}

/// Whether there is one, and meshes.
pub(crate) fn any(tissues: Query<(), With<DrawnBetweenSteps>>, meshes: Option<Res<Assets<Mesh>>>) -> bool {
    meshes.is_some() && !tissues.is_empty()
}

/// Puts the vertices where they are at the time of the frame.
pub(crate) fn draw_between_steps(
    time: Res<Time<Fixed>>,
    mut tissues: Query<(&mut DrawnBetweenSteps, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let share = time.overstep_fraction().clamp(0.0, 1.0);
    for (mut between, handle) in &mut tissues {
        let is_drawn = between.drawn == Some(share) || between.is_still && between.drawn.is_some();
        if is_drawn || between.now.is_empty() {
            continue;
        }
        let Some(mut mesh) = meshes.get_mut(&handle.0) else {
            continue;
        };
        if let Some(VertexAttributeValues::Float32x3(places)) = mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION) {
            for ((place, before), now) in places.iter_mut().zip(&between.before).zip(&between.now) {
                *place = std::array::from_fn(|axis| before[axis] + share * (now[axis] - before[axis]));
            }
        }
        between.drawn = Some(share);
    }
}
