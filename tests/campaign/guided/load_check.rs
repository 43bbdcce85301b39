//! The check of the load at one point.

use bench::experiment::campaign::{Finding, GridPoint, Load, PointResult, Reply};

use super::{DONE, Does, all, campaign, config, grid, nothing, puts, required};

#[test]
fn modes_distinguish_the_requested_load_from_none_or_the_check_cannot_tell() {
    // An unknown asymmetry by manufacture is within the tolerances.
    for made in ["0.0", "-0.02", "0.02"] {
        let config = config(&[&format!("sim.asymmetry_offset={made}")]);
        let grid = grid(&[0.0, 0.08], &[0.0, 0.1]);
        let places =
            [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(row, column)| GridPoint { row, column });
        assert_eq!(all(&grid), places);
        let mut script = vec![(nothing(), DONE)];
        script.extend(places.map(|place| (puts(&config, &grid, place.row, place.column), DONE)));
        let outcome = campaign(&config, &grid, &places, script);
        assert_eq!(
            (outcome.kept.len(), outcome.chirps, outcome.asked.len()),
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
            assert_eq!(check.finding(), *expected, "{made} {index} {check:?}");
            assert!(!check.confirmed_by_hand && check.read.is_none());
            // The rest position does not change, which proves nothing about the weight.
            assert_eq!(check.rest.finding, Finding::CannotTell, "{check:?}");
            assert_eq!(check.rest.expected_m, 0.0);
            assert!(check.rest.seen_m.abs() < 0.5e-6, "{check:?}");
        }
        // At 8 % and with 10 % there are R, u and v to look at; u and v tell.
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
    for (wrong, told) in [
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
        // The same frequencies, mirrored: only the signs differ.
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
        let does: Does = Box::new(move |really| really.on = wrong);
        let script = vec![
            (nothing(), DONE),
            (does, DONE),
            (puts(&config, &grid, 0, 0), DONE),
        ];
        let outcome = campaign(&config, &grid, &all(&grid), script);
        assert_eq!(
            (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
            (3, 2, 1),
            "{wrong:?}"
        );
        assert!(
            outcome.asked[2].text.contains(told) && outcome.asked[2].may_confirm,
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
fn keeps_a_confirmed_load_with_its_failed_checks() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // The same chirp is kept that failed: nothing was moved.
    let script = vec![
        (nothing(), DONE),
        (nothing(), DONE),
        (nothing(), Reply::Right),
    ];
    let outcome = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
        (3, 1, 1)
    );
    let check = outcome.check(0);
    assert!(
        check.confirmed_by_hand && check.finding() == Finding::Fails,
        "{check:?}"
    );
    let json = serde_json::to_value(&outcome.kept[0].1).expect("JSON");
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
    // No load, and something touches the stage: `right` to that does not confirm modes that are not measured yet.
    let touched: Does = Box::new(|really| really.askew_m = 20e-6);
    let script = vec![
        (nothing(), DONE),
        (touched, DONE),
        (nothing(), Reply::Right),
        (puts(&config, &grid, 0, 0), DONE),
        (nothing(), Reply::Right),
    ];
    let outcome = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
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

    let read: (Does, Reply) = (puts(&config, &grid, 0, 0), Reply::Done(Some(3.6e-3)));
    let outcome = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(nothing(), DONE), read, (nothing(), Reply::Right)],
    );
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
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
    let load = puts(&config, &grid, 0, 0);
    let blind: Does = Box::new(move |really| {
        load(really);
        really.blind = true;
    });
    let sees: Does = Box::new(|really| really.blind = false);
    let outcome = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(nothing(), DONE), (blind, DONE), (sees, DONE)],
    );
    assert_eq!(
        (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
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
    // 34 N askew by 0.02 rad are 9.5 um at 72 N/mm, and 2 um may drift.
    for (shift_m, fails) in [(8e-6, false), (-8e-6, false), (20e-6, true), (-20e-6, true)] {
        let load = puts(&config, &grid, 0, 0);
        let askew: Does = Box::new(move |really| {
            load(really);
            really.askew_m = shift_m;
        });
        let straight: Does = Box::new(|really| really.askew_m = 0.0);
        let outcome = campaign(
            &config,
            &grid,
            &all(&grid),
            vec![(nothing(), DONE), (askew, DONE), (straight, DONE)],
        );
        assert_eq!(
            (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
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
    // 8 % of 47.5 mm are 3.8 mm; 0.2 % of it, 95 um, are allowed.
    for (read_m, fails) in [
        (3.72e-3, false),
        (3.88e-3, false),
        (3.6e-3, true),
        (0.0, true),
        (f64::NAN, true),
    ] {
        let script = vec![
            (nothing(), DONE),
            (puts(&config, &grid, 0, 0), Reply::Done(Some(read_m))),
            (nothing(), Reply::Done(Some(3.8e-3))),
        ];
        let outcome = campaign(&config, &grid, &all(&grid), script);
        assert_eq!(
            (outcome.asked.len(), outcome.chirps, outcome.kept.len()),
            (2 + usize::from(fails), 1, 1),
            "{read_m}"
        );
        assert_eq!(
            outcome.check(0).read.as_ref().map(|read| read.finding),
            Some(Finding::Holds)
        );
    }
}
