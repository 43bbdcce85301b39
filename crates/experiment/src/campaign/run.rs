//! Runs a campaign: opens its folder, measures the missing points, stores each result, and evaluates all of them.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::error::CampaignError;
use super::evaluation::{Evaluation, Tolerances};
use super::grid::{Grid, GridPoint};
use super::guided::{GuidedCampaign, LoadedRig, Operator};
use super::load::RestPosition;
use super::measure::{Method, PointMeasurement};
use super::parallel::measure_in_parallel;
use super::point::PointResult;
use super::store::{OpenedStore, Store};
use super::visit_order::visit_order;
use crate::analysis::Ending;
use crate::errors::ExperimentError;
use crate::live::Run;
use crate::plan::{Description, Plan};
use crate::run::{Runner, Setup, close};
use bench_base::progress::Progress;
use bench_config::Config;
use bench_recording::Recording;
use bench_rt::arming::Trip;

/// Makes one run of a guided campaign, for example with a [`Runner`] whose progress is shown. The last argument names the phase.
pub type RunPlan<'a> = dyn FnMut(Setup, &Plan, &'static str) -> Result<Run, ExperimentError> + 'a;

/// How a campaign is measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct CampaignOptions {
    /// Whether on devices, with an operator.
    pub on_devices: bool,
    /// Whether the recordings of the points are kept after their analysis.
    pub keep_recordings: bool,
    /// How each point is measured.
    pub method: Method,
}

/// A campaign in progress.
pub struct Campaign<'a> {
    config: &'a Config,
    grid: &'a Grid,
    store: Store,
    options: CampaignOptions,
    /// Name, note and operator of its runs.
    pub description: Description,
    done: Vec<(GridPoint, PointResult)>,
    /// Files of points that are ignored, with the reason.
    pub rejected: Vec<String>,
    /// Number of finished points whose files have no checksum.
    pub unverified: usize,
}

impl<'a> Campaign<'a> {
    /// Opens the folder of a campaign, or creates it; see [`Store::open`].
    pub fn open(
        folder: &Path,
        grid: &'a Grid,
        config: &'a Config,
        options: CampaignOptions,
    ) -> Result<Campaign<'a>, CampaignError> {
        let OpenedStore {
            store,
            done,
            rejected,
            unverified,
        } = Store::open(folder, grid, config, options.on_devices, options.method)?;
        Ok(Campaign {
            config,
            grid,
            store,
            options,
            description: Description::default(),
            done,
            rejected,
            unverified,
        })
    }

    /// The finished points, in the order of the grid.
    pub fn done(&self) -> &[(GridPoint, PointResult)] {
        &self.done
    }

    /// The points that are not finished, in the order of the grid.
    pub fn missing(&self) -> Vec<GridPoint> {
        let is_missing = |point: &GridPoint| self.done.iter().all(|(done, _)| done != point);
        self.grid.points().filter(is_missing).collect()
    }

    /// Measures the missing points on the simulated stage, on up to `threads` threads. The results do not depend on their
    /// number. Ends early when `stop` is set, after the points in progress.
    pub fn run_simulated(
        &mut self,
        threads: usize,
        progress: &Progress,
        stop: &AtomicBool,
    ) -> Result<(), CampaignError> {
        let missing = self.missing();
        progress.begin("campaign", missing.len() as u64);
        let (config, grid, store) = (self.config, self.grid, &self.store);
        let (options, description) = (self.options, &self.description);
        let measure = |point| {
            let folder = store.recordings(point);
            let runner = Runner::new(Setup {
                description: description.clone(),
                ..Setup::simulated(folder.clone())
            });
            let point = PointMeasurement {
                config: &grid.config_at(config, point)?,
                folder: &folder,
                keep_recordings: options.keep_recordings,
                method: options.method,
                stop,
            };
            point.measure(&mut |plan| runner.run(plan, "chirp"))
        };
        let done = &mut self.done;
        let take = |point, result| {
            store.add(point, &result)?;
            done.push((point, result));
            progress.advance(1);
            Ok(())
        };
        let outcome = measure_in_parallel(&missing, threads, stop, measure, take);
        self.done.sort_by_key(|(point, _)| *point);
        outcome
    }

    /// Measures the missing points on devices, with an operator who loads the stage. `tolerance` is the allowed error of a
    /// measured displacement, a ratio of the beam length; `run` makes each run. When `stop` is set, no other chirp of a point begins.
    pub fn run_guided(
        &mut self,
        operator: &mut dyn Operator,
        tolerance: f64,
        run: &mut RunPlan<'_>,
        stop: &AtomicBool,
    ) -> Result<(), CampaignError> {
        let points = visit_order(self.grid, &self.missing());
        let (config, grid) = (self.config, self.grid);
        let outcome = GuidedCampaign {
            config,
            grid,
            tolerance,
            operator,
            rig: DeviceRig {
                campaign: self,
                run,
                stop,
            },
        }
        .run(&points);
        self.done.sort_by_key(|(point, _)| *point);
        outcome
    }

    /// The devices, with a folder for recordings.
    fn on_devices(&self, folder: PathBuf) -> Setup {
        Setup {
            description: self.description.clone(),
            ..Setup::on_devices(folder)
        }
    }

    /// Evaluates the finished points.
    pub fn evaluate(&self, tolerances: Tolerances) -> Result<Evaluation<'_>, CampaignError> {
        Evaluation::of(self.config, self.grid, &self.done, tolerances)
    }
}

/// The configured devices, with a stage that the operator loads.
struct DeviceRig<'r, 'a, 'f> {
    campaign: &'r mut Campaign<'a>,
    run: &'r mut RunPlan<'f>,
    stop: &'r AtomicBool,
}

impl LoadedRig for DeviceRig<'_, '_, '_> {
    /// Recorded in the folder `rest` of the campaign. A trip is an error: no point can be measured on such a bench.
    fn rest_position(&mut self) -> Result<Option<RestPosition>, CampaignError> {
        let folder = self.campaign.store.folder().join("rest");
        let setup = self.campaign.on_devices(folder);
        let plan = Plan::quiet(self.campaign.config.clone());
        let run = (self.run)(setup, &plan, "rest")?;
        if let Some((trip, tick)) = run.end.servo.trip {
            return Err(tripped_at_rest(trip, tick).into());
        }
        if run.end.stop_cause.is_some() {
            return Ok(None);
        }
        let path = run.path.clone();
        // The file contains every tick once it is closed.
        close(run, &serde_json::json!({ "outcome": Ending::Completed }))?;
        read_rest_position(&path).map(Some)
    }

    fn measure(&mut self, point: GridPoint) -> Result<Option<PointResult>, CampaignError> {
        let campaign = &*self.campaign;
        let config = campaign.grid.config_at(campaign.config, point)?;
        let folder = campaign.store.recordings(point);
        let setup = campaign.on_devices(folder.clone());
        let run = &mut self.run;
        let point = PointMeasurement {
            config: &config,
            folder: &folder,
            keep_recordings: campaign.options.keep_recordings,
            method: campaign.options.method,
            stop: self.stop,
        };
        point.measure(&mut |plan| run(setup.clone(), plan, "chirp"))
    }

    fn store(&mut self, point: GridPoint, result: &PointResult) -> Result<(), CampaignError> {
        self.campaign.store.add(point, result)?;
        self.campaign.done.push((point, result.clone()));
        Ok(())
    }
}

fn tripped_at_rest(trip: Trip, tick: u64) -> ExperimentError {
    let remedy = trip.remedy();
    ExperimentError::Failed(format!(
        "the bench tripped at rest, at tick {tick}: {trip}; {remedy}"
    ))
}

fn read_rest_position(path: &Path) -> Result<RestPosition, CampaignError> {
    let name = path.display().to_string();
    match Recording::open(path) {
        Ok(recording) => RestPosition::of(&recording, &name),
        Err(error) => Err(CampaignError::RestPosition {
            recording: name,
            why: error.to_string(),
        }),
    }
}
