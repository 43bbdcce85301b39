//! `bench margins --frf` at the process boundary.

use serde_json::Value;

use crate::measured::program::{Bench, number};

/// A chirp of 40 s on the simulated stage, its FRF and its recording.
fn chirp(bench: &Bench) -> (String, String) {
    let answer = bench.json("chirp --duration 40s --out runs --pace virtual");
    let text = |key: &str| answer[key].as_str().expect("a path").to_string();
    (text("frf_csv"), text("recording"))
}

/// `value` with its limits.
fn interval(measured: &Value) -> (f64, f64, f64) {
    let [value, low, high] = ["value", "low", "high"].map(|key| number(&measured[key]));
    assert!(low < value && value < high, "{measured}");
    (value, low, high)
}

#[test]
fn frf_and_recording_give_the_same_margins_near_those_of_the_model() {
    let bench = Bench::new();
    let (frf, recording) = chirp(&bench);
    let by_file = bench.json(&format!("margins --fast --frf {frf}"));
    let by_recording = bench.json(&format!("margins --fast --frf {recording}"));
    let margins = |answer: &Value| answer["measured"]["margins"].clone();
    for name in ["crossover_rad_s", "phase_margin_deg", "modulus_margin"] {
        let (a, b) = (
            interval(&margins(&by_file)[name]),
            interval(&margins(&by_recording)[name]),
        );
        // The file has all digits.
        assert!((a.0 / b.0 - 1.0).abs() < 1e-9, "{name}: {a:?} {b:?}");
        // The names of the model's margins keep their meaning. The unmodelled modes and the noise change them by little.
        let model = number(&by_file[name]);
        assert!(
            (a.0 / model - 1.0).abs() < 0.02,
            "{name}: {a:?} for {model}"
        );
    }
    let measured = &by_file["measured"];
    assert_eq!(measured["stability"], "stable");
    assert_eq!(measured["unstable_poles"], 0);
    let below = &measured["outside_band"]["below"];
    let above = &measured["outside_band"]["above"];
    assert!(number(&below["min_loop_gain"]) > 1.0 && number(&above["max_loop_gain"]) < 1.0);
}

#[test]
fn text_has_intervals_bounds_and_files() {
    let bench = Bench::new();
    let (frf, _) = chirp(&bench);
    let answer = bench.run(&format!("margins --fast --frf {frf} --out loop"));
    assert_eq!(answer.code, 0, "{answer:?}");
    for words in [
        "with the measured plant",
        "stable by Nyquist's criterion",
        "not measured, below 0.1",
        "not measured, above",
        "_nyquist.svg",
        "_disturbance.csv",
    ] {
        assert!(
            answer.out.contains(words),
            "`{words}` is not in {}",
            answer.out
        );
    }
    assert!(answer.out.matches('±').count() >= 9, "{}", answer.out);
    let files = std::fs::read_dir(bench.path("loop")).expect("the folder");
    assert_eq!(files.count(), 8);
}

#[test]
fn stage_of_the_other_sign_is_unstable_by_its_frf_although_the_model_is_stable() {
    let bench = Bench::new();
    let answer = bench.json("chirp --asymmetry -10% --duration 40s --out runs --pace virtual");
    let frf = answer["frf_csv"].as_str().expect("a path");
    let answer = bench.run(&format!("margins --json --fast --frf {frf}"));
    assert_eq!(answer.code, 1, "{answer:?}");
    let json = answer.json();
    assert_eq!(json["stable"], true);
    assert_eq!(json["measured"]["stability"], "unstable");
    // By the model with the right sign two poles are unstable.
    let model = bench.run("margins --json --fast --asymmetry -10%").json();
    let poles = model["poles"].as_array().expect("poles");
    let unstable = poles.iter().filter(|pole| pole["stable"] == false);
    let count = number(&json["measured"]["unstable_poles"]);
    assert_eq!(count, 2.0 * unstable.count() as f64);
    assert!(json["measured"]["margins"].is_null());
}

#[test]
fn recording_at_another_rate_is_refused_with_the_setting() {
    let bench = Bench::new();
    let answer =
        bench.json("chirp --set loop.rate_hz=2000 --duration 20s --out runs --pace virtual");
    let recording = answer["recording"].as_str().expect("a path");
    bench
        .run(&format!("margins --fast --frf {recording}"))
        .is_refused(&["loop.rate_hz = 2000", "5000", "--set loop.rate_hz=2000"]);
    let same = format!("margins --slow --set loop.rate_hz=2000 --frf {recording}");
    assert_eq!(bench.json(&same)["measured"]["stability"], "stable");
}
