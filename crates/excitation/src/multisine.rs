//! Many sines at once, each with a whole number of cycles in a period.
//!
//! ```text
//!  u(n) = sum over lines k of a_k cos(2 pi k n/N + phi_k)        a_k in the shape of A(k rate/N), max |u| = largest A in the band
//! ```
//!
//! The phases are drawn at random and then optimised for a low peak of the sum: clip the signal, keep the phases of the
//! clipped signal, restore the amplitudes, repeat (Van der Ouderaa, Schoukens, Renneboog, IEEE Trans. Instrum. Meas. 37, 1988).

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::amplitude::AmplitudeCurve;
use super::design::{ExcitationDesign, Length, SharedSettings};
use super::fourier::{samples, transform, turn};
use super::periodic::Periodic;
use super::waveform::Excitation;
use bench_base::finding::Finding;

/// A random-phase multisine. Amplitudes over its lines have the shape of `chirp.amplitude`, whose largest value within the
/// band is the largest current of the sum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MultisineSettings {
    /// Length of a period in seconds, rounded to ticks; the lines are the multiples of its inverse.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub period_s: f64,
    /// Measured periods; the last one measures the drift of the one before it.
    #[schemars(range(min = 5, max = 100000))]
    pub periods: u32,
    /// Periods before the measured ones, in which the signal fades in and the stage settles.
    #[schemars(range(min = 1, max = 1000))]
    pub settle_periods: u32,
    /// Which lines are excited.
    pub lines: Lines,
    /// Seed of the phases, and of the omitted lines.
    #[schemars(range(min = 0, max = 9223372036854775807i64))]
    pub seed: u64,
}

/// Which lines of a multisine are excited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Lines {
    /// All lines of the band.
    Full,
    /// Odd lines: even distortion appears at the even lines only.
    Odd,
    /// Odd lines except one in each group of four, chosen at random: odd distortion appears there.
    OddRandom,
}

impl ExcitationDesign for MultisineSettings {
    fn describe(&self, shared: &SharedSettings<'_>) -> String {
        let lines = match self.lines {
            Lines::Full => "all",
            Lines::Odd => "odd",
            Lines::OddRandom => "three in four odd",
        };
        let (band, period_s, periods) = (shared.band(), self.period_s, self.periods);
        format!("multisine, {band}, {lines} lines of 1/{period_s} s, {periods} periods")
    }

    fn length(&self, shared: &SharedSettings<'_>) -> Length {
        let periods = self.periods.saturating_add(self.settle_periods);
        Length {
            ticks: Periodic::length(shared, self.period_s, periods),
            key: "multisine.period_s",
            value: self.period_s,
        }
    }

    fn build(&self, shared: &SharedSettings<'_>) -> Box<dyn Excitation> {
        Box::new(multisine(self, shared))
    }

    fn check(&self, shared: &SharedSettings<'_>) -> Vec<Finding> {
        let (period_s, line_hz) = (self.period_s, 1.0 / self.period_s);
        let (low_hz, high_hz) = shared.chirp.band_hz();
        if high_hz - low_hz >= 10.0 * line_hz {
            return Vec::new();
        }
        let what = format!(
            "is {period_s} s: the band from {low_hz} to {high_hz} Hz contains fewer than ten lines ({line_hz} Hz apart); raise it, or widen the band"
        );
        vec![Finding::new("multisine.period_s", what)]
    }

    fn is_broadband(&self) -> bool {
        true
    }

    fn max_span(&self) -> Option<f64> {
        Some(MAX_SPAN)
    }
}

/// A periodic analysis ignores lines below a hundredth of the largest; half of that is kept clear.
const MAX_SPAN: f64 = 50.0;
/// Odd lines in a group, of which one is omitted.
const GROUP: usize = 4;
/// Rounds of clipping.
const ROUNDS: u32 = 100;
/// Clipping level over the peak, in the first and in the last round.
const CLIP_RATIOS: (f64, f64) = (0.5, 0.97);
/// Samples in a period of the fastest line while the phases are optimised: peaks between samples are at most 4 % higher.
const OVERSAMPLING: usize = 8;

/// The multisine of the settings.
fn multisine(settings: &MultisineSettings, shared: &SharedSettings<'_>) -> Periodic {
    let length = libm::round(settings.period_s * shared.rate_hz).max(8.0) as usize;
    let line_hz = shared.rate_hz / length as f64;
    let (low_hz, high_hz) = shared.chirp.band_hz();
    let amplitude = AmplitudeCurve::of_current(&shared.chirp.amplitude);
    let lines = lines(settings, within(low_hz, high_hz, line_hz, length)).into_iter();
    let weighted: Vec<(usize, f64)> = lines
        .map(|k| (k, amplitude.at(libm::log(k as f64 * line_hz))))
        .collect();
    let mut table = table(&weighted, settings.seed, length);
    scale_peak(&mut table, amplitude.range(low_hz, high_hz).1);
    Periodic::new(shared, table, settings.settle_periods, settings.periods)
}

/// Scales the signal to a largest value.
fn scale_peak(table: &mut [f64], peak_a: f64) {
    let peak = table.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
    let scale = if peak > 0.0 { peak_a / peak } else { 0.0 };
    table.iter_mut().for_each(|u| *u *= scale);
}

/// The lines of the band below half the rate; a limit that equals a line except for rounding includes that line.
fn within(low_hz: f64, high_hz: f64, line_hz: f64, length: usize) -> RangeInclusive<usize> {
    let low = libm::ceil(low_hz / line_hz - 1e-6).max(1.0) as usize;
    low..=(libm::floor(high_hz / line_hz + 1e-6) as usize).min((length - 1) / 2)
}

/// The excited lines of the band.
fn lines(settings: &MultisineSettings, band: RangeInclusive<usize>) -> Vec<usize> {
    let odd = band.clone().filter(|k| k % 2 == 1);
    match settings.lines {
        Lines::Full => band.collect(),
        Lines::Odd => odd.collect(),
        Lines::OddRandom => omit_one_line_per_group(&odd.collect::<Vec<_>>(), settings.seed),
    }
}

/// Omits one line of each complete group, at random.
fn omit_one_line_per_group(odd: &[usize], seed: u64) -> Vec<usize> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut kept = Vec::with_capacity(odd.len());
    for group in odd.chunks(GROUP) {
        let left_out = match group.len() {
            GROUP => (random.next_u64() >> 62) as usize,
            _ => GROUP,
        };
        let rest = group.iter().enumerate();
        kept.extend(rest.filter(|(i, _)| *i != left_out).map(|(_, k)| *k));
    }
    kept
}

/// One period of the sum of lines (number, amplitude).
fn table(lines: &[(usize, f64)], seed: u64, length: usize) -> Vec<f64> {
    let Some(&(last, _)) = lines.last() else {
        return vec![0.0; length];
    };
    let mut spectrum = vec![Complex::new(0.0, 0.0); last + 1];
    for (&(k, a), phase) in lines.iter().zip(phases(lines, seed)) {
        spectrum[k] = phase * a;
    }
    samples(&spectrum, length)
}

/// exp(i phi) of each line, optimised for a low peak of the sum.
fn phases(lines: &[(usize, f64)], seed: u64) -> Vec<Complex<f64>> {
    let mut phases = random_phases(lines.len(), seed);
    let last = lines.last().map_or(0, |(k, _)| *k);
    let mut signal = vec![Complex::new(0.0, 0.0); (OVERSAMPLING * last).next_power_of_two()];
    let (mut best, mut lowest) = (phases.clone(), f64::INFINITY);
    for round in 0..ROUNDS {
        let peak = sum(lines, &phases, &mut signal);
        if peak < lowest {
            (best, lowest) = (phases.clone(), peak);
        }
        clip(&mut signal, peak * clip_ratio(round));
        transform(&mut signal);
        take_phases(lines, &signal, &mut phases);
    }
    best
}

/// Clipping level of a round over the peak.
fn clip_ratio(round: u32) -> f64 {
    CLIP_RATIOS.0 + (CLIP_RATIOS.1 - CLIP_RATIOS.0) * f64::from(round) / f64::from(ROUNDS)
}

/// exp(i phi) with `count` random phases of a seed.
pub(super) fn random_phases(count: usize, seed: u64) -> Vec<Complex<f64>> {
    const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
    let mut random = Pcg64::new(u128::from(seed), 1);
    let mut phases = Vec::with_capacity(count);
    for _ in 0..count {
        phases.push(turn(TAU * (random.next_u64() >> 11) as f64 * UNIT));
    }
    phases
}

fn clip(signal: &mut [Complex<f64>], level: f64) {
    for u in signal {
        *u = Complex::new(u.re.clamp(-level, level), 0.0);
    }
}

/// The phases of the lines in the transform of a signal.
fn take_phases(lines: &[(usize, f64)], transform: &[Complex<f64>], phases: &mut [Complex<f64>]) {
    for ((k, _), phase) in lines.iter().zip(phases) {
        // A line exp(+i) of the signal is conjugate in its transform with exp(+i).
        let line = transform[*k].conj();
        let size = line.norm_sqr().sqrt();
        if size > 0.0 {
            *phase = line / size;
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AmplitudePoint;
    use crate::test_profile::{Profile, profile};

    /// Periods of a second at 5 kHz, lines from 20 to 219 Hz.
    fn config(lines: Lines, seed: u64, amplitude: &[(f64, f64)]) -> Profile {
        let mut config = profile();
        (config.chirp.start_hz, config.chirp.stop_hz) = (20.0, 219.0);
        let point = |&(frequency_hz, current_a): &(f64, f64)| AmplitudePoint {
            frequency_hz,
            current_a,
        };
        config.chirp.amplitude = amplitude.iter().map(point).collect();
        (
            config.excitations.multisine.period_s,
            config.excitations.multisine.lines,
            config.excitations.multisine.seed,
        ) = (1.0, lines, seed);
        config
    }

    fn built(config: &Profile) -> Periodic {
        multisine(
            &config.excitations.multisine,
            &config.chosen_excitation().shared,
        )
    }

    const FLAT: [(f64, f64); 1] = [(1.0, 0.7)];

    /// The amplitude of each line, by another transform.
    fn amplitudes(table: &[f64]) -> Vec<f64> {
        let fft = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(table.len());
        let (mut input, mut output) = (table.to_vec(), fft.make_output_vec());
        fft.process(&mut input, &mut output).unwrap();
        output
            .iter()
            .map(|line| 2.0 * line.norm() / table.len() as f64)
            .collect()
    }

    fn crest_factor(table: &[f64]) -> f64 {
        let rms = (table.iter().map(|u| u * u).sum::<f64>() / table.len() as f64).sqrt();
        table.iter().fold(0.0f64, |peak, u| peak.max(u.abs())) / rms
    }

    #[test]
    fn flat_multisine_has_equal_lines_and_half_the_crest_factor_of_random_phases() {
        for seed in 1..=8 {
            let multisine = built(&config(Lines::Full, seed, &FLAT));
            let table = multisine.table();
            assert_eq!(table.len(), 5000);
            let amplitudes = amplitudes(table);
            let a = amplitudes[20];
            for (k, amplitude) in amplitudes.iter().enumerate() {
                let expected = if (20..=219).contains(&k) { a } else { 0.0 };
                // Transforms of 16384 and 5000 numbers: some 14 roundings of the sum of 200 lines.
                assert!(
                    (amplitude - expected).abs() < 1e-12 * a.max(0.1),
                    "line {k}: {amplitude} for {expected}"
                );
            }
            let peak = table.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
            assert!(
                (peak / 0.7 - 1.0).abs() < 1e-12,
                "the largest current is the amplitude: {peak}"
            );
            // The peak of 200 random phases is near sqrt(2 ln 5000) = 4.1 sigma at most, and 3 at least; a sine has 1.41.
            let crest = crest_factor(table);
            assert!((1.41..1.8).contains(&crest), "seed {seed}: {crest}");
        }
    }

    #[test]
    fn lines_follow_the_amplitude_over_frequency() {
        let points = [(30.0, 0.1), (60.0, 0.4), (120.0, 0.05)];
        let amplitudes = amplitudes(built(&config(Lines::Full, 3, &points)).table());
        // ln A is straight over ln f: A = 0.1 (f/30)^2 up to 60 Hz, 0.4 (f/60)^-3 up to 120 Hz.
        let expected = |f: f64| match f {
            ..=30.0 => 0.1,
            ..=60.0 => 0.1 * (f / 30.0).powi(2),
            ..=120.0 => 0.4 * (f / 60.0).powi(-3),
            _ => 0.05,
        };
        for k in 20..=219usize {
            let ratio = amplitudes[k] / amplitudes[60] / (expected(k as f64) / 0.4);
            assert!((ratio - 1.0).abs() < 1e-10, "line {k}: {ratio}");
        }
    }

    #[test]
    fn omitted_lines_are_zero() {
        for (lines, left) in [(Lines::Odd, 100), (Lines::OddRandom, 75)] {
            let amplitudes = amplitudes(built(&config(lines, 5, &FLAT)).table());
            let excited: Vec<usize> = (0..amplitudes.len())
                .filter(|k| amplitudes[*k] > 1e-3)
                .collect();
            assert_eq!(excited.len(), left, "{lines:?}");
            assert!(excited.iter().all(|k| k % 2 == 1 && (20..=219).contains(k)));
            assert!(
                (0..amplitudes.len()).all(|k| excited.contains(&k) || amplitudes[k] < 1e-13),
                "{lines:?}"
            );
            for group in 0..25 {
                let first = 21 + 8 * group;
                let within = excited
                    .iter()
                    .filter(|k| (first..first + 8).contains(*k))
                    .count();
                assert_eq!(within, left / 25, "{lines:?}, group {group}");
            }
        }
        let out = |seed| {
            lines(
                &config(Lines::OddRandom, seed, &FLAT).excitations.multisine,
                20..=219,
            )
        };
        assert_ne!(out(1), out(2), "others with another seed");
    }

    #[test]
    fn current_depends_on_the_seed() {
        let at = |seed: u64, tick: u64| {
            built(&config(Lines::Full, seed, &FLAT))
                .current_a(tick)
                .to_bits()
        };
        assert_eq!(at(1, 30_000), at(1, 30_000));
        assert_ne!(at(1, 30_000), at(2, 30_000));
    }

    #[test]
    fn band_without_lines_gives_zero_current() {
        let mut config = config(Lines::Full, 1, &FLAT);
        (config.chirp.start_hz, config.chirp.stop_hz) = (20.2, 20.8);
        assert!(built(&config).table().iter().all(|u| *u == 0.0));
    }
}
