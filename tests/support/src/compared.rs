//! Chirps of a stage of two masses and two springs, compared, and its closed form.
//!
//! ```text
//! ground --k1-- carriage (m1, force) --k2-- table (m2, reading)
//! ```

use std::f64::consts::TAU;
use std::path::Path;

use bench_config::{Config, Purpose, Source, load};
use bench_experiment::run_comparison::{Comparison, Difference, RunResult};
use bench_experiment::{Plan, never_cancels};
use bench_recording::Recording;

use crate::simulated;

/// k1 of the template in N/m.
pub const GUIDE_N_PER_M: f64 = 40_000.0;
const COUPLING_N_PER_M: f64 = 400_000.0;
const CARRIAGE_KG: f64 = 1.0;
const TABLE_KG: f64 = 0.5;

/// Settings of a short chirp over both modes.
const SETTINGS: [&str; 7] = [
    "loop.rate_hz=1000.0",
    "chirp.start_hz=5.0",
    "chirp.stop_hz=250.0",
    "chirp.duration_s=12.0",
    "chirp.fade_in_s=0.5",
    "chirp.fade_out_s=0.2",
    "control.min_modulus_margin=0.0",
];

/// The stage with a spring k1, and a chirp with noise of a seed.
pub fn config(guide_n_per_m: f64, seed: u64) -> Config {
    let template = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../bench-config/templates/lumped.toml")
        .display()
        .to_string();
    let sets = SETTINGS.iter().map(|set| set.to_string());
    let own = [
        format!("sim.seed={seed}"),
        format!("plant.springs.guide.stiffness_n_per_m={guide_n_per_m:?}"),
    ];
    load(&Source {
        config: Some(template),
        sets: sets.chain(own).collect(),
        purpose: Purpose::Chirp,
        ..Source::default()
    })
    .expect("valid settings")
}

/// The analysed chirp of a stage.
pub fn result(config: &Config) -> RunResult {
    let folder = tempfile::tempdir().expect("a folder");
    let path = simulated::recorded(&Plan::chirp(config.clone()), folder.path());
    let recording = Recording::open(&path).expect("a recording");
    RunResult::of(&recording, &mut never_cancels).expect("an analysis")
}

/// The comparison of two chirps of equal stages with different noise.
pub fn of_equal_stages(pair: u64) -> Comparison {
    let runs = [0, 1].map(|k| result(&config(GUIDE_N_PER_M, 100 + 2 * pair + k)));
    Comparison::of(&runs).expect("two chirps")
}

/// The tested differences of a pair: of both modes, and of the static compliance.
pub fn differences(comparison: &Comparison) -> Vec<Difference> {
    let modes = &comparison.others[0].modes;
    let of_modes = modes
        .modes
        .iter()
        .flat_map(|mode| [mode.frequency_hz, mode.damping_ratio, mode.residue_per_kg]);
    of_modes.chain(modes.static_compliance_m_per_n).collect()
}

/// Mean square of the ratios of differences to their standard deviations. Expected of equal stages: 1; with sigmas that are too
/// large less, with sigmas that are too small more.
pub fn mean_square_ratio(differences: &[Difference]) -> f64 {
    let ratios = differences
        .iter()
        .map(|found| found.difference.value / found.difference.sigma);
    ratios.map(|ratio| ratio * ratio).sum::<f64>() / differences.len() as f64
}

/// Frequency in hertz and residue in 1/kg of both modes, lowest first, by the roots of the characteristic equation
/// (k1 + k2 - m1 L)(k2 - m2 L) = k2^2 with L = w^2.
pub fn modes(guide_n_per_m: f64) -> [(f64, f64); 2] {
    let (k1, k2, m1, m2) = (guide_n_per_m, COUPLING_N_PER_M, CARRIAGE_KG, TABLE_KG);
    let (a, b, c) = (m1 * m2, -(m2 * (k1 + k2) + m1 * k2), k1 * k2);
    let root = (b * b - 4.0 * a * c).sqrt();
    [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)].map(|squared| {
        // Motion of the table for unit motion of the carriage.
        let table = (k1 + k2 - m1 * squared) / k2;
        let residue = table / (m1 + m2 * table * table);
        (squared.sqrt() / TAU, residue)
    })
}
