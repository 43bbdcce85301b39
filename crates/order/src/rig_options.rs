//! On which rig a run is made, and at which pace.

use schemars::JsonSchema;
use serde::Serialize;

use super::bench_options::SeedOption;
use bench_config::Config;
use bench_experiment::{
    ExperimentError, MotorError, MotorForecast, MotorHandling, MotorSummary, Plan, Stage,
};
use bench_rig::motor::{Moment, MotorMemory};
use bench_rt::thread::Pace;

/// Rig, pace and state of the motor.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct RigOptions {
    /// The seed.
    #[command(flatten)]
    #[serde(flatten)]
    pub seed: SeedOption,
    /// Pace of the loop [default: virtual on the simulated stage, realtime on devices]
    #[arg(long, value_name = "PACE")]
    pub pace: Option<Pace>,
    /// Run on the simulated stage, with the rates, delays and resolution of the configured devices
    #[arg(long)]
    pub simulate: bool,
    /// Clear a latched fault of the amplifier; first remove its cause
    #[arg(long)]
    pub clear_fault: bool,
    /// The motor is cold: it has had no current for several thermal time constants. Needed at most before the first run on a
    /// device; later the program knows the state of the motor
    #[arg(long)]
    pub motor_cold: bool,
    /// Wait until the motor is cool enough, where the run would be refused because of the heat of earlier runs
    #[arg(long)]
    pub wait_for_motor: bool,
}

impl RigOptions {
    /// The stage of the run.
    pub fn stage(&self, config: &Config) -> Stage {
        if self.simulate {
            Stage::Simulated
        } else {
            Stage::of(config)
        }
    }

    /// Whether the run is on the simulated stage.
    pub fn is_simulated(&self, config: &Config) -> bool {
        self.stage(config) == Stage::Simulated
    }

    /// The requested pace, or that of the rig. Devices run in real time only.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn loop_pace(&self, config: &Config) -> Result<Pace, ExperimentError> {
        match (self.pace, self.is_simulated(config)) {
            (Some(Pace::Virtual), false) => Err(ExperimentError::Refused(
                "--pace virtual is valid only for the simulated stage, because devices run in real time; leave it out, or add --simulate".into(),
            )),
            (Some(pace), _) => Ok(pace),
            (None, true) => Ok(Pace::Virtual),
            (None, false) => Ok(Pace::Realtime),
        }
    }

    /// How the heat of the motor is treated. With `--motor-cold` this statement is stored first.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn motor_handling(&self, config: &Config) -> Result<MotorHandling, ExperimentError> {
        if self.is_simulated(config) {
            self.refuse_motor_options()?;
            return Ok(MotorHandling::Simulated);
        }
        if self.motor_cold {
            let stated = motor_memory(config)?.state_cold(&Moment::now());
            stated.map_err(MotorError::from)?;
        }
        Ok(if self.wait_for_motor {
            MotorHandling::WaitUntilCool
        } else {
            MotorHandling::Remembered
        })
    }

    fn refuse_motor_options(&self) -> Result<(), ExperimentError> {
        let options = [
            (self.motor_cold, "--motor-cold"),
            (self.wait_for_motor, "--wait-for-motor"),
        ];
        match options.iter().find(|(is_given, _)| *is_given) {
            None => Ok(()),
            Some((_, option)) => Err(ExperimentError::Refused(format!(
                "{option} is valid only on devices, because the simulated motor is cold at its first run and rests between runs; leave it out"
            ))),
        }
    }

    /// The motor of the configured devices before the run `plan`; `None` for a simulated motor.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn motor_summary(&self, plan: &Plan) -> Result<Option<MotorSummary>, ExperimentError> {
        match self.motor_handling(&plan.config)? {
            MotorHandling::Simulated => Ok(None),
            MotorHandling::Remembered | MotorHandling::WaitUntilCool => {
                let memory = motor_memory(&plan.config)?;
                let forecast = MotorForecast::of(plan, &memory, None, Moment::now())?;
                Ok(Some(forecast.summary()))
            }
        }
    }
}

fn motor_memory(config: &Config) -> Result<MotorMemory, ExperimentError> {
    let memory = MotorMemory::of(config);
    Ok(memory.map_err(MotorError::from)?)
}
