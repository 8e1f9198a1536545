//! Resection: which pentahedra a cut takes or thins, what leaves with them, and what stays behind.

use resecta_anatomy::Zone;

use crate::cavity::Taken;
use crate::collapse::CollapseLaw;
use crate::surface::SurfaceChange;
use crate::sweep::LoopSweep;
use crate::tissue::Tissue;

/// What one cut removed. Volumes count rest volume, so that squeezed tissue weighs no less.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Resection {
    /// Pentahedra removed, rising.
    pub pentahedra: Vec<u32>,
    /// What each pentahedron lost, those that stay with less in them included: volume at rest, mm³; rising.
    pub taken_mm3: Vec<(u32, f64)>,
    /// Springs removed, rising.
    pub springs: Vec<u32>,
    /// Springs that stay with less stiffness, rising.
    pub weakened: Vec<u32>,
    /// Nodes removed, rising.
    pub nodes: Vec<u32>,
    /// Nodes that stay with less mass, rising.
    pub lightened: Vec<u32>,
    /// Volume at rest, mm³.
    pub rest_volume_mm3: f64,
    /// Volume just before the cut, mm³: by so much the enclosed volume fell.
    pub current_volume_mm3: f64,
    /// Volume at rest by [`Zone::index`], mm³.
    pub by_zone_mm3: [f64; Zone::COUNT],
    /// Area of the capsule that went, mm².
    pub capsule_area_mm2: f64,
    /// Whether the collapse law was left out because its number cannot be: see [`CollapseLaw::is_usable`].
    pub law_refused: bool,
    /// What changed on the surface.
    pub surface: SurfaceChange,
}

impl Tissue {
    /// The papers' rule: the living pentahedra near a contact node, under the cutting radius.
    ///
    /// Those around the node itself are always taken; from there the search spreads through shared faces over pentahedra
    /// whose centroid lies within `radius_mm` of the node, so its cost follows what is found and a cut does not reach
    /// through a gap. Rising indices; empty if the node is not alive or the radius not above 0.
    pub fn pentahedra_near(&self, node: u32, radius_mm: f64) -> Vec<u32> {
        if !self.is_node_alive(node) || radius_mm.is_nan() || radius_mm <= 0.0 {
            return Vec::new();
        }
        let centre = self.position(node);
        let mut found: Vec<u32> = self.pentahedra_around(node).collect();
        let mut seen = vec![false; self.pentahedron_count()];
        found.iter().for_each(|&pentahedron| seen[pentahedron as usize] = true);
        let mut next = 0;
        while next < found.len() {
            for neighbour in self.surface.neighbours(found[next], &self.pentahedra.alive) {
                if !std::mem::replace(&mut seen[neighbour as usize], true)
                    && f64::from(self.centroid(neighbour).distance(centre)) <= radius_mm
                {
                    found.push(neighbour);
                }
            }
            next += 1;
        }
        found.sort_unstable();
        found
    }

    /// The living pentahedra whose centroid the loop passes over. Rising indices; empty if the sweep is not finite.
    pub fn pentahedra_swept(&self, sweep: &LoopSweep) -> Vec<u32> {
        if !sweep.is_finite() {
            return Vec::new();
        }
        let (centre, radius) = sweep.bounding_ball();
        let centre = centre.as_vec3();
        // Twice the reach at rest: tissue under the loop is rarely stretched further.
        let reach = radius as f32 + 2.0 * self.reach;
        let near = self.motion.positions.within(centre, reach);
        let first = |&pentahedron: &u32, node: u32| self.pentahedra.nodes[pentahedron as usize][0] == node;
        let candidates = near.into_iter().flat_map(|node| {
            self.pentahedra_around(node)
                .filter(move |pentahedron| first(pentahedron, node))
        });
        let mut swept: Vec<u32> = candidates
            .filter(|&pentahedron| sweep.contains(self.centroid(pentahedron).as_dvec3()))
            .collect();
        swept.sort_unstable();
        swept
    }

    /// Removes pentahedra, and with them the springs and nodes that nothing stands behind any more.
    ///
    /// Indices that name no living pentahedron are passed over. Nodes that stay lose the mass, springs that stay the
    /// stiffness that the pentahedra lent them.
    pub fn resect(&mut self, pentahedra: &[u32], law: Option<CollapseLaw>) -> Resection {
        let losses = self.losses(pentahedra.iter().map(|&pentahedron| (pentahedron, 0.0)));
        self.take(&losses, law.map(|law| (law, Taken::Whole)))
    }

    /// Leaves of each of some pentahedra a share of its rest volume, 0 to 1: a cut finer than they are. The mass of its
    /// nodes and the stiffness of its springs follow; one of which nothing is left goes, as by [`Tissue::resect`]. The law
    /// acts in proportion to what was taken.
    ///
    /// Shares that are no less than what a pentahedron holds are passed over, as are indices that name no living one.
    pub fn thin(&mut self, left: &[(u32, f64)], law: Option<CollapseLaw>) -> Resection {
        let losses = self.losses(left.iter().copied());
        self.take(&losses, law.map(|law| (law, Taken::Part)))
    }

    /// What pentahedra lose if such shares of them are left; rising.
    fn losses(&self, left: impl Iterator<Item = (u32, f64)>) -> Vec<Loss> {
        let loss = |(pentahedron, left): (u32, f64)| {
            let before = self.fill(pentahedron);
            (left < before).then(|| Loss {
                pentahedron,
                share: before - left.max(0.0),
                left: left.max(0.0),
            })
        };
        let mut losses: Vec<Loss> = left.filter_map(loss).collect();
        losses.sort_unstable_by(|one, other| {
            let by_index = one.pentahedron.cmp(&other.pentahedron);
            by_index.then(one.left.total_cmp(&other.left))
        });
        losses.dedup_by_key(|loss| loss.pentahedron);
        losses
    }

    fn take(&mut self, losses: &[Loss], law: Option<(CollapseLaw, Taken)>) -> Resection {
        if losses.is_empty() {
            return Resection::default();
        }
        // Before anything changes.
        let cavity = self.cavity(losses);
        let mut resection = self.account(losses);

        for loss in losses {
            self.pentahedra.fill[loss.pentahedron as usize] = loss.left;
            if let Some(volumes) = &mut self.volumes {
                volumes.weaken(loss.pentahedron, loss.left / (loss.left + loss.share));
            }
        }
        for &pentahedron in &resection.pentahedra {
            self.pentahedra.alive[pentahedron as usize] = false;
            for node in self.pentahedra.nodes[pentahedron as usize] {
                let left = &mut self.nodes.pentahedra_left[node as usize];
                *left -= 1;
                self.nodes.alive[node as usize] = *left > 0;
            }
        }
        for &pentahedron in &resection.pentahedra {
            self.surface.remove(
                pentahedron,
                &self.pentahedra.nodes,
                &self.pentahedra.alive,
                &mut resection.surface,
            );
        }
        let weakened = self.weaken_springs(losses);
        self.lighten_nodes(&cavity);
        resection.law_refused = law.is_some_and(|(law, _)| !law.is_usable());
        if let Some((law, taken)) = law.filter(|(law, _)| law.is_usable()) {
            self.collapse_into(&cavity, &weakened, law, taken);
        }
        resection.nodes = self.remove_bare_nodes(&cavity, &weakened);
        for spring in &weakened {
            if self.springs.alive[spring.spring as usize] {
                resection.weakened.push(spring.spring);
            } else {
                resection.springs.push(spring.spring);
            }
        }
        let touched = cavity.nodes();
        resection.lightened = touched.filter(|&node| self.is_node_alive(node)).collect();

        self.living.pentahedra -= resection.pentahedra.len();
        self.living.springs -= resection.springs.len();
        self.living.nodes -= resection.nodes.len();
        self.removed_volume_mm3 += resection.rest_volume_mm3;
        self.forget_what_was_cut();
        if let Some(water) = &mut self.water {
            water.forget_faces();
        }
        cavity.nodes().for_each(|node| self.wake(node));
        self.watch_does(|finer| finer.take(losses, law));
        resection
    }

    /// Volumes and areas of what is about to go. The capsule goes with the last of a pentahedron.
    fn account(&self, losses: &[Loss]) -> Resection {
        let mut resection = Resection::default();
        for loss in losses {
            let pentahedron = loss.pentahedron;
            let volume = self.rest_volume_mm3(pentahedron) * loss.share;
            resection.rest_volume_mm3 += volume;
            resection.current_volume_mm3 += self.volume_of(pentahedron) * loss.share;
            resection.by_zone_mm3[self.pentahedron_zone(pentahedron).index()] += volume;
            resection.taken_mm3.push((pentahedron, volume));
            if loss.left == 0.0 {
                resection.pentahedra.push(pentahedron);
                resection.capsule_area_mm2 += f64::from(self.capsule_area_mm2(pentahedron));
            }
        }
        resection
    }

    /// Takes from every spring what pentahedra no longer lend it. Returns the springs that lost something, rising.
    fn weaken_springs(&mut self, taken: &[Loss]) -> Vec<WeakenedSpring> {
        let mut losses: Vec<SpringLoss> = Vec::new();
        self.scratch.marked_springs.clear();
        for taken in taken {
            let corners = self.pentahedra.nodes[taken.pentahedron as usize];
            for &(spring, lent) in &self.pentahedra.shares[self.pentahedra.share_range(taken.pentahedron)] {
                if !self.springs.alive[spring as usize] {
                    continue;
                }
                let new = || SpringLoss {
                    spring,
                    lent: 0.0,
                    gone: 0,
                    behind: 0,
                };
                let loss = self.scratch.marked_springs.entry(spring, &mut losses, new);
                loss.lent += lent * taken.share as f32;
                let ends = &self.springs.nodes[spring as usize];
                let goes = taken.left == 0.0;
                loss.gone += u16::from(goes);
                loss.behind += u16::from(goes && ends.iter().all(|end| corners.contains(end)));
            }
        }
        losses.sort_unstable_by_key(|loss| loss.spring);
        let mut weakened = Vec::with_capacity(losses.len());
        for loss in losses {
            let before = self.springs.stiffness(loss.spring);
            self.weaken(&loss);
            weakened.push(WeakenedSpring {
                spring: loss.spring,
                before,
                lost: before - self.springs.stiffness(loss.spring),
            });
        }
        weakened
    }

    /// Takes from a spring what it lost. It goes when no pentahedron has both its ends any more; one across a cell, which
    /// none has, goes with the first.
    fn weaken(&mut self, loss: &SpringLoss) {
        self.shift_balance(loss.spring, -1.0);
        let index = loss.spring as usize;
        let springs = &mut self.springs;
        let is_across = springs.behind[index] == 0;
        springs.behind[index] -= loss.behind;
        springs.alive[index] = if is_across {
            loss.gone == 0
        } else {
            springs.behind[index] > 0
        };
        let backing = springs.backing[index];
        springs.backing[index] = if springs.alive[index] {
            (backing - loss.lent).max(0.0)
        } else {
            0.0
        };
        let left = if backing > 0.0 {
            springs.backing[index] / backing
        } else {
            0.0
        };
        springs.set_stiffness(loss.spring, springs.stiffness(loss.spring) * left);
        self.shift_balance(loss.spring, 1.0);
    }

    /// Adds (`1.0`) or takes away (`-1.0`) the load that balances a spring's pre-tension.
    pub(crate) fn shift_balance(&mut self, spring: u32, sign: f32) {
        if self.pre_tension == 0.0 {
            return;
        }
        let tension = sign * self.pre_tension_of(spring);
        let [a, b] = self.springs.nodes[spring as usize];
        self.nodes.balance.add(a, -tension);
        self.nodes.balance.add(b, tension);
    }
}

/// What a pentahedron loses with a cut.
pub(crate) struct Loss {
    pub pentahedron: u32,
    /// Share of its rest volume.
    pub share: f64,
    /// The share that is left; at 0 the pentahedron goes.
    pub left: f64,
}

/// A spring that a cut took something from.
pub(crate) struct WeakenedSpring {
    pub spring: u32,
    /// Stiffness before, µN/mm.
    pub before: f32,
    /// What it lost of it; all where nothing stands behind it any more.
    pub lost: f32,
}

/// What a spring lost with what was taken behind it.
struct SpringLoss {
    spring: u32,
    /// Volume that was lent, mm³.
    lent: f32,
    /// How many of those went.
    gone: u16,
    /// How many of these had both its ends.
    behind: u16,
}
