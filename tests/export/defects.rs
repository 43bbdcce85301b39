//! Recordings of which something is missing: the file is written, a message says what it lacks, and the exit code is 3.

use bench_rt::record::TickRecord;
use bench_test_support::program::{Answer, Bench};
use serde_json::json;

use crate::export::{chirp, record, tick};

/// Exports `run.mcap` and checks the exit code 3 and the words of the message.
fn impaired(bench: &Bench, options: &str, words: &[&str]) -> Answer {
    let answer = bench.run(&format!("export run.mcap {options} --json"));
    assert_eq!(answer.code, 3, "{options}: {answer:?}");
    for word in words {
        assert!(answer.err.contains(word), "{options}: {answer:?}");
    }
    answer
}

#[test]
fn truncated_recording_is_exported_with_a_message_and_exit_code_3() {
    let bench = Bench::new();
    let recording = &chirp().recording;
    bench.write("run.mcap", &recording[..recording.len() * 7 / 10]);
    for format in ["csv", "mat", "uff58"] {
        let options = format!("--format {format}");
        let report = impaired(&bench, &options, &["run.mcap", "cut off", "bench recover"]).json();
        assert_eq!(report["truncated"], json!(true));
        assert_eq!(report["rows"], report["ticks"]);
    }
    let rows = bench.read("run.csv").lines().count() - 1;
    // The chirp has 80,500 ticks; 70 % of its bytes are 70 % of them, less a chunk of 2,500.
    assert!((50_000..60_000).contains(&rows), "{rows}");
    let report = impaired(&bench, "--frf --format mat", &["cut off", "bench recover"]).json();
    assert_eq!(report["outcome"], json!("cut_off"));
}

#[test]
fn recovered_recording_is_exported_with_a_message_and_exit_code_3() {
    let bench = Bench::new();
    let recording = &chirp().recording;
    bench.write("cut.mcap", &recording[..recording.len() * 7 / 10]);
    assert_eq!(bench.run("recover cut.mcap --to run.mcap").code, 3);
    impaired(&bench, "--format csv", &["cut off"]);
}

#[test]
fn lost_ticks_are_exported_with_a_message_and_exit_code_3() {
    let bench = Bench::new();
    let ticks = (0..1000).filter(|n| *n != 501).map(tick);
    record(&bench.path("run.mcap"), 2e-4, ticks);
    for format in ["csv", "mat"] {
        let words = ["0 overruns and 1 lost records", "column `tick`"];
        let report = impaired(&bench, &format!("--format {format}"), &words).json();
        assert_eq!(report["rows"], json!(999));
        assert_eq!(report["lost_records"], json!(1));
    }
}

#[test]
fn missed_ticks_are_exported_with_a_message_and_exit_code_3() {
    let bench = Bench::new();
    let missed = |n: u64| TickRecord {
        missed_ticks: if n == 502 { 2 } else { 0 },
        ..tick(n)
    };
    let ticks = (0..1000).filter(|n| ![500, 501].contains(n)).map(missed);
    record(&bench.path("run.mcap"), 2e-4, ticks);
    let words = ["2 overruns and 0 lost records"];
    let report = impaired(&bench, "--format csv", &words).json();
    assert_eq!(report["overruns"], json!(2));
    let table = bench.read("run.csv");
    let header: Vec<&str> = table
        .lines()
        .next()
        .unwrap_or_default()
        .split(',')
        .collect();
    let column = header.iter().position(|name| *name == "missed_ticks");
    let column = column.expect("a column of missed ticks");
    let cells = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(column));
    let rows: Vec<usize> = cells
        .enumerate()
        .filter(|(_, cell)| *cell != Some("0"))
        .map(|(row, _)| row)
        .collect();
    // Tick 502 is row 500, because two ticks before it are missing.
    assert_eq!(rows, [500]);
}
