//! H1, H2 and Hv: which of the two signals has noise.
//!
//! ```text
//! H1 = S_yu/S_uu                 noise on the output; noise N on the input as well makes it low by 1/(1 + N/S)
//! H2 = S_yy/S_uy                 noise on the input; noise N on the output as well makes it high by 1 + N/S
//! Hv = (H1/|H1|) sqrt(|H1 H2|)   noise on both, in the same ratio to the signal
//! ```
//!
//! where S is the power of the signal without noise. |H1| <= |Hv| <= |H2| by the Cauchy-Schwarz inequality; the coherence is
//! |H1|/|H2| (K. Shin, J. Hammond, Fundamentals of Signal Processing, section 9.3; Hv is total least squares with both
//! signals scaled to the same power: G. T. Rocklin, J. Crowley, H. Vold, IMAC 1985). To first order in the noise all have the
//! same relative error. The local estimator obtains H2 from local models of 1/H. The bench uses H1: its input is the
//! command, which is known exactly. Use H2 or Hv for an input measured with noise above a hundredth of the signal.

use super::{Estimator, FrfPoint};

/// H2 from the estimate G from output to input: 1/G, with the same relative error.
pub(super) fn inverse(point: FrfPoint) -> FrfPoint {
    let response = point.response.inv();
    let variance = point.variance * response.norm_sqr() * response.norm_sqr();
    FrfPoint {
        response,
        variance,
        ..point
    }
}

/// Hv from H1 and H2 at the same frequency.
pub(super) fn hv(h1: FrfPoint, h2: FrfPoint) -> FrfPoint {
    let response = h1.response * (h2.response.norm() / h1.response.norm()).sqrt();
    let variance = 0.5 * (relative_variance(&h1) + relative_variance(&h2)) * response.norm_sqr();
    FrfPoint {
        response,
        variance,
        ..h1
    }
}

fn relative_variance(point: &FrfPoint) -> f64 {
    point.variance / point.response.norm_sqr()
}

/// The estimate of a kind from H1 = S_yu/S_uu and its coherence.
pub(super) fn from_h1(h1: FrfPoint, estimator: Estimator) -> FrfPoint {
    let factor = match estimator {
        Estimator::H1 => 1.0,
        Estimator::H2 => h1.coherence,
        Estimator::Hv => h1.coherence.sqrt(),
    };
    FrfPoint {
        response: h1.response / factor,
        variance: h1.variance / (factor * factor),
        ..h1
    }
}
