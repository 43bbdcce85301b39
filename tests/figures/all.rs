//! All figures, made once for all tests.

use std::path::PathBuf;
use std::sync::OnceLock;

use bench_report::{Chart, Mark};
use thesis_figures::{Content, Figure, Runs, make_all, selected};

/// The folder of the figures, kept for inspection.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("figures")
}

/// Every figure of the registry, as `thesis-figures` makes it.
pub fn all() -> &'static [Figure] {
    static ALL: OnceLock<Vec<Figure>> = OnceLock::new();
    ALL.get_or_init(|| {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let entries = selected(&[]).expect("all");
        make_all(&entries, &folder(), &Runs::new(runs.path()), &mut |_, _| {}).expect("all figures")
    })
}

/// The content of one figure.
pub fn content(number: &str) -> &'static Content {
    let made = all()
        .iter()
        .find(|made| made.entry.number == number)
        .expect("in the registry");
    made.content().expect("a computed figure")
}

/// A chart of a figure by the beginning of its heading.
pub fn chart(number: &str, heading: &str) -> &'static Chart {
    let charts = content(number).rows.iter().flat_map(|row| &row.charts);
    charts
        .into_iter()
        .find(|chart| chart.heading.starts_with(heading))
        .expect("a chart of that heading")
}

/// The curves of a chart: lines with more than ten points.
pub fn curves(chart: &Chart) -> Vec<(&str, &[(f64, f64)])> {
    chart.marks.iter().filter_map(curve).collect()
}

fn curve(mark: &Mark) -> Option<(&str, &[(f64, f64)])> {
    match mark {
        Mark::Line { name, points, .. } if points.len() > 10 => Some((name, points)),
        _ => None,
    }
}

/// `count` evenly spaced points of a curve.
pub fn sampled(points: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    (0..count)
        .map(|k| points[(k * (points.len() - 1)) / (count - 1)])
        .collect()
}
