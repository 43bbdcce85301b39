//! All settings. The range of each setting is defined at its type only. `deny_unknown_fields` cannot be used with a flattened
//! table, so the schema refuses unknown tables.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PlantSettings;
use super::calibration::{CalibrateSettings, CalibrationSettings};
use super::campaign::CampaignSettings;
use super::control::ControlSettings;
use super::excitation::{ExcitationSettings, ShapeSettings};
use super::interlock::InterlockSettings;
use super::rig::{AmplifierSettings, MotorSettings, ProbeSettings};
use super::servo::LoopSettings;
use super::sim::SimSettings;
use bench_excitation::{
    ChirpSettings, ChosenExcitation, ExcitationError, ExcitationTables, Limits, SharedSettings,
};
use bench_identify::IdentifySettings;

/// All settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "bench configuration", extend("additionalProperties" = false))]
pub struct Config {
    /// Short description of this configuration.
    pub title: String,
    /// The real-time loop.
    #[serde(rename = "loop")]
    pub servo: LoopSettings,
    /// The model of the mechanics.
    pub plant: PlantSettings,
    /// The voice coil motor.
    pub motor: MotorSettings,
    /// The current amplifier.
    pub amplifier: AmplifierSettings,
    /// The displacement probe.
    pub probe: ProbeSettings,
    /// Limits of the interlocks.
    pub interlock: InterlockSettings,
    /// The simulated rig.
    pub sim: SimSettings,
    /// The choice of the excitation of `bench chirp`.
    pub excitation: ExcitationSettings,
    /// The chirp; also the band, rest times, fades and amplitude over frequency of every excitation.
    pub chirp: ChirpSettings,
    /// The tables of the other excitations.
    #[serde(flatten)]
    pub excitations: ExcitationTables,
    /// The target of `bench chirp --shape`.
    pub shape: ShapeSettings,
    /// How the frequency response is estimated.
    pub identify: IdentifySettings,
    /// The closed loop of `bench control`.
    pub control: ControlSettings,
    /// The static steps of `bench calibrate`.
    pub calibrate: CalibrateSettings,
    /// The calibration that runs use.
    pub calibration: CalibrationSettings,
    /// How the operator loads the stage between the points of a campaign.
    pub campaign: CampaignSettings,
}

impl Config {
    /// The excitation of `excitation.kind`.
    ///
    /// # Errors
    /// When the kind has no settings, which the check of a configuration refuses.
    pub fn chosen_excitation(&self) -> Result<ChosenExcitation<'_>, ExcitationError> {
        Ok(ChosenExcitation {
            design: self.excitations.design(self.excitation.kind)?,
            shared: SharedSettings {
                chirp: &self.chirp,
                rate_hz: self.servo.rate_hz,
            },
        })
    }

    /// Text that describes the excitation, or why there is none.
    pub fn excitation_text(&self) -> String {
        match self.chosen_excitation() {
            Ok(chosen) => chosen.describe(),
            Err(error) => error.to_string(),
        }
    }

    /// Text that describes the swept reference of a closed loop.
    pub fn swept_reference_text(&self) -> String {
        let (chirp, controller) = (&self.chirp, &self.control.controller);
        format!(
            "under the {controller} controller, reference swept {} to {} Hz in {} s",
            chirp.start_hz, chirp.stop_hz, chirp.duration_s
        )
    }

    /// Text that describes the reference of a closed loop, and how long the loop is closed.
    pub fn reference_text(&self) -> String {
        let control = &self.control;
        if control.reference.is_swept() {
            return self.swept_reference_text();
        }
        let reference = control.reference.design().describe();
        format!(
            "{reference}; the loop is closed for {} s",
            control.duration_s
        )
    }

    /// The travel at which the interlocks trip, in metres of the stage: they judge the position in the metres of the probe as well.
    pub fn permitted_travel_m(&self) -> f64 {
        let gain = self.probe.device.mounting_gain().abs();
        self.interlock.soft_limit_m * gain.min(1.0)
    }

    /// The limits of an excitation.
    pub fn excitation_limits(&self) -> Limits {
        Limits {
            travel_m: self.permitted_travel_m(),
            peak_current_a: self.motor.peak_current_a(),
            amplifier_current_a: self.amplifier.current_limit_a,
            continuous_current_a: self.motor.continuous_current_a(),
            slew_a_per_s: self.amplifier.slew_limit_a_per_s,
            thermal_time_constant_s: self.motor.thermal_time_constant_s,
            period_s: self.servo.period_s(),
        }
    }
}
