//! Defects of a record that an estimator would take for signal: spikes, steps, repeated and clipped samples, motion at its ends.
//!
//! A defect is alike from one frequency to the next, so that modes are fitted to it. It is found in the time domain, from the error of
//! a prediction of each output sample by the samples before it and by the input (least squares over the record):
//!
//! ```text
//! y_k = sum a_i y_(k-i) + sum b_j u_(k-j) + e_k           i = 1 .. 8, j = 0 .. 8
//! spike of height h     e = h (1, -a_1, -a_2, ...)
//! step of height h      e = h (1, 1 - a_1, 1 - a_1 - a_2, ...)
//! ```
//!
//! An error above 20 standard deviations of its neighbours (from their median magnitude) begins a defect. A spike counts if its square exceeds 2 % of the
//! energy of the noise over the record: smaller ones have no effect. Samples after a jump of the input, which excites more than the
//! prediction describes, do not count. In a periodic record such defects differ from period to period and count as noise.
//!
//! A run of L equal samples in a record of n is a defect if n p^L is below 1e-6, with p the ratio of equal neighbours, and the input
//! changes meanwhile.

use std::fmt;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::Signals;

/// Samples of the output, and of the input before the present one, in the prediction.
const ORDER: usize = 8;
/// Coefficients of the prediction.
const COEFFICIENTS: usize = 2 * ORDER + 1;
/// The coefficients are determined from at most this many samples.
const MAX_EQUATIONS: usize = 100_000;
/// Added to the diagonal of the normal equations, relative to it: they are nearly singular for a slow signal.
const REGULARIZATION: f64 = 1e-12;
/// Number of samples whose errors are compared.
const BLOCK: usize = 2048;
/// Errors of the prediction beyond this many standard deviations are no noise.
const DEFECT_SIGMAS: f64 = 20.0;
/// The median magnitude of normally distributed numbers of standard deviation 1.
const NORMAL_MEDIAN: f64 = 0.6745;
/// The input jumps if it changes by more than this multiple of its median change.
const JUMP_RATIO: f64 = 30.0;
/// The square of a spike is at least this ratio of the energy of the noise.
const MIN_ENERGY_RATIO: f64 = 0.02;
/// A spike is at most this many samples long.
const MAX_SPIKE: usize = 4;
/// A repeated sample occurs at least this many times in succession ...
const MIN_REPEATED: usize = 5;
/// ... and by chance with less than this probability.
const CHANCE: f64 = 1e-6;
/// A clipped output stays at its limit for at least this many samples ...
const MIN_CLIPPED: usize = 3;
/// ... at least this many times.
const MIN_CLIPPED_PEAKS: usize = 4;
/// Samples at each end from which its velocity is determined, and number of such intervals.
const END_SAMPLES: usize = 16;
const END_INTERVALS: usize = 8;
/// A record is not at rest if its velocity exceeds this ratio of its root mean square, and noise by this factor.
const MOVING_RATIO: f64 = 0.1;
const MOVING_SIGMAS: f64 = 8.0;

/// A defect of a record. Times are in seconds from its first sample, heights in units of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Defect {
    /// A few samples are far off.
    Spike {
        /// Time of the first one.
        time_s: f64,
        /// By how much.
        height: f64,
    },
    /// The output jumps.
    Step {
        /// Time of the first sample after the jump.
        time_s: f64,
        /// By how much.
        height: f64,
    },
    /// The output keeps its value for some samples.
    Repeated {
        /// Time of the first one.
        time_s: f64,
        /// Number of samples.
        samples: usize,
    },
    /// The output stays at its largest or smallest value.
    Clipped {
        /// Time of the first sample at that value.
        time_s: f64,
        /// The value.
        value: f64,
    },
    /// The output moves at the beginning.
    MovingAtStart {
        /// Its velocity over the RMS velocity of the record.
        ratio: f64,
    },
    /// The output moves at the end.
    MovingAtEnd {
        /// Its velocity over the RMS velocity of the record.
        ratio: f64,
    },
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Defect::Spike { time_s, height } => write!(
                f,
                "the output has a spike of {height:.3e} at {time_s:.4} s; replace these samples by interpolation"
            ),
            Defect::Step { time_s, height } => write!(
                f,
                "the output jumps by {height:.3e} at {time_s:.4} s; subtract the jump from the samples after it, or repeat the record"
            ),
            Defect::Repeated { time_s, samples } => write!(
                f,
                "{samples} samples of the output from {time_s:.4} s on have the same value; check the probe and its connection, and repeat the record"
            ),
            Defect::Clipped { time_s, value } => write!(
                f,
                "the output is clipped at {value:.6e}, for the first time at {time_s:.4} s; lower the amplitude, or extend the range of the probe"
            ),
            Defect::MovingAtStart { ratio } => write!(
                f,
                "the output moves at the first sample, with {:.0} % of its RMS velocity; begin the record before the excitation, with the plant at rest, or give --period if it is periodic",
                100.0 * ratio
            ),
            Defect::MovingAtEnd { ratio } => write!(
                f,
                "the output still moves at the last sample, with {:.0} % of its RMS velocity; record for longer after the excitation, until the plant is at rest, or give --period if it is periodic",
                100.0 * ratio
            ),
        }
    }
}

/// The first defect of each kind. A periodic record does not begin and end at rest.
pub fn defects(signals: &Signals, is_periodic: bool) -> Vec<Defect> {
    let lasting = clipped(signals).or_else(|| repeated(signals));
    if lasting.is_some() || is_periodic {
        return lasting.into_iter().collect();
    }
    let Some(prediction) = Prediction::new(signals) else {
        return Vec::new();
    };
    let jumps = prediction.jumps().into_iter();
    jumps
        .chain(motion_at_ends(signals, prediction.median_sigma()))
        .collect()
}

/// The errors of the prediction of a record.
struct Prediction<'a> {
    signals: &'a Signals,
    coefficients: DVector<f64>,
    /// Error of each sample; 0 of the first ones.
    error: Vec<f64>,
    /// Standard deviation of the errors of each block, at least that of rounding.
    sigma: Vec<f64>,
}

impl<'a> Prediction<'a> {
    fn new(signals: &'a Signals) -> Option<Self> {
        let scale = Scale::new(signals);
        let coefficients = coefficients(signals, &scale)?;
        let row_error = |k: usize| {
            let row = row(signals, &scale, k);
            let predicted: f64 = row
                .iter()
                .zip(coefficients.iter())
                .map(|(x, c)| x * c)
                .sum();
            (signals.output_m[k] - scale.offset) - predicted * scale.output
        };
        let mut error = vec![0.0; ORDER];
        error.extend((ORDER..signals.len()).map(row_error));
        let rounding = f64::EPSILON * scale.output.max(scale.offset.abs());
        let blocks = error.chunks(BLOCK);
        let sigma = blocks
            .map(|block| sigma_by_median(block).max(rounding))
            .collect();
        Some(Self {
            signals,
            coefficients,
            error,
            sigma,
        })
    }

    fn median_sigma(&self) -> f64 {
        median(self.sigma.clone())
    }

    /// The first spike and the first step.
    fn jumps(&self) -> Vec<Defect> {
        let mut found: Vec<Defect> = Vec::new();
        let jumps_of_input = jumps(&self.signals.input_a);
        let mut k = ORDER;
        while k < self.error.len() {
            if !self.is_outlier(k) || after_a_jump(&jumps_of_input, k) {
                k += 1;
                continue;
            }
            let defect = self.classify(k);
            let has_effect = self.has_effect(defect, k);
            let is_new =
                |known: &Defect| std::mem::discriminant(known) != std::mem::discriminant(&defect);
            if has_effect && found.iter().all(is_new) {
                found.push(defect);
            }
            k += ORDER + 1;
        }
        found
    }

    fn is_outlier(&self, k: usize) -> bool {
        self.error[k].abs() > DEFECT_SIGMAS * self.sigma[k / BLOCK]
    }

    /// Whether a defect matters beside the noise: a short spike must have some of the noise's energy, a step always matters.
    fn has_effect(&self, defect: Defect, k: usize) -> bool {
        let Defect::Spike { height, .. } = defect else {
            return true;
        };
        let sigma = self.sigma[k / BLOCK];
        height * height > MIN_ENERGY_RATIO * sigma * sigma * self.error.len() as f64
    }

    fn classify(&self, k: usize) -> Defect {
        let time_s = |k: usize| k as f64 / self.signals.rate_hz;
        let end = (k + ORDER + 1).min(self.error.len());
        let error = &self.error[k..end];
        let time_s = time_s(k);
        let spikes = (1..=MAX_SPIKE).map(|length| projection(error, &self.pattern(length)));
        let spike = spikes.min_by(|a, b| a.1.total_cmp(&b.1));
        let (step_height, step_rest) = projection(error, &self.pattern(ORDER + 1));
        match spike {
            Some((height, rest)) if rest <= step_rest => Defect::Spike { time_s, height },
            _ => Defect::Step {
                time_s,
                height: step_height,
            },
        }
    }

    /// The errors after an offset of 1 that lasts some samples.
    fn pattern(&self, length: usize) -> Vec<f64> {
        let single = |i: usize| {
            if i == 0 {
                1.0
            } else {
                -self.coefficients[i - 1]
            }
        };
        let sum = |i: usize| (0..=i.min(length - 1)).map(|j| single(i - j)).sum();
        (0..=ORDER).map(sum).collect()
    }
}

/// Scales that make both signals of size 1.
struct Scale {
    offset: f64,
    output: f64,
    input: f64,
}

impl Scale {
    fn new(signals: &Signals) -> Scale {
        let offset = super::mean::mean(&signals.output_m);
        let rms = |samples: &[f64], offset: f64| {
            let sum: f64 = samples.iter().map(|x| (x - offset) * (x - offset)).sum();
            (sum / samples.len() as f64).sqrt().max(f64::MIN_POSITIVE)
        };
        Scale {
            offset,
            output: rms(&signals.output_m, offset),
            input: rms(&signals.input_a, 0.0),
        }
    }
}

/// The scaled samples from which sample `k` is predicted.
fn row(signals: &Signals, scale: &Scale, k: usize) -> [f64; COEFFICIENTS] {
    std::array::from_fn(|i| {
        if i < ORDER {
            (signals.output_m[k - 1 - i] - scale.offset) / scale.output
        } else {
            signals.input_a[k - (i - ORDER)] / scale.input
        }
    })
}

/// The coefficients of the prediction by least squares.
fn coefficients(signals: &Signals, scale: &Scale) -> Option<DVector<f64>> {
    let mut matrix = DMatrix::<f64>::zeros(COEFFICIENTS, COEFFICIENTS);
    let mut right = DVector::<f64>::zeros(COEFFICIENTS);
    let step = (signals.len() / MAX_EQUATIONS).max(1);
    for k in (ORDER..signals.len()).step_by(step) {
        let row = row(signals, scale, k);
        let output = (signals.output_m[k] - scale.offset) / scale.output;
        for i in 0..COEFFICIENTS {
            for j in 0..=i {
                matrix[(i, j)] += row[i] * row[j];
            }
            right[i] += row[i] * output;
        }
    }
    let trace = matrix.trace();
    for i in 0..COEFFICIENTS {
        matrix[(i, i)] += REGULARIZATION * trace;
    }
    // Cholesky reads the lower triangle alone.
    Some(Cholesky::<f64, Dyn>::new(matrix)?.solve(&right))
}

fn sigma_by_median(errors: &[f64]) -> f64 {
    median(errors.iter().map(|error| error.abs()).collect()) / NORMAL_MEDIAN
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The indices at which a signal changes by far more than usual, if it seldom does.
fn jumps(samples: &[f64]) -> Vec<usize> {
    let changes: Vec<f64> = samples
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let limit = JUMP_RATIO * median(changes.clone());
    let jumps = changes
        .iter()
        .enumerate()
        .filter(|(_, change)| **change > limit);
    jumps.map(|(k, _)| k + 1).collect()
}

/// Whether one of the jumps lies at most two orders of the prediction before a sample.
fn after_a_jump(jumps: &[usize], k: usize) -> bool {
    let next = jumps.partition_point(|jump| *jump <= k);
    next > 0 && k - jumps[next - 1] <= 2 * ORDER
}

/// The longest run of equal samples, if it is no chance.
fn repeated(signals: &Signals) -> Option<Defect> {
    let output = &signals.output_m;
    let runs = output.chunk_by(|a, b| a == b);
    let starts = runs.scan(0, |end, run| {
        *end += run.len();
        Some((*end - run.len(), run.len()))
    });
    let moving = starts.filter(|(start, samples)| {
        let input = &signals.input_a[*start..start + samples];
        let changes = input.windows(2).filter(|pair| pair[0] != pair[1]);
        2 * changes.count() >= *samples
    });
    let (start, samples) = moving.max_by_key(|(_, samples)| *samples)?;
    let equal = output.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let others = equal.saturating_sub(samples) as f64;
    let ratio = (others / output.len() as f64).max(CHANCE);
    let chance = output.len() as f64 * ratio.powf(samples as f64);
    (samples >= MIN_REPEATED && chance < CHANCE).then(|| Defect::Repeated {
        time_s: start as f64 / signals.rate_hz,
        samples,
    })
}

/// The factor of a pattern in some errors, and what remains of them.
fn projection(errors: &[f64], pattern: &[f64]) -> (f64, f64) {
    let pairs = || errors.iter().zip(pattern);
    let product: f64 = pairs().map(|(e, p)| e * p).sum();
    let square: f64 = pairs().map(|(_, p)| p * p).sum();
    let factor = product / square;
    (factor, pairs().map(|(e, p)| (e - factor * p).powi(2)).sum())
}

/// The output at its largest or smallest value, if it stays there in several places.
fn clipped(signals: &Signals) -> Option<Defect> {
    let output = &signals.output_m;
    let limits = [f64::max, f64::min].map(|extreme| {
        let first = output.first().copied().unwrap_or(0.0);
        output.iter().copied().fold(first, extreme)
    });
    limits.into_iter().find_map(|value| {
        let places = plateaus(output, value);
        (places.len() >= MIN_CLIPPED_PEAKS).then(|| Defect::Clipped {
            time_s: places[0] as f64 / signals.rate_hz,
            value,
        })
    })
}

/// Where a signal has a value at least [`MIN_CLIPPED`] times in succession: the first index of each place.
fn plateaus(samples: &[f64], value: f64) -> Vec<usize> {
    let (mut places, mut length) = (Vec::new(), 0);
    for (k, sample) in samples.iter().enumerate() {
        length = if *sample == value { length + 1 } else { 0 };
        if length == MIN_CLIPPED {
            places.push(k + 1 - MIN_CLIPPED);
        }
    }
    places
}

/// Motion of the output at its ends, where its noise has the given standard deviation.
fn motion_at_ends(signals: &Signals, noise: f64) -> Vec<Defect> {
    let output = &signals.output_m;
    let count = END_SAMPLES * END_INTERVALS;
    if output.len() < 4 * count {
        return Vec::new();
    }
    let of = |samples: &[f64]| samples.chunks_exact(END_SAMPLES).map(slope).collect();
    let all: Vec<f64> = of(output);
    let rms = rms(&all);
    // The slope of n samples of noise has the variance 12 sigma^2/n^3.
    let limit = MOVING_SIGMAS * noise * (12.0 / (END_SAMPLES as f64).powi(3)).sqrt();
    let moving = |velocity: f64| velocity > limit && velocity > MOVING_RATIO * rms;
    let start = all[0].abs();
    let last: Vec<f64> = of(&output[output.len() - count..]);
    let end = self::rms(&last);
    let mut found = Vec::new();
    if moving(start) {
        found.push(Defect::MovingAtStart { ratio: start / rms });
    }
    if moving(end) {
        found.push(Defect::MovingAtEnd { ratio: end / rms });
    }
    found
}

fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    (squares / values.len() as f64).sqrt()
}

/// The slope per sample of the least-squares line.
fn slope(samples: &[f64]) -> f64 {
    let middle = (samples.len() - 1) as f64 / 2.0;
    let moments = samples.iter().enumerate();
    let product: f64 = moments.map(|(n, y)| (n as f64 - middle) * y).sum();
    let n = samples.len() as f64;
    product / (n * (n * n - 1.0) / 12.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 1000.0;

    /// 20 s of a mode of 30 Hz driven by a sweep, with 1 s of rest before and 4 s after, and noise of 1e-3.
    fn signals() -> Signals {
        let (w, zeta, step) = (std::f64::consts::TAU * 30.0, 0.02, 1.0 / RATE_HZ);
        let mut state = 7_u64;
        let mut noise = move || {
            let mut uniform = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        };
        let force = |n: usize| {
            let t = n as f64 / RATE_HZ - 1.0;
            let fade = (t / 1.0).min(20.0 - t).clamp(0.0, 1.0);
            fade * (std::f64::consts::TAU * (3.0 * t + 1.5 * t * t)).sin()
        };
        let input_a: Vec<f64> = (0..25_000).map(force).collect();
        let (mut x, mut v) = (0.0, 0.0);
        let output_m = input_a.iter().map(|u| {
            let position = x;
            // Semi-implicit Euler: any stable recursion of second order serves.
            v += step * (w * w * (u - x) - 2.0 * zeta * w * v);
            x += step * v;
            position + 1e-3 * noise()
        });
        Signals {
            rate_hz: RATE_HZ,
            output_m: output_m.collect(),
            input_a,
        }
    }

    fn spoiled(change: impl Fn(usize, f64) -> f64) -> Vec<Defect> {
        let mut signals = signals();
        let output = signals.output_m.iter().enumerate();
        signals.output_m = output.map(|(k, y)| change(k, *y)).collect();
        defects(&signals, false)
    }

    #[test]
    fn sound_record_has_no_defect() {
        assert_eq!(defects(&signals(), false), []);
    }

    #[test]
    fn spike_is_found_with_its_time_and_height() {
        for length in [1, 3] {
            let inside = |k: usize| (12_000..12_000 + length).contains(&k);
            let found = spoiled(|k, y| if inside(k) { y + 2.0 } else { y });
            let [Defect::Spike { time_s, height }] = found[..] else {
                panic!("{found:?}")
            };
            assert!(time_s == 12.0 && (height - 2.0).abs() < 0.1, "{found:?}");
        }
    }

    #[test]
    fn step_is_found_with_its_time_and_height() {
        let found = spoiled(|k, y| if k >= 15_000 { y - 0.5 } else { y });
        let [Defect::Step { time_s, height }] = found[..] else {
            panic!("{found:?}")
        };
        assert!(time_s == 15.0 && (height + 0.5).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn repeated_samples_are_found_with_their_number() {
        let sound = signals();
        let inside = |k: usize| (9_000..9_100).contains(&k);
        let found = spoiled(|k, y| if inside(k) { sound.output_m[9_000] } else { y });
        assert_eq!(
            found,
            [Defect::Repeated {
                time_s: 9.0,
                samples: 100
            }]
        );
    }

    #[test]
    fn clipped_output_is_found_with_its_limit() {
        let found = spoiled(|_, y| y.clamp(-3.0, 3.0));
        assert!(
            matches!(found[..], [Defect::Clipped { value, .. }] if value == 3.0),
            "{found:?}"
        );
    }

    #[test]
    fn record_that_begins_or_ends_in_motion_is_found() {
        let whole = signals();
        let cases = [(10_000..25_000, true), (0..10_000, false)];
        for (range, at_start) in cases {
            let found = defects(&whole.slice(range), false);
            let expected = |defect: &Defect| match defect {
                Defect::MovingAtStart { .. } => at_start,
                Defect::MovingAtEnd { .. } => !at_start,
                _ => false,
            };
            assert!(found.len() == 1 && found.iter().all(expected), "{found:?}");
        }
    }

    #[test]
    fn impulse_of_the_input_is_no_defect() {
        let mut signals = signals();
        signals.input_a.fill(0.0);
        signals.input_a[1000] = 1.0;
        let response = |k: usize| {
            let t = (k as f64 - 1000.0) / RATE_HZ;
            if t > 0.0 {
                (-4.0 * t).exp() * (188.0 * t).sin()
            } else {
                0.0
            }
        };
        signals.output_m = (0..25_000).map(response).collect();
        assert_eq!(defects(&signals, false), []);
    }
}
