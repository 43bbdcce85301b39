//! The same record as other programs write it gives the same modes: `bench identify` reads each form, or names it.
use serde_json::Value;

use crate::external::program::{Bench, number};
use crate::external::signals::{STAGE, csv, multisine};

const IDENTIFY: &str = "identify data.csv --input force_n --output position_m --period 1000";

/// The record with its names and a time in seconds.
fn plain() -> String {
    csv(&multisine(&(5..=200).collect::<Vec<_>>(), 5, 0.0, 1e-8, 21))
}

/// The lines of samples, each changed.
fn samples(change: impl Fn(&str) -> String) -> String {
    let text = plain();
    let lines = text.lines().skip(1);
    lines.map(|line| change(line) + "\n").collect()
}

/// The time of a line in another unit.
fn with_time(line: &str, write: impl Fn(f64) -> String) -> String {
    let (time, rest) = line.split_once(',').expect("columns");
    let time_s: f64 = time.parse().expect("a time");
    format!("{},{rest}", write(time_s))
}

fn forms() -> Vec<(&'static str, &'static str, String)> {
    let decimal_comma = |line: &str| line.replace(',', ";").replace('.', ",");
    let spaces = |line: &str| line.replace(',', "   ");
    let stamp = |line: &str| {
        with_time(line, |s| {
            (1_700_000_000_000_000_000 + (s * 1e9).round() as i64).to_string()
        })
    };
    let names = "time_s,force_n,position_m\n";
    vec![
        (
            "semicolons and decimal commas",
            "--time time_s",
            decimal_comma(names) + &samples(decimal_comma),
        ),
        (
            "spaces, names in a comment",
            "--time time_s",
            "# run 7\n# time_s force_n position_m\n".to_string() + &samples(spaces),
        ),
        (
            "preamble and a line of units",
            "--time t",
            format!(
                "Recorder 2\n\n\"t\",\"force_n\",\"position_m\"\nms,N,m\n{}",
                samples(|line| with_time(line, |s| (s * 1e3).to_string()))
            ),
        ),
        (
            "nanoseconds since 1970",
            "--time stamp_ns",
            format!("stamp_ns,force_n,position_m\n{}", samples(stamp)),
        ),
    ]
}

fn frequencies_hz(answer: &Value) -> Vec<f64> {
    let modes = answer["modes"].as_array().expect("modes");
    modes
        .iter()
        .map(|mode| number(&mode["frequency_hz"]))
        .collect()
}

#[test]
fn every_form_of_a_record_gives_its_modes() {
    for (form, time, text) in forms() {
        let bench = Bench::new();
        bench.write("data.csv", text);
        let answer = bench.json(&format!("{IDENTIFY} {time} --out results"));
        assert_eq!(number(&answer["rate_hz"]).round(), 1000.0, "{form}");
        let found_hz = frequencies_hz(&answer);
        assert_eq!(found_hz.len(), STAGE.len(), "{form}: {found_hz:?}");
        for (found_hz, (hz, ..)) in found_hz.iter().zip(STAGE) {
            // Noise of 1e-8 m beside lines of 1e-6 m and more, over five periods: below 1e-4 of the frequency.
            assert!((found_hz / hz - 1.0).abs() < 1e-4, "{form}: {found_hz} Hz");
        }
    }
}

#[test]
fn names_the_format_of_another_program() {
    for (name, start, word) in [
        (
            "a.mat",
            b"MATLAB 7.3 MAT-file, Platform: GLNXA64".as_slice(),
            "an HDF5 file",
        ),
        ("a.parquet", b"PAR1\x15\x04".as_slice(), "Parquet"),
        ("a.xlsx", b"PK\x03\x04".as_slice(), "zip"),
        ("a.h5", b"\x89HDF\r\n\x1a\n".as_slice(), "HDF5"),
    ] {
        let bench = Bench::new();
        bench.write(name, [start, &[0; 600]].concat());
        let answer = bench.run(&format!("identify {name} --input u --output y --rate 1kHz"));
        assert_eq!(answer.code, 1, "{name}: {answer:?}");
        assert!(answer.err.contains(word), "{name}: {}", answer.err);
        let is_text = |c: char| !c.is_control() || c == '\n';
        assert!(answer.err.chars().all(is_text), "{name}: {:?}", answer.err);
    }
}
