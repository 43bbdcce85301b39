//! The check of the load at one point.

use bench_experiment::campaign::{Finding, GridPoint, Load, PointResult, Reply};

use super::{Action, DONE, all, campaign, config, grid, no_action, required, set_required};

#[test]
fn load_check_is_inconclusive_unless_modes_differ_from_the_unloaded_stage() {
    // An unknown asymmetry of the built stage is within the tolerances.
    for built in ["0.0", "-0.02", "0.02"] {
        let config = config(&[&format!("sim.asymmetry_offset={built}")]);
        let grid = grid(&[0.0, 0.08], &[0.0, 0.1]);
        let places =
            [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(row, column)| GridPoint { row, column });
        assert_eq!(all(&grid), places);
        let mut script = vec![(no_action(), DONE)];
        script.extend(
            places.map(|place| (set_required(&config, &grid, place.row, place.column), DONE)),
        );
        let outcome = campaign(&config, &grid, &places, script);
        assert_eq!(
            (outcome.stored.len(), outcome.chirps, outcome.asked.len()),
            (4, 4, 5),
            "{:?}",
            outcome.asked.last()
        );
        assert!(outcome.asked[0].text.contains("unloaded stage"));
        for (index, expected) in [
            Finding::CannotTell,
            Finding::CannotTell,
            Finding::Holds,
            Finding::Holds,
        ]
        .iter()
        .enumerate()
        {
            let check = outcome.check(index);
            assert_eq!(check.finding(), *expected, "{built} {index} {check:?}");
            assert!(!check.confirmed_by_hand && check.read.is_none());
            // The rest position in X is 0 with and without the weight, so that it does not distinguish them.
            assert_eq!(check.rest.finding, Finding::CannotTell, "{check:?}");
            assert_eq!(check.rest.expected_m, 0.0);
            assert!(check.rest.seen_m.abs() < 0.5e-6, "{check:?}");
        }
        // At Y1o = 8 % of L and D = 10 %, R, u and v are compared; u and v differ from those of the unloaded stage.
        let findings: Vec<Finding> = outcome
            .check(2)
            .modes
            .iter()
            .map(|mode| mode.finding)
            .collect();
        assert_eq!(
            findings,
            [Finding::CannotTell, Finding::Holds, Finding::Holds]
        );
        assert_eq!(
            outcome.check(0).modes.len(),
            1,
            "without a weight mode R is alone"
        );
    }
}

#[test]
fn asks_again_for_a_missing_weight_or_masses_on_the_wrong_stage() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    let right = required(&config, &grid, 0, 0);
    for (wrong, message) in [
        (
            Load {
                hung_kg: 0.0,
                ..right
            },
            "is missing",
        ),
        (
            Load {
                hung_kg: 0.7 * right.hung_kg,
                ..right
            },
            "the mode expected at",
        ),
        // Mirrored masses: the same frequencies, only the signs of the residues differ.
        (
            Load {
                on_m2_kg: 0.0,
                on_m3_kg: right.on_m2_kg,
                ..right
            },
            "residue",
        ),
        (
            Load {
                on_m2_kg: 0.0,
                ..right
            },
            "the mode expected at",
        ),
    ] {
        let set_wrong: Action = Box::new(move |actual| actual.load = wrong);
        let script = vec![
            (no_action(), DONE),
            (set_wrong, DONE),
            (set_required(&config, &grid, 0, 0), DONE),
        ];
        let outcome = campaign(&config, &grid, &all(&grid), script);
        assert_eq!(
            (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
            (3, 2, 1),
            "{wrong:?}"
        );
        assert!(
            outcome.asked[2].text.contains(message) && outcome.asked[2].may_confirm,
            "{:?}",
            outcome.asked[2]
        );
        assert!(
            !outcome.asked[1].may_confirm,
            "nothing to confirm before a check failed"
        );
        let check = outcome.check(0);
        assert!(
            check.finding() == Finding::Holds && !check.confirmed_by_hand,
            "{check:?}"
        );
    }
}

#[test]
fn stores_failed_checks_of_manually_confirmed_load() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // The chirp of the failed check is stored: the load did not change since.
    let script = vec![
        (no_action(), DONE),
        (no_action(), DONE),
        (no_action(), Reply::Right),
    ];
    let outcome = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
        (3, 1, 1)
    );
    let check = outcome.check(0);
    assert!(
        check.confirmed_by_hand && check.finding() == Finding::Fails,
        "{check:?}"
    );
    let json = serde_json::to_value(&outcome.stored[0].1).expect("JSON");
    assert_eq!(json["load_check"]["confirmed_by_hand"], true);
    assert!(
        json["load_check"]["modes"][1]["expected_hz"].is_f64(),
        "{json}"
    );
    let back: PointResult = serde_json::from_value(json).expect("a point");
    assert_eq!(
        back.load_check.as_ref().map(|check| check.load),
        Some(check.load)
    );
}

#[test]
fn confirming_the_rest_position_does_not_confirm_the_modes() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // No load, and something touches the stage: the reply `right` to that does not confirm modes that are not measured yet.
    let touch: Action = Box::new(|actual| actual.shift_x_m = 20e-6);
    let script = vec![
        (no_action(), DONE),
        (touch, DONE),
        (no_action(), Reply::Right),
        (set_required(&config, &grid, 0, 0), DONE),
        (no_action(), Reply::Right),
    ];
    let outcome = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
        (5, 2, 1),
        "{:?}",
        outcome.asked.last()
    );
    assert!(
        !outcome.asked[2].text.contains("the mode expected")
            && outcome.asked[3].text.contains("is missing"),
        "{:?}",
        outcome.asked
    );
    let check = outcome.check(0);
    assert!(
        check.confirmed_by_hand && check.rest.finding == Finding::Fails,
        "{check:?}"
    );
    assert!(
        check
            .modes
            .iter()
            .all(|mode| mode.finding != Finding::Fails),
        "{check:?}"
    );

    let read: (Action, Reply) = (
        set_required(&config, &grid, 0, 0),
        Reply::Done(Some(3.6e-3)),
    );
    let outcome = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(no_action(), DONE), read, (no_action(), Reply::Right)],
    );
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
        (3, 1, 1),
        "{:?}",
        outcome.asked.last()
    );
    let check = outcome.check(0);
    assert!(
        check.confirmed_by_hand && check.finding() == Finding::Fails,
        "{check:?}"
    );
    assert_eq!(
        check.read.as_ref().map(|read| (read.seen_m, read.finding)),
        Some((3.6e-3, Finding::Fails))
    );
}

#[test]
fn reports_a_tripped_chirp_with_its_reason() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    let set_load = set_required(&config, &grid, 0, 0);
    let lose_target: Action = Box::new(move |actual| {
        set_load(actual);
        actual.loses_target = true;
    });
    let restore_target: Action = Box::new(|actual| actual.loses_target = false);
    let outcome = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![
            (no_action(), DONE),
            (lose_target, DONE),
            (restore_target, DONE),
        ],
    );
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
        (3, 2, 1),
        "{:?}",
        outcome.asked.last()
    );
    assert!(
        outcome.asked[2].text.contains("tripped"),
        "{:?}",
        outcome.asked[2]
    );
    assert!(outcome.check(0).finding() == Finding::Holds && !outcome.check(0).confirmed_by_hand);
}

#[test]
fn reports_a_misaligned_cable_and_a_wrong_displacement_before_the_chirp() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // Limit: 34 N misaligned by 0.02 rad shift the stage by 9.5 um at 72 N/mm; 2 um are allowed for drift.
    for (shift_m, fails) in [(8e-6, false), (-8e-6, false), (20e-6, true), (-20e-6, true)] {
        let set_load = set_required(&config, &grid, 0, 0);
        let misalign: Action = Box::new(move |actual| {
            set_load(actual);
            actual.shift_x_m = shift_m;
        });
        let align: Action = Box::new(|actual| actual.shift_x_m = 0.0);
        let outcome = campaign(
            &config,
            &grid,
            &all(&grid),
            vec![(no_action(), DONE), (misalign, DONE), (align, DONE)],
        );
        assert_eq!(
            (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
            (2 + usize::from(fails), 1, 1),
            "{shift_m}"
        );
        if fails {
            assert!(
                outcome.asked[2].text.contains("the cable pulls in X"),
                "{:?}",
                outcome.asked[2]
            );
        }
    }
    // Required: 8 % of L = 47.5 mm, which is 3.8 mm. Tolerance: 0.2 % of L, 95 um.
    for (read_m, fails) in [
        (3.72e-3, false),
        (3.88e-3, false),
        (3.6e-3, true),
        (0.0, true),
        (f64::NAN, true),
    ] {
        let script = vec![
            (no_action(), DONE),
            (
                set_required(&config, &grid, 0, 0),
                Reply::Done(Some(read_m)),
            ),
            (no_action(), Reply::Done(Some(3.8e-3))),
        ];
        let outcome = campaign(&config, &grid, &all(&grid), script);
        assert_eq!(
            (outcome.asked.len(), outcome.chirps, outcome.stored.len()),
            (2 + usize::from(fails), 1, 1),
            "{read_m}"
        );
        assert_eq!(
            outcome.check(0).read.as_ref().map(|read| read.finding),
            Some(Finding::Holds)
        );
    }
}
