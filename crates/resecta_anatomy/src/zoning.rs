//! Which zone each pentahedron of a prostate lies in.
//!
//! The transition zone's contour is sampled on every given slice along the lattice's rays (outermost crossing: the contour
//! need not lie around the urethra) and carried along the axis like the capsule. A pentahedron belongs to the zone where
//! its nodes lie inside on the mean, and then:
//!
//! - to the middle lobe, if its centre lies between 5 and 7 o'clock seen from the urethra's centre (within 30 degrees of
//!   posterior) and above the verumontanum (without that landmark there is no middle lobe);
//! - to a lateral lobe otherwise.
//!
//! Everything else is peripheral.

use glam::{DVec2, DVec3};

use crate::spline::CubicSpline;
use crate::{Case, Lattice, Zone, sampling, wedge};

/// Half the posterior sector from 5 to 7 o'clock, degrees.
const MIDDLE_LOBE_HALF_ANGLE_DEG: f64 = 30.0;

/// A zone a pentahedron; `heights` and `centres` are those of the given slices.
pub(crate) fn zones(case: &Case, heights: &[f64], centres: &[DVec2], lattice: &Lattice) -> Vec<Zone> {
    let shape = lattice.shape;
    let angles = shape.angles as usize;
    let given: Vec<Vec<f64>> = (case.slices.iter().zip(centres))
        .map(|(slice, &centre)| match &slice.transition_zone {
            Some(contour) => sampling::outermost_radii(contour, centre, angles),
            None => vec![0.0; angles],
        })
        .collect();
    let splines: Vec<CubicSpline> = (0..angles)
        .map(|ray| CubicSpline::new(heights, given.iter().map(|radii| radii[ray]).collect()))
        .collect();
    let verumontanum_z = case.landmarks.verumontanum.map_or(f64::INFINITY, |point| point.z);
    // How far inside the transition zone each node lies along its ray, mm.
    let depth: Vec<f64> = (lattice.positions.iter().enumerate())
        .map(|(node, &position)| {
            let [i, j, _] = shape.coordinates(node as u32);
            let boundary = splines[j as usize].positive_at(position.z);
            boundary - position.distance(lattice.centres[i as usize])
        })
        .collect();
    (lattice.pentahedra.iter().enumerate())
        .map(|(index, nodes)| {
            if nodes.iter().map(|&node| depth[node as usize]).sum::<f64>() <= 0.0 {
                return Zone::Peripheral;
            }
            let [i, ..] = shape.cell_coordinates(index as u32 / 2);
            let place = wedge::centroid(nodes, |node| lattice.positions[node as usize]);
            let urethra = lattice.centres[i as usize].midpoint(lattice.centres[i as usize + 1]);
            if place.z > verumontanum_z && is_posterior(place - urethra) {
                Zone::MiddleLobe
            } else {
                Zone::LateralLobe
            }
        })
        .collect()
}

/// Whether a direction from the urethra points between 5 and 7 o'clock.
fn is_posterior(from_urethra: DVec3) -> bool {
    let along = from_urethra.truncate();
    along.y > along.length() * MIDDLE_LOBE_HALF_ANGLE_DEG.to_radians().cos()
}
