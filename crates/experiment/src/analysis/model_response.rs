//! The frequency response of the model at any frequency.

use std::f64::consts::TAU;

use nalgebra::Complex;

use bench_config::Config;
use bench_plant::{LoopPlant, ModalModel};

/// The model of a configuration between set-point and reading, for readings of the mean age.
#[derive(Clone, Debug)]
pub struct ModelResponse {
    plant: LoopPlant,
    resonances: Vec<(f64, f64)>,
}

impl ModelResponse {
    /// The model with these modes at the end of the signal path of a configuration.
    pub fn new(config: &Config, modal: &ModalModel) -> ModelResponse {
        let modes = modal.modes.iter();
        ModelResponse {
            plant: LoopPlant::with_mean_age(config, &modal.modes),
            resonances: modes
                .map(|mode| (mode.omega_rad_s, mode.damping_ratio))
                .collect(),
        }
    }

    /// The response in metres per ampere at frequencies in hertz.
    pub fn at(&self, frequency_hz: &[f64]) -> Vec<Complex<f64>> {
        let response = frequency_hz.iter().map(|f| self.plant.response(TAU * f));
        response.collect()
    }

    /// Natural frequency in rad/s and damping ratio of each mode.
    pub fn resonances(&self) -> &[(f64, f64)] {
        &self.resonances
    }

    /// Mean time in seconds from a command to the position in the reading.
    pub fn delay_s(&self) -> f64 {
        self.plant.delay_s()
    }
}
