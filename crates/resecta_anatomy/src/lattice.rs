//! The lattice: the gland as layers of nodes between urethra and capsule, and two pentahedra a cell.
//!
//! Papers: 2003, II.B; second paper, 3. Where they leave the construction open, the rules are:
//!
//! - The radius along a ray is that of the sector of equal area (module `sampling`), and what is carried along the axis by
//!   cubic splines are the squared radii and the centres. The sections' areas are then the spline of the contours' areas.
//! - A section's polygon lies inside the arcs of its sectors. Each of its two rings is scaled (by about 0.2 % at 8 degrees)
//!   so that the polygon, not the arcs, has the sectors' area.
//! - Splines are bounded where slices jump (`CubicSpline::bounded_at`), so radii stay positive.
//! - The lumen's radius is at most 95 % of the capsule's on the same ray.
//! - Rays keep their direction from section to section and every section is flat, so each pentahedron's two triangles
//!   have the right sense by construction. Where unlike neighbouring sections still twist a thin pentahedron until its
//!   volume falls below a tenth of the straight prism's (whichever way its faces are cut), the squared radii of its two
//!   rays on its two sections (and, the more rounds it takes, of the rays beside them) are evened out, which keeps the
//!   area, until it does not. [`Lattice::smoothed_sections`] counts the sections this touched.
//! - The first and the last section lie on the first and the last given slice.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::contour;
use crate::lattice_error::{Boundary, LatticeError};
use crate::sampling::{self, direction};
use crate::shape::LatticeShape;
use crate::spline::CubicSpline;
use crate::{Case, Zone, quality, wedge, zoning};

/// Greatest radius of the lumen as a share of the capsule's on the same ray.
const MAX_LUMEN_SHARE: f64 = 0.95;

/// Most nodes a lattice may have: far beyond what moves in real time, and still well inside 32-bit indices.
pub const MAX_NODES: usize = 50_000_000;

/// Least share of a pentahedron's untwisted volume that its twist must leave.
const LEAST_VOLUME_SHARE: f64 = 0.1;

/// Rounds of smoothing before an inverted pentahedron is reported; the reach grows by a ray every eight rounds.
const MAX_REPAIRS: usize = 400;

/// How fine a lattice is. `alpha_deg` is the one knob; `axial_points` overrides what follows from it along the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeOptions {
    /// Angle between rays, degrees, above 0 and at most 120; the papers use 7 to 11. The angle used is the nearest that
    /// divides the circle, see [`Lattice::angle_deg`].
    pub alpha_deg: f64,
    /// Number of sections along the axis (`c` of the second paper), at least 2; from the mean segment length where absent.
    pub axial_points: Option<usize>,
}

impl Default for LatticeOptions {
    fn default() -> Self {
        Self {
            alpha_deg: 8.0,
            axial_points: None,
        }
    }
}

/// One transverse slice of a hollow organ.
#[derive(Debug, Clone, Copy)]
pub struct Section<'a> {
    /// Height along the axis, mm.
    pub z: f64,
    /// Outer boundary, in either sense, mm.
    pub outer: &'a [DVec2],
    /// Boundary of the lumen, inside `outer`, in either sense, mm.
    pub inner: &'a [DVec2],
}

/// A gland or another hollow organ as a volumetric lattice, at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Numbers of slices, angles and layers.
    pub shape: LatticeShape,
    /// Places of the nodes, mm, in the order of [`LatticeShape::index`].
    pub positions: Vec<DVec3>,
    /// Nodes of the pentahedra in the order of [`wedge`], two a cell, in the order of [`LatticeShape::cell_index`].
    pub pentahedra: Vec<[u32; 6]>,
    /// The zone of every pentahedron.
    pub zones: Vec<Zone>,
    /// Centre of the rays in every section, inside the lumen, mm: the line of the urethra.
    pub centres: Vec<DVec3>,
    /// The angle used, `360 / round(360 / alpha)`, degrees.
    pub angle_deg: f64,
    /// Mean length of the segments that join neighbouring control points of all given contours (`l` of the papers), mm.
    pub segment_mm: f64,
    /// Volume between the given contours (areas of the outer less the inner, integrated along the axis by a cubic spline).
    pub contour_volume_mm3: f64,
    /// The same for the outer contours alone.
    pub capsule_volume_mm3: f64,
    /// Rays, over all sections, on which the lumen was narrowed to leave a wall.
    pub narrowed_rays: usize,
    /// Sections on which neighbouring rays were evened out so that no pentahedron is inverted.
    pub smoothed_sections: usize,
}

impl Lattice {
    /// The lattice of a completed case, with its zones.
    ///
    /// Every slice needs a urethra ([`LatticeError::MissingUrethra`]). A case without any transition zone has pentahedra
    /// of [`Zone::Other`] only.
    pub fn build(case: &Case, options: &LatticeOptions) -> Result<Self, LatticeError> {
        let sections = (case.slices.iter().enumerate())
            .map(|(slice, given)| {
                let inner = given.urethra.as_ref().ok_or(LatticeError::MissingUrethra { slice })?;
                Ok(Section {
                    z: given.z,
                    outer: &given.capsule,
                    inner,
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let sampled = Sampled::new(&sections, options)?;
        let mut lattice = sampled.lattice(options)?;
        if case.slices.iter().any(|slice| slice.transition_zone.is_some()) {
            lattice.zones = zoning::zones(case, &sampled.heights, &sampled.centres, &lattice);
        }
        Ok(lattice)
    }

    /// The lattice of any hollow organ between inner and outer contours; every pentahedron is [`Zone::Other`].
    pub fn from_sections(sections: &[Section], options: &LatticeOptions) -> Result<Self, LatticeError> {
        Sampled::new(sections, options)?.lattice(options)
    }

    /// Sum of the pentahedra's volumes, which is the volume that the exposed surface encloses.
    pub fn volume_mm3(&self) -> f64 {
        (self.pentahedra.iter())
            .map(|nodes| wedge::volume(nodes, |node| self.positions[node as usize]))
            .sum()
    }

    /// Smallest and mean quality of the pentahedra.
    pub fn quality(&self) -> quality::LatticeQuality {
        quality::of(&self.pentahedra, &self.positions)
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// Number of springs to axis neighbours, as the papers count them.
    pub fn axis_spring_count(&self) -> usize {
        self.shape.axis_pair_count()
    }

    /// Number of pentahedra.
    pub fn pentahedron_count(&self) -> usize {
        self.pentahedra.len()
    }
}

/// The given slices, sampled.
struct Sampled {
    angles: usize,
    heights: Vec<f64>,
    centres: Vec<DVec2>,
    /// Squared radius by slice and ray.
    outer: Vec<Vec<f64>>,
    inner: Vec<Vec<f64>>,
    outer_areas: Vec<f64>,
    inner_areas: Vec<f64>,
}

/// One section of the lattice: its centre and the squared radii of its two boundaries.
struct Ring {
    z: f64,
    centre: DVec2,
    outer: Vec<f64>,
    inner: Vec<f64>,
    smoothed: bool,
}

impl Sampled {
    fn new(sections: &[Section], options: &LatticeOptions) -> Result<Self, LatticeError> {
        let alpha = options.alpha_deg;
        if !(alpha > 0.0 && alpha <= 120.0) {
            return Err(LatticeError::Alpha { value: alpha });
        }
        let angles = (360.0 / alpha).round();
        if angles > MAX_NODES as f64 / 4.0 {
            return Err(LatticeError::TooFine {
                alpha_deg: alpha,
                nodes: 4.0 * angles,
            });
        }
        if sections.len() < 2 {
            return Err(LatticeError::TooFewSlices { count: sections.len() });
        }
        let mut sampled = Self {
            angles: angles as usize,
            heights: Vec::new(),
            centres: Vec::new(),
            outer: Vec::new(),
            inner: Vec::new(),
            outer_areas: Vec::new(),
            inner_areas: Vec::new(),
        };
        for (slice, section) in sections.iter().enumerate() {
            sampled.add(slice, section)?;
        }
        Ok(sampled)
    }

    fn add(&mut self, slice: usize, section: &Section) -> Result<(), LatticeError> {
        let z = section.z;
        if !z.is_finite() || self.heights.last().is_some_and(|&before| z <= before) {
            return Err(LatticeError::Height { slice, z });
        }
        let checked_area = |boundary, corners: &[DVec2]| {
            let area_mm2 = contour::signed_area(corners).abs();
            let sound = corners.len() >= 3 && corners.iter().all(|corner| corner.is_finite()) && area_mm2 > 0.0;
            sound.then_some(area_mm2).ok_or(LatticeError::Contour {
                slice,
                boundary,
                corners: corners.len(),
                area_mm2,
            })
        };
        self.outer_areas.push(checked_area(Boundary::Outer, section.outer)?);
        self.inner_areas.push(checked_area(Boundary::Inner, section.inner)?);
        let not_around = |boundary, ray: usize| LatticeError::NotAround {
            slice,
            boundary,
            angle_deg: 360.0 * ray as f64 / self.angles as f64,
        };
        let centre = sampling::choose_centre(section.outer, section.inner, self.angles)
            .ok_or_else(|| not_around(Boundary::Inner, 0))?;
        let sample = |boundary, contour: &[DVec2]| {
            let squared = sampling::squared_radii(contour, centre, self.angles);
            match squared.iter().position(|&value| value.is_nan() || value <= 0.0) {
                Some(ray) => Err(not_around(boundary, ray)),
                None => Ok(squared),
            }
        };
        let outer = sample(Boundary::Outer, section.outer)?;
        let inner = sample(Boundary::Inner, section.inner)?;
        self.heights.push(z);
        self.centres.push(centre);
        self.outer.push(outer);
        self.inner.push(inner);
        Ok(())
    }

    /// `l`: mean length of the segments between neighbouring control points of all contours.
    fn segment_mm(&self) -> f64 {
        let total: f64 = (self.outer.iter().chain(&self.inner))
            .map(|squared| {
                let point = |j: usize| direction(j, self.angles) * squared[j % self.angles].sqrt();
                (0..self.angles).map(|j| point(j).distance(point(j + 1))).sum::<f64>()
            })
            .sum();
        total / (2 * self.outer.len() * self.angles) as f64
    }

    fn mean_wall_mm(&self) -> f64 {
        let pairs = self.outer.iter().flatten().zip(self.inner.iter().flatten());
        let total: f64 = pairs.map(|(outer, inner)| (outer.sqrt() - inner.sqrt()).max(0.0)).sum();
        total / (self.outer.len() * self.angles) as f64
    }

    fn lattice(&self, options: &LatticeOptions) -> Result<Lattice, LatticeError> {
        let segment_mm = self.segment_mm();
        let (first, last) = (self.heights[0], self.heights[self.heights.len() - 1]);
        let along = |length: f64| (length / segment_mm).round().max(1.0) + 1.0;
        let slices = match options.axial_points {
            Some(value) if value < 2 => return Err(LatticeError::AxialPoints { value }),
            Some(value) => value as f64,
            None => along(last - first),
        };
        let layers = along(self.mean_wall_mm());
        let nodes = slices * layers * self.angles as f64;
        if nodes.is_nan() || nodes > MAX_NODES as f64 {
            return Err(LatticeError::TooFine {
                alpha_deg: options.alpha_deg,
                nodes,
            });
        }
        let shape = LatticeShape {
            slices: slices as u32,
            angles: self.angles as u32,
            layers: layers as u32,
        };
        let pentahedra = shape.pentahedra();
        let mut rings = self.rings(shape.slices as usize);
        let mut repairs = 0;
        let (positions, narrowed_rays) = loop {
            let (positions, narrowed_rays) = place(&shape, &rings);
            let Some((worst, volume_mm3)) = inverted(&pentahedra, &positions).next() else {
                break (positions, narrowed_rays);
            };
            if repairs == MAX_REPAIRS {
                let cell = shape.cell_coordinates(worst as u32 / 2);
                return Err(LatticeError::Inverted { cell, volume_mm3 });
            }
            smooth_where_inverted(&shape, &pentahedra, &positions, repairs / 8, &mut rings);
            repairs += 1;
        };
        let net_areas = self.outer_areas.iter().zip(&self.inner_areas);
        let integral = |areas: Vec<f64>| CubicSpline::new(&self.heights, areas).integral();
        Ok(Lattice {
            shape,
            zones: vec![Zone::Other; pentahedra.len()],
            centres: rings.iter().map(|ring| ring.centre.extend(ring.z)).collect(),
            positions,
            pentahedra,
            angle_deg: 360.0 / self.angles as f64,
            segment_mm,
            contour_volume_mm3: integral(net_areas.map(|(outer, inner)| outer - inner).collect()),
            capsule_volume_mm3: integral(self.outer_areas.clone()),
            narrowed_rays,
            smoothed_sections: rings.iter().filter(|ring| ring.smoothed).count(),
        })
    }

    /// The sections of the lattice, evenly spaced, the first and the last on the first and last given slice.
    fn rings(&self, count: usize) -> Vec<Ring> {
        let (first, last) = (self.heights[0], self.heights[self.heights.len() - 1]);
        let spline = |value: &dyn Fn(usize) -> f64| {
            CubicSpline::new(&self.heights, (0..self.heights.len()).map(value).collect())
        };
        let of_rays = |squared: &[Vec<f64>]| -> Vec<CubicSpline> {
            (0..self.angles)
                .map(|ray| spline(&|slice| squared[slice][ray]))
                .collect()
        };
        let (outer, inner) = (of_rays(&self.outer), of_rays(&self.inner));
        let x = spline(&|slice| self.centres[slice].x);
        let y = spline(&|slice| self.centres[slice].y);
        (0..count)
            .map(|i| {
                let t = i as f64 / (count - 1) as f64;
                let z = first * (1.0 - t) + last * t;
                Ring {
                    z,
                    centre: DVec2::new(x.bounded_at(z), y.bounded_at(z)),
                    outer: outer.iter().map(|ray| ray.positive_at(z)).collect(),
                    inner: inner.iter().map(|ray| ray.positive_at(z)).collect(),
                    smoothed: false,
                }
            })
            .collect()
    }
}

/// Radii of a boundary, scaled so that the polygon they span has the area of the sectors.
fn polygon_radii(squared: &[f64]) -> Vec<f64> {
    let angles = squared.len();
    let step = TAU / angles as f64;
    let radii: Vec<f64> = squared.iter().map(|value| value.sqrt()).collect();
    let sectors = step * squared.iter().sum::<f64>();
    let polygon = step.sin() * (0..angles).map(|j| radii[j] * radii[(j + 1) % angles]).sum::<f64>();
    let scale = (sectors / polygon).sqrt();
    radii.into_iter().map(|radius| radius * scale).collect()
}

/// Places of all nodes, and on how many rays the lumen was narrowed.
fn place(shape: &LatticeShape, rings: &[Ring]) -> (Vec<DVec3>, usize) {
    let angles = shape.angles as usize;
    let mut narrowed = 0;
    let mut positions = vec![DVec3::ZERO; shape.node_count()];
    for (i, ring) in rings.iter().enumerate() {
        let (outer, inner) = (polygon_radii(&ring.outer), polygon_radii(&ring.inner));
        for j in 0..angles {
            let widest = MAX_LUMEN_SHARE * outer[j];
            narrowed += usize::from(inner[j] > widest);
            let lumen = inner[j].min(widest);
            for k in 0..shape.layers {
                let share = f64::from(k) / f64::from(shape.layers - 1);
                let radius = lumen * (1.0 - share) + outer[j] * share;
                let place = ring.centre + direction(j, angles) * radius;
                positions[shape.index(i as u32, j as u32, k) as usize] = place.extend(ring.z);
            }
        }
    }
    (positions, narrowed)
}

/// The pentahedra that are inverted or nearly so, with their index and their volume.
fn inverted(pentahedra: &[[u32; 6]], positions: &[DVec3]) -> impl Iterator<Item = (usize, f64)> {
    (pentahedra.iter().enumerate())
        .map(|(index, nodes)| (index, volumes(nodes, positions)))
        .filter(|&(_, [least, untwisted])| least.is_nan() || least <= LEAST_VOLUME_SHARE * untwisted)
        .map(|(index, [least, _])| (index, least))
}

/// Volume of a pentahedron with each lateral face cut by the diagonal that leaves less, and that of a straight prism over
/// the mean of its two triangles.
///
/// Where the faces are cut follows from the numbering ([`wedge::split_quad`]); whether a lattice is sound shall not.
fn volumes(nodes: &[u32; 6], positions: &[DVec3]) -> [f64; 2] {
    let corner = |n: usize| positions[nodes[n] as usize] - positions[nodes[0] as usize];
    let cone = |a: usize, b: usize, c: usize| corner(a).dot(corner(b).cross(corner(c)));
    let ends: f64 = wedge::TRIANGLES.iter().map(|&[a, b, c]| cone(a, b, c)).sum();
    let sides: f64 = (wedge::QUADS.iter())
        .map(|&[a, b, c, d]| (cone(a, b, c) + cone(a, c, d)).min(cone(a, b, d) + cone(b, c, d)))
        .sum();
    let doubled_area = |[a, b, c]: [usize; 3]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length();
    let doubled_areas: f64 = wedge::TRIANGLES.iter().map(|&triangle| doubled_area(triangle)).sum();
    [(ends + sides) / 6.0, corner(3).z * doubled_areas / 4.0]
}

/// Evens out the squared radii between the two rays, and on the two sections, of every inverted pentahedron, and of `reach`
/// more rays to either side: each ray gives a quarter of the difference to the next, `reach + 1` times, so the section
/// keeps its area.
fn smooth_where_inverted(
    shape: &LatticeShape,
    pentahedra: &[[u32; 6]],
    positions: &[DVec3],
    reach: usize,
    rings: &mut [Ring],
) {
    let angles = shape.angles as usize;
    let reach = reach.min((angles - 1) / 2);
    let mut touched = vec![vec![false; angles]; rings.len()];
    for (index, _) in inverted(pentahedra, positions) {
        let [i, j, _] = shape.cell_coordinates(index as u32 / 2);
        for offset in 0..=2 * reach {
            let ray = (j as usize + angles + offset - reach) % angles;
            touched[i as usize][ray] = true;
            touched[i as usize + 1][ray] = true;
        }
    }
    for (ring, touched) in rings.iter_mut().zip(&touched) {
        for squared in [&mut ring.outer, &mut ring.inner] {
            for _ in 0..=reach {
                let before = squared.clone();
                for j in (0..angles).filter(|&j| touched[j]) {
                    let next = (j + 1) % angles;
                    let exchanged = 0.25 * (before[next] - before[j]);
                    squared[j] += exchanged;
                    squared[next] -= exchanged;
                }
            }
        }
        ring.smoothed |= touched.contains(&true);
    }
}
