//! Runs of the simulated stage, as `bench chirp` and `bench control` make them.

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use super::FigureError;
use super::model::Model;
use bench_config::Config;
use bench_experiment::{Analysis, Plan, ReadSignals, TrackingMetrics, analyse, never_cancels};
use bench_recording::Recording;
use bench_rig::devices;
use bench_rt::record::{TickRecord, flag};
use bench_rt::thread::Pace;

/// Runs that several figures show; each is made once.
#[derive(Debug)]
pub struct Runs {
    folder: PathBuf,
    chirp: OnceCell<Analysis>,
    steps: [OnceCell<ClosedLoopRun>; 2],
}

/// One of the two controllers of section 6.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ThesisController {
    /// Eq. (6-6).
    Slow,
    /// Eq. (6-7).
    Fast,
}

impl ThesisController {
    pub fn name(self) -> &'static str {
        match self {
            ThesisController::Slow => "slow",
            ThesisController::Fast => "fast",
        }
    }
}

/// A closed-loop run.
#[derive(Clone, Debug)]
pub(crate) struct ClosedLoopRun {
    /// Time in seconds after the loop closed, and position in metres relative to the rest position.
    pub course: Vec<(f64, f64)>,
    /// Time and reference, likewise.
    pub reference: Vec<(f64, f64)>,
    /// Its metrics.
    pub measured: TrackingMetrics,
}

impl Runs {
    /// Records runs in `folder`, which is created; the caller removes it.
    pub fn new(folder: &Path) -> Runs {
        Runs {
            folder: folder.into(),
            chirp: OnceCell::new(),
            steps: [OnceCell::new(), OnceCell::new()],
        }
    }

    /// The frequency response of `bench chirp`.
    pub(crate) fn chirp(&self) -> Result<&Analysis, FigureError> {
        if let Some(known) = self.chirp.get() {
            return Ok(known);
        }
        let config = Model::stage().config()?;
        let recording = self.run(&Plan::chirp(config.clone()), "chirp")?;
        let analysis = analyse(
            &recording,
            ReadSignals::default(),
            &config,
            &mut never_cancels,
        )?;
        Ok(self.chirp.get_or_init(|| analysis))
    }

    /// The step of `bench control`.
    pub(crate) fn step(&self, which: ThesisController) -> Result<&ClosedLoopRun, FigureError> {
        let cell = &self.steps[which as usize];
        if let Some(known) = cell.get() {
            return Ok(known);
        }
        let config = Model::stage()
            .set(&format!("control.controller={}", which.name()))
            .config()?;
        let closed = self.closed(config)?;
        Ok(cell.get_or_init(|| closed))
    }

    /// Any closed-loop run.
    pub(crate) fn closed(&self, config: Config) -> Result<ClosedLoopRun, FigureError> {
        let plan = Plan::control(config.clone()).map_err(bench_experiment::RunError::Plan)?;
        let recording = self.run(&plan, "control")?;
        let measured =
            bench_experiment::tracking_metrics(&recording, &config.control, &config.servo)?;
        let measured = measured
            .ok_or_else(|| FigureError::Run("the run ended before its steady state".into()))?;
        let ticks: Vec<TickRecord> = recording.ticks()?.collect::<Result<_, _>>()?;
        Ok(closed(&ticks, config.servo.period_s(), measured))
    }

    fn run(&self, plan: &Plan, what: &str) -> Result<Recording, FigureError> {
        let rig = devices::simulate(&plan.config)?.rig;
        let mut run =
            bench_experiment::run(plan, rig, Pace::Virtual, &self.folder, &mut |_, _| {})?;
        run.totals()?;
        let path = run.path.clone();
        if let Some((trip, tick)) = run.end.servo.trip {
            return Err(FigureError::Run(format!(
                "`bench {what}` tripped at tick {tick}: {trip}"
            )));
        }
        if !run.end.servo.completed {
            return Err(FigureError::Run(format!("`bench {what}` was stopped")));
        }
        run.finish("{}")?;
        Ok(Recording::open(&path)?)
    }
}

/// The ticks with the loop closed, relative to the rest position before.
fn closed(ticks: &[TickRecord], period_s: f64, measured: TrackingMetrics) -> ClosedLoopRun {
    let active: Vec<&TickRecord> = ticks
        .iter()
        .filter(|tick| tick.flags & flag::ACTIVE != 0)
        .collect();
    let origin_m = ticks
        .iter()
        .rfind(|tick| active.first().is_some_and(|first| tick.tick < first.tick));
    let origin_m = origin_m.map_or(0.0, |tick| tick.reference_m);
    let course = |of: fn(&TickRecord) -> f64| {
        active
            .iter()
            .enumerate()
            .map(|(k, tick)| (k as f64 * period_s, of(tick) - origin_m))
            .collect()
    };
    ClosedLoopRun {
        course: course(|tick| tick.position_m),
        reference: course(|tick| tick.reference_m),
        measured,
    }
}
