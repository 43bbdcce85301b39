//! Attributes of a chart for `plot.js`: where its axes lie, what they show, and which mark is which curve.

use super::Chart;
use super::axis::Axis;
use super::canvas::to_units;
use super::mark::{Mark, Pen};
use super::plot_area::PlotArea;
use super::scale::{Scale, ScaleKind};
use super::series::dash_pattern;
use crate::html::escaped;

/// Box and axes of a chart. The box (left, top, right, bottom) is in units of the view box: tenths of a pixel.
pub(super) fn plot(chart: &Chart, area: &PlotArea) -> String {
    let frame = area.frame;
    let sides = [frame.left, frame.top, frame.right, frame.bottom].map(to_units);
    let [left, top, right, bottom] = sides;
    let x = axis("x", &chart.x, &area.x);
    let y = axis("y", &chart.y, &area.y);
    let equal = if chart.equal { " data-equal=\"\"" } else { "" };
    format!("class=\"plot\" data-box=\"{left} {top} {right} {bottom}\" {x} {y}{equal}")
}

/// Kind, range, quantity and unit of an axis.
fn axis(which: &str, scale: &Scale, axis: &Axis) -> String {
    let (kind, (low, high)) = (kind(scale.kind), axis.ends());
    let (name, unit) = quantity_and_unit(&scale.label);
    let (name, unit) = (escaped(name), escaped(unit));
    format!(
        "data-{which}=\"{kind} {low:e} {high:e}\" data-{which}-name=\"{name}\" data-{which}-unit=\"{unit}\""
    )
}

fn kind(kind: ScaleKind) -> &'static str {
    match kind {
        ScaleKind::Linear | ScaleKind::Count => "linear",
        ScaleKind::Logarithmic => "log",
        ScaleKind::Degrees => "degrees",
        ScaleKind::Blank => "blank",
    }
}

/// `Frequency (Hz)` as `Frequency` and `Hz`; a label without a unit has an empty one.
fn quantity_and_unit(label: &str) -> (&str, &str) {
    let inside = label.strip_suffix(')');
    inside
        .and_then(|inside| inside.rsplit_once(" ("))
        .unwrap_or((label, ""))
}

/// The group of a mark. Areas, and curves without a name, need none.
pub(super) fn mark(mark: &Mark, area: &PlotArea) -> Option<String> {
    match mark {
        Mark::Line { name, pen, .. }
        | Mark::Series { name, pen, .. }
        | Mark::Arrow { name, pen, .. } => curve(name, *pen),
        Mark::Points { name, .. } => Some(format!(
            "data-kind=\"points\" data-name=\"{}\"",
            escaped(name)
        )),
        Mark::Text { at, .. } => text(area.place(at)),
        Mark::Area { .. } | Mark::Cells { .. } => None,
    }
}

fn curve(name: &str, pen: Pen) -> Option<String> {
    let dash = dash_pattern(pen.stroke).map(|(on, off)| {
        let [on, off] = [on, off].map(to_units);
        format!(" data-dash=\"{on} {off}\"")
    });
    let name = escaped(name);
    (!name.is_empty()).then(|| format!("data-name=\"{name}\"{}", dash.unwrap_or_default()))
}

/// The place that a text moves with.
fn text((x, y): (f64, f64)) -> Option<String> {
    let (left, top) = (to_units(x), to_units(y));
    (x.is_finite() && y.is_finite()).then(|| format!("data-at=\"{left},{top}\""))
}

#[cfg(test)]
mod tests {
    use super::quantity_and_unit;

    #[test]
    fn splits_a_label_into_quantity_and_unit() {
        for (label, expected) in [
            ("Frequency (Hz)", ("Frequency", "Hz")),
            ("Real part of H (µm/A)", ("Real part of H", "µm/A")),
            ("Coherence", ("Coherence", "")),
            ("", ("", "")),
        ] {
            assert_eq!(quantity_and_unit(label), expected);
        }
    }
}
