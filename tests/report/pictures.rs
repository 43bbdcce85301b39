//! Plots of measured responses, for the other tests and for inspection.

use std::path::Path;

use bench_identify::Unit;
use bench_identify::{EstimatorSettings, Frf, Signals, local};
use bench_report::{Curve, Trace, bode_svg};
use nalgebra::Complex;

use crate::report::stage::{self, RATE_HZ, SampledPlant};

/// The response of a plant at given frequencies.
pub fn model(plant: &SampledPlant, frequency_hz: &[f64]) -> Vec<Complex<f64>> {
    frequency_hz.iter().map(|f| plant.response(*f)).collect()
}

/// Frequencies from one to another, evenly spaced on a logarithmic axis.
pub fn frequencies(from_hz: f64, to_hz: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| from_hz * (to_hz / from_hz).powf(k as f64 / (count - 1) as f64))
        .collect()
}

/// A full run on the simulated stage, with noise.
pub fn measured() -> Frf {
    let signals = stage::with_noise(&stage::clean_run(), 1);
    local::estimate(&signals, (0.5, 450.0), &EstimatorSettings::default()).unwrap()
}

/// A run of eight seconds with too little current.
pub fn short_and_noisy() -> Frf {
    let input_a: Vec<f64> = stage::chirp_of(6.0, 0.5, 1.5)
        .iter()
        .map(|u| 0.01 * u)
        .collect();
    let output_m = SampledPlant::stage().simulate(&input_a);
    let signals = stage::with_noise(
        &Signals {
            rate_hz: RATE_HZ,
            input: input_a,
            output: output_m,
        },
        1,
    );
    local::estimate(&signals, (1.0, 300.0), &EstimatorSettings::default()).unwrap()
}

/// A response with the same value at every frequency and no uncertainty.
pub fn flat() -> Frf {
    let count = 100;
    Frf {
        frequency_hz: frequencies(1.0, 100.0, count),
        response: vec![Complex::from(1.5e-4); count],
        coherence: vec![1.0; count],
        magnitude_sigma: vec![0.0; count],
        phase_sigma_rad: vec![0.0; count],
        resolution_hz: vec![10.0; count],
        data: Vec::new(),
    }
}

/// A plot of a measured response, and of the stage where the model is given as well; kept as a file of this name.
pub fn bode(name: &str, frf: &Frf, plant: Option<&SampledPlant>, subtitle: &str) -> String {
    let response = plant.map(|plant| model(plant, &frf.frequency_hz));
    let mut traces = vec![Trace {
        name: "measured",
        curve: Curve::Measured(frf),
    }];
    if let Some(response) = &response {
        let curve = Curve::Model {
            frequency_hz: &frf.frequency_hz,
            response,
        };
        traces.push(Trace {
            name: "model: sampled plant with 1 kHz current loop and one tick of delay",
            curve,
        });
    }
    let svg = bode_svg(
        Unit::MetresPerAmpere,
        &traces,
        "FRF from current to displacement",
        subtitle,
    )
    .unwrap();
    keep(name, &svg);
    svg
}

pub fn keep(name: &str, svg: &str) {
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), svg).unwrap();
}
