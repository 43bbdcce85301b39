//! H1, H2 and Hv: which of the two signals has noise.
//!
//! ```text
//! H1 = S_yu/S_uu                 noise on the output; with noise N on the input as well, low by 1/(1 + N/S)
//! H2 = S_yy/S_uy                 noise on the input; with noise N on the output as well, high by 1 + N/S
//! Hv = (H1/|H1|) sqrt(|H1 H2|)   noise on both, in the same ratio to the signal
//! ```
//!
//! where S is the power of the signal without noise. |H1| <= |Hv| <= |H2| by Cauchy and Schwarz, with the coherence |H1|/|H2|
//! (K. Shin, J. Hammond, Fundamentals of Signal Processing, section 9.3; Hv is total least squares with both signals scaled to
//! the same power: G. T. Rocklin, J. Crowley, H. Vold, IMAC 1985). All have, to first order in the noise, the same
//!
//! ```text
//! E|error|^2/|H|^2 = (1 - C)/(C n)        C coherence, n independent averages
//! ```
//!
//! (J. S. Bendat, A. G. Piersol, Random Data, 4th ed., table 9.6: that of |H|, and as much across). The magnitude of Hv, a
//! ratio of two powers, has C times that: its sigma is too large by 1/sqrt(C).
//!
//! H2 is the inverse of H1 from output to input, and is found so; curves are then curves of 1/H. On the bench the input is the
//! command, known exactly, and all noise is on the output: H1. An input that was measured with noise above a hundredth of the
//! signal asks for H2 or Hv.

use nalgebra::Complex;

use super::FrfPoint;

/// H2 from what was estimated from output to input: 1/G, whose relative error is that of G.
pub(super) fn inverted(point: FrfPoint) -> FrfPoint {
    let response = point.response.inv();
    FrfPoint {
        response,
        variance: point.variance * response.norm_sqr() * response.norm_sqr(),
        ..point
    }
}

/// Hv from H1 and H2 at the same frequency.
pub(super) fn between(h1: FrfPoint, h2: FrfPoint) -> FrfPoint {
    let response = h1.response * (h2.response.norm() / h1.response.norm()).sqrt();
    let relative = |point: &FrfPoint| point.variance / point.response.norm_sqr();
    let variance = 0.5 * (relative(&h1) + relative(&h2)) * response.norm_sqr();
    FrfPoint {
        response,
        variance,
        ..h1
    }
}

/// One of them by the spectra: H1 = S_yu/S_uu is given, of the same coherence.
pub(super) fn by_coherence(h1: FrfPoint, estimator: super::Estimator) -> FrfPoint {
    let factor = match estimator {
        super::Estimator::H1 => 1.0,
        super::Estimator::H2 => h1.coherence,
        super::Estimator::Hv => h1.coherence.sqrt(),
    };
    let response: Complex<f64> = h1.response / factor;
    FrfPoint {
        response,
        variance: h1.variance / (factor * factor),
        ..h1
    }
}
