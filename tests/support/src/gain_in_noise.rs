//! A constant gain with white noise on its measured input and output, and the estimators for it.

use bench_identify::{
    Estimator, EstimatorSettings, Frf, IdentifyError, LocalModel, Signals, local, welch,
};

use crate::stage::Dice;

pub const GAIN: f64 = 1.5e-4;
const BAND_HZ: (f64, f64) = (5.0, 495.0);
/// Ratio of the noise power to the signal power, at every frequency.
pub const NOISE: f64 = 0.05;
pub const ESTIMATORS: [Estimator; 3] = [Estimator::H1, Estimator::H2, Estimator::Hv];

pub type Estimate = dyn Fn(&Signals, Estimator) -> Result<Frf, IdentifyError>;

/// White input through a gain, so there is no leakage and no curvature. `on_input` and `on_output` are the ratios of the noise
/// power to the signal power.
pub fn signals(seed: u64, on_input: f64, on_output: f64) -> Signals {
    let mut dice = Dice::new(seed);
    let truth: Vec<f64> = (0..10_000).map(|_| dice.normal()).collect();
    let mut noisy = |gain: f64, noise: f64| -> Vec<f64> {
        truth
            .iter()
            .map(|u| gain * (u + noise.sqrt() * dice.normal()))
            .collect()
    };
    Signals {
        rate_hz: 1000.0,
        input: noisy(1.0, on_input),
        output: noisy(GAIN, on_output),
    }
}

fn by_curves(curve: LocalModel) -> impl Fn(&Signals, Estimator) -> Result<Frf, IdentifyError> {
    move |signals, estimator| {
        let settings = EstimatorSettings {
            curve,
            estimator,
            resolution_ratio: 0.0,
            ..EstimatorSettings::default()
        };
        local::estimate(signals, BAND_HZ, &settings)
    }
}

fn by_segments(signals: &Signals, estimator: Estimator) -> Result<Frf, IdentifyError> {
    welch::estimate(signals, BAND_HZ, 500, estimator)
}

pub fn every_way() -> [(&'static str, Box<Estimate>); 4] {
    [
        ("constant", Box::new(by_curves(LocalModel::Constant))),
        ("polynomial", Box::new(by_curves(LocalModel::Polynomial))),
        ("rational", Box::new(by_curves(LocalModel::Rational))),
        ("welch", Box::new(by_segments)),
    ]
}
