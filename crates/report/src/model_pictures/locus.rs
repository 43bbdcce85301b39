//! The locus of zeros: where they lie in the complex plane as a setting varies, and their parts over the setting.

use nalgebra::Complex;

use super::{colour, setting_label, setting_number};
use crate::ReportError;
use crate::chart::colours::{GREY, INK};
use crate::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use crate::labels::spread;
use bench_plant::zeros::Locus;

const PLANE_HEIGHT: f64 = 420.0;
const PARTS_HEIGHT: f64 = 260.0;
/// Zeros beyond this multiple of the magnitude that 90 % of them do not exceed are not drawn: they pass through infinity.
const FAR: f64 = 1.5;
/// Values of the setting that are written along a track, and their least distance as a ratio of the size of the chart.
const LABELS: usize = 6;
const LABEL_DISTANCE: f64 = 0.09;
/// Pixels from a point to the left end of its text.
const LABEL_OFFSET: (f64, f64) = (6.0, -11.0);
/// The real or the imaginary part of a zero.
type Part = fn(Complex<f64>) -> f64;

const NOWHERE: (f64, f64) = (f64::NAN, f64::NAN);

/// The zeros in the complex plane, with the setting written at some places and its direction shown by arrows, and below the real and
/// imaginary parts over the setting, as an SVG document.
///
/// # Errors
/// When there are no zeros.
pub fn locus_svg(
    locus: &Locus,
    vary: &str,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if locus.tracks.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let limit_rad_s = limit_rad_s(locus);
    let near = |s: &Option<Complex<f64>>| s.filter(|s| s.norm() <= limit_rad_s);
    let tracks: Vec<Vec<Option<Complex<f64>>>> = locus
        .tracks
        .iter()
        .map(|track| track.iter().map(near).collect())
        .collect();
    let parts: [(&str, Part); 2] = [
        ("Real part of s (rad/s)", |s| s.re),
        ("Imaginary part of s (rad/s)", |s| s.im),
    ];
    let parts = parts.map(|(label, part)| over_setting(locus, &tracks, vary, label, part));
    let rows = [
        Row::new(PLANE_HEIGHT, vec![plane(locus, &tracks, limit_rad_s)]),
        Row::new(PARTS_HEIGHT, parts.to_vec()),
    ];
    sheet_svg(title, subtitle, &rows)
}

fn limit_rad_s(locus: &Locus) -> f64 {
    let all = locus.tracks.iter().flatten().flatten();
    let mut magnitudes: Vec<f64> = all.map(|s| s.norm()).filter(|m| m.is_finite()).collect();
    magnitudes.sort_by(f64::total_cmp);
    let index = magnitudes.len() * 9 / 10;
    magnitudes.get(index).map_or(0.0, |most| FAR * most)
}

fn plane(locus: &Locus, tracks: &[Vec<Option<Complex<f64>>>], limit_rad_s: f64) -> Chart {
    let x = Scale::linear("Real part of s (rad/s)");
    let y = Scale::linear("Imaginary part of s (rad/s)");
    let mut chart = Chart::new("", x, y);
    for (k, track) in tracks.iter().enumerate() {
        let (name, pen) = (format!("zero {}", k + 1), Pen::solid(colour(k)));
        let points = track.iter().map(|s| s.map_or(NOWHERE, |s| (s.re, s.im)));
        chart = chart.directed(&name, pen, points.collect());
        let ends = [track.iter().flatten().next(), track.iter().flatten().last()];
        for (symbol, s) in [Symbol::Ring, Symbol::Dot].into_iter().zip(ends) {
            if let Some(s) = s {
                chart = chart.points("", colour(k), symbol, vec![(s.re, s.im)]);
            }
        }
    }
    chart = with_values(chart, locus, tracks);
    let changes = locus.changes.iter().map(|change| change.s);
    let near = changes.filter(|s| s.norm() <= limit_rad_s);
    let places: Vec<(f64, f64)> = near.map(|s| (s.re, s.im)).collect();
    let (first, last) = (locus.values[0], locus.values[locus.values.len() - 1]);
    let [first, last] = [first, last].map(setting_number);
    chart.heading = format!("From {first} (ring) to {last} (dot)");
    if places.is_empty() {
        chart
    } else {
        chart.points("change of the kind", INK, Symbol::Cross, places)
    }
}

/// Values of the setting at the track that moves most.
fn with_values(mut chart: Chart, locus: &Locus, tracks: &[Vec<Option<Complex<f64>>>]) -> Chart {
    let size = size(tracks);
    let scaled = |s: Complex<f64>| Complex::new(s.re / size.re, s.im / size.im);
    let tracks = tracks.iter();
    let tracks = tracks.map(|track| track.iter().map(|s| s.map(scaled)).collect());
    let tracks: Vec<Vec<Option<Complex<f64>>>> = tracks.collect();
    let longest = tracks.iter().max_by(|a, b| length(a).total_cmp(&length(b)));
    let Some(track) = longest else {
        return chart;
    };
    let distance = LABEL_DISTANCE.max(length(track) / LABELS as f64);
    let places = locus.values.iter().zip(track);
    let places = places.filter_map(|(value, s)| Some((*value, (*s)?)));
    for (value, s) in spread(places, distance, LABELS) {
        let at = (s.re * size.re, s.im * size.im);
        chart = chart.text_from(at, LABEL_OFFSET, &setting_number(value));
    }
    chart
}

/// The extent of all tracks along both axes.
fn size(tracks: &[Vec<Option<Complex<f64>>>]) -> Complex<f64> {
    let points = || tracks.iter().flatten().flatten();
    let extent = |part: Part| {
        let low = points().map(|s| part(*s)).fold(f64::INFINITY, f64::min);
        let high = points().map(|s| part(*s)).fold(f64::NEG_INFINITY, f64::max);
        (high - low).max(f64::MIN_POSITIVE)
    };
    Complex::new(extent(|s| s.re), extent(|s| s.im))
}

fn length(track: &[Option<Complex<f64>>]) -> f64 {
    let pairs = track.windows(2);
    let steps = pairs.filter_map(|pair| Some((pair[1]? - pair[0]?).norm()));
    steps.sum()
}

fn over_setting(
    locus: &Locus,
    tracks: &[Vec<Option<Complex<f64>>>],
    vary: &str,
    label: &str,
    part: Part,
) -> Chart {
    let ends = [locus.values[0], locus.values[locus.values.len() - 1]];
    let zero = ends.map(|value| (value, 0.0)).to_vec();
    let chart = Chart::new(
        "",
        Scale::linear(&setting_label(vary)),
        Scale::linear(label),
    )
    .without_legend()
    .line("", Pen::solid(GREY).thin(), zero);
    tracks.iter().enumerate().fold(chart, |chart, (k, track)| {
        let points = locus.values.iter().zip(track);
        let points = points.map(|(value, s)| s.map_or(NOWHERE, |s| (*value, part(s))));
        let name = format!("zero {}", k + 1);
        chart.line(&name, Pen::solid(colour(k)), points.collect())
    })
}
