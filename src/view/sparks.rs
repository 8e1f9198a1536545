//! What current does where it meets tissue, in the endoscope's view: sparks and a glow at the wire, and bubbles that rise.
//!
//! Only drawn: nothing here touches the simulation. A pool of a fixed size in two meshes, written anew only while something
//! is alive.

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::{NoFrustumCulling, RenderLayers},
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::ActiveExercise;
use resecta_tissue::{TissueContact, TissueResected, ToolPartKind};

use super::{
    ENDOSCOPE_LAYER, ViewSystems,
    blood::Water,
    material::{Cover, Look, Surface, ViewMaterial},
    palette,
};

/// Most sparks and bubbles at once.
const SPARKS: usize = 20;
const BUBBLES: usize = 28;
/// New ones a second under the cutting current; the other makes a third.
const SPARKS_PER_S: f32 = 260.0;
const BUBBLES_PER_S: f32 = 30.0;
/// Life of a spark and of a bubble, s.
const SPARK_S: f32 = 0.07;
const BUBBLE_S: f32 = 1.1;
/// How fast bubbles rise, mm/s: the speed of one of 0.4 mm.
const RISE_MM_PER_S: f32 = 38.0;
/// How long after the last sign of tissue the wire still sparks, s: steps may take turns with frames.
const LINGER_S: f32 = 0.05;
/// Radius of the glow about the wire, mm.
const GLOW_MM: f32 = 0.6;
/// Way from an end of the wire in which the glow comes to its full strength, mm.
const GLOW_FADES_MM: f32 = 1.2;
/// Corners of a bubble's outline.
const CORNERS: usize = 12;
/// Light falls to a quarter at this distance from the lens, mm, as the lamp's.
const REACH_MM: f32 = 10.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<Particles>()
        .add_systems(Update, (live, draw).chain().in_set(ViewSystems::Follow));
}

#[derive(Debug, Clone, Copy)]
struct Particle {
    place: Vec3,
    velocity: Vec3,
    /// Radius, mm: of a spark's glare, of a bubble.
    size: f32,
    /// s; dead from its life on.
    age: f32,
    life: f32,
    /// 0 to 1, its own.
    chance: f32,
}

impl Particle {
    fn is_alive(&self) -> bool {
        self.age < self.life
    }
}

/// All that is alive, and the wire.
#[derive(Resource, Debug, Default)]
struct Particles {
    sparks: Vec<Particle>,
    bubbles: Vec<Particle>,
    /// What a frame still owes of each.
    due: [f32; 2],
    /// s since the wire met tissue under current.
    since_contact: f32,
    wire: Vec<Vec3>,
    glow: f32,
    colour: LinearRgba,
    chance: Chance,
    /// Whether the meshes show anything.
    is_shown: bool,
}

/// Chance that looks like it: nothing depends on it.
#[derive(Debug)]
pub(super) struct Chance(u32);

impl Default for Chance {
    fn default() -> Self {
        Self(0x9e37_79b9)
    }
}

impl Chance {
    /// From 0 to 1.
    pub fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 8) as f32 / (1u32 << 24) as f32
    }

    /// Each coordinate from -1 to 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

/// Lets particles come, move and go.
fn live(
    time: Res<Time>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&Resectoscope, &InstrumentState)>,
    mut contacts: MessageReader<TissueContact>,
    mut resections: MessageReader<TissueResected>,
    mut particles: ResMut<Particles>,
) {
    let seconds = time.delta_secs();
    let particles = &mut *particles;
    let contact = contacts
        .read()
        .filter(|contact| contact.current && contact.part == ToolPartKind::Loop)
        .count();
    let resection = resections.read().filter(|resection| resection.tool.is_some()).count();
    particles.since_contact += seconds;
    if contact + resection > 0 {
        particles.since_contact = 0.0;
    }

    let instrument = active.and_then(|active| instruments.get(active.instrument).ok());
    let strength = match instrument {
        Some((_, state)) if particles.since_contact <= LINGER_S => match (state.cut, state.coagulate) {
            (true, _) => 1.0,
            (_, true) => 1.0 / 3.0,
            _ => 0.0,
        },
        _ => 0.0,
    };
    // The glow flickers, and is gone with the current.
    particles.glow = strength * (0.55 + 0.45 * particles.chance.next());
    if let Some((scope, state)) = instrument {
        let sheath = scope.sheath_pose(state);
        particles.wire.clear();
        particles.wire.extend(
            scope
                .geometry
                .loop_wire(state.stroke_mm)
                .into_iter()
                .map(|point| sheath * point),
        );
        particles.colour = if state.cut {
            palette::CUTTING
        } else {
            palette::COAGULATING
        };
    }

    for particle in particles.sparks.iter_mut().chain(&mut particles.bubbles) {
        particle.age += seconds;
        particle.place += particle.velocity * seconds;
    }
    particles.sparks.retain(Particle::is_alive);
    particles.bubbles.retain(Particle::is_alive);

    let [mut sparks, mut bubbles] = particles.due;
    sparks += strength * SPARKS_PER_S * seconds;
    bubbles += strength * BUBBLES_PER_S * seconds;
    while sparks >= 1.0 {
        sparks -= 1.0;
        if let Some(place) = on_wire(&particles.wire, &mut particles.chance)
            && particles.sparks.len() < SPARKS
        {
            let chance = &mut particles.chance;
            particles.sparks.push(Particle {
                place: place + chance.vector() * 0.25,
                velocity: chance.vector() * 12.0,
                size: 0.12 + 0.30 * chance.next() * chance.next(),
                age: 0.0,
                life: SPARK_S * (0.4 + chance.next()),
                chance: chance.next(),
            });
        }
    }
    while bubbles >= 1.0 {
        bubbles -= 1.0;
        if let Some(place) = on_wire(&particles.wire, &mut particles.chance)
            && particles.bubbles.len() < BUBBLES
        {
            let chance = &mut particles.chance;
            let size = 0.10 + 0.22 * chance.next() * chance.next();
            particles.bubbles.push(Particle {
                place: place + chance.vector() * 0.4,
                // Anterior, -y, is up; small ones rise more slowly.
                velocity: Vec3::NEG_Y * RISE_MM_PER_S * (size / 0.2).min(1.3) + chance.vector() * 5.0,
                size,
                age: 0.0,
                life: BUBBLE_S * (0.5 + chance.next()),
                chance: chance.next(),
            });
        }
    }
    particles.due = [sparks, bubbles];
}

/// A point of the wire, more often where it is deep.
fn on_wire(wire: &[Vec3], chance: &mut Chance) -> Option<Vec3> {
    let last = wire.len().checked_sub(2)?;
    let along = 0.5 + 0.5 * (chance.next() + chance.next() - 1.0);
    let place = along * wire.len() as f32;
    let piece = (place as usize).min(last);
    Some(wire[piece].lerp(wire[piece + 1], chance.next()))
}

/// What shows them: bubbles among tissue, and light over everything.
struct Shown {
    bubbles: Handle<Mesh>,
    light: Handle<Mesh>,
}

fn draw(
    lenses: Query<(&GlobalTransform, &Camera), With<super::EndoscopeCamera>>,
    mut particles: ResMut<Particles>,
    water: Res<Water>,
    mut shown: Local<Option<Shown>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let is_alive = particles.glow > 0.0 || !particles.sparks.is_empty() || !particles.bubbles.is_empty();
    // Once more when the last has gone.
    if !is_alive && !particles.is_shown {
        return;
    }
    particles.is_shown = is_alive;
    let Some((lens, _)) = lenses.iter().next() else { return };
    let shown = shown.get_or_insert_with(|| {
        let flat = Look {
            surface: Surface::Flat as u32,
            ..default()
        };
        let bubbles = meshes.add(Brush::default().mesh());
        let light = meshes.add(Brush::default().mesh());
        for (name, mesh, cover) in [("Bubbles", &bubbles, Cover::Opaque), ("Sparks", &light, Cover::Over)] {
            commands.spawn((
                Name::new(name),
                Mesh3d(mesh.clone()),
                MeshMaterial3d(materials.add(ViewMaterial {
                    look: flat.clone(),
                    cover,
                    ..default()
                })),
                Transform::default(),
                RenderLayers::layer(ENDOSCOPE_LAYER),
                NoFrustumCulling,
            ));
        }
        Shown { bubbles, light }
    });

    let eye = Eye {
        place: lens.translation(),
        right: lens.right().into(),
        up: lens.up().into(),
    };
    let mut bubbles = Brush::default();
    for bubble in &particles.bubbles {
        eye.bubble(&mut bubbles, bubble, &water);
    }
    let mut light = Brush::default();
    if particles.glow > 0.0 {
        eye.glow(
            &mut light,
            &particles.wire,
            particles.colour.with_alpha(0.55 * particles.glow),
        );
    }
    for spark in &particles.sparks {
        eye.spark(&mut light, spark, particles.colour);
    }
    for (handle, brush) in [(&shown.bubbles, bubbles), (&shown.light, light)] {
        if let Some(mut mesh) = meshes.get_mut(handle) {
            *mesh = brush.mesh();
        }
    }
}

/// From where particles are seen: they face the lens.
struct Eye {
    place: Vec3,
    right: Vec3,
    up: Vec3,
}

impl Eye {
    /// Light of the lamp there, 0 to 1.
    fn lit(&self, place: Vec3) -> f32 {
        let near = REACH_MM / (REACH_MM + place.distance(self.place));
        (1.6 * near * near).min(1.0)
    }

    /// A thin outline and a highlight: what is seen of a bubble in water.
    fn bubble(&self, brush: &mut Brush, bubble: &Particle, water: &Water) {
        // It sways, and shrinks away at its end.
        let left = 1.0 - bubble.age / bubble.life;
        let radius = bubble.size * (4.0 * left).min(1.0);
        let sway = (8.0 * bubble.age + 6.0 * bubble.chance).sin() * 0.15;
        let centre = bubble.place + self.right * sway;
        let light = self.lit(centre);
        let seen = |brightness: f32| {
            let colour = LinearRgba::rgb(0.92, 0.80, 0.76) * (brightness * light);
            water.beyond(colour, centre.distance(self.place)).with_alpha(1.0)
        };
        let corner = |corner: usize, radius: f32| {
            let (sin, cos) = (std::f32::consts::TAU * corner as f32 / CORNERS as f32).sin_cos();
            (cos, sin, centre + (self.right * cos + self.up * sin) * radius)
        };
        for side in 0..CORNERS {
            let corners = [
                corner(side, radius),
                corner(side + 1, radius),
                corner(side + 1, 0.80 * radius),
                corner(side, 0.80 * radius),
            ];
            // Brighter above, where the lamp is.
            let shade = |(_, sin, _): (f32, f32, Vec3)| seen(0.30 + 0.28 * (sin + 1.0));
            brush.quad(corners.map(|corner| corner.2), corners.map(shade));
        }
        let spot = centre + (self.up * 0.35 - self.right * 0.30) * radius;
        let (x, y) = (self.right * 0.16 * radius, self.up * 0.16 * radius);
        brush.quad([spot - x, spot - y, spot + x, spot + y], [seen(1.3); 4]);
    }

    /// A glare with a bright middle, and a short needle away from it.
    fn spark(&self, brush: &mut Brush, spark: &Particle, colour: LinearRgba) {
        let left = (1.0 - spark.age / spark.life).clamp(0.0, 1.0);
        let (sin, cos) = (std::f32::consts::TAU * spark.chance).sin_cos();
        let along = (self.right * cos + self.up * sin) * spark.size;
        let across = (self.up * cos - self.right * sin) * spark.size;
        let white = LinearRgba::rgb(1.0, 0.93, 0.75).with_alpha(left);
        let (edge, dim) = (colour.with_alpha(0.0), colour.with_alpha(0.5 * left));
        let round = [along, across, -along, -across];
        for (radius, middle) in [(1.0, dim), (0.35, white)] {
            for side in 0..4 {
                let (a, c) = (round[side] * radius, round[(side + 1) % 4] * radius);
                let b = (a + c) * std::f32::consts::FRAC_1_SQRT_2;
                brush.quad(
                    [spark.place, spark.place + a, spark.place + b, spark.place + c],
                    [middle, edge, edge, edge],
                );
            }
        }
        let thin = across * 0.10;
        let tip = spark.place + along * (1.5 + 2.0 * spark.chance);
        brush.quad(
            [spark.place + thin, tip, tip, spark.place - thin],
            [white, edge, edge, white],
        );
    }

    /// A band about the wire, brightest in its middle, that fades in and out at its ends.
    fn glow(&self, brush: &mut Brush, wire: &[Vec3], colour: LinearRgba) {
        let edge = colour.with_alpha(0.0);
        let shares = from_ends(wire);
        let across = |point: usize| {
            let (before, after) = (wire[point.saturating_sub(1)], wire[(point + 1).min(wire.len() - 1)]);
            (after - before).cross(wire[point] - self.place).normalize_or_zero() * GLOW_MM
        };
        for point in 1..wire.len() {
            let (from, to) = (wire[point - 1], wire[point]);
            for side in [1.0, -1.0] {
                let (a, b) = (across(point - 1) * side, across(point) * side);
                let [at_from, at_to] = [point - 1, point].map(|point| colour.with_alpha(colour.alpha * shares[point]));
                brush.quad([from, to, to + b, from + a], [at_from, at_to, edge, edge]);
            }
        }
    }
}

/// How far from the nearer end of a wire its points are, as a share of [`GLOW_FADES_MM`]; at most 1.
fn from_ends(wire: &[Vec3]) -> Vec<f32> {
    let lengths = wire.windows(2).map(|ends| ends[0].distance(ends[1]));
    let along: Vec<f32> = std::iter::once(0.0)
        .chain(lengths.scan(0.0, |sum, length| {
            *sum += length;
            Some(*sum)
        }))
        .collect();
    let whole = along.last().copied().unwrap_or(0.0);
    let share = |at: f32| (at.min(whole - at) / GLOW_FADES_MM).min(1.0);
    along.into_iter().map(share).collect()
}

/// Quadrilaterals on their way to a mesh.
#[derive(Default)]
struct Brush {
    places: Vec<[f32; 3]>,
    colours: Vec<[f32; 4]>,
}

impl Brush {
    fn quad(&mut self, corners: [Vec3; 4], colours: [LinearRgba; 4]) {
        self.places.extend(corners.map(|corner| corner.to_array()));
        self.colours.extend(colours.map(|colour| colour.to_f32_array()));
    }

    fn mesh(mut self) -> Mesh {
        if self.places.is_empty() {
            // A mesh of nothing cannot be drawn; one of no size is not seen.
            self.quad([Vec3::ZERO; 4], [LinearRgba::NONE; 4]);
        }
        let quads = self.places.len() as u32 / 4;
        let normals = vec![[0.0, 0.0, 1.0]; self.places.len()];
        let corners = (0..quads).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|corner| 4 * quad + corner));
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, self.places);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals);
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, self.colours);
        mesh.insert_indices(Indices::U32(corners.collect()));
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glow_is_nothing_at_the_ends_and_whole_in_the_middle() {
        let wire: Vec<Vec3> = (0..=10).map(|n| Vec3::X * (0.5 * n as f32)).collect();
        let shares = from_ends(&wire);
        assert_eq!((shares[0], shares[10], shares[5]), (0.0, 0.0, 1.0));
        assert!((shares[1] - 0.5 / GLOW_FADES_MM).abs() < 1e-6 && shares[1] == shares[9]);
        assert!(from_ends(&[]).iter().all(|share| *share == 0.0));
    }

    #[test]
    fn chance_stays_on_the_wire() {
        let wire = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0)];
        let mut chance = Chance::default();
        for _ in 0..1000 {
            let place = on_wire(&wire, &mut chance).expect("it has a length");
            let is_on = (place.y == 0.0 && (0.0..=1.0).contains(&place.x)) || (place.x == 1.0 && place.y <= 1.0);
            assert!(is_on, "{place}");
        }
        assert_eq!(on_wire(&wire[..1], &mut chance), None);
    }
}
