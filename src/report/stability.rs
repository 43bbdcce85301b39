//! The stability chart: the modes at each order, and which of them stay from one order to the next.

use super::chart::{Chart, Pen, Scale, Symbol};
use super::colours::{BLUE, GREY, ORANGE, VERMILION};
use super::sheet::{Row, sheet_svg};
use super::{Mark, ReportError};

/// A mode stays whose frequency and damping change by less than these ratios.
const STAYS: (f64, f64) = (0.01, 0.05);

/// A mode of an order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderedMode {
    /// Undamped natural frequency in hertz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// How far a mode is what it was at the order before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stays {
    /// Frequency and damping.
    Whole,
    /// The frequency alone.
    Frequency,
    /// It was not there.
    New,
}

/// What became of a mode since the order before.
pub fn stays(mode: &OrderedMode, before: &[OrderedMode]) -> Stays {
    let close = |a: f64, b: f64, ratio: f64| (a - b).abs() <= ratio * b.abs();
    let same = |old: &&OrderedMode| close(mode.frequency_hz, old.frequency_hz, STAYS.0);
    let damped = |old: &OrderedMode| close(mode.damping_ratio, old.damping_ratio, STAYS.1);
    let mut old = before.iter().filter(same).peekable();
    match (old.peek().is_some(), old.any(damped)) {
        (false, _) => Stays::New,
        (true, false) => Stays::Frequency,
        (true, true) => Stays::Whole,
    }
}

/// The chart as an SVG document: each order's modes over frequency, lines where the modes of the fit are.
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
    sheet_svg(
        title,
        subtitle,
        &[Row::new(420.0, vec![chart(orders, fit_hz, band_hz)])],
    )
}

fn chart(orders: &[Vec<OrderedMode>], fit_hz: &[f64], band_hz: (f64, f64)) -> Chart {
    let highest = orders.len().max(9) as f64 + 1.0;
    let mut chart = Chart::new(
        "",
        Scale::logarithmic("Frequency (Hz)").within(from_hz(orders, band_hz), band_hz.1),
        Scale::linear("Order (number of modes)").within(0.0, highest),
    );
    let mut name = format!("the {} modes of the fit", fit_hz.len());
    for f in fit_hz {
        let pen = Pen::dashed(GREY).thin();
        chart = chart.mark(Mark::Line {
            name: std::mem::take(&mut name),
            pen,
            points: vec![(*f, 0.0), (*f, highest)],
            directed: false,
        });
    }
    let kinds = [
        (
            Stays::New,
            "new, or moved by more than 1 %",
            ORANGE,
            Symbol::Cross,
        ),
        (
            Stays::Frequency,
            "frequency stays within 1 %",
            VERMILION,
            Symbol::Ring,
        ),
        (
            Stays::Whole,
            "frequency and damping (5 %) stay",
            BLUE,
            Symbol::Dot,
        ),
    ];
    kinds
        .into_iter()
        .fold(chart, |chart, (kind, name, colour, symbol)| {
            chart.points(name, colour, symbol, places(orders, kind))
        })
}

/// Half of the lowest mode that swings, or the band's lower end where that is higher: below is nothing to see.
fn from_hz(orders: &[Vec<OrderedMode>], band_hz: (f64, f64)) -> f64 {
    let swinging = orders
        .iter()
        .flatten()
        .map(|mode| mode.frequency_hz)
        .filter(|f| *f > 0.0);
    let lowest = swinging.fold(band_hz.1, f64::min);
    band_hz.0.max(0.5 * lowest)
}

/// The modes of a kind: frequency in hertz, and order.
fn places(orders: &[Vec<OrderedMode>], kind: Stays) -> Vec<(f64, f64)> {
    let before = |k: usize| if k == 0 { &[][..] } else { &orders[k - 1][..] };
    let of = |(k, modes): (usize, &Vec<OrderedMode>)| {
        let kept = modes.iter().filter(|mode| stays(mode, before(k)) == kind);
        kept.map(|mode| (mode.frequency_hz, (k + 1) as f64))
            .collect::<Vec<_>>()
    };
    orders.iter().enumerate().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_stays_whole_by_frequency_alone_or_not_at_all() {
        let mode = |frequency_hz, damping_ratio| OrderedMode {
            frequency_hz,
            damping_ratio,
        };
        let before = [mode(100.0, 0.01), mode(50.0, 0.02)];
        for (now, expected) in [
            (mode(100.9, 0.0104), Stays::Whole),
            (mode(100.9, 0.0106), Stays::Frequency),
            (mode(101.1, 0.01), Stays::New),
            (mode(50.0, 0.02), Stays::Whole),
        ] {
            assert_eq!(stays(&now, &before), expected, "{now:?}");
        }
        assert_eq!(stays(&before[0], &[]), Stays::New);
    }
}
