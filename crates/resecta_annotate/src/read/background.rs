//! What lies outside a scanner's sector.

use resecta_anatomy::Approximation;

use crate::stack::note;

/// Far more than the rounding of a crossing, far less than a pixel.
const ROUNDING: f64 = 1e-6;

/// Which pixels of images of `width` columns are shown: those within the convex hull of all pixels that are not black (0) in
/// every image. A sector is convex but for the arc of its probe, and what is black within it, such as fluid or a shadow, was
/// seen to be so. Empty where that leaves all pixels, or none.
pub(super) fn shown<'a>(width: usize, images: impl Iterator<Item = &'a [f32]>) -> Vec<bool> {
    let mut lit: Vec<bool> = Vec::new();
    for image in images {
        lit.resize(image.len(), false);
        for (lit, &grey) in lit.iter_mut().zip(image) {
            *lit |= grey > 0.0;
        }
    }
    // The hull of all is that of the ends of each row.
    let ends = lit.chunks_exact(width).enumerate().filter_map(|(y, row)| {
        let first = row.iter().position(|&lit| lit)?;
        let last = row.iter().rposition(|&lit| lit)?;
        Some([[first as i64, y as i64], [last as i64, y as i64]])
    });
    let ends: Vec<[[i64; 2]; 2]> = ends.collect();
    let left = bulge(ends.iter().map(|[left, _]| *left), 1);
    let right = bulge(ends.iter().map(|[_, right]| *right), -1);
    let mut shown = vec![false; lit.len()];
    for (y, row) in shown.chunks_exact_mut(width).enumerate() {
        if let (Some(first), Some(last)) = (at_row(&left, y), at_row(&right, y)) {
            // A crossing at a pixel's centre counts, however it was rounded.
            row[(first - ROUNDING).ceil() as usize..=(last + ROUNDING).floor() as usize].fill(true);
        }
    }
    if shown.contains(&false) && shown.contains(&true) {
        shown
    } else {
        Vec::new()
    }
}

/// One side of a hull, from points by rising y: those that a straight line between others does not leave behind. `side` is 1
/// for the left one and -1 for the right one.
fn bulge(points: impl Iterator<Item = [i64; 2]>, side: i64) -> Vec<[i64; 2]> {
    let mut hull: Vec<[i64; 2]> = Vec::new();
    for c in points {
        while let [.., a, b] = hull[..] {
            let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if side * turn < 0 {
                break;
            }
            hull.pop();
        }
        hull.push(c);
    }
    hull
}

/// Where a side of the hull crosses a row.
fn at_row(side: &[[i64; 2]], row: usize) -> Option<f64> {
    let row = row as i64;
    let next = side.iter().position(|point| point[1] >= row)?;
    let [x, y] = side[next];
    if y == row {
        return Some(x as f64);
    }
    let [before_x, before_y] = side[next.checked_sub(1)?];
    Some(before_x as f64 + ((x - before_x) * (row - before_y)) as f64 / (y - before_y) as f64)
}

/// Tells of the pixels that are not shown.
pub(super) fn noted(shown: &[bool]) -> Approximation {
    let hidden = shown.iter().filter(|&&shown| !shown).count();
    note(
        "sector",
        format!(
            "{:.0} % of the pixels lie outside the convex hull of all that is not black: taken to lie outside the sector",
            100.0 * hidden as f64 / shown.len() as f64
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(rows: &[&str]) -> Vec<f32> {
        rows.iter()
            .flat_map(|row| row.bytes().map(|byte| if byte == b'.' { 0.0 } else { 0.5 }))
            .collect()
    }

    #[track_caller]
    fn assert_shown(images: &[&[&str]], expected: &[&str]) {
        let images: Vec<Vec<f32>> = images.iter().map(|rows| image(rows)).collect();
        let shown = shown(expected[0].len(), images.iter().map(Vec::as_slice));
        let expected: Vec<bool> = image(expected).iter().map(|&grey| grey > 0.0).collect();
        assert_eq!(shown, expected);
    }

    #[test]
    fn what_is_black_within_the_sector_is_shown() {
        let sector = [
            "....#....",
            "..##.##..",
            ".#.....#.",
            "#.......#",
            ".##...##.",
            "...#.#...",
        ];
        let filled = [
            "....#....",
            "..#####..",
            ".#######.",
            "#########",
            ".#######.",
            "...###...",
        ];
        assert_shown(&[&sector], &filled);
    }

    #[test]
    fn all_images_count_together() {
        let one = ["#....", ".....", ".....", "....."];
        let other = [".....", ".....", "....#", "....."];
        // The line between them, as far as it meets pixels.
        assert_shown(&[&one, &other], &["#....", "..#..", "....#", "....."]);
    }

    #[test]
    fn the_hull_holds_all_that_is_lit_and_never_shrinks() {
        let mut random = resecta_anatomy::random::SplitMix64::new(1);
        for share in [0.01, 0.03, 0.2] {
            for _ in 0..200 {
                let lit: Vec<f32> = (0..13 * 9).map(|_| f32::from(random.unit() < share)).collect();
                let shown = shown(13, [&lit[..]].into_iter());
                assert!(shown.is_empty() || lit.iter().zip(&shown).all(|(&grey, &shown)| shown || grey == 0.0));
                // Lighting the whole hull has the same hull.
                let filled: Vec<f32> = shown.iter().map(|&shown| f32::from(shown)).collect();
                assert_eq!(super::shown(13, [&filled[..]].into_iter()), shown);
            }
        }
    }

    #[test]
    fn images_all_black_or_lit_to_their_corners_are_left_to_other_rules() {
        assert!(shown(2, [&[0.0; 4][..]].into_iter()).is_empty());
        assert!(shown(2, [&[0.1; 4][..]].into_iter()).is_empty());
        let corners = image(&["#...#", ".....", "#...#"]);
        assert!(shown(5, [&corners[..]].into_iter()).is_empty());
        assert!(shown(2, std::iter::empty()).is_empty());
    }
}
