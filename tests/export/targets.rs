//! The file that is written.

use std::path::Path;

use bench_test_support::program::run_program;
use serde_json::json;

use crate::export::{recorded_chirp, short_recording};

#[test]
fn rejects_a_file_that_exists() {
    let bench = short_recording();
    bench.write("notes.csv", "notes");
    let before = std::fs::read(bench.path("run.mcap")).expect("it was written");
    for file in ["notes.csv", "./run.mcap"] {
        let refused = bench.run(&format!("export run.mcap --format csv --out {file}"));
        refused.is_refused(&["--out", file, "exists", "another file"]);
    }
    assert_eq!(bench.read("notes.csv"), "notes");
    let after = std::fs::read(bench.path("run.mcap")).expect("it is kept");
    assert_eq!(before, after);
    assert_eq!(bench.files(), ["notes.csv", "run.mcap"]);
}

#[test]
fn numbers_a_file_beside_the_recording_if_its_name_is_taken() {
    let bench = short_recording();
    for file in ["run.csv", "run-2.csv", "run-3.csv"] {
        let exported = bench.json("export run.mcap --format csv");
        assert_eq!(exported["file"], json!(file));
    }
    assert_eq!(bench.read("run.csv"), bench.read("run-3.csv"));
}

#[test]
fn rejects_a_fifo_a_device_a_folder_and_a_dangling_link() {
    let bench = short_recording();
    nix::unistd::mkfifo(&bench.path("fifo"), nix::sys::stat::Mode::S_IRWXU).expect("a FIFO");
    std::os::unix::fs::symlink("nothing", bench.path("link")).expect("a link");
    for (file, what) in [
        ("fifo", "a FIFO"),
        ("/dev/null", "a device"),
        (".", "a directory"),
        ("link", "exists"),
    ] {
        for option in ["", "--frf"] {
            let refused = bench.run(&format!(
                "export run.mcap --format mat --out {file} {option}"
            ));
            refused.is_refused(&["--out", file, what, "choose"]);
        }
    }
    assert_eq!(bench.files(), ["fifo", "link", "run.mcap"]);
}

#[test]
fn states_what_to_do_if_the_file_cannot_be_written() {
    let bench = recorded_chirp();
    for option in ["", "--frf"] {
        let answer = bench.run(&format!(
            "export run.mcap --format csv --out no/such.csv {option}"
        ));
        assert_eq!(answer.code, 1);
        let remedy = "create the folder no, or choose another file with --out";
        assert!(answer.err.contains(remedy), "{answer:?}");
        assert!(!answer.err.contains("space"), "{answer:?}");
    }
    assert_eq!(bench.files(), ["run.mcap"]);
}

#[test]
fn states_that_the_file_is_larger_than_the_system_allows() {
    let bench = recorded_chirp();
    let mut formats = vec!["csv", "mat", "uff58"];
    if cfg!(feature = "parquet") {
        formats.push("parquet");
    }
    for format in formats {
        // 64 blocks of 512 bytes (1024 in some shells): fewer than the 80,500 ticks of the chirp have in any format.
        let script = format!("ulimit -f 64; exec \"$0\" export run.mcap --format {format}");
        let program = env!("CARGO_BIN_EXE_bench");
        let answer = run_program(Path::new("sh"), &bench.path(""), ["-c", &script, program]);
        assert_eq!(answer.code, 1, "{format}: {answer:?}");
        for words in ["run.", "File too large", "ulimit -f"] {
            assert!(answer.err.contains(words), "{format}: {answer:?}");
        }
        assert_eq!(bench.files(), ["run.mcap"], "{format}");
    }
}

#[test]
fn states_that_the_recording_does_not_exist() {
    let bench = short_recording();
    for option in ["", "--frf"] {
        let answer = bench.run(&format!("export no/such.mcap --format csv {option}"));
        assert_eq!(answer.code, 1, "{answer:?}");
        assert!(answer.err.contains("no such file"), "{answer:?}");
    }
}

#[test]
fn partial_file_of_a_killed_export_is_left_and_does_not_prevent_another() {
    let bench = short_recording();
    bench.write("run.csv.partial", "time_s,refer");
    bench.json("export run.mcap --format csv");
    assert_eq!(bench.files(), ["run.csv", "run.csv.partial", "run.mcap"]);
    assert_eq!(bench.read("run.csv").lines().count(), 11);
    assert_eq!(bench.read("run.csv.partial"), "time_s,refer");
}
