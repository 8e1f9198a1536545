//! Contacts of a part that hardly moves stay where they are.
//!
//! A face is held at its point nearest to the part. Where the two lie along each other that may be nearly any point of the
//! face, and is another one in each step: held by turns, tissue around an instrument at rest would tremble without end. So what
//! a contact holds, and in which direction, follows the nearest point by a share of the way only; by all of it for a part
//! that moves. How far the part pushes is not changed: it is what the nearest point asks for.

use bevy::prelude::*;
use resecta_solver::{Contact, Tissue, TissuePoint};

use super::contacts::{Found, InOrder};

/// The share of the way to the nearest point that a contact of a part at rest goes in a pass.
const SHARE_AT_REST: f32 = 0.02;
/// A part that moves this far in a pass takes its contacts along, mm.
const MOVES_MM: f32 = 0.3;
/// A contact whose direction turns by more than this (the cosine of 60 degrees) is another one.
const TURNED: f32 = 0.5;

/// What a contact is known by from pass to pass: tool, part, and what is held.
type Key = (u32, u32, Place);

/// What a contact holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Place {
    /// What a pentahedron carries inside it.
    Inside(u32),
    /// A face, or thrice a corner.
    Vertices([u32; 3]),
}

/// The contacts of the last pass, in the order in which they were found: much the same one in each pass, so that what is looked up lies one
/// behind the other in memory.
#[derive(Debug, Default)]
pub struct Steady {
    last: InOrder<Key, (TissuePoint, Vec3)>,
    next: InOrder<Key, (TissuePoint, Vec3)>,
}

impl Steady {
    /// Which way what a pentahedron carries was pushed in the last pass, by index of tool and part.
    pub fn direction(&self, (tool, part): (u32, u32), pentahedron: Option<u32>) -> Option<Vec3> {
        let place = Place::Inside(pentahedron?);
        Some(self.last.get(&(tool, part, place))?.1)
    }

    /// Keeps the contacts that were found in a pass near those of the pass before.
    pub fn hold_still(&mut self, pass: u32, found: &mut [Found], tissue: &Tissue) {
        self.next.clear();
        for found in found {
            let Some(contact) = &mut found.contact else { continue };
            let place = match found.inside {
                Some(pentahedron) => Place::Inside(pentahedron),
                None => Place::Vertices(found.vertices),
            };
            let key = (found.tool, found.part, place);
            let share = SHARE_AT_REST + found.motion_mm / MOVES_MM;
            if found.passes.start == pass
                && share < 1.0
                && let Some(&before) = self.last.get(&key)
                && let Some(steadied) = towards(before, contact, share, tissue)
            {
                *contact = steadied;
            }
            // Of several that are known by the same the last counts.
            self.next.insert(key, (contact.point, contact.normal));
        }
        std::mem::swap(&mut self.last, &mut self.next);
    }
}

/// The contact a share of the way from where one of the last pass was, that pushes by as much as it does.
fn towards((point, normal): (TissuePoint, Vec3), contact: &Contact, share: f32, tissue: &Tissue) -> Option<Contact> {
    if normal.dot(contact.normal) < TURNED {
        return None;
    }
    let along = |point: &TissuePoint, normal: Vec3| -> f32 {
        let parts = point.parts();
        parts
            .map(|(node, weight)| weight * tissue.position(node).dot(normal))
            .sum()
    };
    let normal = normal.lerp(contact.normal, share).try_normalize()?;
    let point = point.towards(&contact.point, share)?;
    let shift = along(&point, normal) - along(&contact.point, contact.normal);
    Some(Contact {
        point,
        normal,
        offset_start: contact.offset_start + shift,
        offset_end: contact.offset_end + shift,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::DVec3;
    use resecta_solver::{Material, TissueMesh};

    fn prism() -> Tissue {
        let corners = [
            [0., 0., 0.],
            [0., 1., 0.],
            [1., 0., 0.],
            [0., 0., 1.],
            [0., 1., 1.],
            [1., 0., 1.],
        ];
        let mesh = TissueMesh::from_pentahedra(corners.map(DVec3::from_array).to_vec(), vec![[0, 1, 2, 3, 4, 5]]);
        Tissue::new(&mesh, &Material::default()).expect("a prism is a tissue")
    }

    fn at(weights: [f32; 3], normal: Vec3, depth: f32) -> Contact {
        let point = TissuePoint::on_triangle([3, 4, 5], weights);
        let tissue = prism();
        let now: f32 = point
            .parts()
            .map(|(node, weight)| weight * tissue.position(node).dot(normal))
            .sum();
        Contact {
            point,
            normal,
            offset_start: now,
            offset_end: now + depth,
        }
    }

    /// How far a contact asks its point to go.
    fn depth(contact: &Contact, tissue: &Tissue) -> f32 {
        let place = |(node, weight)| weight * tissue.position(node).dot(contact.normal);
        contact.offset_end - contact.point.parts().map(place).sum::<f32>()
    }

    #[test]
    fn a_steadied_contact_pushes_as_far_from_between_the_two_places() {
        let tissue = prism();
        let before = at([1.0, 0.0, 0.0], Vec3::Z, 0.3);
        let tilted = Vec3::new(0.6, 0.0, 0.8);
        let now = at([0.0, 0.5, 0.5], tilted, 0.1);
        for share in [0.0, 0.25, 1.0] {
            let between = towards((before.point, before.normal), &now, share, &tissue).expect("they are alike");
            assert!((depth(&between, &tissue) - 0.1).abs() < 1e-6);
            assert!((between.normal.dot(tilted) - 1.0).abs() < 1e-6 || share < 1.0);
            let weight = between
                .point
                .parts()
                .find(|(node, _)| *node == 3)
                .map_or(0.0, |(_, weight)| weight);
            assert!((weight - (1.0 - share)).abs() < 1e-6, "{share}: {weight}");
        }
    }

    #[test]
    fn a_contact_that_turned_or_is_of_other_nodes_is_another_one() {
        let tissue = prism();
        let now = at([0.0, 0.5, 0.5], Vec3::Z, 0.1);
        let turned = (now.point, Vec3::X);
        assert!(towards(turned, &now, 0.1, &tissue).is_none());
        let elsewhere = (TissuePoint::node(0), Vec3::Z);
        assert!(towards(elsewhere, &now, 0.1, &tissue).is_none());
    }
}
