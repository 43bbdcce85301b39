//! The noise of lines from few periods, pooled over neighbouring lines.
//!
//! The scatter of P periods gives the variance v of a line with 2 (P - 1) degrees of freedom. Used as if exact, it makes the reduced
//! chi-square (P - 1)/(P - 2) instead of 1, and lines whose scatter is small by chance count too much. Noise is smooth in frequency,
//! apart from what passes through the plant:
//!
//! ```text
//! E v = (a + b |H|^2)/|mean U|^2       a: noise of the output, b: of the measured input, and of what excites the stage beside it
//! ```
//!
//! The residuals Y - H U contain noise of both signals with its covariance, so that a and b are those of a line and its neighbours, by
//! [`NoiseParts`]. There are so many of them that their degrees of freedom are 100 together; with 51 periods or more it is the line
//! alone.
//!
//! **Weights.** Of a variance with f degrees of freedom, E(1/v) is f/(f - 2) over its expectation. v is multiplied by this factor, so
//! that the reduced chi-square of a model that describes the data has the mean 1 for any number of periods. f is that of all pooled
//! lines, divided by the number of parts a and b that are not 0: the mean over the lines.
//!
//! **Disturbed lines.** A line that exceeds what the others around it predict has noise of its own, as from the mains. It keeps its own
//! variance, and does not count for the others. The limit is that of Fisher's distribution of 2 m = 2 (P - 1) and n degrees of freedom,
//! whose tail is exact:
//!
//! ```text
//! P(F > x) = z^(n/2) sum over j < m of (n/2) (n/2 + 1) ... (n/2 + j - 1)/j! (1 - z)^j        z = n/(n + 2 m x)
//! ```

use core::ops::Range;

use crate::{FrfDatum, NoiseParts, PowerDatum};

/// Degrees of freedom of a pooled variance: its standard deviation is 14 %.
const MIN_FREEDOM: f64 = 100.0;
/// Neighbours are within this ratio of frequency: noise that falls with the square of the frequency changes by at most 2.3.
const MAX_RATIO: f64 = 1.5;
/// A line is disturbed if its scatter has less than this probability.
const DISTURBED_PROBABILITY: f64 = 1e-4;

/// The data of lines with rising frequency, with variances that are pooled over neighbouring lines. `data` have the variances by the
/// scatter of `periods` periods, in the square of the unit of the response; `input_powers` are |mean U|^2 of each.
pub fn with_pooled_noise(data: &[FrfDatum], input_powers: &[f64], periods: usize) -> Vec<FrfDatum> {
    let lines = NoisyLines::new(data, input_powers, periods);
    let disturbed: Vec<bool> = (0..lines.powers.len())
        .map(|k| lines.is_disturbed(k))
        .collect();
    let data = data.iter().take(disturbed.len()).enumerate();
    data.map(|(k, datum)| FrfDatum {
        variance: lines.variance(k, &disturbed),
        ..*datum
    })
    .collect()
}

/// The scatter of lines.
struct NoisyLines {
    frequency_hz: Vec<f64>,
    powers: Vec<PowerDatum>,
    /// Half of the degrees of freedom of a line.
    half_freedom: usize,
    /// Neighbours to either side.
    reach: usize,
}

impl NoisyLines {
    fn new(data: &[FrfDatum], input_powers: &[f64], periods: usize) -> NoisyLines {
        let half_freedom = periods.saturating_sub(1).max(1);
        let lines = MIN_FREEDOM / (2 * half_freedom) as f64;
        let powers = data.iter().zip(input_powers);
        NoisyLines {
            frequency_hz: data.iter().map(|datum| datum.frequency_hz).collect(),
            powers: powers.map(power_of).collect(),
            half_freedom,
            reach: (0.5 * (lines - 1.0)).max(0.0).ceil() as usize,
        }
    }

    /// Degrees of freedom of a line.
    fn freedom(&self) -> f64 {
        (2 * self.half_freedom) as f64
    }

    /// A line and its neighbours.
    fn around(&self, k: usize) -> Range<usize> {
        let (hz, center_hz) = (&self.frequency_hz, self.frequency_hz[k]);
        let low = k.saturating_sub(self.reach);
        let high = (k + self.reach + 1).min(self.powers.len());
        let too_low = hz[low..k].partition_point(|hz| hz * MAX_RATIO < center_hz);
        let within = hz[k..high].partition_point(|hz| *hz <= center_hz * MAX_RATIO);
        low + too_low..k + within.max(1)
    }

    /// Whether the scatter of a line exceeds what its neighbours predict.
    fn is_disturbed(&self, k: usize) -> bool {
        let neighbours = self.around(k).filter(|j| *j != k);
        let others: Vec<PowerDatum> = neighbours.map(|j| self.powers[j]).collect();
        if others.is_empty() {
            return false;
        }
        let line = &self.powers[k];
        let expected = NoiseParts::of(&others).power(line.of_probe, line.of_plant);
        let ratio = line.power / expected;
        let freedom = self.freedom() * others.len() as f64;
        ratio > 1.0 && exceedance(ratio, self.half_freedom, freedom) < DISTURBED_PROBABILITY
    }

    /// The variance of a line with those of its neighbours that are not disturbed.
    fn variance(&self, k: usize, disturbed: &[bool]) -> f64 {
        let line = &self.powers[k];
        if disturbed[k] {
            return line.power * weight_factor(self.freedom());
        }
        let neighbours = self.around(k).filter(|j| !disturbed[*j]);
        let near: Vec<PowerDatum> = neighbours.map(|j| self.powers[j]).collect();
        let parts = NoiseParts::of(&near);
        let parameters = if parts.of_probe > 0.0 && parts.of_plant > 0.0 {
            2.0
        } else {
            1.0
        };
        let freedom = self.freedom() * near.len() as f64 / parameters;
        parts.power(line.of_probe, line.of_plant) * weight_factor(freedom)
    }
}

/// The variance of a line, with the shapes of both parts of its noise.
fn power_of((datum, input_power): (&FrfDatum, &f64)) -> PowerDatum {
    PowerDatum {
        power: datum.variance,
        of_probe: 1.0 / input_power,
        of_plant: datum.response.norm_sqr() / input_power,
    }
}

/// E(1/v) E(v) of a variance v with f degrees of freedom: f/(f - 2). With fewer than 3 there is no mean, and that of 3 is used.
fn weight_factor(freedom: f64) -> f64 {
    let freedom = freedom.max(3.0);
    freedom / (freedom - 2.0)
}

/// P(F > x) of Fisher's distribution with 2 m and n degrees of freedom.
fn exceedance(x: f64, m: usize, n: f64) -> f64 {
    if !x.is_finite() {
        return 0.0;
    }
    let half = 0.5 * n;
    let rest = 1.0 / (1.0 + half / (m as f64 * x));
    let (mut term, mut sum) = (1.0, 0.0);
    for j in 0..m {
        sum += term;
        term *= (half + j as f64) / (j as f64 + 1.0) * rest;
    }
    (libm::pow(1.0 - rest, half) * sum).min(1.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Lines of 1 Hz from 20 Hz on, with a resonance of half-width 3 lines at the 50th.
    const LINES: usize = 100;

    fn gain2(k: usize) -> f64 {
        1.0 / (1.0 + ((k as f64 - 50.0) / 3.0).powi(2))
    }

    /// A variance of mean 1 with 2 m degrees of freedom.
    fn scatter(m: usize, random: &mut Pcg64) -> f64 {
        let unit =
            |random: &mut Pcg64| ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64;
        (0..m).map(|_| -unit(random).ln()).sum::<f64>() / m as f64
    }

    /// Scatter of P periods of noise a + b |H|^2, with inputs of different amplitudes: the data, and their true variances.
    fn lines(periods: usize, b: f64, random: &mut Pcg64) -> (Vec<FrfDatum>, Vec<f64>, Vec<f64>) {
        let (mut data, mut inputs, mut exact) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..LINES {
            let input = if k % 3 == 0 { 4.0 } else { 1.0 };
            let variance = (1.0 + b * gain2(k)) / input;
            data.push(FrfDatum {
                frequency_hz: 20.0 + k as f64,
                spread_hz: 0.0,
                response: Complex::new(gain2(k).sqrt(), 0.0),
                variance: variance * scatter(periods - 1, random),
            });
            inputs.push(input);
            exact.push(variance);
        }
        (data, inputs, exact)
    }

    /// Against tables of the F distribution (3 digits): 10 and 60 degrees of freedom, upper 5, 1 and 0.1 %; 2 and 10, 5 and 1 %; 4 and 12,
    /// 1 %.
    #[test]
    fn tail_of_the_f_distribution_is_that_of_the_tables() {
        for (x, m, n, expected) in [
            (1.99, 5, 60.0, 0.05),
            (2.63, 5, 60.0, 0.01),
            (3.54, 5, 60.0, 0.001),
            (4.10, 1, 10.0, 0.05),
            (7.56, 1, 10.0, 0.01),
            (5.41, 2, 12.0, 0.01),
        ] {
            let ratio = exceedance(x, m, n) / expected;
            assert!((0.97..1.03).contains(&ratio), "{x} {m} {n}: {ratio}");
        }
        assert_eq!(exceedance(f64::INFINITY, 5, 60.0), 0.0);
        assert!((exceedance(1e-12, 5, 60.0) - 1.0).abs() < 1e-9);
    }

    /// The mean of exact/pooled is that of chi-square: 1 for any number of periods, with noise of the probe and with noise that passes
    /// through the plant. 60 records of 100 lines have 60 x 100/13 independent variances or more, each with a standard deviation of 14 to
    /// 20 %: 1 % of the mean. The limits a, b >= 0 make variances at the peak too large by some per cent.
    #[test]
    fn mean_of_the_weights_is_that_of_exact_variances() {
        for periods in [4, 5, 7, 10, 20, 60] {
            for b in [0.0, 20.0] {
                let mut random = Pcg64::seed_from_u64(periods as u64);
                let mut sum = 0.0;
                for _ in 0..60 {
                    let (data, inputs, exact) = lines(periods, b, &mut random);
                    let pooled = with_pooled_noise(&data, &inputs, periods);
                    let ratios = exact.iter().zip(&pooled).map(|(v, p)| v / p.variance);
                    sum += ratios.sum::<f64>();
                }
                let mean = sum / (60 * LINES) as f64;
                assert!((0.95..1.05).contains(&mean), "{periods} {b}: {mean}");
            }
        }
    }

    #[test]
    fn with_many_periods_a_line_has_its_own_variance() {
        let mut random = Pcg64::seed_from_u64(3);
        let (data, inputs, _) = lines(60, 5.0, &mut random);
        for (own, pooled) in data.iter().zip(with_pooled_noise(&data, &inputs, 60)) {
            // 2 x 59 degrees of freedom: 118/116.
            assert!((pooled.variance / own.variance / (118.0 / 116.0) - 1.0).abs() < 1e-12);
        }
    }

    /// A line with 100 times the noise, and two neighbours with 60 times.
    #[test]
    fn disturbed_lines_keep_their_variance_and_leave_that_of_the_others() {
        for (lines_disturbed, factor) in [(vec![30], 100.0), (vec![70, 71], 60.0)] {
            let mut random = Pcg64::seed_from_u64(11);
            let (mut data, inputs, _) = lines(6, 0.0, &mut random);
            let clean = with_pooled_noise(&data, &inputs, 6);
            for k in &lines_disturbed {
                data[*k].variance = factor * clean[*k].variance;
            }
            let pooled = with_pooled_noise(&data, &inputs, 6);
            for k in 0..LINES {
                let ratio = pooled[k].variance / clean[k].variance;
                if lines_disturbed.contains(&k) {
                    // 10 degrees of freedom: 10/8.
                    assert!((ratio / (1.25 * factor) - 1.0).abs() < 1e-9, "{k}: {ratio}");
                } else {
                    // The pool of a neighbour loses one or two of eleven lines.
                    assert!((0.6..1.7).contains(&ratio), "{k}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn a_line_without_neighbours_and_lines_without_noise_are_possible() {
        let mut random = Pcg64::seed_from_u64(5);
        let (data, inputs, _) = lines(5, 0.0, &mut random);
        let one = with_pooled_noise(&data[..1], &inputs[..1], 5);
        // 8 degrees of freedom: 8/6.
        assert!((one[0].variance / data[0].variance - 4.0 / 3.0).abs() < 1e-12);
        assert_eq!(with_pooled_noise(&[], &[], 5), []);
        let silent: Vec<FrfDatum> = data
            .iter()
            .map(|datum| FrfDatum {
                variance: 0.0,
                ..*datum
            })
            .collect();
        let pooled = with_pooled_noise(&silent, &inputs, 5);
        assert!(pooled.iter().all(|datum| datum.variance == 0.0));
    }
}
