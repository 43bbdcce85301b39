//! Harmonics in the output of a sweep: signs that the plant or a channel is not linear.
//!
//! A sweep excites one frequency at a time. A linear plant responds with this frequency and with the free vibrations of its modes, a
//! nonlinear one also with multiples of it. With the phase phi of the input, from the samples of a window of 12 periods,
//!
//! ```text
//! Y_k = 2 sum w(phi) y exp(-j k phi) dphi / sum w(phi) dphi         amplitude of the order k
//! ```
//!
//! A resonance changes the fundamental within a window, but by multiples of much less than its frequency: a Blackman-Harris window, with
//! side lobes of -92 dB from a third of an order on (F. J. Harris, *Proc. IEEE* 66, 51, 1978), leaves none of it at the other orders. The
//! orders beside a harmonic tell the noise there, and a free vibration, which passes all orders.
//!
//! Friction, play, hysteresis, limits and stiffness that depends on the amplitude are symmetric and have the third harmonic first; what
//! differs between the directions has the second.

use core::f64::consts::TAU;
use std::ops::Range;

use nalgebra::Complex;
use realfft::RealFftPlanner;
use serde::Serialize;

use crate::Signals;
use crate::mean::mean;
use bench_base::units::hz_text;

/// Periods of the sweep in a window.
const PERIODS: f64 = 12.0;
const WINDOW_RAD: f64 = PERIODS * TAU;
/// Orders are counted in quarters, three bins of a window: up to 3 1/2.
const QUARTERS: usize = 15;
const FUNDAMENTAL: usize = 4;
/// The orders that tell the noise of a harmonic, in quarters from it.
const BESIDE: [isize; 4] = [-2, -1, 1, 2];
/// A harmonic counts where it exceeds the largest of these by this factor. Noise of equal power does so in 1 of 4845 windows: with
/// exponential squares, E[exp(-16 max)] = 4 B(17, 4).
const MIN_RATIO_TO_NOISE: f64 = 4.0;
/// A harmonic is found if it counts in this many windows, and in this part of all. Noise does so in less than one of 10^5 records: most
/// likely in one of 250 windows, which overlap by half, so that it has to in 3 of 125 independent ones: C(125, 3)/4845^3 = 3e-6.
const MIN_WINDOWS: usize = 5;
const MIN_PART: f64 = 0.02;
/// The plant responds to a harmonic of the input as well, in proportion to |H(k f)/H(f)|: up to 100 at a resonance of a damping ratio of
/// 0.5 %. One that is smaller than this part of that of the output does not cause it.
const MAX_INPUT_RATIO: f64 = 0.01;
/// Harmonics are not looked for where those of the input are above this part of the fundamental, as those of a clipped input. They turn the
/// phase of the fundamental by as many radians. The harmonics that this adds to the output of a linear plant, together with those that the
/// plant passes on, are at most half of [`LARGE_RATIO`].
const MAX_INPUT_HARMONIC: f64 = 0.003;
/// A larger harmonic shows that no linear model describes the response: q + c q^3 changes the fundamental by three times as much as it has
/// of the third harmonic (3/4 and 1/4 of c), so by 3 %, which a fit does not take for noise.
const LARGE_RATIO: f64 = 0.01;
/// The input is a sweep where its envelope exceeds this ratio of the largest.
const ACTIVE_RATIO: f64 = 0.1;
/// Largest step of the phase from sample to sample: the highest order lies below the Nyquist frequency.
const MAX_STEP_RAD: f64 = TAU / 2.0 / 3.5;

/// A harmonic of the excitation in the output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SweepHarmonic {
    /// The multiple of the frequency: 2 or 3.
    pub order: u32,
    /// RMS value of the harmonic over that of the fundamental, where the harmonic exceeds the noise.
    pub ratio: f64,
    /// The lowest and the highest frequency of the sweep there, in hertz.
    pub band_hz: (f64, f64),
}

impl SweepHarmonic {
    /// Whether it is so large that a linear model does not describe the response.
    pub fn is_large(&self) -> bool {
        self.ratio > LARGE_RATIO
    }

    /// What was found, and what it means.
    pub fn description(&self) -> String {
        let name = if self.order == 2 { "second" } else { "third" };
        let (low_hz, high_hz) = self.band_hz;
        format!(
            "the output has the {name} harmonic of the sweep, with {:.2} % of the fundamental, from {} to {} Hz: the plant or a channel is nonlinear",
            100.0 * self.ratio,
            hz_text(low_hz, 1),
            hz_text(high_hz, 1)
        )
    }

    /// The harmonic of an order, if it is found in enough windows.
    fn of(order: usize, windows: &[Window]) -> Option<SweepHarmonic> {
        let has_harmonic = |window: &&Window| window.has_harmonic(order);
        let found: Vec<&Window> = windows.iter().filter(has_harmonic).collect();
        let is_enough =
            found.len() >= MIN_WINDOWS && found.len() as f64 >= MIN_PART * windows.len() as f64;
        if !is_enough {
            return None;
        }
        let power = |quarter: usize| -> f64 {
            let squares = found.iter().map(|window| window.output[quarter].powi(2));
            squares.sum()
        };
        let frequencies = found.iter().map(|window| window.frequency_hz);
        Some(SweepHarmonic {
            order: order as u32,
            ratio: (power(FUNDAMENTAL * order) / power(FUNDAMENTAL)).sqrt(),
            band_hz: (
                frequencies.clone().fold(f64::INFINITY, f64::min),
                frequencies.fold(0.0, f64::max),
            ),
        })
    }
}

/// The harmonics in the output of a sweep; none with another excitation.
pub(super) fn harmonics(signals: &Signals) -> Vec<SweepHarmonic> {
    let sweep = Sweep::new(&signals.input);
    let windows: Vec<Window> = sweep
        .windows()
        .into_iter()
        .map(|samples| Window {
            frequency_hz: PERIODS * signals.rate_hz / samples.len() as f64,
            input: sweep.orders(&signals.input, &samples),
            output: sweep.orders(&signals.output, &samples),
        })
        .collect();
    let orders = [2, 3].into_iter();
    orders
        .filter_map(|order| SweepHarmonic::of(order, &windows))
        .collect()
}

/// Amplitudes of the orders in a window, in quarters.
struct Window {
    frequency_hz: f64,
    input: [f64; QUARTERS],
    output: [f64; QUARTERS],
}

impl Window {
    /// Whether the output has a harmonic that exceeds its noise and is not due to the input.
    fn has_harmonic(&self, order: usize) -> bool {
        let ratio = |levels: &[f64; QUARTERS]| levels[FUNDAMENTAL * order] / levels[FUNDAMENTAL];
        let of_input = ratio(&self.input);
        let is_of_input = of_input > MAX_INPUT_HARMONIC
            || exceeds_noise(&self.input, order)
                && of_input > MAX_INPUT_RATIO * ratio(&self.output);
        exceeds_noise(&self.output, order) && !is_of_input
    }
}

fn exceeds_noise(levels: &[f64; QUARTERS], order: usize) -> bool {
    let harmonic = FUNDAMENTAL * order;
    let beside = BESIDE.map(|quarters| levels[harmonic.saturating_add_signed(quarters)]);
    let noise = beside.into_iter().fold(0.0, f64::max);
    levels[harmonic] > MIN_RATIO_TO_NOISE * noise
}

/// The phase of an input.
struct Sweep {
    /// In radians, rising within each run.
    phase_rad: Vec<f64>,
    /// Samples between which the phase rises steadily; none is empty.
    runs: Vec<Range<usize>>,
}

impl Sweep {
    fn new(input: &[f64]) -> Sweep {
        let analytic = analytic(input);
        let largest = analytic.iter().map(|a| a.norm()).fold(0.0, f64::max);
        let mut sweep = Sweep {
            phase_rad: vec![0.0; analytic.len()],
            runs: Vec::new(),
        };
        let mut begin = 0;
        for k in 1..analytic.len() {
            let step = (analytic[k] * analytic[k - 1].conj()).arg();
            sweep.phase_rad[k] = sweep.phase_rad[k - 1] + step;
            let is_active = analytic[k].norm() > ACTIVE_RATIO * largest;
            if !(is_active && step > 0.0 && step < MAX_STEP_RAD) {
                sweep.runs.push(begin..k);
                begin = k;
            }
        }
        if begin < analytic.len() {
            sweep.runs.push(begin..analytic.len());
        }
        sweep
    }

    /// Windows that overlap by half.
    fn windows(&self) -> Vec<Range<usize>> {
        let mut windows = Vec::new();
        for run in &self.runs {
            let mut begin = run.start;
            while let Some(end) = self.after(begin, run, WINDOW_RAD) {
                windows.push(begin..end);
                let Some(next) = self.after(begin, run, 0.5 * WINDOW_RAD) else {
                    break;
                };
                begin = next;
            }
        }
        windows
    }

    /// The first sample of a run whose phase is that of `begin` and an angle, or more.
    fn after(&self, begin: usize, run: &Range<usize>, angle_rad: f64) -> Option<usize> {
        let end_rad = self.phase_rad[begin] + angle_rad;
        let count = self.phase_rad[begin..run.end].partition_point(|phase| *phase < end_rad);
        (begin + count < run.end).then_some(begin + count)
    }

    /// The amplitudes of the orders of a signal in a window, after which there is at least one sample.
    fn orders(&self, signal: &[f64], window: &Range<usize>) -> [f64; QUARTERS] {
        let mean = mean(&signal[window.clone()]);
        let begin_rad = self.phase_rad[window.start];
        let mut sums = [Complex::new(0.0, 0.0); QUARTERS];
        let mut weights = 0.0;
        for k in window.clone() {
            let phase_rad = self.phase_rad[k] - begin_rad;
            let step_rad = self.phase_rad[k + 1] - self.phase_rad[k];
            let weight = blackman_harris(phase_rad / WINDOW_RAD) * step_rad;
            weights += weight;
            let turn = Complex::from_polar(1.0, -phase_rad / FUNDAMENTAL as f64);
            let mut turned = Complex::from(weight * (signal[k] - mean));
            for sum in &mut sums {
                *sum += turned;
                turned *= turn;
            }
        }
        sums.map(|sum| 2.0 * sum.norm() / weights)
    }
}

/// The window of four terms with the lowest side lobes, from 0 to 1.
fn blackman_harris(place: f64) -> f64 {
    let c = (TAU * place).cos();
    let (second, third) = (2.0 * c * c - 1.0, (4.0 * c * c - 3.0) * c);
    0.35875 - 0.48829 * c + 0.14128 * second - 0.01168 * third
}

/// A signal with its Hilbert transform as the imaginary part, from its first value.
fn analytic(signal: &[f64]) -> Vec<Complex<f64>> {
    let Some(first) = signal.first() else {
        return Vec::new();
    };
    let real: Vec<f64> = signal.iter().map(|value| value - first).collect();
    let mut planner = RealFftPlanner::new();
    let forward = planner.plan_fft_forward(real.len());
    let inverse = planner.plan_fft_inverse(real.len());
    let mut spectrum = forward.make_output_vec();
    let mut imaginary = inverse.make_output_vec();
    // The buffers have the planned lengths, and the first and the last bin of the inverse no imaginary part: there is no other error.
    let transformed = forward.process(&mut real.clone(), &mut spectrum).is_ok();
    for bin in &mut spectrum {
        *bin *= Complex::new(0.0, -1.0);
    }
    if let Some(mean) = spectrum.first_mut() {
        *mean = Complex::new(0.0, 0.0);
    }
    if real.len().is_multiple_of(2)
        && let Some(nyquist) = spectrum.last_mut()
    {
        *nyquist = Complex::new(0.0, 0.0);
    }
    if !transformed || inverse.process(&mut spectrum, &mut imaginary).is_err() {
        return Vec::new();
    }
    let scale = 1.0 / real.len() as f64;
    let pairs = real.iter().zip(&imaginary);
    pairs
        .map(|(re, im)| Complex::new(*re, im * scale))
        .collect()
}

#[cfg(test)]
mod tests;
