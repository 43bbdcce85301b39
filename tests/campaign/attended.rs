//! A campaign on a stage that a person loads: what was put on is checked, and nothing that was not seen is passed.
use std::cell::RefCell;
use std::collections::VecDeque;

use bench::config::{Config, Purpose, Source, load};
use bench::experiment::campaign::{
    AnswerError, Attended, CampaignError, Finding, Grid, Load, Person, Place, Point, PutOn,
    Question, Reply, Rest, Stage, measured, order,
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

/// What is really on the stage, and what pulls it in X.
#[derive(Clone, Copy, Default)]
struct Really {
    on: Load,
    askew_m: f64,
    /// The probe loses its target during a chirp.
    blind: bool,
}

/// What a person of the script does before an answer.
type Does = Box<dyn Fn(&mut Really)>;

/// A person who does and answers what stands in a script; at its end, `stop`.
struct Scripted<'a> {
    really: &'a RefCell<Really>,
    script: VecDeque<(Does, Reply)>,
    asked: &'a RefCell<Vec<Question>>,
}

impl Person for Scripted<'_> {
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

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Failed(String);

impl From<CampaignError> for Failed {
    fn from(error: CampaignError) -> Failed {
        Failed(error.to_string())
    }
}

impl From<AnswerError> for Failed {
    fn from(error: AnswerError) -> Failed {
        Failed(error.to_string())
    }
}

/// The simulated stage with whatever is really on it, run, recorded and analysed as devices are.
struct Simulated<'a> {
    config: &'a Config,
    grid: &'a Grid,
    really: &'a RefCell<Really>,
    folder: tempfile::TempDir,
    chirps: usize,
    kept: Vec<(Place, Point)>,
}

impl Simulated<'_> {
    /// The rig does what is on it; the plan knows only what it was asked to be.
    fn rig(&self, config: &Config, chirps: bool) -> Box<FaultyRig<SimulatedRig>> {
        let really = *self.really.borrow();
        let plant = really.on.carried(self.config).expect("a stage");
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

impl Stage for Simulated<'_> {
    type Error = Failed;

    fn rest(&mut self) -> Result<Option<Rest>, Failed> {
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
        Ok(Some(Rest::of(
            &Recording::open(&path).expect("a recording"),
            "rest.mcap",
        )?))
    }

    fn measure(&mut self, place: Place) -> Result<Option<Point>, Failed> {
        self.chirps += 1;
        let plan = Plan::chirp(self.grid.config(self.config, place)?);
        let rig = self.rig(&plan.config, true);
        let mut run = run(
            &plan,
            rig,
            Pace::Virtual,
            self.folder.path(),
            &mut |_, _| {},
        )
        .expect("a run");
        Ok(Some(measured(&mut run, &plan.config).expect("a recording")))
    }

    fn keep(&mut self, place: Place, point: &Point) -> Result<(), Failed> {
        self.kept.push((place, point.clone()));
        Ok(())
    }
}

/// What came of a campaign.
struct Came {
    asked: Vec<Question>,
    chirps: usize,
    kept: Vec<(Place, Point)>,
}

impl Came {
    fn put_on(&self, index: usize) -> &PutOn {
        self.kept[index].1.put_on.as_ref().expect("what was put on")
    }
}

fn campaign(config: &Config, grid: &Grid, places: &[Place], script: Vec<(Does, Reply)>) -> Came {
    let (really, asked) = (RefCell::default(), RefCell::default());
    let person = Scripted {
        really: &really,
        script: script.into(),
        asked: &asked,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let stage = Simulated {
        config,
        grid,
        really: &really,
        folder,
        chirps: 0,
        kept: Vec::new(),
    };
    let mut attended = Attended {
        config,
        grid,
        tolerance: 0.002,
        person,
        stage,
    };
    attended.go(places).expect("a campaign");
    let (chirps, kept) = (attended.stage.chirps, attended.stage.kept);
    Came {
        asked: asked.into_inner(),
        chirps,
        kept,
    }
}

fn all(grid: &Grid) -> Vec<Place> {
    order(grid, &grid.places().collect::<Vec<_>>())
}

fn grid(points: &[f64], asymmetries: &[f64]) -> Grid {
    Grid::new(points.into(), asymmetries.into(), &config(&[])).expect("a grid")
}

/// Puts on what a point needs.
fn puts(config: &Config, grid: &Grid, row: usize, column: usize) -> Does {
    let load =
        Load::of(&grid.config(config, Place { row, column }).expect("a point")).expect("a load");
    Box::new(move |really| really.on = load)
}

fn nothing() -> Does {
    Box::new(|_| {})
}

const DONE: Reply = Reply::Done(None);

#[test]
fn what_was_put_on_as_asked_is_told_from_none_by_the_modes_and_where_it_cannot_be_told_that_is_said()
 {
    // An asymmetry by manufacture that nobody knows of is within what is allowed.
    for made in ["0.0", "-0.02", "0.02"] {
        let config = config(&[&format!("sim.asymmetry_offset={made}")]);
        let grid = grid(&[0.0, 0.08], &[0.0, 0.1]);
        let places = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(row, column)| Place { row, column });
        assert_eq!(all(&grid), places);
        let mut script = vec![(nothing(), DONE)];
        script.extend(places.map(|place| (puts(&config, &grid, place.row, place.column), DONE)));
        let came = campaign(&config, &grid, &places, script);
        assert_eq!(
            (came.kept.len(), came.chirps, came.asked.len()),
            (4, 4, 5),
            "{:?}",
            came.asked.last()
        );
        assert!(came.asked[0].text.contains("nothing on"));
        for (index, expected) in [
            Finding::CannotTell,
            Finding::CannotTell,
            Finding::Holds,
            Finding::Holds,
        ]
        .iter()
        .enumerate()
        {
            let put_on = came.put_on(index);
            assert_eq!(put_on.finding(), *expected, "{made} {index} {put_on:?}");
            assert!(!put_on.confirmed_by_hand && put_on.read.is_none());
            // The stage rests where it did, which tells nothing of the weight.
            assert_eq!(put_on.rest.finding, Finding::CannotTell, "{put_on:?}");
            assert_eq!(put_on.rest.expected_m, 0.0);
            assert!(put_on.rest.seen_m.abs() < 0.5e-6, "{put_on:?}");
        }
        // At 8 % and with 10 % there are R, u and v to look at; u and v tell.
        let findings: Vec<Finding> = came
            .put_on(2)
            .modes
            .iter()
            .map(|mode| mode.finding)
            .collect();
        assert_eq!(
            findings,
            [Finding::CannotTell, Finding::Holds, Finding::Holds]
        );
        assert_eq!(
            came.put_on(0).modes.len(),
            1,
            "without a weight mode R is alone"
        );
    }
}

#[test]
fn a_weight_left_off_or_too_small_or_masses_on_the_wrong_stage_are_asked_for_again() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    let right = Load::of(
        &grid
            .config(&config, Place { row: 0, column: 0 })
            .expect("a point"),
    )
    .expect("a load");
    for (wrong, told) in [
        (
            Load {
                hung_kg: 0.0,
                ..right
            },
            "is not seen",
        ),
        (
            Load {
                hung_kg: 0.7 * right.hung_kg,
                ..right
            },
            "the mode expected at",
        ),
        // The same frequencies, mirrored: the signs tell.
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
        let came = campaign(&config, &grid, &all(&grid), script);
        assert_eq!(
            (came.asked.len(), came.chirps, came.kept.len()),
            (3, 2, 1),
            "{wrong:?}"
        );
        assert!(
            came.asked[2].text.contains(told) && came.asked[2].may_confirm,
            "{:?}",
            came.asked[2]
        );
        assert!(
            !came.asked[1].may_confirm,
            "nothing to confirm before anything failed"
        );
        let put_on = came.put_on(0);
        assert!(
            put_on.finding() == Finding::Holds && !put_on.confirmed_by_hand,
            "{put_on:?}"
        );
    }
}

#[test]
fn what_a_person_says_is_right_is_kept_as_said_by_hand_with_what_failed() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // The same chirp is kept that failed: nothing was moved.
    let script = vec![
        (nothing(), DONE),
        (nothing(), DONE),
        (nothing(), Reply::Right),
    ];
    let came = campaign(&config, &grid, &all(&grid), script);
    assert_eq!((came.asked.len(), came.chirps, came.kept.len()), (3, 1, 1));
    let put_on = came.put_on(0);
    assert!(
        put_on.confirmed_by_hand && put_on.finding() == Finding::Fails,
        "{put_on:?}"
    );
    let json = serde_json::to_value(&came.kept[0].1).expect("JSON");
    assert_eq!(json["put_on"]["confirmed_by_hand"], true);
    assert!(json["put_on"]["modes"][1]["expected_hz"].is_f64(), "{json}");
    let back: Point = serde_json::from_value(json).expect("a point");
    assert_eq!(
        back.put_on.as_ref().map(|put_on| put_on.load),
        Some(put_on.load)
    );
}

#[test]
fn what_a_person_says_of_the_rest_confirms_no_modes_and_a_displacement_that_was_read_stays_as_read()
{
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // Nothing is put on, but something touches the stage: `right` to that is no `right` to modes nobody has seen yet.
    let touched: Does = Box::new(|really| really.askew_m = 20e-6);
    let script = vec![
        (nothing(), DONE),
        (touched, DONE),
        (nothing(), Reply::Right),
        (puts(&config, &grid, 0, 0), DONE),
        (nothing(), Reply::Right),
    ];
    let came = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        (came.asked.len(), came.chirps, came.kept.len()),
        (5, 2, 1),
        "{:?}",
        came.asked.last()
    );
    assert!(
        !came.asked[2].text.contains("the mode expected")
            && came.asked[3].text.contains("is not seen"),
        "{:?}",
        came.asked
    );
    let put_on = came.put_on(0);
    assert!(
        put_on.confirmed_by_hand && put_on.rest.finding == Finding::Fails,
        "{put_on:?}"
    );
    assert!(
        put_on
            .modes
            .iter()
            .all(|mode| mode.finding != Finding::Fails),
        "{put_on:?}"
    );

    let read: (Does, Reply) = (puts(&config, &grid, 0, 0), Reply::Done(Some(3.6e-3)));
    let came = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(nothing(), DONE), read, (nothing(), Reply::Right)],
    );
    assert_eq!(
        (came.asked.len(), came.chirps, came.kept.len()),
        (3, 1, 1),
        "{:?}",
        came.asked.last()
    );
    let put_on = came.put_on(0);
    assert!(
        put_on.confirmed_by_hand && put_on.finding() == Finding::Fails,
        "{put_on:?}"
    );
    assert_eq!(
        put_on.read.as_ref().map(|read| (read.seen_m, read.finding)),
        Some((3.6e-3, Finding::Fails))
    );
}

#[test]
fn a_chirp_that_tripped_is_told_as_such_and_not_as_a_load_alone() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    let load = puts(&config, &grid, 0, 0);
    let blind: Does = Box::new(move |really| {
        load(really);
        really.blind = true;
    });
    let sees: Does = Box::new(|really| really.blind = false);
    let came = campaign(
        &config,
        &grid,
        &all(&grid),
        vec![(nothing(), DONE), (blind, DONE), (sees, DONE)],
    );
    assert_eq!(
        (came.asked.len(), came.chirps, came.kept.len()),
        (3, 2, 1),
        "{:?}",
        came.asked.last()
    );
    assert!(
        came.asked[2].text.contains("tripped"),
        "{:?}",
        came.asked[2]
    );
    assert!(came.put_on(0).finding() == Finding::Holds && !came.put_on(0).confirmed_by_hand);
}

#[test]
fn a_cable_that_pulls_askew_is_told_before_the_chirp_and_so_is_a_displacement_read_wrong() {
    let (config, grid) = (config(&[]), grid(&[0.08], &[0.1]));
    // 34 N askew by 0.02 rad are 9.5 um at 72 N/mm, and 2 um may drift.
    for (shift_m, fails) in [(8e-6, false), (-8e-6, false), (20e-6, true), (-20e-6, true)] {
        let load = puts(&config, &grid, 0, 0);
        let askew: Does = Box::new(move |really| {
            load(really);
            really.askew_m = shift_m;
        });
        let straight: Does = Box::new(|really| really.askew_m = 0.0);
        let came = campaign(
            &config,
            &grid,
            &all(&grid),
            vec![(nothing(), DONE), (askew, DONE), (straight, DONE)],
        );
        assert_eq!(
            (came.asked.len(), came.chirps, came.kept.len()),
            (2 + usize::from(fails), 1, 1),
            "{shift_m}"
        );
        if fails {
            assert!(
                came.asked[2].text.contains("the cable pulls in X"),
                "{:?}",
                came.asked[2]
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
        let came = campaign(&config, &grid, &all(&grid), script);
        assert_eq!(
            (came.asked.len(), came.chirps, came.kept.len()),
            (2 + usize::from(fails), 1, 1),
            "{read_m}"
        );
        assert_eq!(
            came.put_on(0).read.as_ref().map(|read| read.finding),
            Some(Finding::Holds)
        );
    }
}

#[test]
fn skipped_points_are_missing_and_a_campaign_that_was_stopped_goes_on_with_what_is_missing() {
    let (config, grid) = (config(&[]), grid(&[0.0, 0.08], &[0.0]));
    let script = vec![
        (nothing(), DONE),
        (nothing(), Reply::Skip),
        (puts(&config, &grid, 1, 0), DONE),
    ];
    let came = campaign(&config, &grid, &all(&grid), script);
    assert_eq!(
        came.kept
            .iter()
            .map(|(place, _)| place.row)
            .collect::<Vec<_>>(),
        [1]
    );
    assert!(
        came.asked[2].text.contains("point 2 of 2") && came.asked[2].text.contains("put on 3."),
        "{:?}",
        came.asked[2]
    );

    for script in [
        vec![],
        vec![(nothing(), DONE)],
        vec![(nothing(), DONE), (nothing(), Reply::Stop)],
    ] {
        let came = campaign(&config, &grid, &all(&grid), script);
        assert_eq!((came.kept.len(), came.chirps), (0, 0));
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
    let missing: Vec<Place> = all(&grid)
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
fn the_weight_changes_once_a_row_and_the_masses_never_between_rows() {
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
