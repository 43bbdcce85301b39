//! Measured responses without files: of simulated chirps, and of given modes; the true loop of a controller designed from them.

use bench_config::{Config, Source, load};
use bench_control::{ClosedLoop, ControllerFile, ControllerText, SectionSettings};
use bench_experiment::MeasuredFrf;
use bench_experiment::tuning::FrfSource;
use bench_identify::scatter::SigmaSource;
use bench_identify::{Frf, FrfDatum, FrfPoint, response};
use bench_plant::{LoopPlant, Mode};
use bench_rig::simulated;
use nalgebra::Complex;

use crate::stage::Dice;
use crate::unrecorded;

/// The default configuration at an operating point, in % of the beam length, with further settings.
pub fn config_at(percent: f64, seed: u64, sets: &[&str]) -> Config {
    // The beams are 47.5 mm long.
    let own = [
        format!("plant.operating_point_m={}", 0.0475 * percent / 100.0),
        format!("sim.seed={seed}"),
    ];
    let sets = sets.iter().map(|set| set.to_string()).chain(own).collect();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("valid")
}

/// The response of a chirp on the simulated stage with its noise. The digest is the name: it differs for each source.
pub fn measured(name: &str, config: &Config) -> FrfSource {
    let signals = unrecorded::chirp(config);
    let band_hz = config.chirp.band_hz();
    let frf = response(&signals, band_hz, &config.identify).expect("a response");
    FrfSource {
        file: name.into(),
        sha256: name.into(),
        measured: MeasuredFrf {
            frf,
            recorded: None,
            sigma: SigmaSource::Given,
            cautions: Vec::new(),
        },
    }
}

/// Spacing of the frequencies of a sampled response.
const SPACING: f64 = 2e-3;

/// The response of some modes through the signal path of `config`, with independent circular errors of the standard deviation
/// `sigma_m_per_a` in each component.
pub fn sampled(
    name: &str,
    config: &Config,
    modes: &[Mode],
    (low_hz, high_hz): (f64, f64),
    sigma_m_per_a: f64,
) -> FrfSource {
    let plant = LoopPlant::new(config, modes);
    let mut dice = Dice::new(config.sim.seed);
    let mut frf = Frf::default();
    let count = ((high_hz / low_hz).ln() / SPACING) as i32;
    let variance = 2.0 * sigma_m_per_a * sigma_m_per_a;
    for k in 0..=count {
        let frequency_hz = low_hz * (SPACING * f64::from(k)).exp();
        let error = Complex::new(dice.normal(), dice.normal()) * sigma_m_per_a;
        let response = plant.response(std::f64::consts::TAU * frequency_hz) + error;
        frf.push(FrfPoint {
            frequency_hz,
            response,
            coherence: 1.0,
            variance,
            resolution_hz: SPACING * frequency_hz,
        });
        frf.data.push(FrfDatum {
            frequency_hz,
            spread_hz: 0.0,
            response,
            variance,
        });
    }
    FrfSource {
        file: name.into(),
        sha256: name.into(),
        measured: MeasuredFrf {
            frf,
            recorded: None,
            sigma: SigmaSource::Given,
            cautions: Vec::new(),
        },
    }
}

/// The loop of a designed controller with the plant that is simulated, unmodelled modes included.
pub fn true_loop(config: &Config, sections: &[SectionSettings]) -> ClosedLoop {
    let modes = simulated::modes(&config.plant, &config.sim).expect("modes");
    let file = ControllerFile {
        title: "designed".into(),
        section: sections.to_vec(),
    };
    let text = ControllerText {
        name: "designed".into(),
        text: toml::to_string(&file).expect("TOML"),
    };
    let design = text.design(config.servo.rate_hz).expect("a controller");
    let plant = LoopPlant::new(config, &modes);
    ClosedLoop::new(plant, modes, config.motor.force_constant_n_per_a, design).expect("linear")
}
