//! Chips: what has been cut away since a chip was begun, as a body of its own.
//!
//! Its value is `min(before, -after)`: positive where tissue was and is no more. The same extraction gives its surface,
//! and that its centre and inertia; its volume is what the pentahedra lost.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3, Vec3};

use crate::crossings::Sample;
use crate::field::Field;
use crate::moments::Moments;
use crate::surface::{NONE, Surface};
use crate::{FieldError, SurfaceKind};

/// Share of a chip's volume that its surface must enclose to stand for it.
const LEAST_ENCLOSED: f64 = 0.5;

/// What was there when the chip was begun, of all that has changed since.
#[derive(Debug, Clone, Default)]
pub struct Before {
    is_under_way: bool,
    /// Values by point; NaN where unchanged.
    values: Vec<f32>,
    /// The points that have one.
    points: Vec<u32>,
    /// Kept volume by pentahedron.
    kept: BTreeMap<u32, f64>,
}

impl Before {
    pub fn is_under_way(&self) -> bool {
        self.is_under_way
    }

    fn begin(&mut self) {
        self.end();
        self.is_under_way = true;
    }

    fn end(&mut self) {
        self.is_under_way = false;
        for point in self.points.drain(..) {
            self.values[point as usize] = f32::NAN;
        }
        self.kept.clear();
    }

    /// Forgets points that are no more; none may be remembered.
    pub fn trim(&mut self, points: usize) {
        if points < self.values.len() {
            self.values.truncate(points);
            self.values.shrink_to_fit();
        }
    }

    #[inline(always)]
    pub fn remember_point(&mut self, point: u32, value: f32) {
        if !self.is_under_way {
            return;
        }
        let index = point as usize;
        if index >= self.values.len() {
            self.values.resize(index + 1, f32::NAN);
        }
        if self.values[index].is_nan() {
            self.values[index] = value;
            self.points.push(point);
        }
    }

    pub fn remember_kept(&mut self, pentahedron: u32, kept_mm3: f64) {
        if self.is_under_way {
            self.kept.entry(pentahedron).or_insert(kept_mm3);
        }
    }

    /// The value that a point had, if it has changed.
    #[inline(always)]
    fn value(&self, point: u32) -> Option<f32> {
        self.values.get(point as usize).copied().filter(|value| !value.is_nan())
    }

    pub fn bytes(&self) -> usize {
        4 * (self.values.capacity() + self.points.capacity()) + self.kept.len() * size_of::<(u32, f64)>()
    }
}

/// A body that was cut out.
#[derive(Debug, Clone, PartialEq)]
pub struct Chip {
    /// Where its vertices are, mm, with the nodes where they were when it was taken.
    pub vertices: Vec<Vec3>,
    /// Unit normals of the vertices.
    pub normals: Vec<Vec3>,
    /// What the surface was in the tissue: parts of its former surface keep their kind.
    pub kinds: Vec<SurfaceKind>,
    /// Closed and outward.
    pub triangles: Vec<[u32; 3]>,
    /// Volume at rest, mm³: what the cuts since [`Field::begin_chip`] reported as removed. Slivers count; the surface
    /// does not enclose them.
    pub rest_volume_mm3: f64,
    /// Centre of what the surface encloses, mm.
    pub centre: DVec3,
    /// Inertia about the centre of that body for a mass of 1 a mm³ at rest, mm⁵.
    pub inertia: DMat3,
}

impl Field {
    /// Begins a chip: all that is removed from now on is part of it. One begun earlier and not taken is forgotten.
    ///
    /// Until it is taken the field holds what emptied pentahedra held.
    pub fn begin_chip(&mut self) {
        self.before.end();
        self.release_emptied();
        self.before.begin();
    }

    /// The chip begun last, the nodes being at `positions`; none if none was begun or nothing was removed since. It may
    /// be of several parts that touch nowhere.
    ///
    /// # Errors
    ///
    /// Positions that are not one finite place a node; the chip can then still be taken.
    pub fn take_chip(&mut self, positions: &[Vec3]) -> Result<Option<Chip>, FieldError> {
        self.mesh.check(positions)?;
        if !self.before.is_under_way() {
            return Ok(None);
        }
        let chip = self.chip(positions);
        self.before.end();
        self.release_emptied();
        Ok(chip)
    }

    fn chip(&self, positions: &[Vec3]) -> Option<Chip> {
        let lost = |(&pentahedron, &kept): (&u32, &f64)| kept - self.kept_mm3(pentahedron);
        let rest_volume_mm3: f64 = self.before.kept.iter().map(lost).sum();
        if rest_volume_mm3 <= 0.0 {
            return None;
        }
        let mut chip = Chip {
            vertices: Vec::new(),
            normals: Vec::new(),
            kinds: Vec::new(),
            triangles: Vec::new(),
            rest_volume_mm3,
            centre: DVec3::ZERO,
            inertia: DMat3::ZERO,
        };
        self.skin(positions, &mut chip);
        (chip.centre, chip.inertia) = self.moments(&chip, positions).about_centre(rest_volume_mm3);
        Some(chip)
    }

    /// The chip's surface.
    fn skin(&self, positions: &[Vec3], chip: &mut Chip) {
        let before = &self.before;
        let sample = |point: u32| {
            let after = self.points.values[point as usize];
            Sample {
                value: before.value(point).map_or(-after.abs(), |before| before.min(-after)),
                is_changed: true,
                is_turned: true,
            }
        };
        let mut surface = Surface::like(&self.surface);
        // Elsewhere the chip's values are nowhere positive.
        let is_part = |&point: &u32| {
            self.points.values[point as usize] < 0.0 && before.value(point).is_some_and(|before| before > 0.0)
        };
        let pentahedra: Vec<u32> = (before.kept.keys().copied())
            .filter(|&pentahedron| self.points.of(pentahedron).iter().any(is_part))
            .collect();
        surface.update(&self.mesh, &self.points, sample, &pentahedra, &pentahedra);
        let mut places = Vec::new();
        surface.vertices.places(&self.mesh, positions, &mut places);
        let mut number = vec![NONE; places.len()];
        for triangle in surface.triangles() {
            for slot in triangle {
                let number = &mut number[slot as usize];
                if *number == NONE {
                    *number = chip.vertices.len() as u32;
                    chip.vertices.push(places[slot as usize]);
                    chip.kinds.push(surface.kinds()[slot as usize]);
                }
            }
            chip.triangles.push(triangle.map(|slot| number[slot as usize]));
        }
        chip.normals = vec![Vec3::ZERO; chip.vertices.len()];
        for triangle in &chip.triangles {
            let [a, b, c] = triangle.map(|vertex| chip.vertices[vertex as usize]);
            let area = (b - a).cross(c - a);
            for &vertex in triangle {
                chip.normals[vertex as usize] += area;
            }
        }
        chip.normals
            .iter_mut()
            .for_each(|normal| *normal = normal.normalize_or_zero());
    }

    /// Mass and moments of what the surface encloses, or, where it is too fine for a surface, of what the pentahedra
    /// lost, each in its middle.
    fn moments(&self, chip: &Chip, positions: &[Vec3]) -> Moments {
        let enclosed = Moments::of_surface(&chip.vertices, &chip.triangles);
        if enclosed.mass > LEAST_ENCLOSED * chip.rest_volume_mm3 {
            return enclosed;
        }
        let mut moments = Moments::default();
        for (&pentahedron, &kept) in &self.before.kept {
            let shape = self.mesh.shape(pentahedron, positions);
            moments.add_point(shape.at([1.0 / 3.0, 1.0 / 3.0, 0.5]), kept - self.kept_mm3(pentahedron));
        }
        moments
    }
}
