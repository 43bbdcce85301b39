//! Offset and recommendation for CNMP regions given in closed form.
use bench_experiment::campaign::{
    Judgement, Region, Tolerances, disagreeing, estimate_offset, recommend,
};

/// Tolerances of asymmetry and operating point.
const TOLERANCES: Tolerances = Tolerances {
    asymmetry: 0.004,
    operating_point: 0.002,
};

fn even(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| low + (high - low) * k as f64 / (count - 1) as f64)
        .collect()
}

/// A region with CNMP zeros at and above the asymmetry `border(Y)`.
fn region_above(operating_points: &[f64], border: impl Fn(f64) -> f64) -> Region {
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

/// Correct verdicts on the grid of section 5.2.2, for a stage with an asymmetry offset.
fn verdicts(offset: f64) -> (Region, Vec<Judgement>) {
    let (points, asymmetries) = (even(0.0, 0.08, 15), even(-0.1, 0.1, 10));
    let judgement = |row: usize, asymmetry: f64| Judgement {
        row,
        asymmetry,
        detected: asymmetry + offset >= curved(points[row]),
    };
    let all = (0..15)
        .flat_map(|row| asymmetries.iter().map(move |d| (row, *d)))
        .map(|(row, d)| judgement(row, d))
        .collect();
    (region_above(&points, curved), all)
}

#[test]
fn offset_interval_contains_exactly_the_offsets_that_agree_with_all_verdicts() {
    for offset in [-0.02, -0.0043, 0.0, 0.031] {
        let (region, judgements) = verdicts(offset);
        let found = estimate_offset(&region, &judgements).expect("verdicts");
        // D + offset >= border where detected, D + offset < border where excluded.
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
            "{offset}: {found:?}"
        );
        assert!((found.best - 0.5 * (low + high)).abs() < 1e-12);
        assert!(
            low <= offset && offset <= high && high - low < 0.01,
            "{offset}: {low} to {high}"
        );
        assert_eq!(
            (
                found.contradicted,
                disagreeing(&region, &judgements, offset)
            ),
            (0, 0)
        );
        assert_eq!(found.decided, 150);
    }
}

#[test]
fn offset_interval_contains_the_true_offset_despite_wrong_verdicts() {
    let offset = -0.02;
    let (region, mut judgements) = verdicts(offset);
    let narrow = estimate_offset(&region, &judgements)
        .expect("verdicts")
        .interval;
    // Every sixth verdict is inverted: 25 of 150, on both sides of the border.
    judgements
        .iter_mut()
        .step_by(6)
        .for_each(|one| one.detected = !one.detected);
    let found = estimate_offset(&region, &judgements).expect("verdicts");
    let [low, high] = found.interval;
    assert!(low <= offset && offset <= high, "{found:?}");
    assert!(
        high - low >= narrow[1] - narrow[0] && high - low < 0.03,
        "{low} to {high}"
    );
    // The best offset disagrees with at most as many verdicts as the true offset.
    assert!(
        found.contradicted <= disagreeing(&region, &judgements, offset) && found.contradicted >= 20,
        "{found:?}"
    );
}

#[test]
fn no_offset_without_verdicts_and_no_limits_without_a_border() {
    let (region, judgements) = verdicts(0.0);
    assert_eq!(estimate_offset(&region, &[]), None);
    let nowhere = Region {
        bands: vec![Vec::new(); 15],
        ..region
    };
    let found = estimate_offset(&nowhere, &judgements).expect("verdicts");
    // All offsets agree equally well, so that the interval is the whole search range.
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
    // Expected asymmetry: the middle of the gap minus the offset. Expected distance: half of the gap minus half of the offset interval.
    for (offset, middle, distance) in [
        ([0.0, 0.0], 0.02, 0.08),
        ([-0.02, -0.02], 0.04, 0.08),
        ([-0.03, -0.01], 0.04, 0.07),
    ] {
        let best =
            recommend(&region, [0.0, 0.08], &candidates, offset, TOLERANCES, &[]).expect("a gap");
        assert!((best.asymmetry - middle).abs() < 1e-9, "{best:?}");
        let in_tolerances = best.distance_tolerances.expect("a border");
        assert!(
            (in_tolerances - distance / TOLERANCES.asymmetry).abs() < 1e-6,
            "{best:?}"
        );
        // The border as an intended asymmetry.
        let border = best.nearest.expect("a border")[1];
        assert!(
            ((border - best.asymmetry).abs() - distance).abs() < 1e-9 && !best.at_the_end,
            "{best:?}"
        );
    }
}

#[test]
fn distance_to_a_straight_border_equals_the_closed_form() {
    // Border D = 0.1 - 1.5 Y; the range ends at Y = 8 % of L. With the tolerances t of D and q of Y, the distance from (D, 0.08) to the
    // line is (0.1 - 0.12 - D)/sqrt(t^2 + (1.5 q)^2). Rows are 0.05 % of L apart, a quarter of q, so that the nearest row is at most
    // 0.125 from the foot of the perpendicular: sqrt(d^2 + 0.125^2) - d < 1e-3 for d > 8.
    let region = region_above(&even(0.0, 0.2, 401), |y| 0.1 - 1.5 * y);
    let best = recommend(
        &region,
        [0.0, 0.08],
        &even(-0.1, 0.1, 41),
        [0.0, 0.0],
        TOLERANCES,
        &[],
    )
    .expect("an asymmetry without CNMP zeros");
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
    let everywhere = region_above(&even(0.0, 0.08, 9), |_| -0.3);
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
    // Asymmetries next to a point with detected CNMP zeros are not recommended either, whatever the model predicts.
    let nowhere = Region {
        bands: vec![Vec::new(); 9],
        ..everywhere
    };
    let detected = [Judgement {
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
        &detected,
    )
    .expect("an asymmetry without CNMP zeros");
    assert!(
        (best.asymmetry.abs() - 0.01).abs() < 1e-12 && best.distance_tolerances.is_none(),
        "{best:?}"
    );
}
