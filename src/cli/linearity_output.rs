//! What a multisine with lines left out says of noise and geometry, as JSON and for people.

use serde::Serialize;

use super::table::table;
use crate::identify::linearity::{BandLinearity, Distortion, Linearity};

/// The part of the report that tells distortion from noise; its names are a contract.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LinearityMade {
    #[serde(flatten)]
    whole: ShareJson,
    /// What the coherence lacks and why, and the remedy.
    why: String,
    /// Periods that were compared.
    periods: usize,
    excited_lines: usize,
    odd_lines_left_out: usize,
    even_lines: usize,
    /// The same by parts of the band.
    bands: Vec<ShareJson>,
}

/// Ratios are powers over that of the output.
#[derive(Clone, Debug, Serialize)]
struct ShareJson {
    low_hz: f64,
    high_hz: f64,
    /// `noise`, `geometry` or `none`: what low coherence is put down to.
    cause: &'static str,
    /// Of one period.
    noise_ratio: f64,
    odd_distortion_ratio: Option<f64>,
    even_distortion_ratio: Option<f64>,
    /// The probability that noise alone gives as much.
    odd_by_noise_alone: Option<f64>,
    even_by_noise_alone: Option<f64>,
    /// Mean over the lines of what a linear response explains of one period, and of what takes the rest.
    coherence: f64,
    missing_by_noise: f64,
    missing_by_distortion: f64,
}

impl ShareJson {
    fn of(share: &BandLinearity) -> ShareJson {
        let ratio = |kind: Option<Distortion>| kind.map(|kind| kind.ratio);
        let probability = |kind: Option<Distortion>| kind.map(|kind| kind.by_noise_alone);
        ShareJson {
            low_hz: share.band_hz.0,
            high_hz: share.band_hz.1,
            cause: share.cause().name(),
            noise_ratio: share.noise_ratio,
            odd_distortion_ratio: ratio(share.odd),
            even_distortion_ratio: ratio(share.even),
            odd_by_noise_alone: probability(share.odd),
            even_by_noise_alone: probability(share.even),
            coherence: share.coherence(),
            missing_by_noise: share.missing_by_noise,
            missing_by_distortion: share.missing_by_distortion(),
        }
    }

    /// Band, cause, and amplitudes as ratios of the output's.
    fn row(&self) -> Vec<String> {
        // Noise makes an estimate of nothing negative as often as positive.
        let amplitude = |power: Option<f64>| match power {
            Some(power) if power > 0.0 => format!("{:.1e}", power.sqrt()),
            Some(_) => "0".into(),
            None => "-".into(),
        };
        vec![
            format!("{:.1} to {:.1}", self.low_hz, self.high_hz),
            amplitude(Some(self.noise_ratio)),
            amplitude(self.odd_distortion_ratio),
            amplitude(self.even_distortion_ratio),
            format!("{:.6}", self.coherence),
            self.cause.into(),
        ]
    }
}

impl LinearityMade {
    pub fn of(linearity: &Linearity) -> LinearityMade {
        let harmonics = &linearity.harmonics;
        LinearityMade {
            whole: ShareJson::of(&linearity.whole),
            why: linearity.whole.words(),
            periods: harmonics.periods,
            excited_lines: harmonics.excited.len(),
            odd_lines_left_out: harmonics.odd.len(),
            even_lines: harmonics.even.len(),
            bands: linearity.bands.iter().map(ShareJson::of).collect(),
        }
    }

    /// The line of `bench chirp`.
    pub fn line(&self) -> String {
        format!("  linearity  {}\n", self.why)
    }

    /// Amplitudes by bands, for people.
    pub fn text(&self) -> String {
        let header = [
            "Hz",
            "noise/output",
            "odd/output",
            "even/output",
            "coherence",
            "lacks by",
        ];
        let rows: Vec<_> = self
            .bands
            .iter()
            .chain([&self.whole])
            .map(ShareJson::row)
            .collect();
        self.line() + &table(&header, &rows)
    }
}
