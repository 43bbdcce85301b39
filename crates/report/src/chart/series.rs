//! Curves in pixels, thinned to what a screen can show.
//!
//! Of all points within one pixel column the first, the lowest, the highest and the last are drawn: the line covers the
//! same pixels as all points would, and no peak is lost.

use super::Points;
use super::mark::Stroke;

/// One point of a series, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub at: (f64, f64),
    /// Upper and lower end of the band.
    pub band: (f64, f64),
    pub faint: bool,
    /// Whether a gap precedes this point.
    pub starts: bool,
}

/// The drawn part of a pixel column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    points: Points,
    band: (f64, f64),
    faint: bool,
    starts: bool,
}

/// A continuous piece of a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece {
    pub points: Points,
    pub faint: bool,
}

/// The samples by pixel column.
pub(super) fn columns(samples: &[Sample]) -> Vec<Column> {
    samples
        .chunk_by(|a, b| a.at.0.floor() == b.at.0.floor() && !b.starts)
        .map(column)
        .collect()
}

fn column(samples: &[Sample]) -> Column {
    let points: Points = samples.iter().map(|sample| sample.at).collect();
    let faint = samples.iter().filter(|sample| sample.faint).count();
    let upper = samples.iter().map(|sample| sample.band.0);
    let lower = samples.iter().map(|sample| sample.band.1);
    Column {
        points: extremes(&points),
        band: (
            upper.fold(f64::INFINITY, f64::min),
            lower.fold(f64::NEG_INFINITY, f64::max),
        ),
        faint: 2 * faint > samples.len(),
        starts: samples[0].starts,
    }
}

/// A line of rising x, with at most four points for each pixel column.
pub(super) fn thinned(points: &[(f64, f64)]) -> Points {
    let columns = points.chunk_by(|a, b| a.0.floor() == b.0.floor());
    columns.flat_map(extremes).collect()
}

/// First, lowest, highest and last point, in their order and each once.
fn extremes(points: &[(f64, f64)]) -> Points {
    let by_y = |a: &usize, b: &usize| points[*a].1.total_cmp(&points[*b].1);
    let lowest = (0..points.len()).min_by(by_y).unwrap_or(0);
    let highest = (0..points.len()).max_by(by_y).unwrap_or(0);
    let mut indices = vec![0, lowest, highest, points.len() - 1];
    indices.sort_unstable();
    indices.dedup();
    indices.into_iter().map(|k| points[k]).collect()
}

/// The lines of a series, broken at gaps and where it turns faint or full.
pub(super) fn pieces(columns: &[Column]) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for column in columns {
        match pieces.last_mut().filter(|_| !column.starts) {
            Some(piece) if piece.faint == column.faint => piece.points.extend(&column.points),
            before => {
                let joint = before.and_then(|piece| piece.points.last().copied());
                pieces.push(piece_of(column, joint));
            }
        }
    }
    pieces
}

fn piece_of(column: &Column, joint: Option<(f64, f64)>) -> Piece {
    let points = joint.into_iter().chain(column.points.iter().copied());
    Piece {
        points: points.collect(),
        faint: column.faint,
    }
}

/// Outlines of the band around a series, one between each two gaps.
pub(super) fn bands(columns: &[Column]) -> Vec<Points> {
    columns
        .chunk_by(|_, next| !next.starts)
        .map(outline)
        .collect()
}

fn outline(columns: &[Column]) -> Points {
    let upper = columns.iter().map(|column| (middle(column), column.band.0));
    let lower = columns.iter().map(|column| (middle(column), column.band.1));
    upper.chain(lower.rev()).collect()
}

fn middle(column: &Column) -> f64 {
    let last = column.points[column.points.len() - 1];
    (column.points[0].0 + last.0) / 2.0
}

/// A line in the dashes of a stroke.
pub(super) fn dashes(stroke: Stroke, points: &[(f64, f64)]) -> Vec<Points> {
    match dash_pattern(stroke) {
        Some((on, off)) => dashed(points, on, off),
        None => vec![points.to_vec()],
    }
}

/// Pixels drawn and pixels left out; `None` for a continuous line.
pub(super) fn dash_pattern(stroke: Stroke) -> Option<(f64, f64)> {
    match stroke {
        Stroke::Solid => None,
        Stroke::Dashed => Some((7.0, 5.0)),
        Stroke::Dotted => Some((2.0, 3.5)),
    }
}

/// `on` pixels drawn, `off` pixels left out, along the length of a line.
fn dashed(points: &[(f64, f64)], on: f64, off: f64) -> Vec<Points> {
    let lengths = lengths(points);
    let total = lengths.last().copied().unwrap_or(0.0);
    let starts = (0..).map(|k| f64::from(k) * (on + off));
    let starts = starts.take_while(|start| *start < total);
    starts
        .map(|start| part(points, &lengths, start, (start + on).min(total)))
        .collect()
}

/// Length of a line from its beginning to each of its points.
fn lengths(points: &[(f64, f64)]) -> Vec<f64> {
    let mut length = 0.0;
    let mut all = vec![0.0];
    for pair in points.windows(2) {
        length += libm::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        all.push(length);
    }
    all
}

/// The part of a line between two lengths.
fn part(points: &[(f64, f64)], lengths: &[f64], from: f64, to: f64) -> Points {
    let first = lengths.partition_point(|length| *length <= from);
    let last = lengths.partition_point(|length| *length < to);
    let mut part = vec![point_at(points, lengths, from)];
    part.extend(&points[first..last]);
    part.push(point_at(points, lengths, to));
    part
}

/// The point of a line at a length. The line has two points at least, and its length is above 0.
fn point_at(points: &[(f64, f64)], lengths: &[f64], length: f64) -> (f64, f64) {
    let next = lengths
        .partition_point(|before| *before <= length)
        .min(points.len() - 1);
    let ((x0, y0), (x1, y1)) = (points[next - 1], points[next]);
    let step = lengths[next] - lengths[next - 1];
    let ratio = if step > 0.0 {
        (length - lengths[next - 1]) / step
    } else {
        0.0
    };
    (x0 + ratio * (x1 - x0), y0 + ratio * (y1 - y0))
}
