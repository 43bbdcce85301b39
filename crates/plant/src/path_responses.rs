//! The response of a mode at the end of a signal path, at many frequencies.

use multiversion::multiversion;
use nalgebra::Complex;

use super::discrete::RowResponse;

/// The part of the responses at some z = exp(j w T) that does not depend on the modes: that of the amplifier and of the delays.
#[derive(Clone, Debug)]
pub struct PathResponses {
    pub(super) z: Parts,
    /// I(z) of the amplifier, see [`DiscretePlant::current_response`](super::DiscretePlant::current_response).
    currents: Parts,
    /// z I(z).
    z_currents: Parts,
    /// z^-periods of each tap.
    pub(super) arrivals: Vec<Parts>,
}

/// Complex numbers as their real and imaginary parts, which a processor computes side by side.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    re: Vec<f64>,
    im: Vec<f64>,
}

/// The part of a reading that one mode gives, with that of the current and of the set-point.
#[derive(Clone, Copy, Debug)]
pub(super) struct TapResponse {
    pub(super) mode: RowResponse,
    pub(super) current: f64,
    pub(super) setpoint: f64,
}

impl PathResponses {
    pub(super) fn new(
        z: &[Complex<f64>],
        current: impl Fn(Complex<f64>) -> Complex<f64>,
        arrivals: Vec<Parts>,
    ) -> PathResponses {
        let currents: Vec<Complex<f64>> = z.iter().map(|z| current(*z)).collect();
        let products = z.iter().zip(&currents).map(|(z, current)| z * current);
        PathResponses {
            z: Parts::of(z.iter().copied()),
            z_currents: Parts::of(products),
            currents: Parts::of(currents.iter().copied()),
            arrivals,
        }
    }

    /// The number of frequencies.
    pub(super) fn len(&self) -> usize {
        self.z.re.len()
    }
}

impl Parts {
    pub(super) fn of(values: impl Iterator<Item = Complex<f64>>) -> Parts {
        let (re, im) = values.map(|value| (value.re, value.im)).unzip();
        Parts { re, im }
    }

    /// The first `count` parts. One length for all slices tells the compiler that no index is out of bounds.
    #[inline(always)]
    fn first(&self, count: usize) -> (&[f64], &[f64]) {
        (&self.re[..count], &self.im[..count])
    }
}

/// Adds the response of a mode and its tap at each z: that of [`RowResponse::at`], of the current and of the set-point, with the delay. The
/// wider instructions of a processor compute the same sums and products of several frequencies side by side, so that all bits are the same
/// on every one.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn add_response(
    sums: &mut [Complex<f64>],
    tap: TapResponse,
    path: &PathResponses,
    arrivals: &Parts,
) {
    let count = sums.len();
    let (z_re, z_im) = path.z.first(count);
    let (current_re, current_im) = path.currents.first(count);
    let (z_current_re, z_current_im) = path.z_currents.first(count);
    let (arrival_re, arrival_im) = arrivals.first(count);
    let TapResponse {
        mode,
        current,
        setpoint,
    } = tap;
    let (of_current, of_setpoint) = (mode.of_current, mode.of_setpoint);
    for k in 0..count {
        let re = of_current.constant * current_re[k]
            + of_current.slope * z_current_re[k]
            + (of_setpoint.constant + of_setpoint.slope * z_re[k]);
        let im = of_current.constant * current_im[k]
            + of_current.slope * z_current_im[k]
            + of_setpoint.slope * z_im[k];
        let (first, second) = (z_re[k] - mode.diagonal[0], z_re[k] - mode.diagonal[1]);
        let denominator_re = first * second - z_im[k] * z_im[k] - mode.off_diagonal;
        let denominator_im = z_im[k] * (first + second);
        let inverse = 1.0 / (denominator_re * denominator_re + denominator_im * denominator_im);
        let moved_re = (re * denominator_re + im * denominator_im) * inverse
            + (current * current_re[k] + setpoint);
        let moved_im =
            (im * denominator_re - re * denominator_im) * inverse + current * current_im[k];
        sums[k] += Complex::new(
            moved_re * arrival_re[k] - moved_im * arrival_im[k],
            moved_re * arrival_im[k] + moved_im * arrival_re[k],
        );
    }
}
