//! A campaign on a stage that an operator loads: every load is checked, and no check passes without a measurement that distinguishes the
//! load from none.

mod load_check;
mod progress;

use std::cell::RefCell;
use std::collections::VecDeque;

use bench_config::{Config, Purpose, Source, load};
use bench_experiment::campaign::{
    CampaignError, Grid, GridPoint, GuidedCampaign, Load, LoadCheck, LoadedRig, Operator,
    PointResult, Question, Reply, RestPosition, StageModel, analyse_point, visit_order,
};
use bench_experiment::{Plan, run};
use bench_hal::Validity;
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;

use crate::campaign::faulty_rig::{Fault, FaultyRig};

/// The shortest chirp over all modes and the shortest quiet intervals, at 1 kHz.
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

/// The actual load of the stage, and its shift in X.
#[derive(Clone, Copy, Default)]
struct ActualLoad {
    load: Load,
    /// Displacement in X, as of a misaligned cable.
    shift_x_m: f64,
    /// The probe loses its target during a chirp.
    loses_target: bool,
}

/// A change of the actual load that the operator makes before an answer.
type Action = Box<dyn Fn(&mut ActualLoad)>;

/// An operator who follows a script; after its end every answer is `stop`.
struct Scripted<'a> {
    actual: &'a RefCell<ActualLoad>,
    script: VecDeque<(Action, Reply)>,
    asked: &'a RefCell<Vec<Question>>,
}

impl Operator for Scripted<'_> {
    fn ask(&mut self, question: &Question) -> Reply {
        self.asked.borrow_mut().push(question.clone());
        let Some((action, reply)) = self.script.pop_front() else {
            return Reply::Stop;
        };
        action(&mut self.actual.borrow_mut());
        reply
    }

    fn report(&mut self, _text: &str) {}
}

/// The simulated stage with the actual load; it is run, recorded and analysed like devices.
struct Simulated<'a> {
    config: &'a Config,
    grid: &'a Grid,
    actual: &'a RefCell<ActualLoad>,
    folder: tempfile::TempDir,
    chirps: usize,
    stored: Vec<(GridPoint, PointResult)>,
}

impl Simulated<'_> {
    /// The rig has the actual load; the plan has the requested one.
    fn rig(&self, config: &Config, chirps: bool) -> Box<FaultyRig<SimulatedRig>> {
        let actual = *self.actual.borrow();
        let model = StageModel::of(self.config).expect("a stage");
        let plant = model.loaded_plant(&actual.load);
        let rig = SimulatedRig::new(&Config {
            plant,
            ..config.clone()
        })
        .expect("a rig");
        let lost = (actual.loses_target && chirps)
            .then_some((2000..u64::MAX, Fault::Validity(Validity::OutOfRange)));
        let shift = (0..u64::MAX, Fault::Offset(actual.shift_x_m));
        Box::new(FaultyRig::new(
            rig,
            &[shift].into_iter().chain(lost).collect::<Vec<_>>(),
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
        assert!(run.end.servo.trip.is_none());
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

    fn store(&mut self, place: GridPoint, point: &PointResult) -> Result<(), CampaignError> {
        self.stored.push((place, point.clone()));
        Ok(())
    }
}

/// Outcome of a campaign: the questions, the number of chirps and the stored points.
struct Outcome {
    asked: Vec<Question>,
    chirps: usize,
    stored: Vec<(GridPoint, PointResult)>,
}

impl Outcome {
    fn check(&self, index: usize) -> &LoadCheck {
        self.stored[index]
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
    script: Vec<(Action, Reply)>,
) -> Outcome {
    let (actual, asked) = (RefCell::default(), RefCell::default());
    let mut operator = Scripted {
        actual: &actual,
        script: script.into(),
        asked: &asked,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = Simulated {
        config,
        grid,
        actual: &actual,
        folder,
        chirps: 0,
        stored: Vec::new(),
    };
    let mut guided = GuidedCampaign {
        config,
        grid,
        tolerance: 0.002,
        operator: &mut operator,
        rig,
    };
    guided.run(places).expect("a campaign");
    let (chirps, stored) = (guided.rig.chirps, guided.rig.stored);
    Outcome {
        asked: asked.into_inner(),
        chirps,
        stored,
    }
}

fn all(grid: &Grid) -> Vec<GridPoint> {
    visit_order(grid, &grid.points().collect::<Vec<_>>())
}

fn grid(points: &[f64], asymmetries: &[f64]) -> Grid {
    Grid::new(points.into(), asymmetries.into(), &config(&[])).expect("a grid")
}

/// Sets the required load of a point.
fn set_required(config: &Config, grid: &Grid, row: usize, column: usize) -> Action {
    let load = required(config, grid, row, column);
    Box::new(move |actual| actual.load = load)
}

fn required(config: &Config, grid: &Grid, row: usize, column: usize) -> Load {
    let config = grid.config_at(config, GridPoint { row, column });
    let config = config.expect("a point");
    StageModel::of(&config).expect("a stage").required_load()
}

fn no_action() -> Action {
    Box::new(|_| {})
}

const DONE: Reply = Reply::Done(None);
