//! `bench control` with a certificate, and with an override.
use bench_recording::Recording;
use bench_rt::record::EventKind;
use bench_test_support::program::{Answer, Bench};

use crate::certificate::stage::{SETTINGS, chirp};

/// Settings of devices that do not exist.
const NO_DEVICES: &str = "--config lab --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9";
const REASON: &str = "the supply is limited to 0.5 A";

fn with_override(bench: &Bench, arguments: &str) -> Answer {
    let words = arguments.split_whitespace().chain(["--override", REASON]);
    bench.run_with(words)
}

#[test]
fn devices_are_not_opened_without_a_certificate() {
    let bench = Bench::new();
    let control = format!("control {NO_DEVICES} --slow");
    let refused = bench.run(&control);
    refused.is_refused(&[
        "certificate",
        "bench chirp",
        "--certificate",
        "--override",
        "nothing was moved",
    ]);
    assert!(!refused.err.contains("ttyNONE9"), "{}", refused.err);
    bench
        .run(&format!("{control} --plan"))
        .is_refused(&["certificate"]);
    // With a reason the devices are opened.
    let opened = with_override(&bench, &control);
    assert!(
        opened.code == 2 && opened.err.contains("ttyNONE9"),
        "{opened:?}"
    );
    // A loop that is unstable by the model is refused with a reason as well.
    let unstable = format!("control {NO_DEVICES} --fast --set control.min_modulus_margin=0");
    with_override(&bench, &unstable).is_refused(&["unstable by the model", "never run on devices"]);
}

#[test]
fn short_reason_is_refused() {
    let bench = Bench::new();
    let answer = bench.run_with(["control", "--slow", "--override", "because"]);
    answer.is_refused(&["7 characters", "10 to 1000"]);
}

#[test]
fn reason_is_recorded_in_metadata_and_events() {
    let bench = Bench::new();
    let answer = with_override(&bench, "control --slow --duration 1 --json");
    assert_eq!(answer.code, 0, "{}", answer.err);
    let report = answer.json();
    assert_eq!(report["evidence"]["override"], REASON);
    let path = report["recording"].as_str().expect("a path");
    let recording = Recording::open(&bench.path(path)).expect("a recording");
    assert_eq!(
        recording.metadata().get("override").map(String::as_str),
        Some(REASON)
    );
    let overrides = recording
        .events()
        .iter()
        .filter(|event| event.kind == EventKind::Override);
    assert_eq!(overrides.count(), 1);
    let bytes = std::fs::read(bench.path(path)).expect("a file");
    assert!(
        bytes
            .windows(REASON.len())
            .any(|part| part == REASON.as_bytes())
    );
    assert_eq!(bench.run(&format!("replay {path}")).code, 0);
}

#[test]
fn certificate_and_stage_check_are_recorded_and_replay() {
    let bench = Bench::new();
    let certificate = chirp().file("certificate");
    let control = format!(
        "control {SETTINGS} --duration 1 --json --certificate {}",
        certificate.display()
    );
    let answer = bench.run(&control);
    assert_eq!(
        (answer.code, answer.err.as_str()),
        (0, ""),
        "{}",
        answer.out
    );
    let report = answer.json();
    assert!(
        report["evidence"]["modulus_margin_lower"].as_f64() > Some(0.3),
        "{report}"
    );
    let path = report["recording"].as_str().expect("a path");
    let recording = Recording::open(&bench.path(path)).expect("a recording");
    let attached = recording.attachment("certificate.json").expect("attached");
    assert_eq!(attached.data, chirp().text("certificate").as_bytes());
    let names = std::fs::read_dir(bench.path("recordings")).expect("a folder");
    let mut names = names.map(|entry| {
        entry
            .expect("an entry")
            .file_name()
            .to_string_lossy()
            .into_owned()
    });
    let check = names
        .find(|name| name.ends_with("_stage-check.mcap"))
        .expect("a stage check");
    for recording in [path.to_string(), format!("recordings/{check}")] {
        assert_eq!(
            bench.run(&format!("replay {recording}")).code,
            0,
            "{recording}"
        );
    }
}

#[test]
fn defects_are_warnings_on_the_simulated_stage() {
    let bench = Bench::new();
    let certificate = chirp().file("certificate");
    let control = format!(
        "control --slow --set loop.rate_hz=1000 --duration 1 --certificate {}",
        certificate.display()
    );
    let answer = bench.run(&control);
    assert_eq!(answer.code, 0, "{}", answer.err);
    assert!(
        answer.err.contains("the certificate was made at 5000 Hz"),
        "{}",
        answer.err
    );
}

#[test]
fn all_mismatches_are_listed_in_text_and_json_before_a_device_is_opened() {
    let bench = Bench::new();
    let certificate = chirp().file("certificate");
    // The certificate is that of the simulated stage at 5 kHz.
    let control = format!(
        "control {NO_DEVICES} --slow --certificate {} --json",
        certificate.display()
    );
    let refused = bench.run(&control);
    assert_eq!(refused.code, 2, "{}", refused.err);
    let error = &refused.json()["error"];
    let defects = error["defects"].as_array().expect("a list");
    assert!(defects.len() >= 3, "{error}");
    let text = refused.err.clone();
    for (number, defect) in (1..).zip(defects) {
        let defect = defect.as_str().expect("a text");
        assert!(defect.contains("; "), "{defect}");
        assert!(text.contains(&format!("\n  {number}. {defect}")), "{text}");
    }
    for table in ["[amplifier]", "[probe]"] {
        let line = format!("the settings in {table} differ");
        assert!(text.contains(&line), "{table}: {text}");
    }
    assert!(!text.contains("ttyNONE9"), "{text}");
}

#[test]
fn plan_shows_the_table_of_conditions_and_the_rest_after_the_check() {
    let bench = Bench::new();
    let control = format!(
        "control {SETTINGS} --asymmetry 9% --plan --certificate {}",
        chirp().file("certificate").display()
    );
    let answer = bench.run(&control);
    assert_eq!(answer.code, 0, "{}", answer.err);
    let row = |name: &str| -> String {
        let lines = answer.out.lines();
        let mut rows = lines.filter(|line| line.trim_start().starts_with(name));
        rows.next().expect("a row").to_string()
    };
    assert!(row("mass asymmetry").contains("DIFFERS"), "{}", answer.out);
    assert!(row("operating point").contains("agrees"), "{}", answer.out);
    assert!(row("amplifier").contains("not compared"), "{}", answer.out);
    assert!(
        row("rest").contains("after the check of the stage"),
        "{}",
        answer.out
    );
    let json = bench.json(&control);
    let conditions = json["evidence"]["conditions"].as_array().expect("a list");
    let asymmetry = conditions.iter().find(|c| c["subject"] == "mass_asymmetry");
    let asymmetry = asymmetry.expect("a condition");
    assert_eq!(asymmetry["agreement"], "differs");
    assert_eq!(
        (
            asymmetry["certificate"].as_str(),
            asymmetry["today"].as_str()
        ),
        (Some("0.1"), Some("0.09"))
    );
}
