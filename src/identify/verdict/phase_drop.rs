//! A criterion without a model of modes: the phase drop beyond that of a minimum-phase system of the same magnitude.
//!
//! The phase of a plant without zeros in the right half plane follows from its magnitude (Bode 1945),
//!
//! ```text
//! phase(w0) = (1/pi) integral of d ln|G| / dx  ln coth(|x|/2) dx,    x = ln(w/w0)
//! ```
//!
//! A pair of CNMP zeros adds a phase lag of 360 degrees between a frequency below it and one above, a real zero in the right
//! half plane 180. Therefore the difference between two frequencies is close to a multiple of 180 degrees, or the data are
//! inconclusive.
//!
//! Hold, amplifier and delays are removed first: a delay changes the phase but not the magnitude.

use nalgebra::Complex;

/// The phase lag between two frequencies beyond that of a minimum-phase system of the same magnitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseDrop {
    /// The phase drop in degrees: the change of the minimum phase from the lower to the upper frequency, minus that of the
    /// measured phase. Positive for additional lag.
    pub drop_deg: f64,
    /// The nearest number of half turns: 2 for each CNMP pair.
    pub half_turns: i32,
    /// Deviation of the phase drop from that number of half turns, in degrees: 0 to 90.
    pub deviation_deg: f64,
}

/// Length in ln w of the interval at each end of the band whose slope extrapolates the magnitude beyond the band.
const END_INTERVAL: f64 = 0.6;
/// Distance in ln w of the frequencies between which a slope is computed.
const SLOPE_INTERVAL: f64 = 0.15;

/// The phase drop of `response` between two of its frequencies, given by index. Frequencies rise, responses are not zero.
pub fn phase_drop(
    omega_rad_s: &[f64],
    response: &[Complex<f64>],
    from: usize,
    to: usize,
) -> PhaseDrop {
    let measured = response[from..=to]
        .windows(2)
        .map(|pair| (pair[1] / pair[0]).arg())
        .sum::<f64>();
    let minimum =
        minimum_phase(omega_rad_s, response, to) - minimum_phase(omega_rad_s, response, from);
    let drop_deg = (minimum - measured).to_degrees();
    let half_turns = (drop_deg / 180.0).round();
    PhaseDrop {
        drop_deg,
        half_turns: half_turns as i32,
        deviation_deg: (drop_deg - 180.0 * half_turns).abs(),
    }
}

/// The phase in radians of the minimum-phase system at one frequency.
fn minimum_phase(omega_rad_s: &[f64], response: &[Complex<f64>], at: usize) -> f64 {
    let magnitude = LogMagnitude {
        x: omega_rad_s
            .iter()
            .map(|w| (w / omega_rad_s[at]).ln())
            .collect(),
        height: response.iter().map(|h| h.norm().ln()).collect(),
    };
    (magnitude.integral_within() + magnitude.integral_below() + magnitude.integral_above())
        / std::f64::consts::PI
}

/// ln|G| over x = ln(w/w0), and the parts of Bode's integral.
struct LogMagnitude {
    x: Vec<f64>,
    height: Vec<f64>,
}

impl LogMagnitude {
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
mod tests {
    use super::*;

    fn of(zeros: &[Complex<f64>], delay_s: f64) -> (Vec<f64>, Vec<Complex<f64>>) {
        let omega: Vec<f64> = (0..12_000)
            .map(|k| 1.0 * (0.0007 * f64::from(k)).exp())
            .collect();
        let response = omega.iter().map(|w| {
            let s = Complex::new(0.0, *w);
            let mode = |w: f64, z: f64| (s * s / (w * w) + s * (2.0 * z / w) + 1.0).inv();
            let poles = mode(180.0, 0.009) * mode(516.0, 0.004) * mode(540.0, 0.004);
            let zeros: Complex<f64> = zeros
                .iter()
                .map(|z| (s - z) * (s - z.conj()) / z.norm_sqr())
                .product();
            poles * zeros * Complex::from_polar(1.0, -w * delay_s)
        });
        let response = response.collect();
        (omega, response)
    }

    fn drop_over_zeros(zeros: &[Complex<f64>]) -> PhaseDrop {
        let (omega, response) = of(zeros, 0.0);
        let at = |w: f64| omega.iter().position(|x| *x >= w).unwrap();
        phase_drop(&omega, &response, at(300.0), at(900.0))
    }

    #[test]
    fn each_right_half_plane_pair_adds_one_turn_of_lag_and_a_left_one_none() {
        let zero = Complex::new;
        for (zeros, half_turns) in [
            (vec![zero(-2.0, 528.0)], 0),
            (vec![zero(-2.0, 525.0), zero(-2.0, 530.0)], 0),
            (vec![zero(-14.9, 530.2), zero(10.7, 530.3)], 2),
            (vec![zero(-4.0, 530.0), zero(1.0, 530.0)], 2),
            (vec![zero(5.0, 524.0), zero(5.0, 534.0)], 4),
        ] {
            let drop = drop_over_zeros(&zeros);
            // Outside the band the magnitude is extrapolated by its slope at the band limits; this causes an error of
            // some degrees.
            assert!(
                drop.half_turns == half_turns && drop.deviation_deg < 20.0,
                "{zeros:?}: {drop:?}"
            );
        }
    }

    #[test]
    fn weight_is_the_integral_of_ln_coth() {
        assert!((weight(f64::INFINITY) - 2.467_401_100_272_34).abs() < 1e-14);
        for x in [0.05, 0.0999, 0.1001, 1.0, 7.0] {
            // The midpoint rule; at 0 the logarithm adds an error of half a step times ln 2.
            let step = 1e-5;
            let midpoint = |k: usize| (k as f64 + 0.5) * step;
            let sum: f64 = (0..(x / step) as usize)
                .map(|k| -(midpoint(k) / 2.0).tanh().ln() * step)
                .sum();
            assert!((weight(x) - sum).abs() < 1e-4, "{x}: {} {sum}", weight(x));
            assert_eq!(weight(-x), -weight(x));
        }
    }
}
