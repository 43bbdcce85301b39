//! Time signals.

use bench_rt::record::TickRecord;
use bench_test_support::program::Bench;
use bench_test_support::truth;
use serde_json::{Value, json};

use crate::export::{record, tick};

/// More than a row group of the Parquet file and a block of a column, and no multiple of the four numbers of a line in UFF 58.
const TICKS: u64 = 66_001;

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
    record(&bench.path("run.mcap"), 2e-4, (0..TICKS).map(special_tick));
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
    record(&bench.path("run.mcap"), 2e-4, (0..TICKS).map(tick));
    if let Some(differences) = differences(&bench, "uff58", "run.uff") {
        assert_eq!(differences, json!([]));
    }
}

/// The positions of a loop with this rate; UFF 58 omits signals without a measurement.
fn position(n: u64, rate_hz: f64) -> TickRecord {
    let none = f64::NAN;
    TickRecord {
        scheduled_ns: (n as f64 / rate_hz * 1e9).round() as u64,
        reference_m: none,
        requested_a: none,
        command_a: none,
        actual_a: None,
        ..tick(n)
    }
}

#[test]
fn uff58_states_the_times_of_600_000_ticks() {
    // Period 1/rate as a text of 13 columns: exact at 5 kHz and 4096 Hz (2.44140625E-4). At 3 kHz it is 3.33333333E-4 s, so tick
    // 599,999 is 599,999 * 1/3 * 1e-12 s = 0.2 us early.
    for (rate_hz, allowed_s) in [(5000.0, 0.0), (4096.0, 0.0), (3000.0, 0.3e-6)] {
        let bench = Bench::new();
        let ticks = (0..600_000).map(|n| position(n, rate_hz));
        record(&bench.path("run.mcap"), 1.0 / rate_hz, ticks);
        let exported = bench.json("export run.mcap --format uff58");
        assert_eq!(exported["rows"], json!(600_000));
        let question = json!({
            "what": "uff58_times",
            "file": bench.path("run.uff"),
            "rate_hz": rate_hz,
            "allowed_s": allowed_s,
        });
        if let Some(answers) = truth::ask_of("export.py", &[question]) {
            let right = json!({ "rows": 600_000, "differences": [] });
            assert_eq!(answers[0], right, "{rate_hz} Hz");
        }
    }
}

#[test]
fn uff58_rejects_a_recording_with_a_gap() {
    let bench = Bench::new();
    let ticks = (0..1000).filter(|n| *n != 501).map(tick);
    record(&bench.path("run.mcap"), 2e-4, ticks);
    let refused = bench.run("export run.mcap --format uff58");
    refused.is_refused(&["between tick 500 and tick 502", "--format csv"]);
    assert_eq!(bench.files(), ["run.mcap"]);
}

#[test]
fn every_format_has_the_signals_of_a_simulated_chirp() {
    let bench = crate::export::recorded_chirp();
    for (format, file) in [("csv", "run.csv"), ("mat", "run.mat"), ("uff58", "run.uff")] {
        if let Some(differences) = differences(&bench, format, file) {
            assert_eq!(differences, json!([]), "{format}");
        }
    }
}
