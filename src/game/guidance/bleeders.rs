//! Which bleeder is to be closed next, and where it is: blood in the water hides it, and whoever looks for it draws back from it.

use bevy::prelude::*;
use resecta_fluid::{OpenVessel, VesselKind, Vessels};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, Sight, Unseen};

use super::{super::palette, Shown, picture::Picture};
use crate::view::ViewSystems;

/// A vessel as urgent as the one that is marked takes its place where it is nearer to the lens by this, mm: between two alike the mark is
/// not to jump to and fro.
const NEARER_MM: f32 = 4.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<NextBleeder>()
        .add_systems(Update, look.in_set(ViewSystems::Last));
}

/// The bleeder that is marked; none where nothing bleeds, or no guidance is shown.
#[derive(Resource, Debug, Default, PartialEq)]
pub struct NextBleeder(Option<Bleeder>);

#[derive(Debug, Clone, Copy, PartialEq)]
struct Bleeder {
    /// Its index in the list of vessels.
    index: usize,
    kind: VesselKind,
    place: Vec3,
    /// The way to it from the lens, mm: right, up and back as the picture has it.
    from_lens: Vec3,
    unseen: Option<Unseen>,
}

/// Chooses one, and casts a ray at it.
fn look(
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    lists: Query<&Vessels>,
    mut sight: Sight,
    mut next: ResMut<NextBleeder>,
) {
    let active = active.filter(|_| shown.names_landmarks());
    let found = active.and_then(|active| {
        let (state, scope) = instruments.get(active.instrument).ok()?;
        let lens = scope.lens_pose(state);
        let marked = next.0.map(|marked| marked.index);
        let open = lists.get(active.tissue).ok()?.open();
        let is_in_field = |place: Vec3| scope.has_in_field(state, place);
        let vessel = most_urgent(open, lens.translation.into(), marked, is_in_field)?;
        Some(Bleeder {
            index: vessel.index,
            kind: vessel.vessel.kind,
            place: vessel.place,
            from_lens: lens.inverse() * vessel.place,
            unseen: sight.unseen(vessel.place),
        })
    });
    next.set_if_neq(NextBleeder(found));
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

/// Marks it in the picture.
pub fn show(picture: &Picture, next: &NextBleeder, opacity: f32) {
    let Some(bleeder) = next.0 else { return };
    let name = match bleeder.kind {
        VesselKind::Arterial => "artery",
        VesselKind::Venous => "vein",
    };
    let name = format!("{name}, {:.0} mm", bleeder.from_lens.length());
    // The colour of the current that closes it, which also stands out from tissue and blood.
    let colour = palette::COAGULATION.gamma_multiply(opacity);
    if !picture.mark(bleeder.place, bleeder.unseen, &name, colour) {
        picture.point_to(bleeder.from_lens, &name, colour);
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
