//! The types of a configuration. Ranges stand here and nowhere else.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::campaign::CampaignSettings;
use super::devices::{AmplifierDevice, ProbeDevice};
use super::excitation::{ExcitationSettings, MultisineSettings, PrbsSettings, ShapeSettings, SteppedSineSettings};
use super::plant::PlantSettings;

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

/// The real-time loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoopSettings {
    /// Servo rate in ticks per second.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub rate_hz: f64,
    /// Whole periods between a measurement and the moment its command acts.
    #[schemars(range(min = 0, max = 8))]
    pub computing_delay_periods: u32,
    /// SCHED_FIFO priority of the loop's thread in real time.
    #[schemars(range(min = 1, max = 98))]
    pub priority: i32,
    /// Processor to bind the loop's thread to; left to the scheduler if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1023))]
    pub cpu: Option<usize>,
}

impl LoopSettings {
    /// Length of a tick in seconds.
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }
}

/// The voice coil motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorSettings {
    /// Force constant in newtons per ampere; positive current gives positive force.
    #[schemars(range(min = 1e-6, max = 1e4))]
    pub force_constant_n_per_a: f64,
    /// Peak force in newtons: a command beyond it trips.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub peak_force_n: f64,
    /// Continuous force in newtons: the thermal current may not exceed it.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub continuous_force_n: f64,
    /// Thermal time constant of the winding in seconds.
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub thermal_time_constant_s: f64,
}

impl MotorSettings {
    /// The current of the peak force in amperes.
    pub fn peak_current_a(&self) -> f64 {
        self.peak_force_n / self.force_constant_n_per_a
    }

    /// The current of the continuous force in amperes.
    pub fn continuous_current_a(&self) -> f64 {
        self.continuous_force_n / self.force_constant_n_per_a
    }
}

/// The current amplifier: the current follows the limited command through a first order lag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplifierSettings {
    /// Bandwidth of the current loop in hertz.
    #[schemars(range(min = 1.0, max = 1e6))]
    pub bandwidth_hz: f64,
    /// Largest current in amperes.
    #[schemars(range(min = 1e-3, max = 1000.0))]
    pub current_limit_a: f64,
    /// Largest change of the current's set-point in amperes per second.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub slew_limit_a_per_s: f64,
    /// From the moment a command is due to the moment its set-point acts, in seconds: bus and drive. Whole periods of
    /// computing stand in `loop.computing_delay_periods`, the current loop's own lag in `bandwidth_hz`.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub latency_s: f64,
    /// What stands behind the interface.
    pub device: AmplifierDevice,
}

/// The displacement probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSettings {
    /// Full range in metres; readings go from minus to plus half of it.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub range_m: f64,
    /// Readings that arrive in a second, by a clock of the probe's own; absent if each tick has a reading of its very moment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 1e6))]
    pub rate_hz: Option<f64>,
    /// From a measurement to the moment the probe could tell it (filters, computing), in seconds.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub latency_s: f64,
    /// From that moment to the arrival of the whole reading (request, line), in seconds.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub transport_s: f64,
    /// What stands behind the interface.
    pub device: ProbeDevice,
}

impl ProbeSettings {
    /// Age in seconds of a reading when it arrives.
    pub fn age_at_arrival_s(&self) -> f64 {
        self.latency_s + self.transport_s
    }
}

/// What trips: zero current in the same tick, amplifier disabled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InterlockSettings {
    /// Travel in either direction, in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub soft_limit_m: f64,
    /// Largest age of a reading in seconds.
    #[schemars(range(min = 1e-6, max = 10.0))]
    pub probe_stale_s: f64,
    /// Longest time in seconds for which a reading may not change while the current does.
    #[schemars(range(min = 1e-4, max = 100.0))]
    pub probe_stuck_s: f64,
    /// The change of current in amperes that a reading must answer.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub probe_stuck_current_a: f64,
    /// How far the current that the amplifier measures may lie from the commands, in amperes.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub current_error_a: f64,
    /// Over how long a time in seconds; longer than the amplifier's status is late.
    #[schemars(range(min = 1e-4, max = 100.0))]
    pub current_error_s: f64,
    /// Ticks that may be missed within one second.
    #[schemars(range(min = 0, max = 1000000))]
    pub overruns_per_s: u32,
}

/// How the simulated stage obeys its constraints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// Linearised about the operating point, as the model is.
    #[default]
    Linear,
    /// As they are, x_i - x_j = -0.6 (y_i - y_j)^2/L: the response depends on the amplitude. Plant `sr4dof` only.
    Quadratic,
}

/// The simulated rig beyond the plant's model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimSettings {
    /// The constraints of the simulated stage, linearised or not.
    #[serde(default)]
    pub geometry: Geometry,
    /// What the simulated stage has of mass asymmetry m2/m3 - 1 beyond `plant.mass_asymmetry`, which nobody knows of: an
    /// initial asymmetry by manufacture (section 5.2.2). Plant `sr4dof` only.
    #[serde(default)]
    #[schemars(range(min = -0.5, max = 0.5))]
    pub asymmetry_offset: f64,
    /// Seed of noise and disturbance.
    #[schemars(range(min = 0, max = 9223372036854775807i64))]
    pub seed: u64,
    /// White noise of the probe, RMS a reading, in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probe_noise_rms_m: f64,
    /// Quantisation of the probe in metres; 0 for none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probe_quantisation_m: f64,
    /// Mechanical stop on either side, in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub stop_m: f64,
    /// Stiffness of the stop in newtons per metre.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub stop_stiffness_n_per_m: f64,
    /// Damping of the stop in newton-seconds per metre.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub stop_damping_n_s_per_m: f64,
    /// Modes of the rig that the plant's model leaves out.
    pub unmodelled: Vec<UnmodelledMode>,
    /// Lines of the floor's acceleration in X.
    pub floor: Vec<FloorLine>,
}

/// A mode of the rig that the plant's model leaves out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnmodelledMode {
    /// Natural frequency in hertz.
    #[schemars(range(min = 0.01, max = 1e5))]
    pub frequency_hz: f64,
    /// Damping ratio.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub damping_ratio: f64,
    /// Residue from force to displacement in 1/kg, with its sign.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub residue_per_kg: f64,
}

/// White noise through the band-pass 2 zeta w s/(s^2 + 2 zeta w s + w^2), scaled to an RMS acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FloorLine {
    /// Centre frequency in hertz.
    #[schemars(range(min = 0.01, max = 1e5))]
    pub frequency_hz: f64,
    /// Damping ratio: the line's full width at half power is 2 zeta times its frequency.
    #[schemars(range(min = 1e-4, max = 0.99))]
    pub damping_ratio: f64,
    /// RMS of the line in m/s^2.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub acceleration_rms_m_per_s2: f64,
}

/// How a sweep's frequency runs over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sweep {
    /// f(t) = f0 + (f1 - f0) t/T.
    Linear,
    /// f(t) = f0 (f1/f0)^(t/T).
    Logarithmic,
}

/// The excitation of `bench chirp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChirpSettings {
    /// Linear or logarithmic.
    pub sweep: Sweep,
    /// First frequency in hertz.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub start_hz: f64,
    /// Last frequency in hertz, below half the servo rate.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub stop_hz: f64,
    /// Length of the sweep in seconds.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub duration_s: f64,
    /// Zero current before the sweep, in seconds.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub quiet_before_s: f64,
    /// Zero current after the sweep, in seconds: long enough for the stage to come to rest.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub quiet_after_s: f64,
    /// Length of the cosine fade at the start, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub fade_in_s: f64,
    /// Length of the cosine fade at the end, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub fade_out_s: f64,
    /// How often the chirp, its quiet included, is run; the analysis takes their mean.
    #[serde(default = "once")]
    #[schemars(range(min = 1, max = 10000))]
    pub repetitions: u32,
    /// Amplitude over frequency: straight lines on logarithmic axes, constant outside; one point is a flat sweep.
    #[schemars(length(min = 1, max = 64))]
    pub amplitude: Vec<AmplitudePoint>,
}

impl ChirpSettings {
    /// The band in hertz, lowest and highest frequency, whichever way the sweep runs.
    pub fn band_hz(&self) -> (f64, f64) {
        (self.start_hz.min(self.stop_hz), self.start_hz.max(self.stop_hz))
    }
}

fn once() -> u32 {
    1
}

/// The amplitude of the excitation at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplitudePoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Amplitude in amperes.
    #[schemars(range(min = 1e-9, max = 1000.0))]
    pub current_a: f64,
}

/// How the frequency response is estimated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum IdentifySettings {
    /// By smooth curves through neighbouring frequencies of the transform of the whole record: no leakage where it begins and
    /// ends at rest.
    Local(LocalSettings),
    /// Over segments in time (Welch): Hann windows, half overlapped.
    Welch {
        /// Length of a segment in seconds.
        #[schemars(range(min = 0.001, max = 100000.0))]
        segment_s: f64,
        /// Which signal has noise.
        #[serde(default)]
        estimator: Estimator,
    },
}

/// The local estimator: resolution, grid, and shape of the curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LocalSettings {
    /// Half-width of the neighbourhood of a frequency, as a ratio of the frequency.
    #[schemars(range(min = 0.0, max = 0.1))]
    pub resolution_ratio: f64,
    /// Smallest half-width in bins of the record's transform.
    #[schemars(range(min = 2, max = 10000))]
    pub min_half_width_bins: usize,
    /// Half-width over frequency in place of the ratio, in rising order: straight lines on logarithmic axes, constant outside.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub resolution: Vec<ResolutionPoint>,
    /// So many frequencies, evenly on a logarithmic axis; without it they are half of a half-width apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 1000000))]
    pub frequencies: Option<usize>,
    /// The shape of the response within a neighbourhood.
    #[serde(default)]
    pub curve: Curve,
    /// Which signal has noise.
    #[serde(default)]
    pub estimator: Estimator,
    /// Whether the record begins or ends in motion: what that leaves in the transform is then estimated with the response.
    #[serde(default)]
    pub transient: bool,
}

/// The resolution of an estimate at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResolutionPoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Half-width of the neighbourhood there, in hertz.
    #[schemars(range(min = 1e-6, max = 1e4))]
    pub half_width_hz: f64,
}

/// What shape a response is given within a neighbourhood of frequencies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// A constant: the weighted mean. Its bias grows with the square of the half-width.
    Constant,
    /// A parabola: bias of the fourth power.
    Polynomial,
    /// A parabola over a straight line, a pole, where the data call for one; else a parabola.
    #[default]
    Rational,
}

/// Which signal has noise, and so which estimate of H is without bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The output: what a bench has, whose command is known exactly.
    #[default]
    H1,
    /// The input.
    H2,
    /// Both, in the same ratio to the signal: the geometric mean of H1 and H2.
    Hv,
}

/// The closed loop of `bench control`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlSettings {
    /// `fast`, `slow`, or the path of a TOML file with sections.
    pub controller: String,
    /// A loop with a smaller modulus margin (1/max|S|), or an unstable one, is refused; 0 refuses none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub least_modulus_margin: f64,
    /// Zero current before the loop closes, in seconds; the mean position over it is the origin of the reference.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Length of the run after the loop closed, in seconds.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub duration_s: f64,
    /// Seconds after the last change of the reference from which on the steady state is measured.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub steady_after_s: f64,
    /// What to follow.
    pub reference: ReferenceSettings,
}

/// A reference, relative to where the stage rests when the loop closes; zero before its start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ReferenceSettings {
    /// Stay where the loop closed.
    Hold,
    /// A step.
    Step {
        /// Height in metres.
        #[schemars(range(min = -1.0, max = 1.0))]
        amplitude_m: f64,
        /// When, in seconds after the loop closed.
        #[schemars(range(min = 0.0, max = 1000000.0))]
        at_s: f64,
    },
    /// From 0 to a height at a constant speed, then stay.
    Ramp {
        /// Height in metres.
        #[schemars(range(min = -1.0, max = 1.0))]
        amplitude_m: f64,
        /// Speed in metres per second.
        #[schemars(range(min = 1e-12, max = 100.0))]
        speed_m_per_s: f64,
        /// When, in seconds after the loop closed.
        #[schemars(range(min = 0.0, max = 1000000.0))]
        at_s: f64,
    },
    /// A sine that starts at zero.
    Sine {
        /// Amplitude in metres.
        #[schemars(range(min = -1.0, max = 1.0))]
        amplitude_m: f64,
        /// Frequency in hertz, below half the servo rate.
        #[schemars(range(min = 1e-4, max = 50000.0))]
        frequency_hz: f64,
    },
    /// The sweep of `[chirp]` with its quiets, in metres: for identification in closed loop. The run lasts as long as the
    /// sweep, whatever `control.duration_s` says.
    Chirp {
        /// Amplitude over frequency: straight lines on logarithmic axes, constant outside. Without a point it is planned from
        /// the model: the command has the amplitude of `[chirp]` where the stage moves by no more than `travel_m`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        #[schemars(length(max = 64))]
        amplitude: Vec<TravelPoint>,
        /// Amplitude in metres by which a planned sweep moves the stage at most.
        #[schemars(range(min = 1e-9, max = 1.0))]
        travel_m: f64,
    },
    /// A CSV file with the columns `time_s,reference_m`; straight lines between its points.
    File {
        /// Path of the file.
        path: String,
    },
}

/// The amplitude of a swept reference at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TravelPoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Amplitude in metres.
    #[schemars(range(min = 1e-12, max = 1.0))]
    pub amplitude_m: f64,
}

/// The static steps of `bench calibrate`, and the chirp that it measures the delay by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrateSettings {
    /// Largest current in amperes, to both sides.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub amplitude_a: f64,
    /// Levels on either side of zero.
    #[schemars(range(min = 1, max = 100))]
    pub levels: u32,
    /// Time from a level to the next in seconds: some periods of the slowest mode, so that it is not set swinging.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub ramp_s: f64,
    /// Time in seconds for the stage to come to rest.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Time in seconds over which a level is averaged.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub average_s: f64,
    /// Length in seconds of the chirp that the delay is measured by; its band and amplitude are those of `[chirp]`.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub chirp_duration_s: f64,
    /// By what the probe's scale is known.
    pub scale_by: ScaleBy,
    /// Largest distance of a level from a straight line, as a ratio of the whole travel.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub largest_nonlinearity_ratio: f64,
    /// Largest distance between the ways up and down, as a ratio of the whole travel.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub largest_hysteresis_ratio: f64,
}

/// By what the probe's scale is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleBy {
    /// By itself: a calibration corrects its sign and offset.
    Nothing,
    /// By the model's static compliance: a calibration corrects its scale as well.
    Model,
}

/// The calibration that runs use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationSettings {
    /// A file made by `bench calibrate`; none if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Days for which it holds.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub valid_days: f64,
    /// What happens when it is older.
    pub when_expired: WhenUnfit,
    /// What happens when it is of other devices.
    pub when_foreign: WhenUnfit,
}

/// What happens when a calibration is not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WhenUnfit {
    /// A warning; the run goes on with it.
    Warn,
    /// The run is refused.
    Refuse,
}
