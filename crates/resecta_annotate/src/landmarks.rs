//! Landmarks of an outline: the same places on every gland.
//!
//! Four anatomical reference points are where the lines through the middle of the gland, sagittal and coronal, leave it:
//! anterior, left, posterior, right. Between two of them the landmarks divide the outline by arc length, so that a notch or
//! a posterior hollow, which a ray would cross several times, is followed.

use glam::DVec2;
use resecta_anatomy::contour;

/// Landmarks of an outline, a multiple of four: the first anterior, then counter-clockwise in (x, y), so the patient's
/// left, posterior and right follow a quarter each.
pub const LANDMARKS: usize = 32;

/// The landmark opposite in the mirror of the sagittal plane.
pub const fn mirrored(landmark: usize) -> usize {
    (LANDMARKS - landmark) % LANDMARKS
}

/// The landmarks of a closed outline, mm; none where it encloses no area.
pub fn landmarks(outline: &[DVec2]) -> Option<Vec<DVec2>> {
    let outline = contour::ensure_ccw(outline.to_vec());
    if outline.len() < 3 || contour::signed_area(&outline) <= 0.0 {
        return None;
    }
    let mut middle = contour::centroid(&outline);
    if !contour::contains(&outline, middle) {
        middle = contour::inscribed(&outline).centre;
    }
    let mut lengths = vec![0.0];
    for [a, b] in contour::edges(&outline) {
        lengths.push(lengths[lengths.len() - 1] + a.distance(b));
    }
    let total = lengths[outline.len()];
    let references = [DVec2::NEG_Y, DVec2::X, DVec2::Y, DVec2::NEG_X].map(|direction| {
        let (edge, along) = last_exit(&outline, middle, direction)?;
        Some(lengths[edge] + along * (lengths[edge + 1] - lengths[edge]))
    });
    let [first, ..] = references;
    let first = first?;
    // Arc lengths from the anterior point on.
    let mut marks = [0.0; 5];
    for (mark, reference) in marks.iter_mut().zip(references) {
        *mark = (reference? - first).rem_euclid(total);
    }
    marks[4] = total;
    if marks.windows(2).any(|pair| pair[0] >= pair[1]) {
        // An outline so winding that the four points are out of order: quarters of its length instead.
        marks = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * total);
    }
    let quarter = LANDMARKS / 4;
    let places = (0..LANDMARKS).map(|landmark| {
        let (from, to) = (marks[landmark / quarter], marks[landmark / quarter + 1]);
        let share = (landmark % quarter) as f64 / quarter as f64;
        at_length(
            &outline,
            &lengths,
            (first + from + share * (to - from)).rem_euclid(total),
        )
    });
    Some(places.collect())
}

/// The edge and the place along it, 0 to 1, where a ray leaves the outline for the last time.
fn last_exit(outline: &[DVec2], origin: DVec2, direction: DVec2) -> Option<(usize, f64)> {
    contour::edges(outline)
        .enumerate()
        .filter_map(|(index, [a, b])| {
            let edge = b - a;
            let determinant = direction.perp_dot(edge);
            if determinant == 0.0 {
                return None;
            }
            let along_ray = (a - origin).perp_dot(edge) / determinant;
            let along_edge = (a - origin).perp_dot(direction) / determinant;
            (along_ray >= 0.0 && (0.0..=1.0).contains(&along_edge)).then_some((along_ray, index, along_edge))
        })
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, index, along)| (index, along))
}

fn at_length(outline: &[DVec2], lengths: &[f64], length: f64) -> DVec2 {
    let edge = lengths
        .partition_point(|&start| start <= length)
        .saturating_sub(1)
        .min(outline.len() - 1);
    let step = lengths[edge + 1] - lengths[edge];
    let share = if step > 0.0 {
        (length - lengths[edge]) / step
    } else {
        0.0
    };
    outline[edge].lerp(outline[(edge + 1) % outline.len()], share)
}

/// Outward unit normals at the points of a closed counter-clockwise outline, from the neighbours on both sides.
pub fn normals(points: &[DVec2]) -> Vec<DVec2> {
    let count = points.len();
    (0..count)
        .map(|point| {
            let along = points[(point + 1) % count] - points[(point + count - 1) % count];
            DVec2::new(along.y, -along.x).normalize_or_zero()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipse(corners: usize, turn: usize) -> Vec<DVec2> {
        (0..corners)
            .map(|corner| {
                let angle = std::f64::consts::TAU * (corner + turn) as f64 / corners as f64;
                DVec2::new(25.0, 18.0) * DVec2::from_angle(angle) + DVec2::new(3.0, -2.0)
            })
            .collect()
    }

    #[test]
    fn they_do_not_depend_on_where_an_outline_begins_nor_on_its_sense() {
        let first = landmarks(&ellipse(360, 0)).expect("an ellipse");
        let mut reversed = ellipse(360, 77);
        reversed.reverse();
        let second = landmarks(&reversed).expect("an ellipse");
        assert_eq!(first.len(), LANDMARKS);
        for (one, other) in first.iter().zip(&second) {
            assert!(one.distance(*other) < 1e-6, "{one} {other}");
        }
        // Anterior is -y, and the patient's left comes next.
        assert!((first[0] - DVec2::new(3.0, -20.0)).length() < 0.1);
        assert!((first[LANDMARKS / 4] - DVec2::new(28.0, -2.0)).length() < 0.1);
    }

    #[test]
    fn a_mirrored_outline_has_mirrored_landmarks() {
        let outline: Vec<DVec2> = ellipse(90, 0)
            .into_iter()
            .map(|corner| corner + DVec2::new(0.02 * corner.y * corner.y, 0.1 * corner.x))
            .collect();
        let mirror: Vec<DVec2> = outline.iter().map(|corner| DVec2::new(-corner.x, corner.y)).collect();
        let (first, second) = (landmarks(&outline).unwrap(), landmarks(&mirror).unwrap());
        for (index, place) in first.iter().enumerate() {
            let other = second[mirrored(index)];
            assert!(place.distance(DVec2::new(-other.x, other.y)) < 1e-6);
        }
    }

    #[test]
    fn normals_point_outwards() {
        let points = landmarks(&ellipse(90, 0)).expect("an ellipse");
        for (point, normal) in points.iter().zip(normals(&points)) {
            assert!((*point - DVec2::new(3.0, -2.0)).dot(normal) > 0.0);
        }
    }
}
