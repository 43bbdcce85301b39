//! The thermal model of the motor between runs, and its prediction over a run.

use bench_config::MotorSettings;

/// First-order model of the winding: thermal' = (i^2 - thermal)/tau, with the thermal state in A^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermalModel {
    /// Largest allowed state: the square of the continuous current, in A^2.
    pub limit_a2: f64,
    /// tau in seconds.
    pub time_constant_s: f64,
}

/// The thermal state over a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatPrediction {
    /// Largest state in A^2.
    pub peak_a2: f64,
    /// The largest state at the start, in A^2, with which the run stays below the limit. Not above 0 if a run from a cold motor
    /// would exceed it.
    pub largest_start_a2: f64,
}

impl HeatPrediction {
    /// Of a run whose currents are not finite.
    const UNBOUNDED: HeatPrediction = HeatPrediction {
        peak_a2: f64::INFINITY,
        largest_start_a2: f64::NEG_INFINITY,
    };
}

impl ThermalModel {
    /// The model of a configured motor.
    pub fn of(motor: &MotorSettings) -> ThermalModel {
        let limit_a = motor.continuous_current_a();
        ThermalModel {
            limit_a2: limit_a * limit_a,
            time_constant_s: motor.thermal_time_constant_s,
        }
    }

    /// The state after a time without current: thermal exp(-t/tau).
    ///
    /// ```
    /// use bench_rig::motor::ThermalModel;
    ///
    /// let motor = ThermalModel { limit_a2: 4.0, time_constant_s: 10.0 };
    /// assert_eq!(motor.after(4.0, 0.0), 4.0);
    /// assert!((motor.after(4.0, 10.0 * 2f64.ln()) - 2.0).abs() < 1e-12);
    /// ```
    pub fn after(&self, thermal_a2: f64, duration_s: f64) -> f64 {
        thermal_a2 * libm::exp(-duration_s.max(0.0) / self.time_constant_s)
    }

    /// The time in seconds without current until the state falls from `from_a2` to `to_a2`: tau ln(from/to); infinite if
    /// `to_a2` is not above 0.
    pub fn cooling_s(&self, from_a2: f64, to_a2: f64) -> f64 {
        if from_a2 > to_a2 {
            self.time_constant_s * libm::log(from_a2 / to_a2.max(0.0))
        } else {
            0.0
        }
    }

    /// Predicts the state over a run with one of `currents_a` for each period. The model is linear: the state after k ticks is
    /// that of a cold motor plus start (1 - T/tau)^k.
    pub fn predict(
        &self,
        start_a2: f64,
        period_s: f64,
        currents_a: impl Iterator<Item = f64>,
    ) -> HeatPrediction {
        let cooling = (period_s / self.time_constant_s).min(1.0);
        let (mut cold_a2, mut remaining) = (0.0, 1.0);
        let mut prediction = HeatPrediction {
            peak_a2: start_a2,
            largest_start_a2: f64::INFINITY,
        };
        for current_a in currents_a {
            cold_a2 += cooling * (current_a * current_a - cold_a2);
            remaining *= 1.0 - cooling;
            if !f64::is_finite(cold_a2) {
                return HeatPrediction::UNBOUNDED;
            }
            prediction.add(cold_a2, remaining, start_a2, self.limit_a2);
        }
        prediction
    }
}

impl HeatPrediction {
    /// Adds a tick: the state of a cold motor, and the remaining ratio of the state at the start.
    fn add(&mut self, cold_a2: f64, remaining: f64, start_a2: f64, limit_a2: f64) {
        self.peak_a2 = self.peak_a2.max(cold_a2 + start_a2 * remaining);
        let largest_a2 = (limit_a2 - cold_a2) / remaining;
        self.largest_start_a2 = self.largest_start_a2.min(largest_a2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTOR: ThermalModel = ThermalModel {
        limit_a2: 4.0,
        time_constant_s: 10.0,
    };
    const PERIOD_S: f64 = 1e-3;

    #[test]
    fn cooling_time_inverts_the_decay() {
        // tau ln(4/1) = 13.862943611198906 s.
        assert!((MOTOR.cooling_s(4.0, 1.0) - 13.862_943_611_198_906).abs() < 1e-12);
        assert!((MOTOR.after(4.0, MOTOR.cooling_s(4.0, 1.0)) - 1.0).abs() < 1e-12);
        assert_eq!(MOTOR.cooling_s(1.0, 1.0), 0.0);
        assert_eq!(MOTOR.cooling_s(1.0, 0.0), f64::INFINITY);
        assert_eq!(MOTOR.cooling_s(1.0, -1.0), f64::INFINITY);
    }

    #[test]
    fn prediction_of_a_constant_current_matches_the_closed_form() {
        // thermal(t) = I^2 (1 - e^(-t/tau)) + start e^(-t/tau), here with I = 1.5 A and t = tau.
        let currents = std::iter::repeat_n(1.5, 10_000);
        let cold = MOTOR.predict(0.0, PERIOD_S, currents.clone());
        let expected_a2 = 2.25 * (1.0 - (-1f64).exp());
        // Euler's method errs by T/(2 tau) relative.
        assert!((cold.peak_a2 / expected_a2 - 1.0).abs() < 1e-4, "{cold:?}");
        // I^2 = 9 A^2 heats to the limit when start e^(-t/tau) = 4 - 9 (1 - e^(-t/tau)), with t = tau/4 at the end.
        let strong = MOTOR.predict(0.0, PERIOD_S, std::iter::repeat_n(3.0, 2_500));
        let kept = (-0.25f64).exp();
        let expected_a2 = (4.0 - 9.0 * (1.0 - kept)) / kept;
        assert!(
            (strong.largest_start_a2 / expected_a2 - 1.0).abs() < 1e-3,
            "{strong:?} {expected_a2}"
        );
        let at_limit = MOTOR.predict(
            strong.largest_start_a2,
            PERIOD_S,
            std::iter::repeat_n(3.0, 2_500),
        );
        assert!((at_limit.peak_a2 - 4.0).abs() < 1e-9, "{at_limit:?}");
    }

    #[test]
    fn run_without_current_may_start_at_the_limit() {
        let quiet = MOTOR.predict(4.0, PERIOD_S, std::iter::repeat_n(0.0, 100));
        assert_eq!(quiet.peak_a2, 4.0);
        assert!((4.0..4.001).contains(&quiet.largest_start_a2));
    }

    #[test]
    fn run_that_exceeds_the_limit_from_cold_may_never_start() {
        let currents = std::iter::repeat_n(3.0, 10_000);
        assert!(MOTOR.predict(0.0, PERIOD_S, currents).largest_start_a2 < 0.0);
        for current_a in [f64::NAN, f64::INFINITY] {
            let diverged = MOTOR.predict(0.0, PERIOD_S, std::iter::once(current_a));
            assert_eq!(diverged, HeatPrediction::UNBOUNDED);
        }
    }
}
