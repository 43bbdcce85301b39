//! The report that `bench control` writes after each run.

use bench_experiment::{ControlRun, Plan, control_run};
use bench_recording::Recording;
use bench_test_support::program::Bench;
use serde_json::{Value, json};

use crate::report::truth;

const PLOTS: [&str; 6] = [
    "signals",
    "step",
    "spectrum",
    "loop",
    "loop_nyquist",
    "sensitivity",
];

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is not a number"))
}

fn page(bench: &Bench, run: &Value) -> String {
    bench.read(run["report"].as_str().expect("a path"))
}

/// The report of a run, read from its recording.
fn report(bench: &Bench, run: &Value) -> ControlRun {
    let path = bench.path(run["recording"].as_str().expect("a path"));
    let recording = Recording::open(&path).expect("readable");
    let plan = Plan::of(&recording).expect("a plan");
    control_run(&recording, &plan).expect("a report")
}

#[test]
fn step_leaves_plots_and_a_page_beside_its_recording() {
    let bench = Bench::new();
    let run = bench.json("control --fast --duration 3s");
    let stem = run["recording"].as_str().unwrap().trim_end_matches(".mcap");
    let mut files = Vec::new();
    for kind in PLOTS {
        let path = run["plots"][kind].as_str().expect(kind);
        assert_eq!(path, format!("{stem}_{kind}.svg"));
        files.push(json!(bench.path(path)));
    }
    assert_eq!(run["report"], format!("{stem}_report.html"));
    files.push(json!(bench.path(run["report"].as_str().unwrap())));
    for (file, answer) in files
        .iter()
        .zip(truth::ask_of("pages.py", &files).unwrap_or_default())
    {
        assert_eq!(answer["errors"], json!([]), "{file}");
    }
    let page = page(&bench, &run);
    let settling_ms = number(&run["measured"]["settling_time_s"]) * 1e3;
    let modulus = number(&run["predicted"]["modulus_margin"]);
    for part in [
        "2 % of the step".to_string(),
        format!("<td class=\"n\">{settling_ms:.1} ms</td>"),
        format!("modulus margin {modulus:.3} at "),
        "phase margin 34.5°".into(),
        "Spectrum of the error".into(),
        "Heat of the motor".into(),
    ] {
        assert!(page.contains(&part), "{part}");
    }
    assert!(!page.contains("tripped"));
    let whole = &run["whole_run"];
    // The error begins with the height of the step.
    let peak_um = number(&whole["peak_error_m"]) * 1e6;
    assert!((49.5..51.5).contains(&peak_um), "{peak_um}");
    assert!(number(&whole["peak_current_a"]) > number(&whole["rms_current_a"]));
}

#[test]
fn same_page_for_a_recording() {
    let bench = Bench::new();
    let run = bench.json("control --slow --reference hold --duration 2s");
    let recording = run["recording"].as_str().unwrap();
    let again = bench.json(&format!("report {recording}"));
    assert_eq!(
        bench.read(again["page"].as_str().unwrap()),
        page(&bench, &run)
    );
}

#[test]
fn trip_is_in_page_and_signals_with_reason_and_time() {
    let bench = Bench::new();
    let answer = bench.run("control --fast --asymmetry -10% --json");
    assert_eq!(answer.code, 1, "{}", answer.err);
    let run = answer.json();
    assert_eq!(run["measured"], Value::Null);
    let page = page(&bench, &run);
    let time_s = number(&run["trip"]["tick"]) / 5000.0;
    for part in ["tripped", &format!("After {time_s:.4} s"), "unstable"] {
        assert!(page.contains(part), "{part}");
    }
    let signals = bench.read(run["plots"]["signals"].as_str().unwrap());
    assert_eq!(signals.matches("data-name=\"trip\"").count(), 1);
    // A growing oscillation has no steady state, and so no spectrum.
    assert_eq!(run["plots"]["spectrum"], Value::Null);
    // The error at the step is its height.
    let peak_um = number(&run["whole_run"]["peak_error_m"]) * 1e6;
    assert!((49.5..51.5).contains(&peak_um), "{peak_um}");
}

#[test]
fn writes_only_the_recording_without_report() {
    let bench = Bench::new();
    let run = bench.json("control --slow --duration 2s --no-report");
    let files = std::fs::read_dir(bench.path("recordings")).unwrap();
    assert_eq!(files.count(), 1);
    assert!(run.get("report").is_none() && run["measured"]["settling_time_s"].is_f64());
    assert!(run["whole_run"]["peak_current_a"].is_f64());
}

#[test]
fn sine_has_gain_and_phase_of_the_complementary_sensitivity() {
    // Without unmodelled modes the model of the margins is that of the stage. The disturbance of the position has an RMS of 0.05 um,
    // at most 1e-14 m^2/Hz at any frequency here; over 9.5 s the standard deviation of either quadrature of the amplitude is
    // sqrt(1e-14/9.5) = 0.032 um at most, 1.6e-3 of 20 um. The measured sigma must be below it, and is the tolerance (five sigma,
    // with a relative error of a sigma of nine blocks of 25 %).
    for (controller, frequency_hz) in [("fast", 20.0), ("fast", 3.0), ("slow", 5.0)] {
        let bench = Bench::new();
        let run = bench.json(&format!(
            "control --{controller} --reference sine --amplitude 20um --frequency {frequency_hz}Hz --set sim.unmodelled=[]"
        ));
        let (measured, predicted) = (&run["measured"]["sine"], &run["predicted"]["sine"]);
        let gain = number(&measured["gain"]) / number(&predicted["gain"]) - 1.0;
        let gain_sigma = number(&measured["gain_sigma"]) / number(&measured["gain"]);
        let phase_deg = number(&measured["phase_deg"]) - number(&predicted["phase_deg"]);
        let phase_sigma_deg = number(&measured["phase_sigma_deg"]);
        let limit = 1.6e-3 / number(&predicted["gain"]);
        assert!(
            gain_sigma < limit && phase_sigma_deg.to_radians() < limit,
            "{measured}"
        );
        assert!(
            gain.abs() < 5.0 * gain_sigma,
            "{controller}: {measured} {predicted}"
        );
        assert!(
            phase_deg.abs() < 5.0 * phase_sigma_deg,
            "{controller}: {measured} {predicted}"
        );
        // Beside the sine is what a hold leaves: 0.050 um and 0.066 um in the thesis, 5 % of scatter in 9.5 s.
        let residual_um = number(&measured["residual_rms_m"]) * 1e6;
        assert!((0.03..0.09).contains(&residual_um), "{residual_um}");
    }
}

#[test]
fn error_spectrum_agrees_with_its_prediction() {
    for (controller, reference) in [
        ("fast", "hold"),
        ("slow", "hold"),
        ("fast", "sine --frequency 5Hz --amplitude 5um"),
    ] {
        let bench = Bench::new();
        let run = bench.json(&format!(
            "control --{controller} --reference {reference} --duration 30s"
        ));
        let spectrum = report(&bench, &run).spectrum.expect("a spectrum");
        let predicted = &spectrum.predicted.as_ref().expect("simulated").total;
        let rows = spectrum
            .measured
            .iter()
            .zip(&spectrum.interval)
            .zip(predicted);
        let inside = rows.filter(|((measured, interval), predicted)| {
            (*measured * interval[0]..=*measured * interval[1]).contains(*predicted)
        });
        let share = inside.count() as f64 / predicted.len() as f64;
        // 95 % of some 280 bands; neighbouring bands of one bin are correlated, so that they are worth about 150 independent ones:
        // the standard deviation is sqrt(0.95 0.05/150) = 1.8 %. The prediction may be off by a tenth in narrow lines.
        assert!(
            (0.87..=1.0).contains(&share),
            "{controller} {reference}: {share}"
        );
        let total = |values: &[f64]| -> f64 {
            let parts = values.iter().zip(&spectrum.width_hz);
            parts.map(|(value, width_hz)| value * width_hz).sum()
        };
        // The variance is dominated by lines 1.6 Hz and 2.8 Hz wide, in 29.5 s: 2 pi zeta f T = 148 and 260 averages, 8 %.
        let ratio = total(&spectrum.measured) / total(predicted);
        assert!(
            (0.7..1.35).contains(&ratio),
            "{controller} {reference}: {ratio}"
        );
    }
}

#[test]
fn every_reference_runs_and_leaves_a_page() {
    for (reference, name) in [
        (
            "square --amplitude 10um --frequency 2Hz",
            "square wave of +-10 um at 2 Hz",
        ),
        (
            "triangle --amplitude 10um",
            "triangle wave of +-10 um at 1 Hz, 40 um/s",
        ),
        (
            "s-curve --amplitude 100um --speed 2mm/s",
            "s-curve to 100 um",
        ),
        (
            "random --amplitude 20um --frequency 20Hz",
            "random up to 20 Hz, within +-20 um",
        ),
    ] {
        let bench = Bench::new();
        let run = bench.json(&format!(
            "control --fast --reference {reference} --duration 2s"
        ));
        assert!(page(&bench, &run).contains(name), "{reference}");
        assert_eq!(run["outcome"], "completed");
        let replay = bench.json(&format!("replay {}", run["recording"].as_str().unwrap()));
        assert_eq!(replay["identical"], true, "{reference}");
    }
}

#[test]
fn s_curve_beyond_the_motor_is_refused_before_motion() {
    let bench = Bench::new();
    let arguments = "control --fast --reference s-curve --amplitude 0.8mm --speed 10m/s --acceleration 1000 --jerk 1e6";
    let answer = bench.run(arguments);
    assert_eq!(answer.code, 2, "{}", answer.err);
    assert!(answer.err.contains("peak current"), "{}", answer.err);
    assert!(!bench.path("recordings").exists(), "nothing is recorded");
}

#[test]
fn plant_of_close_resonances_has_a_report() {
    // Frequencies of the plot around resonances can be equal after their conversion to hertz.
    let bench = Bench::new();
    let run = bench.json("control --config xy --duration 1s");
    assert!(page(&bench, &run).contains("Nyquist plot of the loop"));
}
