//! Order of the points; skipped points and stopped campaigns.

use bench_experiment::campaign::{GridPoint, Reply};

use super::{DONE, Outcome, all, campaign, config, grid, no_action, set_required};

/// Rows of the stored points, in their order.
fn stored_rows(outcome: &Outcome) -> Vec<usize> {
    outcome.stored.iter().map(|(place, _)| place.row).collect()
}

#[test]
fn skipped_points_stay_missing_and_stopped_campaign_continues() {
    let (config, grid) = (config(&[]), grid(&[0.0, 0.08], &[0.0]));
    let script = vec![
        (no_action(), DONE),
        (no_action(), Reply::Skip),
        (set_required(&config, &grid, 1, 0), DONE),
    ];
    let outcome = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(stored_rows(&outcome), [1]);
    assert!(
        outcome.asked[2].text.contains("point 2 of 2") && outcome.asked[2].text.contains("add 3."),
        "{:?}",
        outcome.asked[2]
    );

    for script in [
        vec![],
        vec![(no_action(), DONE)],
        vec![(no_action(), DONE), (no_action(), Reply::Stop)],
    ] {
        let outcome = campaign(&config, &grid, &all(&grid), script);
        assert_eq!((outcome.stored.len(), outcome.chirps), (0, 0));
    }
    let first = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(no_action(), DONE), (no_action(), DONE)],
    );
    assert_eq!(
        first.stored.len(),
        1,
        "the script ends with `stop` at the second point"
    );
    let missing: Vec<GridPoint> = all(&grid)
        .into_iter()
        .filter(|place| *place != first.stored[0].0)
        .collect();
    let continued = campaign(
        &config,
        &grid,
        &missing,
        vec![
            (no_action(), DONE),
            (set_required(&config, &grid, 1, 0), DONE),
        ],
    );
    assert_eq!(stored_rows(&continued), [1]);
    assert!(
        campaign(&config, &grid, &[], vec![]).asked.is_empty(),
        "no point is missing, so that nothing is asked"
    );
}

#[test]
fn visit_order_changes_the_weight_once_per_row_and_keeps_the_masses_between_rows() {
    // The values of the grid are not sorted.
    let grid = grid(&[0.08, 0.0, 0.04], &[0.05, -0.05, 0.0, 0.1]);
    let places = all(&grid);
    assert_eq!(places.len(), 12);
    let weights: Vec<f64> = places
        .iter()
        .map(|place| grid.operating_points[place.row])
        .collect();
    let masses: Vec<f64> = places
        .iter()
        .map(|place| grid.asymmetries[place.column])
        .collect();
    assert_eq!(weights, [[0.0; 4], [0.04; 4], [0.08; 4]].concat());
    let rising = [-0.05, 0.0, 0.05, 0.1];
    let falling = [0.1, 0.05, 0.0, -0.05];
    assert_eq!(masses, [rising, falling, rising].concat());
}
