//! Options, help, errors and files of the command line.
use std::fs::File;
use std::process::Stdio;

use bench_test_support::program::{Bench, number};
use serde_json::Value;

use crate::process::common::bench;

#[test]
fn quantities_accept_units_and_default_to_si() {
    let plan = |options: &str| Bench::new().json(&format!("chirp --plan {options}"));
    let expected = plan("--amplitude 0.05 --start 5 --stop 500 --duration 20");
    for options in [
        "--amplitude 0.05A --start 5Hz --stop 500Hz --duration 20s",
        "--amplitude 50mA --start 5Hz --stop 0.5kHz --duration 20000ms",
    ] {
        assert_eq!(plan(options)["excitation"], expected["excitation"]);
        let (found, bare) = (&plan(options)["expected"], &expected["expected"]);
        let travel = |plan: &Value| number(&plan["travel_m"]);
        assert!(
            (travel(found) / travel(bare) - 1.0).abs() < 1e-9,
            "{options}"
        );
    }
    let show = |options: &str| Bench::new().json(&format!("config show {options}"));
    let micro = show("--operating-point 50\u{b5}m")["plant"]["operating_point_m"].clone();
    assert_eq!(number(&micro), 50.0 * 1e-6);
}

#[test]
fn errors_name_option_and_unit_as_typed_and_suggest_a_correction() {
    let refused = |arguments: &str, words: &[&str]| {
        let answer = Bench::new().run(arguments);
        answer.is_refused(words);
        assert!(!answer.err.contains("--set"), "{}", answer.err);
        assert!(!answer.err.contains("operating_point_m"), "{}", answer.err);
    };
    refused(
        "model modes --operating-point 8",
        &[
            "--operating-point 8 is 8 m",
            "-0.5 to 0.5 m",
            "did you mean 8% or 8mm?",
        ],
    );
    refused(
        "chirp --amplitude 5s",
        &[
            "--amplitude",
            "`5s` is a time in s",
            "give a current in A",
            "100mA",
        ],
    );
    refused(
        "control --amplitude 10mm",
        &["--amplitude 10mm is 0.01 m", "the soft limit of 0.0009 m"],
    );
    refused(
        "control --reference circle",
        &[
            "--reference",
            "circle",
            "step, hold, ramp, sine, square, triangle, s-curve, random or chirp",
        ],
    );
}

#[test]
fn json_errors_are_objects_on_standard_output() {
    for (arguments, code, kind, place) in [
        ("margins --config nosuch", 2, "configuration", "nosuch"),
        ("margins --set loop.rate_hz=0", 2, "configuration", "--set"),
        (
            "chirp --amplitude banana",
            2,
            "usage",
            "--amplitude <CURRENT>",
        ),
        ("control --speed 1e-5", 2, "usage", "--speed"),
    ] {
        let answer = Bench::new().run(&format!("{arguments} --json"));
        let error = answer.json()["error"].clone();
        assert_eq!(
            (answer.code, error["kind"].as_str()),
            (code, Some(kind)),
            "{error}"
        );
        assert_eq!(error["where"].as_str(), Some(place), "{error}");
        let message = error["message"].as_str().expect("a message");
        assert!(answer.err.contains(message), "{error}");
        assert!(error.get("remedy").is_some(), "{error}");
    }
}

#[test]
fn recording_names_contain_controller_and_reference() {
    let bench = Bench::new();
    for (arguments, end) in [
        ("control --fast --duration 0.3", "_control-fast-step.mcap"),
        ("control --fast --duration 0.3", "_control-fast-step"),
        (
            "control --slow --duration 0.3 --reference hold",
            "_control-slow-hold.mcap",
        ),
    ] {
        let report = bench.json(arguments);
        let recording = report["recording"].as_str().expect("a path");
        assert!(recording.contains(end), "{recording}");
    }
}

#[test]
fn identify_in_place_adds_no_files() {
    let bench = Bench::new();
    let chirp = bench.json("chirp --start 5 --stop 50 --duration 6");
    let recording = chirp["recording"].as_str().expect("a path");
    let files = || {
        std::fs::read_dir(bench.path("recordings"))
            .expect("a folder")
            .count()
    };
    let before = files();
    let identified = bench.json(&format!("identify {recording}"));
    assert_eq!(files(), before);
    assert_eq!(identified["frf_csv"], chirp["frf_csv"]);
}

#[test]
fn margins_of_an_unstable_loop_list_unstable_poles_and_exit_with_1() {
    let answer = Bench::new().run("margins --fast --asymmetry -10%");
    assert_eq!(answer.code, 1, "{}", answer.err);
    assert!(answer.out.contains("UNSTABLE") && !answer.out.contains("phase margin"));
    let answer = Bench::new().run("margins --fast --asymmetry -10% --json");
    let report = answer.json();
    assert_eq!((answer.code, &report["stable"]), (1, &Value::Bool(false)));
    assert!(report["modulus_margin"].is_null(), "{report}");
    let poles = report["poles"].as_array().expect("poles");
    let unstable = poles.iter().filter(|pole| pole["stable"] == false);
    assert!(unstable.clone().count() > 0, "{report}");
    for pole in unstable {
        // s^2 + 2 zeta w s + w^2 = 0: |s| = 2 pi f and zeta = -Re s/|s|.
        let (re, im) = (number(&pole["re_rad_s"]), number(&pole["im_rad_s"]));
        let omega = re.hypot(im);
        let hz = omega / std::f64::consts::TAU;
        assert!((number(&pole["frequency_hz"]) / hz - 1.0).abs() < 1e-9);
        assert!((number(&pole["damping_ratio"]) + re / omega).abs() < 1e-9);
    }
}

#[test]
fn initial_file_of_own_stage_is_valid_and_found_by_name() {
    for plant in ["lumped", "modal"] {
        let bench = Bench::new();
        std::fs::create_dir(bench.path("bench-config")).expect("a folder");
        let init = format!("config init --plant {plant} --out bench-config/mine.toml");
        assert_eq!(bench.run(&init).code, 0);
        assert_eq!(
            bench.json("config check --config mine")["title"],
            "my stage"
        );
        assert_eq!(bench.run("margins --config nosuch").code, 2);
        let profiles = bench.json("config profiles")["profiles"].clone();
        let named = |name: &str| {
            let profiles = profiles.as_array().expect("a list").iter();
            profiles.filter(|profile| profile["name"] == name).count()
        };
        assert_eq!((named("mine"), named("stage")), (1, 1), "{profiles}");
        let again = bench.run(&init);
        assert!(
            again.code == 1 && again.err.contains("mine.toml"),
            "{}",
            again.err
        );
    }
}

#[test]
fn completions_and_manual_pages_are_generated() {
    for shell in ["bash", "zsh", "fish"] {
        let script = Bench::new().run(&format!("completions {shell}"));
        assert!(
            script.code == 0 && script.out.contains("stepped_sine"),
            "{shell}"
        );
    }
    let bench = Bench::new();
    assert_eq!(bench.run("man --out man").code, 0);
    for page in ["bench.1", "bench-chirp.1", "bench-model-locus.1"] {
        assert!(bench.read(format!("man/{page}")).contains(".TH"), "{page}");
    }
}

#[test]
fn help_fits_80_columns_and_shows_kinds_and_defaults() {
    let bench = Bench::new();
    let help = |command: &str| bench.run(&format!("{command} --help")).out;
    for command in [
        "", "chirp", "control", "margins", "config", "identify", "emulate", "model",
    ] {
        let wide = |line: &&str| line.chars().count() > 80;
        let text = help(command);
        assert_eq!(text.lines().find(wide), None, "{command}");
    }
    let chirp = help("chirp");
    for word in ["multisine", "logarithmic", "realtime", "0.1 Hz", "110 s"] {
        assert!(chirp.contains(word), "{word}: {chirp}");
    }
    for command in ["", "model", "margins", "identify"] {
        assert!(help(command).contains("docs/glossary.md"), "{command}");
    }
    let control = help("control").replace('\n', " ");
    assert!(control.contains("step of 50 um, 0.2 s after"), "{control}");
}

#[test]
fn old_name_of_emulate_works_and_is_hidden() {
    let bench = Bench::new();
    assert!(bench.run("device --help").out.contains("emulate"));
    assert!(!bench.run("--help").out.contains("  device"));
}

#[test]
fn full_output_device_causes_no_panic() {
    let full = || {
        File::options()
            .write(true)
            .open("/dev/full")
            .expect("a full device")
    };
    let mut refused = bench(&["margins", "--config", "nosuch"]);
    let output = refused
        .stderr(full())
        .stdout(Stdio::null())
        .status()
        .expect("it runs");
    assert_eq!(output.code(), Some(2));
    let mut shown = bench(&["config", "show"]);
    let output = shown
        .stdout(full())
        .stderr(full())
        .status()
        .expect("it runs");
    assert_eq!(output.code(), Some(1));
    // The emulator reports on standard error while it runs.
    let emulate = "emulate probe --config lab --duration 300ms --fault probe.silence@100ms";
    let mut emulator = bench(&emulate.split(' ').collect::<Vec<_>>());
    let status = emulator
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(full())
        .status()
        .expect("it runs");
    assert_eq!(status.code(), Some(0));
}

#[test]
fn calibrate_and_linearity_print_the_plan_before_the_first_run() {
    let bench = Bench::new();
    // A file instead of the folder prevents the run.
    std::fs::write(bench.path("taken"), "").expect("a file");
    for (command, words) in [
        (
            "calibrate --amplitude 20mA",
            ["static steps up to 0.020 A", "for the delay"],
        ),
        (
            "linearity --scales 0.5,1",
            [
                "0.5 of the amplitude; expected travel",
                "1 of the amplitude",
            ],
        ),
    ] {
        let answer = bench.run(&format!("{command} --out taken"));
        assert!(
            answer.code != 0 && answer.err.contains("taken"),
            "{}",
            answer.err
        );
        for word in words {
            assert!(answer.out.contains(word), "{word}: {}", answer.out);
        }
    }
}
