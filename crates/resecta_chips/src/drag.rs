//! How water holds a chip back, and what weight it leaves it.
//!
//! ```text
//! (m + ma) dv/dt = (m - rho V) g + c (3 pi mu d) f(Re) (u - v)
//! f(Re) = 1 + 0.15 Re^0.687          Re <= 1000      Schiller and Naumann (1935)
//!         0.44 Re / 24               Re > 1000       Newton
//! Re = rho d |u - v| / mu            d: diameter of the sphere of the same volume V
//! ma = rho V / 2                     added mass of a sphere
//! I dw/dt = - c pi mu d^3 w          a turning sphere, Stokes
//! ```
//!
//! `u` is the water's velocity, c [`ChipSettings::drag_of_sphere`](crate::ChipSettings). A step takes f from its beginning and
//! solves the rest exactly for the velocity at its end (backward Euler), so that no drag is too strong for it and the velocity
//! that it settles at is that of the law. What accelerating water does to a chip beyond its drag is left out.

use std::f32::consts::PI;

use bevy::math::Vec3;

/// Above, drag grows with the square of the velocity.
const NEWTON_REYNOLDS: f32 = 1000.0;

/// Acceleration of gravity, mm/s².
pub const GRAVITY_MM_PER_S2: f32 = 9810.0;

/// The way down: the patient lies on the back, posterior (`+y`) is below.
pub const DOWN: Vec3 = Vec3::Y;

/// Water: g/mm³ and g/(mm s), which is Pa s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// g/mm³.
    pub density: f32,
    /// Pa s.
    pub viscosity: f32,
    /// Drag as a multiple of a sphere's.
    pub drag_of_sphere: f32,
}

/// What a chip is to the water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Float {
    /// Mass, g.
    pub mass: f32,
    /// Volume, mm³.
    pub volume: f32,
}

impl Float {
    /// Diameter of the sphere of the same volume, mm.
    pub fn diameter(&self) -> f32 {
        (6.0 / PI * self.volume).cbrt()
    }
}

impl Water {
    /// Mass that moves with a chip, its own and the water's, g.
    pub fn moved_mass(&self, float: &Float) -> f32 {
        float.mass + 0.5 * self.density * float.volume
    }

    /// Weight that buoyancy leaves, µN; negative for what rises.
    pub fn weight(&self, float: &Float) -> f32 {
        (float.mass - self.density * float.volume) * GRAVITY_MM_PER_S2
    }

    /// Force for each mm/s of velocity against the water, g/s, at a velocity against it.
    pub fn resistance(&self, float: &Float, speed: f32) -> f32 {
        let diameter = float.diameter();
        let reynolds = self.density * diameter * speed / self.viscosity;
        let correction = if reynolds <= NEWTON_REYNOLDS {
            1.0 + 0.15 * reynolds.powf(0.687)
        } else {
            0.44 / 24.0 * reynolds
        };
        self.drag_of_sphere * 3.0 * PI * self.viscosity * diameter * correction
    }

    /// The velocity at the end of a step, mm/s.
    pub fn velocity(&self, float: &Float, velocity: Vec3, flow: Vec3, seconds: f32) -> Vec3 {
        let mass = self.moved_mass(float);
        let rate = self.resistance(float, velocity.distance(flow)) / mass;
        let gained = DOWN * (self.weight(float) / mass) + flow * rate;
        (velocity + gained * seconds) / (1.0 + rate * seconds)
    }

    /// How fast water stops a turn, 1/s, of a chip with this inertia, g mm².
    pub fn turn_rate(&self, float: &Float, inertia: f32) -> f32 {
        self.drag_of_sphere * PI * self.viscosity * float.diameter().powi(3) / inertia
    }
}
