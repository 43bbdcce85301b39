//! The settings as a whole. The ranges of each stand at its type and nowhere else.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PlantSettings;
use super::calibration::{CalibrateSettings, CalibrationSettings};
use super::campaign::CampaignSettings;
use super::chirp::ChirpSettings;
use super::control::ControlSettings;
use super::excitation::{
    ExcitationSettings, MultisineSettings, PrbsSettings, ShapeSettings, SteppedSineSettings,
};
use super::identify::IdentifySettings;
use super::interlock::InterlockSettings;
use super::rig::{AmplifierSettings, MotorSettings, ProbeSettings};
use super::servo::LoopSettings;
use super::sim::SimSettings;

/// Everything a run depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench configuration")]
pub struct Config {
    /// What this configuration is, in words.
    pub title: String,
    /// The real-time loop.
    #[serde(rename = "loop")]
    pub servo: LoopSettings,
    /// The mechanics.
    pub plant: PlantSettings,
    /// The voice coil motor.
    pub motor: MotorSettings,
    /// The current amplifier.
    pub amplifier: AmplifierSettings,
    /// The displacement probe.
    pub probe: ProbeSettings,
    /// What trips.
    pub interlock: InterlockSettings,
    /// The simulated rig.
    pub sim: SimSettings,
    /// Which excitation `bench chirp` uses.
    pub excitation: ExcitationSettings,
    /// The chirp; and band, quiet, fades and amplitude over frequency of every excitation.
    pub chirp: ChirpSettings,
    /// The multisine.
    pub multisine: MultisineSettings,
    /// The stepped sine.
    pub stepped_sine: SteppedSineSettings,
    /// The pseudo-random binary sequence.
    pub prbs: PrbsSettings,
    /// What `bench chirp --shape` aims at.
    pub shape: ShapeSettings,
    /// How the frequency response is estimated.
    pub identify: IdentifySettings,
    /// The closed loop of `bench control`.
    pub control: ControlSettings,
    /// The static steps of `bench calibrate`.
    pub calibrate: CalibrateSettings,
    /// The calibration that runs use.
    pub calibration: CalibrationSettings,
    /// How a person loads the stage between the points of a campaign.
    pub campaign: CampaignSettings,
}
