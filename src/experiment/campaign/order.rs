//! In which order a person goes through a grid.

use super::{Grid, Place};

/// The missing points so that least is moved: all asymmetries of one operating point before the weight changes, which then
/// changes by one step, and the asymmetries of the next one backwards, so that the masses stay on from row to row.
pub fn order(grid: &Grid, missing: &[Place]) -> Vec<Place> {
    let mut places = missing.to_vec();
    let point = |place: &Place| grid.operating_points[place.row];
    let asymmetry = |place: &Place| grid.asymmetries[place.column];
    places.sort_by(|a, b| {
        point(a)
            .total_cmp(&point(b))
            .then(a.row.cmp(&b.row))
            .then(asymmetry(a).total_cmp(&asymmetry(b)))
    });
    places
        .chunk_by_mut(|a, b| a.row == b.row)
        .skip(1)
        .step_by(2)
        .for_each(<[Place]>::reverse);
    places
}
