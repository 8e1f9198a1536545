//! Thin tissue beside a cut: sheets and ribbons that a current leaves vaporise with its kerf.
//!
//! The thickness at a point beside the wire's way is measured along the normal of the wall that the wire leaves: from
//! that wall through the point to where the tissue ends at another cut or at the mucosa. The capsule and other faces
//! of the organ are no such end: other tissue lies behind them. An edge of thick tissue that the wall
//! meets at a right angle is not thin, a sharp one is as far as it is thinner than the limit.
//!
//! A point counts in the step in which the loop's plane passes it, so that tissue ahead is not thin because it waits to be cut.

use glam::{DVec3, Mat3, Vec3};

use crate::field::Field;
use crate::lookup::Lookup;
use crate::tool::Prepared;
use crate::{Cut, SurfaceKind};

/// From how much above the limit on the thickness leaves values as they are, mm; below, a value falls in proportion, to its opposite where
/// the thickness is as much below. So values that are alike on both sides of a rim change sign where the thickness is the limit. A wider range
/// would move the wall before tissue that is a little thicker.
const RANGE_MM: f32 = 0.25;

/// A point on a face of the surface may lie so far outside of it, mm: a hundred times the resolution of single precision.
const ROUNDING_MM: f32 = 1e-4;
/// A ray may pass so far beside a triangle, as a share of its size.
const SLACK_SHARE: f32 = 1e-4;

/// A point that stays, near the wall.
pub struct Beside {
    pub point: u32,
    /// Relative to the tool's origin.
    pub place: Vec3,
}

/// Axes along and across a tool's way.
struct Frame {
    origin: DVec3,
    turned: Mat3,
}

/// In a tool's frame.
struct Ray {
    from: Vec3,
    /// Of unit length.
    direction: Vec3,
    length: f32,
}

/// A box in a tool's frame: its lowest and highest corner.
#[derive(Clone, Copy)]
struct Extent([Vec3; 2]);

/// Where the tissue of a pentahedron ends, all within an extent.
struct Ends {
    extent: Extent,
    faces: Vec<Face>,
}

/// A triangle of the surface in a tool's frame.
struct Face {
    a: Vec3,
    sides: [Vec3; 2],
    /// Not normalised.
    normal: Vec3,
}

impl Field {
    /// Vaporises what is thin beside the wall that a tool has left; what went, if anything did. `beside`: points that the tool came near to,
    /// `near`: pentahedra around.
    pub(crate) fn vaporise_thin(
        &mut self,
        tool: &Prepared,
        beside: &[Beside],
        near: &[u32],
        positions: &[Vec3],
    ) -> Option<Cut> {
        // Further from the tool no point is looked at.
        let thin_mm = tool.thin_mm().min(self.band);
        let most = thin_mm + RANGE_MM;
        // Rays lie across the loop's way: in its axes the box around them is as flat as the step is short.
        let frame = Frame::of(tool);
        let mut extent = Extent::NONE;
        let mut rays = Vec::new();
        let is_kept = |beside: &&Beside| self.points.values[beside.point as usize] > 0.0;
        for &Beside { point, place } in beside.iter().filter(is_kept) {
            let Some((distance, outwards)) = tool.wall(place) else {
                continue;
            };
            let ray = Ray {
                from: frame.turn(place),
                direction: frame.turn(outwards),
                length: most - distance,
            };
            extent = extent.with(ray.extent());
            rays.push((point, distance, ray));
        }
        if rays.is_empty() {
            return None;
        }
        let mut edit = None;
        let ends = self.ends(&frame, extent, near, positions);
        for (point, distance, ray) in rays {
            let reached = ends.iter().filter(|ends| ends.extent.meets(ray.extent()));
            let faces = reached.flat_map(|ends| &ends.faces);
            let ways = faces.filter_map(|face| face.leaves(&ray));
            let Some(way) = ways.min_by(f32::total_cmp) else {
                continue;
            };
            let edit = edit.get_or_insert_with(|| self.begin_edit());
            let value = distance * ((distance + way - thin_mm) / RANGE_MM).clamp(-1.0, 1.0);
            if value <= 0.0 {
                self.before.lower_of_chip(point, distance + tool.kerf_mm());
            }
            let mut values = self.points.values_mut();
            values.lower(edit, &mut self.before, point, value);
        }
        let edit = edit?;
        let changed = self.marked(edit.changed(), near);
        let thin = self.finish(edit, changed);
        self.before.note_thin(thin.removed_mm3);
        Some(thin)
    }

    /// Where the tissue of some pentahedra ends, as far as that reaches into an extent.
    fn ends(&self, frame: &Frame, extent: Extent, pentahedra: &[u32], positions: &[Vec3]) -> Vec<Ends> {
        let vertices = &self.surface.vertices;
        let position = |node: u32| frame.place(positions[node as usize]);
        let is_end = |slot: u32| matches!(vertices.kinds[slot as usize], SurfaceKind::Mucosa | SurfaceKind::Cut);
        let mut all = Vec::new();
        // A vertex is a corner of some six triangles.
        let mut places: Lookup<u32, Vec3> = Lookup::default();
        for &pentahedron in pentahedra {
            if !extent.meets(Extent::of(&self.mesh.pentahedra[pentahedron as usize].map(position))) {
                continue;
            }
            let mut ends = Ends {
                extent: Extent::NONE,
                faces: Vec::new(),
            };
            for triangle in self.surface.triangles_of(pentahedron) {
                if !triangle.iter().all(|&slot| is_end(slot)) {
                    continue;
                }
                let corners = triangle.map(|slot| {
                    *places.entry(slot).or_insert_with(|| match vertices.home(slot) {
                        Some((pentahedron, place)) => self.mesh.carrier(pentahedron, position).at_one(place),
                        // No triangle has a corner that nothing carries.
                        None => Vec3::NAN,
                    })
                });
                let its = Extent::of(&corners);
                if extent.meets(its) {
                    ends.extent = ends.extent.with(its);
                    ends.faces.push(Face::new(corners));
                }
            }
            all.push(ends);
        }
        all
    }
}

impl Frame {
    fn of(tool: &Prepared) -> Self {
        let axes = tool.bounds().axes.map(DVec3::as_vec3);
        Self {
            origin: tool.origin(),
            turned: Mat3::from_cols_array_2d(&axes.map(|axis| axis.to_array())).transpose(),
        }
    }

    fn turn(&self, vector: Vec3) -> Vec3 {
        self.turned * vector
    }

    fn place(&self, place: Vec3) -> Vec3 {
        self.turn((place.as_dvec3() - self.origin).as_vec3())
    }
}

impl Ray {
    fn extent(&self) -> Extent {
        let Extent([low, high]) = Extent::of(&[self.from, self.from + self.direction * self.length]);
        Extent([low - ROUNDING_MM, high + ROUNDING_MM])
    }
}

impl Extent {
    const NONE: Self = Self([Vec3::INFINITY, Vec3::NEG_INFINITY]);

    fn of(corners: &[Vec3]) -> Self {
        let at = |extent: Self, &corner: &Vec3| extent.with(Self([corner; 2]));
        corners.iter().fold(Self::NONE, at)
    }

    fn with(self, other: Self) -> Self {
        Self([self.0[0].min(other.0[0]), self.0[1].max(other.0[1])])
    }

    fn meets(self, other: Self) -> bool {
        self.0[0].cmple(other.0[1]).all() && self.0[1].cmpge(other.0[0]).all()
    }
}

impl Face {
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let sides = [b - a, c - a];
        Self {
            a,
            sides,
            normal: sides[0].cross(sides[1]),
        }
    }

    /// How far from its start a ray leaves the tissue through this face, if it does (Möller and Trumbore, J. Graphics Tools 2:21, 1997, for
    /// faces that look along the ray).
    fn leaves(&self, ray: &Ray) -> Option<f32> {
        let along = ray.direction.dot(self.normal);
        if along <= 0.0 {
            return None;
        }
        let offset = ray.from - self.a;
        let moment = ray.direction.cross(offset);
        let (u, v) = (moment.dot(self.sides[1]), -moment.dot(self.sides[0]));
        let way = -offset.dot(self.normal) / along;
        // Rounding must not let a ray slip through between two faces.
        let slack = -SLACK_SHARE * along;
        let meets = u >= slack && v >= slack && u + v <= along - slack;
        (meets && (-ROUNDING_MM..=ray.length).contains(&way)).then_some(way)
    }
}
