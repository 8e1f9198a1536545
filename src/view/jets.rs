//! Blood on its way from open vessels into the water: an artery's jet that beats, a vein's slow cloud.
//!
//! Only drawn: what blood does to the water as a whole is in `resecta_fluid`. A pool of soft discs that face the lens, in one mesh.

use std::collections::BTreeMap;

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::{NoFrustumCulling, RenderLayers},
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use resecta_fluid::{OpenVessel, VesselKind, Vessels};

use super::{
    ENDOSCOPE_LAYER, EndoscopeCamera, ViewSystems,
    material::{Cover, Look, Surface, ViewMaterial},
    palette,
    sparks::Chance,
};

/// Reach of a jet for each ml/s, mm, and the longest. Our choice: an artery of 4 ml/min, 0.07 ml/s, is seen as some millimetres.
const JET_MM_PER_ML_S: f32 = 100.0;
const LONGEST_JET_MM: f32 = 12.0;
/// In this time water has taken all but 1/e of a jet's speed, s.
const SLOWED_S: f32 = 0.12;
/// How fast a vein's blood leaves it, mm/s.
const OOZE_MM_PER_S: f32 = 3.0;
/// Most discs at once: beyond, no more come.
const MOST: usize = 700;

pub fn plugin(app: &mut App) {
    app.init_resource::<Plumes>()
        .add_systems(Update, (live, draw).chain().in_set(ViewSystems::Follow));
}

/// A bit of blood in the water.
#[derive(Debug, Clone, Copy)]
struct Puff {
    place: Vec3,
    velocity: Vec3,
    /// s; gone from its life on.
    age: f32,
    life: f32,
    /// Radius at first and at its end, mm.
    size: [f32; 2],
    /// How much it hides at first, 0 to 1.
    dense: f32,
}

impl Puff {
    /// What leaves a vessel.
    fn of(vessel: &OpenVessel, chance: &mut Chance) -> Self {
        let direction = vessel.direction.normalize_or(Vec3::Y);
        match vessel.vessel.kind {
            VesselKind::Arterial => {
                let reach = (JET_MM_PER_ML_S * vessel.rate_ml_per_s as f32).min(LONGEST_JET_MM);
                let speed = reach / SLOWED_S;
                Puff {
                    place: vessel.place + direction * 0.1,
                    // Some lag behind, so that the jet has no end as round as a disc.
                    velocity: (direction + chance.vector() * 0.10) * (speed * (0.45 + 0.55 * chance.next())),
                    age: 0.0,
                    life: 0.30 + 0.25 * chance.next(),
                    // Thin where it leaves the vessel, where discs lie on each other.
                    size: [0.10, 0.6 + 0.8 * chance.next()],
                    dense: 0.45 + 0.30 * chance.next(),
                }
            }
            VesselKind::Venous => Puff {
                place: vessel.place + chance.vector() * 0.3,
                velocity: (direction + chance.vector() * 0.5) * OOZE_MM_PER_S,
                age: 0.0,
                life: 1.5 + chance.next(),
                size: [0.30, 1.6 + 0.6 * chance.next()],
                dense: 0.50,
            },
        }
    }

    /// How many leave a vessel a second.
    fn per_s(vessel: &OpenVessel) -> f32 {
        match vessel.vessel.kind {
            VesselKind::Arterial => 110.0,
            VesselKind::Venous => 9.0 * vessel.share as f32,
        }
    }

    fn age(&mut self, seconds: f32) {
        self.age += seconds;
        let left = (-seconds / SLOWED_S).exp();
        // A jet is slowed; what drifts keeps drifting.
        let drift = self.velocity.clamp_length_max(OOZE_MM_PER_S);
        self.place += drift * seconds + (self.velocity - drift) * (SLOWED_S * (1.0 - left));
        self.velocity = drift + (self.velocity - drift) * left;
    }

    /// Radius, mm, and how much it hides now.
    fn seen(&self) -> (f32, f32) {
        let share = (self.age / self.life).clamp(0.0, 1.0);
        (
            self.size[0] + (self.size[1] - self.size[0]) * share.sqrt(),
            self.dense * (1.0 - share) * (1.0 - share),
        )
    }
}

/// All blood that is seen on its way.
#[derive(Resource, Debug, Default)]
struct Plumes {
    puffs: Vec<Puff>,
    /// What each vessel still owes, by its tissue and index.
    due: BTreeMap<(Entity, usize), f32>,
    chance: Chance,
    /// Whether the mesh shows any.
    is_shown: bool,
}

fn live(time: Res<Time>, vessels: Query<(Entity, &Vessels)>, mut plumes: ResMut<Plumes>) {
    let seconds = time.delta_secs();
    let plumes = &mut *plumes;
    plumes.puffs.iter_mut().for_each(|puff| puff.age(seconds));
    plumes.puffs.retain(|puff| puff.age < puff.life);
    let mut due = BTreeMap::new();
    for (tissue, vessels) in &vessels {
        for vessel in vessels.open() {
            let key = (tissue, vessel.index);
            let mut owed = plumes.due.get(&key).copied().unwrap_or(0.0) + Puff::per_s(&vessel) * seconds;
            while owed >= 1.0 {
                owed -= 1.0;
                if plumes.puffs.len() < MOST {
                    let mut puff = Puff::of(&vessel, &mut plumes.chance);
                    // Those of one frame left one after the other.
                    puff.age(seconds * plumes.chance.next());
                    plumes.puffs.push(puff);
                }
            }
            due.insert(key, owed);
        }
    }
    plumes.due = due;
}

fn draw(
    lenses: Query<(&GlobalTransform, &Camera), With<EndoscopeCamera>>,
    mut plumes: ResMut<Plumes>,
    mut shown: Local<Option<Handle<Mesh>>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    // Once more when the last has gone.
    if plumes.puffs.is_empty() && !plumes.is_shown {
        return;
    }
    plumes.is_shown = !plumes.puffs.is_empty();
    let Some((lens, _)) = lenses.iter().next() else { return };
    let mesh = discs(&plumes.puffs, lens);
    if let Some(handle) = &*shown {
        if let Some(mut known) = meshes.get_mut(handle) {
            *known = mesh;
        }
        return;
    }
    let handle = meshes.add(mesh);
    commands.spawn((
        Name::new("Jets"),
        Mesh3d(handle.clone()),
        MeshMaterial3d(
            materials.add(ViewMaterial {
                look: Look {
                    surface: Surface::Cloud as u32,
                    ..default()
                }
                .under_lamp(),
                cover: Cover::Among,
                ..default()
            }),
        ),
        Transform::default(),
        RenderLayers::layer(ENDOSCOPE_LAYER),
        NoFrustumCulling,
    ));
    *shown = Some(handle);
}

/// A quadrilateral for each, towards the lens, the farthest first.
fn discs(puffs: &[Puff], lens: &GlobalTransform) -> Mesh {
    let (right, up) = (Vec3::from(lens.right()), Vec3::from(lens.up()));
    let mut ordered: Vec<&Puff> = puffs.iter().collect();
    let far = |puff: &&Puff| puff.place.distance_squared(lens.translation());
    ordered.sort_by(|a, b| far(b).total_cmp(&far(a)));
    let count = 4 * ordered.len().max(1);
    let (mut places, mut colours) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    for puff in ordered {
        let (radius, dense) = puff.seen();
        places.extend(corners.map(|[x, y]| (puff.place + (right * x + up * y) * radius).to_array()));
        colours.extend([palette::BLOOD.with_alpha(dense).to_f32_array(); 4]);
    }
    // A mesh of nothing cannot be drawn; one of no size is not seen.
    places.resize(count, [0.0; 3]);
    colours.resize(count, [0.0; 4]);
    let quads = count as u32 / 4;
    let indices = (0..quads).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|corner| 4 * quad + corner));
    let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; count]);
    mesh.insert_attribute(Mesh::ATTRIBUTE_UV_0, corners.repeat(count / 4));
    mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, places);
    mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colours);
    mesh.insert_indices(Indices::U32(indices.collect()));
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn puff(speed: f32) -> Puff {
        Puff {
            place: Vec3::ZERO,
            velocity: Vec3::Y * speed,
            age: 0.0,
            life: 0.5,
            size: [0.2, 1.0],
            dense: 0.8,
        }
    }

    #[test]
    fn a_jet_comes_as_far_in_few_frames_as_in_many() {
        let way = |frames: usize| {
            let mut puff = puff(60.0);
            (0..frames).for_each(|_| puff.age(0.5 / frames as f32));
            puff.place.y
        };
        assert!((way(1) - way(100)).abs() < 0.05, "{} {}", way(1), way(100));
        // Its speed over the slowing, and what drifts on.
        assert!((way(30) - (57.0 * SLOWED_S + 3.0 * 0.5)).abs() < 0.2, "{}", way(30));
    }

    #[test]
    fn blood_spreads_and_thins_until_it_is_gone() {
        let mut puff = puff(10.0);
        let mut before = puff.seen();
        for _ in 0..10 {
            puff.age(0.05);
            let now = puff.seen();
            assert!(now.0 > before.0 && now.1 < before.1);
            before = now;
        }
        assert_eq!(before.1, 0.0);
    }
}
