//! What the charts carry for the cursor readout and the zoom of `plot.js`.

use bench_identify::Unit;
use bench_report::{
    Chart, Curve, Pen, Row, Scale, Symbol, Trace, bode_svg, colours, html, sheet_svg,
};
use nalgebra::Complex;

use crate::report::pictures::flat;
use crate::report::svg;

/// The groups of plots.
fn plots(svg: &str) -> Vec<&str> {
    let lines = svg.lines();
    lines
        .filter(|line| line.starts_with("<g class=\"plot\""))
        .collect()
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(' ')
        .filter_map(|word| word.parse().ok())
        .collect()
}

/// The place of a value on an axis between two places, by the attributes alone.
fn place(plot: &str, axis: &str, value: f64, (start, end): (f64, f64)) -> f64 {
    let text = svg::attribute(plot, axis).unwrap();
    let ends = numbers(text);
    let (low, high) = (ends[0], ends[1]);
    let ratio = if text.starts_with("log ") {
        (value / low).ln() / (high / low).ln()
    } else {
        (value - low) / (high - low)
    };
    start + ratio * (end - start)
}

fn place_in(plot: &str, (x, y): (f64, f64)) -> (f64, f64) {
    let sides = numbers(svg::attribute(plot, "data-box").unwrap());
    (
        place(plot, "data-x", x, (sides[0], sides[2])),
        place(plot, "data-y", y, (sides[3], sides[1])),
    )
}

fn assert_near(drawn: (f64, f64), expected: (f64, f64)) {
    // Drawn places are rounded to whole units, a tenth of a pixel.
    let distance = (drawn.0 - expected.0).hypot(drawn.1 - expected.1);
    assert!(distance <= 1.0, "{drawn:?} instead of {expected:?}");
}

#[test]
fn attributes_of_axes_place_a_value_where_it_is_drawn() {
    let line = vec![(2.0, 1e-4), (20.0, 3e-6)];
    for (x, y) in [
        (
            Scale::logarithmic("Frequency (Hz)").within(1.0, 100.0),
            Scale::logarithmic("Gain (m/A)").within(1e-7, 1e-3),
        ),
        (
            Scale::linear("Time (s)").within(0.0, 50.0),
            Scale::linear("Position (m)").within(-1e-4, 2e-4),
        ),
        (Scale::linear("Time (s)"), Scale::linear("Position (m)")),
    ] {
        let chart = Chart::new("", x, y).line("response", Pen::solid(colours::BLUE), line.clone());
        let svg = sheet_svg("", "", &[Row::new(300.0, vec![chart])]).unwrap();
        let drawn = svg::points(&svg, "polyline", "#0072B2");
        // The first line is the sample of the legend.
        let curve = drawn.last().unwrap();
        for (drawn, value) in curve.iter().zip(&line) {
            assert_near(*drawn, place_in(plots(&svg)[0], *value));
        }
    }
}

#[test]
fn panels_of_a_bode_plot_have_quantity_unit_one_frequency_axis_and_named_curves() {
    let (measured, frequency_hz) = (flat(), [1.0, 10.0, 100.0]);
    let response = [Complex::from(1e-4); 3];
    let model = Curve::Model {
        frequency_hz: &frequency_hz,
        response: &response,
    };
    let traces = [
        Trace::measured("a <b>", &measured),
        Trace {
            name: "model",
            curve: model,
        },
    ];
    let svg = bode_svg(Unit::MetresPerAmpere, &traces, "", "").unwrap();
    let plots = plots(&svg);
    let attribute = |name| -> Vec<&str> {
        plots
            .iter()
            .map(|plot| svg::attribute(plot, name).unwrap())
            .collect()
    };
    assert_eq!(attribute("data-x"), ["log 1e0 1e2"; 3]);
    assert_eq!(attribute("data-x-name"), ["Frequency"; 3]);
    assert_eq!(attribute("data-x-unit"), ["Hz"; 3]);
    assert_eq!(
        attribute("data-y-name"),
        ["Magnitude", "Phase", "Coherence"]
    );
    assert_eq!(attribute("data-y-unit"), ["m/A", "deg", ""]);
    let named = |name: &str| {
        svg.lines()
            .filter(|line| line.starts_with(&format!("<g data-name=\"{name}")))
            .count()
    };
    assert_eq!((named("a &lt;b&gt;"), named("model")), (3, 2));
}

#[test]
fn groups_of_marks_are_closed_and_hold_points_apart_from_curves() {
    let chart = Chart::new("", Scale::linear("x"), Scale::linear("y"))
        .points(
            "pole",
            colours::BLUE,
            Symbol::Cross,
            vec![(0.0, 0.0), (1.0, 1.0)],
        )
        .text((0.5, 0.5), (0.0, 0.0), "axis")
        .equal();
    let svg = sheet_svg("", "", &[Row::new(300.0, vec![chart])]).unwrap();
    assert_eq!(svg.matches("<g ").count(), svg.matches("</g>").count());
    assert_eq!(
        svg.matches("<g data-kind=\"points\" data-name=\"pole\">")
            .count(),
        1
    );
    assert!(plots(&svg)[0].contains("data-equal"));
    let anchor = svg
        .lines()
        .find_map(|line| svg::attribute(line, "data-at"))
        .unwrap();
    let at = anchor
        .split_once(',')
        .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()));
    assert_near(at.unwrap(), place_in(plots(&svg)[0], (0.5, 0.5)));
}

#[test]
fn a_page_with_plots_has_the_script_once() {
    let chart = Chart::new("", Scale::linear("x"), Scale::linear("y")).line(
        "a",
        Pen::solid(colours::BLUE),
        vec![(0.0, 0.0), (1.0, 1.0)],
    );
    let svg = sheet_svg("", "", &[Row::new(300.0, vec![chart])]).unwrap();
    let page = html::document_with_plots("two plots", &(svg.clone() + &svg));
    assert_eq!(page.matches("<script>").count(), 1);
    assert_eq!(page.matches("globalThis.attachPlots").count(), 1);
    assert_eq!(page.matches("prefers-color-scheme:dark){svg").count(), 1);
    assert!(!html::document("text", "<p>text</p>").contains("<script>"));
    // A script that ended early, or loaded another file, would break a page that works alone.
    let script = html::PLOT_SCRIPT;
    assert!(!script.contains("</script") && !script.contains("http") && !script.contains("import"));
    assert!(script.len() < 30_000);
}
