//! Order of the points; skipped points and stopped campaigns.

use bench::experiment::campaign::{GridPoint, Reply};

use super::{DONE, all, campaign, config, grid, nothing, puts};

#[test]
fn skipped_points_stay_missing_and_a_stopped_campaign_continues() {
    let (config, grid) = (config(&[]), grid(&[0.0, 0.08], &[0.0]));
    let script = vec![
        (nothing(), DONE),
        (nothing(), Reply::Skip),
        (puts(&config, &grid, 1, 0), DONE),
    ];
    let outcome = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        outcome
            .kept
            .iter()
            .map(|(place, _)| place.row)
            .collect::<Vec<_>>(),
        [1]
    );
    assert!(
        outcome.asked[2].text.contains("point 2 of 2") && outcome.asked[2].text.contains("add 3."),
        "{:?}",
        outcome.asked[2]
    );

    for script in [
        vec![],
        vec![(nothing(), DONE)],
        vec![(nothing(), DONE), (nothing(), Reply::Stop)],
    ] {
        let outcome = campaign(&config, &grid, &all(&grid), script);
        assert_eq!((outcome.kept.len(), outcome.chirps), (0, 0));
    }
    let first = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(nothing(), DONE), (nothing(), DONE)],
    );
    assert_eq!(
        first.kept.len(),
        1,
        "the script ends with `stop` at the second point"
    );
    let missing: Vec<GridPoint> = all(&grid)
        .into_iter()
        .filter(|place| *place != first.kept[0].0)
        .collect();
    let then = campaign(
        &config,
        &grid,
        &missing,
        vec![(nothing(), DONE), (puts(&config, &grid, 1, 0), DONE)],
    );
    assert_eq!(
        then.kept
            .iter()
            .map(|(place, _)| place.row)
            .collect::<Vec<_>>(),
        [1]
    );
    assert!(
        campaign(&config, &grid, &[], vec![]).asked.is_empty(),
        "nothing missing, nothing asked"
    );
}

#[test]
fn visit_order_changes_the_weight_once_a_row_and_no_mass_between_rows() {
    // In any order of the grid's own values.
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
    let up = [-0.05, 0.0, 0.05, 0.1];
    let down = [0.1, 0.05, 0.0, -0.05];
    assert_eq!(masses, [up, down, up].concat());
}
