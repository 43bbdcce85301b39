//! The stability chart: the modes at each model order, and which of them persist from one order to the next.

use super::ReportError;
use super::chart::colours::{BLUE, Colour, GREY, ORANGE, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use bench_identify::{Frf, Unit};

/// Largest relative changes of the frequency and of the damping of a mode that persists.
const FREQUENCY_CHANGE: f64 = 0.01;
const DAMPING_CHANGE: f64 = 0.05;

/// A mode of an order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderedMode {
    /// Undamped natural frequency in hertz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// The properties of a mode that were present at the order before; more properties are greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Persistence {
    New,
    Frequency,
    FrequencyAndDamping,
}

const KINDS: [(Persistence, &str, Colour, Symbol); 3] = [
    (
        Persistence::New,
        "new, or moved by more than 1 %",
        ORANGE,
        Symbol::Cross,
    ),
    (
        Persistence::Frequency,
        "frequency stable within 1 %",
        VERMILION,
        Symbol::Ring,
    ),
    (
        Persistence::FrequencyAndDamping,
        "frequency and damping (5 %) stable",
        BLUE,
        Symbol::Dot,
    ),
];

fn persistence(mode: &OrderedMode, before: &[OrderedMode]) -> Persistence {
    let same_frequency = before.iter().filter(|old| mode.has_frequency_of(old));
    let persistences = same_frequency.map(|old| {
        if mode.has_damping_of(old) {
            Persistence::FrequencyAndDamping
        } else {
            Persistence::Frequency
        }
    });
    persistences.max().unwrap_or(Persistence::New)
}

impl OrderedMode {
    fn has_frequency_of(&self, other: &OrderedMode) -> bool {
        is_close(self.frequency_hz, other.frequency_hz, FREQUENCY_CHANGE)
    }

    fn has_damping_of(&self, other: &OrderedMode) -> bool {
        is_close(self.damping_ratio, other.damping_ratio, DAMPING_CHANGE)
    }
}

fn is_close(a: f64, b: f64, ratio: f64) -> bool {
    (a - b).abs() <= ratio * b.abs()
}

/// The modes that a fit found at each order, and the response that it was fitted to.
#[derive(Clone, Copy, Debug)]
pub struct StabilityChart<'a> {
    /// The modes of each order.
    pub orders: &'a [Vec<OrderedMode>],
    /// Frequencies of the modes of the fit in hertz.
    pub fit_hz: &'a [f64],
    /// Lowest and highest frequency of the fit in hertz.
    pub band_hz: (f64, f64),
    /// The measured response.
    pub measured: &'a Frf,
    /// Unit of the response.
    pub unit: Unit,
}

/// The chart as an SVG document: the modes of each order over frequency, vertical lines at the modes of the fit, and behind them the
/// measured magnitude on a logarithmic scale.
///
/// # Errors
/// When there is no order.
pub fn stability_svg(
    plot: &StabilityChart<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if plot.orders.is_empty() {
        return Err(ReportError::NoTrace);
    }
    sheet_svg(title, subtitle, &[Row::new(420.0, vec![chart(plot)])])
}

fn chart(plot: &StabilityChart<'_>) -> Chart {
    let StabilityChart {
        orders,
        fit_hz,
        band_hz,
        ..
    } = *plot;
    let highest = orders.len().max(9) as f64 + 1.0;
    let low_hz = low_end_hz(orders, band_hz);
    let x = Scale::logarithmic("Frequency (Hz)").within(low_hz, band_hz.1);
    let y = Scale::linear("Order (number of modes)").within(0.0, highest);
    let mut chart = with_magnitude(Chart::new("", x, y), plot, (low_hz, band_hz.1), highest);
    let mut name = format!("the {} modes of the fit", fit_hz.len());
    for f in fit_hz {
        let line = vec![(*f, 0.0), (*f, highest)];
        chart = chart.line(&name, Pen::dashed(GREY).thin(), line);
        name.clear();
    }
    for (kind, name, colour, symbol) in KINDS {
        chart = chart.points(name, colour, symbol, places(orders, kind));
    }
    chart
}

/// The magnitude between the lower and the upper end of the chart, and its range as a heading.
fn with_magnitude(
    mut chart: Chart,
    plot: &StabilityChart<'_>,
    (low_hz, high_hz): (f64, f64),
    highest: f64,
) -> Chart {
    let points = plot
        .measured
        .frequency_hz
        .iter()
        .zip(&plot.measured.response);
    let magnitudes: Vec<(f64, f64)> = points
        .map(|(f, h)| (*f, h.norm()))
        .filter(|(f, magnitude)| (low_hz..=high_hz).contains(f) && *magnitude > 0.0)
        .collect();
    let values = magnitudes.iter().map(|(_, magnitude)| *magnitude);
    let ends = (values.clone().reduce(f64::min), values.reduce(f64::max));
    let (Some(low), Some(high)) = ends else {
        return chart;
    };
    if low < high {
        let unit = match plot.unit {
            Unit::MetresPerAmpere => " m/A",
            Unit::Bare => "",
        };
        chart.heading = format!(
            "Grey: measured magnitude, logarithmic, from {low:.1e} at the bottom to {high:.1e}{unit} at the top"
        );
    }
    let decades = libm::log10(high / low).max(f64::MIN_POSITIVE);
    let height = |magnitude: f64| highest * libm::log10(magnitude / low) / decades;
    let line = magnitudes
        .iter()
        .map(|(f, magnitude)| (*f, height(*magnitude)));
    chart.line("", Pen::solid(GREY).width(1.2), line.collect())
}

/// Half of the lowest oscillating mode, or the lower end of the band where that is higher.
fn low_end_hz(orders: &[Vec<OrderedMode>], band_hz: (f64, f64)) -> f64 {
    let frequencies = orders.iter().flatten().map(|mode| mode.frequency_hz);
    let lowest = frequencies.filter(|f| *f > 0.0).fold(band_hz.1, f64::min);
    band_hz.0.max(0.5 * lowest)
}

/// The modes of a kind: frequency in hertz, and order.
fn places(orders: &[Vec<OrderedMode>], kind: Persistence) -> Vec<(f64, f64)> {
    let mut places = Vec::new();
    let mut before: &[OrderedMode] = &[];
    for (order, modes) in (1..).zip(orders) {
        let of_kind = modes
            .iter()
            .filter(|mode| persistence(mode, before) == kind);
        places.extend(of_kind.map(|mode| (mode.frequency_hz, f64::from(order))));
        before = modes;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classifies_modes_by_their_change_of_frequency_and_damping() {
        let mode = |frequency_hz, damping_ratio| OrderedMode {
            frequency_hz,
            damping_ratio,
        };
        let before = [mode(100.0, 0.01), mode(50.0, 0.02)];
        for (now, expected) in [
            (mode(100.9, 0.0104), Persistence::FrequencyAndDamping),
            (mode(100.9, 0.0106), Persistence::Frequency),
            (mode(101.1, 0.01), Persistence::New),
            (mode(50.0, 0.02), Persistence::FrequencyAndDamping),
        ] {
            assert_eq!(persistence(&now, &before), expected, "{now:?}");
        }
        assert_eq!(persistence(&before[0], &[]), Persistence::New);
    }
}
