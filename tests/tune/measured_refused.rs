//! Responses that give no plant for a design are refused with a remedy.

use bench_config::Config;
use bench_experiment::tuning::{FrfSource, IdentifiedFrf, TuneSourceError, evidence};
use bench_plant::{ModalModel, Mode, build};
use bench_test_support::chirp_source::{config_at, sampled};
use nalgebra::{Complex, DVector};

use crate::tune::measured::designed;

const BAND_HZ: (f64, f64) = (1.0, 200.0);

/// The response of the model of the stage at an operating point, with a noise of a thousandth of its static response.
fn source(name: &str, config: &Config, band_hz: (f64, f64)) -> FrfSource {
    let modes = ModalModel::of(&build(&config.plant).unwrap())
        .unwrap()
        .modes;
    sampled(name, config, &modes, band_hz, 1.5e-7)
}

fn config(sets: &[&str]) -> Config {
    config_at(8.0, 3, sets)
}

#[track_caller]
fn says(error: &TuneSourceError, words: &[&str]) {
    let text = error.to_string();
    assert!(text.contains("; "), "no remedy: {text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

#[track_caller]
fn refusal(sources: Vec<FrfSource>, config: &Config) -> TuneSourceError {
    // The text of a plant would be some hundred kilobytes.
    match IdentifiedFrf::all(sources, config) {
        Err(error) => error,
        Ok(_) => panic!("not refused"),
    }
}

/// The source with its points changed; those for which the change gives `None` are omitted.
fn changed(
    source: &FrfSource,
    change: impl Fn(f64, Complex<f64>) -> Option<Complex<f64>>,
) -> FrfSource {
    let mut changed = source.clone();
    let frf = &source.measured.frf;
    changed.measured.frf = Default::default();
    for k in 0..frf.len() {
        if let Some(response) = change(frf.frequency_hz[k], frf.response[k]) {
            let factor = (response / frf.response[k]).norm();
            changed.measured.frf.push(bench_identify::FrfPoint {
                frequency_hz: frf.frequency_hz[k],
                response,
                coherence: 1.0,
                variance: 2.0 * (factor * frf.magnitude_sigma[k]).powi(2),
                resolution_hz: frf.resolution_hz[k],
            });
        }
    }
    changed.measured.frf.data = source
        .measured
        .frf
        .data
        .iter()
        .filter_map(|datum| {
            let response = change(datum.frequency_hz, datum.response)?;
            let factor = (response / datum.response).norm();
            Some(bench_identify::FrfDatum {
                response,
                variance: datum.variance * factor * factor,
                ..*datum
            })
        })
        .collect();
    changed
}

#[test]
fn refuses_micrometres_per_ampere_given_as_metres() {
    let config = config(&[]);
    let micrometres = changed(&source("um.csv", &config, BAND_HZ), |_, h| Some(h * 1e6));
    says(
        &refusal(vec![micrometres], &config),
        &["um.csv", "m/A", "unit", "interlock.soft_limit_m"],
    );
    let millimetres = changed(&source("mm.csv", &config, BAND_HZ), |_, h| Some(h * 1e3));
    says(&refusal(vec![millimetres], &config), &["mm.csv", "unit"]);
}

#[test]
fn refuses_a_gap_that_may_hide_a_resonance() {
    let config = config(&[]);
    // The smallest damping ratio of the stage is 0.0039: at 120 Hz such a resonance is 0.94 Hz wide.
    let gap = changed(&source("gap.csv", &config, BAND_HZ), |f, h| {
        (!(120.0..122.0).contains(&f)).then_some(h)
    });
    says(
        &refusal(vec![gap], &config),
        &["gap.csv", "no point between 119", "sweep"],
    );
}

#[test]
fn refuses_a_delay_larger_than_a_period_and_a_removed_delay() {
    let config = config(&[]);
    let delayed = |delay_s: f64| {
        changed(&source("late.csv", &config, BAND_HZ), move |f, h| {
            Some(h * Complex::from_polar(1.0, -std::f64::consts::TAU * f * delay_s))
        })
    };
    // A period is 0.2 ms.
    says(
        &refusal(vec![delayed(0.5e-3)], &config),
        &["late.csv", "+0.500 ms", "loop.rate_hz"],
    );
    says(
        &refusal(vec![delayed(-0.2e-3)], &config),
        &["late.csv", "_frf.csv"],
    );
}

#[test]
fn refuses_a_response_of_another_loop_rate() {
    // At 1 kHz the delay is longer by 0.8 ms, and that of the hold by 0.4 ms.
    let slow = config(&["loop.rate_hz=1000", "chirp.stop_hz=400"]);
    let fast = config(&[]);
    let error = refusal(vec![source("slow.csv", &slow, BAND_HZ)], &fast);
    says(&error, &["slow.csv", "ms", "loop.rate_hz"]);
}

#[test]
fn refuses_one_operating_point_twice_although_the_noise_differs() {
    let [first, second] = [3, 4].map(|seed| config_at(8.0, seed, &[]));
    let sources = vec![
        source("a.csv", &first, BAND_HZ),
        source("b.csv", &second, BAND_HZ),
    ];
    says(
        &refusal(sources, &first),
        &["a.csv", "b.csv", "same operating point", "leave one"],
    );
    let twice = vec![
        source("a.csv", &first, BAND_HZ),
        source("a.csv", &first, BAND_HZ),
    ];
    says(
        &refusal(twice, &first),
        &["same operating point", "content"],
    );
}

#[test]
fn refuses_a_stage_without_a_spring() {
    let config = config(&[]);
    let free = Mode {
        omega_rad_s: 0.0,
        damping_ratio: 0.0,
        shape: DVector::zeros(0),
        force_gain: 0.5,
        sensor_gain: 1.0,
        floor_gain: 0.0,
    };
    let mode = Mode {
        omega_rad_s: 400.0,
        damping_ratio: 0.01,
        ..free.clone()
    };
    let source = sampled("free.csv", &config, &[free, mode], (4.0, 200.0), 1e-8);
    says(
        &refusal(vec![source], &config),
        &["free.csv", "free body", "chirp.start_hz"],
    );
}

#[test]
fn refuses_a_band_without_the_crossover() {
    let config = config(&["sim.unmodelled=[]"]);
    // Modes u and v at 82 and 86 Hz are above this band, and so is the crossover of a design from the first mode alone.
    let frfs =
        IdentifiedFrf::all(vec![source("short.csv", &config, (1.0, 40.0))], &config).unwrap();
    let sections = designed(&frfs, 4).cascade.sections();
    let error = evidence(&frfs, &sections, &config).expect_err("a refusal");
    says(&error, &["short.csv", "chirp.stop_hz"]);
}
