//! Arithmetic on eight places at a time, by component: plain loops, which the compiler makes vector instructions of. (It
//! does not of `array::map` and `array::from_fn`.)

use glam::Vec3;

use crate::sublattice::{LANES, Lanes};

#[inline(always)]
pub fn map(a: &Lanes, f: impl Fn(f32) -> f32) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        out[l] = f(a[l]);
    }
    out
}

#[inline(always)]
pub fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        out[l] = a[0][l] * b[0][l] + a[1][l] * b[1][l] + a[2][l] * b[2][l];
    }
    out
}

/// With one and the same vector.
#[inline(always)]
pub fn dot_one(a: &[Lanes; 3], b: Vec3) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        out[l] = a[0][l] * b.x + a[1][l] * b.y + a[2][l] * b.z;
    }
    out
}

/// `a + b * s`.
#[inline(always)]
pub fn add_scaled(a: &[Lanes; 3], b: &[Lanes; 3], s: &Lanes) -> [Lanes; 3] {
    let mut out = [[0.0; LANES]; 3];
    for n in 0..3 {
        for l in 0..LANES {
            out[n][l] = a[n][l] + b[n][l] * s[l];
        }
    }
    out
}

/// `a + b * s` with one `b`.
#[inline(always)]
pub fn add_one_scaled(a: &[Lanes; 3], b: Vec3, s: &Lanes) -> [Lanes; 3] {
    let mut out = [[0.0; LANES]; 3];
    for n in 0..3 {
        for l in 0..LANES {
            out[n][l] = a[n][l] + b[n] * s[l];
        }
    }
    out
}

#[inline(always)]
pub fn cross(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    let mut out = [[0.0; LANES]; 3];
    for (n, out) in out.iter_mut().enumerate() {
        let (i, j) = ((n + 1) % 3, (n + 2) % 3);
        for l in 0..LANES {
            out[l] = a[i][l] * b[j][l] - a[j][l] * b[i][l];
        }
    }
    out
}

/// Of unit length; what is shorter than all single precision tells stays short.
#[inline(always)]
pub fn normalized(a: &[Lanes; 3]) -> [Lanes; 3] {
    let squares = dot(a, a);
    let mut out = [[0.0; LANES]; 3];
    for l in 0..LANES {
        let scale = 1.0 / squares[l].max(f32::MIN_POSITIVE).sqrt();
        out[0][l] = a[0][l] * scale;
        out[1][l] = a[1][l] * scale;
        out[2][l] = a[2][l] * scale;
    }
    out
}

/// Of unit length; zero where it is shorter than single precision tells.
#[inline(always)]
pub fn normalized_or_zero(a: &[Lanes; 3]) -> [Lanes; 3] {
    let squares = dot(a, a);
    let mut out = [[0.0; LANES]; 3];
    for l in 0..LANES {
        let is_long = f32::from(u8::from(squares[l] > f32::MIN_POSITIVE));
        let scale = is_long / squares[l].max(f32::MIN_POSITIVE).sqrt();
        out[0][l] = a[0][l] * scale;
        out[1][l] = a[1][l] * scale;
        out[2][l] = a[2][l] * scale;
    }
    out
}
