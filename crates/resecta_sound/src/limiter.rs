//! Keeps the sum of all sounds in range, without a corner that would be heard.

/// Up to here nothing changes.
const KNEE: f64 = 0.8;

/// `x` to the knee k, from there `k + (1 - k) t / (1 + t)` with `t = (x - k) / (1 - k)`: smooth at the knee, growing, below 1.
pub fn limit(sample: f64) -> f64 {
    let over = (sample.abs() - KNEE) / (1.0 - KNEE);
    if over <= 0.0 {
        sample
    } else {
        (KNEE + (1.0 - KNEE) * over / (1.0 + over)).copysign(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_quiet_stays_and_what_is_loud_stays_in_range_and_in_order() {
        let mut last = 0.0;
        for step in 1..5000 {
            let sample = f64::from(step) / 1000.0;
            let limited = limit(sample);
            assert_eq!(limit(-sample), -limited);
            assert!(limited < 1.0 && limited > last, "{sample}: {limited} after {last}");
            assert!(limited - last <= 0.001 + 1e-12, "no corner at {sample}");
            if sample <= KNEE {
                assert_eq!(limited, sample);
            }
            last = limited;
        }
    }
}
