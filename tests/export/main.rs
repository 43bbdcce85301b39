//! `bench export`, at the process boundary: pandas, pyarrow, scipy, pyuff and python-control read back what was recorded.
//!
//! The truth is the recording as the public package `mcap` reads it (`tests/python/export.py`), and the values of a table.

use std::path::Path;

use bench::recording::{Header, Recorder};
use bench::rt::arming::State;
use bench::rt::record::{LoopMessage, TickRecord};
use bench_hal::Validity;
use bench_test_support::program::Bench;
use bench_test_support::truth;
use serde_json::{Value, json};

/// More than a row group of the Parquet file, and no multiple of the four numbers of a line in UFF 58.
const TICKS: u64 = 66_001;

/// A tick of a run at 5 kHz. Every signal is a number that a text of 13 digits does not hold exactly.
fn tick(n: u64) -> TickRecord {
    let phase = n as f64 * 0.01;
    TickRecord {
        tick: n,
        scheduled_ns: n * 200_000,
        woke_ns: n * 200_000 + 1000 + n % 7,
        done_ns: n * 200_000 + 9000,
        reference_m: 1e-4 * phase.sin(),
        position_m: 0.97e-4 * (phase - 0.3).sin(),
        requested_a: 0.1 * phase.cos(),
        command_a: -0.099 * phase.cos(),
        actual_a: (!n.is_multiple_of(3)).then(|| 0.098 * phase.cos()),
        raw_position_m: None,
        raw_command_a: None,
        probe_sequence: u64::MAX - n,
        probe_age_ns: n % 11,
        validity: Validity::Valid,
        state: State::Running,
        flags: n as u32 % 32,
        missed_ticks: 0,
    }
}

/// As [`tick`], with doubles that only an exact format keeps.
fn special_tick(n: u64) -> TickRecord {
    let special = [-0.0, f64::NAN, f64::INFINITY, 5e-324, 0.1 + 0.2, f64::MAX];
    let value = special[n as usize % special.len()];
    TickRecord {
        position_m: value,
        command_a: -value,
        raw_position_m: n.is_multiple_of(2).then_some(value),
        ..tick(n)
    }
}

fn record(path: &Path, ticks: impl Iterator<Item = TickRecord>) {
    let header = Header {
        config_toml: String::new(),
        period_s: 2e-4,
        started_ns: 1_790_000_000_000_000_000,
        metadata: Default::default(),
    };
    let mut recorder = Recorder::create(path, &header).expect("a fresh file");
    for tick in ticks {
        let recorded = recorder.record(&LoopMessage::Tick(tick));
        recorded.expect("a good disk");
    }
    recorder.finish(&[]).expect("a good disk");
}

/// Exports `run.mcap` and asks Python for the differences between recording and file.
fn differences(bench: &Bench, format: &str, file: &str) -> Option<Value> {
    let exported = bench.json(&format!("export run.mcap --format {format}"));
    assert_eq!(exported["file"], json!(file));
    let question = json!({
        "what": format,
        "recording": bench.path("run.mcap"),
        "file": bench.path(file),
    });
    let answers = truth::ask_of("export.py", &[question])?;
    assert_eq!(answers[0]["rows"], exported["rows"], "{format}");
    Some(answers[0]["differences"].clone())
}

#[test]
fn exact_formats_are_read_back_bit_for_bit() {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), (0..TICKS).map(special_tick));
    let mut formats = vec![("csv", "run.csv"), ("mat", "run.mat")];
    if cfg!(feature = "parquet") {
        formats.push(("parquet", "run.parquet"));
    }
    for (format, file) in formats {
        if let Some(differences) = differences(&bench, format, file) {
            assert_eq!(differences, json!([]), "{format}");
        }
    }
}

#[test]
fn uff58_is_read_back_to_13_digits() {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), (0..TICKS).map(tick));
    if let Some(differences) = differences(&bench, "uff58", "run.uff") {
        assert_eq!(differences, json!([]));
    }
}

#[test]
fn uff58_rejects_a_recording_with_a_gap() {
    let bench = Bench::new();
    let ticks = (0..1000).filter(|n| *n != 501).map(tick);
    record(&bench.path("run.mcap"), ticks);
    let refused = bench.run("export run.mcap --format uff58");
    refused.is_refused(&["after 0.1 s", "--format csv"]);
    assert_eq!(bench.files(), ["run.mcap"]);
    // The other formats state the time of each tick.
    assert_eq!(bench.json("export run.mcap --format mat")["rows"], 999);
}

#[test]
#[cfg(not(feature = "parquet"))]
fn rejects_parquet_without_the_feature() {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), (0..10).map(tick));
    bench
        .run("export run.mcap --format parquet")
        .is_refused(&["--features parquet", "--format csv"]);
    assert_eq!(bench.files(), ["run.mcap"]);
}

#[test]
fn keeps_the_recording() {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), (0..10).map(tick));
    let before = std::fs::read(bench.path("run.mcap")).expect("it was written");
    bench
        .run("export run.mcap --format csv --out ./run.mcap")
        .is_refused(&["--out", "recording itself"]);
    let after = std::fs::read(bench.path("run.mcap")).expect("it is kept");
    assert_eq!(before, after);
}

/// A response of 301 frequencies with its standard deviations.
fn response_table() -> String {
    let header = bench::identify::frf_csv::HEADER;
    let rows = (0..301).map(|k| {
        let frequency = 0.1 * (f64::from(k) / 30.0).exp();
        let magnitude = 3.4e-4 / (1.0 + frequency);
        let phase_deg = -170.0 + f64::from(k);
        let sigma = 1e-8 * f64::from(k + 1);
        format!("{frequency},{magnitude:e},{phase_deg},0.99,{sigma:e},0.1,0.05\n")
    });
    format!("{header}\n{}", rows.collect::<String>())
}

#[test]
fn response_is_read_back_by_scipy_pyuff_and_python_control() {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), (0..10).map(tick));
    bench.write("run_frf.csv", response_table());
    for (format, file) in [("mat", "run_frf.mat"), ("uff58", "run_frf.uff")] {
        let exported = bench.json(&format!("export run.mcap --frf --format {format}"));
        assert_eq!(exported["rows"], json!(301));
        let question = json!({
            "what": format!("frf_{format}"),
            "table": bench.path("run_frf.csv"),
            "file": bench.path(file),
        });
        let Some(answers) = truth::ask_of("export.py", &[question]) else {
            return;
        };
        assert_eq!(answers[0]["differences"], json!([]), "{format}");
        assert_eq!(answers[0]["rows"], json!(301), "{format}");
    }
}

#[test]
fn states_how_to_get_a_response() {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), (0..10).map(tick));
    let answer = bench.run("export run.mcap --frf --format mat");
    assert_eq!(answer.code, 1);
    assert!(
        answer.err.contains("bench identify run.mcap"),
        "{}",
        answer.err
    );
    bench
        .run("export run.mcap --frf --format csv")
        .is_refused(&["mat and uff58", "run_frf.csv"]);
}
