//! Cutting: what a tool takes, what is too thin to be left, and what the surface makes of it.

use glam::{DVec3, Vec3};

use crate::crossings::Sample;
use crate::field::{Edit, Field};
use crate::shape::Carrier;
use crate::sublattice::{LANES, Lanes};
use crate::thin::Beside;
use crate::tool::{Bounds, Prepared};
use crate::{FieldError, Tool, capsule, volume};

/// A pentahedron of which less than this share is kept is emptied: it would move, and cost, as if it were whole.
///
/// What goes with it leaves a pit in the tool's wall. Measured on cells of 2 mm, pits reach 0.5 mm at a share of 2 %, and
/// 0.3 mm, plain to see, at 0.5 %; at this share they are half as large.
pub const SLIVER_SHARE: f64 = 0.001;

/// How far behind its start a step still reaches into what its stroke has removed, as a share of the band: a little
/// more than an edge of the sub-lattice. Further behind, values are read by no edge that a wall crosses, and a stroke
/// that turns has long gone another way.
const REACH: f64 = 0.6;

/// What one cut removed, as volume and area at rest, so that squeezed tissue weighs no less.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cut {
    /// What every pentahedron lost, mm³; rising pentahedra, those that lost nothing left out.
    pub removed: Vec<(u32, f64)>,
    /// Their sum, mm³.
    pub removed_mm3: f64,
    /// The part of it that went because too little was left of a pentahedron, mm³.
    pub slivers_mm3: f64,
    /// Area at rest of the capsule ([`crate::SurfaceKind::Capsule`]) that went, mm²; 0 unless the organ was perforated.
    pub capsule_mm2: f64,
    /// Pentahedra of which nothing is left since this cut, rising.
    pub emptied: Vec<u32>,
}

impl Cut {
    /// One cut of this and of what was thin after it.
    fn and_thin(mut self, thin: Cut) -> Self {
        self.removed.extend(thin.removed);
        self.removed.sort_by_key(|&(pentahedron, _)| pentahedron);
        self.removed.dedup_by(|next, first| {
            let is_same = next.0 == first.0;
            if is_same {
                first.1 += next.1;
            }
            is_same
        });
        self.removed_mm3 += thin.removed_mm3;
        self.slivers_mm3 += thin.slivers_mm3;
        self.capsule_mm2 += thin.capsule_mm2;
        self.emptied.extend(thin.emptied);
        self.emptied.sort_unstable();
        self
    }
}

impl Field {
    /// Takes away what is inside a tool, the nodes being at `positions`, mm.
    ///
    /// A tool that does not move (a loop at rest) takes nothing. Of pentahedra of which less than 0.1 % would be left
    /// nothing is left.
    ///
    /// # Errors
    ///
    /// A tool with a number out of range, positions that are not one finite place a node; the field is then unchanged.
    pub fn cut(&mut self, tool: &Tool, positions: &[Vec3]) -> Result<Cut, FieldError> {
        let prepared = tool.prepare(REACH * f64::from(self.band))?;
        self.mesh.check(positions)?;
        let Some(tool) = prepared else {
            return Ok(Cut::default());
        };
        let mut near = self.near(&tool.bounds(), positions);
        let mut edit = self.begin_edit();
        let (mut distances, mut beside) = (Vec::new(), Vec::new());
        self.leave_out(&tool, positions, &mut near);
        for &pentahedron in &near {
            self.evaluate(&mut edit, &tool, pentahedron, positions, &mut distances, &mut beside);
        }
        let changed = self.marked(edit.changed(), &near);
        let cut = self.finish(edit, changed);
        let thin = self.vaporise_thin(&tool, &beside, &near, positions);
        Ok(match thin {
            Some(thin) => cut.and_thin(thin),
            None => cut,
        })
    }

    /// Takes all that is left of some pentahedra: a piece that hangs by nothing, or what the caller removes whole.
    /// Points that they share with others go too, so that the others lose a little where they touch.
    ///
    /// # Errors
    ///
    /// An index that names no pentahedron; the field is then unchanged.
    pub fn empty(&mut self, pentahedra: &[u32]) -> Result<Cut, FieldError> {
        pentahedra
            .iter()
            .try_for_each(|&index| self.mesh.check_pentahedron(index))?;
        let mut pentahedra = pentahedra.to_vec();
        pentahedra.sort_unstable();
        pentahedra.dedup();
        let mut edit = self.begin_edit();
        let changed = self.take(&mut edit, &pentahedra);
        let cut = self.finish(edit, changed);
        if !self.before.is_under_way() {
            self.tidy();
        }
        Ok(cut)
    }

    /// Pentahedra that may reach into the box widened by the band, rising.
    ///
    /// A pentahedron lies inside the hull of its corners. It is left out when all six are beyond the same side of the
    /// box: a byte a node says beyond which.
    pub(crate) fn near(&self, bounds: &Bounds, positions: &[Vec3]) -> Vec<u32> {
        let half = bounds.half + DVec3::splat(f64::from(self.band));
        let [x, y, z] = bounds.axes.map(DVec3::as_vec3);
        // Rounded outwards: a micrometre beside a band of a millimetre.
        let half = half.as_vec3() + Vec3::splat(1e-3);
        let middle = bounds.middle.as_vec3();
        let beyond: Vec<u8> = (positions.iter())
            .map(|&position| {
                let offset = position - middle;
                let local = Vec3::new(offset.dot(x), offset.dot(y), offset.dot(z));
                (local.cmplt(-half).bitmask() | local.cmpgt(half).bitmask() << 3) as u8
            })
            .collect();
        (0u32..)
            .zip(&self.mesh.pentahedra)
            .filter(|(_, nodes)| nodes.iter().fold(u8::MAX, |all, &node| all & beyond[node as usize]) == 0)
            .map(|(pentahedron, _)| pentahedron)
            .collect()
    }

    /// Leaves out what is gone already, and what lies in a ball that is no nearer to the tool than the band.
    fn leave_out(&self, tool: &Prepared, positions: &[Vec3], near: &mut Vec<u32>) {
        near.retain(|&pentahedron| self.kept_mm3(pentahedron) > 0.0);
        let origin = tool.origin();
        let mut kept = 0;
        for first in (0..near.len()).step_by(LANES) {
            let count = LANES.min(near.len() - first);
            let (mut middles, mut radii) = ([[0.0; LANES]; 3], [0.0; LANES]);
            for l in 0..count {
                let corners = self.mesh.pentahedra[near[first + l] as usize].map(|node| positions[node as usize]);
                let middle = corners.iter().sum::<Vec3>() / 6.0;
                let square = corners
                    .iter()
                    .map(|corner| corner.distance_squared(middle))
                    .fold(0.0, f32::max);
                let local = (middle.as_dvec3() - origin).as_vec3();
                (0..3).for_each(|n| middles[n][l] = local[n]);
                radii[l] = square.sqrt();
            }
            let floors = tool.floors(&middles, &radii);
            for l in 0..count {
                if floors[l] < self.band {
                    near[kept] = near[first + l];
                    kept += 1;
                }
            }
        }
        near.truncate(kept);
    }

    /// Lowers the values of a pentahedron, if a point of it is nearer to the tool than the band; lists the points that stay
    /// beside a current.
    fn evaluate(
        &mut self,
        edit: &mut Edit,
        tool: &Prepared,
        pentahedron: u32,
        positions: &[Vec3],
        distances: &mut Vec<[Lanes; 3]>,
        beside: &mut Vec<Beside>,
    ) {
        let (vaporises, thin_mm) = (tool.kerf_mm() > 0.0, tool.thin_mm());
        let origin = tool.origin();
        let nodes = self.mesh.pentahedra[pentahedron as usize];
        let shape = Carrier::new(nodes.map(|node| (positions[node as usize].as_dvec3() - origin).as_vec3()));
        distances.clear();
        distances.extend((self.mesh.sub(pentahedron).lanes.iter()).map(|places| tool.distances(&shape.at(places))));
        if !(distances.as_flattened().as_flattened().iter()).any(|&distance| distance < self.band) {
            return;
        }
        self.touch(edit, pentahedron);
        let (ids, mut values) = self.points.of_and_values(pentahedron);
        let places = &self.mesh.sub(pentahedron).lanes;
        for ((ids, places), [distance, gone, of_chip]) in ids.chunks(LANES).zip(places).zip(distances.iter()) {
            for (lane, &point) in ids.iter().enumerate() {
                let (old, mark) = values.get(point);
                if mark >= edit.seen || old <= -self.band {
                    continue;
                }
                let value = if old > 0.0 { distance[lane] } else { gone[lane] };
                if vaporises && value <= 0.0 {
                    self.before.lower_of_chip(point, of_chip[lane]);
                }
                if value > 0.0 && value < thin_mm {
                    let place = shape.at_one(places.each_ref().map(|lanes| lanes[lane]));
                    beside.push(Beside { point, place });
                }
                if value < old {
                    values.lower(edit, &mut self.before, point, value.max(-self.band));
                } else {
                    values.look_at(edit, point);
                }
            }
        }
    }

    /// Takes the points of pentahedra (rising); returns the pentahedra that changed, rising.
    fn take(&mut self, edit: &mut Edit, pentahedra: &[u32]) -> Vec<u32> {
        let mut around: Vec<u32> = pentahedra.to_vec();
        let is_left = |other: u32| pentahedra.binary_search(&other).is_err();
        for &pentahedron in pentahedra {
            self.touch(edit, pentahedron);
            for local in 0..self.points.of(pentahedron).len() {
                around.extend(self.take_point(edit, pentahedron, local, is_left));
            }
        }
        self.touched_and_changed(edit, around)
    }

    /// Takes a point of a touched pentahedron, where it is kept; returns the pentahedra that share it. `is_left`: of these, what
    /// is not taken with it.
    pub(crate) fn take_point(
        &mut self,
        edit: &mut Edit,
        pentahedron: u32,
        local: usize,
        is_left: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        let point = self.points.of(pentahedron)[local];
        if self.points.values[point as usize] <= 0.0 {
            return Vec::new();
        }
        let nodes = self.mesh.pentahedra[pentahedron as usize];
        let corners: Vec<u32> = self.mesh.sub(pentahedron).parts[local]
            .corners()
            .iter()
            .map(|&corner| nodes[corner])
            .collect();
        let holds = |other: &&u32| {
            corners
                .iter()
                .all(|node| self.mesh.pentahedra[**other as usize].contains(node))
        };
        let sharing: Vec<u32> = self.mesh.around(corners[0]).iter().filter(holds).copied().collect();
        // 0 is removed too, and moves the wall of a neighbour that stays no further than to the point.
        let value = if sharing.iter().any(|&other| is_left(other)) {
            0.0
        } else {
            -self.points.values[point as usize]
        };
        let (_, mut values) = self.points.of_and_values(pentahedron);
        values.lower(edit, &mut self.before, point, value);
        self.before.keep_for_chip(point);
        sharing
    }

    /// Touches pentahedra of which points were taken; returns those of them that changed, rising.
    pub(crate) fn touched_and_changed(&mut self, edit: &mut Edit, mut pentahedra: Vec<u32>) -> Vec<u32> {
        pentahedra.sort_unstable();
        pentahedra.dedup();
        for &pentahedron in &pentahedra {
            self.touch(edit, pentahedron);
        }
        self.marked(edit.changed(), &pentahedra)
    }

    /// Measures what changed, empties slivers and renews the surface.
    pub(crate) fn finish(&mut self, mut edit: Edit, changed: Vec<u32>) -> Cut {
        let mut cut = Cut::default();
        // What was kept before, by pentahedron; of one that comes twice the first holds.
        let mut kept: Vec<(u32, f64)> = Vec::new();
        let mut open = changed;
        let mut slivers = false;
        while !open.is_empty() {
            for &pentahedron in &open {
                let before = self.kept_mm3(pentahedron);
                kept.push((pentahedron, before));
                volume::measure(&self.mesh, &mut self.points, pentahedron, &edit);
                cut.capsule_mm2 += capsule::measure(&self.mesh, &mut self.points, pentahedron);
                if slivers {
                    cut.slivers_mm3 += before - self.kept_mm3(pentahedron);
                }
            }
            open.retain(|&pentahedron| (f64::MIN_POSITIVE..SLIVER_SHARE).contains(&self.fill(pentahedron)));
            open = self.take(&mut edit, &open);
            slivers = true;
        }
        kept.sort_by_key(|&(pentahedron, _)| pentahedron);
        kept.dedup_by_key(|&mut (pentahedron, _)| pentahedron);
        for &(pentahedron, before) in &kept {
            let after = self.kept_mm3(pentahedron);
            if after < before {
                cut.removed.push((pentahedron, before - after));
                cut.removed_mm3 += before - after;
                if after == 0.0 {
                    cut.emptied.push(pentahedron);
                }
            }
            self.before.remember_kept(pentahedron, before);
        }
        self.removed_mm3 += cut.removed_mm3;
        // Where all is kept, or nothing is and nothing was, the surface does not change.
        let matters = |&pentahedron: &u32| {
            let Some(cell) = self.points.index(pentahedron) else {
                return false;
            };
            let is_kept = |&point: &u32| self.points.values[point as usize] > 0.0;
            let points = self.points.of(pentahedron);
            !points.iter().all(is_kept) && (points.iter().any(is_kept) || !self.surface.is_bare(pentahedron, cell))
        };
        let dirty: Vec<u32> = kept
            .into_iter()
            .map(|(pentahedron, _)| pentahedron)
            .filter(matters)
            .collect();
        self.renew(edit, dirty);
        self.emptied.extend(&cut.emptied);
        self.release_emptied();
        cut
    }

    /// Makes the surface anew where the edit reached.
    pub(crate) fn renew(&mut self, edit: Edit, mut dirty: Vec<u32>) {
        dirty.extend(&edit.fresh);
        dirty.sort_unstable();
        dirty.dedup();
        if dirty.is_empty() {
            return;
        }
        let mut turned = self.marked(edit.turned(), &dirty);
        turned.extend(&edit.fresh);
        turned.sort_unstable();
        turned.dedup();
        let points = &self.points;
        let (changes, turns) = (edit.changed(), edit.turned());
        let sample = |point: u32| Sample {
            value: points.values[point as usize],
            is_changed: points.marks[point as usize] >= changes,
            is_turned: points.marks[point as usize] >= turns,
        };
        self.surface.update(&self.mesh, points, sample, &dirty, &turned);
        self.surface.join_coarse(&self.mesh, points, &edit.fresh);
    }
}
