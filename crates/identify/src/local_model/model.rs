//! A smooth model of the response around a frequency: the response in the middle and its sensitivity to noise.
//!
//! With x the distance from the middle over the half-width h, Y_k = H(x_k) U_k + N_k with
//!
//! ```text
//! constant      H = b0
//! polynomial    H = b0 + b1 x + b2 x^2
//! rational      H = (b0 + b1 x + b2 x^2)/(1 + a x)        or with more poles
//! ```
//!
//! by least squares over |x| < 1 with the weights cos^2(pi x/2): the local polynomial method (LPM) and the local rational
//! method (LRM; T. McKelvey, G. Guerin, IFAC SYSID 2012; E. Geerardyn, T. Oomen, J. Schoukens, IFAC World Congress 2014; R.
//! Pintelon, J. Schoukens, System Identification, 2nd ed., chapter 7). Near a lightly damped mode 1/(1 + a x) is its pole,
//! and the remaining response is smooth. With a transient, T = t0 + t1 x + t2 x^2 (over the same denominator) is added to H U:
//! the effect of the states at the beginning and at the end of the record.
//!
//! The rational model ([`super::rational`]) has more variance than the polynomial, and is used only where its residual is significantly
//! smaller.

use nalgebra::Complex;

use super::least_squares;
use super::rational::{self, Order, combination};
use super::window::{FittedModel, Window};
use crate::{EstimatorSettings, LocalModel};

/// F statistic above which a rational model is used: Fisher's F of 2 and some 20 degrees of freedom exceeds it with a probability of 0.1
/// %, and that of a further pole, of 6 and some 10, with 0.1 %.
const SIGNIFICANT_F: f64 = 10.0;

/// The model of a window with at most this number of poles; `None` where there is no input.
pub(super) fn fit(
    window: &Window,
    settings: &EstimatorSettings,
    max_poles: usize,
) -> Option<FittedModel> {
    let transient = settings.transient;
    let degree = window.degree(settings.curve, transient);
    let mut best = polynomial(window, degree, transient)?;
    if settings.curve != LocalModel::Rational || degree < 2 {
        return Some(best);
    }
    for poles in 1..=max_poles {
        let order = Order { poles, transient };
        let rational = rational::fit(window, order, &best.fit);
        if let Some(better) = rational.filter(|it| it.fit.f_statistic(&best.fit) > SIGNIFICANT_F) {
            best = better;
        }
    }
    Some(best)
}

fn polynomial(window: &Window, degree: usize, transient: bool) -> Option<FittedModel> {
    let columns = if transient {
        window.numerators(degree, true, &vec![Complex::from(1.0); window.len()])
    } else {
        window.powers(degree, |j| window.input[j])
    };
    let right = window
        .output
        .iter()
        .zip(&window.root_weight)
        .map(|(y, root)| y * root)
        .collect();
    let of_transient = columns.get(degree + 1..).unwrap_or_default().to_vec();
    let linear = least_squares::solve(columns, right)?;
    let transient = combination(
        &of_transient,
        linear.solution.get(degree + 1..).unwrap_or_default(),
    );
    Some(FittedModel {
        fit: window.local_fit(&linear),
        linear,
        transient,
    })
}
