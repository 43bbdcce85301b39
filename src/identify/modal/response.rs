//! What a fit says that the data need not: its response at any frequency, and its poles.

use nalgebra::Complex;

use super::refine::Entry;
use super::{MeasurementChain, ModalFit};
use crate::identify::FrfDatum;
use crate::model::zeros::ModalTerm;

/// A pole with its errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertainPole {
    /// Where it is, in rad/s; of a conjugate pair the one above the real axis.
    pub s: Complex<f64>,
    /// Covariance of its real and imaginary part in (rad/s)^2.
    pub covariance: [[f64; 2]; 2],
}

impl ModalFit {
    /// The response of the fit through `view`, its delay included, at frequencies in hertz; in the unit of what was fitted
    /// (m/A through a bench, m/N bare).
    pub fn response(&self, view: &MeasurementChain<'_>, frequency_hz: &[f64]) -> Vec<Complex<f64>> {
        let at = |f: &f64| FrfDatum {
            frequency_hz: *f,
            spread_hz: 0.0,
            response: Complex::new(0.0, 0.0),
            variance: 1.0,
        };
        let points: Vec<FrfDatum> = frequency_hz.iter().map(at).collect();
        let nodes = view.nodes(self.parameters.delay_s, &points);
        let mut sum = view.constant(&nodes);
        sum.iter_mut()
            .for_each(|h| *h *= self.parameters.remainder_m_per_n);
        for term in &self.parameters.modes {
            let part = view.mode((term.omega_rad_s, term.damping_ratio), &nodes);
            sum.iter_mut()
                .zip(part)
                .for_each(|(h, part)| *h += part * term.residue_per_kg);
        }
        sum
    }

    /// The poles, slowest mode first: of a mode below critical damping one, above it both, which are real.
    ///
    /// ```text
    /// s = -zeta w + j w sqrt(1 - zeta^2)             covariance J cov(w, zeta) J^T, J the slopes of (Re s, Im s)
    /// ```
    pub fn poles(&self) -> Vec<UncertainPole> {
        let entries = self.parameters.entries();
        let place = |wanted: Entry| entries.iter().position(|entry| *entry == wanted);
        let of = |(k, term): (usize, &ModalTerm)| {
            let places = place(Entry::Omega(k)).zip(place(Entry::Damping(k)));
            let sides = slopes(term);
            sides
                .into_iter()
                .map(|(s, slopes)| UncertainPole {
                    s,
                    covariance: self.spread(places, slopes),
                })
                .collect()
        };
        self.parameters
            .modes
            .iter()
            .enumerate()
            .flat_map(|mode| -> Vec<UncertainPole> { of(mode) })
            .collect()
    }

    /// J cov J^T of a pair of parameters; zero of parameters that are not free.
    fn spread(&self, places: Option<(usize, usize)>, slopes: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
        let Some((omega, damping)) = places else {
            return [[0.0; 2]; 2];
        };
        let at = [omega, damping];
        let product = |a: usize, b: usize| -> f64 {
            let term =
                |i: usize, j: usize| slopes[a][i] * self.covariance[(at[i], at[j])] * slopes[b][j];
            term(0, 0) + term(0, 1) + term(1, 0) + term(1, 1)
        };
        [0, 1].map(|a| [0, 1].map(|b| product(a, b)))
    }
}

/// Each pole of a mode with d(Re s, Im s)/d(w, zeta).
fn slopes(term: &ModalTerm) -> Vec<(Complex<f64>, [[f64; 2]; 2])> {
    let (w, zeta) = (term.omega_rad_s, term.damping_ratio);
    if zeta < 1.0 {
        let root = (1.0 - zeta * zeta).sqrt();
        return vec![(
            Complex::new(-zeta * w, w * root),
            [[-zeta, -w], [root, -w * zeta / root]],
        )];
    }
    let root = (zeta * zeta - 1.0).sqrt();
    let side = |sign: f64| {
        let re_per_w = -zeta + sign * root;
        (
            Complex::new(w * re_per_w, 0.0),
            [[re_per_w, w * (-1.0 + sign * zeta / root)], [0.0, 0.0]],
        )
    };
    vec![side(1.0), side(-1.0)]
}
