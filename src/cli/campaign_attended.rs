//! `bench campaign` on devices: quiet runs and chirps on the stage that a person loads.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::campaign::Bench;
use super::error::CliError;
use super::person::AtTerminal;
use super::progress::ProgressLine;
use crate::experiment::campaign::{Attended, CampaignError, Place, Point, Rest, Stage, Store};
use crate::experiment::{Plan, Run, Runner, Setup, close};
use crate::recording::Recording;

/// The configured devices, and the folder of the campaign.
pub(super) struct OnDevices<'a> {
    pub bench: &'a Bench<'a>,
    pub store: &'a Store,
    pub out: &'a Path,
    pub done: &'a mut Vec<(Place, Point)>,
}

impl OnDevices<'_> {
    /// Goes through `places` with the person at the terminal.
    pub fn go(self, places: &[Place], tolerance: f64, stop: &AtomicBool) -> Result<(), CliError> {
        let (config, grid) = (self.bench.config, self.bench.grid);
        let length_m = config.plant.beam_length_m();
        let person = AtTerminal::new(stop, length_m)?;
        Attended {
            config,
            grid,
            tolerance,
            person,
            stage: self,
        }
        .go(places)
    }
}

impl Stage for OnDevices<'_> {
    type Error = CliError;

    /// Recorded in the folder `rest` of the campaign; a trip is an error: nothing can be measured on such a bench.
    fn rest(&mut self) -> Result<Option<Rest>, CliError> {
        let plan = Plan::quiet(self.bench.config.clone());
        let run = on_devices(self.out.join("rest"), &plan, "rest")?;
        if let Some((trip, tick)) = run.ended.trip {
            let what = format!(
                "the bench tripped at rest, at tick {tick}: {trip}; {}",
                trip.remedy()
            );
            return Err(CliError::Failed(what));
        }
        if run.stopped {
            return Ok(None);
        }
        let path = run.path.clone();
        // All ticks are in the file once it is closed.
        close(run, &serde_json::json!({ "outcome": "completed" }))?;
        let name = path.display().to_string();
        let opened = Recording::open(&path);
        let rest = opened.map_err(|e| CampaignError::Rest {
            recording: name.clone(),
            why: e.to_string(),
        })?;
        Ok(Some(Rest::of(&rest, &name)?))
    }

    fn measure(&mut self, place: Place) -> Result<Option<Point>, CliError> {
        let folder = self.store.recordings(place);
        self.bench.measure_by(place, &folder, |plan| {
            on_devices(folder.clone(), plan, "chirp")
        })
    }

    fn keep(&mut self, place: Place, point: &Point) -> Result<(), CliError> {
        self.store.add(place, point)?;
        self.done.push((place, point.clone()));
        Ok(())
    }
}

fn on_devices(
    folder: std::path::PathBuf,
    plan: &Plan,
    phase: &'static str,
) -> Result<Run, CliError> {
    let (setup, progress) = (
        Setup::on_devices(folder),
        crate::util::progress::Progress::new(phase),
    );
    let _line = ProgressLine::show(&progress);
    Ok(Runner { setup, progress }.run(plan, phase)?)
}
