//! Contacts: a moving rigid body that a point of the tissue may not enter.
//!
//! A contact holds after every substep, against the body where it is by then: a fast body pushes tissue along its whole way, and
//! nothing has to be found again on the way. A point inside the body goes out along the gradient of the body's distance. A body that is
//! thin against its way may pass a point: then the point goes out in a direction of its own, that into the tissue, however far it was
//! passed. So do all points of a face alike, where the gradient would drive those on either side of a wire apart.
//!
//! The velocity of a touched point against the body is lost; none is gained from a body that pushes. Tissue is so viscous that
//! it would lose it within a millisecond (`Material::damping_rate`), and raised inertias (`bound.rs`) would keep it for longer than that.
//! What the velocity that is lost takes of momentum is the body's force on the point: at rest it equals what the tissue presses with.

use glam::Vec3;

use crate::kick::Kicks;
use crate::ranges::{FURTHEST_MM, within};
use crate::tissue::Motion;
use crate::vectors::{Place, Scalars, Vectors};

/// A point of the tissue: where the weighted mean of some nodes is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissuePoint {
    nodes: [u32; 6],
    /// Together 1; 0 past the last node.
    weights: [f32; 6],
}

impl TissuePoint {
    /// A node.
    pub fn node(node: u32) -> TissuePoint {
        TissuePoint::on_triangle([node; 3], [1.0, 0.0, 0.0])
    }

    /// A point of a triangle, by barycentric weights; 0 to 1, together 1.
    pub fn on_triangle([a, b, c]: [u32; 3], [at_a, at_b, at_c]: [f32; 3]) -> TissuePoint {
        TissuePoint::in_pentahedron([a, b, c, a, a, a], [at_a, at_b, at_c, 0.0, 0.0, 0.0])
    }

    /// A point of a pentahedron, by the weights of its corners; 0 to 1, together 1.
    pub fn in_pentahedron(nodes: [u32; 6], weights: [f32; 6]) -> TissuePoint {
        TissuePoint { nodes, weights }
    }

    /// The nodes that count, and their weights.
    #[inline]
    pub fn parts(&self) -> impl Iterator<Item = (u32, f32)> + Clone {
        self.nodes
            .into_iter()
            .zip(self.weights)
            .filter(|(_, weight)| *weight != 0.0)
    }
}

/// A rigid body that pushes tissue, with its way through one advance. Lengths mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pusher {
    /// The half space `normal · x < offset`: tissue stays where `normal` points.
    HalfSpace {
        /// Unit direction in which tissue is pushed.
        normal: Vec3,
        /// Offset of the plane along the normal when the advance begins and when it ends.
        offset_mm: [f32; 2],
    },
    /// All that lies within a radius of a segment. Its ends move straight on, at even speed.
    Capsule {
        /// The ends of the segment when the advance begins.
        from: [Vec3; 2],
        /// The ends when it ends.
        to: [Vec3; 2],
        /// Above 0.
        radius_mm: f32,
    },
}

impl Pusher {
    fn is_usable(&self) -> bool {
        let near = |value: f32| within(value, -FURTHEST_MM, FURTHEST_MM);
        let is_near = |place: &Vec3| place.to_array().into_iter().all(near);
        match self {
            Pusher::HalfSpace { normal, offset_mm } => {
                normal.is_finite() && offset_mm.iter().all(|&offset| near(offset))
            }
            Pusher::Capsule { from, to, radius_mm } => {
                from.iter().chain(to).all(is_near) && *radius_mm > 0.0 && near(*radius_mm)
            }
        }
    }

    /// Where it is at a time, 0 to 1 over an advance of that duration, s.
    fn at(&self, time: f32, duration_s: f32) -> Body {
        let rate = 1.0 / duration_s;
        match *self {
            Pusher::HalfSpace {
                normal,
                offset_mm: [first, last],
            } => Body::HalfSpace {
                normal,
                offset: first + time * (last - first),
                speed: (last - first) * rate,
            },
            Pusher::Capsule { from, to, radius_mm } => {
                let ends = [0, 1].map(|end: usize| from[end].lerp(to[end], time));
                let [a, b] = ends;
                let velocities = [0, 1].map(|end: usize| (to[end] - from[end]) * rate);
                let along = b - a;
                let squared = along.length_squared();
                Body::Capsule {
                    a,
                    along,
                    per_squared: if squared > 0.0 { 1.0 / squared } else { 0.0 },
                    velocity: velocities[0],
                    turning: velocities[1] - velocities[0],
                    radius: radius_mm,
                }
            }
        }
    }
}

/// Keeps one point of the tissue out of a body during one advance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The point.
    pub point: TissuePoint,
    /// The body.
    pub pusher: Pusher,
    /// The unit direction in which a capsule pushes the point; `None` for the gradient of its distance, where the capsule is thick enough
    /// for no point to pass its middle.
    pub inward: Option<Vec3>,
    /// How deep the point may lie inside the body when the advance begins, mm; 0 or more. For tissue that the body has been put into:
    /// it is moved out at [`recovery_mm_per_s`](Self::recovery_mm_per_s), not thrown aside at once.
    pub overlap_mm: f32,
    /// How fast that becomes less, mm/s; 0 or more.
    pub recovery_mm_per_s: f32,
    /// How deep the point may lie inside the body for good, mm; 0 or more.
    pub slack_mm: f32,
    /// The most that the body pushes the point with, µN; above 0. Tissue that presses harder goes into it.
    pub most_force_un: f32,
}

impl Contact {
    /// Keeps a point out of a body from the beginning.
    pub fn new(point: TissuePoint, pusher: Pusher) -> Contact {
        Contact {
            point,
            pusher,
            inward: None,
            overlap_mm: 0.0,
            recovery_mm_per_s: 0.0,
            slack_mm: 0.0,
            most_force_un: f32::INFINITY,
        }
    }

    /// Keeps a point on the side of a plane to which its unit normal points; the plane's offset along the normal moves from the first
    /// number to the second, mm.
    pub fn with_plane(point: TissuePoint, normal: Vec3, offset_mm: [f32; 2]) -> Contact {
        Contact::new(point, Pusher::HalfSpace { normal, offset_mm })
    }

    /// Whether it can be held: its numbers are finite, and the body lies within the range of places.
    pub(crate) fn is_usable(&self) -> bool {
        self.pusher.is_usable()
            && self.inward.is_none_or(Vec3::is_finite)
            && within(self.overlap_mm, 0.0, FURTHEST_MM)
            && within(self.recovery_mm_per_s, 0.0, f32::MAX)
            && within(self.slack_mm, 0.0, FURTHEST_MM)
            && self.most_force_un > 0.0
            && self.point.weights.iter().all(|weight| weight.is_finite())
    }
}

/// What became of a contact in an advance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Touch {
    /// The direction in which the body pushed the point last, a unit vector; 0 if it never touched it.
    pub normal: Vec3,
    /// The mean force of the body on the point over the advance, µN.
    pub force_un: Vec3,
}

/// A body where it is in a substep.
#[derive(Debug, Clone, Copy)]
enum Body {
    HalfSpace {
        normal: Vec3,
        offset: f32,
        speed: f32,
    },
    Capsule {
        a: Vec3,
        along: Vec3,
        per_squared: f32,
        /// Of the end a, mm/s, and how much faster the other one is.
        velocity: Vec3,
        turning: Vec3,
        radius: f32,
    },
}

/// Contacts made ready for an advance: where their nodes lie and how they share the way are looked up once, not every substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Holds {
    pushers: Vec<Pusher>,
    bodies: Vec<Body>,
    holds: Vec<Hold>,
    duration_s: f32,
}

/// A contact made ready.
#[derive(Debug, Clone)]
struct Hold {
    /// The nodes that count, so many of them.
    parts: [Part; 6],
    count: usize,
    /// The sum of weight times share, 1/g; 0 if nothing of it moves.
    compliance: f32,
    pusher: u32,
    inward: Option<Vec3>,
    overlap_mm: f32,
    /// What the overlap becomes less by over the advance, mm.
    recovered_mm: f32,
    slack_mm: f32,
    /// What its point loses of a substep's push to the medium before the body takes the rest: a factor on the impulse, 1 or more.
    lost: f32,
    /// The most that the point is moved out by in a substep, mm, and the most of its velocity that is taken, mm/s: what the most force
    /// makes of them.
    most_mm: f32,
    most_mm_per_s: f32,
    normal: Vec3,
    /// g mm/s = µN s.
    impulse: Vec3,
}

/// A node of a contact.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    place: Place,
    weight: f32,
    /// Its weight times its inverse inertia, 1/g: over the compliance, which part of the contact's way it goes.
    share: f32,
}

/// A node moves at most this many times as far as the point of its contact. A node with a small weight, beside nodes that are fixed or far
/// heavier, would have to move far for the point to move at all; the point then takes several substeps.
const MOST_LEVER: f32 = 2.0;

impl Hold {
    /// The contact, the nodes sharing its way by weight and inverse inertia.
    fn new(contact: &Contact, pusher: u32, duration_s: f32, inverse_inertia: &Scalars) -> Hold {
        let (mut parts, mut count) = ([Part::default(); 6], 0);
        for ((node, weight), part) in contact.point.parts().zip(&mut parts) {
            *part = Part {
                place: inverse_inertia.place(node),
                weight,
                share: weight * inverse_inertia.at(node),
            };
            count += 1;
        }
        let compliance: f32 = parts[..count].iter().map(|part| part.share * part.weight).sum();
        let largest = parts[..count].iter().map(|part| part.share).fold(0.0, f32::max);
        let compliance = compliance.max(largest / MOST_LEVER);
        Hold {
            parts,
            count,
            compliance: compliance.max(0.0),
            pusher,
            inward: contact.inward,
            overlap_mm: contact.overlap_mm,
            recovered_mm: contact.recovery_mm_per_s * duration_s,
            slack_mm: contact.slack_mm,
            lost: 1.0,
            most_mm: f32::INFINITY,
            most_mm_per_s: f32::INFINITY,
            normal: Vec3::ZERO,
            impulse: Vec3::ZERO,
        }
    }

    /// The same, with what the kicks lose to the medium.
    fn with_loss(self, contact: &Contact, kicks: &Kicks, substep_s: f32, inverse_inertia: &Scalars) -> Hold {
        let (mut whole, mut left) = (0.0, 0.0);
        for (node, weight) in contact.point.parts() {
            let push = weight * weight * substep_s * inverse_inertia.at(node);
            whole += push;
            left += weight * weight * kicks.whole_push(node);
        }
        let lost = if left > 0.0 { whole / left } else { 1.0 };
        let most_mm_per_s = contact.most_force_un * substep_s * self.compliance / lost;
        Hold {
            lost,
            most_mm: most_mm_per_s * substep_s,
            most_mm_per_s,
            ..self
        }
    }
}

impl Holds {
    /// Prepares contacts for an advance: the number and length (s) of its substeps, and their kicks.
    pub fn prepare(
        &mut self,
        contacts: &[Contact],
        (substeps, substep_s): (u32, f32),
        kicks: &Kicks,
        inverse_inertia: &Scalars,
    ) {
        let duration_s = substep_s * substeps as f32;
        self.duration_s = duration_s;
        self.pushers.clear();
        self.holds.clear();
        for contact in contacts {
            // Contacts come body by body.
            if self.pushers.last() != Some(&contact.pusher) {
                self.pushers.push(contact.pusher);
            }
            let pusher = self.pushers.len() as u32 - 1;
            let hold = Hold::new(contact, pusher, duration_s, inverse_inertia);
            self.holds
                .push(hold.with_loss(contact, kicks, substep_s, inverse_inertia));
        }
    }

    /// Makes them ready again where inertias have changed in the course of the advance.
    pub fn reweigh(&mut self, contacts: &[Contact], inverse_inertia: &Scalars) {
        for (hold, contact) in self.holds.iter_mut().zip(contacts) {
            let fresh = Hold::new(contact, hold.pusher, self.duration_s, inverse_inertia);
            (hold.parts, hold.compliance) = (fresh.parts, fresh.compliance);
        }
    }

    /// What became of each contact.
    pub fn touches(&self) -> impl Iterator<Item = Touch> + '_ {
        self.holds.iter().map(|hold| Touch {
            normal: hold.normal,
            force_un: hold.impulse / self.duration_s,
        })
    }

    /// Brings every point out of its body as that is at `time`, 0 to 1 over the advance.
    #[inline(always)]
    pub fn apply(&mut self, motion: &mut Motion, time: f32) {
        let (pushers, duration_s) = (&self.pushers, self.duration_s);
        self.bodies.clear();
        self.bodies
            .extend(pushers.iter().map(|pusher| pusher.at(time, duration_s)));
        for hold in &mut self.holds {
            motion.hold(hold, &self.bodies[hold.pusher as usize], time);
        }
    }
}

impl Body {
    /// How deep a point lies in the body, which way is out and how fast the body moves there; `None` if it lies outside.
    #[inline(always)]
    fn depth(&self, point: Vec3, inward: Option<Vec3>) -> Option<(f32, Vec3, Vec3)> {
        match *self {
            Body::HalfSpace { normal, offset, speed } => {
                let depth = offset - normal.dot(point);
                (depth > 0.0).then_some((depth, normal, normal * speed))
            }
            Body::Capsule {
                a,
                along,
                per_squared,
                velocity,
                turning,
                radius,
            } => {
                let share = ((point - a).dot(along) * per_squared).clamp(0.0, 1.0);
                let away = point - (a + along * share);
                let squared = away.length_squared();
                if let Some(inward) = inward {
                    let deep = away.dot(inward);
                    // How far the body reaches that way beside its axis.
                    let reach = radius * radius - (squared - deep * deep);
                    let depth = reach.max(0.0).sqrt() - deep;
                    return (reach > 0.0 && depth > 0.0).then(|| (depth, inward, velocity + turning * share));
                }
                if squared >= radius * radius {
                    return None;
                }
                let distance = squared.sqrt();
                let normal = if distance > NO_DIRECTION_MM {
                    away / distance
                } else {
                    along.any_orthogonal_vector().normalize_or(Vec3::X)
                };
                Some((radius - distance, normal, velocity + turning * share))
            }
        }
    }
}

/// Below this distance the direction between two points is noise, mm.
const NO_DIRECTION_MM: f32 = 1e-4;

impl Motion {
    /// Brings a contact's point out of its body and takes the velocity that goes against it.
    #[inline(always)]
    fn hold(&mut self, hold: &mut Hold, body: &Body, time: f32) {
        let parts = &hold.parts[..hold.count];
        let mean = |vectors: &Vectors| -> Vec3 {
            let parts = parts.iter();
            parts.fold(Vec3::ZERO, |sum, part| sum + vectors.at_place(part.place) * part.weight)
        };
        // Most contacts only come near: this first.
        let Some((depth, normal, velocity)) = body.depth(mean(&self.positions), hold.inward) else {
            return;
        };
        let allowed = (hold.overlap_mm - time * hold.recovered_mm).max(hold.slack_mm);
        let depth = (depth - allowed).min(hold.most_mm);
        if depth <= 0.0 || hold.compliance <= 0.0 {
            return;
        }
        hold.normal = normal;
        // A body that draws back lets tissue follow; one that pushes gives it no velocity.
        let against = velocity.dot(normal).min(0.0) - mean(&self.velocities).dot(normal);
        let per_compliance = 1.0 / hold.compliance;
        for part in parts {
            self.positions
                .add_at(part.place, normal * (depth * part.share * per_compliance));
        }
        let against = against.min(hold.most_mm_per_s);
        if against > 0.0 {
            for part in parts {
                self.velocities
                    .add_at(part.place, normal * (against * part.share * per_compliance));
            }
            hold.impulse += normal * (against * per_compliance * hold.lost);
        }
    }
}
