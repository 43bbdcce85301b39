//! The Bode plot of an identification: as the Bode plot, with what the fit leaves of the measured response.

use nalgebra::Complex;

use super::ReportError;
use super::bode::{
    COHERENCE_HEIGHT, MAGNITUDE_HEIGHT, PHASE_HEIGHT, coherence, magnitude, panel, phase, stacked,
};
use super::chart::colours::{BLUE, VERMILION};
use super::chart::{Chart, Mark, Pen, SeriesPoint};
use super::magnitude::{MagnitudeAxis, MagnitudeScale};
use super::trace::{self, Trace, has_gap_before};
use bench_identify::{Frf, Unit};

const RESIDUAL_HEIGHT: f64 = 190.0;
/// The size of a circular error whose components have the standard deviation 1 has a Rayleigh distribution: its quantiles
/// sqrt(-2 ln(1 - p)) at 2.5 %, 50 % and 97.5 %.
const RAYLEIGH: [f64; 3] = [0.225_024, 1.177_410, 2.716_203];
/// Factor by which the axis of the residual extends beyond residual and noise.
const ROOM: f64 = 2.0;
/// The axis begins below the quantile of the lower end of the band by this factor at most.
const MAX_DEPTH: f64 = 10.0;

/// A measured response with model and fit.
#[derive(Clone, Copy, Debug)]
pub struct Identification<'a> {
    /// Unit of the response.
    pub unit: Unit,
    /// Axis of the magnitudes.
    pub magnitude_axis: MagnitudeAxis,
    /// The measured response.
    pub measured: &'a Frf,
    /// Models and fits over it, on any frequencies.
    pub curves: &'a [Trace<'a>],
    /// The response of the fit at the measured frequencies.
    pub fitted: Option<&'a [Complex<f64>]>,
}

impl<'a> Identification<'a> {
    /// The measured response and the curves over it.
    pub(super) fn traces(&self) -> Vec<Trace<'a>> {
        let measured = Trace::measured("measured", self.measured);
        std::iter::once(measured)
            .chain(self.curves.iter().cloned())
            .collect()
    }
}

/// Magnitude, residual of the fit, phase and coherence as an SVG document. The measured curve lies below the others and is wider. The
/// residual |H - fit| has the band that contains 95 % of the values if noise alone caused it.
///
/// # Errors
/// When a response is invalid: see [`ReportError`].
pub fn identification_svg(
    plot: &Identification<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let scale = MagnitudeScale::new(plot.unit, plot.magnitude_axis);
    let lines = trace::lines(&plot.traces())?;
    let residual = plot
        .fitted
        .map(|fitted| (RESIDUAL_HEIGHT, residual(scale, plot.measured, fitted)));
    let charts = std::iter::once((MAGNITUDE_HEIGHT, magnitude(scale, &lines)?))
        .chain(residual)
        .chain([(PHASE_HEIGHT, phase(&lines))])
        .chain(coherence(&lines).map(|chart| (COHERENCE_HEIGHT, chart)));
    stacked(charts, &lines, title, subtitle)
}

fn residual(scale: MagnitudeScale, frf: &Frf, fitted: &[Complex<f64>]) -> Chart {
    let differences = frf.response.iter().zip(fitted);
    let residual: Vec<f64> = differences.map(|(h, fit)| (h - fit).norm()).collect();
    let axis = scale.axis("|H − fit|", residual_range(frf, &residual));
    panel(axis)
        .mark(noise_mark(scale, frf))
        .mark(residual_mark(scale, frf, &residual))
}

/// What noise leaves: the median, with the band that contains 95 %.
fn noise_mark(scale: MagnitudeScale, frf: &Frf) -> Mark {
    let points = frf.frequency_hz.iter().zip(&frf.magnitude_sigma);
    let points = points.enumerate().map(|(k, (x, sigma))| {
        let [low, median, high] = RAYLEIGH.map(|quantile| quantile * sigma);
        scale.point(SeriesPoint {
            x: *x,
            y: median,
            band: (low, high),
            faint: false,
            starts: k == 0,
        })
    });
    Mark::Series {
        name: "expected from the noise (band: 95 %)".into(),
        pen: Pen::solid(BLUE).thin(),
        points: points.collect(),
        dots: false,
    }
}

fn residual_mark(scale: MagnitudeScale, frf: &Frf, residual: &[f64]) -> Mark {
    let points = frf.frequency_hz.iter().zip(residual);
    let points = points.enumerate().map(|(k, (x, y))| {
        scale.point(SeriesPoint {
            x: *x,
            y: *y,
            band: (*y, *y),
            faint: false,
            starts: k == 0 || has_gap_before(frf, k),
        })
    });
    Mark::Series {
        name: "residual of the fit".into(),
        pen: Pen::solid(VERMILION).width(1.0),
        points: points.collect(),
        dots: true,
    }
}

/// From the lower end of the band of the noise, or the smallest residual if that is close to it, to the largest value.
fn residual_range(frf: &Frf, residual: &[f64]) -> (f64, f64) {
    let [low, _, high] = RAYLEIGH;
    let sigmas = frf.magnitude_sigma.iter().filter(|sigma| **sigma > 0.0);
    let smallest = sigmas
        .clone()
        .fold(f64::INFINITY, |least, sigma| least.min(low * sigma));
    let residuals = residual.iter().filter(|value| **value > 0.0);
    let least = residuals.fold(f64::INFINITY, |least, value| least.min(*value));
    let largest = residual.iter().copied().chain(sigmas.map(|s| high * s));
    let largest = largest.fold(0.0, f64::max);
    let bottom = if smallest.is_finite() {
        least.clamp(smallest / MAX_DEPTH, smallest)
    } else {
        least
    };
    if bottom < largest {
        (bottom / ROOM, largest * ROOM)
    } else {
        (0.1, 10.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// P(|e| < q sigma) = 1 - exp(-q^2/2) of a circular error.
    #[test]
    fn band_holds_95_percent_of_a_rayleigh_distribution() {
        let below = RAYLEIGH.map(|q| 1.0 - (-0.5 * q * q).exp());
        for (found, expected) in below.iter().zip([0.025, 0.5, 0.975]) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }
}
