//! Many sines at once, each a whole number of turns a period.
//!
//! ```text
//!  u(n) = sum over lines k of a_k cos(2 pi k n/N + phi_k)        a_k in the shape of A(k rate/N), max |u| = largest A in the band
//! ```
//!
//! The phases are drawn at random, and then moved so that the sum's peak falls: clip the signal, keep the phases of what is
//! left, give the lines their amplitudes back, again (Van der Ouderaa, Schoukens, Renneboog, IEEE Trans. Instrum. Meas. 37, 1988).

use std::f64::consts::PI;

use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::envelope::Amplitude;
use super::fourier::{samples, transform, turn};
use super::periodic::Periodic;
use crate::config::{Config, Lines, MultisineSettings};

/// Odd lines a group, of which one is left out.
const GROUP: usize = 4;
/// Rounds of clipping.
const ROUNDS: u32 = 100;
/// The signal is clipped at this part of its peak at first, and ever less.
const CLIP: f64 = 0.75;
/// Samples to a turn of the fastest line while its phases are sought: peaks between them are 4 % higher at most.
const OVERSAMPLING: usize = 8;

/// The multisine of a configuration.
pub fn multisine(config: &Config) -> Periodic {
    let settings = &config.multisine;
    let length = libm::round(settings.period_s * config.servo.rate_hz).max(8.0) as usize;
    let line_hz = config.servo.rate_hz / length as f64;
    let chirp = &config.chirp;
    let (low_hz, high_hz) = (chirp.start_hz.min(chirp.stop_hz), chirp.start_hz.max(chirp.stop_hz));
    let amplitude = Amplitude::new(&chirp.amplitude);
    let of = |k: usize| (k, amplitude.at(libm::log(k as f64 * line_hz)));
    let lines = lines(settings, within(low_hz, high_hz, line_hz, length));
    let weighted: Vec<(usize, f64)> = lines.into_iter().map(of).collect();
    let mut table = table(&weighted, settings.seed, length);
    let peak_a = table.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
    let scale = if peak_a > 0.0 { amplitude.range_a(low_hz, high_hz).1 / peak_a } else { 0.0 };
    table.iter_mut().for_each(|u| *u *= scale);
    Periodic::new(config, table, settings.settle_periods, settings.periods)
}

/// The lines of the band below half the rate; one that is a limit up to rounding counts.
fn within(low_hz: f64, high_hz: f64, line_hz: f64, length: usize) -> std::ops::RangeInclusive<usize> {
    let low = libm::ceil(low_hz / line_hz - 1e-6).max(1.0) as usize;
    low..=(libm::floor(high_hz / line_hz + 1e-6) as usize).min((length - 1) / 2)
}

/// Those of the band that are excited.
fn lines(settings: &MultisineSettings, band: std::ops::RangeInclusive<usize>) -> Vec<usize> {
    match settings.lines {
        Lines::Full => band.collect(),
        Lines::Odd => band.filter(|k| k % 2 == 1).collect(),
        Lines::OddRandom => {
            let odd: Vec<usize> = band.filter(|k| k % 2 == 1).collect();
            let mut random = Pcg64::seed_from_u64(settings.seed);
            let kept = |group: &[usize]| {
                let out = if group.len() == GROUP { (random.next_u64() >> 62) as usize } else { GROUP };
                let rest = group.iter().enumerate().filter(|(place, _)| *place != out);
                rest.map(|(_, k)| *k).collect::<Vec<_>>()
            };
            odd.chunks(GROUP).flat_map(kept).collect()
        }
    }
}

/// One period of the sum of lines (number, amplitude).
fn table(lines: &[(usize, f64)], seed: u64, length: usize) -> Vec<f64> {
    let Some(&(last, _)) = lines.last() else { return vec![0.0; length] };
    let mut spectrum = vec![Complex::new(0.0, 0.0); last + 1];
    for (&(k, a), phase) in lines.iter().zip(phases(lines, seed)) {
        spectrum[k] = phase * a;
    }
    samples(&spectrum, length)
}

/// exp(i phi) of each line, by which the sum's peak is low.
fn phases(lines: &[(usize, f64)], seed: u64) -> Vec<Complex<f64>> {
    let mut random = Pcg64::new(u128::from(seed), 1);
    let mut draw = || turn(2.0 * PI * (random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64));
    let mut phases: Vec<Complex<f64>> = lines.iter().map(|_| draw()).collect();
    let last = lines.last().map_or(0, |(k, _)| *k);
    let mut signal = vec![Complex::new(0.0, 0.0); (OVERSAMPLING * last).next_power_of_two()];
    let (mut best, mut lowest) = (phases.clone(), f64::INFINITY);
    for round in 0..ROUNDS {
        let peak = sum(lines, &phases, &mut signal);
        if peak < lowest {
            (best, lowest) = (phases.clone(), peak);
        }
        let level = peak * (CLIP + (0.98 - CLIP) * f64::from(round) / f64::from(ROUNDS));
        signal.iter_mut().for_each(|u| *u = Complex::new(u.re.clamp(-level, level), 0.0));
        transform(&mut signal);
        for ((k, _), phase) in lines.iter().zip(&mut phases) {
            // What turns by exp(+i) in the signal stands conjugate in its transform with exp(+i) again.
            let left = signal[*k].conj();
            let size = left.norm_sqr().sqrt();
            *phase = if size > 0.0 { left / size } else { *phase };
        }
    }
    best
}

/// The samples of the sum, and its peak.
fn sum(lines: &[(usize, f64)], phases: &[Complex<f64>], signal: &mut [Complex<f64>]) -> f64 {
    signal.fill(Complex::new(0.0, 0.0));
    for ((k, a), phase) in lines.iter().zip(phases) {
        signal[*k] = phase * *a;
    }
    transform(signal);
    signal.iter().fold(0.0f64, |peak, u| peak.max(u.re.abs()))
}
