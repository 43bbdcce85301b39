//! The order in which an operator visits the points of a grid.

use super::grid::{Grid, GridPoint};

/// The points in the order with the fewest changes of the load: all asymmetries of one operating point before the weight
/// changes to the next operating point, and every second row backwards, so that the masses stay from row to row.
pub fn visit_order(grid: &Grid, points: &[GridPoint]) -> Vec<GridPoint> {
    let mut points = points.to_vec();
    let operating_point = |point: &GridPoint| grid.operating_points[point.row];
    let asymmetry = |point: &GridPoint| grid.asymmetries[point.column];
    points.sort_by(|a, b| {
        let by_weight = operating_point(a).total_cmp(&operating_point(b));
        by_weight
            .then(a.row.cmp(&b.row))
            .then(asymmetry(a).total_cmp(&asymmetry(b)))
    });
    let rows = points.chunk_by_mut(|a, b| a.row == b.row);
    rows.skip(1).step_by(2).for_each(<[GridPoint]>::reverse);
    points
}
