//! Frequency responses.

use bench_experiment::{Plan, open_with_signals, recorded_frf};
use bench_identify::Frf;
use bench_test_support::program::Bench;
use bench_test_support::truth;
use serde_json::json;

use crate::export::{chirp, recorded_chirp, short_recording};

/// The response of `run.mcap`.
fn response(bench: &Bench) -> Frf {
    let path = bench.path("run.mcap");
    let (recording, signals) = open_with_signals(&path).expect("a recording");
    let plan = Plan::of(&recording).expect("a plan");
    recorded_frf(&recording, signals, &plan).expect("a chirp")
}

#[test]
fn response_is_that_of_bench_identify() {
    let bench = recorded_chirp();
    let exported = bench.json("export run.mcap --frf --format csv --out response.csv");
    assert_eq!(bench.read("response.csv"), chirp().response);
    let rows = chirp().response.lines().count() - 1;
    assert_eq!(exported["rows"], json!(rows));
    let identified = bench.json("identify run.mcap");
    assert_eq!(identified["frequencies"], json!(rows));
    assert_eq!(bench.read("run_frf.csv"), chirp().response);
}

#[test]
fn response_does_not_come_from_a_table_beside_the_recording() {
    let bench = recorded_chirp();
    bench.write("run_frf.csv", "another response");
    let exported = bench.json("export run.mcap --frf --format csv");
    assert_eq!(exported["file"], json!("run_frf-2.csv"));
    assert_eq!(bench.read("run_frf-2.csv"), chirp().response);
    assert_eq!(bench.read("run_frf.csv"), "another response");
}

#[test]
fn response_is_read_back_by_scipy_pandas_pyuff_and_python_control() {
    let bench = recorded_chirp();
    bench.write("table.csv", &chirp().response);
    let frf = response(&bench);
    let parts = |part: fn(&nalgebra::Complex<f64>) -> f64| -> Vec<f64> {
        frf.response.iter().map(part).collect()
    };
    let mut formats = vec![("mat", "run_frf.mat"), ("uff58", "run_frf.uff")];
    if cfg!(feature = "parquet") {
        formats.push(("parquet", "run_frf.parquet"));
    }
    for (format, file) in formats {
        let exported = bench.json(&format!("export run.mcap --frf --format {format}"));
        assert_eq!(exported["rows"], json!(frf.len()));
        let question = json!({
            "what": format!("frf_{format}"),
            "table": bench.path("table.csv"),
            "file": bench.path(file),
            "rate_hz": 5000.0,
            "frequency_hz": frf.frequency_hz,
            "real": parts(|h| h.re),
            "imaginary": parts(|h| h.im),
        });
        let Some(answers) = truth::ask_of("export.py", &[question]) else {
            return;
        };
        let right = json!({ "rows": frf.len(), "differences": [] });
        assert_eq!(answers[0], right, "{format}");
    }
}

#[test]
fn exported_responses_are_read_back_as_they_were() {
    let bench = recorded_chirp();
    let frf = response(&bench);
    // A universal file has 13 digits of each ordinate, and at least 9 of a frequency.
    for (format, file, tolerance, of_frequency) in [
        ("mat", "run_frf.mat", 1e-12, 1e-14),
        ("uff58", "run_frf.uff", 1e-12, 1e-9),
    ] {
        bench.json(&format!("export run.mcap --frf --format {format}"));
        let found = bench_external::frf::read(&bench.path(file), None).expect("a response");
        assert!(found.assumptions.is_empty(), "{:?}", found.assumptions);
        assert_eq!(found.frf.len(), frf.len());
        for k in 0..frf.len() {
            let frequency = found.frf.frequency_hz[k] / frf.frequency_hz[k];
            assert!(
                (frequency - 1.0).abs() < of_frequency,
                "{format}: {frequency}"
            );
            let response = (found.frf.response[k] - frf.response[k]).norm();
            assert!(
                response < tolerance * frf.response[k].norm(),
                "{format}: {response}"
            );
            if format == "mat" {
                let sigma = found.frf.magnitude_sigma[k] / frf.magnitude_sigma[k];
                assert!((sigma - 1.0).abs() < 1e-12, "{sigma}");
                assert_eq!(found.frf.coherence[k], frf.coherence[k]);
                assert_eq!(found.frf.resolution_hz[k], frf.resolution_hz[k]);
            }
        }
    }
}

#[test]
#[cfg(not(feature = "parquet"))]
fn rejects_parquet_without_the_feature() {
    let bench = short_recording();
    for option in ["", "--frf"] {
        let refused = bench.run(&format!("export run.mcap --format parquet {option}"));
        refused.is_refused(&["--features parquet", "--format csv, mat or uff58"]);
    }
    assert_eq!(bench.files(), ["run.mcap"]);
}

#[test]
fn states_what_to_do_about_a_recording_without_a_response() {
    for (run, code, words) in [
        ("control --fast --duration 0.2", 1, "--reference chirp"),
        ("calibrate", 2, "`bench chirp`"),
    ] {
        let bench = Bench::new();
        let made = bench.run(&format!("{run} --out . --json")).json();
        let recording = made["recording"].as_str().expect("a path");
        let before = bench.files();
        let answer = bench.run(&format!("export {recording} --frf --format mat"));
        assert_eq!(answer.code, code, "{run}: {answer:?}");
        assert!(answer.err.contains(words), "{run}: {answer:?}");
        assert_eq!(bench.files(), before, "{run}");
    }
    let bench = short_recording();
    let answer = bench.run("export run.mcap --frf --format mat");
    assert!(answer.err.contains("configuration"), "{answer:?}");
    assert_eq!(bench.files(), ["run.mcap"]);
}
