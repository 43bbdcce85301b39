//! FRFs that do not belong to the loop, or do not contain its margins, are refused with a remedy.

use bench_config::Config;
use bench_control::ClosedLoop;
use bench_experiment::{FrfError, MeasuredFrf, closed_loop, measured_margins};
use bench_identify::Frf;
use bench_identify::frf_csv::{self, METRES_PER_AMPERE};
use bench_identify::scatter::SigmaSource;

use crate::measured::program::Bench;
use crate::measured::sampled::{config, frf};

const BAND_HZ: (f64, f64) = (0.1, 500.0);

fn refusal(frf: Frf, config: &Config) -> FrfError {
    let model = closed_loop(config).expect("a loop");
    let measured = MeasuredFrf {
        frf,
        recorded: None,
        sigma: SigmaSource::Given,
        cautions: Vec::new(),
    };
    measured_margins(&measured, &model, config).expect_err("a refusal")
}

#[track_caller]
fn says(error: &FrfError, words: &[&str]) {
    let text = error.to_string();
    assert!(text.contains("; "), "no remedy: {text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

fn model(sets: &[&str]) -> (Config, ClosedLoop) {
    let config = config(sets);
    let model = closed_loop(&config).expect("a loop");
    (config, model)
}

/// The FRF without the points between two frequencies.
fn without(frf: &Frf, (low_hz, high_hz): (f64, f64)) -> Frf {
    let mut rest = Frf::default();
    for k in 0..frf.len() {
        let f = frf.frequency_hz[k];
        if f < low_hz || f > high_hz {
            rest.push(bench_identify::FrfPoint {
                frequency_hz: f,
                response: frf.response[k],
                coherence: 1.0,
                variance: 2.0 * frf.magnitude_sigma[k].powi(2),
                resolution_hz: 1e-3 * f,
            });
        }
    }
    rest
}

#[test]
fn refuses_a_band_without_the_crossover() {
    // The crossover of the fast controller is at 45 Hz. |L| at mode R, 29 Hz, is above 1, and below 1 from 60 Hz on.
    let (config, model) = model(&[]);
    let above = refusal(frf(&model, (60.0, 500.0)), &config);
    assert!(matches!(above, FrfError::Loop(_)));
    says(&above, &["begins at 60", "chirp.start_hz"]);
    let below = refusal(frf(&model, (0.1, 20.0)), &config);
    says(&below, &["ends at 19.9", "chirp.stop_hz"]);
}

#[test]
fn refuses_a_band_without_the_peak_of_s() {
    // Just above the last crossing of |L| = 1, |L| is near 1 above the band, and |S| may be large there.
    let (config, model) = model(&[]);
    let last = model.margins().crossings.last().expect("one").rad_s;
    let end_hz = 1.03 * last / std::f64::consts::TAU;
    says(
        &refusal(frf(&model, (0.1, end_hz)), &config),
        &["peak of |S|", "chirp.stop_hz"],
    );
}

#[test]
fn refuses_a_gap_that_may_hide_a_resonance_and_accepts_a_narrower_one() {
    let (config, model) = model(&[]);
    let whole = frf(&model, BAND_HZ);
    // The smallest damping ratio of the model is 0.0039: at 120 Hz such a resonance is 0.94 Hz wide.
    says(
        &refusal(without(&whole, (120.0, 121.5)), &config),
        &["no point between 119", "sweep"],
    );
    let measured = MeasuredFrf {
        frf: without(&whole, (120.0, 120.05)),
        recorded: None,
        sigma: SigmaSource::Given,
        cautions: Vec::new(),
    };
    // The model's own points are 0.6 % apart: 0.7 Hz.
    assert!(measured_margins(&measured, &model, &config).is_ok());
}

#[test]
fn refuses_an_frf_whose_delay_was_removed() {
    let (config, model) = model(&[]);
    let whole = frf(&model, BAND_HZ);
    let removed = whole.without_delay(model.plant().delay_s());
    says(
        &refusal(removed, &config),
        &["frf_without_delay", "_frf.csv"],
    );
}

#[test]
fn refuses_an_frf_of_another_loop_rate() {
    // At 1 kHz the delay is longer by 0.8 ms, and that of the hold by 0.4 ms: 1.2 ms in all. The aliases, which are larger at 1 kHz,
    // change the mean delay by less than 0.01 ms.
    let (slow, at_1_khz) = model(&["loop.rate_hz=1000", "chirp.stop_hz=400"]);
    let (fast, at_5_khz) = model(&[]);
    let measured_at_1_khz = frf(&at_1_khz, (0.1, 400.0));
    says(
        &refusal(measured_at_1_khz, &fast),
        &["+1.20", "ms", "loop.rate_hz"],
    );
    let measured_at_5_khz = frf(&at_5_khz, BAND_HZ);
    says(&refusal(measured_at_5_khz, &slow), &["loop.rate_hz"]);
}

#[test]
fn refuses_an_frf_in_another_unit() {
    let (config, model) = model(&[]);
    let mut micrometres = frf(&model, BAND_HZ);
    micrometres.response.iter_mut().for_each(|h| *h *= 1e6);
    says(&refusal(micrometres, &config), &["m/A", "unit"]);
}

#[test]
fn refuses_too_few_points() {
    let (config, model) = model(&[]);
    let mut few = Frf::default();
    let whole = frf(&model, BAND_HZ);
    few.frequency_hz.extend(&whole.frequency_hz[..2]);
    few.response.extend(&whole.response[..2]);
    for (column, values) in [
        (&mut few.coherence, &whole.coherence),
        (&mut few.magnitude_sigma, &whole.magnitude_sigma),
        (&mut few.phase_sigma_rad, &whole.phase_sigma_rad),
        (&mut few.resolution_hz, &whole.resolution_hz),
    ] {
        column.extend(&values[..2]);
    }
    says(&refusal(few, &config), &["2 frequencies"]);
    says(&refusal(Frf::default(), &config), &["0 frequencies"]);
}

#[test]
fn command_refuses_other_files_and_options() {
    let bench = Bench::new();
    let (_, model) = model(&[]);
    let text = frf_csv::to_string(&frf(&model, BAND_HZ), METRES_PER_AMPERE);
    bench.write("good.csv", &text);
    bench.write("ratio.csv", text.replace("magnitude_m_per_a", "magnitude"));
    bench.write(
        "newton.csv",
        text.replace("magnitude_m_per_a", "magnitude_x_per_f"),
    );
    bench.write("other.csv", "a,b\n1,2\n");
    let refused = |arguments: &str, words: &[&str]| {
        bench
            .run(&format!("margins --json {arguments}"))
            .is_refused(words);
    };
    refused(
        "--frf ratio.csv",
        &["ratio.csv", "magnitude_m_per_a", "current (A)"],
    );
    refused(
        "--frf newton.csv",
        &["magnitude_x_per_f", "magnitude_m_per_a"],
    );
    refused(
        "--frf other.csv",
        &["other.csv", "no column of the frequency", "a, b"],
    );
    refused("--frf missing.csv", &["missing.csv"]);
    refused("--frf good.csv --continuous", &["--continuous", "--frf"]);
    refused("--out there", &["--frf"]);
    let answer = bench.run("margins --frf missing.mcap");
    assert_eq!(answer.code, 1, "{answer:?}");
}
