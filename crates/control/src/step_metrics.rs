//! Figures of a step: settling time, overshoot, steady state.

use serde::Serialize;

/// Ratio of the height of a step: the step has settled when the position stays within this distance of the reference.
pub const SETTLING_BAND: f64 = 0.02;

/// Figures of a step response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepMetrics {
    /// Seconds from the step until the position stays within 2 % of the step around the reference; absent if it never does.
    pub settling_time_s: Option<f64>,
    /// Largest excursion beyond the reference, in per cent of the step.
    pub overshoot_percent: f64,
}

/// Follows a step of `height_m` position by position, however long it takes.
#[derive(Clone, Copy, Debug)]
pub struct StepMeter {
    height_m: f64,
    /// Number of positions so far.
    seen: u64,
    /// Number of positions up to and including the last one outside the band.
    settled: u64,
    beyond_m: f64,
}

impl StepMeter {
    /// Before the first position.
    pub fn new(height_m: f64) -> Self {
        StepMeter {
            height_m,
            seen: 0,
            settled: 0,
            beyond_m: 0.0,
        }
    }

    /// The next position, relative to where the step started.
    pub fn push(&mut self, position_m: f64) {
        let error_m = position_m - self.height_m;
        self.seen += 1;
        if error_m.abs() > SETTLING_BAND * self.height_m.abs() {
            self.settled = self.seen;
        }
        self.beyond_m = self.beyond_m.max(error_m * self.height_m.signum());
    }

    /// Figures of the positions so far.
    pub fn figures(&self, period_s: f64) -> StepMetrics {
        StepMetrics {
            settling_time_s: (self.settled < self.seen).then_some(self.settled as f64 * period_s),
            overshoot_percent: 100.0 * self.beyond_m / self.height_m.abs(),
        }
    }
}

/// Figures of a step of `height_m` at the first of `positions_m`, which are relative to where it started.
pub fn step_metrics(positions_m: &[f64], height_m: f64, period_s: f64) -> StepMetrics {
    let mut meter = StepMeter::new(height_m);
    positions_m.iter().for_each(|y| meter.push(*y));
    meter.figures(period_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_order_step_has_the_figures_of_its_closed_form() {
        let (w, zeta, period_s) = (50.0, 0.5f64, 1e-4);
        let damped = w * (1.0 - zeta * zeta).sqrt();
        let y = |t: f64| {
            1.0 - (-zeta * w * t).exp()
                * ((damped * t).cos() + zeta * w / damped * (damped * t).sin())
        };
        for height in [50e-6, -50e-6] {
            let positions: Vec<f64> = (0..10_000)
                .map(|k| height * y(f64::from(k) * period_s))
                .collect();
            let figures = step_metrics(&positions, height, period_s);
            let overshoot =
                100.0 * (-std::f64::consts::PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
            assert!(
                (figures.overshoot_percent - overshoot).abs() < 0.01,
                "{figures:?}"
            );
            // The last time |1 - y| passes 2 %, found on the closed form itself.
            let settled = (0..1_000_000)
                .map(|k| f64::from(k) * 1e-6)
                .rfind(|t| (1.0 - y(*t)).abs() > 0.02)
                .unwrap();
            assert!(
                (figures.settling_time_s.unwrap() - settled).abs() < 2.0 * period_s,
                "{figures:?} {settled}"
            );
        }
    }

    #[test]
    fn a_response_that_never_settles_has_no_settling_time() {
        assert_eq!(
            step_metrics(&[0.0, 1.0, 0.0], 1.0, 1.0).settling_time_s,
            None
        );
    }
}
