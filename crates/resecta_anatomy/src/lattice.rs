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
//!   volume is not positive, the squared radii of its two sections are smoothed around the section (weights 1/4, 1/2,
//!   1/4, which keeps the area) until it is. [`Lattice::smoothed_sections`] counts them.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::sampling::{self, direction};
use crate::shape::LatticeShape;
use crate::spline::CubicSpline;
use crate::{Case, Zone, quality, wedge, zoning};

/// Greatest radius of the lumen as a share of the capsule's on the same ray.
const MAX_LUMEN_SHARE: f64 = 0.95;

/// Most nodes a lattice may have: far beyond what moves in real time, and still well inside 32-bit indices.
pub const MAX_NODES: usize = 50_000_000;

/// Rounds of smoothing before an inverted pentahedron is reported. Sections are circles long before.
const MAX_REPAIRS: usize = 200;

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

/// Which contour of a section an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// The capsule.
    Outer,
    /// The urethra or other lumen.
    Inner,
}

impl std::fmt::Display for Boundary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Outer => "outer contour",
            Self::Inner => "inner contour",
        })
    }
}

/// Why no lattice could be built. Slices and cells are counted from 0.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LatticeError {
    /// The angle is no number, not positive or leaves fewer than three rays.
    #[error("alpha is {value} degrees; expected more than 0 and at most 120")]
    Alpha {
        /// What was given.
        value: f64,
    },
    /// Too few points along the axis.
    #[error("{value} axial points; expected at least 2")]
    AxialPoints {
        /// What was given.
        value: usize,
    },
    /// The lattice would not fit.
    #[error("alpha of {alpha_deg} degrees gives {nodes:.3e} nodes; expected at most {MAX_NODES}")]
    TooFine {
        /// The angle between rays.
        alpha_deg: f64,
        /// Nodes it would take.
        nodes: f64,
    },
    /// Too few slices to go on.
    #[error("{count} slices; expected at least 2")]
    TooFewSlices {
        /// What was given.
        count: usize,
    },
    /// A height is no number or does not rise.
    #[error("slice {slice}: z is {z} mm; expected a finite number above that of the slice before")]
    Height {
        /// The slice.
        slice: usize,
        /// Its height.
        z: f64,
    },
    /// A contour is not finite, has fewer than three corners or no area.
    #[error(
        "slice {slice}: the {boundary} has {corners} corners and area {area_mm2} mm²; expected at least 3 and more than 0"
    )]
    Contour {
        /// The slice.
        slice: usize,
        /// Which contour.
        boundary: Boundary,
        /// Number of corners.
        corners: usize,
        /// Enclosed area, NaN where a corner is not finite.
        area_mm2: f64,
    },
    /// The contour crosses itself or does not lie around the centre of the lumen.
    #[error("slice {slice}: the {boundary} does not lie around the centre of the lumen at {angle_deg:.1} degrees")]
    NotAround {
        /// The slice.
        slice: usize,
        /// Which contour.
        boundary: Boundary,
        /// Direction of the ray, from `+x` towards `+y`.
        angle_deg: f64,
    },
    /// The case has a slice without urethra: it was not completed.
    #[error("slice {slice} has no urethra; complete the case first")]
    MissingUrethra {
        /// The slice.
        slice: usize,
    },
    /// A pentahedron stayed without positive volume.
    #[error("cell (slice {}, ray {}, layer {}) has a pentahedron of {volume_mm3} mm³", cell[0], cell[1], cell[2])]
    Inverted {
        /// Slice, ray and layer.
        cell: [u32; 3],
        /// Its volume.
        volume_mm3: f64,
    },
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
    /// Sections smoothed so that no pentahedron is inverted.
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
        let checked_area = |boundary, contour: &[DVec2]| {
            let area_mm2 = sampling::signed_area(contour).abs();
            let sound = contour.len() >= 3 && contour.iter().all(|corner| corner.is_finite()) && area_mm2 > 0.0;
            sound.then_some(area_mm2).ok_or(LatticeError::Contour {
                slice,
                boundary,
                corners: contour.len(),
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
            let Some((worst, volume_mm3)) = first_inverted(&pentahedra, &positions) else {
                break (positions, narrowed_rays);
            };
            if repairs == MAX_REPAIRS {
                let cell = shape.cell_coordinates(worst as u32 / 2);
                return Err(LatticeError::Inverted { cell, volume_mm3 });
            }
            repairs += 1;
            smooth_where_inverted(&shape, &pentahedra, &positions, &mut rings);
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

/// The first pentahedron whose volume is not positive, with that volume.
fn first_inverted(pentahedra: &[[u32; 6]], positions: &[DVec3]) -> Option<(usize, f64)> {
    (pentahedra.iter().enumerate())
        .map(|(index, nodes)| (index, wedge::volume(nodes, |node| positions[node as usize])))
        .find(|&(_, volume)| volume.is_nan() || volume <= 0.0)
}

fn smooth_where_inverted(shape: &LatticeShape, pentahedra: &[[u32; 6]], positions: &[DVec3], rings: &mut [Ring]) {
    let mut touched = vec![false; rings.len()];
    for (index, nodes) in pentahedra.iter().enumerate() {
        let volume = wedge::volume(nodes, |node| positions[node as usize]);
        if volume.is_nan() || volume <= 0.0 {
            let [i, ..] = shape.cell_coordinates(index as u32 / 2);
            touched[i as usize] = true;
            touched[i as usize + 1] = true;
        }
    }
    for (ring, _) in rings.iter_mut().zip(touched).filter(|(_, touched)| *touched) {
        ring.outer = smoothed(&ring.outer);
        ring.inner = smoothed(&ring.inner);
        ring.smoothed = true;
    }
}

fn smoothed(squared: &[f64]) -> Vec<f64> {
    let count = squared.len();
    (0..count)
        .map(|j| 0.25 * squared[(j + count - 1) % count] + 0.5 * squared[j] + 0.25 * squared[(j + 1) % count])
        .collect()
}
