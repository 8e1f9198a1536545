//! The bed as a whole gives way: an organ shifts, and turns about the place where it is anchored.
//!
//! The bed of every node (`bed.rs`) is the tissue next to the organ, a centimetre of it. What that rests on moves, too: held by nothing else,
//! an organ would be as hard to move as its bed is to squeeze. So the beds are springs to a frame that itself is held by two springs, one
//! against shifting, one against turning about an anchor. The frame takes the place in which its springs balance the beds', late by
//! [`YIELDS_IN_S`]: what surrounds an organ is as viscous as the organ. Its nodes go with it and draw it on, so that an organ that is let go
//! comes back more slowly, by as much as its beds together are stiffer than its frame: with a time constant of `YIELDS_IN_S (1 + w / k)`,
//! some 1.4 s in the shipped glands.
//!
//! With `d` the way of a node from its rest place, `r` that place from the anchor and `w` the stiffness of its bed, the frame's shift `t` and
//! turn `θ` (small, so that places turn by `θ × r`) make `Σ w |d - t - θ × r|² + k_t |t|² + k_r |θ|²` least: six linear equations. The
//! force of the frame on a node is `w (t + θ × r)`, beside that of its bed. It stays within an advance.
//!
//! What moves the organ are tools and the user's loads. Forces that stand for what happens within it, or that the same water next door takes
//! up, would not balance here and would push it about: those of resections (`collapse.rs`), of the pre-tension and of the water. Their sum and
//! moment are left out.

use glam::{DMat3, DVec3, Vec3};

use crate::tissue::{EditError, Tissue, check_range};
use crate::vectors::{SiteVectors, Vectors};

/// Time in which the frame makes up for most of what it is behind while its nodes stay, s. Ours, without a source: an organ that is let go
/// is back within seconds.
const YIELDS_IN_S: f64 = 0.05;

/// Tissue that sleeps is woken when the frame has moved a node by more than this since, mm.
const WAKING_MM: f64 = 1e-3;

/// How an organ as a whole gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mobility {
    /// Where it is anchored: it turns about this place, mm.
    pub anchor: Vec3,
    /// Stiffness against shifting, N/mm; above 0.
    pub shift_n_per_mm: f32,
    /// Stiffness against turning about the anchor, N mm for a radian; above 0.
    pub turn_n_mm: f32,
}

/// The frame of a tissue's beds.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    mobility: Mobility,
    moved: Moved,
    /// Where it was when the tissue was last woken for it.
    woken_at: Moved,
    /// Its forces on the nodes, µN.
    pub forces: Vectors,
}

impl Frame {
    /// What its two springs hold, µN mm.
    pub fn energy(&self) -> f64 {
        let [shift, turn] = self.mobility.stiffnesses();
        0.5 * (shift * self.moved.shift.length_squared() + turn * self.moved.turn.length_squared())
    }
}

/// How far a frame has moved from where it was at first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Moved {
    /// mm.
    shift: DVec3,
    /// Along the axis, rad.
    turn: DVec3,
}

impl Moved {
    /// The way of what rests so far from the anchor, mm.
    fn at(&self, place: DVec3) -> DVec3 {
        self.shift + self.turn.cross(place)
    }

    /// A share of the way to another one further on.
    fn towards(&self, other: Moved, share: f64) -> Moved {
        Moved {
            shift: self.shift.lerp(other.shift, share),
            turn: self.turn.lerp(other.turn, share),
        }
    }
}

impl Mobility {
    /// The frame that balances some nodes: how far the rest place of each is from the anchor, its way from there, mm, and the stiffness of its
    /// bed, µN/mm. `within`: places and forces, µN, that move no organ.
    fn balanced(
        &self,
        nodes: impl Iterator<Item = (DVec3, DVec3, f64)>,
        within: impl Iterator<Item = (DVec3, DVec3)>,
    ) -> Moved {
        balanced(nodes, within, self.stiffnesses())
    }

    /// Against shifting, µN/mm, and turning, µN mm.
    fn stiffnesses(&self) -> [f64; 2] {
        [self.shift_n_per_mm, self.turn_n_mm].map(|newtons| f64::from(newtons) * 1e6)
    }

    fn off_anchor(&self, rest: Vec3) -> DVec3 {
        rest.as_dvec3() - self.anchor.as_dvec3()
    }
}

/// See [`Mobility::balanced`]; with stiffnesses against shifting, µN/mm, and turning, µN mm.
fn balanced(
    nodes: impl Iterator<Item = (DVec3, DVec3, f64)>,
    within: impl Iterator<Item = (DVec3, DVec3)>,
    [against_shift, against_turn]: [f64; 2],
) -> Moved {
    let (mut whole, mut lever, mut pull, mut moment) = (against_shift, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let mut inertia = DMat3::from_diagonal(DVec3::splat(against_turn));
    for (place, way, stiffness) in nodes {
        whole += stiffness;
        lever += place * stiffness;
        pull += way * stiffness;
        moment += place.cross(way) * stiffness;
        inertia += turning(place) * stiffness;
    }
    for (place, force) in within {
        pull -= force;
        moment -= place.cross(force);
    }
    if whole <= 0.0 {
        return Moved::default();
    }
    // Of the balance of forces, the shift: put into that of moments.
    let turn = (inertia - turning(lever) * (1.0 / whole)).inverse() * (moment - lever.cross(pull) / whole);
    let turn = if turn.is_finite() { turn } else { DVec3::ZERO };
    Moved {
        shift: (pull - turn.cross(lever)) / whole,
        turn,
    }
}

/// What `r × (θ × r)` is of `θ`.
fn turning(r: DVec3) -> DMat3 {
    let along = DMat3::from_cols(r * r.x, r * r.y, r * r.z);
    DMat3::from_diagonal(DVec3::splat(r.length_squared())) - along
}

impl Tissue {
    /// The mobility that was set; `None` if the bed is fixed in space.
    pub fn mobility(&self) -> Option<Mobility> {
        self.frame.as_ref().map(|frame| frame.mobility)
    }

    /// Sets how the organ as a whole moves; `None` fixes its bed in space, which costs nothing.
    ///
    /// # Errors
    ///
    /// When a stiffness is not above 0, or a number is not finite; the bed is as before.
    pub fn set_mobility(&mut self, mobility: Option<Mobility>) -> Result<(), EditError> {
        if let Some(Mobility {
            anchor,
            shift_n_per_mm,
            turn_n_mm,
        }) = mobility
        {
            let range = f32::MIN_POSITIVE..=f32::MAX;
            for (field, value) in [("shift_n_per_mm", shift_n_per_mm), ("turn_n_mm", turn_n_mm)] {
                check_range("tissue", 0, field, value, range.clone(), "a finite number above 0")?;
            }
            for coordinate in anchor.to_array() {
                check_range("tissue", 0, "anchor", coordinate, -1e6..=1e6, "-1e6 to 1e6 mm")?;
            }
        }
        self.sleep.wake_all();
        self.frame = mobility.map(|mobility| Frame {
            mobility,
            moved: Moved::default(),
            woken_at: Moved::default(),
            forces: Vectors::zero(self.springs.layout().sites()),
        });
        self.watch_does(|finer| finer.set_mobility(mobility));
        Ok(())
    }

    /// How far the bed has moved a place of the rest shape, mm.
    pub fn bed_moves(&self, rest: Vec3) -> Vec3 {
        let frame = self.frame.as_ref();
        frame.map_or(Vec3::ZERO, |frame| {
            frame.moved.at(frame.mobility.off_anchor(rest)).as_vec3()
        })
    }

    /// Lets the frame follow the organ for a time, and works out its forces.
    pub(crate) fn yield_bed(&mut self, duration_s: f64) {
        let Some(mut frame) = self.frame.take() else { return };
        let mobility = frame.mobility;
        let off_anchor = |node: u32| mobility.off_anchor(self.rest_position(node));
        let held = self.held_nodes().map(|(node, stiffness)| {
            let way = self.position64(node) - self.rest_position(node).as_dvec3();
            (off_anchor(node), way, stiffness)
        });
        let within = self.forces_within().map(|(node, force)| (off_anchor(node), force));
        let share = 1.0 - (-duration_s / YIELDS_IN_S).exp();
        frame.moved = frame.moved.towards(mobility.balanced(held, within), share);
        frame.forces.values.fill(SiteVectors::default());
        let mut furthest_mm = 0.0_f64;
        for (node, stiffness) in self.held_nodes() {
            let place = off_anchor(node);
            let way = frame.moved.at(place);
            frame.forces.add(node, (way * stiffness).as_vec3());
            furthest_mm = furthest_mm.max(way.distance(frame.woken_at.at(place)));
        }
        if furthest_mm > WAKING_MM {
            frame.woken_at = frame.moved;
            self.sleep.wake_all();
        }
        self.frame = Some(frame);
    }

    /// The living nodes and the forces on them that move no organ, µN.
    fn forces_within(&self) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        let nodes = (0..self.node_count() as u32).filter(|&node| self.is_node_alive(node));
        nodes.map(|node| {
            let of_water = self.water.as_ref().map_or(Vec3::ZERO, |water| water.forces.at(node));
            let force = self.nodes.balance.at(node) + self.collapse.current().at(node) + of_water;
            (node, force.as_dvec3())
        })
    }

    /// Forces on the nodes that stay through an advance, µN: of the water, and of what the bed rests on.
    pub(crate) fn forces_of_surroundings(&self) -> impl Iterator<Item = &Vectors> {
        let of_water = self.water.as_ref().map(|water| &water.forces);
        let of_frame = self.frame.as_ref().map(|frame| &frame.forces);
        of_water.into_iter().chain(of_frame)
    }

    /// The living nodes that the bed holds, and with what stiffness, µN/mm.
    fn held_nodes(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let nodes = (0..self.node_count() as u32).filter(|&node| self.is_node_alive(node));
        let stiffness = |node: u32| (node, f64::from(self.nodes.support.at(node)));
        nodes.map(stiffness).filter(|(_, stiffness)| *stiffness > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STIFFNESSES: [f64; 2] = [0.5e6, 150e6];

    /// A ring of held places, which lie off the anchor, moved by a shift and a turn.
    fn ring(shift: DVec3, turn: DVec3) -> Vec<(DVec3, DVec3, f64)> {
        let place = |n: u32| {
            let (sin, cos) = (0.7 * f64::from(n)).sin_cos();
            DVec3::new(20.0 * cos, 15.0 * sin, 10.0 + f64::from(n))
        };
        let moved = |n: u32| (place(n), shift + turn.cross(place(n)), 2e3 + 10.0 * f64::from(n));
        (0..30).map(moved).collect()
    }

    #[test]
    fn a_frame_without_stiffness_goes_where_the_organ_went() {
        let (shift, turn) = (DVec3::new(1.0, -0.5, 0.3), DVec3::new(0.02, 0.01, -0.03));
        let found = balanced(ring(shift, turn).into_iter(), std::iter::empty(), [0.0; 2]);
        assert!(
            found.shift.distance(shift) < 1e-9 && found.turn.distance(turn) < 1e-9,
            "{found:?}"
        );
    }

    #[test]
    fn forces_and_moments_of_frame_and_beds_balance() {
        let nodes = ring(DVec3::new(1.0, -0.5, 0.3), DVec3::new(0.02, 0.01, -0.03));
        let Moved { shift, turn } = balanced(nodes.iter().copied(), std::iter::empty(), STIFFNESSES);
        let beds = |&(place, way, stiffness): &(DVec3, DVec3, f64)| {
            let force = (way - shift - turn.cross(place)) * stiffness;
            (force, place.cross(force))
        };
        let (force, moment) = nodes
            .iter()
            .map(beds)
            .fold((DVec3::ZERO, DVec3::ZERO), |sum, next| (sum.0 + next.0, sum.1 + next.1));
        assert!(force.distance(shift * STIFFNESSES[0]) < 1e-6 * force.length());
        assert!(moment.distance(turn * STIFFNESSES[1]) < 1e-6 * moment.length());
    }

    #[test]
    fn nothing_that_is_held_moves_nothing() {
        assert_eq!(
            balanced(std::iter::empty(), std::iter::empty(), [0.0; 2]),
            Moved::default()
        );
    }
}
