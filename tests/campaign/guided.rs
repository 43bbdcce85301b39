//! A campaign on a stage that an operator loads: every load is checked, and no check passes without evidence.
use std::cell::RefCell;
use std::collections::VecDeque;

use bench::config::{Config, Purpose, Source, load};
use bench::experiment::campaign::{
    CampaignError, Finding, Grid, GridPoint, GuidedCampaign, Load, LoadCheck, LoadedRig, Operator,
    PointResult, Question, Reply, RestPosition, StageModel, analyse_point, visit_order,
};
use bench::experiment::{Plan, run};
use bench::recording::Recording;
use bench::rig::simulated::SimulatedRig;
use bench::rt::thread::Pace;
use bench_hal::Validity;

use crate::faulty_rig::{Fault, FaultyRig};

/// The shortest chirp that passes over all modes, and the shortest quiet, at 1 kHz.
const SETS: [&str; 8] = [
    "loop.rate_hz=1000.0",
    "chirp.stop_hz=450.0",
    "chirp.start_hz=5",
    "chirp.duration_s=8",
    "chirp.fade_in_s=0.5",
    "chirp.quiet_after_s=2",
    "campaign.settle_s=1",
    "campaign.average_s=0.5",
];

fn config(more: &[&str]) -> Config {
    let sets = SETS.iter().chain(more).map(|set| set.to_string()).collect();
    load(&Source {
        sets,
        purpose: Purpose::Chirp,
        ..Source::default()
    })
    .expect("a configuration")
}

/// The actual load of the stage, and what pulls it in X.
#[derive(Clone, Copy, Default)]
struct Really {
    on: Load,
    askew_m: f64,
    /// The probe loses its target during a chirp.
    blind: bool,
}

/// What the operator of the script does before an answer.
type Does = Box<dyn Fn(&mut Really)>;

/// An operator who follows a script; at its end the answer is `stop`.
struct Scripted<'a> {
    really: &'a RefCell<Really>,
    script: VecDeque<(Does, Reply)>,
    asked: &'a RefCell<Vec<Question>>,
}

impl Operator for Scripted<'_> {
    fn ask(&mut self, question: &Question) -> Reply {
        self.asked.borrow_mut().push(question.clone());
        let Some((does, reply)) = self.script.pop_front() else {
            return Reply::Stop;
        };
        does(&mut self.really.borrow_mut());
        reply
    }

    fn tell(&mut self, _text: &str) {}
}

/// The simulated stage with the actual load; run, recorded and analysed as devices are.
struct Simulated<'a> {
    config: &'a Config,
    grid: &'a Grid,
    really: &'a RefCell<Really>,
    folder: tempfile::TempDir,
    chirps: usize,
    kept: Vec<(GridPoint, PointResult)>,
}

impl Simulated<'_> {
    /// The rig has the actual load; the plan has the requested one.
    fn rig(&self, config: &Config, chirps: bool) -> Box<FaultyRig<SimulatedRig>> {
        let really = *self.really.borrow();
        let model = StageModel::of(self.config).expect("a stage");
        let plant = model.loaded_plant(&really.on);
        let rig = SimulatedRig::new(&Config {
            plant,
            ..config.clone()
        })
        .expect("a rig");
        let blind =
            (really.blind && chirps).then_some((2000..u64::MAX, Fault::Says(Validity::OutOfRange)));
        let askew = (0..u64::MAX, Fault::Offset(really.askew_m));
        Box::new(FaultyRig::new(
            rig,
            &[askew].into_iter().chain(blind).collect::<Vec<_>>(),
        ))
    }
}

impl LoadedRig for Simulated<'_> {
    fn rest_position(&mut self) -> Result<Option<RestPosition>, CampaignError> {
        let plan = Plan::quiet(self.config.clone());
        let run = run(
            &plan,
            self.rig(self.config, false),
            Pace::Virtual,
            self.folder.path(),
            &mut |_, _| {},
        )
        .expect("a run");
        assert!(run.ended.trip.is_none());
        let path = run.path.clone();
        run.finish("{}").expect("a file");
        Ok(Some(RestPosition::of(
            &Recording::open(&path).expect("a recording"),
            "rest.mcap",
        )?))
    }

    fn measure(&mut self, place: GridPoint) -> Result<Option<PointResult>, CampaignError> {
        self.chirps += 1;
        let plan = Plan::chirp(self.grid.config_at(self.config, place)?);
        let rig = self.rig(&plan.config, true);
        let mut run = run(
            &plan,
            rig,
            Pace::Virtual,
            self.folder.path(),
            &mut |_, _| {},
        )
        .expect("a run");
        let result = analyse_point(&mut run, &plan.config).expect("a recording");
        Ok(Some(result))
    }

    fn keep(&mut self, place: GridPoint, point: &PointResult) -> Result<(), CampaignError> {
        self.kept.push((place, point.clone()));
        Ok(())
    }
}

/// What outcome of a campaign.
struct Outcome {
    asked: Vec<Question>,
    chirps: usize,
    kept: Vec<(GridPoint, PointResult)>,
}

impl Outcome {
    fn check(&self, index: usize) -> &LoadCheck {
        self.kept[index]
            .1
            .load_check
            .as_ref()
            .expect("a load check")
    }
}

fn campaign(
    config: &Config,
    grid: &Grid,
    places: &[GridPoint],
    script: Vec<(Does, Reply)>,
) -> Outcome {
    let (really, asked) = (RefCell::default(), RefCell::default());
    let mut operator = Scripted {
        really: &really,
        script: script.into(),
        asked: &asked,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = Simulated {
        config,
        grid,
        really: &really,
        folder,
        chirps: 0,
        kept: Vec::new(),
    };
    let mut guided = GuidedCampaign {
        config,
        grid,
        tolerance: 0.002,
        operator: &mut operator,
        rig,
    };
    guided.run(places).expect("a campaign");
    let (chirps, kept) = (guided.rig.chirps, guided.rig.kept);
    Outcome {
        asked: asked.into_inner(),
        chirps,
        kept,
    }
}

fn all(grid: &Grid) -> Vec<GridPoint> {
    visit_order(grid, &grid.points().collect::<Vec<_>>())
}

fn grid(points: &[f64], asymmetries: &[f64]) -> Grid {
    Grid::new(points.into(), asymmetries.into(), &config(&[])).expect("a grid")
}

/// Sets the load of a point.
fn puts(config: &Config, grid: &Grid, row: usize, column: usize) -> Does {
    let load = required(config, grid, row, column);
    Box::new(move |really| really.on = load)
}

fn required(config: &Config, grid: &Grid, row: usize, column: usize) -> Load {
    let there = grid.config_at(config, GridPoint { row, column });
    let there = there.expect("a point");
    StageModel::of(&there).expect("a stage").required_load()
}

fn nothing() -> Does {
    Box::new(|_| {})
}

const DONE: Reply = Reply::Done(None);

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
