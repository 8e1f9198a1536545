//! Resection: which pentahedra a cut takes, what leaves with them, and what stays behind.

use glam::{DVec3, Vec3};
use resecta_anatomy::Zone;

use crate::collapse::CollapseLaw;
use crate::surface::SurfaceChange;
use crate::sweep::LoopSweep;
use crate::tissue::Tissue;

/// What one cut removed. Volumes count rest volume, so that squeezed tissue weighs no less.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Resection {
    /// Pentahedra removed, rising.
    pub pentahedra: Vec<u32>,
    /// Springs removed, rising.
    pub springs: Vec<u32>,
    /// Springs that stay with less stiffness, rising.
    pub weakened: Vec<u32>,
    /// Nodes removed, rising.
    pub nodes: Vec<u32>,
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
        let mut removed: Vec<u32> = pentahedra
            .iter()
            .copied()
            .filter(|&pentahedron| self.is_pentahedron_alive(pentahedron))
            .collect();
        removed.sort_unstable();
        removed.dedup();
        if removed.is_empty() {
            return Resection::default();
        }
        // Before anything changes.
        let volumes: Vec<f64> = removed.iter().map(|&pentahedron| self.volume_of(pentahedron)).collect();
        let mut resection = self.account(&removed, &volumes);
        let cavity = self.cavity(&removed, &volumes);

        for &pentahedron in &removed {
            self.pentahedra.alive[pentahedron as usize] = false;
            if let Some(volumes) = &mut self.volumes {
                volumes.remove(pentahedron);
            }
            for node in self.pentahedra.nodes[pentahedron as usize] {
                let left = &mut self.nodes.pentahedra_left[node as usize];
                *left -= 1;
                self.nodes.alive[node as usize] = *left > 0;
            }
        }
        for &pentahedron in &removed {
            self.surface.remove(
                pentahedron,
                &self.pentahedra.nodes,
                &self.pentahedra.alive,
                &mut resection.surface,
            );
        }
        let (gone, weakened) = self.weaken_springs(&removed);
        self.lighten_nodes(&cavity);
        resection.law_refused = law.is_some_and(|law| !law.is_usable());
        match law.filter(CollapseLaw::is_usable) {
            Some(CollapseLaw::CompressionForce { share }) => self.compression_force(&gone, share),
            Some(CollapseLaw::HydraulicPressure { resistance_un }) => self.hydraulic_pressure(&cavity, resistance_un),
            None => {}
        }
        resection.nodes = self.remove_bare_nodes(&cavity, &gone);
        resection.springs = gone.iter().map(|(spring, _)| *spring).collect();
        resection.weakened = weakened;
        resection.pentahedra = removed;

        self.living.pentahedra -= resection.pentahedra.len();
        self.living.springs -= resection.springs.len();
        self.living.nodes -= resection.nodes.len();
        self.removed_volume_mm3 += resection.rest_volume_mm3;
        self.forget_what_was_cut();
        cavity.lost.iter().for_each(|loss| self.wake(loss.node));
        self.watch_does(|finer| finer.resect(pentahedra, law));
        resection
    }

    /// Volumes and areas of what is about to go.
    fn account(&self, removed: &[u32], volumes: &[f64]) -> Resection {
        let mut resection = Resection {
            current_volume_mm3: volumes.iter().sum(),
            ..Resection::default()
        };
        for &pentahedron in removed {
            let volume = self.rest_volume_mm3(pentahedron);
            resection.rest_volume_mm3 += volume;
            resection.by_zone_mm3[self.pentahedron_zone(pentahedron).index()] += volume;
            resection.capsule_area_mm2 += f64::from(self.capsule_area_mm2(pentahedron));
        }
        resection
    }

    fn cavity(&mut self, removed: &[u32], volumes: &[f64]) -> Cavity {
        let mut lost: Vec<NodeLoss> = Vec::new();
        let mut centre = DVec3::ZERO;
        self.scratch.marked_nodes.clear();
        for (&pentahedron, &volume) in removed.iter().zip(volumes) {
            centre += self.centroid(pentahedron).as_dvec3() * volume;
            let rest_volume = self.rest_volume_mm3(pentahedron);
            for node in self.pentahedron_nodes(pentahedron) {
                let new = || NodeLoss {
                    node,
                    ratios: 0.0,
                    rest_volume_mm3: 0.0,
                };
                let loss = self.scratch.marked_nodes.entry(node, &mut lost, new);
                loss.ratios += (volume / rest_volume) as f32;
                loss.rest_volume_mm3 += rest_volume;
            }
        }
        lost.sort_unstable_by_key(|loss| loss.node);
        Cavity {
            centre: (centre / volumes.iter().sum::<f64>()).as_vec3(),
            lost,
        }
    }

    fn volume_around(&self, node: u32) -> f64 {
        self.pentahedra_around(node)
            .map(|pentahedron| self.rest_volume_mm3(pentahedron))
            .sum()
    }

    /// Takes from every spring what removed pentahedra lent it. Returns the springs that went, rising, with the stiffness
    /// (µN/mm) they had before, and those that stay, rising.
    fn weaken_springs(&mut self, removed: &[u32]) -> (Vec<(u32, f32)>, Vec<u32>) {
        let mut losses: Vec<SpringLoss> = Vec::new();
        self.scratch.marked_springs.clear();
        for &pentahedron in removed {
            let corners = self.pentahedra.nodes[pentahedron as usize];
            for &(spring, lent) in &self.pentahedra.shares[self.pentahedra.share_range(pentahedron)] {
                if !self.springs.alive[spring as usize] {
                    continue;
                }
                let new = || SpringLoss {
                    spring,
                    lent: 0.0,
                    behind: 0,
                };
                let loss = self.scratch.marked_springs.entry(spring, &mut losses, new);
                loss.lent += lent;
                let ends = &self.springs.nodes[spring as usize];
                loss.behind += u16::from(ends.iter().all(|end| corners.contains(end)));
            }
        }
        losses.sort_unstable_by_key(|loss| loss.spring);
        let (mut gone, mut stay) = (Vec::new(), Vec::new());
        for loss in losses {
            let before = self.springs.stiffness(loss.spring);
            self.weaken(&loss);
            if self.springs.alive[loss.spring as usize] {
                stay.push(loss.spring);
            } else {
                gone.push((loss.spring, before));
            }
        }
        (gone, stay)
    }

    /// Takes from a spring what it lost. It goes when no pentahedron has both its ends any more; one across a cell, which
    /// none has, goes with the first.
    fn weaken(&mut self, loss: &SpringLoss) {
        self.shift_balance(loss.spring, -1.0);
        let index = loss.spring as usize;
        let springs = &mut self.springs;
        springs.behind[index] -= loss.behind;
        let backing = springs.backing[index];
        springs.alive[index] = springs.behind[index] > 0;
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

    /// Takes from every node the mass, and from its bed the stiffness, of what is gone around it.
    fn lighten_nodes(&mut self, cavity: &Cavity) {
        for &NodeLoss {
            node, rest_volume_mm3, ..
        } in &cavity.lost
        {
            let after = self.volume_around(node);
            let left = (after / (after + rest_volume_mm3)) as f32;
            for quantity in [&mut self.nodes.mass, &mut self.nodes.support] {
                quantity.set(node, quantity.at(node) * left);
            }
        }
    }

    /// 2003 paper, II.C: see [`CollapseLaw::CompressionForce`].
    fn compression_force(&mut self, gone: &[(u32, f32)], share: f32) {
        for &(spring, stiffness) in gone {
            let SpringEnds { stays, goes } = match self.ends(spring) {
                Some(ends) => ends,
                None => continue,
            };
            let towards = (self.position(goes) - self.position(stays)).normalize_or_zero();
            let force = stiffness * self.springs.rest_length(spring);
            self.collapse.add(stays, towards * force * share);
        }
    }

    /// The ends of a removed spring, where one stays and the other goes.
    fn ends(&self, spring: u32) -> Option<SpringEnds> {
        let [a, b] = self.springs.nodes[spring as usize];
        match [a, b].map(|node| self.is_node_alive(node)) {
            [true, false] => Some(SpringEnds { stays: a, goes: b }),
            [false, true] => Some(SpringEnds { stays: b, goes: a }),
            _ => None,
        }
    }

    /// Second paper, equations (3) and (4): see [`CollapseLaw::HydraulicPressure`].
    fn hydraulic_pressure(&mut self, cavity: &Cavity, resistance_un: f32) {
        for &NodeLoss { node, ratios, .. } in &cavity.lost {
            if self.is_node_alive(node) {
                let towards = (cavity.centre - self.position(node)).normalize_or_zero();
                self.collapse.add(node, towards * resistance_un * ratios);
            }
        }
    }

    /// Removes the nodes that no pentahedron holds any more. The resection force each had gathered goes, in equal parts,
    /// to its former neighbours that stay.
    fn remove_bare_nodes(&mut self, cavity: &Cavity, gone: &[(u32, f32)]) -> Vec<u32> {
        let bare: Vec<u32> = cavity
            .lost
            .iter()
            .map(|loss| loss.node)
            .filter(|&node| !self.is_node_alive(node))
            .collect();
        // By the node that goes.
        let mut heirs: Vec<SpringEnds> = gone.iter().filter_map(|&(spring, _)| self.ends(spring)).collect();
        heirs.sort_by_key(|ends| ends.goes);
        for &node in &bare {
            let force = self.collapse.take(node);
            self.nodes.inverse_inertia.set(node, 0.0);
            self.nodes.load.set(node, Vec3::ZERO);
            self.nodes.balance.set(node, Vec3::ZERO);
            self.motion.velocities.set(node, Vec3::ZERO);
            if force != Vec3::ZERO {
                let first = heirs.partition_point(|ends| ends.goes < node);
                let end = heirs.partition_point(|ends| ends.goes <= node);
                for heir in &heirs[first..end] {
                    self.collapse.add(heir.stays, force / (end - first) as f32);
                }
            }
        }
        bare
    }
}

/// What a cut leaves: its centre, and what every node it touched lost, by rising node.
struct Cavity {
    centre: Vec3,
    lost: Vec<NodeLoss>,
}

/// What a node lost with the pentahedra removed around it.
struct NodeLoss {
    node: u32,
    /// Sum of V^c / V^0.
    ratios: f32,
    /// Sum of V^0, mm³.
    rest_volume_mm3: f64,
}

/// What a spring lost with the pentahedra removed behind it.
struct SpringLoss {
    spring: u32,
    /// Volume that they lent, mm³.
    lent: f32,
    /// How many had both its ends.
    behind: u16,
}

struct SpringEnds {
    stays: u32,
    goes: u32,
}
