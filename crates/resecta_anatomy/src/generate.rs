//! Generated glands: plausible cases from published dimensions, for training without a patient's data.
//!
//! Width, depth, length and the transition zone's share follow our measurement on 1,099 public masks, as means by gland
//! volume; the urethra's length and bend follow the literature (see [`generate`]). The seed varies the rest a little, as
//! glands do.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::complete::{NECK_TO_VERUMONTANUM, ellipse, round, trigone};
use crate::random::SplitMix64;
use crate::spline::CubicSpline;
use crate::transition_zone::{self, look_up, published_share};
use crate::{Case, CaseSource, LUMEN_RADIUS_MM, Landmarks, Slice, Unit, contour};

/// What to generate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlandSpec {
    /// Volume inside the capsule with the middle lobe, 15 to 150 ml.
    pub volume_ml: f64,
    /// How far the middle lobe protrudes into the bladder, 0 (two lobes only) to 20 mm. Published: 9.0 ± 3.8 mm in glands
    /// of two lobes, 11.8 ± 5.2 mm in those of three (Korean J Urol 2010).
    pub median_lobe_mm: f64,
    /// Two seeds give two glands of the same size.
    pub seed: u64,
}

/// A gland that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GenerateError {
    /// Too small, too large or no number.
    #[error("volume_ml: is {volume_ml}, expected 15 to 150 ml")]
    Volume {
        /// The volume asked for, ml.
        volume_ml: f64,
    },
    /// Too long, negative or no number.
    #[error("median_lobe_mm: is {median_lobe_mm}, expected 0 to 20 mm")]
    MedianLobe {
        /// The protrusion asked for, mm.
        median_lobe_mm: f64,
    },
}

/// Gland volume in ml; left-right, anterior-posterior and base-apex sizes in mm (means over 1,099 patients).
const SIZES: [(f64, [f64; 3]); 7] = [
    (17.5, [41.4, 29.9, 35.8]),
    (30.0, [46.7, 34.6, 38.8]),
    (40.0, [50.6, 39.4, 42.6]),
    (52.5, [53.6, 43.9, 46.7]),
    (70.0, [56.9, 48.8, 51.9]),
    (95.0, [61.0, 54.5, 57.1]),
    (130.0, [65.2, 61.3, 61.7]),
];
/// Half of the relative standard deviation of each size: how far a seed may move it.
const SIZE_SPREAD: [f64; 3] = [0.035, 0.042, 0.045];

/// Slice spacing of the papers, mm.
const SPACING_MM: f64 = 5.0;
/// Corners of a capsule contour.
const CORNERS: usize = 72;
/// Where the gland is widest, as a share of the way from apex to base, and its half widths at apex and base there.
const WIDEST: f64 = 0.55;
/// Relative width of the lowest slice.
const APEX_WIDTH: f64 = 0.42;
/// Relative width of the highest slice below the bladder.
const BASE_WIDTH: f64 = 0.62;
/// How far apex and base lean forward, as shares of half the gland's depth: the gland bends about the verumontanum as its
/// urethra does.
const LEAN: [f64; 2] = [0.1, 0.28];
/// How far behind the middle the verumontanum lies, as a share of half the gland's depth.
const VERUMONTANUM_BEHIND: f64 = 0.2;
/// The prostatic urethra turns by this much at the verumontanum: the prostatic urethral angle of 131 to 142 degrees
/// (einj 2014) is what is left of 180.
const BEND_DEG: [f64; 2] = [38.0, 49.0];
/// Half the length over which it turns, mm.
const BEND_MM: f64 = 1.5;
/// Least tissue before the lumen at the bladder neck, mm.
const ANTERIOR_WALL_MM: f64 = 2.0;
/// The lateral lobes press the lumen to a slit: its half width and half depth, relative to [`LUMEN_RADIUS_MM`].
const SLIT: DVec2 = DVec2::new(0.8, 1.2);
/// Rim of tissue around the lumen beside and before the middle lobe, mm.
const RIM_MM: f64 = 2.0;
/// The middle lobe's depth where it enters the bladder, as a share of the way from lumen to the gland's posterior side.
const LOBE_DEPTH: f64 = 0.95;
/// Even in a small gland the middle lobe reaches at least this many times as far behind the lumen's centre as the rim.
const LOBE_LEAST: f64 = 1.6;
/// The middle lobe is this much wider than deep about the lumen.
const LOBE_WIDTH: f64 = 1.25;

/// Generates a complete case with 5 mm between slices, and no more between those of a middle lobe.
///
/// Two lateral lobes with a groove behind; if asked for, a middle lobe behind the lumen in slices above the bladder neck;
/// a urethra with 34/45 of its length above the verumontanum, where it bends to a prostatic urethral angle of 131 to 142
/// degrees; a transition zone of the published share. The volume (slice areas integrated along the axis by a cubic spline)
/// is the one asked for to within 0.5 %. The same specification gives the same case.
///
/// # Errors
///
/// [`GenerateError`] outside the ranges that [`GlandSpec`] states.
pub fn generate(spec: &GlandSpec) -> Result<Case, GenerateError> {
    let &GlandSpec {
        volume_ml,
        median_lobe_mm,
        seed,
    } = spec;
    if !(15.0..=150.0).contains(&volume_ml) {
        return Err(GenerateError::Volume { volume_ml });
    }
    if !(0.0..=20.0).contains(&median_lobe_mm) {
        return Err(GenerateError::MedianLobe { median_lobe_mm });
    }
    let form = Form::new(spec);
    // The volume rises with the width; 32 halvings settle it far below a cubic millimetre.
    let (mut low, mut high) = (0.5, 2.0);
    for _ in 0..32 {
        let middle = 0.5 * (low + high);
        if volume_mm3(&form.slices(middle)) < 1000.0 * volume_ml {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut slices = form.slices(high);
    let landmarks = form.landmarks(high);
    if let Some(verumontanum) = landmarks.verumontanum {
        transition_zone::fill(&mut slices, verumontanum.z, published_share(volume_ml));
    }
    let lobes = if median_lobe_mm > 0.0 { "three" } else { "two" };
    Ok(Case {
        name: format!("{volume_ml} ml, {lobes} lobes"),
        source: CaseSource {
            description: format!(
                "generated from published dimensions: volume {volume_ml} ml, median lobe {median_lobe_mm} mm, seed {seed}"
            ),
            licence: "MIT OR Apache-2.0".into(),
        },
        unit: Unit::Millimetre,
        material: Case::DEFAULT_MATERIAL.into(),
        landmarks,
        approximated: Vec::new(),
        slices,
    })
}

fn volume_mm3(slices: &[Slice]) -> f64 {
    let heights: Vec<f64> = slices.iter().map(|slice| slice.z).collect();
    let areas = slices
        .iter()
        .map(|slice| contour::signed_area(&slice.capsule))
        .collect();
    CubicSpline::new(&heights, areas).integral()
}

/// Everything of a gland but its final width.
struct Form {
    /// Half of the left-right and of the anterior-posterior size before scaling, mm.
    half_width: f64,
    half_depth: f64,
    /// Slices from apex to bladder neck.
    levels: usize,
    median_lobe_mm: f64,
    bend_rad: f64,
    /// How much wider the left half is than the right, relative.
    asymmetry: f64,
    /// Depth of the posterior groove, relative to half the depth.
    groove: f64,
    /// Waves on the outline from the second order on: amplitude, phase, turn from apex to base.
    waves: [[f64; 3]; 4],
}

impl Form {
    fn new(spec: &GlandSpec) -> Form {
        let mut random = SplitMix64::new(spec.seed);
        let volume_ml = spec.volume_ml;
        // Beyond the table's ends, sizes go on with the cube root of the volume.
        let held = volume_ml.clamp(SIZES[0].0, SIZES[SIZES.len() - 1].0);
        let [width, depth, length] = [0, 1, 2].map(|axis| {
            let table = SIZES.map(|(volume, sizes)| (volume, sizes[axis]));
            look_up(&table, held) * (volume_ml / held).cbrt() * (1.0 + SIZE_SPREAD[axis] * random.signed())
        });
        Form {
            half_width: 0.5 * width,
            half_depth: 0.5 * depth,
            levels: (length / SPACING_MM).round() as usize + 1,
            median_lobe_mm: spec.median_lobe_mm,
            bend_rad: (BEND_DEG[0] + (BEND_DEG[1] - BEND_DEG[0]) * random.unit()).to_radians(),
            asymmetry: 0.04 * random.signed(),
            groove: 0.15 + 0.04 * random.signed(),
            waves: std::array::from_fn(|wave| {
                let amplitude = 0.02 / (wave + 2) as f64 * random.unit();
                [amplitude, TAU * random.unit(), 0.8 * random.signed()]
            }),
        }
    }

    /// Height of the bladder neck above the apex, mm.
    fn neck_z(&self) -> f64 {
        (self.levels - 1) as f64 * SPACING_MM
    }

    /// Height of the verumontanum above the apex, mm.
    fn verumontanum_z(&self) -> f64 {
        (1.0 - NECK_TO_VERUMONTANUM) * self.neck_z()
    }

    /// Relative width at a share of the way from apex to base: rising and falling as the root of an arc of higher order.
    fn width(&self, along: f64) -> f64 {
        let (reach, end) = if along < WIDEST {
            (WIDEST, APEX_WIDTH)
        } else {
            (1.0 - WIDEST, BASE_WIDTH)
        };
        let off = (along - WIDEST).abs() / reach;
        (1.0 - (1.0 - end * end) * off.powf(2.3)).sqrt()
    }

    /// Middle of the slice in y at a share of the way from apex to base, mm.
    fn lean(&self, along: f64, scale: f64) -> f64 {
        let off = 2.0 * along - 1.0;
        let lean = if off < 0.0 { LEAN[0] } else { LEAN[1] };
        -lean * self.half_depth * scale * off * off
    }

    fn capsule(&self, along: f64, scale: f64) -> Vec<DVec2> {
        let size = self.width(along) * scale;
        (0..CORNERS)
            .map(|corner| {
                let angle = TAU * corner as f64 / CORNERS as f64;
                let swell: f64 = (self.waves.iter().enumerate())
                    .map(|(wave, &[amplitude, phase, turn])| {
                        amplitude * ((wave + 2) as f64 * angle + phase + PI * turn * along).cos()
                    })
                    .sum();
                // In units of the half sizes: a rounded box, narrower before, flat and grooved behind.
                let round_box = |value: f64| value.signum() * value.abs().powf(0.9);
                let (mut x, mut y) = (round_box(angle.cos()), round_box(angle.sin()));
                x *= 1.0 + 0.18 * y.min(0.0) + self.asymmetry * x;
                if y > 0.0 {
                    y *= 0.9 - self.groove * (-(x / 0.35).powi(2)).exp();
                } else {
                    y *= 1.0 - 0.03 * (-(x / 0.25).powi(2)).exp();
                }
                let half = DVec2::new(self.half_width, self.half_depth);
                let middle = DVec2::new(0.0, self.lean(along, scale));
                round(middle + half * DVec2::new(x, y) * (1.0 + swell) * size)
            })
            .collect()
    }

    /// How far the urethra leans forward above and below the verumontanum, mm a mm: half the bend each, less above where
    /// the lumen would come too near to the anterior side of the base.
    fn slopes(&self, scale: f64) -> [f64; 2] {
        let behind = VERUMONTANUM_BEHIND * self.half_depth * scale;
        let anterior = self.lean(1.0, scale) - 0.93 * self.width(1.0) * self.half_depth * scale;
        let room = behind - (anterior + SLIT.y * LUMEN_RADIUS_MM + ANTERIOR_WALL_MM);
        let above_rad = (0.5 * self.bend_rad).min((room / (self.neck_z() - self.verumontanum_z())).atan());
        [above_rad.tan(), (self.bend_rad - above_rad).tan()]
    }

    /// Centre of the urethra at a height, mm; straight up above the bladder neck.
    fn urethra(&self, z: f64, scale: f64) -> DVec2 {
        let [above, below] = self.slopes(scale);
        let off = z.min(self.neck_z()) - self.verumontanum_z();
        // A hyperbola with the two slopes as asymptotes.
        let turn = (off * off + BEND_MM * BEND_MM).sqrt();
        let forward = 0.5 * (above + below) * turn + 0.5 * (above - below) * off;
        DVec2::new(0.0, VERUMONTANUM_BEHIND * self.half_depth * scale - forward)
    }

    /// A lumen no wider than half the way to the capsule: round below the verumontanum and in the bladder, a slit between
    /// the lateral lobes.
    fn lumen(&self, z: f64, centre: DVec2, capsule: &[DVec2]) -> Vec<DVec2> {
        let between_lobes = z > self.verumontanum_z() && z <= self.neck_z();
        let shape = if between_lobes { SLIT } else { DVec2::ONE };
        let widest = 0.5 * contour::clearance(capsule, centre) / shape.max_element();
        ellipse(centre, shape * LUMEN_RADIUS_MM.min(widest))
    }

    fn slices(&self, scale: f64) -> Vec<Slice> {
        let slice = |z: f64, capsule: Vec<DVec2>| {
            let urethra = self.lumen(z, self.urethra(z, scale), &capsule);
            Slice {
                z,
                capsule,
                urethra: Some(urethra),
                transition_zone: None,
            }
        };
        let last = self.levels - 1;
        let mut slices: Vec<Slice> = (0..self.levels)
            .map(|level| {
                slice(
                    level as f64 * SPACING_MM,
                    self.capsule(level as f64 / last as f64, scale),
                )
            })
            .collect();
        let extra = (self.median_lobe_mm / SPACING_MM).ceil() as usize;
        let posterior = contour::bounds(&slices[last].capsule)[1].y;
        slices.extend((1..=extra).map(|level| {
            let rise = level as f64 / extra as f64;
            slice(
                self.neck_z() + rise * self.median_lobe_mm,
                self.median_lobe(rise, posterior, scale),
            )
        }));
        slices
    }

    /// Outline of the middle lobe in the bladder, with the rim around the lumen, at a share of its height: thick behind the
    /// lumen and tapering upwards.
    fn median_lobe(&self, rise: f64, posterior: f64, scale: f64) -> Vec<DVec2> {
        let centre = self.urethra(self.neck_z(), scale);
        let rim = LUMEN_RADIUS_MM + RIM_MM;
        let depth = (LOBE_DEPTH * (posterior - centre.y) * (1.0 - 0.6 * rise * rise).sqrt()).max(LOBE_LEAST * rim);
        (0..CORNERS)
            .map(|corner| {
                let angle = TAU * corner as f64 / CORNERS as f64;
                let behind = 0.5 + 0.5 * angle.sin();
                let [amplitude, phase, _] = self.waves[1];
                let swell = 1.0 + amplitude * (3.0 * angle + phase).cos();
                let radius = rim + (depth - rim) * behind * swell;
                let wide = DVec2::new(1.0 + (LOBE_WIDTH - 1.0) * behind, 1.0);
                round(centre + wide * radius * DVec2::from_angle(angle))
            })
            .collect()
    }

    fn landmarks(&self, scale: f64) -> Landmarks {
        let on_line = |z: f64| self.urethra(z, scale).extend(z);
        let neck = on_line(self.neck_z());
        // The middle lobe lifts the trigone behind it.
        let lifted = trigone(neck).map(|orifice| orifice + self.median_lobe_mm * DVec3::Z);
        let tidy = |point: DVec3| round(point.truncate()).extend((point.z * 1000.0).round() / 1000.0);
        Landmarks {
            bladder_neck: Some(tidy(neck)),
            verumontanum: Some(tidy(on_line(self.verumontanum_z()) + LUMEN_RADIUS_MM * DVec3::Y)),
            external_sphincter: Some(tidy(on_line(-SPACING_MM))),
            ureteral_orifices: Some(lifted.map(tidy)),
        }
    }
}
