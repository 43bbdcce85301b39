//! Curves in pixels, thinned out to what a screen can show.
//!
//! Of all samples within one pixel column, the first, the least, the greatest and the last are drawn: the line covers
//! the same pixels as if all were, and no peak is lost however narrow.

/// One sample of a curve, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub x: f64,
    pub y: f64,
    /// Ends of the band around it, upper end first; both equal to `y` without one.
    pub band: (f64, f64),
    /// Known too badly to be drawn in full.
    pub faint: bool,
    /// Whether the line begins anew here, after a gap.
    pub begins: bool,
}

/// What is drawn of a pixel column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub points: Vec<(f64, f64)>,
    pub band: (f64, f64),
    pub faint: bool,
    pub begins: bool,
}

/// A piece of line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stroke {
    pub points: Vec<(f64, f64)>,
    pub faint: bool,
}

/// The samples by pixel column.
pub(super) fn columns(samples: &[Sample]) -> Vec<Column> {
    samples
        .chunk_by(|a, b| a.x.floor() == b.x.floor() && !b.begins)
        .map(column)
        .collect()
}

fn column(samples: &[Sample]) -> Column {
    let faint = samples.iter().filter(|sample| sample.faint).count() * 2 > samples.len();
    let upper = samples
        .iter()
        .map(|sample| sample.band.0)
        .fold(f64::INFINITY, f64::min);
    let lower = samples
        .iter()
        .map(|sample| sample.band.1)
        .fold(f64::NEG_INFINITY, f64::max);
    Column {
        points: extremes(samples),
        band: (upper, lower),
        faint,
        begins: samples[0].begins,
    }
}

/// First, least, greatest and last, in their order and each once.
fn extremes(samples: &[Sample]) -> Vec<(f64, f64)> {
    let by_y = |a: &usize, b: &usize| samples[*a].y.total_cmp(&samples[*b].y);
    let least = (0..samples.len()).min_by(by_y).unwrap_or(0);
    let greatest = (0..samples.len()).max_by(by_y).unwrap_or(0);
    let mut kept = [0, least, greatest, samples.len() - 1];
    kept.sort_unstable();
    kept.chunk_by(|a, b| a == b)
        .map(|same| (samples[same[0]].x, samples[same[0]].y))
        .collect()
}

/// The lines of a curve, broken at gaps and where it turns faint or firm.
pub(super) fn strokes(columns: &[Column]) -> Vec<Stroke> {
    let mut strokes: Vec<Stroke> = Vec::new();
    for column in columns {
        let joins = |stroke: &&mut Stroke| !column.begins && stroke.faint == column.faint;
        if let Some(stroke) = strokes.last_mut().filter(joins) {
            stroke.points.extend(&column.points);
            continue;
        }
        let from = strokes
            .last()
            .filter(|_| !column.begins)
            .and_then(|stroke| stroke.points.last().copied());
        let points = from
            .into_iter()
            .chain(column.points.iter().copied())
            .collect();
        strokes.push(Stroke {
            points,
            faint: column.faint,
        });
    }
    strokes
}

/// Outlines of the band around a curve, one for each stretch between gaps.
pub(super) fn bands(columns: &[Column]) -> Vec<Vec<(f64, f64)>> {
    let stretches = columns.chunk_by(|_, b| !b.begins);
    stretches.map(outline).collect()
}

fn outline(columns: &[Column]) -> Vec<(f64, f64)> {
    let middle =
        |column: &Column| (column.points[0].0 + column.points[column.points.len() - 1].0) / 2.0;
    let upper = columns.iter().map(|column| (middle(column), column.band.0));
    let lower = columns
        .iter()
        .rev()
        .map(|column| (middle(column), column.band.1));
    upper.chain(lower).collect()
}

/// The dashes of a line: `on` pixels drawn, `off` left out, along its length.
pub(super) fn dashed(points: &[(f64, f64)], (on, off): (f64, f64)) -> Vec<Vec<(f64, f64)>> {
    let along = lengths(points);
    let total = along.last().copied().unwrap_or(0.0);
    let starts = (0..)
        .map(|k| f64::from(k) * (on + off))
        .take_while(|start| *start < total);
    starts
        .map(|start| piece(points, &along, start, (start + on).min(total)))
        .collect()
}

/// Length of a line from its beginning to each of its points.
fn lengths(points: &[(f64, f64)]) -> Vec<f64> {
    let mut length = 0.0;
    let steps = points
        .windows(2)
        .map(|pair| libm::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1));
    let after = steps.map(|step| {
        length += step;
        length
    });
    core::iter::once(0.0).chain(after).collect()
}

/// The part of a line between two lengths.
fn piece(points: &[(f64, f64)], along: &[f64], from: f64, to: f64) -> Vec<(f64, f64)> {
    let inner = along.partition_point(|length| *length <= from)
        ..along.partition_point(|length| *length < to);
    let ends = [from, to].map(|length| point_at(points, along, length));
    core::iter::once(ends[0])
        .chain(points[inner].iter().copied())
        .chain([ends[1]])
        .collect()
}

/// The point of a line at a length between 0 and that of the whole, which is not 0: there are two points at least, and
/// the first is not above any length.
fn point_at(points: &[(f64, f64)], along: &[f64], length: f64) -> (f64, f64) {
    let next = along
        .partition_point(|before| *before <= length)
        .min(points.len() - 1);
    let ((x0, y0), (x1, y1)) = (points[next - 1], points[next]);
    let step = along[next] - along[next - 1];
    let part = if step > 0.0 {
        (length - along[next - 1]) / step
    } else {
        0.0
    };
    (x0 + part * (x1 - x0), y0 + part * (y1 - y0))
}
