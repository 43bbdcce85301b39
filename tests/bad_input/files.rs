//! Files that cannot be read, written or followed.

use std::path::Path;

use crate::bad_input::program::{self, Bench, NO_DAEMON};

#[test]
fn rejects_a_chirp_too_long_to_be_analysed() {
    // 1e5 s at 5 kHz are 5e8 ticks: a recording of 37 GB and as much memory to analyse it.
    let bench = Bench::new();
    bench
        .run("chirp --duration 1e5")
        .is_refused(&["100000 s", "20000000", "shorten"]);
    bench
        .run("chirp --duration 1e30")
        .is_refused(&["--duration 1e30", "0.001 to 100000 s"]);
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn rejects_a_sweep_of_an_unstable_loop() {
    // `bench margins --fast --asymmetry -10%`: the loop is unstable.
    let bench = Bench::new();
    let refused = bench.run("control --fast --reference chirp --asymmetry -10%");
    refused.is_refused(&[
        "the closed loop is unstable in the model",
        "`bench margins`",
    ]);
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn memory_of_a_run_does_not_grow_with_its_duration() {
    // The reference lasts 1e4 s, 5e7 ticks, and noise of 0.1 m trips at its start. The memory limit of 300 MB (`ulimit -v` is in kB)
    // is less than 400 MB, one f64 per tick. A longer run would need more free space on the disk than a test can expect.
    let bench = Bench::new();
    bench.write("long.csv", "0,0\n0.1,1e-6\n");
    let run = format!(
        "ulimit -v 300000; exec {} control --fast --reference long.csv --duration 1e4 --set sim.probe_noise_rms_m=0.1 --json",
        env!("CARGO_BIN_EXE_bench")
    );
    let output = assert_cmd::Command::new("sh")
        .args(["-c", &run])
        .env("MALLOC_ARENA_MAX", "1")
        .envs([NO_DAEMON])
        .current_dir(bench.path(""))
        .output()
        .expect("sh");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(
        String::from_utf8_lossy(&output.stdout).contains("\"tripped\""),
        "{err}"
    );
}

#[test]
fn rejects_invalid_reference_file_with_its_line() {
    let cases: &[(&[u8], &[&str])] = &[
        (b"", &["line 1", "no point"]),
        (b"time_s,reference_m\n", &["no point"]),
        (
            b"time_s,reference_m\n0,0\n0,1e-6\n",
            &["line 3", "not after the one before"],
        ),
        (b"0,0\n1,NaN\n", &["line 2", "not two finite numbers"]),
        (b"0;0\n", &["line 1", "time_s,reference_m"]),
        (b"\xff\xfe\x00", &["UTF-8"]),
    ];
    for (text, words) in cases {
        let bench = Bench::new();
        bench.write("reference.csv", text);
        bench
            .run("control --reference reference.csv")
            .is_refused(&[words, &["reference.csv"][..]].concat());
        assert_eq!(bench.files(), ["reference.csv"]);
    }
    Bench::new()
        .run("control --reference .")
        .is_refused(&["directory"]);
}

#[test]
fn rejects_a_fifo_and_a_device_as_input() {
    let bench = Bench::new();
    let made = std::process::Command::new("mkfifo")
        .arg(bench.path("fifo"))
        .status();
    assert!(made.expect("mkfifo").success());
    for command in [
        "config check --config",
        "margins --controller",
        "control --reference",
        "chirp --shape",
        "identify",
        "identify --input x --output y --rate 1000",
        "export --format csv",
        "model study --vary plant.secondary_stage_mass_kg=+-2% --draws 10 --file",
        "model study --join",
    ] {
        for (file, what) in [("fifo", "a FIFO"), ("/dev/zero", "a device")] {
            let answer = bench.run(&format!("{command} {file}"));
            assert!(
                [1, 2].contains(&answer.code) && answer.err.contains(what),
                "{command} {file}: {answer:?}"
            );
        }
    }
}

#[test]
fn accepts_a_byte_order_mark_in_a_reference() {
    let bench = Bench::new();
    bench.write("bom.csv", "\u{feff}time_s,reference_m\n0,0\n0.1,1e-6\n");
    bench.json("control --fast --duration 0.2 --reference bom.csv");
}

#[test]
fn rejects_a_reference_beyond_the_soft_limit() {
    for options in [
        "--amplitude 0.91mm",
        "--amplitude -1m",
        "--reference sine --amplitude 2mm",
    ] {
        let bench = Bench::new();
        let refused = bench.run(&format!("control --fast {options}"));
        refused.is_refused(&["--amplitude", "the soft limit of 0.0009 m"]);
        assert_eq!(bench.files(), [""; 0], "{options}");
    }
    let bench = Bench::new();
    // 50 um meant, 50 m written.
    bench.write("far.csv", "0,0\n1,50\n");
    bench
        .run("control --fast --reference far.csv")
        .is_refused(&["far.csv line 2", "is 50 m", "0.0009 m", "in metres"]);
    bench.write("far.csv", "time_s,reference_m\n0,0\n0.1,-1e300\n");
    bench
        .run("control --fast --reference far.csv")
        .is_refused(&["far.csv line 3", "-1e300 m"]);
    assert_eq!(bench.files(), ["far.csv"]);
}

#[test]
fn rejects_a_reference_that_would_trip_by_the_closed_loop_model() {
    // A step of 0.85 mm is within the soft limit of 0.9 mm, but the command of the fast controller is beyond the motor's
    // peak current, and its overshoot beyond the soft limit. A ramp of 1 s reaches the same place.
    let bench = Bench::new();
    bench.write("step.csv", "0,0\n0.1,0\n0.1002,850e-6\n");
    for reference in ["step.csv", "step --amplitude 0.85mm"] {
        let refused = bench.run(&format!("control --fast --reference {reference}"));
        refused.is_refused(&["by the model", "9.982 A", "lower the values"]);
    }
    assert_eq!(bench.files(), ["step.csv"]);
    bench.write("step.csv", "0,0\n0.1,0\n1.1,100e-6\n2,100e-6\n");
    bench.json("control --fast --duration 2 --reference step.csv");
}

#[test]
fn rejects_files_that_are_not_recordings() {
    let bench = Bench::new();
    bench.write("text.mcap", "not a recording");
    bench.write("empty.mcap", "");
    for command in ["identify", "replay", "recover", "export --format csv"] {
        for file in ["text.mcap", "empty.mcap", "nosuch.mcap", "."] {
            let answer = bench.run(&format!("{command} {file}"));
            assert!(
                [1, 2].contains(&answer.code) && answer.out.is_empty(),
                "{command} {file}: {answer:?}"
            );
            assert!(
                answer.err.contains(file),
                "{command} {file}: {}",
                answer.err
            );
        }
    }
    assert_eq!(bench.files(), ["empty.mcap", "text.mcap"]);
}

#[test]
fn commands_work_in_an_empty_folder() {
    let bench = Bench::new();
    bench.json("model modes");
    bench.json("margins");
    assert_eq!(
        bench.files(),
        [""; 0],
        "commands without a run write no files"
    );
    let control = bench.json("control --duration 0.2");
    assert_eq!(bench.files(), ["recordings"]);
    let chirp = bench.json("chirp --duration 6 --start 5 --stop 50 --out elsewhere/deep");
    for (answer, key) in [
        (&control, "recording"),
        (&chirp, "recording"),
        (&chirp, "frf_csv"),
        (&chirp, "plot"),
    ] {
        assert!(
            bench.path(answer[key].as_str().expect("a path")).exists(),
            "{key}"
        );
    }
}

#[test]
fn runs_within_one_second_do_not_overwrite_each_other() {
    let bench = Bench::new();
    let names: Vec<String> = (0..4)
        .map(|_| bench.json("control --duration 0.05")["recording"].to_string())
        .collect();
    let mut distinct = names.clone();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), 4, "{names:?}");
}

#[test]
fn unwritable_folder_prevents_motion_and_names_the_remedy() {
    // Nobody can create a folder in /proc, not even root.
    let proc = Path::new("/proc");
    for arguments in ["control --duration 0.1", "chirp --duration 10"] {
        let answer = program::run_in(proc, arguments.split(' '));
        assert_eq!(answer.code, 1, "{}", answer.err);
        assert!(
            !answer.out.contains("overruns"),
            "the run must not have started: {}",
            answer.out
        );
        for word in ["recordings", "--out", "nothing was moved"] {
            assert!(answer.err.contains(word), "{word}: {}", answer.err);
        }
    }
    assert_eq!(
        program::run_in(proc, ["margins", "--fast"]).code,
        0,
        "commands without output files work"
    );
    let bench = Bench::new();
    bench.write("taken", "");
    let answer = bench.run("control --duration 0.1 --out taken");
    assert!(
        answer.code == 1 && answer.err.contains("taken"),
        "{answer:?}"
    );
}
