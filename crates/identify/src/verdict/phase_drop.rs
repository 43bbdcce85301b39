//! A criterion without a model of modes: the phase drop beyond that of a minimum-phase system of the same magnitude.
//!
//! The phase of a plant without zeros in the right half plane follows from its magnitude (Bode 1945),
//!
//! ```text
//! phase(w0) = (1/pi) integral of d ln|G| / dx  ln coth(|x|/2) dx,    x = ln(w/w0)
//! ```
//!
//! A zero s = x + j y in the right half plane adds the lag of an all-pass filter. Between two frequencies a and b that is
//!
//! ```text
//! 2 (atan((b - y)/x) - atan((a - y)/x))
//! ```
//!
//! nearly 360 degrees for a pair of CNMP zeros between a and b, and part of 180 for a real zero. The measured phase drop is compared
//! with the sum over the zeros of the fit, for the same two frequencies.
//!
//! Hold, amplifier and delays are removed first: a delay changes the phase but not the magnitude.
//!
//! Beyond the data the magnitude is that of the fit, over a factor of 1000 in frequency, and then falls with a constant slope. (The
//! slope at the end of the data is that of the side of a resonance, if a mode lies near.)
//!
//! Only significant data are used. The phase is unwrapped along the phase of the fit: measured over fitted response turns little from
//! one frequency to the next, even across an antiresonance whose bottom is noise. It turns by 360 degrees around a pair of zeros that
//! the fit has on the wrong side.

use nalgebra::Complex;

/// The phase lag between two frequencies beyond that of a minimum-phase system of the same magnitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseDrop {
    /// The measured phase drop in degrees: the change of the minimum phase from the lower to the upper frequency, minus that of the
    /// measured phase. Positive for additional lag.
    pub drop_deg: f64,
    /// The phase drop that the right-half-plane zeros of the fit predict, in degrees.
    pub predicted_deg: f64,
    /// The lower and the upper frequency in rad/s.
    pub followed_rad_s: (f64, f64),
}

impl PhaseDrop {
    /// Deviation of the measured from the predicted phase drop in degrees.
    pub fn deviation_deg(&self) -> f64 {
        (self.drop_deg - self.predicted_deg).abs()
    }

    /// The lag between the two frequencies of a zero in the right half plane beyond that of its mirror image, in degrees.
    pub(super) fn lag_deg(&self, zero: Complex<f64>) -> f64 {
        let (from_rad_s, to_rad_s) = self.followed_rad_s;
        let roots = Roots {
            poles: Vec::new(),
            zeros: vec![zero],
        };
        roots.all_pass_lag(from_rad_s, to_rad_s).to_degrees()
    }
}

/// A measured response beside that of its fit. Frequencies rise, responses are not zero.
pub(super) struct PhaseCurve {
    pub(super) omega_rad_s: Vec<f64>,
    pub(super) measured: Vec<Complex<f64>>,
    pub(super) fitted: Vec<Complex<f64>>,
    /// Angular frequency and ln|G| of the fit below and above the data, rising.
    pub(super) below: Vec<(f64, f64)>,
    pub(super) above: Vec<(f64, f64)>,
}

/// The roots of a transfer function in rad/s: of a conjugate pair the one above the real axis.
pub(super) struct Roots {
    pub(super) poles: Vec<Complex<f64>>,
    pub(super) zeros: Vec<Complex<f64>>,
}

impl Roots {
    /// The change of phase from one frequency to another in radians.
    fn phase_change(&self, from_rad_s: f64, to_rad_s: f64) -> f64 {
        let sum = |roots: &[Complex<f64>]| -> f64 {
            let turns = roots.iter().map(|root| turn(*root, from_rad_s, to_rad_s));
            turns.sum()
        };
        sum(&self.zeros) - sum(&self.poles)
    }

    /// The lag of the zeros in the right half plane beyond that of their mirror images, in radians.
    fn all_pass_lag(&self, from_rad_s: f64, to_rad_s: f64) -> f64 {
        let right = self.zeros.iter().filter(|zero| zero.re > 0.0);
        let lags = right.map(|zero| -2.0 * turn(*zero, from_rad_s, to_rad_s));
        // The sum of no terms is the negative zero.
        lags.sum::<f64>() + 0.0
    }
}

/// The change of arg(j w - s) over a root s, and over its conjugate, in radians. A root at 0 has a constant phase.
fn turn(root: Complex<f64>, from_rad_s: f64, to_rad_s: f64) -> f64 {
    if root == Complex::new(0.0, 0.0) {
        return 0.0;
    }
    let distance = root.re.abs();
    let angle =
        |im: f64| ((to_rad_s - im) / distance).atan() - ((from_rad_s - im) / distance).atan();
    let both = if root.im == 0.0 {
        angle(0.0)
    } else {
        angle(root.im) + angle(-root.im)
    };
    if root.re > 0.0 { -both } else { both }
}

/// Length in ln w of the interval at each end of the band whose slope extrapolates the magnitude beyond the band.
const END_INTERVAL: f64 = 0.6;
/// Distance in ln w of the frequencies between which a slope is computed.
const SLOPE_INTERVAL: f64 = 0.15;

/// The phase drop of a response between two of its frequencies, given by index, beside that of the roots of its fit.
pub(super) fn phase_drop(curve: &PhaseCurve, roots: &Roots, from: usize, to: usize) -> PhaseDrop {
    let omega = &curve.omega_rad_s;
    let minimum = curve.minimum_phase(omega[to]) - curve.minimum_phase(omega[from]);
    let fitted = roots.phase_change(omega[from], omega[to]);
    let measured = fitted + curve.turn_from_fit(from, to);
    PhaseDrop {
        drop_deg: (minimum - measured).to_degrees(),
        predicted_deg: roots.all_pass_lag(omega[from], omega[to]).to_degrees(),
        followed_rad_s: (omega[from], omega[to]),
    }
}

impl PhaseCurve {
    /// The phase in radians of the minimum-phase system of this magnitude at one frequency.
    fn minimum_phase(&self, at_rad_s: f64) -> f64 {
        let measured = self.omega_rad_s.iter().zip(&self.measured);
        let measured = measured.map(|(omega, h)| (*omega, h.norm().ln()));
        let points = self.below.iter().copied();
        let points = points.chain(measured).chain(self.above.iter().copied());
        let (x, height) = points
            .map(|(omega, height)| ((omega / at_rad_s).ln(), height))
            .unzip();
        LogMagnitude { x, height }.phase()
    }

    /// The change of the phase of measured over fitted response in radians.
    fn turn_from_fit(&self, from: usize, to: usize) -> f64 {
        let ratio = |k: usize| self.measured[k] / self.fitted[k];
        (from..to).map(|k| (ratio(k + 1) / ratio(k)).arg()).sum()
    }
}

/// ln|G| over x = ln(w/w0), and the parts of Bode's integral.
struct LogMagnitude {
    x: Vec<f64>,
    height: Vec<f64>,
}

impl LogMagnitude {
    fn phase(&self) -> f64 {
        let integral = self.integral_within() + self.integral_below() + self.integral_above();
        integral / std::f64::consts::PI
    }

    fn slope(&self, i: usize, j: usize) -> f64 {
        (self.height[j] - self.height[i]) / (self.x[j] - self.x[i])
    }

    fn integral_within(&self) -> f64 {
        (1..self.x.len())
            .map(|i| self.slope(i - 1, i) * (weight(self.x[i]) - weight(self.x[i - 1])))
            .sum()
    }

    fn integral_below(&self) -> f64 {
        let first = self.x[0];
        self.end_slope(first, first + END_INTERVAL) * (weight(first) - weight(f64::NEG_INFINITY))
    }

    fn integral_above(&self) -> f64 {
        let last = self.x[self.x.len() - 1];
        self.end_slope(last - END_INTERVAL, last) * (weight(f64::INFINITY) - weight(last))
    }

    /// The median slope between x values [`SLOPE_INTERVAL`] apart, from `low` to `high`: robust against noise and against a
    /// resonance at the end of the band.
    fn end_slope(&self, low: f64, high: f64) -> f64 {
        let first = self.x.partition_point(|x| *x < low);
        let mut slopes: Vec<f64> = (first..self.x.len())
            .map_while(|i| self.slope_over_interval(i, high))
            .collect();
        slopes.sort_by(f64::total_cmp);
        slopes.get(slopes.len() / 2).copied().unwrap_or(0.0)
    }

    /// The slope from `i` to the first x at least [`SLOPE_INTERVAL`] above it, if that is not above `high`.
    fn slope_over_interval(&self, i: usize, high: f64) -> Option<f64> {
        let end = self.x[i] + SLOPE_INTERVAL;
        let j = self.x.partition_point(|x| *x < end);
        (j < self.x.len() && self.x[j] <= high).then(|| self.slope(i, j))
    }
}

/// The integral of ln coth(|t|/2) from 0 to x, which is odd in x and has the limit pi^2/4: with e = exp(-|x|),
/// pi^2/4 - 2 sum of e^(2 k + 1)/(2 k + 1)^2.
fn weight(x: f64) -> f64 {
    let t = x.abs();
    let size = if t < 0.1 {
        weight_near_zero(t)
    } else {
        weight_by_series(t)
    };
    size.copysign(x)
}

/// For small t, where the series converges slowly: ln coth(t/2) = ln(2/t) + t^2/12 - ...
fn weight_near_zero(t: f64) -> f64 {
    if t == 0.0 {
        0.0
    } else {
        t * ((2.0 / t).ln() + 1.0) + t.powi(3) / 36.0
    }
}

fn weight_by_series(t: f64) -> f64 {
    let e = (-t).exp();
    let odd = (0..120).map(|k| 2 * k + 1);
    let sum: f64 = odd.map(|n| e.powi(n) / f64::from(n * n)).sum();
    std::f64::consts::PI * std::f64::consts::PI / 4.0 - 2.0 * sum
}

#[cfg(test)]
mod tests;
