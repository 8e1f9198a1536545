//! Numbers and three-dimensional vectors of all nodes, site by site (`sites.rs`), the layout of every hot loop.

use std::cell::Cell;
use std::ops::{Add, Sub};

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

use crate::sites::{LANES, Lanes, Sites};
use crate::widest::{Widened, fused, with_widest};

/// The vectors of a site, by component.
pub(crate) type SiteVectors = [Lanes; 3];

/// Where the number of a node lies.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Place {
    site: u32,
    lane: u32,
}

/// The vectors of a site in registers, by component.
///
/// Everything about them is inlined by force: what is not has been compiled for narrower registers. `array::map` is not.
#[derive(Clone, Copy)]
pub(crate) struct Registers<S: Simd> {
    pub x: f32x8<S>,
    pub y: f32x8<S>,
    pub z: f32x8<S>,
}

/// One number a node; 0 in lanes that hold no node.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scalars {
    pub values: Vec<Lanes>,
    sites: Sites,
}

/// One vector a node; 0 in lanes that hold no node.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Vectors {
    pub values: Vec<SiteVectors>,
    sites: Sites,
}

/// The vectors of all nodes, to be read.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub values: &'a [SiteVectors],
    pub sites: Sites,
}

impl View<'_> {
    #[inline(always)]
    pub fn at(&self, node: u32) -> Vec3 {
        let (site, lane) = self.sites.place(node);
        let [x, y, z] = &self.values[site];
        Vec3::new(x.0[lane], y.0[lane], z.0[lane])
    }
}

impl Scalars {
    pub fn zero(sites: Sites) -> Scalars {
        Scalars {
            values: vec![Lanes::default(); sites.count()],
            sites,
        }
    }

    /// The numbers of the nodes, in their order.
    pub fn of(sites: Sites, numbers: impl IntoIterator<Item = f32>) -> Scalars {
        let mut all = Scalars::zero(sites);
        for (node, number) in (0..).zip(numbers) {
            all.set(node, number);
        }
        all
    }

    #[inline(always)]
    pub fn place(&self, node: u32) -> Place {
        let (site, lane) = self.sites.place(node);
        Place {
            site: site as u32,
            lane: lane as u32,
        }
    }

    #[inline(always)]
    pub fn at(&self, node: u32) -> f32 {
        let (site, lane) = self.sites.place(node);
        self.values[site].0[lane]
    }

    #[inline(always)]
    pub fn set(&mut self, node: u32, number: f32) {
        let (site, lane) = self.sites.place(node);
        self.values[site].0[lane] = number;
    }

    /// The numbers of all nodes, in their order.
    pub fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        (0..self.sites.nodes() as u32).map(|node| self.at(node))
    }
}

impl Vectors {
    pub fn zero(sites: Sites) -> Vectors {
        Vectors {
            values: vec![SiteVectors::default(); sites.count()],
            sites,
        }
    }

    /// The vectors of the nodes, in their order.
    pub fn of(sites: Sites, vectors: impl IntoIterator<Item = Vec3>) -> Vectors {
        let mut all = Vectors::zero(sites);
        for (node, vector) in (0..).zip(vectors) {
            all.set(node, vector);
        }
        all
    }

    /// Where the nodes are.
    #[cfg(test)]
    pub fn sites(&self) -> Sites {
        self.sites
    }

    #[inline(always)]
    pub fn copy_from(&mut self, other: &Vectors) {
        self.values.copy_from_slice(&other.values);
    }

    #[inline(always)]
    pub fn view(&self) -> View<'_> {
        View {
            values: &self.values,
            sites: self.sites,
        }
    }

    #[inline(always)]
    pub fn at(&self, node: u32) -> Vec3 {
        self.view().at(node)
    }

    #[inline(always)]
    pub fn set(&mut self, node: u32, vector: Vec3) {
        let (site, lane) = self.sites.place(node);
        for (component, value) in self.values[site].iter_mut().zip(vector.to_array()) {
            component.0[lane] = value;
        }
    }

    #[inline(always)]
    pub fn add(&mut self, node: u32, vector: Vec3) {
        self.set(node, self.at(node) + vector);
    }

    /// The vector of the node at a place.
    #[inline(always)]
    pub fn at_place(&self, Place { site, lane }: Place) -> Vec3 {
        let [x, y, z] = &self.values[site as usize];
        let lane = lane as usize % LANES;
        Vec3::new(x.0[lane], y.0[lane], z.0[lane])
    }

    /// Adds to the vector of the node at a place.
    #[inline(always)]
    pub fn add_at(&mut self, Place { site, lane }: Place, vector: Vec3) {
        let values = &mut self.values[site as usize];
        for (component, value) in values.iter_mut().zip(vector.to_array()) {
            component.0[lane as usize % LANES] += value;
        }
    }

    /// The nodes whose vector ends within `radius` of a point. Looks at all, some ten thousand in 3 µs.
    pub fn within(&self, centre: Vec3, radius: f32) -> Vec<u32> {
        with_widest(Within {
            vectors: self,
            centre,
            radius,
        })
    }

    /// The nodes whose vector ends near any of some segments. Looks at all.
    pub fn near(&self, segments: &[Segment]) -> Vec<u32> {
        with_widest(Near {
            vectors: self,
            segments,
        })
    }

    /// `count` sites from each of `firsts` on, to be read and written side by side though they overlap.
    #[inline(always)]
    pub fn shared<const N: usize>(&mut self, firsts: [usize; N], count: usize) -> [&[Cell<SiteVectors>]; N] {
        let cells = Cell::from_mut(&mut self.values[..]).as_slice_of_cells();
        firsts.map(|first| &cells[first..][..count])
    }
}

/// Nodes near any of some segments: see [`Vectors::near`].
struct Near<'a> {
    vectors: &'a Vectors,
    segments: &'a [Segment],
}

/// A segment with a radius, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Its ends.
    pub ends: [Vec3; 2],
    /// How far from it something counts as near.
    pub radius_mm: f32,
}

impl Widened for Near<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<u32> {
        let Near { vectors, segments } = self;
        let splat = |vector: Vec3| Registers {
            x: f32x8::splat(simd, vector.x),
            y: f32x8::splat(simd, vector.y),
            z: f32x8::splat(simd, vector.z),
        };
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let mut near = Vec::new();
        for (site, places) in vectors.values.iter().enumerate() {
            let places = Registers::load(simd, places);
            let mut is_near = zero.simd_gt(one);
            for segment in segments {
                let [a, b] = segment.ends;
                let along = b - a;
                let squared = along.length_squared();
                let per_squared = if squared > 0.0 { 1.0 / squared } else { 0.0 };
                let (away, way) = (places - splat(a), splat(along));
                let product = fused(away.x, way.x, fused(away.y, way.y, away.z * way.z));
                let share = (product * f32x8::splat(simd, per_squared)).max(zero).min(one);
                let squares = (away - way.times(share)).length_squared();
                is_near |= squares.simd_le(f32x8::splat(simd, segment.radius_mm * segment.radius_mm));
            }
            if is_near.any_true() {
                let lanes = (0..LANES).filter(|&lane| is_near.test(lane));
                near.extend(lanes.filter_map(|lane| vectors.sites.node(site, lane)));
            }
        }
        near
    }
}

struct Within<'a> {
    vectors: &'a Vectors,
    centre: Vec3,
    radius: f32,
}

impl Widened for Within<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<u32> {
        let Within {
            vectors,
            centre,
            radius,
        } = self;
        let centre = Registers {
            x: f32x8::splat(simd, centre.x),
            y: f32x8::splat(simd, centre.y),
            z: f32x8::splat(simd, centre.z),
        };
        let reach = f32x8::splat(simd, radius * radius);
        let mut within = Vec::new();
        for (site, places) in vectors.values.iter().enumerate() {
            let squares = (Registers::load(simd, places) - centre).length_squared();
            if squares.simd_le(reach).any_true() {
                let near = (0..LANES).filter(|&lane| squares[lane] <= radius * radius);
                within.extend(near.filter_map(|lane| vectors.sites.node(site, lane)));
            }
        }
        within
    }
}

/// A site's numbers in a register.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, lanes: &Lanes) -> f32x8<S> {
    f32x8::from_slice(simd, &lanes.0)
}

/// The other way.
#[inline(always)]
pub(crate) fn stored<S: Simd>(register: f32x8<S>) -> Lanes {
    let mut lanes = Lanes::default();
    register.store_slice(&mut lanes.0);
    lanes
}

impl<S: Simd> Registers<S> {
    #[inline(always)]
    pub fn zero(simd: S) -> Registers<S> {
        let zero = f32x8::splat(simd, 0.0);
        Registers {
            x: zero,
            y: zero,
            z: zero,
        }
    }

    #[inline(always)]
    pub fn load(simd: S, vectors: &SiteVectors) -> Registers<S> {
        Registers {
            x: load(simd, &vectors[0]),
            y: load(simd, &vectors[1]),
            z: load(simd, &vectors[2]),
        }
    }

    #[inline(always)]
    pub fn stored(self) -> SiteVectors {
        [stored(self.x), stored(self.y), stored(self.z)]
    }

    /// Each vector times its factor.
    #[inline(always)]
    pub fn times(self, factor: f32x8<S>) -> Registers<S> {
        Registers {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    /// Each vector times its factor, plus another; rounded once.
    #[inline(always)]
    pub fn times_plus(self, factor: f32x8<S>, other: Registers<S>) -> Registers<S> {
        Registers {
            x: fused(factor, self.x, other.x),
            y: fused(factor, self.y, other.y),
            z: fused(factor, self.z, other.z),
        }
    }

    #[inline(always)]
    pub fn length_squared(self) -> f32x8<S> {
        fused(self.x, self.x, fused(self.y, self.y, self.z * self.z))
    }

    /// The product of each vector with another.
    #[inline(always)]
    pub fn cross(self, other: Registers<S>) -> Registers<S> {
        Registers {
            x: fused(self.y, other.z, -(self.z * other.y)),
            y: fused(self.z, other.x, -(self.x * other.z)),
            z: fused(self.x, other.y, -(self.y * other.x)),
        }
    }

    /// The product of each vector with another, plus a third.
    #[inline(always)]
    pub fn cross_plus(self, other: Registers<S>, third: Registers<S>) -> Registers<S> {
        Registers {
            x: fused(self.y, other.z, fused(-self.z, other.y, third.x)),
            y: fused(self.z, other.x, fused(-self.x, other.z, third.y)),
            z: fused(self.x, other.y, fused(-self.y, other.x, third.z)),
        }
    }

    /// Turned on: lane `n` gets what lane `(n + TURN) % 8` held.
    #[inline(always)]
    pub fn turned<const TURN: usize>(self) -> Registers<S> {
        if TURN == 0 {
            return self;
        }
        Registers {
            x: self.x.slide::<TURN>(self.x),
            y: self.y.slide::<TURN>(self.y),
            z: self.z.slide::<TURN>(self.z),
        }
    }
}

impl<S: Simd> Add for Registers<S> {
    type Output = Registers<S>;

    #[inline(always)]
    fn add(self, other: Registers<S>) -> Registers<S> {
        Registers {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }
}

impl<S: Simd> Sub for Registers<S> {
    type Output = Registers<S>;

    #[inline(always)]
    fn sub(self, other: Registers<S>) -> Registers<S> {
        Registers {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }
}

const _: () = assert!(LANES == 8, "registers are f32x8");
