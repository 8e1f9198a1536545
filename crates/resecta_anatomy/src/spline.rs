//! Cubic splines over uneven knots: how everything known on slices is carried along the gland's axis.
//!
//! The end condition is "not a knot" (the first two and the last two pieces are one cubic each), so every cubic is
//! reproduced exactly; with three knots that is their parabola, with two their chord.

/// A cubic spline through the points `(knots[i], values[i])`.
#[derive(Debug, Clone)]
pub(crate) struct CubicSpline<'a> {
    knots: &'a [f64],
    values: Vec<f64>,
    /// Second derivative at every knot.
    curvatures: Vec<f64>,
}

impl<'a> CubicSpline<'a> {
    /// `knots` rise strictly, are at least two and as many as `values`: the caller has checked its slices.
    pub(crate) fn new(knots: &'a [f64], values: Vec<f64>) -> Self {
        debug_assert!(knots.len() >= 2 && knots.len() == values.len());
        let curvatures = curvatures(knots, &values);
        Self {
            knots,
            values,
            curvatures,
        }
    }

    /// Value at `x`, between the first and the last knot, where the spline may leave a piece's chord by no more than half the greatest step between
    /// neighbouring values on this piece and the two beside it.
    ///
    /// A smooth series never comes near that bound. A spline through slices that jump, or that stand much closer
    /// together in one place than in the next, would swing far beyond the contours on both sides; this one does not.
    pub(crate) fn bounded_at(&self, x: f64) -> f64 {
        let piece = self.piece(x);
        let first = piece.saturating_sub(1);
        let last = (piece + 2).min(self.values.len() - 1);
        let greatest_step = (self.values[first..=last].windows(2))
            .map(|pair| (pair[1] - pair[0]).abs())
            .fold(0.0, f64::max);
        let bound = 0.5 * greatest_step;
        self.chord(piece, x) + self.bow(piece, x).clamp(-bound, bound)
    }

    /// As [`Self::bounded_at`], and no less than half the smaller value at the two ends of the piece: the spline of a
    /// positive series stays positive.
    pub(crate) fn positive_at(&self, x: f64) -> f64 {
        let piece = self.piece(x);
        let floor = 0.5 * self.values[piece].min(self.values[piece + 1]);
        self.bounded_at(x).max(floor)
    }

    /// Integral over all knots, exact for the spline.
    pub(crate) fn integral(&self) -> f64 {
        (0..self.knots.len() - 1)
            .map(|i| {
                let step = self.knots[i + 1] - self.knots[i];
                step * (self.values[i] + self.values[i + 1]) / 2.0
                    - step.powi(3) * (self.curvatures[i] + self.curvatures[i + 1]) / 24.0
            })
            .sum()
    }

    fn piece(&self, x: f64) -> usize {
        let above = self.knots.partition_point(|&knot| knot <= x);
        above.clamp(1, self.knots.len() - 1) - 1
    }

    fn chord(&self, piece: usize, x: f64) -> f64 {
        let (x0, x1) = (self.knots[piece], self.knots[piece + 1]);
        let (y0, y1) = (self.values[piece], self.values[piece + 1]);
        (y0 * (x1 - x) + y1 * (x - x0)) / (x1 - x0)
    }

    /// How far the cubic lies above its chord.
    fn bow(&self, piece: usize, x: f64) -> f64 {
        let (x0, x1) = (self.knots[piece], self.knots[piece + 1]);
        let step = x1 - x0;
        let (a, b) = ((x1 - x) / step, (x - x0) / step);
        let weight = |t: f64| t * (t * t - 1.0);
        (weight(a) * self.curvatures[piece] + weight(b) * self.curvatures[piece + 1]) * step * step / 6.0
    }
}

/// Second derivatives at the knots: continuity of the slope at every inner knot, the two end conditions put in, solved
/// by elimination along the diagonal (the system is dominated by it).
fn curvatures(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let count = knots.len();
    let step: Vec<f64> = knots.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> = (0..count - 1).map(|i| (values[i + 1] - values[i]) / step[i]).collect();
    if count == 2 {
        return vec![0.0; 2];
    }
    if count == 3 {
        return vec![2.0 * (slope[1] - slope[0]) / (step[0] + step[1]); 3];
    }
    // Unknowns are the inner curvatures; those at the ends follow from "the third derivative does not jump at the
    // second and at the last but one knot".
    let inner = count - 2;
    let first = step[0] / step[1];
    let last = step[count - 2] / step[count - 3];
    let mut diagonal: Vec<f64> = (0..inner).map(|i| 2.0 * (step[i] + step[i + 1])).collect();
    let mut above: Vec<f64> = (0..inner).map(|i| step[i + 1]).collect();
    let mut below: Vec<f64> = (0..inner).map(|i| step[i]).collect();
    let mut right: Vec<f64> = (0..inner).map(|i| 6.0 * (slope[i + 1] - slope[i])).collect();
    diagonal[0] += step[0] * (1.0 + first);
    above[0] -= step[0] * first;
    diagonal[inner - 1] += step[count - 2] * (1.0 + last);
    below[inner - 1] -= step[count - 2] * last;
    for row in 1..inner {
        let factor = below[row] / diagonal[row - 1];
        diagonal[row] -= factor * above[row - 1];
        right[row] -= factor * right[row - 1];
    }
    let mut result = vec![0.0; count];
    for row in (0..inner).rev() {
        let next = if row + 1 < inner {
            above[row] * result[row + 2]
        } else {
            0.0
        };
        result[row + 1] = (right[row] - next) / diagonal[row];
    }
    result[0] = result[1] * (1.0 + first) - result[2] * first;
    result[count - 1] = result[count - 2] * (1.0 + last) - result[count - 3] * last;
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    impl CubicSpline<'_> {
        /// The plain cubic, without the bound.
        fn at(&self, x: f64) -> f64 {
            let piece = self.piece(x);
            self.chord(piece, x) + self.bow(piece, x)
        }
    }

    const KNOTS: [f64; 6] = [-2.0, -1.5, 0.1, 0.4, 3.0, 7.0];

    #[test]
    fn cubics_are_reproduced_over_uneven_knots() {
        let cubic = |x: f64| 0.3 * x.powi(3) - 2.0 * x * x + x - 4.0;
        for count in 4..=KNOTS.len() {
            let knots = &KNOTS[..count];
            let spline = CubicSpline::new(knots, knots.iter().copied().map(cubic).collect());
            for step in 0..=100 {
                let x = knots[0] + (knots[count - 1] - knots[0]) * f64::from(step) / 100.0;
                assert!((spline.at(x) - cubic(x)).abs() < 1e-10, "{count} knots, at {x}");
            }
        }
    }

    #[test]
    fn the_integral_of_a_cubic_is_exact() {
        let spline = CubicSpline::new(&KNOTS, KNOTS.iter().map(|x| x.powi(3)).collect());
        let exact = (7.0f64.powi(4) - 2.0f64.powi(4)) / 4.0;
        assert!((spline.integral() - exact).abs() < 1e-10);
    }

    #[test]
    fn three_knots_give_their_parabola_and_two_their_chord() {
        let parabola = CubicSpline::new(&KNOTS[..3], KNOTS[..3].iter().map(|x| x * x).collect());
        assert!((parabola.at(-1.0) - 1.0).abs() < 1e-12);
        let chord = CubicSpline::new(&KNOTS[..2], vec![1.0, 2.0]);
        assert!((chord.at(-1.75) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn the_spline_passes_through_its_points_and_bends_smoothly() {
        let spline = CubicSpline::new(&KNOTS, vec![1.0, 5.0, 2.0, 2.0, 9.0, 1.0]);
        for (&knot, &value) in KNOTS.iter().zip(&spline.values) {
            assert!((spline.at(knot) - value).abs() < 1e-12);
        }
        let curvature = |x: f64, h: f64| (spline.at(x + h) - 2.0 * spline.at(x) + spline.at(x - h)) / (h * h);
        for &knot in &KNOTS[1..5] {
            let jump = curvature(knot + 2e-4, 1e-4) - curvature(knot - 2e-4, 1e-4);
            assert!(jump.abs() < 0.1, "at {knot}: {jump}");
        }
    }

    #[test]
    fn a_positive_series_stays_positive_where_the_plain_cubic_does_not() {
        let knots = [0.0, 0.1, 5.0, 10.0, 15.0];
        let spline = CubicSpline::new(&knots, vec![4.0, 1.0, 1.0, 300.0, 1.0]);
        let samples = || (0..=1500).map(|step| f64::from(step) / 100.0);
        assert!(samples().any(|x| spline.at(x) < 0.0));
        assert!(samples().all(|x| spline.positive_at(x) >= 0.5));
    }

    #[test]
    fn the_bound_does_not_touch_a_smooth_series() {
        let knots: Vec<f64> = (0..9).map(f64::from).collect();
        let spline = CubicSpline::new(&knots, knots.iter().map(|x| 20.0 - (x - 4.1).powi(2)).collect());
        for step in 0..=800 {
            let x = f64::from(step) / 100.0;
            assert_eq!(spline.at(x), spline.bounded_at(x));
        }
    }
}
