//! Arithmetic on eight places at a time, by component: loops that the compiler makes vector instructions of.

use glam::Vec3;

use crate::sublattice::{LANES, Lanes};

#[inline(always)]
pub fn map(a: &Lanes, f: impl Fn(f32) -> f32) -> Lanes {
    std::array::from_fn(|l| f(a[l]))
}

#[inline(always)]
pub fn map2(a: &Lanes, b: &Lanes, f: impl Fn(f32, f32) -> f32) -> Lanes {
    std::array::from_fn(|l| f(a[l], b[l]))
}

#[inline(always)]
pub fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    std::array::from_fn(|l| a[0][l] * b[0][l] + a[1][l] * b[1][l] + a[2][l] * b[2][l])
}

/// The same vector eight times.
#[inline(always)]
pub fn splat(v: Vec3) -> [Lanes; 3] {
    v.to_array().map(|component| [component; LANES])
}

/// `a + b * s`.
#[inline(always)]
pub fn add_scaled(a: &[Lanes; 3], b: &[Lanes; 3], s: &Lanes) -> [Lanes; 3] {
    std::array::from_fn(|n| std::array::from_fn(|l| a[n][l] + b[n][l] * s[l]))
}

#[inline(always)]
pub fn cross(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    std::array::from_fn(|n| {
        let (i, j) = ((n + 1) % 3, (n + 2) % 3);
        std::array::from_fn(|l| a[i][l] * b[j][l] - a[j][l] * b[i][l])
    })
}

/// Of unit length; what is shorter than all single precision tells stays as it is.
#[inline(always)]
pub fn normalized(a: &[Lanes; 3]) -> [Lanes; 3] {
    let scale = map(&dot(a, a), |square| 1.0 / square.max(f32::MIN_POSITIVE).sqrt());
    std::array::from_fn(|n| map2(&a[n], &scale, |a, scale| a * scale))
}
