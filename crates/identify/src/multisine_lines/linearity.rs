//! The loss of coherence, separated into noise and nonlinear distortion.
//!
//! At each excited line k, with the power X_k of the linear output, that of the noise of one period N_k, and of odd and even
//! distortion O_k and E_k as measured at the omitted lines around it,
//!
//! ```text
//!  noise ratio = sum N_k / sum X_k                                          distortion ratios with O_k and E_k in place of N_k
//!  coherence lost to noise = mean of N_k / (X_k + N_k + O_k + E_k)          likewise for distortion
//! ```
//!
//! The losses and the mean coherence add up to 1. A chirp, or a multisine of all lines, loses as much coherence. Odd lines alone
//! keep even distortion out of the response; odd distortion remains in it. Pintelon, Schoukens, System Identification, 2nd ed.,
//! section 4.3: distortion at the excited lines is assumed to equal that at the lines around them.

use serde::Serialize;

use super::harmonics::{Harmonics, LineLevel, noise_probability};
use crate::FrfDatum;

/// Distortion is detected if the probability that noise alone gives at least this level is below this value.
const FALSE_ALARM_PROBABILITY: f64 = 1e-3;
/// A loss of coherence below this is negligible.
const NEGLIGIBLE_LOSS: f64 = 1e-3;
/// Smallest number of excited lines in a part of the band.
const MIN_LINES: usize = 16;

/// The main cause of lost coherence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Cause {
    /// Noise: what differs from period to period.
    Noise,
    /// Nonlinear distortion, of the stage, the motor, the amplifier or the probe: it repeats in every period.
    Nonlinearity,
    /// The loss is negligible.
    None,
}

impl Cause {
    /// The name used in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Noise => "noise",
            Cause::Nonlinearity => "nonlinearity",
            Cause::None => "none",
        }
    }

    /// The remedy that reduces the loss.
    fn remedy(self) -> &'static str {
        match self {
            Cause::Nonlinearity => {
                "a smaller amplitude reduces the distortion, a longer run does not, and odd lines alone keep even distortion out of the response"
            }
            Cause::Noise => "a longer run or a larger amplitude reduces the noise",
            Cause::None => "both are negligible",
        }
    }
}

/// Noise and distortion in a band. Ratios are powers over that of the output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BandLinearity {
    /// Lowest excited line in hertz.
    pub low_hz: f64,
    /// Highest excited line in hertz.
    pub high_hz: f64,
    /// Number of excited lines.
    #[serde(skip)]
    pub lines: usize,
    /// The larger loss of coherence.
    pub cause: Cause,
    /// Noise of one period.
    pub noise_ratio: f64,
    /// Odd distortion, without bias: 0 on average for noise alone; `None` if no odd line was omitted.
    pub odd_distortion_ratio: Option<f64>,
    /// Even distortion, likewise.
    pub even_distortion_ratio: Option<f64>,
    /// Probability that noise alone gives as much odd distortion.
    pub odd_by_noise_alone: Option<f64>,
    /// Probability that noise alone gives as much even distortion.
    pub even_by_noise_alone: Option<f64>,
    /// Mean coherence of a linear response with one period.
    pub coherence: f64,
    /// Coherence lost to noise.
    pub missing_by_noise: f64,
    /// Coherence lost to distortion; 0 where none is detected.
    pub missing_by_distortion: f64,
    /// The part of it that is lost to odd distortion.
    #[serde(skip)]
    pub missing_by_odd: f64,
    /// The part of it that is lost to even distortion.
    #[serde(skip)]
    pub missing_by_even: f64,
}

/// Noise and distortion of a stage, over the whole band and its parts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Linearity {
    /// The whole band.
    #[serde(flatten)]
    pub whole: BandLinearity,
    /// [`BandLinearity::description`] of the whole band.
    pub why: String,
    /// Number of compared periods.
    pub periods: usize,
    /// Number of excited lines.
    pub excited_lines: usize,
    /// Number of omitted odd lines.
    pub odd_lines_left_out: usize,
    /// Number of even lines.
    pub even_lines: usize,
    /// The same for bands of one octave, combined until each has 16 excited lines.
    pub bands: Vec<BandLinearity>,
    /// Line by line.
    #[serde(skip)]
    pub harmonics: Harmonics,
}

impl Linearity {
    /// Noise and distortion from the levels of all lines.
    pub fn new(harmonics: Harmonics) -> Linearity {
        let bands = octaves(&harmonics.excited);
        let whole = BandLinearity::new(&harmonics, &harmonics.excited);
        Linearity {
            why: whole.description(),
            whole,
            periods: harmonics.periods,
            excited_lines: harmonics.excited.len(),
            odd_lines_left_out: harmonics.odd.len(),
            even_lines: harmonics.even.len(),
            bands: bands
                .into_iter()
                .map(|lines| BandLinearity::new(&harmonics, lines))
                .collect(),
            harmonics,
        }
    }

    /// The data with the power of odd distortion, if it was detected, in their variances: a fit treats it as noise that more
    /// periods do not reduce.
    pub fn with_odd_distortion(&self, data: &[FrfDatum]) -> Vec<FrfDatum> {
        if !self.whole.is_odd_detected() {
            return data.to_vec();
        }
        data.iter()
            .map(|datum| FrfDatum {
                variance: datum.variance + self.odd_variance(datum.frequency_hz),
                ..*datum
            })
            .collect()
    }

    /// E|error of H|^2 by odd distortion at an excited line, in (m/A)^2.
    fn odd_variance(&self, frequency_hz: f64) -> f64 {
        let Harmonics { excited, odd, .. } = &self.harmonics;
        let above = excited.partition_point(|line| line.frequency_hz < frequency_hz);
        let input_a2 = excited[above.min(excited.len() - 1)].input_a2;
        self.harmonics.around_m2(odd, frequency_hz).max(0.0) / input_a2
    }
}

/// Whether distortion exceeds the noise, by the probability of noise alone.
fn detected(by_noise_alone: Option<f64>) -> bool {
    by_noise_alone.is_some_and(|probability| probability < FALSE_ALARM_PROBABILITY)
}

impl BandLinearity {
    /// Noise and distortion at some of the excited lines.
    fn new(harmonics: &Harmonics, excited: &[LineLevel]) -> BandLinearity {
        let kinds = [&harmonics.odd, &harmonics.even];
        let band_hz = band_hz(excited);
        let mut sums = Sums {
            probabilities: kinds.map(|lines| probability_in_band(lines, band_hz)),
            ..Sums::default()
        };
        for line in excited {
            let distortion_m2 = kinds.map(|lines| harmonics.around_m2(lines, line.frequency_hz));
            let output_m2 = harmonics.without_noise_m2(line);
            sums.add(output_m2, line.noise_m2, distortion_m2);
        }
        sums.band(band_hz)
    }

    /// Whether there is odd distortion, with a probability of false alarm of 0.1 %.
    pub fn is_odd_detected(&self) -> bool {
        detected(self.odd_by_noise_alone)
    }

    /// Whether there is even distortion, with the same probability of false alarm.
    pub fn is_even_detected(&self) -> bool {
        detected(self.even_by_noise_alone)
    }

    /// The cause of the lost coherence as text, with the remedy.
    pub fn description(&self) -> String {
        let noise = loss(self.missing_by_noise);
        let distortion = loss(self.missing_by_distortion);
        let kinds = self.kinds();
        let losses = match self.cause {
            Cause::Nonlinearity => {
                format!("{distortion} lost to nonlinear distortion ({kinds}), {noise} to noise")
            }
            Cause::Noise | Cause::None => {
                format!("{noise} lost to noise, {distortion} to nonlinear distortion ({kinds})")
            }
        };
        let remedy = self.cause.remedy();
        format!("coherence {:.5}: {losses}; {remedy}", self.coherence)
    }

    fn kinds(&self) -> String {
        let odd = significance(self.odd_by_noise_alone);
        let even = significance(self.even_by_noise_alone);
        format!("odd {odd}, even {even}")
    }
}

/// Whether distortion is detected, by the probability of noise alone.
fn significance(by_noise_alone: Option<f64>) -> &'static str {
    match by_noise_alone {
        Some(_) if detected(by_noise_alone) => "detected",
        Some(_) => "not significant",
        None => "not measured",
    }
}

/// Lowest and highest frequency of some lines in hertz; 0 without lines.
fn band_hz(lines: &[LineLevel]) -> (f64, f64) {
    match lines {
        [] => (0.0, 0.0),
        [first, ..] => (first.frequency_hz, lines[lines.len() - 1].frequency_hz),
    }
}

/// A loss of coherence in two digits.
fn loss(ratio: f64) -> String {
    if ratio == 0.0 {
        "0".into()
    } else {
        format!("{ratio:.2e}")
    }
}

/// The lines by octaves from the first on. An octave with too few lines is combined with the next, the last with the one
/// before.
fn octaves(lines: &[LineLevel]) -> Vec<&[LineLevel]> {
    let (mut parts, mut rest) = (Vec::new(), lines);
    while !rest.is_empty() {
        let (part, remainder) = rest.split_at(octave(rest));
        parts.push(part);
        rest = remainder;
    }
    parts
}

/// Number of lines in the first octave of some lines.
fn octave(lines: &[LineLevel]) -> usize {
    let mut end_hz = lines[0].frequency_hz;
    let mut count = 0;
    while count < MIN_LINES && count < lines.len() {
        end_hz *= 2.0;
        count = lines.partition_point(|line| line.frequency_hz < end_hz);
    }
    if lines.len() - count < MIN_LINES {
        lines.len()
    } else {
        count
    }
}

/// The probability that noise alone gives as much distortion at those of `lines` that are in a band; `None` without lines.
fn probability_in_band(lines: &[LineLevel], (low_hz, high_hz): (f64, f64)) -> Option<f64> {
    let [low, high] =
        [low_hz, high_hz].map(|hz| lines.partition_point(|line| line.frequency_hz < hz));
    (!lines.is_empty()).then(|| noise_probability(&lines[low..high]))
}

/// Sums over excited lines; pairs are odd and even distortion.
#[derive(Default)]
struct Sums {
    lines: usize,
    /// Probabilities that noise alone gives as much distortion in the band.
    probabilities: [Option<f64>; 2],
    output_m2: f64,
    noise_m2: f64,
    distortion_m2: [f64; 2],
    lost_to_noise: f64,
    lost_to_distortion: [f64; 2],
}

impl Sums {
    fn add(&mut self, output_m2: f64, noise_m2: f64, distortion_m2: [f64; 2]) {
        let significant_m2 = self.significant(distortion_m2);
        let total_m2 = output_m2.max(0.0) + noise_m2 + significant_m2[0] + significant_m2[1];
        self.lines += 1;
        self.output_m2 += output_m2;
        self.noise_m2 += noise_m2;
        self.lost_to_noise += part(noise_m2, total_m2);
        for k in 0..2 {
            self.distortion_m2[k] += distortion_m2[k];
            self.lost_to_distortion[k] += part(significant_m2[k], total_m2);
        }
    }

    /// The powers of distortion where it is detected, 0 elsewhere.
    fn significant(&self, distortion_m2: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| {
            if detected(self.probabilities[k]) {
                distortion_m2[k].max(0.0)
            } else {
                0.0
            }
        })
    }

    /// A power over that of the output.
    fn over_output(&self, power_m2: f64) -> f64 {
        power_m2 / self.output_m2.max(f64::MIN_POSITIVE)
    }

    /// Odd (0) or even (1) distortion over the output, if it was measured.
    fn distortion_ratio(&self, k: usize) -> Option<f64> {
        self.probabilities[k]?;
        Some(self.over_output(self.distortion_m2[k]))
    }

    fn band(&self, (low_hz, high_hz): (f64, f64)) -> BandLinearity {
        let count = self.lines.max(1) as f64;
        let missing_by_noise = self.lost_to_noise / count;
        let [missing_by_odd, missing_by_even] = self.lost_to_distortion.map(|lost| lost / count);
        let missing_by_distortion = missing_by_odd + missing_by_even;
        let [odd_by_noise_alone, even_by_noise_alone] = self.probabilities;
        BandLinearity {
            low_hz,
            high_hz,
            lines: self.lines,
            cause: cause(missing_by_noise, missing_by_distortion),
            noise_ratio: self.over_output(self.noise_m2),
            odd_distortion_ratio: self.distortion_ratio(0),
            even_distortion_ratio: self.distortion_ratio(1),
            odd_by_noise_alone,
            even_by_noise_alone,
            coherence: 1.0 - missing_by_noise - missing_by_distortion,
            missing_by_noise,
            missing_by_distortion,
            missing_by_odd,
            missing_by_even,
        }
    }
}

/// power_m2/total_m2; 0 if the total is 0.
fn part(power_m2: f64, total_m2: f64) -> f64 {
    if total_m2 > 0.0 {
        power_m2 / total_m2
    } else {
        0.0
    }
}

fn cause(missing_by_noise: f64, missing_by_distortion: f64) -> Cause {
    if missing_by_distortion > missing_by_noise {
        Cause::Nonlinearity
    } else if missing_by_noise > NEGLIGIBLE_LOSS {
        Cause::Noise
    } else {
        Cause::None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DATUM: FrfDatum = FrfDatum {
        frequency_hz: 51.0,
        spread_hz: 0.0,
        response: nalgebra::Complex::new(1.0, 0.0),
        variance: 1.0,
    };

    /// Odd lines of 1 Hz with every fourth omitted, and the even lines between, all with the same levels of output, noise, odd
    /// and even distortion; surprisals are those of odd and even lines.
    fn linearity(
        [output_m2, noise_m2, odd_m2, even_m2]: [f64; 4],
        surprisal: [f64; 2],
    ) -> Linearity {
        let level = |k: usize, power_m2: f64, surprisal: f64| LineLevel {
            frequency_hz: k as f64,
            input_a2: 4.0,
            power_m2: power_m2 + noise_m2 / 8.0,
            noise_m2,
            surprisal,
        };
        let (omitted, excited): (Vec<usize>, Vec<usize>) =
            (1..200).step_by(2).partition(|k| k / 2 % 4 == 2);
        Linearity::new(Harmonics {
            excited: excited.iter().map(|k| level(*k, output_m2, 0.0)).collect(),
            odd: omitted
                .iter()
                .map(|k| level(*k, odd_m2, surprisal[0]))
                .collect(),
            even: (2..200)
                .step_by(2)
                .map(|k| level(k, even_m2, surprisal[1]))
                .collect(),
            periods: 8,
        })
    }

    #[test]
    fn ratios_and_losses_of_equal_lines_follow_from_their_powers() {
        let linearity = linearity([1.0, 0.01, 0.02, 0.07], [20.0, 20.0]);
        let whole = &linearity.whole;
        // All lines are equal: ratios are those of the powers, of 1.1 in total. Sums of 75 numbers: 1e-14.
        for (found, expected) in [
            (whole.noise_ratio, 0.01),
            (whole.odd_distortion_ratio.unwrap(), 0.02),
            (whole.even_distortion_ratio.unwrap(), 0.07),
            (whole.missing_by_noise, 0.01 / 1.1),
            (whole.missing_by_distortion, 0.09 / 1.1),
            (whole.coherence, 1.0 / 1.1),
        ] {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
        assert!(whole.is_odd_detected() && whole.is_even_detected());
        // 0.02 m^2 over 4 A^2.
        assert!((linearity.with_odd_distortion(&[DATUM])[0].variance - 1.005).abs() < 1e-14);
    }

    #[test]
    fn cause_is_the_larger_significant_loss() {
        for (powers, surprisal, cause, words) in [
            (
                [1.0, 0.01, 0.0, 0.07],
                [1.0, 20.0],
                Cause::Nonlinearity,
                ["even detected", "smaller amplitude"],
            ),
            (
                [1.0, 0.01, 0.02, 0.0],
                [20.0, 1.0],
                Cause::Nonlinearity,
                ["odd detected", "even not significant"],
            ),
            (
                [1.0, 0.1, 0.0, 0.07],
                [1.0, 20.0],
                Cause::Noise,
                ["even detected", "longer run or a larger amplitude"],
            ),
            (
                [1.0, 0.01, 0.02, 0.07],
                [1.0, 1.0],
                Cause::Noise,
                ["odd not significant", "larger amplitude"],
            ),
            (
                [1.0, 1e-4, 0.0, 0.0],
                [1.0, 1.0],
                Cause::None,
                ["both are negligible", "not significant"],
            ),
            (
                [1.0, 1e-6, 0.0, 1e-5],
                [1.0, 20.0],
                Cause::Nonlinearity,
                ["even detected", "a longer run does not"],
            ),
        ] {
            let Linearity { whole, why, .. } = linearity(powers, surprisal);
            assert_eq!(whole.cause, cause, "{powers:?}");
            for part in words {
                assert!(why.contains(part), "{why}");
            }
        }
    }

    #[test]
    fn data_stay_unchanged_without_significant_odd_distortion() {
        let linearity = linearity([1.0, 0.01, 0.02, 0.07], [1.0, 20.0]);
        assert_eq!(linearity.with_odd_distortion(&[DATUM]), [DATUM]);
    }

    #[test]
    fn bands_are_octaves_with_enough_lines_and_contain_every_line_once() {
        let Linearity { whole, bands, .. } = linearity([1.0, 0.01, 0.0, 0.0], [1.0, 1.0]);
        let lines: Vec<usize> = bands.iter().map(|band| band.lines).collect();
        assert_eq!(whole.lines, 75);
        // 32 odd lines from 1 to 63 Hz less 8, 33 from 65 to 129 Hz less 8, 35 to 199 Hz less 9.
        assert_eq!(lines, [24, 25, 26]);
    }
}
