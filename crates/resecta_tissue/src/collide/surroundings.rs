//! On which side of the tissue's surface a part's axis is.

use bevy::math::Vec3;

use super::{
    closest::ClosestPoints,
    collider::{Collider, DEPTH_LIMIT_MM, Face, TIE_MM},
    nearest::Nearest,
    patches::ChunkPart,
    sweep::Axis,
    touch::NO_DIRECTION_MM,
};
use crate::skin::Skin;

/// The face nearest to a point of an axis inside the tissue is looked up for points about this far apart, mm.
const APART_MM: f32 = 0.5;

/// A vertex that faces an axis by less than this (the cosine of 60 degrees) does not tell its side.
const SQUARE: f32 = 0.5;

/// Which stretches of one part's axis are inside the tissue, and the faces nearest to those.
///
/// The surface is closed, so an axis is on one side of it from each face it passes through to the next. The faces that it
/// passes through tell which; where it passes through none, the nearest face tells.
pub struct Surroundings<'a> {
    collider: &'a Collider,
    skin: &'a Skin<'a>,
    /// Where the axis passes through faces, shares, rising.
    crossings: Vec<f32>,
    /// On which side each stretch is, from before the first crossing to past the last, where that is known.
    sides: Vec<Option<Side>>,
    /// Whether no face is within the depth limit of the axis.
    is_far: bool,
    axis: Axis,
    /// Faces with their points closest to the axis.
    near: &'a [(Face, ClosestPoints)],
    /// The faces nearest to the middles of equal parts of the axis, as far as they have been looked up.
    nearest: Vec<Option<Option<Nearest>>>,
    /// The face that was found last.
    last: Option<Face>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Inside,
    Outside,
}

impl Side {
    fn from_inside(inside: bool) -> Side {
        if inside { Side::Inside } else { Side::Outside }
    }
}

impl<'a> Surroundings<'a> {
    /// `near` are faces with their points closest to the axis, among them all that are within `known_mm` of it, and vertices
    /// that stand for others.
    pub fn new(
        collider: &'a Collider,
        skin: &'a Skin,
        axis: Axis,
        (near, points): (&'a [(Face, ClosestPoints)], &[ChunkPart]),
        known_mm: f32,
    ) -> Self {
        let along = axis.b - axis.a;
        let crossings = near.iter().filter(|(_, closest)| passes_through(closest));
        let mut crossings: Vec<(f32, Side)> = crossings
            .map(|(face, closest)| {
                let comes_out = face.normal().dot(along) > 0.0;
                (closest.share, Side::from_inside(comes_out))
            })
            .collect();
        crossings.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut sides = vec![None; crossings.len() + 1];
        if crossings.is_empty() {
            sides[0] = side_by_nearest(near, known_mm).or_else(|| side_by_vertices(skin, &axis, points));
        }
        let is_far = crossings.is_empty() && sides[0].is_none() && known_mm >= DEPTH_LIMIT_MM;
        for (stretch, side) in sides.iter_mut().enumerate() {
            let before = stretch.checked_sub(1).and_then(|crossing| crossings.get(crossing));
            let told_before = before.map(|(_, side)| match side {
                Side::Inside => Side::Outside,
                Side::Outside => Side::Inside,
            });
            let told_after = crossings.get(stretch).map(|(_, side)| *side);
            *side = match (told_before, told_after) {
                (Some(told), None) | (None, Some(told)) => Some(told),
                // Faces that tell otherwise are of tissue that has folded into itself.
                (Some(before), Some(after)) if before == after => Some(before),
                _ => *side,
            };
        }
        Self {
            collider,
            skin,
            sides,
            is_far,
            crossings: crossings.into_iter().map(|(share, _)| share).collect(),
            axis,
            near,
            nearest: vec![None; ((axis.a.distance(axis.b) / APART_MM).round() as usize).max(1)],
            last: None,
        }
    }

    /// The faces nearest to points of the axis that are inside the tissue: they are moved past the part.
    pub fn nearest_from_within(&mut self) -> Vec<Nearest> {
        if self.is_far || self.sides.iter().all(|side| *side == Some(Side::Outside)) {
            return Vec::new();
        }
        let count = self.nearest.len();
        let mut is_near = vec![false; count];
        self.collider.stretches_near(&self.axis, DEPTH_LIMIT_MM, |from, to| {
            let numbers = (from * count as f32) as usize..(to * count as f32).ceil() as usize;
            if let Some(numbers) = is_near.get_mut(numbers) {
                numbers.fill(true);
            }
        });
        // The ends first: they are the furthest from what the part touches, and where one of them is outside of a surface
        // that the axis does not pass through, all is.
        let order = (0..count).rev().take(1).chain(0..count - 1);
        let mut within: Vec<(usize, Nearest)> = Vec::new();
        for number in order.filter(|&number| is_near[number]) {
            let stretch = self.stretch_of(self.middle_of(number));
            if self.sides[stretch] == Some(Side::Outside) {
                continue;
            }
            let Some(nearest) = self.look_up(number) else {
                continue;
            };
            self.sides[stretch].get_or_insert(Side::from_inside(nearest.inside));
            if nearest.inside {
                within.push((number, nearest));
            }
        }
        within.sort_by_key(|(number, _)| *number);
        within.into_iter().map(|(_, nearest)| nearest).collect()
    }

    /// On which side the axis is at `share`; none if it is too far from any face to tell.
    pub fn side(&mut self, share: f32) -> Option<Side> {
        let stretch = self.stretch_of(share);
        if self.sides[stretch].is_none() && !self.is_far {
            let last = self.nearest.len() - 1;
            let number = ((share * self.nearest.len() as f32) as usize).min(last);
            let nearest = if self.stretch_of(self.middle_of(number)) == stretch {
                self.look_up(number)
            } else {
                self.collider.nearest_face(self.skin, self.axis.at(share), None)
            };
            self.sides[stretch] = nearest.map(|nearest| Side::from_inside(nearest.inside));
        }
        self.sides[stretch]
    }

    fn stretch_of(&self, share: f32) -> usize {
        self.crossings.partition_point(|crossing| *crossing < share)
    }

    /// The share of the middle of a part that is looked up.
    fn middle_of(&self, number: usize) -> f32 {
        (number as f32 + 0.5) / self.nearest.len() as f32
    }

    /// The face nearest to the middle of a part.
    fn look_up(&mut self, number: usize) -> Option<Nearest> {
        let share = self.middle_of(number);
        if let Some(nearest) = self.nearest[number] {
            return nearest;
        }
        let point = self.axis.at(share);
        // The nearest may be another one, but no face further away than this one needs a look.
        let known = self.last.or_else(|| self.nearest_of_near(point));
        let nearest = self.collider.nearest_face(self.skin, point, known.as_ref());
        let nearest = nearest.map(|nearest| Nearest {
            closest: ClosestPoints {
                share,
                ..nearest.closest
            },
            ..nearest
        });
        self.last = nearest.map(|nearest| nearest.face).or(self.last);
        self.nearest[number] = Some(nearest);
        nearest
    }

    /// Of the faces near the axis the one whose nearest point to it is nearest to a point.
    fn nearest_of_near(&self, point: Vec3) -> Option<Face> {
        let away = |(_, closest): &&(Face, ClosestPoints)| closest.on_triangle.distance_squared(point);
        let nearest = self.near.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map(|(face, _)| *face)
    }
}

/// Whether the axis passes through the face that these points are of.
pub fn passes_through(closest: &ClosestPoints) -> bool {
    closest.distance() <= NO_DIRECTION_MM
}

/// On which side of the nearest face the axis is, if that is one of `near`, among which are all within `known_mm`.
///
/// Where several share the nearest point (an edge, a corner), the one that faces the axis most squarely tells.
fn side_by_nearest(near: &[(Face, ClosestPoints)], known_mm: f32) -> Option<Side> {
    let distances = near.iter().map(|(_, closest)| closest.distance());
    let nearest = distances
        .min_by(f32::total_cmp)
        .filter(|&nearest| nearest <= known_mm)?;
    let tied = near
        .iter()
        .filter(|(_, closest)| closest.distance() <= nearest + TIE_MM);
    let squareness = tied.map(|(face, closest)| {
        let towards = closest.on_segment - closest.on_triangle;
        face.normal().dot(towards.normalize_or_zero())
    });
    let squarest = squareness.max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    Some(Side::from_inside(squarest < 0.0))
}

/// On which side of the vertex nearest to it the axis is, if that is one of `points` and faces the axis squarely enough to
/// tell.
fn side_by_vertices(skin: &Skin, axis: &Axis, points: &[ChunkPart]) -> Option<Side> {
    let vertices = points.iter().flat_map(|part| {
        let vertices = part.vertices(skin);
        vertices.map(|(number, vertex)| (part.chunk, number, skin.place(vertex)))
    });
    let towards = vertices.map(|(chunk, number, place)| {
        let towards = axis.at(axis.share_nearest(place)) - place;
        (chunk, number, towards)
    });
    let (chunk, number, towards) =
        towards.min_by(|(.., a), (.., b)| a.length_squared().total_cmp(&b.length_squared()))?;
    let squareness = skin.chunk_normals(chunk)?[number].dot(towards.normalize_or_zero());
    (squareness.abs() > SQUARE).then(|| Side::from_inside(squareness < 0.0))
}
