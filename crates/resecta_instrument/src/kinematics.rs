//! The resectoscope and its forward kinematics: from an [`InstrumentState`] to poses in the world.
//!
//! The sheath passes through one fixed point, the pivot, where the patient's body holds it. A state turns the sheath about
//! the pivot and slides it along its own axis; nothing else can move.

use bevy::prelude::*;
use thiserror::Error;

use crate::{
    InstrumentLimits, InstrumentPlayback, InstrumentRequest, InstrumentSource, InstrumentState, ResectoscopeGeometry,
    TissueLoad,
};
use resecta_tissue::TissueTool;

/// Why a [`Resectoscope`] was refused.
#[derive(Error, Debug, Clone, Copy, PartialEq)]
pub enum ResectoscopeError {
    /// The pivot is NaN or infinite.
    #[error("pivot is {0}, expected finite coordinates")]
    Pivot(Vec3),
    /// The axis has no direction.
    #[error("axis is {0}, expected a finite vector that is not zero")]
    Axis(Vec3),
    /// The up vector has no direction across the axis.
    #[error("up is {up}, expected a finite vector that is not parallel to the axis {axis}")]
    Up {
        /// The vector given.
        up: Vec3,
        /// The instrument's axis.
        axis: Vec3,
    },
}

/// A resectoscope held by a pivot. Inserting or changing it places the instrument anew: no tissue is swept on the way.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component)]
#[require(
    InstrumentState,
    InstrumentRequest,
    InstrumentSource,
    InstrumentPlayback,
    TissueLoad,
    TissueTool,
    Transform
)]
pub struct Resectoscope {
    pivot: Vec3,
    frame: Quat,
    /// Range and fastest change of every field.
    pub limits: InstrumentLimits,
    /// Measures of the instrument.
    pub geometry: ResectoscopeGeometry,
    /// Above this force on a patch of the sheath, a diameter long, tissue holds it, N; above 0. What is right depends on the tissue's modulus:
    /// the default suits one of 4.6 kPa.
    pub holds_n: f32,
}

/// The loop in the world, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopPose {
    /// Middle of the loop's open side.
    pub centre: Vec3,
    /// Unit normal of the loop's plane, in the direction of the pull (towards the operator).
    pub travel: Vec3,
    /// Unit vector from the open side towards the deepest point.
    pub down: Vec3,
}

impl Resectoscope {
    /// A resectoscope of default limits and geometry.
    ///
    /// `pivot` (mm) is the point that the sheath always passes through, `axis` its direction at pitch and yaw 0, towards
    /// the bladder, and `up` the direction of anterior; neither needs unit length, and `up` is made perpendicular.
    ///
    /// # Errors
    /// [`ResectoscopeError`] names the vector that is not finite or has no direction.
    pub fn new(pivot: Vec3, axis: Vec3, up: Vec3) -> Result<Self, ResectoscopeError> {
        if !pivot.is_finite() {
            return Err(ResectoscopeError::Pivot(pivot));
        }
        let forward = axis.try_normalize().ok_or(ResectoscopeError::Axis(axis))?;
        // Within half a degree of the axis the rounding of `up` would decide where anterior is.
        let right = up
            .try_normalize()
            .map(|up| forward.cross(up))
            .filter(|right| right.length() > 0.01)
            .and_then(Vec3::try_normalize)
            .ok_or(ResectoscopeError::Up { up, axis })?;
        let frame = Quat::from_mat3(&Mat3::from_cols(right, right.cross(forward), -forward)).normalize();
        Ok(Resectoscope {
            pivot,
            frame,
            limits: InstrumentLimits::default(),
            geometry: ResectoscopeGeometry::default(),
            holds_n: 0.5,
        })
    }

    /// The point that the sheath always passes through, mm.
    pub fn pivot(&self) -> Vec3 {
        self.pivot
    }

    /// The sheath's direction at pitch and yaw 0, towards the bladder.
    pub fn axis(&self) -> Vec3 {
        self.frame * Vec3::NEG_Z
    }

    /// The direction of anterior, perpendicular to the axis.
    pub fn up(&self) -> Vec3 {
        self.frame * Vec3::Y
    }

    /// The sheath's pose: translation to its tip, rotation from the local frame (`-Z` forward, `+Y` up) to the world.
    ///
    /// The state is taken as it is; [`InstrumentLimits::advance`] makes it fit.
    pub fn sheath_pose(&self, state: &InstrumentState) -> Isometry3d {
        let rotation = self.frame
            * Quat::from_rotation_y(-state.yaw_deg.to_radians())
            * Quat::from_rotation_x(state.pitch_deg.to_radians())
            * Quat::from_rotation_z(-state.roll_deg.to_radians());
        Isometry3d::new(self.pivot + rotation * Vec3::NEG_Z * state.insertion_mm, rotation)
    }

    /// The middle of the sheath's tip, mm.
    pub fn tip(&self, state: &InstrumentState) -> Vec3 {
        self.sheath_pose(state).translation.into()
    }

    /// The pitch and the yaw of a sheath that points in a direction, degrees; those of the axis for none.
    pub fn turned_to(&self, ahead: Vec3) -> [f32; 2] {
        let ahead = self.frame.inverse() * ahead.normalize_or(self.axis());
        let pitch = ahead.y.clamp(-1.0, 1.0).asin();
        let yaw = ahead.x.atan2(-ahead.z);
        [pitch.to_degrees(), yaw.to_degrees()]
    }

    /// The loop's pose.
    pub fn loop_pose(&self, state: &InstrumentState) -> LoopPose {
        let sheath = self.sheath_pose(state);
        LoopPose {
            centre: sheath * self.geometry.loop_centre(state.stroke_mm),
            travel: sheath.rotation * Vec3::Z,
            down: sheath.rotation * Vec3::NEG_Y,
        }
    }

    /// The way from the loop's wire to the nearest of some places (mm), mm: right, up and back as the sheath is held. None without
    /// places.
    pub fn way_from_wire(&self, state: &InstrumentState, places: impl Iterator<Item = Vec3>) -> Option<Vec3> {
        let from_sheath = self.sheath_pose(state).inverse();
        let wire = &self.geometry.loop_wire(state.stroke_mm);
        let ways = places.flat_map(|place| {
            let place = from_sheath * place;
            wire.iter().map(move |point| place - *point)
        });
        ways.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
    }

    /// The lens's pose as a Bevy camera's: translation to the lens, `-Z` the direction of view (inclined towards the loop),
    /// `+Y` the top of the picture.
    pub fn lens_pose(&self, state: &InstrumentState) -> Isometry3d {
        let lens = Isometry3d::new(
            Vec3::Y * self.geometry.telescope_offset_mm,
            Quat::from_rotation_x(-self.geometry.lens_deg.to_radians()),
        );
        self.sheath_pose(state) * lens
    }
    /// Whether a place lies within the round field of view and neither sheath nor beak hides it. What else may be between is for
    /// others to say.
    pub fn has_in_field(&self, state: &InstrumentState, place: Vec3) -> bool {
        let lens = self.lens_pose(state);
        let way = place - Vec3::from(lens.translation);
        let half = (0.5 * self.geometry.field_of_view_deg).to_radians();
        let ahead = lens.rotation * Vec3::NEG_Z;
        ahead.dot(way.normalize_or_zero()) > half.cos()
            && !self.geometry.hides(self.sheath_pose(state).rotation.inverse() * way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_field_is_a_cone_about_the_view() {
        let scope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).expect("a direction and another across it");
        let state = InstrumentState {
            insertion_mm: 20.0,
            ..default()
        };
        let lens = scope.lens_pose(&state);
        let at = |deg: f32, far: f32| {
            let (sin, cos) = deg.to_radians().sin_cos();
            scope.has_in_field(&state, lens * (far * Vec3::new(sin, 0.0, -cos)))
        };
        assert!(at(0.0, 10.0) && at(37.0, 10.0) && at(37.0, 44.0));
        assert!(!at(38.0, 10.0) && !at(180.0, 10.0) && !at(0.0, 0.0));
        assert!(!scope.has_in_field(&state, Vec3::NAN));
    }

    #[test]
    fn the_way_from_the_wire_is_that_to_the_nearest_place_as_the_sheath_is_held() {
        let scope = Resectoscope::new(Vec3::ZERO, Vec3::Z, Vec3::NEG_Y).expect("a direction and another across it");
        let state = InstrumentState {
            insertion_mm: 30.0,
            pitch_deg: -12.0,
            roll_deg: 40.0,
            stroke_mm: 10.0,
            ..default()
        };
        let wire = scope.geometry.loop_wire(state.stroke_mm);
        // Below its deepest point nothing of the wire is nearer.
        let deepest = wire[wire.len() / 2];
        let [near, far] = [-2.0, -9.0].map(|up| scope.sheath_pose(&state) * (deepest + Vec3::Y * up));
        let way = scope.way_from_wire(&state, [far, near].into_iter()).unwrap();
        assert!(way.abs_diff_eq(Vec3::Y * -2.0, 1e-4), "{way}");
        assert_eq!(scope.way_from_wire(&state, std::iter::empty()), None);
    }
}
