//! The motor before and after a run: a simulated one, or a real one whose heat is kept in a file.

use std::sync::atomic::Ordering;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::errors::{ExperimentError, MotorError, RunError};
use crate::forecast::{MotorForecast, RESERVE, duration_text, predict};
use crate::live::{Run, TAIL_S, stop_on_signal};
use crate::plan::{MotorStart, Plan};
use bench_base::progress::Progress;
use bench_rig::motor::{Moment, MotorMemory};
use bench_rt::supervision::StopFlags;

/// Longest time in seconds from the entry in the file to the first tick of the run.
const ENABLING_S: f64 = 10.0;
/// Interval at which a waiting run looks at the clock and at signals.
const BEAT: Duration = Duration::from_millis(100);

/// How runs treat the thermal state that earlier runs left in the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotorHandling {
    /// A simulated motor: cold at the first run of a runner. Before a later run it rests for as long as that run requires; this
    /// takes no time.
    Simulated,
    /// A real motor, whose state is kept in a file. A run that would overheat it is refused.
    Remembered,
    /// As `Remembered`, but the run waits until the motor is cool enough.
    WaitUntilCool,
}

/// The state of a simulated motor before a run: it rests as long as the run requires.
pub(super) fn rested(plan: &Plan, thermal_a2: f64) -> Result<MotorStart, ExperimentError> {
    let mut start = MotorStart {
        thermal_a2,
        known_from: "the motor is simulated".into(),
    };
    if thermal_a2 > 0.0 {
        let largest_a2 = predict(plan, thermal_a2)?.largest_start_a2;
        if thermal_a2 > largest_a2 {
            start.thermal_a2 = RESERVE * largest_a2.max(0.0);
        }
    }
    Ok(start)
}

/// The motor of a run on devices: its file, the identity of its amplifier, and the clock.
pub(super) struct RememberedMotor<'a> {
    pub memory: MotorMemory,
    pub amplifier: &'a str,
    pub now: fn() -> Moment,
    /// Ends the wait for a cool motor, as a signal does.
    pub stop: &'a StopFlags,
}

impl RememberedMotor<'_> {
    /// The state with which the run starts. If the motor is too warm, the run is refused, or waits with `progress`.
    pub fn ready(
        &self,
        plan: &Plan,
        waits: bool,
        progress: &Progress,
    ) -> Result<MotorStart, ExperimentError> {
        self.store_assumption()?;
        let forecast = self.forecast(plan)?;
        match forecast.require_cool() {
            Err(MotorError::Warm { .. }) if waits => {
                self.wait(forecast.wait_s(), progress)?;
                let cooled = self.forecast(plan)?;
                cooled.require_cool()?;
                Ok(cooled.start())
            }
            refused => {
                refused?;
                Ok(forecast.start())
            }
        }
    }

    fn forecast(&self, plan: &Plan) -> Result<MotorForecast, ExperimentError> {
        MotorForecast::of(plan, &self.memory, Some(self.amplifier), (self.now)())
    }

    /// An unknown state is stored as hot, so that the motor counts as cool after a known time.
    fn store_assumption(&self) -> Result<(), MotorError> {
        let now = (self.now)();
        match self.memory.read(Some(self.amplifier), &now).known {
            Ok(_) => Ok(()),
            Err(why) => {
                tracing::warn!(
                    "the thermal state of the motor is unknown ({why}): it is assumed at its limit from now on"
                );
                Ok(self.memory.assume_hot(self.amplifier, &now)?)
            }
        }
    }

    /// Stores that the run begins: if its end is not stored, the motor must be assumed hot.
    pub fn begin(&self, plan: &Plan) -> Result<(), ExperimentError> {
        let ticks = (plan.program()?.ticks() + 2 * plan.ramp_ticks()?) as f64;
        let longest_s = ticks * plan.config.servo.period_s() + TAIL_S + ENABLING_S;
        let begun = (self.memory).begin(self.amplifier, longest_s, &(self.now)());
        Ok(begun.map_err(MotorError::from)?)
    }

    /// Stores the state of the motor after a run. A run that ended before the motor had current leaves the state at its start; a
    /// run that failed in its middle leaves the entry of its beginning.
    pub fn end(&self, plan: &Plan, result: &Result<Run, RunError>) {
        let thermal_a2 = match result {
            Ok(run) => run.end.servo.thermal_a2,
            Err(
                RunError::Plan(_)
                | RunError::Create(_)
                | RunError::Folder { .. }
                | RunError::Space { .. }
                | RunError::StoppedBefore
                | RunError::System { .. },
            ) => plan.motor.thermal_a2,
            Err(
                RunError::Recording(_)
                | RunError::Unrecorded(_)
                | RunError::AnalysisDied
                | RunError::LoopDied(_),
            ) => return,
        };
        let stored = (self.memory).store(thermal_a2, self.amplifier, &(self.now)());
        if let Err(error) = stored {
            tracing::warn!("{error}; until then the motor counts as hot");
        }
    }

    /// Waits until the motor has cooled for `wait_s`. A signal stops it.
    fn wait(&self, wait_s: f64, progress: &Progress) -> Result<(), ExperimentError> {
        let (begun, now) = ((self.now)(), self.now);
        let until = begun.later(wait_s).time_of_day();
        tracing::warn!(
            "the motor is too warm: the run starts at {until}, in {}",
            duration_text(wait_s)
        );
        progress.begin("waiting for the motor", wait_s.ceil() as u64);
        let is_cool = stop_on_signal(|signal| {
            let is_stopped = || signal.load(Ordering::Relaxed) || self.stop.is_raised();
            wait_for(wait_s, &begun, now, is_stopped, progress)
        })?;
        if is_cool {
            Ok(())
        } else {
            Err(MotorError::Stopped.into())
        }
    }
}

/// Whether the time passed before the wait was stopped. A clock that is set back ends the wait: the state is then unknown.
fn wait_for(
    wait_s: f64,
    begun: &Moment,
    now: fn() -> Moment,
    is_stopped: impl Fn() -> bool,
    progress: &Progress,
) -> bool {
    let total = wait_s.ceil() as u64;
    loop {
        let elapsed_s = now().seconds_since(begun).unwrap_or(wait_s);
        progress.set(elapsed_s as u64, total);
        if elapsed_s >= wait_s || is_stopped() {
            return elapsed_s >= wait_s;
        }
        std::thread::sleep(BEAT);
    }
}
