//! Feedforward by the stable inverse of the sampled plant.
//!
//! The current u_ff = P^-1 F r moves the plant along y = F r, where F is a low-pass without phase. On the unit circle the inverse
//! F/P is a bounded filter of both sides, whatever the zeros of P are: a zero outside the unit circle (CNMP, or that of sampling),
//! and the delay, make it read the reference ahead of time. This is the stable inversion of Devasia, Chen and Paden (IEEE
//! Transactions on Automatic Control 41, 1996) for a sampled plant; its taps are the inverse Fourier transform of F/P.
//!
//! The loop follows F r, so that it sees no error where the plant is that of the model. What is left of the tracking error e is
//!
//! e = S (P_model - P) u_ff = S (1 - P/P_model) F r
//!
//! F passes up to `bandwidth_hz` and stops from twice this frequency on: the inverse asks for nothing where the model is not
//! known.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use bench_excitation::command::{CommandFilter, CommandFilterError, Taps};
use bench_excitation::fourier;
use bench_plant::LoopPlant;

/// Attenuation of F beyond its stop frequency in decibels; its ripple below `bandwidth_hz` is 10^(-60/20) = 0.1 %.
const ATTENUATION_DB: f64 = 60.0;
/// Length of the Fourier transform over that of F: what the inverse rings beyond it folds back.
const TRANSFORM_RATIO: usize = 16;
/// Sum of the taps that are cut off at either end, over the sum of all magnitudes.
const CUT_OFF: f64 = 1e-4;

/// The filters of a feedforward.
#[derive(Clone, Debug, PartialEq)]
pub struct InverseFilter {
    /// F, from the reference to the reference of the loop.
    pub reference: Taps,
    /// F/P, from the reference in metres to the feedforward current in amperes.
    pub feedforward: Taps,
}

/// The feedforward of a plant, from metres at the probe to amperes, with a low-pass F that passes up to `bandwidth_hz`, which is
/// above 0.
///
/// # Errors
/// For a bandwidth so low that F has too many taps.
pub fn inverse_filter(
    plant: &LoopPlant,
    bandwidth_hz: f64,
) -> Result<InverseFilter, CommandFilterError> {
    let half = half_length(bandwidth_hz, plant.period_s())?;
    let low_pass = low_pass(bandwidth_hz, plant.period_s(), half as i64);
    let length = (TRANSFORM_RATIO * low_pass.len()).next_power_of_two();
    let response = inverse_response(plant, &low_pass, length);
    let taps = cut_off(&impulse_response(response));
    Ok(InverseFilter {
        reference: Taps::dense(-(half as i64), low_pass),
        feedforward: taps,
    })
}

/// Taps of F on either side of the one in the middle, by Kaiser's formula.
fn half_length(bandwidth_hz: f64, period_s: f64) -> Result<usize, CommandFilterError> {
    let width = bandwidth_hz * period_s;
    let half = libm::ceil((ATTENUATION_DB - 7.95) / (14.36 * width) / 2.0) as usize;
    let (taps, max) = (
        half.saturating_mul(2).saturating_add(1),
        CommandFilter::MAX_TAPS,
    );
    if taps > max {
        Err(CommandFilterError::Long {
            taps,
            ticks: i64::try_from(taps).unwrap_or(i64::MAX),
            max,
        })
    } else {
        Ok(half.max(1))
    }
}

/// The weights of F, an odd number, symmetric: a sinc within a Kaiser window (J. F. Kaiser, 1974), with a sum of 1.
fn low_pass(bandwidth_hz: f64, period_s: f64, half: i64) -> Vec<f64> {
    // The middle of the transition in cycles per tick.
    let corner = 1.5 * bandwidth_hz * period_s;
    let shape = 0.1102 * (ATTENUATION_DB - 8.7);
    let weight = |k: i64| {
        let x = k as f64 / half as f64;
        let window = bessel_i0(shape * (1.0 - x * x).sqrt()) / bessel_i0(shape);
        window * sinc(2.0 * corner * k as f64)
    };
    let weights: Vec<f64> = (-half..=half).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

/// sin(pi x)/(pi x).
fn sinc(x: f64) -> f64 {
    match x {
        0.0 => 1.0,
        _ => libm::sin(PI * x) / (PI * x),
    }
}

/// The modified Bessel function I0 by its series; 40 terms are exact below an argument of 10.
fn bessel_i0(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..40 {
        term *= (x / 2.0 / f64::from(k)) * (x / 2.0 / f64::from(k));
        sum += term;
    }
    sum
}

/// F/P at w_k = 2 pi k/(N T), k = 0 ... N - 1. Without a value where P is infinite: a free body needs no steady current.
fn inverse_response(plant: &LoopPlant, low_pass: &[f64], length: usize) -> Vec<Complex<f64>> {
    let half = length / 2;
    let passed = symmetric_response(low_pass, length);
    let mut response = vec![Complex::new(0.0, 0.0); length];
    for k in 0..=half {
        let angle = TAU * k as f64 / length as f64;
        let value = plant.response(angle / plant.period_s()).inv() * passed[k].re;
        if value.re.is_finite() && value.im.is_finite() {
            response[k] = value;
            response[(length - k) % length] = value.conj();
        }
    }
    response[0].im = 0.0;
    response[half].im = 0.0;
    response
}

/// Response of an odd number of symmetric weights, the one in the middle without delay, at `length` frequencies.
fn symmetric_response(weights: &[f64], length: usize) -> Vec<Complex<f64>> {
    let half = weights.len() / 2;
    let mut samples = vec![Complex::new(0.0, 0.0); length];
    for (index, weight) in weights.iter().enumerate() {
        samples[(length + index - half) % length] = Complex::new(*weight, 0.0);
    }
    fourier::transform(&mut samples);
    samples
}

/// The weights with delays from -N/2 to N/2 - 1.
fn impulse_response(mut response: Vec<Complex<f64>>) -> Vec<f64> {
    fourier::transform(&mut response);
    let half = response.len() / 2;
    response.rotate_left(half);
    let scale = 1.0 / response.len() as f64;
    response.iter().map(|value| value.re * scale).collect()
}

/// The taps without those at both ends that add almost nothing, with the same gain at low frequency.
fn cut_off(weights: &[f64]) -> Taps {
    let total: f64 = weights.iter().map(|weight| weight.abs()).sum();
    let early = negligible(weights.iter(), CUT_OFF * total);
    let late = negligible(weights[early..].iter().rev(), CUT_OFF * total);
    let first = early as i64 - (weights.len() / 2) as i64;
    let kept = Taps::dense(first, weights[early..weights.len() - late].iter().copied());
    let gain: f64 = weights.iter().sum();
    // A free body needs no steady current, and its taps keep their sum near 0.
    if gain.abs() > CUT_OFF * total {
        let ratio = gain / kept.sum();
        kept.scaled(ratio)
    } else {
        kept
    }
}

/// How many of the first weights have magnitudes that sum up to less than `limit`.
fn negligible<'a>(weights: impl Iterator<Item = &'a f64>, limit: f64) -> usize {
    let mut sum = 0.0;
    let small = weights.take_while(|weight| {
        sum += weight.abs();
        sum < limit
    });
    small.count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_plant::{Mode, OutputKind, SignalPath};

    fn plant(modes: &[Mode]) -> LoopPlant {
        let path = SignalPath {
            period_s: 2e-4,
            amplifier_bandwidth_hz: 1000.0,
            force_constant_n_per_a: 11.12,
            delays_s: vec![2e-4],
            output: OutputKind::Position,
        };
        LoopPlant::of(&path, modes)
    }

    fn mode(omega_rad_s: f64, residue_per_kg: f64) -> Mode {
        Mode {
            omega_rad_s,
            damping_ratio: 0.01,
            shape: nalgebra::DVector::zeros(1),
            force_gain: residue_per_kg,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        }
    }

    fn response(taps: &Taps, angle: f64) -> Complex<f64> {
        let terms = taps
            .as_slice()
            .iter()
            .map(|tap| Complex::from_polar(tap.weight, -angle * tap.delay_ticks as f64));
        terms.sum()
    }

    /// Residues of 1, 1 and -0.5: the zeros are CNMP, for example at 18 +- 490j rad/s without damping of the modes.
    #[test]
    fn current_moves_the_plant_along_the_filtered_reference() {
        let plant = plant(&[mode(180.0, 1.0), mode(480.0, 0.4), mode(500.0, -0.5)]);
        let period_s = plant.period_s();
        let filter = inverse_filter(&plant, 25.0).expect("short");
        let (first, last) = filter.feedforward.span_ticks().expect("taps");
        assert!(first < 0 && last > 0, "{first} {last}");
        for hertz in [0.01, 1.0, 10.0, 20.0, 25.0, 32.0, 50.0, 78.0, 300.0] {
            let angle = TAU * hertz * period_s;
            let position = plant.response(TAU * hertz) * response(&filter.feedforward, angle);
            let reference = response(&filter.reference, angle);
            // Cut off at 2e-4 of the sum of the taps; beyond the band the inverse has a large gain there.
            assert!(
                (position - reference).norm() < 2e-3,
                "{hertz} Hz: {position} {reference}"
            );
            let passes = if hertz <= 25.0 { 1.0 } else { 0.0 };
            if !(25.1..49.9).contains(&hertz) {
                // 60 dB: 1e-3, and a little more at the edges by Kaiser's formula.
                assert!(
                    (reference.re - passes).abs() < 2e-3,
                    "{hertz} Hz: {reference}"
                );
            }
            assert!(reference.im.abs() < 1e-12, "without phase");
        }
    }
}
