//! A design task from the model of a rig.

use super::cascade::ParameterLimits;
use super::design::DesignTask;
use super::disturbance::{Disturbance, PositionDisturbance};
use super::disturbance_spectrum::DisturbanceSpectrum;
use super::error::TuneError;
use super::measured_plant::MeasuredPlant;
use super::plant::{DesignPlant, Tolerances};
use super::requirement::Requirements;
use super::search::Effort;
use super::unmodelled::UnmodelledBound;
use bench_plant::{
    FloorLine, ModalModel, Mode, PlantError, PlantSettings, SignalPath, UnmodelledMode,
};

/// What is designed, and how.
#[derive(Clone, Debug)]
pub struct DesignOptions {
    /// Goal and limits.
    pub requirements: Requirements,
    /// Tolerances of the modes.
    pub tolerances: Tolerances,
    /// Relative tolerance of the frequencies of modes that the model lacks.
    pub unmodelled_ratio: f64,
    /// Number of poles of the controller.
    pub order: usize,
    /// How much is tried.
    pub effort: Effort,
    /// Seed of the search.
    pub seed: u64,
}

/// What a design knows of the rig besides its modes.
#[derive(Clone, Debug)]
pub struct RigModel {
    /// From the command to the reading.
    pub path: SignalPath,
    /// Modes that the model of the plant lacks.
    pub unmodelled: Vec<UnmodelledMode>,
    /// Motion of the floor.
    pub floor: Vec<FloorLine>,
    /// Noise of the probe, standard deviation.
    pub probe_noise_rms_m: f64,
    /// Step of the probe's readings.
    pub probe_step_m: f64,
}

/// A plant of a design by its name, for example its operating point.
#[derive(Clone, Debug)]
pub struct NamedPlant {
    /// Name, for messages.
    pub name: String,
    /// The modes.
    pub modes: Vec<Mode>,
}

impl NamedPlant {
    /// The modes of the plant of some settings.
    ///
    /// # Errors
    /// The settings describe no plant.
    pub fn of(name: &str, settings: &PlantSettings) -> Result<NamedPlant, PlantError> {
        Ok(NamedPlant {
            name: name.into(),
            modes: ModalModel::of(&bench_plant::build(settings)?)?.modes,
        })
    }
}

/// Damping ratio of pairs of poles from which on they are robust against the rounding of a file and of the tolerances of modes.
const LEAST_POLE_DAMPING: f64 = 0.08;
/// The largest frequency of a pole as part of half the sampling rate: at 5 kHz it is 6000 rad/s.
const POLE_RANGE: f64 = 6000.0 / (std::f64::consts::PI * 5000.0);
/// The smallest frequency of zeros and poles as part of that of the first mode.
const LOWEST_RATIO: f64 = 5e-3;

impl DesignTask {
    /// The task for some plants at the signal path, with disturbances and unmodelled modes, of a rig.
    ///
    /// # Errors
    /// There is no plant.
    pub fn new(
        rig: &RigModel,
        plants: &[NamedPlant],
        options: DesignOptions,
    ) -> Result<DesignTask, TuneError> {
        let path = &rig.path;
        let first = plants.first().ok_or(TuneError::NoPlant)?;
        let varied = plants.iter().flat_map(|plant| {
            let (name, modes) = (&plant.name, &plant.modes);
            DesignPlant::with_tolerances(name, path, modes, &options.tolerances)
        });
        Ok(DesignTask {
            plants: varied.collect(),
            bound: UnmodelledBound::of(path, &rig.unmodelled, options.unmodelled_ratio),
            disturbance: disturbance(rig),
            limits: limits(path, &first.modes),
            requirements: options.requirements,
            order: options.order,
            effort: options.effort,
            seed: options.seed,
        })
    }
}

impl DesignTask {
    /// The same task with a measured disturbance in place of the lines of the floor.
    #[must_use]
    pub fn with_disturbance(mut self, measured: DisturbanceSpectrum) -> DesignTask {
        self.disturbance.position = PositionDisturbance::Measured(measured);
        self
    }

    /// The task for plants that were measured: without a model. What the fitted modes lack is in the uncertainty of each plant, and
    /// the modes that count with any phase are in the bound. The disturbance of the position is not known.
    ///
    /// # Errors
    /// There is no plant.
    pub fn measured(
        plants: &[MeasuredPlant],
        options: DesignOptions,
    ) -> Result<DesignTask, TuneError> {
        let first = plants.first().ok_or(TuneError::NoPlant)?;
        let varied = plants
            .iter()
            .flat_map(|plant| plant.with_tolerances(&options.tolerances));
        let bounds: Vec<UnmodelledBound> = plants
            .iter()
            .map(|plant| plant.minor_bound(options.unmodelled_ratio))
            .collect();
        Ok(DesignTask {
            plants: varied.collect(),
            bound: UnmodelledBound::largest(&bounds),
            disturbance: Disturbance::default(),
            limits: limits(&first.response.path, &first.modes),
            requirements: options.requirements,
            order: options.order,
            effort: options.effort,
            seed: options.seed,
        })
    }
}

/// Lines of the floor, and noise and quantisation of the probe: a step q has the variance q^2/12.
fn disturbance(rig: &RigModel) -> Disturbance {
    let (noise_m, step_m) = (rig.probe_noise_rms_m, rig.probe_step_m);
    Disturbance {
        position: PositionDisturbance::Floor(rig.floor.clone()),
        noise_rms_m: (noise_m * noise_m + step_m * step_m / 12.0).sqrt(),
    }
}

fn limits(path: &SignalPath, modes: &[Mode]) -> ParameterLimits {
    let nyquist_rad_s = std::f64::consts::PI / path.period_s;
    let pole_rad_s = POLE_RANGE * nyquist_rad_s;
    let first = modes.iter().find(|mode| mode.omega_rad_s > 0.0);
    let first_rad_s = first.map_or(pole_rad_s, |mode| mode.omega_rad_s);
    ParameterLimits {
        pole_rad_s,
        lowest_rad_s: LOWEST_RATIO * first_rad_s.min(pole_rad_s),
        pole_damping_ratio: LEAST_POLE_DAMPING,
    }
}
