//! Accepted settings: layers, units, profiles, and their output.
use std::path::PathBuf;

use serde_json::json;

use crate::config_settings::program::{self, Bench, number};
use crate::config_settings::{bench_config, toml_files};

#[test]
fn converts_units_of_set_values() {
    let bench = Bench::new();
    for (set, pointer, expected) in [
        (
            "plant.operating_point_m=4%",
            "/plant/operating_point_m",
            0.04 * 0.0475,
        ),
        (
            "plant.operating_point_m=3.8mm",
            "/plant/operating_point_m",
            3.8 * 1e-3,
        ),
        ("plant.mass_asymmetry=10%", "/plant/mass_asymmetry", 0.1),
        ("loop.rate_hz=2kHz", "/loop/rate_hz", 2000.0),
        (
            "interlock.current_error_s=50ms",
            "/interlock/current_error_s",
            50.0 * 1e-3,
        ),
        (
            "motor.force_constant_n_per_a=11",
            "/motor/force_constant_n_per_a",
            11.0,
        ),
    ] {
        let shown = bench.json(&format!("config show --set {set}"));
        let value = number(shown.pointer(pointer).expect("a setting"));
        assert_eq!(value, expected, "{set}");
    }
}

#[test]
fn config_show_output_reads_back_unchanged() {
    let bench = Bench::new();
    let options = [
        "--config chapter2 --operating-point 3.3% --seed 17",
        "--set loop.cpu=1 --set sim.floor=[] --set chirp.sweep=linear --set control.reference.kind=hold",
        "--set plant.damping={kind=\"rayleigh\",mass_per_s=3.0,stiffness_s=1e-6} --asymmetry -0.123456789012345678",
    ];
    for options in std::iter::once("").chain(options) {
        let shown = bench.run(&format!("config show {options}"));
        assert_eq!(shown.code, 0, "{options}: {}", shown.err);
        bench.write("shown.toml", &shown.out);
        let again = bench.run("config show --config shown.toml");
        assert_eq!(again.out, shown.out, "{options}: {}", again.err);
        let json = |options: &str| bench.json(&format!("config show {options}"));
        assert_eq!(json("--config shown.toml"), json(options), "{options}");
    }
}

#[test]
fn profiles_and_controllers_are_valid_and_found_by_name() {
    let bench = Bench::new();
    let profiles = toml_files(&bench_config());
    assert!(profiles.len() >= 2, "{profiles:?}");
    for path in &profiles {
        let name = path.file_stem().expect("a name").to_str().expect("UTF-8");
        let by_path = bench.json(&format!("config show --config {}", path.display()));
        assert_eq!(
            bench.json(&format!("config check --config {name}"))["valid"],
            true,
            "{name}"
        );
        assert_eq!(
            bench.json(&format!("config show --config {name}")),
            by_path,
            "{name}"
        );
    }
    for path in &toml_files(&bench_config().join("controllers")) {
        let name = path.file_stem().expect("a name").to_str().expect("UTF-8");
        let profile = profile_of(name, &profiles);
        let margins = |controller: &str| {
            bench.json(&format!(
                "margins --config {profile} --controller {controller}"
            ))
        };
        assert_eq!(
            margins(name),
            margins(path.to_str().expect("UTF-8")),
            "{name}"
        );
    }
}

/// The profile whose name begins the name of a controller; otherwise the default one.
fn profile_of<'a>(controller: &str, profiles: &'a [PathBuf]) -> &'a str {
    let names = profiles
        .iter()
        .map(|path| path.file_stem().expect("a name").to_str().expect("UTF-8"));
    let mut names = names.filter(|name| controller.starts_with(*name));
    names.next().unwrap_or("stage")
}

#[test]
fn later_layer_overrides_only_the_keys_it_contains() {
    let bench = Bench::new();
    bench.write(
        "mine.toml",
        "[plant]\nmass_asymmetry = 0.03\n[loop]\nrate_hz = 4000\n",
    );
    let show = |options: &str| bench.json(&format!("config show {options}"));
    let (stage, mine) = (show(""), show("--config mine.toml"));
    assert_eq!(
        (&mine["plant"]["mass_asymmetry"], &mine["loop"]["rate_hz"]),
        (&json!(0.03), &json!(4000.0))
    );
    assert_eq!(
        mine["plant"]["beam_length_m"],
        stage["plant"]["beam_length_m"]
    );
    let set =
        show("--config mine.toml --set plant.mass_asymmetry=0.04 --set plant.mass_asymmetry=0.05");
    assert_eq!(set["plant"]["mass_asymmetry"], 0.05);
    assert_eq!(
        show("--set plant.mass_asymmetry=0.04 --asymmetry 6%")["plant"]["mass_asymmetry"],
        0.06
    );
}

#[test]
fn operating_point_accepts_percent_of_l_millimetres_and_metres() {
    let bench = Bench::new();
    let metres = |options: &str| {
        number(&bench.json(&format!("config show {options}"))["plant"]["operating_point_m"])
    };
    for text in ["8%", "3.8mm", "3800um", "0.0038", "0.0038m"] {
        program::near(
            text,
            metres(&format!("--operating-point {text}")),
            0.0038,
            1e-17,
        );
    }
    program::near("-8%", metres("--operating-point -8%"), -0.0038, 1e-17);
    // A percentage refers to the configured length of the beams.
    program::near(
        "of 60 mm",
        metres("--operating-point 5% --set plant.beam_length_m=0.06"),
        0.003,
        1e-17,
    );
}

#[test]
fn json_output_is_a_single_object() {
    let bench = Bench::new();
    let run = |arguments: &str| {
        bench.json(arguments)["recording"]
            .as_str()
            .map(str::to_string)
    };
    for arguments in [
        "config show",
        "config check",
        "model modes",
        "margins --fast",
        "margins --slow --continuous",
    ] {
        run(arguments);
    }
    let control = run("control --slow --duration 0.3").expect("a recording");
    let chirp = run("chirp --start 5 --stop 200 --duration 8").expect("a recording");
    run(&format!("identify {chirp}"));
    run(&format!("replay {control}"));
    run(&format!("recover {control}"));
    // The same for a run that trips.
    let tripped = bench.run("control --fast --asymmetry -10% --json");
    assert_eq!(
        (tripped.code, &tripped.json()["outcome"]),
        (1, &json!("tripped"))
    );
}

/// `--reference KIND` states default values, which `--set` changes; an option for a single value is over `--set`.
#[test]
fn set_changes_the_table_of_an_option() {
    let bench = Bench::new();
    for (arguments, expected) in [
        (
            "--reference sine --set control.reference.amplitude_m=2e-5",
            "sine of 20 um at 1 Hz",
        ),
        (
            "--reference sine --set control.reference.amplitude_m=20um --set control.reference.frequency_hz=5",
            "sine of 20 um at 5 Hz",
        ),
        (
            "--reference sine --amplitude 30um --set control.reference.amplitude_m=2e-5",
            "sine of 30 um at 1 Hz",
        ),
        (
            "--reference sine --amplitude 30um --set control.reference.amplitude_m=20um",
            "sine of 30 um at 1 Hz",
        ),
        (
            "--reference sine --set control.reference.kind=sine",
            "sine of 50 um at 1 Hz",
        ),
    ] {
        let planned = bench.json(&format!("control --fast {arguments} --plan"));
        let reference = planned["reference"].as_str().expect("a text");
        assert!(reference.starts_with(expected), "{arguments}: {reference}");
    }
}

#[test]
fn set_that_contradicts_an_option_is_refused() {
    let bench = Bench::new();
    for (arguments, words) in [
        (
            "--reference sine --set control.reference.kind=step",
            ["--reference sine", "contradicts", "control.reference.kind"],
        ),
        // A sine has no beginning.
        (
            "--reference sine --set control.reference.at_s=1",
            ["--set", "at_s", "control.reference"],
        ),
    ] {
        let answer = bench.run(&format!("control --fast {arguments} --plan"));
        assert_eq!(answer.code, 2, "{arguments}: {}", answer.out);
        for word in words {
            assert!(answer.err.contains(word), "{arguments}: {}", answer.err);
        }
    }
}
