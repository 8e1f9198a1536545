//! Chips: what has been cut away since a chip was begun, as a body of its own.
//!
//! Its value is `min(before, -after)`: positive where tissue was and is no more. The same extraction gives its surface,
//! and the same tetrahedra its volume and moments, as what was kept before less what is kept after.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3, Vec3};

use crate::crossings::Sample;
use crate::field::Field;
use crate::lookup::Lookup;
use crate::surface::Surface;
use crate::{FieldError, SurfaceKind, volume};

/// What was there when the chip was begun, of all that has changed since.
#[derive(Debug, Clone, Default)]
pub struct Before {
    /// Values by point. Only looked up, so its order is of no matter.
    values: Lookup<u32, f32>,
    /// Kept volume by pentahedron.
    kept: BTreeMap<u32, f64>,
}

impl Before {
    pub fn remember_point(&mut self, point: u32, value: f32) {
        self.values.entry(point).or_insert(value);
    }

    pub fn remember_kept(&mut self, pentahedron: u32, kept_mm3: f64) {
        self.kept.entry(pentahedron).or_insert(kept_mm3);
    }

    pub fn bytes(&self) -> usize {
        self.values.capacity() * size_of::<(u32, f32)>() + self.kept.len() * size_of::<(u32, f64)>()
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
    /// Centre of mass, mm.
    pub centre: DVec3,
    /// Inertia about the centre for a mass of 1 a mm³ at rest, mm⁵.
    pub inertia: DMat3,
}

impl Field {
    /// Begins a chip: all that is removed from now on is part of it. One begun earlier and not taken is forgotten.
    pub fn begin_chip(&mut self) {
        self.before = Some(Before::default());
    }

    /// The chip begun last, the nodes being at `positions`; none if none was begun or nothing was removed since. It may
    /// be of several parts that touch nowhere.
    ///
    /// # Errors
    ///
    /// Positions that are not one finite place a node; the chip can then still be taken.
    pub fn take_chip(&mut self, positions: &[Vec3]) -> Result<Option<Chip>, FieldError> {
        self.mesh.check(positions)?;
        let Some(before) = self.before.take() else {
            return Ok(None);
        };
        let lost = |(&pentahedron, &kept): (&u32, &f64)| kept - self.kept_mm3(pentahedron);
        let rest_volume_mm3: f64 = before.kept.iter().map(lost).sum();
        if rest_volume_mm3 <= 0.0 {
            return Ok(None);
        }
        let moments = self.moments(&before, positions);
        let (centre, inertia) = moments.about_centre(rest_volume_mm3);
        let mut chip = Chip {
            vertices: Vec::new(),
            normals: Vec::new(),
            kinds: Vec::new(),
            triangles: Vec::new(),
            rest_volume_mm3,
            centre,
            inertia,
        };
        self.skin(&before, positions, &mut chip);
        Ok(Some(chip))
    }

    /// The chip's surface.
    fn skin(&self, before: &Before, positions: &[Vec3], chip: &mut Chip) {
        let sample = |point: u32| {
            let after = self.points.values[point as usize];
            let former = before.values.get(&point);
            Sample {
                value: former.map_or(-after.abs(), |before| before.min(-after)),
                is_changed: false,
            }
        };
        let mut surface = Surface::empty(&self.mesh);
        let pentahedra: Vec<u32> = before.kept.keys().copied().collect();
        surface.update(&self.mesh, &self.points, sample, &pentahedra, &pentahedra);
        let mut places = Vec::new();
        surface.vertices.places(&self.mesh, positions, &mut places);
        let mut number: Lookup<u32, u32> = Lookup::default();
        for triangle in surface.triangles() {
            let corners = triangle.map(|slot| {
                *number.entry(slot).or_insert_with(|| {
                    chip.vertices.push(places[slot as usize]);
                    chip.kinds.push(surface.kinds()[slot as usize]);
                    chip.vertices.len() as u32 - 1
                })
            });
            chip.triangles.push(corners);
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

    fn moments(&self, before: &Before, positions: &[Vec3]) -> Moments {
        let mut moments = Moments::default();
        for &pentahedron in before.kept.keys() {
            let Some(cell) = self.points.cell(pentahedron) else {
                continue;
            };
            let scale = self.mesh.rest_volumes[pentahedron as usize] / cell.prisms_mm3;
            let rest = self.mesh.rest_shape(pentahedron);
            let now = self.mesh.shape(pentahedron, positions);
            let after: Vec<f32> = cell
                .points
                .iter()
                .map(|&point| self.points.values[point as usize])
                .collect();
            let former: Vec<f32> = (cell.points.iter().zip(&after))
                .map(|(point, &after)| before.values.get(point).copied().unwrap_or(after))
                .collect();
            let sub = self.mesh.sub(pentahedron);
            for prism in &sub.prisms {
                let corners = prism.map(|corner| corner as usize);
                if corners.iter().all(|&corner| former[corner] == after[corner]) {
                    continue;
                }
                let at_rest = corners.map(|corner| rest.at(sub.places[corner]));
                let places = corners.map(|corner| now.at(sub.places[corner]));
                for tetrahedron in volume::tetrahedra(corners.map(|corner| cell.points[corner])) {
                    let mass = scale * volume::tetrahedron_volume(tetrahedron.map(|corner| at_rest[corner]));
                    let places = tetrahedron.map(|corner| places[corner]);
                    let values = |of: &[f32]| tetrahedron.map(|corner| f64::from(of[corners[corner]]));
                    moments.add(values(&former), places, mass);
                    moments.add(values(&after), places, -mass);
                }
            }
        }
        moments
    }
}

/// Mass and its first and second moments about the origin.
#[derive(Debug, Default)]
struct Moments {
    mass: f64,
    first: DVec3,
    second: DMat3,
}

impl Moments {
    /// Adds the part of a tetrahedron in which a linear function is positive.
    fn add(&mut self, values: [f64; 4], places: [DVec3; 4], mass: f64) {
        if values.iter().all(|&value| value > 0.0) {
            self.add_whole(places, mass);
            return;
        }
        for part in volume::kept_parts(values) {
            let corners = part.map(|weights| places.iter().zip(weights).map(|(place, weight)| *place * weight).sum());
            self.add_whole(corners, mass * volume::share(&part));
        }
    }

    /// Adds a tetrahedron of even density.
    fn add_whole(&mut self, corners: [DVec3; 4], mass: f64) {
        let sum: DVec3 = corners.iter().sum();
        self.mass += mass;
        self.first += sum * (0.25 * mass);
        let squares = outer(corners[0]) + outer(corners[1]) + outer(corners[2]) + outer(corners[3]);
        self.second += (squares + outer(sum)) * (mass / 20.0);
    }

    /// Centre, and inertia about it, of that mass.
    fn about_centre(&self, mass: f64) -> (DVec3, DMat3) {
        let centre = self.first / self.mass;
        let second = (self.second - outer(centre) * self.mass) * (mass / self.mass);
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        (centre, DMat3::from_diagonal(DVec3::splat(trace)) - second)
    }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}
