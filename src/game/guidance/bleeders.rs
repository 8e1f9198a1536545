//! What bleeds, marked in the picture: blood in the water hides it, and whoever looks for it draws back from it. The bleeder that is to be
//! closed next is told wherever it is, others where they are seen.

use std::collections::BTreeSet;

use bevy::prelude::*;
use resecta_fluid::{OpenVessel, VesselKind, Vessels};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, Sight, Unseen};

use super::{
    super::{closing::beside, palette},
    Shown,
    picture::Picture,
};
use crate::view::ViewSystems;

/// A vessel as urgent as the one that is marked takes its place where it is nearer to the lens by this, mm: between two alike the mark is
/// not to jump to and fro.
const NEARER_MM: f32 = 4.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Bleeders>()
        .add_systems(Update, look.in_set(ViewSystems::Last));
}

/// What is marked; nothing where no guidance is shown.
#[derive(Resource, Debug, Default)]
pub struct Bleeders {
    next: Option<Bleeder>,
    /// The others that the lens sees.
    others: Vec<(VesselKind, Vec3)>,
    /// Those that it saw when it was looked at them last, one a frame in turn, by their indices in the list of vessels.
    seen: BTreeSet<usize>,
    turn: usize,
}

#[derive(Debug, Clone, Copy)]
struct Bleeder {
    /// Its index in the list of vessels.
    index: usize,
    kind: VesselKind,
    place: Vec3,
    /// The way to it from the lens, mm: right, up and back as the picture has it.
    from_lens: Vec3,
    unseen: Option<Unseen>,
}

/// Chooses the next one, and casts a ray at it and at another one.
fn look(
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    lists: Query<&Vessels>,
    mut sight: Sight,
    mut bleeders: ResMut<Bleeders>,
) {
    let bleeders = &mut *bleeders;
    let active = active.filter(|_| shown.names_landmarks());
    let held = active.and_then(|active| {
        let (state, scope) = instruments.get(active.instrument).ok()?;
        Some((state, scope, lists.get(active.tissue).ok()?))
    });
    let Some((state, scope, vessels)) = held else {
        *bleeders = Bleeders::default();
        return;
    };
    let lens = scope.lens_pose(state);
    let marked = bleeders.next.map(|marked| marked.index);
    let is_in_field = |place: Vec3| scope.has_in_field(state, place);
    // Under a current the one that words below the picture speak of.
    let coagulates = state.coagulate && !state.cut;
    let at_wire = coagulates.then(|| beside(scope, state, vessels)).flatten();
    let at_wire = at_wire.map(|(vessel, _)| vessel);
    let next = at_wire.or_else(|| most_urgent(vessels.open(), lens.translation.into(), marked, is_in_field));
    bleeders.next = next.map(|vessel| Bleeder {
        index: vessel.index,
        kind: vessel.vessel.kind,
        place: vessel.place,
        from_lens: lens.inverse() * vessel.place,
        unseen: sight.unseen(vessel.place),
    });
    bleeders.turn = (bleeders.turn + 1) % vessels.open().count().max(1);
    if let Some(vessel) = vessels.open().nth(bleeders.turn) {
        if sight.sees(vessel.place) {
            bleeders.seen.insert(vessel.index);
        } else {
            bleeders.seen.remove(&vessel.index);
        }
    }
    let next = bleeders.next.map(|next| next.index);
    let others = vessels.open().filter(|vessel| next != Some(vessel.index));
    bleeders.others.clear();
    bleeders.others.extend(
        others
            .filter(|vessel| bleeders.seen.contains(&vessel.index))
            .map(|vessel| (vessel.vessel.kind, vessel.place)),
    );
}

/// Of arteries before veins, and of those in the picture before others, the one nearest to the lens; the marked one unless another is
/// nearer by [`NEARER_MM`].
fn most_urgent<'a>(
    open: impl Iterator<Item = OpenVessel<'a>>,
    lens: Vec3,
    marked: Option<usize>,
    is_in_field: impl Fn(Vec3) -> bool,
) -> Option<OpenVessel<'a>> {
    let rank = |vessel: &OpenVessel| (vessel.vessel.kind == VesselKind::Venous, !is_in_field(vessel.place));
    let far = |vessel: &OpenVessel| {
        let kept = if marked == Some(vessel.index) { NEARER_MM } else { 0.0 };
        vessel.place.distance(lens) - kept
    };
    open.min_by(|a, b| rank(a).cmp(&rank(b)).then_with(|| far(a).total_cmp(&far(b))))
}

/// Marks them in the picture, the next one with how far it is.
pub fn show(picture: &Picture, bleeders: &Bleeders, opacity: f32) {
    let name = |kind: VesselKind| match kind {
        VesselKind::Arterial => "artery",
        VesselKind::Venous => "vein",
    };
    // The colour of the current that closes them, which also stands out from tissue and blood.
    let colour = palette::COAGULATION.gamma_multiply(opacity);
    for (kind, place) in &bleeders.others {
        picture.mark(*place, None, name(*kind), colour);
    }
    let Some(next) = bleeders.next else { return };
    let name = format!("{}, {:.0} mm", name(next.kind), next.from_lens.length());
    if !picture.mark(next.place, next.unseen, &name, colour) {
        picture.point_to(next.from_lens, &name, colour);
    }
}

#[cfg(test)]
mod tests {
    use resecta_fluid::Vessel;

    use super::*;

    /// What is further away is not in the field.
    const FIELD_MM: f32 = 25.0;

    /// Which is chosen of vessels by their kinds and distances from the lens, mm.
    fn chosen(vessels: &[(VesselKind, f32)], marked: Option<usize>) -> Option<usize> {
        let data: Vec<Vessel> = vessels
            .iter()
            .map(|&(kind, far)| Vessel {
                pentahedron: 0,
                place: Vec3::Z * far,
                direction: Vec3::X,
                kind,
                diameter_mm: 1.0,
                rate_ml_per_s: 0.1,
                clotting_s: 100.0,
            })
            .collect();
        let open = data.iter().enumerate().map(|(index, vessel)| OpenVessel {
            index,
            vessel,
            place: vessel.place,
            direction: vessel.direction,
            rate_ml_per_s: vessel.rate_ml_per_s,
            share: 1.0,
            dwell_s: 0.0,
        });
        let is_in_field = |place: Vec3| place.z < FIELD_MM;
        most_urgent(open, Vec3::ZERO, marked, is_in_field).map(|vessel| vessel.index)
    }

    #[test]
    fn arteries_come_first_then_what_is_near_and_the_mark_does_not_jump() {
        use VesselKind::{Arterial, Venous};
        assert_eq!(chosen(&[], None), None);
        assert_eq!(chosen(&[(Venous, 2.0), (Arterial, 20.0)], None), Some(1));
        assert_eq!(chosen(&[(Arterial, 9.0), (Arterial, 6.0)], None), Some(1));
        assert_eq!(chosen(&[(Arterial, 9.0), (Arterial, 6.0)], Some(0)), Some(0));
        assert_eq!(chosen(&[(Arterial, 9.0), (Arterial, 4.0)], Some(0)), Some(1));
        // An artery takes the mark of a vein, however near that is, and what is in the picture that of what is not.
        assert_eq!(chosen(&[(Venous, 1.0), (Arterial, 30.0)], Some(0)), Some(1));
        assert_eq!(chosen(&[(Arterial, 26.0), (Arterial, 24.0)], Some(0)), Some(1));
        // The one that was marked is closed.
        assert_eq!(chosen(&[(Venous, 1.0)], Some(7)), Some(0));
    }
}
