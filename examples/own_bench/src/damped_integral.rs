//! An integrator, and damping by the velocity: `u[k] = Ki T sum(e) - Kv (y[k] - y[k-1])/T`.

use bench_control::{
    ControlDesign, ControlLaw, ControlLawSettings, LawInput, LinearLaw, StateSpace,
};
use schemars::JsonSchema;
use serde::Deserialize;

#[derive(Clone, Deserialize, JsonSchema)]
pub struct DampedIntegral {
    /// Ki in amperes per metre and second.
    #[schemars(range(min = 0.0, max = 1e9))]
    integral_a_per_m_s: f64,
    /// Kv in ampere seconds per metre.
    #[schemars(range(min = 0.0, max = 1e6))]
    velocity_a_s_per_m: f64,
}

impl ControlLawSettings for DampedIntegral {}

impl ControlDesign for DampedIntegral {
    fn law(&self, period_s: f64) -> Box<dyn ControlLaw> {
        let integral_a_per_m = self.integral_a_per_m_s * period_s;
        let velocity_a_per_m = self.velocity_a_s_per_m / period_s;
        Box::new(Running {
            integral_a_per_m,
            velocity_a_per_m,
            sum_m: 0.0,
            last_m: 0.0,
        })
    }
}

struct Running {
    integral_a_per_m: f64,
    velocity_a_per_m: f64,
    sum_m: f64,
    last_m: f64,
}

impl ControlLaw for Running {
    fn reset(&mut self, rest_m: f64) {
        (self.sum_m, self.last_m) = (0.0, rest_m);
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        let step_m = input.position_m - self.last_m;
        self.last_m = input.position_m;
        self.sum_m += input.reference_m - input.position_m;
        self.integral_a_per_m * self.sum_m - self.velocity_a_per_m * step_m
    }

    /// The states are the sum and -y of the tick before; the input is -y. Stability and margins follow from it.
    fn linear(&self) -> Option<Box<dyn LinearLaw>> {
        let (ki, kv) = (self.integral_a_per_m, self.velocity_a_per_m);
        let a = [[1.0, 0.0], [0.0, 0.0]];
        let law = StateSpace::from_rows(a, [1.0, 1.0], [ki, -kv], ki + kv);
        Some(Box::new(law))
    }
}
