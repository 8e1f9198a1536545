//! What a scan line meets: how strongly tissue scatters, what mirrors, what casts a shadow.

use glam::{DVec2, DVec3};
use resecta_anatomy::{Case, contour};

use super::fan::Fan;
use super::speckle::{FWHM_OVER_SD, margins};
use super::{SyntheticOptions, amplitude, stream};

/// The transition zone beside the rest of the gland: darker, and of uneven texture where it is nodular.
const TRANSITION_ZONE_DB: f64 = -3.0;
const TRANSITION_ZONE_TEXTURE: f64 = 2.0;
/// The lumen of the urethra beside the gland.
const URETHRA_DB: f64 = -10.0;
/// The rectal wall from the probe on: depth in mm up to which a layer reaches, and its echo beside the surroundings.
const WALL: [(f64, f64); 3] = [(0.6, 10.0), (1.6, 2.0), (3.0, -7.0)];
/// The capsule where the beam meets it squarely, beside the surroundings; it falls as a power of the cosine of the angle.
const CAPSULE_DB: f64 = 6.0;
const CAPSULE_POWER: i32 = 4;
/// Refraction at grazing sides: shadow behind, at most, and the cosine of the angle below which it begins.
const EDGE_SHADOW_DB: f64 = 8.0;
const EDGE_COSINE: f64 = 0.35;
/// A calcification: radius, echo and shadow behind.
const CALCIFICATION_RADIUS_MM: [f64; 2] = [0.5, 1.5];
const CALCIFICATION_DB: f64 = 14.0;
const CALCIFICATION_SHADOW_DB: f64 = 25.0;
/// Distance over which the texture of a tissue changes, mm.
const TEXTURE_MM: f64 = 4.0;

/// A case as sound meets it.
pub(super) struct Tissue<'a> {
    case: &'a Case,
    options: &'a SyntheticOptions,
    seed: u64,
    calcifications: Vec<Calcification>,
}

struct Calcification {
    slice: usize,
    centre: DVec2,
    radius_mm: f64,
}

/// What a fan receives of one slice, attenuation included.
pub(super) struct Echoes {
    /// Amplitude of scattering with the margins around the fan.
    pub scatter: Vec<f32>,
    /// Amplitude of mirrored echoes at the samples of the fan.
    pub mirror: Vec<f32>,
}

impl<'a> Tissue<'a> {
    pub fn new(case: &'a Case, options: &'a SyntheticOptions, seed: u64) -> Tissue<'a> {
        const TRIES: usize = 200;
        let mut random = stream(seed, &[u64::MAX]);
        let calcifications = (0..options.calcifications)
            .filter_map(|_| {
                let slice = ((random.unit() * case.slices.len() as f64) as usize).min(case.slices.len() - 1);
                let capsule = &case.slices[slice].capsule;
                let [low, high] = contour::bounds(capsule);
                let radius_mm = random.between(CALCIFICATION_RADIUS_MM);
                let inside = (0..TRIES)
                    .map(|_| DVec2::new(random.between([low.x, high.x]), random.between([low.y, high.y])))
                    .find(|&point| contour::clearance(capsule, point) > radius_mm);
                Some(Calcification {
                    slice,
                    centre: inside?,
                    radius_mm,
                })
            })
            .collect();
        Tissue {
            case,
            options,
            seed,
            calcifications,
        }
    }

    /// What the fan receives of a slice.
    pub fn echoes(&self, fan: &Fan, slice: usize) -> Echoes {
        let [row_margin, line_margin] = margins(fan);
        let (wide, tall) = (fan.lines + 2 * line_margin, fan.rows + 2 * row_margin);
        let mut echoes = Echoes {
            scatter: vec![0.0; wide * tall],
            mirror: vec![0.0; fan.lines * fan.rows],
        };
        for column in 0..wide {
            let line = column as isize - line_margin as isize;
            let path = self.path(fan, fan.direction(line), slice);
            for row in 0..tall {
                let depth_mm = (row as f64 - row_margin as f64) * fan.row_step_mm;
                echoes.scatter[row * wide + column] = amplitude(self.scatter_db(fan, &path, depth_mm.max(0.0)));
            }
            if let Some(line) = usize::try_from(line).ok().filter(|&line| line < fan.lines) {
                for row in 0..fan.rows {
                    echoes.mirror[row * fan.lines + line] = self.mirror(fan, &path, fan.depth_mm(row));
                }
            }
        }
        echoes
    }

    /// All that a line from the probe passes.
    fn path(&self, fan: &Fan, direction: DVec2, slice: usize) -> Path {
        let outlines = &self.case.slices[slice];
        let crossings = |contour: Option<&Vec<DVec2>>| contour.map_or_else(Vec::new, |c| crossings(fan, direction, c));
        let stones = self
            .calcifications
            .iter()
            .filter(|stone| stone.slice == slice)
            .filter_map(|stone| {
                let offset = stone.centre - fan.point(direction, 0.0);
                let (along, aside) = (offset.dot(direction), offset.perp_dot(direction));
                let half = (stone.radius_mm.powi(2) - aside * aside).sqrt();
                (half > 0.0).then_some([along - half, along + half])
            })
            .collect();
        Path {
            direction,
            z_mm: outlines.z,
            capsule: crossings(Some(&outlines.capsule)),
            transition_zone: crossings(outlines.transition_zone.as_ref()),
            urethra: crossings(outlines.urethra.as_ref()),
            stones,
        }
    }

    /// Echo of the scatterers at a depth, dB beside the surroundings at the probe.
    fn scatter_db(&self, fan: &Fan, path: &Path, depth_mm: f64) -> f64 {
        let inside = |crossings: &[Crossing]| crossings.iter().filter(|c| c.depth_mm <= depth_mm).count() % 2 == 1;
        let (mut echo, mut texture) = (0.0, 1.0);
        if inside(&path.capsule) {
            echo = self.options.gland_db;
            if inside(&path.transition_zone) {
                echo += TRANSITION_ZONE_DB;
                texture = TRANSITION_ZONE_TEXTURE;
            }
            if inside(&path.urethra) {
                echo += URETHRA_DB;
            }
        } else if let Some((_, wall)) = WALL.iter().find(|(reach, _)| depth_mm < *reach) {
            echo = *wall;
        }
        if path.stones.iter().any(|[from, to]| (*from..*to).contains(&depth_mm)) {
            echo = CALCIFICATION_DB;
        }
        if self.options.texture_db > 0.0 {
            let place = fan.point(path.direction, depth_mm).extend(path.z_mm);
            echo += texture * self.options.texture_db * self.texture(place / TEXTURE_MM);
        }
        echo - self.lost_db(path, depth_mm)
    }

    /// Amplitude that the capsule throws straight back.
    fn mirror(&self, fan: &Fan, path: &Path, depth_mm: f64) -> f32 {
        let sd = fan.beam.pulse_fwhm_mm / FWHM_OVER_SD;
        let mirrored: f64 = path
            .capsule
            .iter()
            .map(|crossing| ((depth_mm - crossing.depth_mm) / sd, crossing.cosine))
            .filter(|(away, _)| away.abs() < 4.0)
            .map(|(away, cosine)| cosine.powi(CAPSULE_POWER) * (-0.5 * away * away).exp())
            .sum();
        if mirrored > 0.0 {
            amplitude(CAPSULE_DB - self.lost_db(path, depth_mm)) * mirrored as f32
        } else {
            0.0
        }
    }

    /// Attenuation there and back and shadows on the way, dB.
    fn lost_db(&self, path: &Path, depth_mm: f64) -> f64 {
        let per_mm = 2.0 * self.options.attenuation_db_per_cm_mhz * self.options.frequency_mhz / 10.0;
        let refracted: f64 = path
            .capsule
            .iter()
            .filter(|crossing| crossing.depth_mm < depth_mm)
            .map(|crossing| EDGE_SHADOW_DB * (1.0 - crossing.cosine / EDGE_COSINE).max(0.0))
            .fold(0.0, f64::max);
        let is_shadowed = path.stones.iter().any(|[_, to]| *to <= depth_mm);
        per_mm * depth_mm + refracted + if is_shadowed { CALCIFICATION_SHADOW_DB } else { 0.0 }
    }

    /// A smooth field of about unit variance: normal numbers at whole coordinates, between them by smooth steps.
    fn texture(&self, place: DVec3) -> f64 {
        let base = place.floor();
        let part = (place - base).to_array();
        let part = part.map(|t| t * t * (3.0 - 2.0 * t));
        let (mut sum, mut power) = (0.0, 0.0);
        for corner in 0..8_u64 {
            let steps = [corner & 1, (corner >> 1) & 1, corner >> 2];
            let weight: f64 = (0..3)
                .map(|axis| if steps[axis] == 1 { part[axis] } else { 1.0 - part[axis] })
                .product();
            let node = base.to_array();
            let node = [0, 1, 2].map(|axis| (node[axis] as i64 as u64).wrapping_add(steps[axis]));
            // A sum of twelve even numbers is nearly normal; four do here, where nothing rests on the tails.
            let mut random = stream(self.seed, &node);
            let value: f64 = (0..4).map(|_| random.signed()).sum::<f64>() * (3.0_f64 / 4.0).sqrt();
            sum += weight * value;
            power += weight * weight;
        }
        sum / power.sqrt()
    }
}

/// What one line passes, with depths from the probe's surface on.
struct Path {
    direction: DVec2,
    z_mm: f64,
    capsule: Vec<Crossing>,
    transition_zone: Vec<Crossing>,
    urethra: Vec<Crossing>,
    /// From where to where a line runs in a calcification.
    stones: Vec<[f64; 2]>,
}

struct Crossing {
    depth_mm: f64,
    /// Of the angle between the line and the contour's normal, 0 (grazing) to 1.
    cosine: f64,
}

/// Where a line from the probe crosses a contour.
fn crossings(fan: &Fan, direction: DVec2, contour: &[DVec2]) -> Vec<Crossing> {
    let start = fan.point(direction, 0.0);
    contour::edges(contour)
        .filter_map(|[a, b]| {
            let (side_a, side_b) = (direction.perp_dot(a - start), direction.perp_dot(b - start));
            // A corner on the line counts with one of its edges only.
            if (side_a > 0.0) == (side_b > 0.0) {
                return None;
            }
            let along = a + (b - a) * (side_a / (side_a - side_b));
            let depth_mm = (along - start).dot(direction);
            (depth_mm > 0.0).then(|| Crossing {
                depth_mm,
                cosine: direction.perp_dot((b - a).normalize_or_zero()).abs(),
            })
        })
        .collect()
}
