//! How far two surfaces of tissue are apart.
//!
//! Points are spread over one surface, each with the area that it stands for, and the distance of each from the nearest point of the
//! other surface is taken; then the other way round. One way alone does not see what only one of the two has: a ribbon, a hole.

use bevy::prelude::*;
use parry3d::{query::PointQuery, shape::TriMesh};
use resecta_tissue::Tissue;
use serde::Serialize;

/// Points on a surface are no further apart than this, mm.
const APART_MM: f32 = 0.5;

/// A surface made of triangles, outward by the right-hand rule; mm.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Corners.
    pub places: Vec<Vec3>,
    /// Indices of corners.
    pub triangles: Vec<[u32; 3]>,
}

/// The part of space in which surfaces are compared: around a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Ends of the segment, mm.
    pub ends: [Vec3; 2],
    /// How far from it, mm.
    pub within_mm: f32,
}

impl Region {
    fn contains(&self, place: Vec3) -> bool {
        distance_to_segment(place, self.ends) <= self.within_mm
    }
}

/// Distance of a point from a segment, mm.
pub fn distance_to_segment(place: Vec3, [from, to]: [Vec3; 2]) -> f32 {
    let along = to - from;
    let squared = along.length_squared();
    let share = if squared > 0.0 {
        ((place - from).dot(along) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    place.distance(from + share * along)
}

/// A triangle of less area than this share of its length squared stands for none, and rounding decides where in it a point lies.
const SLIVER: f32 = 1e-4;

impl Surface {
    /// All of the surface of a tissue that is cut finer than its elements, where it lies now; `None` of another tissue.
    pub fn of(tissue: &Tissue) -> Option<Surface> {
        tissue.field()?;
        let (places, triangles) = tissue.surface();
        Some(Surface { places, triangles })
    }

    /// Points of the surface that lie in a region, with the area that each stands for, mm².
    pub fn points(&self, region: &Region) -> Vec<(Vec3, f32)> {
        let mut points = Vec::new();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| self.places[corner as usize]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            // A triangle whose middle is further away than it is long has no point in the region.
            let middle = (a + b + c) / 3.0;
            if distance_to_segment(middle, region.ends) > region.within_mm + longest {
                continue;
            }
            let parts = (longest / APART_MM).ceil().clamp(1.0, 64.0) as u32;
            let whole = 0.5 * (b - a).cross(c - a).length();
            if whole <= SLIVER * longest * longest {
                continue;
            }
            let area = whole / (parts * parts) as f32;
            for place in middles([a, b, c], parts) {
                if region.contains(place) {
                    points.push((place, area));
                }
            }
        }
        points
    }

    /// The same surface where `origin` is the origin: far from it, rounding would count as distance.
    fn about(&self, origin: Vec3) -> Surface {
        Surface {
            places: self.places.iter().map(|&place| place - origin).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// The surface, for distances from it; `None` without triangles.
    pub fn solid(&self) -> Option<TriMesh> {
        TriMesh::new(self.places.clone(), self.triangles.clone()).ok()
    }
}

/// Middles of the equal small triangles that a triangle is divided into, `parts` to an edge.
fn middles([a, b, c]: [Vec3; 3], parts: u32) -> impl Iterator<Item = Vec3> {
    let step = 1.0 / parts as f32;
    let [u, v] = [(b - a) * step, (c - a) * step];
    (0..parts).flat_map(move |i| {
        // In a row, upright ones and those upside down take turns.
        let upright = (0..parts - i).map(move |j| (j, 1.0 / 3.0));
        let turned = (0..parts - i - 1).map(move |j| (j, 2.0 / 3.0));
        upright
            .chain(turned)
            .map(move |(j, share)| a + u * (i as f32 + share) + v * (j as f32 + share))
    })
}

/// Distances between surfaces, each with the area that it stands for.
#[derive(Debug, Clone, Default)]
pub struct Distances(Vec<(f32, f32)>);

/// A sample of [`Distances`] in three numbers, weighted by area.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Apart {
    /// Root mean square, mm.
    pub rms_mm: f64,
    /// 95 % of the area is nearer than this, mm.
    pub p95_mm: f64,
    /// Largest, mm.
    pub largest_mm: f64,
}

impl Apart {
    /// Several as one: the root mean square of theirs, and the largest of their other numbers; `None` without any.
    pub fn over(several: &[Apart]) -> Option<Apart> {
        let largest = |value: fn(&Apart) -> f64| several.iter().map(value).fold(0.0, f64::max);
        let squares: f64 = several.iter().map(|apart| apart.rms_mm.powi(2)).sum();
        (!several.is_empty()).then(|| Apart {
            rms_mm: (squares / several.len() as f64).sqrt(),
            p95_mm: largest(|apart| apart.p95_mm),
            largest_mm: largest(|apart| apart.largest_mm),
        })
    }
}

impl Distances {
    /// Distances between two surfaces in a region, both ways. Points outside of it count as the nearest, so its rim makes no
    /// distance. Empty where either surface has nothing there.
    pub fn between(one: &Surface, other: &Surface, region: &Region) -> Distances {
        let mut distances = Vec::new();
        let middle = region.ends[0].midpoint(region.ends[1]);
        let (one, other) = (one.about(middle), other.about(middle));
        let region = Region {
            ends: region.ends.map(|end| end - middle),
            ..*region
        };
        if let (Some(solid), Some(other_solid)) = (one.solid(), other.solid()) {
            for (points, solid) in [(one.points(&region), &other_solid), (other.points(&region), &solid)] {
                distances.extend(
                    points
                        .into_iter()
                        .map(|(place, area)| (solid.distance_to_local_point(place, false), area)),
                );
            }
        }
        Distances(distances)
    }

    /// Distances, mm, with the area that each stands for.
    pub fn of(distances: impl IntoIterator<Item = (f32, f32)>) -> Distances {
        Distances(distances.into_iter().collect())
    }

    /// Adds others.
    pub fn join(&mut self, others: Distances) {
        self.0.extend(others.0);
    }

    /// The three numbers; `None` without distances.
    pub fn summary(&self) -> Option<Apart> {
        let mut sorted = self.0.clone();
        sorted.sort_by(|one, other| one.0.total_cmp(&other.0));
        let area: f64 = sorted.iter().map(|(_, area)| f64::from(*area)).sum();
        let last = sorted.last().filter(|_| area > 0.0)?;
        let squares: f64 = (sorted.iter())
            .map(|(distance, area)| f64::from(*distance).powi(2) * f64::from(*area))
            .sum();
        let mut below = 0.0;
        let p95 = sorted.iter().find(|(_, part)| {
            below += f64::from(*part);
            below >= 0.95 * area
        });
        Some(Apart {
            rms_mm: (squares / area).sqrt(),
            p95_mm: p95.unwrap_or(last).0.into(),
            largest_mm: last.0.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat square of a size (mm) at a height (mm), divided into `parts` squares along each edge.
    fn plane(size: f32, height: f32, parts: u32) -> Surface {
        let at = |n: u32| size * (n as f32 / parts as f32 - 0.5);
        let corner = |i: u32, j: u32| i * (parts + 1) + j;
        let mut surface = Surface::default();
        for i in 0..=parts {
            for j in 0..=parts {
                surface.places.push(Vec3::new(at(i), at(j), height));
            }
        }
        for (i, j) in (0..parts).flat_map(|i| (0..parts).map(move |j| (i, j))) {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            surface.triangles.extend([[a, b, c], [a, c, d]]);
        }
        surface
    }

    fn around_origin(within_mm: f32) -> Region {
        Region {
            ends: [Vec3::ZERO; 2],
            within_mm,
        }
    }

    #[test]
    fn planes_are_apart_by_their_offset_however_they_are_divided() {
        for offset in [0.01, 0.3, 2.0] {
            let distances = Distances::between(&plane(40.0, 0.0, 3), &plane(40.0, offset, 17), &around_origin(6.0));
            let apart = distances.summary().expect("both pass through the region");
            for found in [apart.rms_mm, apart.p95_mm, apart.largest_mm] {
                assert!((found - f64::from(offset)).abs() < 1e-5, "{offset}: {apart:?}");
            }
        }
    }

    #[test]
    fn a_surface_is_nowhere_apart_from_itself() {
        let surface = plane(20.0, 1.0, 5);
        let apart = Distances::between(&surface, &surface, &around_origin(8.0)).summary();
        assert!(apart.expect("it passes through the region").largest_mm < 1e-5);
    }

    #[test]
    fn both_ways_are_the_same_whichever_comes_first() {
        let (whole, part) = (plane(20.0, 0.0, 4), plane(6.0, 0.5, 4));
        let [one, other] = [(&whole, &part), (&part, &whole)]
            .map(|(one, other)| Distances::between(one, other, &around_origin(8.0)).summary().unwrap());
        assert!((one.rms_mm - other.rms_mm).abs() < 1e-9);
        // What only one has is seen: its corners in the region are far from the small square.
        assert!(one.largest_mm > 4.0, "{one:?}");
    }

    #[test]
    fn the_points_stand_for_the_area_in_the_region() {
        let points = plane(40.0, 0.0, 9).points(&around_origin(10.0));
        let area: f32 = points.iter().map(|(_, area)| area).sum();
        let circle = std::f32::consts::PI * 100.0;
        assert!((area / circle - 1.0).abs() < 0.02, "{area}");
    }

    #[test]
    fn several_as_one_lie_between_them_and_have_their_worst() {
        let apart = |mm: f64| Apart {
            rms_mm: mm,
            p95_mm: 2.0 * mm,
            largest_mm: 3.0 * mm,
        };
        let both = Apart::over(&[apart(1.0), apart(7.0)]).expect("there are two");
        assert_eq!((both.rms_mm, both.p95_mm, both.largest_mm), (5.0, 14.0, 21.0));
        assert_eq!(Apart::over(&[apart(0.3)]), Some(apart(0.3)));
        assert_eq!(Apart::over(&[]), None);
    }

    #[test]
    fn without_surface_there_is_no_distance() {
        let nothing = Distances::between(&plane(2.0, 50.0, 1), &plane(2.0, 50.0, 1), &around_origin(5.0));
        assert_eq!(nothing.summary(), None);
        assert_eq!(
            Distances::between(&Surface::default(), &plane(2.0, 0.0, 1), &around_origin(5.0)).summary(),
            None
        );
    }

    #[test]
    fn a_twentieth_of_the_area_may_be_further_than_the_95th_percentile() {
        let far = |share: f32| {
            Distances(vec![(0.0, 1.0 - share), (1.0, share)])
                .summary()
                .unwrap()
                .p95_mm
        };
        assert_eq!((far(0.04), far(0.06)), (0.0, 1.0));
    }
}
