//! Making a chip's surface, and from that its centre and inertia, in parts.
//!
//! The chip of a long stroke has tens of thousands of triangles: made at once, they would hold up the step in which the
//! stroke ends for longer than all of its cutting. What it is made of is copied when it ends, so that cuts can go on.

use glam::Vec3;

use crate::chips::Chip;
use crate::crossings::{Gathered, Sample};
use crate::extract::Walks;
use crate::field::Field;
use crate::mesh::Mesh;
use crate::moments::Moments;
use crate::points::Points;
use crate::surface::{NONE, Piece, Surface};
use crate::volume;

/// Share of a chip's volume that its surface must enclose to stand for it.
const LEAST_ENCLOSED: f64 = 0.5;

/// Chunks of vertices that find their places, and triangles that are added to the body, in about the time in which a
/// pentahedron is worked on.
const AS_A_PENTAHEDRON: usize = 64;

/// A chip that has ended and has no surface yet: see [`crate::Field::end_chip`].
#[derive(Debug)]
pub struct ChipMaking {
    points: Points,
    surface: Surface,
    walks: Walks,
    /// Those with a part of it inside, rising, and how many of them have their vertices and their triangles.
    pentahedra: Vec<u32>,
    placed: usize,
    extracted: usize,
    /// Where the vertices are, by slot, the nodes first, and how many of their chunks are there.
    places: Vec<Vec3>,
    located: usize,
    /// Number of the body's vertex by slot, and how many triangles are part of the body.
    numbers: Vec<u32>,
    joined: usize,
    chip: Chip,
    enclosed: Moments,
    /// Area of the surface, mm².
    area_mm2: f64,
    /// What every pentahedron lost, mm³, those without a part of the surface included; ascending by pentahedron.
    lost: Vec<(u32, f64)>,
    /// Whether a part of that vaporised.
    vaporises: bool,
}

impl ChipMaking {
    pub(crate) fn new(
        field: &Field,
        points: Points,
        pentahedra: Vec<u32>,
        lost: Vec<(u32, f64)>,
        nodes: &[Vec3],
    ) -> Self {
        let mut surface = Surface::like(&field.surface);
        surface.pieces.resize_with(points.cell_count(), Piece::default);
        surface.point_slots.resize(points.values.len(), NONE);
        let mut walks = Walks::default();
        walks.begin(&field.mesh, &points, &pentahedra);
        Self {
            walks,
            points,
            surface,
            pentahedra,
            placed: 0,
            extracted: 0,
            places: nodes.to_vec(),
            located: 0,
            numbers: Vec::new(),
            joined: 0,
            chip: Chip::empty(lost.iter().map(|(_, mm3)| mm3).sum()),
            enclosed: Moments::default(),
            area_mm2: 0.0,
            lost,
            vaporises: false,
        }
    }

    /// The same, where only what the values hold becomes the chip, and the rest of what was lost vaporised, `thin_mm3` of it because it was thin.
    pub(crate) fn less_what_vaporised(mut self, thin_mm3: f64) -> Self {
        self.vaporises = true;
        self.chip.thin_mm3 = thin_mm3;
        self.chip.vaporised_mm3 = std::mem::take(&mut self.chip.rest_volume_mm3);
        self
    }

    /// Goes on by about as much work as so many pentahedra are; the chip when it is made, which ends this. `field` must be
    /// the one that it came from. The chip is the same, by whatever parts it is made.
    pub fn advance(&mut self, field: &Field, pentahedra: usize) -> Option<Chip> {
        let mesh = &field.mesh;
        let (points, all) = (&self.points, self.pentahedra.len());
        let sample = |point: u32| Sample {
            value: points.values[point as usize],
            is_changed: true,
            is_turned: true,
        };
        let mut gathered = Gathered::default();
        let mut left = pentahedra;
        while self.placed < all && left > 0 {
            let pentahedron = self.pentahedra[self.placed];
            self.surface
                .place_vertices(mesh, points, sample, &mut gathered, pentahedron);
            if self.vaporises {
                let lost = (self.lost).binary_search_by_key(&pentahedron, |&(pentahedron, _)| pentahedron);
                let lost_mm3 = lost.map_or(0.0, |index| self.lost[index].1);
                let held_mm3 = volume::positive_mm3(mesh, points, pentahedron).min(lost_mm3);
                self.chip.rest_volume_mm3 += held_mm3;
                self.chip.vaporised_mm3 -= held_mm3;
            }
            self.placed += 1;
            left -= 1;
        }
        while self.placed == all && self.extracted < all && left > 0 {
            let pentahedron = self.pentahedra[self.extracted];
            self.surface.extract(mesh, points, sample, &mut self.walks, pentahedron);
            self.extracted += 1;
            left -= 1;
        }
        if self.extracted < all {
            return None;
        }
        let vertices = &self.surface.vertices;
        let chunks = vertices.chunk_count();
        let mut left = left.saturating_mul(AS_A_PENTAHEDRON);
        while self.located < chunks && left > 0 {
            let position = |node: u32| self.places[node as usize];
            let places = vertices.chunk_places(mesh, self.located, position);
            self.places.extend(places);
            self.located += 1;
            left -= 1;
        }
        self.numbers.resize(vertices.len(), NONE);
        while self.located == chunks && self.joined < self.walks.found.len() && left > 0 {
            self.join(self.walks.found[self.joined].2);
            self.joined += 1;
            left -= 1;
        }
        let is_made = self.located == chunks && self.joined == self.walks.found.len();
        is_made.then(|| self.finish(mesh))
    }

    /// Adds a triangle to the body.
    fn join(&mut self, slots: [u32; 3]) {
        let chip = &mut self.chip;
        let triangle = slots.map(|slot| {
            let number = &mut self.numbers[slot as usize];
            if *number == NONE {
                *number = chip.vertices.len() as u32;
                chip.vertices.push(self.places[slot as usize]);
                chip.normals.push(Vec3::ZERO);
                chip.kinds.push(self.surface.kinds()[slot as usize]);
            }
            *number
        });
        let corners = triangle.map(|vertex| chip.vertices[vertex as usize]);
        let [a, b, c] = corners;
        let area = (b - a).cross(c - a);
        self.area_mm2 += f64::from(0.5 * area.length());
        for vertex in triangle {
            chip.normals[vertex as usize] += area;
        }
        chip.triangles.push(triangle);
        self.enclosed.add_triangle(corners);
    }

    fn finish(&mut self, mesh: &Mesh) -> Chip {
        let mut chip = std::mem::replace(&mut self.chip, Chip::empty(0.0));
        let normals = chip.normals.iter_mut();
        normals.for_each(|normal| *normal = normal.normalize_or_zero());
        // Not below 0 by rounding.
        chip.vaporised_mm3 = chip.vaporised_mm3.max(0.0);
        let moments = self.moments(mesh, chip.rest_volume_mm3);
        (chip.centre, chip.inertia) = moments.about_centre(chip.rest_volume_mm3);
        if self.area_mm2 > 0.0 {
            chip.thickness_mm = 2.0 * self.enclosed.mass / self.area_mm2;
        }
        chip.shrink_to_fit();
        chip
    }

    /// Mass and moments of what the surface encloses, or, where it is too fine for a surface, of what the pentahedra
    /// lost, each in its middle.
    fn moments(&self, mesh: &Mesh, rest_volume_mm3: f64) -> Moments {
        if self.enclosed.mass > LEAST_ENCLOSED * rest_volume_mm3 {
            return self.enclosed;
        }
        let mut moments = Moments::default();
        for &(pentahedron, lost) in &self.lost {
            let shape = mesh.shape(pentahedron, &self.places);
            moments.add_point(shape.at([1.0 / 3.0, 1.0 / 3.0, 0.5]), lost);
        }
        moments
    }
}
