//! A chirp over the simulated chain of the profile `lab`, against the closed form.
use bench_config::Config;
use bench_experiment::{Analysis, Plan};
use bench_plant::Mode;
use bench_rig::simulated::modes as simulated_modes;
use nalgebra::Complex;

use crate::lab::aliases::{lab, response};
use crate::lab::simulated;

const QUIET: [&str; 4] = [
    "sim.floor=[]",
    "sim.probe_noise_rms_m=0",
    "sim.probe_quantisation_m=0",
    "chirp.duration_s=60",
];

fn measured(config: &Config, assumed: &Config) -> Analysis {
    simulated::analysed(&Plan::chirp(config.clone()), assumed).expect("an analysis")
}

/// Ratios of the measured to the exact response between two frequencies.
fn ratios(
    analysis: &Analysis,
    config: &Config,
    modes: &[Mode],
    band_hz: (f64, f64),
) -> Vec<Complex<f64>> {
    let at = |(f, h): (&f64, &Complex<f64>)| {
        let exact = response(config, modes, std::f64::consts::TAU * f, true);
        h / exact
    };
    let all = analysis.frf.frequency_hz.iter().zip(&analysis.frf.response);
    all.filter(|(f, _)| (band_hz.0..band_hz.1).contains(*f))
        .map(at)
        .collect()
}

fn share_beyond(ratios: &[Complex<f64>], percent: f64, deg: f64) -> f64 {
    let off = |r: &&Complex<f64>| {
        (r.norm() - 1.0).abs() > percent / 100.0 || r.arg().to_degrees().abs() > deg
    };
    ratios.iter().filter(off).count() as f64 / ratios.len() as f64
}

#[test]
fn slow_free_running_probe_does_not_bias_the_response() {
    let config = lab(&QUIET);
    let (analysis, modes) = (
        measured(&config, &config),
        simulated_modes(&config.plant, &config.sim).expect("modes"),
    );
    let all = ratios(&analysis, &config, &modes, (0.5, 140.0));
    assert!(all.len() > 1000);
    // A current step of 2 mA of 0.1 to 1.5 A gives 0.5 % of noise in a bin. With a constant age for all readings the error would
    // be about 30 %.
    assert!(
        share_beyond(&all, 1.0, 1.0) < 0.01,
        "{}",
        share_beyond(&all, 1.0, 1.0)
    );
    let low = ratios(&analysis, &config, &modes, (0.5, 25.0));
    assert!(
        share_beyond(&low, 0.2, 0.2) < 0.01,
        "{}",
        share_beyond(&low, 0.2, 0.2)
    );
}

#[test]
fn phase_gives_the_delay_of_amplifier_or_probe() {
    for (set, extra_s) in [
        ("amplifier.latency_s=0.0004", 0.0),
        ("amplifier.latency_s=0.0011", 0.0007),
        ("probe.latency_s=0.0012", 0.0009),
    ] {
        let config = lab(&[&QUIET[..], &[set]].concat());
        let mut assumed = lab(&QUIET);
        assumed.amplifier.latency_s = 0.0004;
        let analysis = measured(&config, &assumed);
        let excess = analysis.excess_delay.expect("enough frequencies");
        // The unmodelled modes shift the phase by 0.1 degree at 100 Hz, that is 3 us.
        assert!((excess.value - extra_s).abs() < 6e-6, "{set}: {excess:?}");
    }
}
