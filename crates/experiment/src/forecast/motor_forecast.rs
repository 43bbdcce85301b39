//! Whether the motor is cool enough for a run: the heat of earlier runs and the predicted heat of the run.

use serde::Serialize;

use crate::errors::{ExperimentError, MotorError};
use crate::plan::{MotorStart, Plan};
use bench_plant::LoopPlant;
use bench_rig::motor::{
    HeatPrediction, Moment, MotorMemory, MotorOrigin, MotorState, ThermalModel,
};
use bench_rig::simulated;
use bench_rt::program::ProgramInput;
use bench_rt::tuning::Factors;

/// A waiting run starts when the state is this ratio of the largest allowed one: the currents of a run differ slightly from the
/// predicted ones.
pub(crate) const RESERVE: f64 = 0.98;
/// Thermal state of a motor that counts as cold, as a ratio of the limit.
const COLD: f64 = 0.01;

/// The motor before a run, and the predicted heat of that run.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorForecast {
    state: MotorState,
    model: ThermalModel,
    prediction: HeatPrediction,
    now: Moment,
}

/// The figures of a [`MotorForecast`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotorSummary {
    /// How the state is known.
    pub known_from: String,
    /// Thermal current of the motor now, in amperes.
    pub thermal_start_a: f64,
    /// Largest predicted thermal current of the run if it starts now, in amperes.
    pub thermal_peak_a: f64,
    /// Its limit in amperes.
    pub thermal_limit_a: f64,
    /// Time in seconds until the run is allowed; `None` if it is not allowed with a cold motor either.
    pub wait_s: Option<f64>,
    /// Date and time (UTC) from which the run is allowed; `None` if the state is unknown, because the wait then begins with the
    /// next attempt.
    pub start_after: Option<String>,
}

impl MotorForecast {
    /// The forecast of a run on devices, by the stored state. `amplifier` is its identity, if it is open.
    pub fn of(
        plan: &Plan,
        memory: &MotorMemory,
        amplifier: Option<&str>,
        now: Moment,
    ) -> Result<MotorForecast, ExperimentError> {
        let state = memory.read(amplifier, &now);
        let prediction = predict(plan, state.thermal_a2)?;
        Ok(MotorForecast {
            model: memory.model(),
            state,
            prediction,
            now,
        })
    }

    /// Seconds until the run is allowed: 0 now, infinite if never.
    pub fn wait_s(&self) -> f64 {
        let largest_a2 = self.prediction.largest_start_a2;
        if self.state.thermal_a2 <= largest_a2 {
            return 0.0;
        }
        let cooling_s = (self.model).cooling_s(self.state.thermal_a2, RESERVE * largest_a2);
        self.state.busy_s + cooling_s
    }

    /// The figures.
    pub fn summary(&self) -> MotorSummary {
        let wait_s = Some(self.wait_s()).filter(|wait_s| wait_s.is_finite());
        MotorSummary {
            known_from: known_from(&self.state),
            thermal_start_a: self.state.thermal_a2.sqrt(),
            thermal_peak_a: self.prediction.peak_a2.sqrt(),
            thermal_limit_a: self.model.limit_a2.sqrt(),
            start_after: wait_s
                .filter(|_| self.state.known.is_ok())
                .map(|wait_s| self.now.later(wait_s).utc()),
            wait_s,
        }
    }

    /// Refuses a run for which the motor is too warm.
    pub fn require_cool(&self) -> Result<(), MotorError> {
        let wait_s = self.wait_s();
        let (peak_a, limit_a) = (self.prediction.peak_a2.sqrt(), self.model.limit_a2.sqrt());
        if wait_s == 0.0 {
            return Ok(());
        }
        if !wait_s.is_finite() {
            return Err(MotorError::Never { peak_a, limit_a });
        }
        Err(MotorError::Warm {
            known_from: known_from(&self.state),
            peak_a,
            limit_a,
            when: self.when_allowed(wait_s),
            unless_cold: self.unless_cold(),
        })
    }

    /// From when on the run is allowed. An unknown state is not stored yet, so the wait begins with the next attempt.
    fn when_allowed(&self, wait_s: f64) -> String {
        let wait = duration_text(wait_s);
        match self.state.known {
            Err(_) => format!("add --wait-for-motor to wait {wait} before the run"),
            Ok(_) => {
                let start_after = self.now.later(wait_s).time_of_day();
                format!("start after {start_after} (in {wait}), or add --wait-for-motor")
            }
        }
    }

    /// The remedy for a motor whose state is only assumed.
    fn unless_cold(&self) -> String {
        match self.state.known {
            Ok((MotorOrigin::Run | MotorOrigin::StatedCold, _)) => String::new(),
            Ok((MotorOrigin::Running | MotorOrigin::Assumed, _)) | Err(_) => {
                let cold_s = self.model.cooling_s(1.0, COLD);
                let cold = duration_text(cold_s);
                format!(", or add --motor-cold if the motor has had no current for {cold}")
            }
        }
    }

    /// The state with which the run starts now.
    pub(crate) fn start(&self) -> MotorStart {
        MotorStart {
            thermal_a2: self.state.thermal_a2,
            known_from: known_from(&self.state),
        }
    }
}

/// How a state is known: the beginning of a sentence.
fn known_from(state: &MotorState) -> String {
    let thermal_a = state.thermal_a2.sqrt();
    let (origin, at) = match &state.known {
        Ok((origin, at)) => (origin, at.utc()),
        Err(why) => {
            return format!(
                "its thermal state is unknown ({why}) and it is assumed at its limit of {thermal_a:.3} A"
            );
        }
    };
    match origin {
        MotorOrigin::Run => {
            format!("it has a thermal current of {thermal_a:.3} A since the run that ended at {at}")
        }
        MotorOrigin::Running => format!(
            "the run that began at {at} has no stored end (in progress, killed or without power), and its thermal current may be {thermal_a:.3} A"
        ),
        MotorOrigin::Assumed => format!(
            "its thermal state was unknown at {at} and its thermal current may be {thermal_a:.3} A"
        ),
        MotorOrigin::StatedCold => format!("the operator stated at {at} that it is cold"),
    }
}

/// `46 s`, `2 min 10 s`, `1 h 5 min`: rounded up.
pub(crate) fn duration_text(duration_s: f64) -> String {
    let seconds = duration_s.ceil() as u64;
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds % 3600 / 60),
    }
}

/// Predicts the heat of a run by its program and the model of the whole rig. With a calibration the larger of current and
/// set-point counts, as in the interlocks.
pub(crate) fn predict(plan: &Plan, start_a2: f64) -> Result<HeatPrediction, ExperimentError> {
    let config = &plan.config;
    let modes = simulated::modes(&config.plant, &config.sim)?;
    let plant = LoopPlant::new(config, &modes);
    let (mut program, correction) = (plan.program()?, plan.correction());
    let (mut state, mut applied_a) = (plant.at_rest(), 0.0);
    let currents_a = (0..program.ticks()).map(|tick| {
        let input = ProgramInput {
            tick,
            position_m: plant.reading_m(&state),
            applied_a,
            factors: Factors::default(),
        };
        applied_a = program.decide(&input).requested_a;
        plant.step(&mut state, applied_a);
        let set_point_a = correction.map_or(applied_a, |c| c.set_point_a(applied_a));
        applied_a.abs().max(set_point_a.abs())
    });
    let model = ThermalModel::of(&config.motor);
    Ok(model.predict(start_a2, config.servo.period_s(), currents_a))
}
