//! The simulated stage at 1 kHz, and runs on it.
use std::path::{Path, PathBuf};

use bench_config::{Config, Purpose, Source, load};
use bench_experiment::{Analysis, Plan};
use bench_recording::Recording;

use crate::excitation::simulated;

/// 1 kHz, up to 400 Hz.
const HERE: [&str; 2] = ["loop.rate_hz=1000", "chirp.stop_hz=400.0"];
/// No noise, no quantisation, no floor vibration.
pub const SILENT: [&str; 3] = [
    "sim.probe_noise_rms_m=0",
    "sim.probe_quantisation_m=0",
    "sim.floor=[]",
];

/// Each kind of excitation with settings that resolve the modes of the stage: the line spacing is at most the width of a mode.
pub const KINDS: [(&str, &[&str]); 3] = [
    ("multisine", &["multisine.periods=8"]),
    (
        "prbs",
        &[
            "prbs.order=14",
            "prbs.clock_divider=1",
            "prbs.periods=8",
            "prbs.amplitude_a=0.5",
        ],
    ),
    (
        "stepped_sine",
        &[
            "chirp.start_hz=26.0",
            "chirp.stop_hz=92.0",
            "stepped_sine.count=133",
            "stepped_sine.spacing=linear",
            "stepped_sine.settle_s=8.0",
            "stepped_sine.measure_s=1.0",
            "chirp.amplitude=[{ frequency_hz = 1.0, current_a = 0.04 }]",
        ],
    ),
];

pub fn config(sets: &[&str]) -> Config {
    let sets = HERE.iter().chain(sets).map(|set| set.to_string()).collect();
    load(&Source {
        sets,
        purpose: Purpose::Chirp,
        ..Source::default()
    })
    .expect("valid settings")
}

/// The configuration of a kind of excitation, with `more` settings.
pub fn of_kind((kind, sets): (&str, &[&str]), more: &[&str]) -> Config {
    let kind = format!("excitation.kind={kind}");
    config(&[&[kind.as_str()], sets, more].concat())
}

pub fn recorded(config: &Config, folder: &Path) -> PathBuf {
    simulated::recorded(&Plan::chirp(config.clone()), folder)
}

pub fn analysed(config: &Config) -> Analysis {
    simulated::analysed(&Plan::chirp(config.clone()), config).expect("an analysis")
}

/// The largest measured displacement, in metres.
pub fn travel_m(path: &Path) -> f64 {
    let recording = Recording::open(path).expect("a recording");
    recording
        .ticks()
        .expect("ticks")
        .map(|record| record.expect("whole").position_m.abs())
        .fold(0.0, f64::max)
}
