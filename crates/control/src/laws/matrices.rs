//! A discrete linear law by its matrices: for example a state feedback with observer, designed elsewhere.
//!
//! ```text
//!  x[k+1] = A x[k] + Br r[k] + By y[k]
//!  u[k]   = C x[k] + Dr r[k] + Dy y[k]
//! ```
//!
//! r and y are metres relative to the rest position at which the loop closes, u is amperes. With u = -K x, an observer of
//! gain L and a plant (P, Q, R) the matrices are A = P - Q K - L R, By = L, C = -K.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ControlLawSettings;
use crate::law::{ControlDesign, ControlLaw, LawInput, LinearLaw};
use crate::state_space::StateSpace;

/// A discrete linear law. Its matrices hold for one servo rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StateSpaceLaw {
    /// Servo rate in hertz for which the matrices were designed.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub rate_hz: f64,
    /// A, row by row.
    #[schemars(length(min = 1, max = 32))]
    pub a: Vec<Vec<f64>>,
    /// Br in 1/m, one number per state.
    pub b_reference: Vec<f64>,
    /// By in 1/m, one number per state.
    pub b_position: Vec<f64>,
    /// C in amperes, one number per state.
    pub c: Vec<f64>,
    /// Dr in amperes per metre.
    #[serde(default)]
    pub d_reference: f64,
    /// Dy in amperes per metre.
    #[serde(default)]
    pub d_position: f64,
}

impl ControlLawSettings for StateSpaceLaw {
    fn check(&self, rate_hz: f64) -> Result<(), String> {
        if let Some((name, given)) = self.wrong_size() {
            let states = self.a.len();
            return Err(format!(
                "has {given} numbers in `{name}`; `a` has {states} rows, so {states} are needed"
            ));
        }
        if self.rate_hz != rate_hz {
            return Err(format!(
                "is designed for {} Hz, the loop runs at {rate_hz} Hz (loop.rate_hz)",
                self.rate_hz
            ));
        }
        Ok(())
    }
}

impl StateSpaceLaw {
    /// Name and length of a row of A, or of a vector, whose length is not the number of states.
    fn wrong_size(&self) -> Option<(&'static str, usize)> {
        let vectors = [
            ("b_reference", self.b_reference.len()),
            ("b_position", self.b_position.len()),
            ("c", self.c.len()),
        ];
        let rows = self.a.iter().map(|row| ("a", row.len()));
        let mut lengths = rows.chain(vectors);
        lengths.find(|(_, length)| *length != self.a.len())
    }
}

impl ControlDesign for StateSpaceLaw {
    fn law(&self, _period_s: f64) -> Box<dyn ControlLaw> {
        let states = self.a.len();
        let column = |list: &[f64]| DVector::from_column_slice(list);
        Box::new(RunningLaw {
            a: DMatrix::from_row_iterator(states, states, self.a.iter().flatten().copied()),
            b: [column(&self.b_reference), column(&self.b_position)],
            c: column(&self.c),
            d: [self.d_reference, self.d_position],
            state: DVector::zeros(states),
            next: DVector::zeros(states),
            rest_m: 0.0,
        })
    }
}

/// The matrices with their state.
struct RunningLaw {
    a: DMatrix<f64>,
    b: [DVector<f64>; 2],
    c: DVector<f64>,
    d: [f64; 2],
    state: DVector<f64>,
    next: DVector<f64>,
    rest_m: f64,
}

impl ControlLaw for RunningLaw {
    fn reset(&mut self, rest_m: f64) {
        self.state.fill(0.0);
        self.rest_m = rest_m;
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        let reference_m = input.reference_m - self.rest_m;
        let position_m = input.position_m - self.rest_m;
        let request_a = self.c.dot(&self.state) + self.d[0] * reference_m + self.d[1] * position_m;
        self.next.gemv(1.0, &self.a, &self.state, 0.0);
        self.next.axpy(reference_m, &self.b[0], 1.0);
        self.next.axpy(position_m, &self.b[1], 1.0);
        std::mem::swap(&mut self.state, &mut self.next);
        request_a
    }

    fn linear(&self) -> Option<Box<dyn LinearLaw>> {
        Some(Box::new(StateSpace {
            a: self.a.clone(),
            b: DMatrix::from_column_slice(self.a.nrows(), 1, (-&self.b[1]).as_slice()),
            c: DMatrix::from_row_slice(1, self.a.nrows(), self.c.as_slice()),
            d: -self.d[1],
        }))
    }
}

impl LinearLaw for StateSpace {
    fn state_space(&self) -> Option<StateSpace> {
        Some(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Biquad, BiquadState};

    /// y[k] = 0.25 e[k] + s, s+ = 0.5 (0.25 e + s) with e = r - y: the biquad 0.25/(1 - 0.5 z^-1).
    fn law() -> StateSpaceLaw {
        StateSpaceLaw {
            rate_hz: 1000.0,
            a: vec![vec![0.5]],
            b_reference: vec![0.125],
            b_position: vec![-0.125],
            c: vec![1.0],
            d_reference: 0.25,
            d_position: -0.25,
        }
    }

    #[test]
    fn law_follows_the_difference_equation_of_its_matrices() {
        let biquad = Biquad::new([0.25, 0.0, 0.0], [1.0, -0.5, 0.0]);
        let mut state = BiquadState::default();
        let mut running = law().law(1e-3);
        running.reset(3.0);
        for tick in 0..100 {
            let (r, y) = (f64::from(tick % 7), f64::from(tick % 5));
            let input = LawInput {
                reference_m: 3.0 + r,
                position_m: 3.0 + y,
                applied_a: 0.0,
            };
            let expected = biquad.update(&mut state, r - y);
            assert!((running.update(&input) - expected).abs() < 1e-12, "{tick}");
        }
        let linear = running.linear().expect("linear");
        let z = nalgebra::Complex::new(0.6, 0.8);
        assert!((linear.response(z) - biquad.response(z)).norm() < 1e-12);
    }

    #[test]
    fn rejects_matrices_of_wrong_size_and_another_servo_rate() {
        assert_eq!(law().check(1000.0), Ok(()));
        assert!(law().check(5000.0).unwrap_err().contains("5000 Hz"));
        let mut ragged = law();
        ragged.c.push(1.0);
        assert!(ragged.check(1000.0).unwrap_err().contains("`c`"));
    }
}
