//! Distortion told apart from noise, by the lines that a periodic excitation leaves out.
//!
//! An excitation of odd lines alone, some of them left out, makes a plant answer
//!
//! ```text
//!  at its own lines         the linear response, odd distortion, noise
//!  at odd lines left out                         odd distortion, noise      sums of an odd number of odd lines
//!  at even lines                                even distortion, noise      sums of an even number of odd lines
//! ```
//!
//! Distortion is alike in every period and noise is not. With Y_p the spectrum of period p of P, m their mean and s^2 their scatter,
//!
//! ```text
//!  m = mean of Y_p     s^2 = sum |Y_p - m|^2 / (P - 1)     E |m|^2 = |distortion|^2 + s^2/P
//! ```
//!
//! so |m|^2 - s^2/P estimates the power of distortion without bias, and of noise alone F = P |m|^2 / s^2 has Fisher's
//! distribution of 2 and 2 (P - 1) degrees of freedom, whose tail is exact and needs no knowledge of the noise:
//!
//! ```text
//!  P(F beyond) = (1 + F/(P - 1))^-(P - 1)       - sum of ln P over M lines: Gamma distributed, shape M
//! ```
//!
//! (Fisher's method; the noise may differ from line to line.) Levels are squares of RMS values in m^2: 2 |Y|^2/N^2 of N samples a
//! period. Pintelon, Schoukens, System Identification, 2nd ed., section 4.3: the fast method, of one realization of the phases.
//!
//! What the surroundings do at exactly a line (mains, with periods of whole seconds) is alike in every period as well, and counts as
//! distortion; in the probability one line weighs no more than ln(level) does.

use super::periodic::{Line, ROUNDING, Repetition, excited, lines, mean, variance_of_mean};
use crate::identify::{IdentifyError, Signals};

/// A line is left out whose input is below this part of the largest: of an excited line of a hundredth, a linear plant then
/// answers with a thousandth of its amplitude.
const QUIET_RATIO: f64 = 1e-5;
/// Lines of a kind that are averaged around a frequency.
const AROUND: usize = 4;

/// One line of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineLevel {
    /// Its frequency in hertz.
    pub frequency_hz: f64,
    /// Square of the RMS of the mean input in A^2.
    pub input_a2: f64,
    /// Square of the RMS of the mean of all periods in m^2.
    pub power_m2: f64,
    /// Square of the RMS of the noise in m^2, of one period.
    pub noise_m2: f64,
    /// - ln of the probability that noise alone gives a mean as large.
    pub surprise: f64,
}

/// All lines of a band, by what they show.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    /// Those that were excited, all of them odd.
    pub excited: Vec<LineLevel>,
    /// Odd ones that were left out.
    pub odd: Vec<LineLevel>,
    /// Even ones.
    pub even: Vec<LineLevel>,
    /// Periods that were averaged.
    pub periods: usize,
}

/// The lines of `band_hz`; none if there is no line that tells: none left out, or excited even ones.
///
/// # Errors
/// When the signals, the band or the periods allow no estimate: see [`IdentifyError`].
pub fn harmonics(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
) -> Result<Option<Harmonics>, IdentifyError> {
    let lines = lines(signals, band_hz, repetition)?;
    let scale = Scale::of(&lines, signals.rate_hz, repetition.period);
    let levels =
        |of: &mut dyn Iterator<Item = &Line>| of.map(|line| scale.level(line)).collect::<Vec<_>>();
    let left_out = |parity: usize| lines.iter().filter(move |line| line.number % 2 == parity);
    let quiet = |line: &&Line| mean(&line.input).norm() <= QUIET_RATIO * scale.largest_input;
    let found = Harmonics {
        excited: levels(&mut excited(&lines)),
        odd: levels(&mut left_out(1).filter(quiet)),
        even: levels(&mut left_out(0).filter(quiet)),
        periods: scale.periods,
    };
    let only_odd = excited(&lines).all(|line| line.number % 2 == 1);
    let tells = only_odd && !found.excited.is_empty() && found.odd.len() + found.even.len() > 0;
    Ok(tells.then_some(found))
}

/// From sums over a period to levels.
struct Scale {
    line_hz: f64,
    /// (sqrt(2)/N)^2.
    square: f64,
    periods: usize,
    largest_input: f64,
    /// Power below which a scatter is rounding.
    rounding: f64,
}

impl Scale {
    fn of(lines: &[Line], rate_hz: f64, period: usize) -> Scale {
        let largest = |of: fn(&Line) -> f64| lines.iter().map(of).fold(0.0, f64::max);
        let largest_output = largest(|line| mean(&line.output).norm());
        Scale {
            line_hz: rate_hz / period as f64,
            square: 2.0 / (period as f64 * period as f64),
            periods: lines.first().map_or(0, |line| line.output.len()),
            largest_input: largest(|line| mean(&line.input).norm()),
            rounding: (ROUNDING * largest_output).powi(2).max(f64::MIN_POSITIVE),
        }
    }

    fn level(&self, line: &Line) -> LineLevel {
        let (power, of_mean) = (
            mean(&line.output).norm_sqr(),
            variance_of_mean(&line.output),
        );
        let freedom = self.periods as f64 - 1.0;
        LineLevel {
            frequency_hz: line.number as f64 * self.line_hz,
            input_a2: self.square * mean(&line.input).norm_sqr(),
            power_m2: self.square * power,
            noise_m2: self.square * self.periods as f64 * of_mean,
            surprise: freedom * libm::log1p(power / (freedom * (of_mean + self.rounding))),
        }
    }
}

impl Harmonics {
    /// What a line answers beyond noise, in m^2, without bias: below zero now and then.
    pub fn beyond_noise_m2(&self, level: &LineLevel) -> f64 {
        level.power_m2 - level.noise_m2 / self.periods as f64
    }

    /// The same around a frequency: the mean of the nearest of some lines, which rise; 0 where there are none.
    pub fn around_m2(&self, lines: &[LineLevel], frequency_hz: f64) -> f64 {
        let above = lines.partition_point(|line| line.frequency_hz < frequency_hz);
        let first = above
            .saturating_sub(AROUND / 2)
            .min(lines.len().saturating_sub(AROUND));
        let near = &lines[first..(first + AROUND).min(lines.len())];
        near.iter()
            .map(|line| self.beyond_noise_m2(line))
            .sum::<f64>()
            / near.len().max(1) as f64
    }
}

/// The probability that noise alone gives lines as far beyond it: exp(-x) sum of x^j/j! for j below their number, x their sum of
/// surprises. 1 without lines.
pub fn by_noise_alone(lines: &[LineLevel]) -> f64 {
    let x: f64 = lines.iter().map(|line| line.surprise).sum();
    if lines.is_empty() || x <= 0.0 {
        return 1.0;
    }
    if !x.is_finite() {
        return 0.0;
    }
    let term = |j: usize| libm::exp(j as f64 * libm::log(x) - x - libm::lgamma(j as f64 + 1.0));
    (0..lines.len()).map(term).sum::<f64>().min(1.0)
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    const PERIOD: usize = 500;
    /// Sums of three lines stay below half of the rate, 250, so that none is folded back.
    const LAST: usize = 79;
    /// The filter behind the distortion: 1/(1 - (f/60)^2 + 0.1 i f/60), lines being hertz.
    fn gain(line: f64) -> (f64, f64) {
        let (re, im) = (1.0 - (line / 60.0).powi(2), 0.1 * line / 60.0);
        let square = re * re + im * im;
        (re / square, -im / square)
    }

    fn uniform(random: &mut Pcg64) -> f64 {
        ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// By Box and Muller.
    fn normal(random: &mut Pcg64) -> f64 {
        let radius = (-2.0 * uniform(random).ln()).sqrt();
        radius * (std::f64::consts::TAU * uniform(random)).cos()
    }

    /// Odd lines up to [`LAST`], the third of each four left out.
    fn excited_lines() -> Vec<usize> {
        (1..=LAST)
            .step_by(2)
            .enumerate()
            .filter(|(place, _)| place % 4 != 2)
            .map(|(_, k)| k)
            .collect()
    }

    /// A record of `periods` of y = filter(u + a u^2 + b u^3), u of amplitude 1 a line, with white noise on every sample.
    fn record(seed: u64, (a, b): (f64, f64), noise_m: f64, periods: usize) -> Signals {
        let mut random = Pcg64::seed_from_u64(seed);
        let lines: Vec<(usize, f64)> = excited_lines()
            .into_iter()
            .map(|k| (k, std::f64::consts::TAU * uniform(&mut random)))
            .collect();
        let turn = std::f64::consts::TAU / PERIOD as f64;
        let input: Vec<f64> = (0..PERIOD)
            .map(|n| {
                lines
                    .iter()
                    .map(|(k, phase)| (turn * (k * n % PERIOD) as f64 + phase).cos())
                    .sum()
            })
            .collect();
        let mut static_part: Vec<f64> = input
            .iter()
            .map(|u| u + a * u * u + b * u * u * u)
            .collect();
        let fft = crate::identify::spectrum::RealFft::new(PERIOD);
        let spectrum = fft.transform(&mut static_part);
        let output: Vec<f64> = (0..PERIOD)
            .map(|n| {
                let of = |k: usize| {
                    let (re, im) = gain(k as f64);
                    let (s, c) = (turn * (k * n % PERIOD) as f64).sin_cos();
                    let y = spectrum[k] * nalgebra::Complex::new(re, im);
                    2.0 / PERIOD as f64 * (y.re * c - y.im * s)
                };
                (1..PERIOD / 2).map(of).sum()
            })
            .collect();
        let repeated = |one: &[f64]| {
            one.iter()
                .copied()
                .cycle()
                .take(periods * PERIOD)
                .collect::<Vec<f64>>()
        };
        let output_m = repeated(&output)
            .into_iter()
            .map(|y| y + noise_m * normal(&mut random))
            .collect();
        Signals {
            rate_hz: PERIOD as f64,
            input_a: repeated(&input),
            output_m,
        }
    }

    fn shown(signals: &Signals) -> Harmonics {
        let repetition = Repetition {
            period: PERIOD,
            skip: 0,
        };
        harmonics(signals, (1.0, LAST as f64), repetition)
            .unwrap()
            .expect("lines left out")
    }

    /// E |Y|^2 as a square of an RMS at a line, of products of `order` lines: the sum over all unordered choices of signed lines
    /// that add up to it, each of a phase of its own, of (their orders x coefficient x amplitudes)^2.
    fn by_products(line: usize, order: usize, coefficient: f64) -> f64 {
        let signed: Vec<i64> = excited_lines()
            .iter()
            .flat_map(|k| [-(*k as i64), *k as i64])
            .collect();
        let (target, half) = (line as i64, 0.5f64);
        let mut sum = 0.0;
        for (i, a) in signed.iter().enumerate() {
            for (j, b) in signed.iter().enumerate().skip(i) {
                if order == 2 {
                    let orders = if i == j { 1.0 } else { 2.0 };
                    sum += if a + b == target {
                        (orders * half * half * coefficient).powi(2)
                    } else {
                        0.0
                    };
                    continue;
                }
                for (l, c) in signed.iter().enumerate().skip(j) {
                    let orders = match (i == j, j == l) {
                        (true, true) => 1.0,
                        (false, false) => 6.0,
                        _ => 3.0,
                    };
                    sum += if a + b + c == target {
                        (orders * half.powi(3) * coefficient).powi(2)
                    } else {
                        0.0
                    };
                }
            }
        }
        let (re, im) = gain(line as f64);
        // A complex amplitude C is an RMS of sqrt(2) |C|.
        2.0 * sum * (re * re + im * im)
    }

    #[test]
    fn second_and_third_order_products_come_out_by_their_closed_form_and_each_at_its_own_lines() {
        let (a, b) = (1e-3, 2e-5);
        let (mut odd, mut even) = (0.0, 0.0);
        let seeds = 300;
        for seed in 0..seeds {
            let harmonics = shown(&record(seed, (a, b), 1e-3, 6));
            let sum = |lines: &[LineLevel]| {
                lines
                    .iter()
                    .map(|l| harmonics.beyond_noise_m2(l))
                    .sum::<f64>()
            };
            (odd, even) = (odd + sum(&harmonics.odd), even + sum(&harmonics.even));
        }
        let expected_odd: f64 = (1..=LAST)
            .step_by(2)
            .filter(|k| !excited_lines().contains(k))
            .map(|k| by_products(k, 3, b))
            .sum();
        let expected_even: f64 = (2..=LAST).step_by(2).map(|k| by_products(k, 2, a)).sum();
        // A line's power is that of a sum of many phases, its sigma its mean, and that of all lines no larger were they one: 1/sqrt(300) =
        // 5.8 %, of which three.
        for (name, found, expected) in [("odd", odd, expected_odd), ("even", even, expected_even)] {
            let ratio = found / f64::from(seeds as u32) / expected;
            assert!((0.827..1.173).contains(&ratio), "{name}: {ratio}");
        }
    }

    #[test]
    fn even_distortion_alone_shows_at_even_lines_and_odd_at_odd_ones() {
        for (terms, odd, even) in [
            ((1e-3, 0.0), false, true),
            ((0.0, 2e-5), true, false),
            ((1e-3, 2e-5), true, true),
        ] {
            let harmonics = shown(&record(4, terms, 1e-4, 6));
            let (by_odd, by_even) = (
                by_noise_alone(&harmonics.odd),
                by_noise_alone(&harmonics.even),
            );
            // Found by far; where it is not, noise explains it: once in a thousand it would not.
            assert_eq!(by_odd < 1e-9, odd, "{terms:?}: {by_odd}");
            assert_eq!(by_even < 1e-9, even, "{terms:?}: {by_even}");
            assert!(
                (by_odd > 1e-3) != odd && (by_even > 1e-3) != even,
                "{terms:?}: {by_odd} {by_even}"
            );
        }
    }

    #[test]
    fn noise_alone_is_taken_for_distortion_as_often_as_is_said() {
        let seeds = 200;
        let (mut below, mut level) = ([0; 2], 0.0);
        for seed in 0..seeds {
            let harmonics = shown(&record(1000 + seed, (0.0, 0.0), 0.01, 6));
            for lines in [&harmonics.odd, &harmonics.even] {
                let probability = by_noise_alone(lines);
                below[0] += u32::from(probability < 0.1);
                below[1] += u32::from(probability < 1e-3);
            }
            let high: Vec<f64> = harmonics
                .even
                .iter()
                .filter(|l| l.frequency_hz > 20.0)
                .map(|line| line.noise_m2)
                .collect();
            level += high.iter().sum::<f64>() / high.len() as f64;
        }
        // 400 probabilities: 40 below 0.1, of which sigma is 6; three of these. Below 0.001 are 0.4; five and more come once in
        // 16,000 times.
        assert!((22..=58).contains(&below[0]) && below[1] < 5, "{below:?}");
        // White noise of variance 1e-4 a sample is 2 x 1e-4/500 a line; 200 seeds x 29 lines x 5 degrees: 0.6 %, three of them. What is
        // taken off as drift, from 11 samples of noise, adds 500 x 2/11/(2 pi k)^2: below 0.6 % from line 20 on, 0.2 % on average.
        let ratio = level / f64::from(seeds as u32) / (2.0 * 1e-4 / PERIOD as f64);
        assert!((0.98..1.02).contains(&ratio), "{ratio}");
    }

    #[test]
    fn lines_that_the_input_does_not_leave_quiet_do_not_count_and_without_any_there_is_no_answer() {
        let mut signals = record(1, (0.0, 0.0), 1e-3, 6);
        let all = shown(&signals);
        let (left_out, turn) = (5.0, std::f64::consts::TAU / PERIOD as f64);
        for (n, u) in signals.input_a.iter_mut().enumerate() {
            *u += 1e-3 * (turn * left_out * n as f64).cos();
        }
        let fewer = shown(&signals);
        assert_eq!(
            (fewer.odd.len(), fewer.even.len()),
            (all.odd.len() - 1, all.even.len())
        );
        assert!(fewer.odd.iter().all(|line| line.frequency_hz != left_out));
        // Every line excited: a pulse.
        for (n, u) in signals.input_a.iter_mut().enumerate() {
            *u = f64::from(u8::from(n % PERIOD == 0));
        }
        let repetition = Repetition {
            period: PERIOD,
            skip: 0,
        };
        assert_eq!(harmonics(&signals, (1.0, 79.0), repetition), Ok(None));
    }

    #[test]
    fn the_probability_is_that_of_a_sum_of_exponentials() {
        let level = |surprise| LineLevel {
            frequency_hz: 1.0,
            input_a2: 0.0,
            power_m2: 0.0,
            noise_m2: 0.0,
            surprise,
        };
        assert_eq!(by_noise_alone(&[]), 1.0);
        // exp(-x), (1 + x) exp(-x): two roundings of numbers near 1.
        assert!((by_noise_alone(&[level(2.0)]) - (-2.0f64).exp()).abs() < 1e-15);
        assert!((by_noise_alone(&[level(2.0), level(1.0)]) - 4.0 * (-3.0f64).exp()).abs() < 1e-15);
        assert_eq!(by_noise_alone(&[level(0.0)]), 1.0);
        assert_eq!(by_noise_alone(&[level(1e6), level(f64::INFINITY)]), 0.0);
        // Of 1000 lines the sum is 1000 with a sigma of 31.6; half lies beyond 1000 - 1/3.
        let many = by_noise_alone(&vec![level(1.0 - 1.0 / 3000.0); 1000]);
        assert!((many - 0.5).abs() < 1e-3, "{many}");
    }
}
