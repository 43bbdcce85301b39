//! A random reference that is limited to a band and to a peak.
//!
//! ```text
//!  r(n) = c sum over k = 1 ... K of cos(2 pi k (n + n0)/N + phi_k)      N = period rate,  K = floor(f N/rate)
//! ```
//!
//! The phases are random, and c gives max |r| = A. n0, between two ticks, is a zero of the sum: the reference starts at zero and has
//! no frequency beyond the band.

use std::f64::consts::TAU;

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{
    ReferenceContext, ReferenceDesign, ReferenceError, check_amplitude, check_frequency, um,
};
use crate::fourier::{samples, turn};
use crate::multisine::random_phases;
use crate::waveform::Reference;
use bench_base::finding::Finding;
use bench_base::numeric::bisect;

/// Largest number of ticks of a period, which is stored as a table: 200 s at 5 kHz.
const MAX_TICKS: f64 = 1e6;
/// A frequency that equals a line except for this part of the line spacing includes that line.
const ROUNDING: f64 = 1e-6;

/// A random signal with a flat spectrum up to a frequency. It repeats after a period.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomReference {
    /// Largest position to either side in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Highest frequency in hertz, below half the servo rate.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub frequency_hz: f64,
    /// Time in seconds after which it repeats, rounded to ticks. Its frequencies are the multiples of the inverse.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub period_s: f64,
    /// Seed of the phases.
    #[schemars(range(min = 0, max = 9223372036854775807i64))]
    pub seed: u64,
}

impl RandomReference {
    /// A band without a multiple of the inverse of the period.
    fn check_band(&self, rate_hz: f64) -> Option<Finding> {
        let (period_s, frequency_hz) = (self.period_s, self.frequency_hz);
        let what = format!(
            "is {frequency_hz} Hz, less than a cycle in the period of {period_s} s (control.reference.period_s); raise it, or lengthen the period"
        );
        let is_empty = line_count(self, 1.0 / rate_hz) == 0;
        is_empty.then(|| Finding::new("control.reference.frequency_hz", what))
    }

    fn check_period(&self, rate_hz: f64) -> Option<Finding> {
        let (period_s, longest_s) = (self.period_s, MAX_TICKS / rate_hz);
        let what = format!(
            "is {period_s} s, longer than {longest_s} s ({MAX_TICKS} ticks); lower it, or lower loop.rate_hz"
        );
        (period_s > longest_s).then(|| Finding::new("control.reference.period_s", what))
    }
}

impl ReferenceDesign for RandomReference {
    fn describe(&self) -> String {
        let (peak, frequency_hz) = (um(self.amplitude_m.abs()), self.frequency_hz);
        format!("random up to {frequency_hz} Hz, within +-{peak}")
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(Random(table(self, context.period_s))))
    }

    fn check(&self, soft_limit_m: f64, rate_hz: f64) -> Vec<Finding> {
        let mut findings = check_amplitude(self.amplitude_m, soft_limit_m);
        findings.extend(check_frequency(self.frequency_hz, rate_hz));
        findings.extend(self.check_band(rate_hz));
        findings.extend(self.check_period(rate_hz));
        findings
    }
}

/// Ticks of a period.
fn period_ticks(settings: &RandomReference, tick_s: f64) -> usize {
    libm::round(settings.period_s / tick_s).clamp(1.0, MAX_TICKS) as usize
}

/// Number of frequencies: the multiples of the inverse of the period up to the highest frequency, below half the rate.
fn line_count(settings: &RandomReference, tick_s: f64) -> usize {
    let ticks = period_ticks(settings, tick_s);
    let wanted = libm::floor(settings.frequency_hz * ticks as f64 * tick_s + ROUNDING);
    (wanted as usize).min((ticks - 1) / 2)
}

/// One period, which starts at zero.
fn table(settings: &RandomReference, tick_s: f64) -> Vec<f64> {
    let ticks = period_ticks(settings, tick_s);
    let phases = random_phases(line_count(settings, tick_s), settings.seed);
    let mut lines = vec![Complex::new(0.0, 0.0)];
    lines.extend(phases);
    let start = zero(&lines, ticks);
    for (k, line) in lines.iter_mut().enumerate() {
        *line *= turn(TAU * k as f64 * start / ticks as f64);
    }
    let mut table = samples(&lines, ticks);
    scale(&mut table, settings.amplitude_m);
    table
}

/// A zero of the sum of the lines, in ticks: in the first interval in which it changes its sign.
fn zero(lines: &[Complex<f64>], ticks: usize) -> f64 {
    let table = samples(lines, ticks);
    let changes_sign = |pair: &[f64]| (pair[0] < 0.0) != (pair[1] < 0.0);
    let Some(before) = table.windows(2).position(changes_sign) else {
        return 0.0;
    };
    let sum = |time: f64| -> f64 {
        let lines = lines.iter().enumerate();
        let terms = lines.map(|(k, line)| (line * turn(TAU * k as f64 * time / ticks as f64)).re);
        terms.sum()
    };
    bisect(sum, before as f64, (before + 1) as f64)
}

/// Scales the values to a peak; the first value, zero except for rounding, becomes zero.
fn scale(table: &mut [f64], peak_m: f64) {
    let largest = table
        .iter()
        .fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let factor = if largest > 0.0 { peak_m / largest } else { 0.0 };
    table.iter_mut().for_each(|x| *x *= factor);
    if let Some(first) = table.first_mut() {
        *first = 0.0;
    }
}

/// The values of one period.
struct Random(Vec<f64>);

impl Reference for Random {
    fn at_m(&self, tick: u64) -> f64 {
        let ticks = self.0.len().max(1) as u64;
        let place = (tick % ticks) as usize;
        self.0.get(place).copied().unwrap_or_default()
    }
}
