//! Noise and nonlinear distortion of a multisine, as text.

use super::table::{labelled, table};
use bench_identify::linearity::{BandLinearity, Linearity};

/// The line of `bench chirp`.
pub(super) fn line(linearity: &Linearity) -> String {
    labelled("linearity", &linearity.why)
}

/// The line, and a table of the amplitudes in each band.
pub(super) fn text(linearity: &Linearity) -> String {
    let header = [
        "Hz",
        "noise/output",
        "odd/output",
        "even/output",
        "coherence",
        "lost to",
    ];
    let bands = linearity.bands.iter().chain([&linearity.whole]);
    let rows: Vec<_> = bands.map(row).collect();
    line(linearity) + &table(&header, &rows)
}

/// Band, amplitudes as ratios of that of the output, and cause.
fn row(band: &BandLinearity) -> Vec<String> {
    vec![
        format!("{:.1} to {:.1}", band.low_hz, band.high_hz),
        amplitude(Some(band.noise_ratio)),
        amplitude(band.odd_distortion_ratio),
        amplitude(band.even_distortion_ratio),
        format!("{:.6}", band.coherence),
        band.cause.name().into(),
    ]
}

/// The square root of a power ratio; an estimate without bias may be negative.
fn amplitude(power_ratio: Option<f64>) -> String {
    match power_ratio {
        Some(power) if power > 0.0 => format!("{:.1e}", power.sqrt()),
        Some(_) => "0".into(),
        None => "-".into(),
    }
}
