//! Figures of a step: settling time, overshoot, steady state.

use serde::Serialize;

/// What a step response shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepFigures {
    /// Seconds from the step until the position has entered the band of 2 % of the step around the reference for good; absent where it never does.
    pub settling_time_s: Option<f64>,
    /// Largest excursion beyond the reference, in per cent of the step.
    pub overshoot_percent: f64,
}

/// Figures of a step of `height_m` at the first of `positions_m`, which are relative to where it started.
pub fn step_figures(positions_m: &[f64], height_m: f64, period_s: f64) -> StepFigures {
    let band_m = 0.02 * height_m.abs();
    let outside = positions_m.iter().rposition(|y| (y - height_m).abs() > band_m);
    let settled = outside.map_or(0, |last| last + 1);
    let beyond = positions_m.iter().map(|y| (y - height_m) * height_m.signum()).fold(0.0, f64::max);
    StepFigures {
        settling_time_s: (settled < positions_m.len()).then_some(settled as f64 * period_s),
        overshoot_percent: 100.0 * beyond / height_m.abs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_order_step_has_the_figures_of_its_closed_form() {
        let (w, zeta, period_s) = (50.0, 0.5f64, 1e-4);
        let damped = w * (1.0 - zeta * zeta).sqrt();
        let y = |t: f64| 1.0 - (-zeta * w * t).exp() * ((damped * t).cos() + zeta * w / damped * (damped * t).sin());
        for height in [50e-6, -50e-6] {
            let positions: Vec<f64> = (0..10_000).map(|k| height * y(f64::from(k) * period_s)).collect();
            let figures = step_figures(&positions, height, period_s);
            let overshoot = 100.0 * (-std::f64::consts::PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
            assert!((figures.overshoot_percent - overshoot).abs() < 0.01, "{figures:?}");
            // The last time |1 - y| passes 2 %, found on the closed form itself.
            let settled = (0..1_000_000).map(|k| f64::from(k) * 1e-6).rfind(|t| (1.0 - y(*t)).abs() > 0.02).unwrap();
            assert!((figures.settling_time_s.unwrap() - settled).abs() < 2.0 * period_s, "{figures:?} {settled}");
        }
    }

    #[test]
    fn a_response_that_never_settles_has_no_settling_time() {
        assert_eq!(step_figures(&[0.0, 1.0, 0.0], 1.0, 1.0).settling_time_s, None);
    }
}
