//! What coherence lacks, and whether noise or geometry takes it.
//!
//! At each excited line k, with the power X_k of the linear output, that of the noise of one period N_k, and of odd and even
//! distortion O_k and E_k as they stand at the lines left out around it,
//!
//! ```text
//!  ratio of noise = sum N_k / sum X_k                                       and so on: of the power of the whole band
//!  missing by noise = mean of N_k / (X_k + N_k + O_k + E_k)                 and so on: of a coherence, line by line
//! ```
//!
//! The parts and the mean coherence add up to 1. A chirp's coherence, or that of a multisine of all lines, lacks the same. Odd lines
//! alone keep even distortion out of the response; odd distortion stays in it. Pintelon, Schoukens, System Identification, 2nd ed.,
//! section 4.3: distortion at the excited lines is taken to be that at the lines around.

use super::harmonics::{Harmonics, LineLevel, by_noise_alone};
use crate::identify::FrfDatum;

/// Distortion is found where noise alone gives as much with less than this probability.
pub const FALSE_ALARM: f64 = 1e-3;
/// Less than this part of a coherence is nothing to speak of.
const LITTLE: f64 = 1e-3;
/// Excited lines that a part of the band has at least.
const LEAST_LINES: usize = 16;

/// What takes coherence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Noise: what differs from period to period.
    Noise,
    /// The stage itself: what is alike in every period, and yet no linear answer.
    Nonlinearity,
    /// Nothing to speak of is missing.
    None,
}

/// One kind of distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Its power over that of the output, without bias: noise alone makes it 0 on average.
    pub ratio: f64,
    /// What it takes of the coherence; 0 where it is not found.
    pub missing: f64,
    /// The probability that noise alone gives as much.
    pub by_noise_alone: f64,
}

/// What is found in a band.
#[derive(Clone, Debug, PartialEq)]
pub struct BandLinearity {
    /// Lowest and highest excited line in hertz.
    pub band_hz: (f64, f64),
    /// Excited lines.
    pub lines: usize,
    /// Power of the noise of one period over that of the output.
    pub noise_ratio: f64,
    /// What noise takes of the coherence.
    pub missing_by_noise: f64,
    /// None if no odd line was left out.
    pub odd: Option<Distortion>,
    /// None if no even line was left out.
    pub even: Option<Distortion>,
}

/// How linear a stage answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearity {
    /// Line by line.
    pub harmonics: Harmonics,
    /// Over the whole band.
    pub whole: BandLinearity,
    /// By octaves, joined until each has 16 excited lines.
    pub bands: Vec<BandLinearity>,
}

impl Linearity {
    /// What the lines say.
    pub fn of(harmonics: Harmonics) -> Linearity {
        let bands = octaves(&harmonics.excited)
            .into_iter()
            .map(|lines| share(&harmonics, lines))
            .collect();
        Linearity {
            whole: share(&harmonics, &harmonics.excited),
            bands,
            harmonics,
        }
    }

    /// The frf_data with the power of odd distortion in their variances, where it was found: to a fit it is a noise that more
    /// periods do not lessen.
    pub fn with_odd_distortion(&self, frf_data: &[FrfDatum]) -> Vec<FrfDatum> {
        if !self.whole.odd.is_some_and(|odd| odd.is_found()) {
            return frf_data.to_vec();
        }
        let with = |block: &FrfDatum| FrfDatum {
            variance: block.variance + self.odd_variance(block.frequency_hz),
            ..*block
        };
        frf_data.iter().map(with).collect()
    }

    /// E|error of H|^2 at an excited line by odd distortion, in (m/A)^2.
    pub fn odd_variance(&self, frequency_hz: f64) -> f64 {
        let Harmonics { excited, odd, .. } = &self.harmonics;
        let above = excited.partition_point(|line| line.frequency_hz < frequency_hz);
        let input_a2 = excited[above.min(excited.len() - 1)].input_a2;
        self.harmonics.around_m2(odd, frequency_hz).max(0.0) / input_a2
    }
}

impl Distortion {
    /// Whether it is beyond noise.
    pub fn is_found(&self) -> bool {
        self.by_noise_alone < FALSE_ALARM
    }
}

impl BandLinearity {
    /// What distortion takes of the coherence.
    pub fn missing_by_distortion(&self) -> f64 {
        self.odd
            .iter()
            .chain(&self.even)
            .map(|kind| kind.missing)
            .sum()
    }

    /// The mean coherence that a linear response has with one period.
    pub fn coherence(&self) -> f64 {
        1.0 - self.missing_by_noise - self.missing_by_distortion()
    }

    /// What the rest of the coherence is put down to.
    pub fn cause(&self) -> Cause {
        if self.missing_by_distortion() > self.missing_by_noise {
            Cause::Nonlinearity
        } else if self.missing_by_noise > LITTLE {
            Cause::Noise
        } else {
            Cause::None
        }
    }

    /// The same in words, with the remedy.
    pub fn words(&self) -> String {
        let part = |ratio: f64| {
            if ratio == 0.0 {
                "0".into()
            } else {
                format!("{ratio:.2e}")
            }
        };
        let (noise, distortion) = (
            part(self.missing_by_noise),
            part(self.missing_by_distortion()),
        );
        let kinds = self.kinds();
        match self.cause() {
            Cause::Nonlinearity => format!(
                "a coherence of {:.5} lacks {distortion} by distortion ({kinds}) and {noise} by noise: geometry, not noise; less \
                 amplitude lessens it, longer does not, and odd lines alone keep even distortion out of the response",
                self.coherence()
            ),
            Cause::Noise => format!(
                "a coherence of {:.5} lacks {noise} by noise and {distortion} by distortion ({kinds}): noise; longer or more amplitude \
                 lessens it",
                self.coherence()
            ),
            Cause::None => format!(
                "a coherence of {:.5} lacks nothing to speak of: {noise} by noise, {distortion} by distortion ({kinds})",
                self.coherence()
            ),
        }
    }

    fn kinds(&self) -> String {
        let word = |name: &str, kind: Option<Distortion>| match kind {
            Some(kind) if kind.is_found() => Some(format!("{name} found")),
            Some(_) => Some(format!("{name} not beyond noise")),
            None => Some(format!("{name} not looked for")),
        };
        [word("odd", self.odd), word("even", self.even)]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(", ")
    }
}

impl Cause {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Noise => "noise",
            Cause::Nonlinearity => "geometry",
            Cause::None => "none",
        }
    }
}

/// The lines by octaves from the first on; one that has too few joins the next, at the end the one before.
fn octaves(lines: &[LineLevel]) -> Vec<&[LineLevel]> {
    let (mut parts, mut rest) = (Vec::new(), lines);
    while let Some(first) = rest.first() {
        let mut end_hz = 2.0 * first.frequency_hz;
        let mut count = rest.partition_point(|line| line.frequency_hz < end_hz);
        while count < LEAST_LINES && count < rest.len() {
            end_hz *= 2.0;
            count = rest.partition_point(|line| line.frequency_hz < end_hz);
        }
        count = if rest.len() - count < LEAST_LINES {
            rest.len()
        } else {
            count
        };
        parts.push(&rest[..count]);
        rest = &rest[count..];
    }
    parts
}

/// What some excited lines and those left out between them show.
fn share(harmonics: &Harmonics, excited: &[LineLevel]) -> BandLinearity {
    let ends = excited.first().zip(excited.last());
    let band_hz = ends.map_or((0.0, 0.0), |(first, last)| {
        (first.frequency_hz, last.frequency_hz)
    });
    let found = |lines: &[LineLevel]| {
        let within = |f: f64| lines.partition_point(|line| line.frequency_hz < f);
        by_noise_alone(&lines[within(band_hz.0)..within(band_hz.1)])
    };
    let probabilities =
        [&harmonics.odd, &harmonics.even].map(|lines| (!lines.is_empty()).then(|| found(lines)));
    let mut sums = Sums::default();
    for line in excited {
        let around = |lines: &[LineLevel]| harmonics.around_m2(lines, line.frequency_hz);
        let distortion = [around(&harmonics.odd), around(&harmonics.even)];
        sums.add(
            harmonics.beyond_noise_m2(line),
            line.noise_m2,
            distortion,
            probabilities,
        );
    }
    sums.share(band_hz, excited.len(), probabilities)
}

/// Odd and even.
type Both<T> = [T; 2];

#[derive(Default)]
struct Sums {
    output_m2: f64,
    noise_m2: f64,
    distortion_m2: Both<f64>,
    missing_by_noise: f64,
    missing: Both<f64>,
}

impl Sums {
    fn add(
        &mut self,
        output_m2: f64,
        noise_m2: f64,
        distortion_m2: Both<f64>,
        probabilities: Both<Option<f64>>,
    ) {
        let counts = |k: usize| probabilities[k].is_some_and(|p| p < FALSE_ALARM);
        let counted = [0, 1].map(|k| {
            if counts(k) {
                distortion_m2[k].max(0.0)
            } else {
                0.0
            }
        });
        let all_m2 = output_m2.max(0.0) + noise_m2 + counted[0] + counted[1];
        let part = |power_m2: f64| if all_m2 > 0.0 { power_m2 / all_m2 } else { 0.0 };
        self.output_m2 += output_m2;
        self.noise_m2 += noise_m2;
        self.missing_by_noise += part(noise_m2);
        for k in 0..2 {
            self.distortion_m2[k] += distortion_m2[k];
            self.missing[k] += part(counted[k]);
        }
    }

    fn share(
        &self,
        band_hz: (f64, f64),
        lines: usize,
        probabilities: Both<Option<f64>>,
    ) -> BandLinearity {
        let count = lines.max(1) as f64;
        let over_output = |power_m2: f64| power_m2 / self.output_m2.max(f64::MIN_POSITIVE);
        let kind = |k: usize| {
            probabilities[k].map(|by_noise_alone| Distortion {
                ratio: over_output(self.distortion_m2[k]),
                missing: self.missing[k] / count,
                by_noise_alone,
            })
        };
        BandLinearity {
            band_hz,
            lines,
            noise_ratio: over_output(self.noise_m2),
            missing_by_noise: self.missing_by_noise / count,
            odd: kind(0),
            even: kind(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines 1, 3, 5 ... of 1 Hz, every fourth left out, and the even ones between, all of them alike but for chance, which there is not.
    fn harmonics(
        (output_m2, noise_m2, odd_m2, even_m2): (f64, f64, f64, f64),
        surprise: Both<f64>,
    ) -> Harmonics {
        let level = |k: usize, power_m2: f64, surprise: f64| LineLevel {
            frequency_hz: k as f64,
            input_a2: 4.0,
            power_m2: power_m2 + noise_m2 / 8.0,
            noise_m2,
            surprise,
        };
        let odd: Vec<usize> = (1..200).step_by(2).collect();
        let left_out = |k: &usize| k / 2 % 4 == 2;
        Harmonics {
            excited: odd
                .iter()
                .filter(|k| !left_out(k))
                .map(|k| level(*k, output_m2, 0.0))
                .collect(),
            odd: odd
                .iter()
                .filter(|k| left_out(k))
                .map(|k| level(*k, odd_m2, surprise[0]))
                .collect(),
            even: (2..200)
                .step_by(2)
                .map(|k| level(k, even_m2, surprise[1]))
                .collect(),
            periods: 8,
        }
    }

    #[test]
    fn powers_over_that_of_the_output_and_what_they_take_of_the_coherence() {
        let linearity = Linearity::of(harmonics((1.0, 0.01, 0.02, 0.07), [20.0, 20.0]));
        let whole = &linearity.whole;
        let (odd, even) = (whole.odd.unwrap(), whole.even.unwrap());
        // Alike at every line: ratios are those of the powers, and 1.1 is all there is. Sums of 75 numbers: 1e-14.
        for (found, expected) in [
            (whole.noise_ratio, 0.01),
            (odd.ratio, 0.02),
            (even.ratio, 0.07),
            (whole.missing_by_noise, 0.01 / 1.1),
            (whole.missing_by_distortion(), 0.09 / 1.1),
            (whole.coherence(), 1.0 / 1.1),
        ] {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
        assert!(odd.is_found() && even.is_found());
        let frf_data = [FrfDatum {
            frequency_hz: 51.0,
            spread_hz: 0.0,
            response: 1.0.into(),
            variance: 1.0,
        }];
        // 0.02 m^2 over 4 A^2.
        assert!((linearity.with_odd_distortion(&frf_data)[0].variance - 1.005).abs() < 1e-14);
    }

    #[test]
    fn what_is_larger_is_the_cause_and_what_is_not_found_is_none() {
        let of = |powers, surprise| Linearity::of(harmonics(powers, surprise)).whole;
        for (powers, surprise, cause, words) in [
            (
                (1.0, 0.01, 0.0, 0.07),
                [1.0, 20.0],
                Cause::Nonlinearity,
                ["even found", "less amplitude"],
            ),
            (
                (1.0, 0.01, 0.02, 0.0),
                [20.0, 1.0],
                Cause::Nonlinearity,
                ["odd found", "even not beyond noise"],
            ),
            (
                (1.0, 0.1, 0.0, 0.07),
                [1.0, 20.0],
                Cause::Noise,
                ["even found", "longer or more amplitude"],
            ),
            (
                (1.0, 0.01, 0.02, 0.07),
                [1.0, 1.0],
                Cause::Noise,
                ["odd not beyond noise", "longer or more amplitude"],
            ),
            (
                (1.0, 1e-4, 0.0, 0.0),
                [1.0, 1.0],
                Cause::None,
                ["nothing to speak of", "not beyond noise"],
            ),
            (
                (1.0, 1e-6, 0.0, 1e-5),
                [1.0, 20.0],
                Cause::Nonlinearity,
                ["even found", "longer does not"],
            ),
        ] {
            let share = of(powers, surprise);
            assert_eq!(share.cause(), cause, "{powers:?}");
            for part in words {
                assert!(share.words().contains(part), "{}", share.words());
            }
        }
    }

    #[test]
    fn where_odd_distortion_is_not_found_blocks_stay_as_they_are() {
        let linearity = Linearity::of(harmonics((1.0, 0.01, 0.02, 0.07), [1.0, 20.0]));
        let frf_data = [FrfDatum {
            frequency_hz: 51.0,
            spread_hz: 0.0,
            response: 1.0.into(),
            variance: 1.0,
        }];
        assert_eq!(linearity.with_odd_distortion(&frf_data), frf_data);
    }

    #[test]
    fn bands_are_octaves_with_enough_lines_and_hold_every_line_once() {
        let linearity = Linearity::of(harmonics((1.0, 0.01, 0.0, 0.0), [1.0, 1.0]));
        assert!(
            linearity.bands.iter().all(|band| band.lines >= LEAST_LINES),
            "{:?}",
            linearity.bands
        );
        assert_eq!(
            linearity.bands.iter().map(|band| band.lines).sum::<usize>(),
            linearity.whole.lines
        );
        assert_eq!(linearity.whole.lines, 75);
        // 32 odd lines from 1 to 63 Hz less 8, 33 from 65 to 129 Hz less 8, 35 to 199 Hz less 9.
        assert_eq!(
            linearity
                .bands
                .iter()
                .map(|band| band.lines)
                .collect::<Vec<_>>(),
            [24, 25, 26]
        );
    }
}
