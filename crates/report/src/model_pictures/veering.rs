//! Two close modes as a setting varies: their frequencies, and those of all modes.

use super::{colour, setting_label, setting_text};
use crate::ReportError;
use crate::chart::colours::INK;
use crate::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use crate::labels::frequency_text;
use crate::number::significant;
use bench_thesis::veering::report::{VeeringPoint, VeeringReport};

const HEIGHT: f64 = 400.0;
/// Smallest gap that is written.
const MIN_GAP_HZ: f64 = 1e-3;

/// The frequencies of the two modes over the setting, with the place where they are closest, and beside it those of all modes, as an
/// SVG document.
///
/// # Errors
/// When there are no values.
pub fn veering_svg(
    report: &VeeringReport,
    vary: &str,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if report.values.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let point = &report.point;
    let pair = point.modes;
    let modes = |chart: Chart, is_shown: &dyn Fn(usize) -> bool| {
        let numbered = (1..).zip(&report.frequencies_hz);
        let shown = numbered.filter(|(mode, _)| is_shown(*mode));
        shown.fold(chart, |chart, (mode, frequencies_hz)| {
            let points = report
                .values
                .iter()
                .copied()
                .zip(frequencies_hz.iter().copied());
            let (name, pen) = (format!("mode {mode}"), Pen::solid(colour(mode - 1)));
            chart.line(&name, pen, points.collect())
        })
    };
    let closest = (point.value, point.frequency_hz);
    let name = format!("closest: gap {}", gap_text(point.gap_hz));
    let close = modes(chart("The close modes", vary), &|mode| pair.contains(&mode));
    let close = close.points(&name, INK, Symbol::Cross, vec![closest]);
    let all = modes(chart("All modes", vary), &|_| true);
    sheet_svg(title, subtitle, &[Row::new(HEIGHT, vec![close, all])])
}

/// What the picture shows, and how the two modes meet.
pub fn veering_caption(point: &VeeringPoint, vary: &str) -> String {
    let [first, second] = point.modes;
    let (verb, frequency) = (point.meeting.verb(), frequency_text(point.frequency_hz));
    let (place, gap) = (setting_text(vary, point.value), gap_text(point.gap_hz));
    format!(
        "Natural frequencies of modes {first} and {second} over {vary}, and beside them those of all modes. The two {verb} at \
         {place} (cross): mean frequency {frequency}, gap {gap}."
    )
}

/// The gap of two modes that cross is not exactly 0.
fn gap_text(gap_hz: f64) -> String {
    if gap_hz < MIN_GAP_HZ {
        format!("below {MIN_GAP_HZ} Hz")
    } else {
        format!("{} Hz", significant(gap_hz, 3))
    }
}

fn chart(heading: &str, vary: &str) -> Chart {
    let y = Scale::linear("Natural frequency (Hz)");
    Chart::new(heading, Scale::linear(&setting_label(vary)), y)
}
