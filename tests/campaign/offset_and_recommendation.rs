//! Offset and recommendation on regions that are known in closed form.
use bench::experiment::campaign::{
    Judgement, Region, Tolerances, disagreeing, estimate_offset, recommend,
};

/// How exactly both can be set.
const TOLERANCES: Tolerances = Tolerances {
    asymmetry: 0.004,
    operating_point: 0.002,
};

fn even(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| low + (high - low) * k as f64 / (count - 1) as f64)
        .collect()
}

/// CNMP zeros from the asymmetry `border(Y)` on.
fn beyond(operating_points: &[f64], border: impl Fn(f64) -> f64) -> Region {
    let bands = operating_points
        .iter()
        .map(|&y| vec![[border(y), 0.3]])
        .collect();
    Region {
        operating_points: operating_points.into(),
        bands,
        searched: [-0.3, 0.3],
    }
}

fn curved(y: f64) -> f64 {
    0.05 - 8.0 * y * y
}

/// Verdicts without errors on the grid of section 5.2.2, of a stage with an offset.
fn table(made: f64) -> (Region, Vec<Judgement>) {
    let (points, asymmetries) = (even(0.0, 0.08, 15), even(-0.1, 0.1, 10));
    let judgement = |row: usize, asymmetry: f64| Judgement {
        row,
        asymmetry,
        detected: asymmetry + made >= curved(points[row]),
    };
    let all = (0..15)
        .flat_map(|row| asymmetries.iter().map(move |d| (row, *d)))
        .map(|(row, d)| judgement(row, d))
        .collect();
    (beyond(&points, curved), all)
}

#[test]
fn offset_interval_contains_exactly_the_offsets_that_agree_with_all_verdicts() {
    for made in [-0.02, -0.0043, 0.0, 0.031] {
        let (region, judgements) = table(made);
        let found = estimate_offset(&region, &judgements).expect("verdicts");
        // D + d >= border where detected, below it where excluded.
        let bound = |one: &Judgement| curved(region.operating_points[one.row]) - one.asymmetry;
        let low = judgements
            .iter()
            .filter(|one| one.detected)
            .map(bound)
            .fold(f64::MIN, f64::max);
        let high = judgements
            .iter()
            .filter(|one| !one.detected)
            .map(bound)
            .fold(f64::MAX, f64::min);
        assert!(
            (found.interval[0] - low).abs() < 1e-12 && (found.interval[1] - high).abs() < 1e-12,
            "{made}: {found:?}"
        );
        assert!((found.best - 0.5 * (low + high)).abs() < 1e-12);
        assert!(
            low <= made && made <= high && high - low < 0.01,
            "{made}: {low} to {high}"
        );
        assert_eq!(
            (found.contradicted, disagreeing(&region, &judgements, made)),
            (0, 0)
        );
        assert_eq!(found.decided, 150);
    }
}

#[test]
fn wrong_verdicts_widen_the_offset_interval_and_keep_the_truth_in_it() {
    let made = -0.02;
    let (region, mut judgements) = table(made);
    let narrow = estimate_offset(&region, &judgements)
        .expect("verdicts")
        .interval;
    // Every sixth, 25 of 150, on both sides of the border.
    judgements
        .iter_mut()
        .step_by(6)
        .for_each(|one| one.detected = !one.detected);
    let found = estimate_offset(&region, &judgements).expect("verdicts");
    let [low, high] = found.interval;
    assert!(low <= made && made <= high, "{found:?}");
    assert!(
        high - low >= narrow[1] - narrow[0] && high - low < 0.03,
        "{low} to {high}"
    );
    // As good as the truth, or better.
    assert!(
        found.contradicted <= disagreeing(&region, &judgements, made) && found.contradicted >= 20,
        "{found:?}"
    );
}

#[test]
fn no_offset_without_verdicts_and_no_bounds_without_a_border() {
    let (region, judgements) = table(0.0);
    assert_eq!(estimate_offset(&region, &[]), None);
    let nowhere = Region {
        bands: vec![Vec::new(); 15],
        ..region
    };
    let found = estimate_offset(&nowhere, &judgements).expect("verdicts");
    // Open at both ends: all offsets are as good.
    assert_eq!(found.interval, found.searched);
}

#[test]
fn recommends_the_middle_between_two_bands() {
    let points = even(0.0, 0.08, 41);
    let bands = vec![vec![[-0.3, -0.06], [0.1, 0.3]]; 41];
    let region = Region {
        operating_points: points,
        bands,
        searched: [-0.3, 0.3],
    };
    let candidates = even(-0.1, 0.1, 201);
    // The middle, less the initial asymmetry; half of the room, less half of the interval.
    for (offset, middle, room) in [
        ([0.0, 0.0], 0.02, 0.08),
        ([-0.02, -0.02], 0.04, 0.08),
        ([-0.03, -0.01], 0.04, 0.07),
    ] {
        let best = recommend(&region, [0.0, 0.08], &candidates, offset, TOLERANCES, &[])
            .expect("there is room");
        assert!((best.asymmetry - middle).abs() < 1e-9, "{best:?}");
        let distance = best.distance_tolerances.expect("a border");
        assert!(
            (distance - room / TOLERANCES.asymmetry).abs() < 1e-6,
            "{best:?}"
        );
        // The border as an intended asymmetry.
        let border = best.nearest.expect("a border")[1];
        assert!(
            ((border - best.asymmetry).abs() - room).abs() < 1e-9 && !best.at_the_end,
            "{best:?}"
        );
    }
}

#[test]
fn distance_to_a_straight_border_is_the_distance_to_a_line() {
    // Border D = 0.1 - 1.5 Y; the range ends at 8 % of L. From (D, 0.08), in tolerances t and q, the line is
    // (0.1 - 0.12 - D)/sqrt(t^2 + (1.5 q)^2) away. Rows 0.05 % apart miss its foot by a quarter of a tolerance at most:
    // sqrt(d^2 + 0.125^2) - d < 1e-3 for d > 8.
    let region = beyond(&even(0.0, 0.2, 401), |y| 0.1 - 1.5 * y);
    let best = recommend(
        &region,
        [0.0, 0.08],
        &even(-0.1, 0.1, 41),
        [0.0, 0.0],
        TOLERANCES,
        &[],
    )
    .expect("room");
    assert_eq!((best.asymmetry, best.at_the_end), (-0.1, true));
    let expected = 0.08 / f64::hypot(TOLERANCES.asymmetry, 1.5 * TOLERANCES.operating_point);
    let distance = best.distance_tolerances.expect("a border");
    assert!(
        distance >= expected - 1e-9 && distance < expected + 1e-3,
        "{distance} {expected}"
    );
}

#[test]
fn does_not_recommend_an_asymmetry_with_cnmp_zeros() {
    let everywhere = beyond(&even(0.0, 0.08, 9), |_| -0.3);
    let candidates = even(-0.1, 0.1, 21);
    assert_eq!(
        recommend(
            &everywhere,
            [0.0, 0.08],
            &candidates,
            [0.0, 0.0],
            TOLERANCES,
            &[]
        ),
        None
    );
    // Nor an asymmetry beside a point where they were detected, whatever the model predicts.
    let nowhere = Region {
        bands: vec![Vec::new(); 9],
        ..everywhere
    };
    let seen = [Judgement {
        row: 3,
        asymmetry: 0.001,
        detected: true,
    }];
    let best = recommend(
        &nowhere,
        [0.0, 0.08],
        &candidates,
        [0.0, 0.0],
        TOLERANCES,
        &seen,
    )
    .expect("room");
    assert!(
        (best.asymmetry.abs() - 0.01).abs() < 1e-12 && best.distance_tolerances.is_none(),
        "{best:?}"
    );
}
