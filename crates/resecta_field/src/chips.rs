//! Chips: what has been cut away since a chip was begun, as a body of its own.
//!
//! Its value is `min(before, -after)`: positive where tissue was and is no more. Where a current took it, the distance to the part that
//! does not vaporise stands for `after`. The chip's volume is what the pentahedra lost, less what vaporised;
//! its surface takes more time to make than a step of a stroke has (`chip_making.rs`).

use std::collections::BTreeMap;

use glam::{DMat3, DVec3, Vec3};

use crate::field::Field;
use crate::{ChipMaking, FieldError, SurfaceKind, room};

/// What was there when the chip was begun, of all that has changed since.
#[derive(Debug, Clone, Default)]
pub struct Before {
    is_under_way: bool,
    /// Values by point; NaN where unchanged.
    values: Vec<f32>,
    /// The points that have one.
    points: Vec<u32>,
    /// Distance of a point to what currents took and did not vaporise, mm; infinite where no current passed, minus infinite where the point
    /// came off without one.
    of_chip: Vec<f32>,
    /// Whether a current has vaporised anything.
    vaporises: bool,
    /// What vaporised because it was thin, mm³.
    thin_mm3: f64,
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
        self.of_chip.clear();
        self.vaporises = false;
        self.thin_mm3 = 0.0;
        self.kept.clear();
    }

    /// Forgets points that are no more; none may be remembered.
    pub fn trim(&mut self, points: usize) {
        if points < self.values.len() {
            room::cut_off(&mut self.values, points);
        }
    }

    pub fn make_room(&mut self) {
        room::make(&mut self.values);
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

    /// Notes how far a point is from what a step of a current takes and does not vaporise, mm.
    #[inline(always)]
    pub fn lower_of_chip(&mut self, point: u32, distance: f32) {
        if self.is_under_way {
            let lowest = self.of_chip_mut(point);
            *lowest = lowest.min(distance);
            self.vaporises = true;
        }
    }

    /// Notes that thin tissue has vaporised.
    pub fn note_thin(&mut self, mm3: f64) {
        if self.is_under_way {
            self.thin_mm3 += mm3;
        }
    }

    /// Notes that a point comes off without a current, so that all around it is part of the chip.
    #[inline(always)]
    pub fn keep_for_chip(&mut self, point: u32) {
        if self.is_under_way {
            *self.of_chip_mut(point) = f32::NEG_INFINITY;
        }
    }

    fn of_chip_mut(&mut self, point: u32) -> &mut f32 {
        let index = point as usize;
        if index >= self.of_chip.len() {
            self.of_chip.resize(index + 1, f32::INFINITY);
        }
        &mut self.of_chip[index]
    }

    /// Distance of a point to what becomes the chip, mm, with its value after the cut: less where a current took it, of which the outermost
    /// layer vaporises.
    fn of_chip(&self, point: u32, after: f32) -> f32 {
        let lowest = self.of_chip.get(point as usize).copied();
        lowest.filter(|lowest| lowest.is_finite()).unwrap_or(after)
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
        let numbers = self.values.capacity() + self.points.capacity() + self.of_chip.capacity();
        4 * numbers + self.kept.len() * size_of::<(u32, f64)>()
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
    /// Volume at rest, mm³: what the cuts since [`Field::begin_chip`] reported as removed, less what vaporised. Slivers of a cut without a
    /// kerf count; the surface does not enclose them.
    pub rest_volume_mm3: f64,
    /// What vaporised of that, mm³ at rest.
    pub vaporised_mm3: f64,
    /// What of that did because it was thin, beside the wall of a cut, mm³ at rest: four fifths of it, as its rim to tissue that a later step
    /// takes counts as kerf.
    pub thin_mm3: f64,
    /// Centre of what the surface encloses, mm.
    pub centre: DVec3,
    /// Inertia about the centre of that body for a mass of 1 a mm³ at rest, mm⁵.
    pub inertia: DMat3,
    /// How thick it is in the mean, mm: twice the volume that its surface encloses by the area of that. 0 without a surface, negative
    /// where most of that is inside out.
    pub thickness_mm: f64,
}

impl Chip {
    /// A volume without a surface.
    pub(crate) fn empty(rest_volume_mm3: f64) -> Self {
        Self {
            vertices: Vec::new(),
            normals: Vec::new(),
            kinds: Vec::new(),
            triangles: Vec::new(),
            rest_volume_mm3,
            vaporised_mm3: 0.0,
            thin_mm3: 0.0,
            centre: DVec3::ZERO,
            inertia: DMat3::ZERO,
            thickness_mm: 0.0,
        }
    }

    /// Gives back what its lists hold beyond their ends: chips stay for the rest of an operation.
    pub fn shrink_to_fit(&mut self) {
        self.vertices.shrink_to_fit();
        self.normals.shrink_to_fit();
        self.kinds.shrink_to_fit();
        self.triangles.shrink_to_fit();
    }
}

impl Field {
    /// Begins a chip: all that is removed from now on is part of it. One begun earlier and not ended is forgotten.
    ///
    /// Until it is ended the field holds what emptied pentahedra held.
    pub fn begin_chip(&mut self) {
        self.before.end();
        self.release_emptied();
        self.before.begin();
    }

    /// Ends the chip begun last, the nodes being at `positions`: what is to be made of it, apart from the field and all
    /// that is cut from now on. None if none was begun or nothing was removed since.
    ///
    /// # Errors
    ///
    /// Positions that are not one finite place a node; the chip can then still be ended.
    pub fn end_chip(&mut self, positions: &[Vec3]) -> Result<Option<ChipMaking>, FieldError> {
        self.mesh.check(positions)?;
        if !self.before.is_under_way() {
            return Ok(None);
        }
        let making = self.making(positions);
        self.before.end();
        self.release_emptied();
        self.tidy();
        Ok(making)
    }

    /// The chip begun last, the nodes being at `positions`; none if none was begun or nothing was removed since. It may
    /// be of several parts that touch nowhere.
    ///
    /// # Errors
    ///
    /// As [`Field::end_chip`].
    pub fn take_chip(&mut self, positions: &[Vec3]) -> Result<Option<Chip>, FieldError> {
        let Some(mut making) = self.end_chip(positions)? else {
            return Ok(None);
        };
        Ok(making.advance(self, usize::MAX))
    }

    fn making(&mut self, positions: &[Vec3]) -> Option<ChipMaking> {
        let before = &self.before;
        let lost: Vec<(u32, f64)> = (before.kept.iter())
            .map(|(&pentahedron, kept)| (pentahedron, kept - self.kept_mm3(pentahedron)))
            .collect();
        if lost.iter().map(|(_, mm3)| mm3).sum::<f64>() <= 0.0 {
            return None;
        }
        let value = |point: u32, after: f32| {
            let was = before.value(point);
            was.map_or(-after.abs(), |was| was.min(-before.of_chip(point, after)))
        };
        // Elsewhere the chip's values are nowhere positive.
        let is_part = |&point: &u32| value(point, self.points.values[point as usize]) > 0.0;
        let pentahedra: Vec<u32> = (before.kept.keys().copied())
            .filter(|&pentahedron| self.points.of(pentahedron).iter().any(is_part))
            .collect();
        let points = self.points.part(&pentahedra, value);
        let (vaporises, thin_mm3) = (before.vaporises, before.thin_mm3);
        let making = ChipMaking::new(self, points, pentahedra, lost, positions);
        Some(if vaporises {
            making.less_what_vaporised(thin_mm3)
        } else {
            making
        })
    }
}
