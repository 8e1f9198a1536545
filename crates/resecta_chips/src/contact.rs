//! Contacts between chips and with walls, and the impulses that keep them apart.
//!
//! Sequential impulses: in each pass every contact in turn lets its two bodies come no nearer at the velocities that they
//! have, with Coulomb friction. Overlap is undone by velocities of its own that are forgotten after the step, so that it
//! gives no energy.

use bevy::math::Vec3;
use parry3d::{
    bounding_volume::{Aabb, BoundingVolume},
    query::{ContactManifold, details::contact_manifold_pfm_pfm_shapes},
};

use crate::{
    body::Body,
    walls::{Cavity, Sheath},
};

/// How near bodies come before they are looked at, mm, besides the way that they go in the step.
const NEAR_MM: f32 = 0.1;
/// Overlap that is left alone, mm: contacts that come and go would shake a pile.
const SLOP_MM: f32 = 0.02;
/// Share of an overlap that is undone in a step, and the fastest.
const UNDONE_SHARE: f32 = 0.2;
const FASTEST_MM_PER_S: f32 = 40.0;
/// Wet tissue on wet tissue: slippery (ours).
const FRICTION: f32 = 0.2;
/// Passes over all contacts.
const PASSES: usize = 8;
/// Most corners of a hull that rest on the bladder's wall.
const MOST_CORNERS: usize = 4;

/// A point where a body touches another or a wall.
#[derive(Debug, Clone)]
pub struct Contact {
    /// The body that is pushed along `normal`.
    pub body: usize,
    /// The other; none for a wall.
    pub other: Option<usize>,
    /// Unit vector towards `body`.
    normal: Vec3,
    /// The point from either's centre, mm.
    arms: [Vec3; 2],
    /// Gap, mm; negative where they overlap.
    gap: f32,
    /// Velocity of the wall, mm/s.
    wall_velocity: Vec3,
    /// Mass that resists an impulse along the normal, and along any way across it, g; 0 where nothing moves.
    mass: f32,
    mass_across: f32,
    /// Sums of impulses, g mm/s.
    pushed: f32,
    rubbed: Vec3,
    undone: f32,
}

impl Contact {
    fn new(body: usize, bodies: &[Body], normal: Vec3, point: Vec3, gap: f32) -> Self {
        Self {
            body,
            other: None,
            normal,
            arms: [point - bodies[body].place(), Vec3::ZERO],
            gap,
            wall_velocity: Vec3::ZERO,
            mass: 0.0,
            mass_across: 0.0,
            pushed: 0.0,
            rubbed: Vec3::ZERO,
            undone: 0.0,
        }
    }

    /// How fast the two approach or leave each other, mm/s.
    pub fn relative_speed(&self, bodies: &[Body]) -> f32 {
        self.relative_velocity(bodies).length()
    }

    fn relative_velocity(&self, bodies: &[Body]) -> Vec3 {
        let other = self
            .other
            .map_or(self.wall_velocity, |other| bodies[other].velocity_at(self.arms[1]));
        bodies[self.body].velocity_at(self.arms[0]) - other
    }

    /// Finds the masses that resist.
    fn weigh(&mut self, bodies: &[Body]) {
        let mass = |compliance: f32| if compliance > 0.0 { compliance.recip() } else { 0.0 };
        let across = self.normal.any_orthonormal_vector();
        self.mass = mass(self.compliance(bodies, self.normal));
        // The softer of two ways across: friction that is a little weak is stable.
        let softer = self
            .compliance(bodies, across)
            .max(self.compliance(bodies, self.normal.cross(across)));
        self.mass_across = mass(softer);
    }

    /// 1 over the mass that resists an impulse along a direction, 1/g.
    fn compliance(&self, bodies: &[Body], direction: Vec3) -> f32 {
        let of = |index: usize, arm: Vec3| {
            let body = &bodies[index];
            if !body.moves() {
                return 0.0;
            }
            let turned = body.inverse_inertia_now * arm.cross(direction);
            body.inverse_mass + turned.cross(arm).dot(direction)
        };
        of(self.body, self.arms[0]) + self.other.map_or(0.0, |other| of(other, self.arms[1]))
    }

    /// Gives an impulse to the body and its opposite to the other.
    fn give(&self, velocities: &mut impl FnMut(usize, Vec3, Vec3), impulse: Vec3) {
        velocities(self.body, self.arms[0], impulse);
        if let Some(other) = self.other {
            velocities(other, self.arms[1], -impulse);
        }
    }
}

/// Finds the contacts between chips, each pair once, in the order of their numbers. Chips that both rest do not meet.
pub fn between(bodies: &[Body], seconds: f32, contacts: &mut Vec<Contact>) {
    let mut manifold = ContactManifold::<(), ()>::new();
    let boxes: Vec<Aabb> = (bodies.iter())
        .map(|body| body.hull.aabb(&body.pose).loosened(near(body, seconds)))
        .collect();
    for (first, a) in bodies.iter().enumerate() {
        for (second, b) in bodies.iter().enumerate().skip(first + 1) {
            if !(a.moves() || b.moves()) || !boxes[first].intersects(&boxes[second]) {
                continue;
            }
            let pose = a.pose.inv_mul(&b.pose);
            let near = near(a, seconds) + near(b, seconds);
            manifold.clear();
            contact_manifold_pfm_pfm_shapes(&pose, &a.hull, &b.hull, None, None, near, &mut manifold);
            let normal = -(a.pose.rotation * manifold.local_n1);
            if !normal.is_finite() {
                continue;
            }
            for point in &manifold.points {
                let place = a.pose * point.local_p1;
                let mut contact = Contact::new(first, bodies, normal, place, point.dist);
                contact.other = Some(second);
                contact.arms[1] = place - b.place();
                contacts.push(contact);
            }
        }
    }
}

/// How far from a body another may be that it reaches in the step, mm.
fn near(body: &Body, seconds: f32) -> f32 {
    NEAR_MM + body.velocity.length() * seconds
}

/// Finds the contacts of chips with the bladder's wall.
pub fn with_wall(bodies: &[Body], cavity: &Cavity, seconds: f32, contacts: &mut Vec<Contact>) {
    for (index, body) in bodies.iter().enumerate().filter(|(_, body)| body.moves()) {
        let near = near(body, seconds);
        if cavity.wall(body.place()).0 > body.reach + near {
            continue;
        }
        let mut touching: Vec<(f32, Vec3, Vec3)> = (body.corners())
            .filter(|&corner| cavity.has_wall_at(corner))
            .map(|corner| {
                let (gap, normal) = cavity.wall(corner);
                (gap, normal, corner)
            })
            .filter(|(gap, ..)| *gap < near)
            .collect();
        touching.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (gap, normal, corner) in touching.into_iter().take(MOST_CORNERS) {
            contacts.push(Contact::new(index, bodies, normal, corner, gap));
        }
    }
}

/// Finds the contacts of chips with the sheath.
pub fn with_sheath(bodies: &[Body], sheath: &Sheath, seconds: f32, contacts: &mut Vec<Contact>) {
    let pose = sheath.way[1];
    let mut manifold = ContactManifold::<(), ()>::new();
    for (index, body) in bodies.iter().enumerate().filter(|(_, body)| body.held.is_none()) {
        let [a, b] = [pose * sheath.capsule.segment.a, pose * sheath.capsule.segment.b];
        let along = ((body.place() - a).dot(b - a) / (b - a).length_squared().max(1e-9)).clamp(0.0, 1.0);
        let near = near(body, seconds);
        let reach = sheath.capsule.radius + body.reach + near;
        if (a + (b - a) * along).distance_squared(body.place()) > reach * reach {
            continue;
        }
        manifold.clear();
        contact_manifold_pfm_pfm_shapes(
            &pose.inv_mul(&body.pose),
            &sheath.capsule,
            &body.hull,
            None,
            None,
            near,
            &mut manifold,
        );
        // From the sheath towards the chip.
        let normal = pose.rotation * manifold.local_n1;
        if !normal.is_finite() {
            continue;
        }
        for point in &manifold.points {
            let place = pose * point.local_p1;
            let mut contact = Contact::new(index, bodies, normal, place, point.dist);
            contact.wall_velocity = sheath.velocity_at(place, seconds);
            contacts.push(contact);
        }
    }
}

/// Lets bodies that touch come no nearer, and returns for each the velocity and turn that undo its overlap.
pub fn resolve(bodies: &mut [Body], contacts: &mut [Contact], seconds: f32) -> Vec<[Vec3; 2]> {
    for body in bodies.iter_mut().filter(|body| body.moves()) {
        body.turn_inertia();
    }
    for contact in contacts.iter_mut() {
        contact.weigh(bodies);
    }
    let mut undoing = vec![[Vec3::ZERO; 2]; bodies.len()];
    for _ in 0..PASSES {
        for contact in contacts.iter_mut() {
            push(bodies, contact, seconds);
            rub(bodies, contact);
            undo(bodies, &mut undoing, contact, seconds);
        }
    }
    undoing
}

fn push(bodies: &mut [Body], contact: &mut Contact, seconds: f32) {
    if contact.mass <= 0.0 {
        return;
    }
    let approach = contact.relative_velocity(bodies).dot(contact.normal);
    // A gap may be closed within the step.
    let allowed = -contact.gap.max(0.0) / seconds;
    let before = contact.pushed;
    contact.pushed = (before + (allowed - approach) * contact.mass).max(0.0);
    let impulse = contact.normal * (contact.pushed - before);
    contact.give(
        &mut |index, arm, impulse| kick(&mut bodies[index], arm, impulse),
        impulse,
    );
}

fn rub(bodies: &mut [Body], contact: &mut Contact) {
    let velocity = contact.relative_velocity(bodies);
    let sliding = velocity - contact.normal * velocity.dot(contact.normal);
    let before = contact.rubbed;
    contact.rubbed = (before - sliding * contact.mass_across).clamp_length_max(FRICTION * contact.pushed);
    let impulse = contact.rubbed - before;
    contact.give(
        &mut |index, arm, impulse| kick(&mut bodies[index], arm, impulse),
        impulse,
    );
}

fn undo(bodies: &[Body], undoing: &mut [[Vec3; 2]], contact: &mut Contact, seconds: f32) {
    let overlap = -contact.gap - SLOP_MM;
    if overlap <= 0.0 || contact.mass <= 0.0 {
        return;
    }
    let wanted = (UNDONE_SHARE * overlap / seconds).min(FASTEST_MM_PER_S);
    let of = |index: usize, arm: Vec3| undoing[index][0] + undoing[index][1].cross(arm);
    let other = contact.other.map_or(Vec3::ZERO, |other| of(other, contact.arms[1]));
    let leaving = (of(contact.body, contact.arms[0]) - other).dot(contact.normal);
    let before = contact.undone;
    contact.undone = (before + (wanted - leaving) * contact.mass).max(0.0);
    let impulse = contact.normal * (contact.undone - before);
    contact.give(
        &mut |index, arm, impulse| {
            let body = &bodies[index];
            if body.moves() {
                undoing[index][0] += impulse * body.inverse_mass;
                undoing[index][1] += body.inverse_inertia_now * arm.cross(impulse);
            }
        },
        impulse,
    );
}

fn kick(body: &mut Body, arm: Vec3, impulse: Vec3) {
    if body.moves() {
        body.velocity += impulse * body.inverse_mass;
        body.turn += body.inverse_inertia_now * arm.cross(impulse);
    }
}
