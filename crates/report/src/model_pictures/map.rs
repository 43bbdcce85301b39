//! The CNMP map: the number of pairs of CNMP zeros over operating point and mass asymmetry.

use crate::ReportError;
use crate::chart::colours::{Colour, ORANGE, PURPLE, SKY, UNMARKED, VERMILION};
use crate::chart::{Chart, Mark, Row, Scale, sheet_svg};

const HEIGHT: f64 = 520.0;
const PERCENT: f64 = 100.0;
/// Colours of no pair, one, two, three and more pairs.
const COLOURS: [Colour; 5] = [UNMARKED, SKY, ORANGE, VERMILION, PURPLE];

/// Pairs of CNMP zeros on a grid.
#[derive(Clone, Copy, Debug)]
pub struct CnmpMap<'a> {
    /// Operating points as ratios of the beam length.
    pub operating_points: &'a [f64],
    /// Mass asymmetries m2/m3 - 1.
    pub asymmetries: &'a [f64],
    /// Number of pairs: a row for each operating point.
    pub pairs: &'a [Vec<u8>],
}

/// The map as an SVG document: the operating point to the right, the asymmetry upward, both in %. Each point of the grid is the middle
/// of a cell.
///
/// # Errors
/// When the grid is empty.
pub fn map_svg(map: &CnmpMap<'_>, title: &str, subtitle: &str) -> Result<String, ReportError> {
    if map.operating_points.is_empty() || map.asymmetries.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let points = rising(map.operating_points);
    let asymmetries = rising(map.asymmetries);
    let row = |asymmetry: &usize| -> Vec<usize> {
        let pairs = points.iter().map(|point| map.pairs[*point][*asymmetry]);
        pairs
            .map(|pairs| usize::from(pairs).min(COLOURS.len() - 1))
            .collect()
    };
    let rows: Vec<Vec<usize>> = asymmetries.iter().map(row).collect();
    let most = rows.iter().flatten().copied().max().unwrap_or(0);
    let (x, y) = (
        edges(map.operating_points, &points),
        edges(map.asymmetries, &asymmetries),
    );
    let chart = Chart::new(
        "",
        Scale::linear("Operating point Y1o/L (%)").within(x[0], x[x.len() - 1]),
        Scale::linear("Mass asymmetry m2/m3 − 1 (%)").within(y[0], y[y.len() - 1]),
    )
    .mark(Mark::Cells {
        x,
        y,
        rows,
        colours: colours(most),
    });
    sheet_svg(title, subtitle, &[Row::new(HEIGHT, vec![chart])])
}

/// The names and colours of no pair up to a number of pairs.
fn colours(most: usize) -> Vec<(String, Colour)> {
    let name = |pairs: usize| match pairs {
        0 => "no CNMP zeros".to_string(),
        1 => "1 pair of CNMP zeros".to_string(),
        pairs if pairs + 1 == COLOURS.len() => format!("{pairs} pairs or more"),
        pairs => format!("{pairs} pairs"),
    };
    let all = COLOURS.iter().enumerate().take(most + 1);
    all.map(|(pairs, colour)| (name(pairs), *colour)).collect()
}

/// The indices of values in rising order.
fn rising(values: &[f64]) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..values.len()).collect();
    indices.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    indices
}

/// The edges in % between neighbouring values; the outer ones are as far from their values as the next ones.
fn edges(values: &[f64], rising: &[usize]) -> Vec<f64> {
    let percent: Vec<f64> = rising.iter().map(|k| PERCENT * values[*k]).collect();
    let middles: Vec<f64> = percent.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    let (first, last) = (percent[0], percent[percent.len() - 1]);
    let (Some(low), Some(high)) = (middles.first(), middles.last()) else {
        return vec![first - 0.5, first + 0.5];
    };
    let (below, above) = (2.0 * first - low, 2.0 * last - high);
    let inner = middles.iter().copied();
    std::iter::once(below).chain(inner).chain([above]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lie_in_the_middle_of_neighbours_in_rising_order() {
        let values = [0.02, 0.01, 0.0];
        let order = rising(&values);
        assert_eq!(order, [2, 1, 0]);
        assert_eq!(edges(&values, &order), [-0.5, 0.5, 1.5, 2.5]);
        assert_eq!(edges(&[0.08], &[0]), [7.5, 8.5]);
    }
}
