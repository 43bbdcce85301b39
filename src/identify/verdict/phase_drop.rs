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

/// The measured phase drop compared with that of a minimum-phase system of the same magnitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseDrop {
    /// The change of the measured phase from the lower to the upper frequency, minus that of the minimum-phase system, in
    /// degrees; negative for additional lag.
    pub excess_phase_deg: f64,
    /// The nearest number of half turns, positive for additional lag: 2 for each CNMP pair.
    pub half_turns: i32,
    /// Deviation of the difference from that number of half turns, in degrees: 0 to 90.
    pub deviation_deg: f64,
}

/// Beyond the band the magnitude continues with the slope of this interval of ln w at its ends ...
const END_INTERVAL: f64 = 0.6;
/// ... between frequencies this far apart in ln w.
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
    let excess_phase_deg = (measured - minimum).to_degrees();
    let half_turns = -(excess_phase_deg / 180.0).round();
    PhaseDrop {
        excess_phase_deg,
        half_turns: half_turns as i32,
        deviation_deg: (excess_phase_deg + 180.0 * half_turns).abs(),
    }
}

/// The phase in radians of the minimum-phase system at one frequency.
fn minimum_phase(omega_rad_s: &[f64], response: &[Complex<f64>], at: usize) -> f64 {
    let x: Vec<f64> = omega_rad_s
        .iter()
        .map(|w| (w / omega_rad_s[at]).ln())
        .collect();
    let height: Vec<f64> = response.iter().map(|h| h.norm().ln()).collect();
    let slope = |i: usize| (height[i] - height[i - 1]) / (x[i] - x[i - 1]);
    let within: f64 = (1..x.len())
        .map(|i| slope(i) * (weight(x[i]) - weight(x[i - 1])))
        .sum();
    let (first, last) = (x[0], x[x.len() - 1]);
    let below = end_slope(&x, &height, first, first + END_INTERVAL)
        * (weight(first) - weight(f64::NEG_INFINITY));
    let above =
        end_slope(&x, &height, last - END_INTERVAL, last) * (weight(f64::INFINITY) - weight(last));
    (within + below + above) / std::f64::consts::PI
}

/// The median slope of the height between x values [`SLOPE_INTERVAL`] apart, from `low` to `high`: robust against noise and
/// against a resonance at the end of the band.
fn end_slope(x: &[f64], height: &[f64], low: f64, high: f64) -> f64 {
    let first = x.partition_point(|x| *x < low);
    let slope = |i: usize| {
        let j = x.partition_point(|other| *other < x[i] + SLOPE_INTERVAL);
        (j < x.len() && x[j] <= high).then(|| (height[j] - height[i]) / (x[j] - x[i]))
    };
    let mut slopes: Vec<f64> = (first..x.len()).map_while(slope).collect();
    slopes.sort_by(f64::total_cmp);
    slopes.get(slopes.len() / 2).copied().unwrap_or(0.0)
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
    let term = |k: i32| e.powi(2 * k + 1) / f64::from((2 * k + 1) * (2 * k + 1));
    let limit = std::f64::consts::PI * std::f64::consts::PI / 4.0;
    limit - 2.0 * (0..120).map(term).sum::<f64>()
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
            // The slopes at the ends of the band replace the rest of it: an error of some degrees.
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
