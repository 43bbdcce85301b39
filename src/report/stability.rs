//! The stability chart: the modes at each model order, and which of them persist from one order to the next.

use super::ReportError;
use super::chart::colours::{BLUE, Colour, GREY, ORANGE, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};

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

/// What of a mode was present at the order before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Persistence {
    FrequencyAndDamping,
    Frequency,
    New,
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
    let close = |a: f64, b: f64, ratio: f64| (a - b).abs() <= ratio * b.abs();
    let same = |old: &&OrderedMode| close(mode.frequency_hz, old.frequency_hz, FREQUENCY_CHANGE);
    let damped = |old: &OrderedMode| close(mode.damping_ratio, old.damping_ratio, DAMPING_CHANGE);
    let mut matches = before.iter().filter(same).peekable();
    if matches.peek().is_none() {
        Persistence::New
    } else if matches.any(damped) {
        Persistence::FrequencyAndDamping
    } else {
        Persistence::Frequency
    }
}

/// The chart as an SVG document: the modes of each order over frequency, and vertical lines at the modes of the fit.
///
/// # Errors
/// When there is no order.
pub fn stability_svg(
    orders: &[Vec<OrderedMode>],
    fit_hz: &[f64],
    band_hz: (f64, f64),
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if orders.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let chart = chart(orders, fit_hz, band_hz);
    sheet_svg(title, subtitle, &[Row::new(420.0, vec![chart])])
}

fn chart(orders: &[Vec<OrderedMode>], fit_hz: &[f64], band_hz: (f64, f64)) -> Chart {
    let highest = orders.len().max(9) as f64 + 1.0;
    let x = Scale::logarithmic("Frequency (Hz)").within(low_end_hz(orders, band_hz), band_hz.1);
    let y = Scale::linear("Order (number of modes)").within(0.0, highest);
    let mut chart = Chart::new("", x, y);
    for (k, f) in fit_hz.iter().enumerate() {
        let name = if k == 0 {
            format!("the {} modes of the fit", fit_hz.len())
        } else {
            String::new()
        };
        chart = chart.line(
            &name,
            Pen::dashed(GREY).thin(),
            vec![(*f, 0.0), (*f, highest)],
        );
    }
    KINDS
        .into_iter()
        .fold(chart, |chart, (kind, name, colour, symbol)| {
            chart.points(name, colour, symbol, places(orders, kind))
        })
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
