//! The spectrum of the error of a closed loop: measured with its confidence band, and predicted.

use super::ReportError;
use super::chart::colours::{BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION};
use super::chart::{Chart, Mark, Pen, Row, Scale, SeriesPoint, sheet_svg};
use bench_experiment::{ErrorSpectrum, PredictedSpectrum};

/// Heights of the frames for the spectrum and for the RMS in pixels.
const SPECTRUM_HEIGHT: f64 = 320.0;
const RMS_HEIGHT: f64 = 220.0;
const NANO: f64 = 1e9;
/// Factor by which the axis of the spectrum extends beyond the measured curve.
const DENSITY_MARGIN: f64 = 4.0;

/// The error spectrum in nm/sqrt(Hz), and its RMS in nm up to each frequency, as an SVG document.
///
/// # Errors
/// When the spectrum is empty.
pub fn error_spectrum_svg(
    spectrum: &ErrorSpectrum,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if spectrum.frequency_hz.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let rows = [
        Row::new(SPECTRUM_HEIGHT, vec![densities(spectrum)]),
        Row::new(RMS_HEIGHT, vec![cumulative(spectrum)]),
    ];
    sheet_svg(title, subtitle, &rows)
}

fn frequencies(spectrum: &ErrorSpectrum) -> Scale {
    let ends = spectrum
        .frequency_hz
        .first()
        .zip(spectrum.frequency_hz.last());
    let (low_hz, high_hz) = ends.map_or((1.0, 1.0), |(low, high)| (*low, *high));
    Scale::frequency((low_hz, high_hz))
}

fn densities(spectrum: &ErrorSpectrum) -> Chart {
    let (low, high) = density_range(spectrum);
    let y = Scale::logarithmic("Error (nm/√Hz)").within(low, high);
    let mut chart = Chart::new("", frequencies(spectrum).unnumbered(), y).mark(measured(spectrum));
    if let Some(predicted) = &spectrum.predicted {
        for (name, pen, values) in curves(predicted) {
            chart = chart.line(name, pen, density_points(spectrum, values));
        }
    }
    chart
}

/// The range of the measured curve with its margin; predicted parts below it are cut off.
fn density_range(spectrum: &ErrorSpectrum) -> (f64, f64) {
    let values = spectrum.measured.iter().map(|value| nm(*value));
    let positive = values.filter(|value| *value > 0.0);
    let (low, high) = positive.fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low <= high {
        (low / DENSITY_MARGIN, high * DENSITY_MARGIN)
    } else {
        (0.1, 10.0)
    }
}

/// Name, pen and values of the predicted curves.
fn curves(predicted: &PredictedSpectrum) -> [(&'static str, Pen, &[f64]); 4] {
    [
        ("by the floor", Pen::dotted(GREEN), &predicted.floor),
        ("by the probe", Pen::dotted(PURPLE), &predicted.noise),
        ("of the stage itself", Pen::dashed(ORANGE), &predicted.stage),
        ("predicted", Pen::dashed(VERMILION), &predicted.total),
    ]
}

/// The measured curve with its 95 % band.
fn measured(spectrum: &ErrorSpectrum) -> Mark {
    let rows = spectrum
        .frequency_hz
        .iter()
        .zip(&spectrum.measured)
        .zip(&spectrum.interval);
    let points = rows
        .enumerate()
        .map(|(k, ((frequency_hz, value), interval))| SeriesPoint {
            x: *frequency_hz,
            y: nm(*value),
            band: (nm(value * interval[0]), nm(value * interval[1])),
            faint: false,
            starts: k == 0,
        });
    Mark::Series {
        name: "measured (band: 95 %)".into(),
        pen: Pen::solid(BLUE),
        points: points.collect(),
        dots: true,
    }
}

fn density_points(spectrum: &ErrorSpectrum, values: &[f64]) -> Vec<(f64, f64)> {
    let points = spectrum.frequency_hz.iter().copied().zip(values);
    points
        .map(|(frequency_hz, value)| (frequency_hz, nm(*value)))
        .collect()
}

/// Square root of m^2 or m^2/Hz in nm.
fn nm(square: f64) -> f64 {
    NANO * square.max(0.0).sqrt()
}

fn cumulative(spectrum: &ErrorSpectrum) -> Chart {
    let y = Scale::linear("RMS up to f (nm)");
    let mut chart = Chart::new("", frequencies(spectrum), y)
        .line("", Pen::solid(GREY).thin(), zero_line(spectrum))
        .line(
            "",
            Pen::solid(BLUE),
            rms_points(spectrum, &spectrum.measured),
        );
    if let Some(predicted) = &spectrum.predicted {
        for (_, pen, values) in curves(predicted) {
            chart = chart.line("", pen, rms_points(spectrum, values));
        }
    }
    chart
}

fn zero_line(spectrum: &ErrorSpectrum) -> Vec<(f64, f64)> {
    let ends = spectrum
        .frequency_hz
        .first()
        .into_iter()
        .chain(spectrum.frequency_hz.last());
    ends.map(|frequency_hz| (*frequency_hz, 0.0)).collect()
}

/// The square root of the integral up to each frequency.
fn rms_points(spectrum: &ErrorSpectrum, values: &[f64]) -> Vec<(f64, f64)> {
    let mut square_m2 = 0.0;
    let rows = spectrum
        .frequency_hz
        .iter()
        .zip(&spectrum.width_hz)
        .zip(values);
    let points = rows.map(|((frequency_hz, width_hz), value)| {
        square_m2 += value * width_hz;
        (*frequency_hz, nm(square_m2))
    });
    points.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_is_the_square_root_of_the_integral() {
        let spectrum = ErrorSpectrum {
            frequency_hz: vec![1.0, 2.0, 4.0],
            width_hz: vec![1.0, 1.0, 3.0],
            measured: vec![1e-18, 3e-18, 4e-18],
            interval: vec![[0.5, 2.0]; 3],
            predicted: None,
        };
        let points = rms_points(&spectrum, &spectrum.measured);
        for (point, expected) in points.iter().zip([(1.0, 1.0), (2.0, 2.0), (4.0, 4.0)]) {
            assert!(
                (point.1 - expected.1).abs() < 1e-12 && point.0 == expected.0,
                "{points:?}"
            );
        }
        let svg = error_spectrum_svg(&spectrum, "Error", "").unwrap();
        assert!(svg.contains("measured (band: 95 %)") && !svg.contains("predicted"));
    }
}
