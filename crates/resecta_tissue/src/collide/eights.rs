//! Points near a part, eight at a time: a step looks at thousands, most of which are too far.

use bevy::prelude::*;
use resecta_field::CHUNK;

use super::{contacts::MARGIN_MM, sweep::PartSweep};

/// Points at most this much further than asked for pass too, mm: room for rounding.
const ROUNDING_MM: f32 = 1e-3;

/// Eight points by component, each with how much further than others it is looked for, mm. Lanes without a point are infinitely far.
#[derive(Debug, Clone, Copy)]
pub struct Eight {
    pub places: [[f32; CHUNK]; 3],
    pub further: [f32; CHUNK],
}

impl Eight {
    /// Points in their order, eight by eight.
    pub fn all(mut points: impl Iterator<Item = (Vec3, f32)>) -> Vec<Eight> {
        let mut eights = Vec::new();
        while let Some(first) = points.next() {
            let mut eight = Eight {
                places: [[f32::INFINITY; CHUNK]; 3],
                further: [0.0; CHUNK],
            };
            for (lane, (place, further)) in std::iter::once(first).chain(points.by_ref()).take(CHUNK).enumerate() {
                for (component, value) in eight.places.iter_mut().zip(place.to_array()) {
                    component[lane] = value;
                }
                eight.further[lane] = further;
            }
            eights.push(eight);
        }
        eights
    }
}

impl PartSweep {
    /// Which of eight points may become contacts of the part, a bit each.
    #[inline(always)]
    pub fn near_of(&self, Eight { places, further }: &Eight) -> u8 {
        let mut least = [f32::INFINITY; CHUNK];
        for axis in [&self.from, &self.to] {
            let along = axis.b - axis.a;
            let squared = along.length_squared();
            let per_squared = if squared > 0.0 { 1.0 / squared } else { 0.0 };
            for n in 0..CHUNK {
                let [x, y, z] = [
                    places[0][n] - axis.a.x,
                    places[1][n] - axis.a.y,
                    places[2][n] - axis.a.z,
                ];
                let share = ((x * along.x + y * along.y + z * along.z) * per_squared).clamp(0.0, 1.0);
                let [x, y, z] = [x - along.x * share, y - along.y * share, z - along.z * share];
                least[n] = least[n].min(x * x + y * y + z * z);
            }
        }
        let usual = self.contact_radius() + MARGIN_MM + self.motion() + ROUNDING_MM;
        let mut near = 0;
        for n in 0..CHUNK {
            let reach = usual + further[n];
            near |= u8::from(least[n] < reach * reach) << n;
        }
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{collide::sweep::Axis, tool::ToolPartKind};
    use proptest::prelude::*;

    fn place() -> impl Strategy<Value = Vec3> {
        let axis = || -8.0..8.0f32;
        (axis(), axis(), axis()).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn those_near_are_those_that_the_distance_says(
            (a, b, c, d) in (place(), place(), place(), place()),
            points in proptest::collection::vec((place(), 0.0..2.0f32), 1..20),
            radius in 0.1..4.0f32,
        ) {
            let part = PartSweep { kind: ToolPartKind::Sheath, radius, from: Axis { a, b }, to: Axis { a: c, b: d } };
            let eights = Eight::all(points.iter().copied());
            prop_assert_eq!(eights.len(), points.len().div_ceil(CHUNK));
            let within = |further: f32| MARGIN_MM + part.motion() + further;
            for (number, &(point, further)) in points.iter().enumerate() {
                let is_near = part.near_of(&eights[number / CHUNK]) >> (number % CHUNK) & 1 == 1;
                let (_, nearest) = part.gaps(point);
                prop_assert!(is_near || nearest >= within(further));
                prop_assert!(!is_near || nearest < within(further) + 3.0 * ROUNDING_MM);
            }
            for lane in points.len()..eights.len() * CHUNK {
                prop_assert_eq!(part.near_of(&eights[lane / CHUNK]) >> (lane % CHUNK) & 1, 0);
            }
        }
    }
}
