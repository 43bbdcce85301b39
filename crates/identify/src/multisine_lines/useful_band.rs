//! The useful band of a held sequence, such as a PRBS.
//!
//! A sequence with the clock rate fc, each value of which is held for d samples, has the spectrum of its values times that of the hold,
//!
//! ```text
//! |U(f)| = |S(f)| |sin(pi f/fc)/(d sin(pi f/rate))|        fc = rate/d
//! ```
//!
//! with zeros at the multiples of fc. |S| of a PRBS is constant. Beyond the first zero the power is at most a twentieth of that at low
//! frequencies, and around the zero the response is noise. The useful band ends where the power has fallen to a half: at 0.5 fc with d =
//! 2, 0.44 fc with a large d (K. Godfrey, Perturbation Signals for System Identification, 1993, section 1.3).
//!
//! An input is such a sequence if the amplitudes of nine in ten of its lines up to 0.8 fc have this shape within 20 %, those within 5 % of
//! fc are below a tenth of the level at low frequencies (by the shape 0.08), and those beyond are below a half of it. Up to 0.8 fc the
//! shape falls to a quarter: lines of equal amplitudes, or of a shape that rises, or of random noise, differ by more, and those of a shape
//! that falls in the same ratio do not reach zero.

use super::excited::excited;
use super::lines::{Repetition, lines, mean};
use crate::Signals;

/// The shape is compared up to this ratio of fc.
const COMPARED: f64 = 0.8;
/// There are lines below this ratio of fc.
const LOWEST: f64 = 0.2;
/// Lines this close to fc, as a ratio of it, are near the zero.
const NEAR_ZERO: f64 = 0.05;
/// Largest amplitude near the zero, over that at low frequencies.
const ZERO: f64 = 0.1;
/// Largest amplitude beyond the zero: that of the shape is 1/3 with d = 3.
const SIDE_LOBE: f64 = 0.5;
/// Smallest number of compared lines.
const MIN_LINES: usize = 16;
/// Part of the lines that may have another shape.
const OUTLIERS: f64 = 0.1;
/// Largest difference of the others from the shape, in ln |U|.
const TOLERANCE: f64 = 0.2;
/// The band ends at this ratio of the power of the hold.
const USEFUL_POWER: f64 = 0.5;

/// The last useful line in hertz of a periodic input that is a held sequence; `None` of another input.
pub(crate) fn useful_limit_hz(signals: &Signals, repetition: Repetition) -> Option<f64> {
    let all_hz = (0.0, 0.5 * signals.rate_hz);
    let lines = lines(signals, all_hz, repetition).ok()?;
    let excited: Vec<ExcitedLine> = excited(&lines)
        .map(|line| ExcitedLine {
            turns: line.number as f64 / repetition.period as f64,
            amplitude: mean(&line.input).norm(),
        })
        .collect();
    let hold = hold_of(&excited)?;
    let useful = excited.iter().rev().find(|line| {
        line.turns * hold < 1.0 && hold_gain(line.turns, hold).powi(2) >= USEFUL_POWER
    })?;
    Some(useful.turns * signals.rate_hz)
}

/// A line of the input.
struct ExcitedLine {
    /// Its frequency in cycles per sample.
    turns: f64,
    amplitude: f64,
}

/// |sin(pi f/fc)/(d sin(pi f/rate))| at a frequency above 0 in cycles per sample, of a hold of d samples.
fn hold_gain(turns: f64, hold: f64) -> f64 {
    let half_angle = std::f64::consts::PI * turns;
    (libm::sin(half_angle * hold) / (hold * libm::sin(half_angle))).abs()
}

/// The hold of at least two samples whose shape the lines of rising frequency have.
fn hold_of(lines: &[ExcitedLine]) -> Option<f64> {
    let (first, last) = (lines.first()?, lines.last()?);
    let mut best: Option<(f64, f64)> = None;
    for samples in 2_u32.. {
        let hold = f64::from(samples);
        let compared = lines.partition_point(|line| line.turns * hold <= COMPARED);
        if compared < MIN_LINES || first.turns * hold > LOWEST {
            break;
        }
        if last.turns * hold < 1.0 - NEAR_ZERO {
            continue;
        }
        let (level, difference) = level_and_difference(&lines[..compared], hold);
        let is_best = best.is_none_or(|(least, _)| difference < least);
        if is_best && falls_to_zero(&lines[compared..], hold, level) {
            best = Some((difference, hold));
        }
    }
    best.filter(|(difference, _)| *difference < TOLERANCE)
        .map(|(_, hold)| hold)
}

/// The amplitude at low frequencies of lines that have the shape of a hold, and their largest difference from it in ln |U|, without the
/// outliers.
fn level_and_difference(lines: &[ExcitedLine], hold: f64) -> (f64, f64) {
    let ratio = |line: &ExcitedLine| libm::log(line.amplitude / hold_gain(line.turns, hold));
    let mut ratios: Vec<f64> = lines.iter().map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    let mut differences: Vec<f64> = ratios.iter().map(|ratio| (ratio - median).abs()).collect();
    differences.sort_by(f64::total_cmp);
    let outliers = (OUTLIERS * differences.len() as f64) as usize;
    (
        libm::exp(median),
        differences[differences.len() - 1 - outliers],
    )
}

/// Whether the lines above those that are compared fall to zero at fc, and stay small beyond.
fn falls_to_zero(above: &[ExcitedLine], hold: f64, level: f64) -> bool {
    above.iter().all(|line| {
        let over_clock = line.turns * hold;
        let limit = if over_clock < 1.0 - NEAR_ZERO {
            1.0
        } else if over_clock <= 1.0 + NEAR_ZERO {
            ZERO
        } else {
            SIDE_LOBE
        };
        line.amplitude <= limit * level
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 1000.0;
    const PERIODS: usize = 6;

    /// Periods of a signal as input; the output is of no importance.
    fn limit_hz(period: &[f64]) -> Option<f64> {
        let input: Vec<f64> = (0..PERIODS * period.len())
            .map(|n| period[n % period.len()])
            .collect();
        let output = input.iter().map(|u| 2.0 * u).collect();
        let signals = Signals {
            rate_hz: RATE_HZ,
            input,
            output,
        };
        let repetition = Repetition {
            period: period.len(),
            skip: 0,
        };
        useful_limit_hz(&signals, repetition)
    }

    /// A sequence with each value repeated.
    fn held(values: &[f64], samples: usize) -> Vec<f64> {
        let repeated = values.iter().map(|value| vec![*value; samples]);
        repeated.flatten().collect()
    }

    /// The sequence of a shift register of x^9 + x^5 + 1: 511 values.
    fn prbs() -> Vec<f64> {
        let mut cells = 1_u32;
        let next = |_| {
            let bit = ((cells >> 8) ^ (cells >> 4)) & 1;
            cells = ((cells << 1) | bit) & 0x1ff;
            if bit == 1 { 1.0 } else { -1.0 }
        };
        (0..511).map(next).collect()
    }

    /// Numbers between -1 and 1.
    fn random(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let next = |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        (0..count).map(next).collect()
    }

    /// Lines with amplitudes over 1000 samples.
    fn multisine(lines: impl Iterator<Item = usize>, amplitude: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut period = vec![0.0; 1000];
        for (j, line) in lines.enumerate() {
            for (n, u) in period.iter_mut().enumerate() {
                let turns = (n * line % 1000) as f64 / 1000.0;
                let phase = std::f64::consts::TAU * (turns + 0.37 * (j * j) as f64);
                *u += amplitude(line as f64) * libm::cos(phase);
            }
        }
        period
    }

    /// Half of the power: sin^2(2 x)/(2 sin x)^2 = cos^2 x = 1/2 at rate/4, 0.5 fc, for 2 samples; cos x cos 2 x = sqrt(1/2) of 4
    /// samples at 0.4554 fc; sin(10 x)/(10 sin x) of 10 samples at 0.4449 fc. The lines are 1/511 fc apart.
    #[test]
    fn held_binary_sequence_is_useful_up_to_half_of_its_power() {
        for (samples, ratio) in [(2, 0.5), (4, 0.4554), (10, 0.4449)] {
            let clock_hz = RATE_HZ / samples as f64;
            let found = limit_hz(&held(&prbs(), samples)).expect("a held sequence") / clock_hz;
            assert!(
                (ratio - 1.0 / 511.0..=ratio + 1e-4).contains(&found),
                "{samples}: {found}"
            );
        }
    }

    /// A measured current lags: 1/(1 + j f/fc) falls to 0.78 at 0.8 fc.
    #[test]
    fn held_sequence_with_a_lag_has_the_shape_of_a_hold() {
        let pole = libm::exp(-std::f64::consts::TAU / 4.0);
        let period = held(&prbs(), 4);
        let mut current = 0.0;
        let mut lagged = Vec::new();
        for u in period.iter().chain(&period) {
            current = pole * current + (1.0 - pole) * u;
            lagged.push(current);
        }
        let found = limit_hz(&lagged[period.len()..]).expect("a held sequence");
        assert!((112.0..114.0).contains(&found), "{found}");
    }

    #[test]
    fn other_inputs_are_no_held_sequence() {
        // A PRBS without hold has no zero below half of the rate; lines of random noise are irregular, held or not.
        assert_eq!(limit_hz(&prbs()), None);
        assert_eq!(limit_hz(&random(1000)), None);
        assert_eq!(limit_hz(&held(&random(500), 4)), None);
        let mut impulse = vec![0.0; 1000];
        impulse[3] = 1.0;
        assert_eq!(limit_hz(&impulse), None);
    }

    /// Equal amplitudes; 50:1 falling, rising, and with a minimum in the middle; all lines and odd lines.
    #[test]
    fn multisines_of_any_shape_are_no_held_sequence() {
        let shapes: [fn(f64) -> f64; 5] = [
            |_| 1.0,
            |hz| (5.0 / hz).powf(1.06),
            |hz| (hz / 200.0).powf(1.06),
            |hz| 0.02 + 0.98 * ((hz - 100.0) / 100.0).powi(2),
            |hz| libm::exp(-libm::log(50.0) * hz / 200.0),
        ];
        for (k, shape) in shapes.into_iter().enumerate() {
            for step in [1, 2, 4] {
                let period = multisine((5..=200).step_by(step), shape);
                assert_eq!(limit_hz(&period), None, "shape {k}, every {step}");
            }
        }
        assert_eq!(limit_hz(&multisine(1..500, |_| 1.0)), None);
    }
}
