//! The calibration file: written and used by the program, and rejected if it does not match.
use std::path::Path;

use assert_cmd::Command;
use bench_recording::Recording;
use serde_json::Value;

fn bench(folder: &Path, arguments: &[&str]) -> (i32, Value, String) {
    let mut command = Command::cargo_bin("bench").expect("built");
    let output = command
        .current_dir(folder)
        .args(arguments)
        .arg("--json")
        .output()
        .expect("it runs");
    let json = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (
        output.status.code().unwrap_or(-1),
        json,
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

/// Number of recordings in the default folder of `folder`.
fn recordings(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder.join("recordings")).expect("the folder");
    let names = entries.map(|entry| entry.expect("an entry").path());
    names
        .filter(|path| path.extension().is_some_and(|e| e == "mcap"))
        .count()
}

/// Makes a calibration in `folder` and returns its text.
fn calibrate(folder: &Path) -> (Value, String) {
    let (code, report, errors) = bench(folder, &["calibrate", "--write", "mine.toml"]);
    assert_eq!(code, 0, "{errors}");
    (
        report,
        std::fs::read_to_string(folder.join("mine.toml")).expect("the file"),
    )
}

#[test]
fn calibration_file_has_date_devices_and_delay_and_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (report, text) = calibrate(folder.path());
    let calibration = &report["calibration"];
    assert_eq!(calibration["amplifier"]["device"], "simulated");
    assert!(
        calibration["made"]
            .as_str()
            .is_some_and(|made| made.starts_with("20") && made.ends_with('Z'))
    );
    // The computing delay is 0.2 ms; the fit of the phase estimates it within 2 us.
    let delay_s = calibration["chain"]["delay_s"].as_f64().expect("measured");
    assert!((delay_s - 2e-4).abs() < 2e-6, "{delay_s}");
    assert!(
        text.contains("compliance_m_per_a")
            && Path::new(report["recording"].as_str().expect("a path"))
                .extension()
                .is_some()
    );
    let recorded = recordings(folder.path());
    let (code, _, errors) = bench(
        folder.path(),
        &["calibrate", "--no-delay", "--write", "mine.toml"],
    );
    assert!(
        code == 1 && errors.contains("mine.toml") && errors.contains("--write"),
        "{errors}"
    );
    assert!(errors.contains("nothing was moved"), "{errors}");
    assert_eq!(
        recordings(folder.path()),
        recorded,
        "refused before any motion"
    );
    assert_eq!(
        std::fs::read_to_string(folder.path().join("mine.toml")).expect("the file"),
        text
    );
}

#[test]
fn run_records_its_calibration_and_replays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    calibrate(folder.path());
    let run = [
        "control",
        "--duration",
        "1",
        "--set",
        "calibration.file=mine.toml",
    ];
    let (code, report, errors) = bench(folder.path(), &run);
    assert_eq!(code, 0, "{errors}");
    let path = report["recording"].as_str().expect("a path");
    let recording = Recording::open(&folder.path().join(path)).expect("a recording");
    let attached = recording.attachment("calibration.toml").expect("attached");
    assert!(String::from_utf8_lossy(&attached.data).contains("compliance_m_per_a"));
    assert_eq!(
        recording.metadata().get("amplifier").map(String::as_str),
        Some("simulated")
    );
    assert_eq!(bench(folder.path(), &["replay", path]).0, 0);
}

#[test]
fn expired_or_mismatched_calibration_warns_or_fails_as_configured() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (_, text) = calibrate(folder.path());
    let old = text.lines().map(|l| {
        if l.starts_with("made") {
            "made = \"2020-01-01T00:00:00Z\""
        } else {
            l
        }
    });
    std::fs::write(
        folder.path().join("old.toml"),
        old.collect::<Vec<_>>().join("\n"),
    )
    .expect("a good disk");
    let mismatched = text.replacen("device = \"simulated\"", "device = \"canopen 0x1-0x2\"", 1);
    std::fs::write(folder.path().join("mismatched.toml"), mismatched).expect("a good disk");
    let cases = [
        ("old.toml", "when_expired", "180", "days ago"),
        (
            "mismatched.toml",
            "when_other_devices",
            "made for the amplifier",
            "canopen 0x1-0x2",
        ),
    ];
    for (file, setting, first, second) in cases {
        for (then, expected) in [("warn", 0), ("refuse", 2)] {
            let (file, then) = (
                format!("calibration.file={file}"),
                format!("calibration.{setting}={then}"),
            );
            let run = ["control", "--duration", "1", "--set", &file, "--set", &then];
            let (code, _, errors) = bench(folder.path(), &run);
            assert_eq!(code, expected, "{file} {then}: {errors}");
            assert!(
                errors.contains(first) && errors.contains(second),
                "{errors}"
            );
            assert_eq!(
                errors.contains("nothing was moved"),
                expected == 2,
                "{errors}"
            );
        }
    }
}

#[test]
fn gains_beyond_25_percent_need_a_name_and_large_current_offsets_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (_, text) = calibrate(folder.path());
    let probe_gain = text.split_once("[probe]").expect("a table").1;
    let probe_gain = probe_gain.split_once("\ngain = ").expect("a key").1;
    let probe_gain = format!("\ngain = {}", probe_gain.lines().next().expect("a value"));
    let current =
        |gain: f64| text.replace("current_gain = 1.0", &format!("current_gain = {gain:?}"));
    let probe = |gain: f64| text.replacen(&probe_gain, &format!("\ngain = {gain:?}"), 1);
    let offset = text.replace("current_offset_a = 0.0", "current_offset_a = 0.9");
    // Text, place in the message, exit code without and with a name.
    let cases = [
        (current(0.76), "", 0, 0),
        (current(1.24), "", 0, 0),
        (probe(1.24), "", 0, 0),
        (current(0.74), "amplifier.current_gain = 0.74", 2, 0),
        (current(1.26), "amplifier.current_gain = 1.26", 2, 0),
        (probe(0.74), "probe.gain = 0.74", 2, 0),
        (probe(0.0), "probe.gain = 0e0", 2, 2),
        (probe(1e-9), "probe.gain = 1e-9", 2, 2),
        (probe(-0.74), "-1.25 to -0.75 of a reversed probe", 2, 0),
        (probe(-1.26), "probe.gain = -1.26", 2, 0),
        (offset, "amplifier.current_offset_a = 0.9", 2, 2),
    ];
    for (text, place, without_name, with_name) in cases {
        std::fs::write(folder.path().join("edited.toml"), text).expect("a good disk");
        let run = [
            "control",
            "--duration",
            "1",
            "--set",
            "calibration.file=edited.toml",
        ];
        let named = [&run[..], &["--set", "calibration.accepted_by=A. Smith"]].concat();
        for (arguments, expected) in [(&run[..], without_name), (&named[..], with_name)] {
            let (code, _, errors) = bench(folder.path(), arguments);
            assert_eq!(
                code == 2,
                expected == 2,
                "{place} {arguments:?}: {code} {errors}"
            );
            let is_explained = errors.contains(place) && errors.contains("nothing was moved");
            assert!(expected == 0 || is_explained, "{errors}");
        }
    }
}

/// The compliance of the stage is twice that of its model: the unmodelled mode adds residue/omega^2 = 1/k with
/// k = 72000 N/m, the stiffness of the model.
fn twice_as_soft(folder: &Path) {
    let omega_rad_s = std::f64::consts::TAU * 1500.0;
    let residue_per_kg = omega_rad_s * omega_rad_s / 72_000.0;
    let text = format!(
        "calibrate.scale_by = \"model\"\ncalibrate.amplitude_a = 1.0\n[[sim.unmodelled]]\nfrequency_hz = 1500.0\ndamping_ratio = 0.5\nresidue_per_kg = {residue_per_kg:?}\n"
    );
    std::fs::write(folder.join("soft.toml"), text).expect("a good disk");
}

#[test]
fn refuses_measured_gain_without_naming_a_file_or_denying_the_motion() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    twice_as_soft(folder.path());
    let calibrate = ["calibrate", "--no-delay", "--config", "soft.toml"];
    let (code, report, errors) = bench(folder.path(), &calibrate);
    assert_eq!(
        (code, &report["calibration"]),
        (1, &Value::Null),
        "{errors}"
    );
    let why = report["why"].as_str().expect("a reason");
    let (gain, rest) = why
        .strip_prefix("probe.gain = ")
        .and_then(|text| text.split_once(" is outside 0.75 to 1.25"))
        .expect(why);
    // The compliance of the model over that of the stage; the fit has an error of less than 0.1 %.
    let gain: f64 = gain.parse().expect("a number");
    assert!((gain - 0.5).abs() < 5e-4, "{gain}");
    assert!(rest.contains("; check scale") && rest.contains("calibration.accepted_by"));
    assert!(!why.contains("nothing was moved") && !why.contains("calibration as measured"));
    let confirmed = [
        &calibrate[..],
        &["--set", "calibration.accepted_by=A. Smith"],
    ]
    .concat();
    let (code, report, errors) = bench(folder.path(), &confirmed);
    assert_eq!(code, 0, "{errors}");
    let confirmed_gain = report["calibration"]["probe"]["gain"].as_f64();
    assert!((confirmed_gain.expect("a number") - gain).abs() < 1e-4);
}

#[test]
fn rejects_blank_name_of_the_confirming_person() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["", "  ", "\t"] {
        let text = format!("calibration.accepted_by = {name:?}\n");
        std::fs::write(folder.path().join("blank.toml"), text).expect("a good disk");
        let (code, _, errors) = bench(
            folder.path(),
            &["config", "check", "--config", "blank.toml"],
        );
        assert!(
            code == 2 && errors.contains("`calibration.accepted_by` is blank; give the name"),
            "{name:?}: {code} {errors}"
        );
    }
}

#[test]
fn rejects_invalid_calibration_file_with_its_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (_, text) = calibrate(folder.path());
    let cases = [
        (
            text.replace("current_gain = 1.0", "current_gain = 0.0"),
            "current_gain",
        ),
        (text.replace("[chain]", "[chains]"), "chain"),
        (
            text.replace("made = \"2", "made = \"yesterday 2"),
            "not a date",
        ),
        ("not toml [".into(), "TOML"),
    ];
    for (text, word) in cases {
        std::fs::write(folder.path().join("wrong.toml"), text).expect("a good disk");
        let run = [
            "control",
            "--duration",
            "1",
            "--set",
            "calibration.file=wrong.toml",
        ];
        let (code, _, errors) = bench(folder.path(), &run);
        assert!(code == 2 && errors.contains(word), "{word}: {errors}");
    }
    let (code, _, errors) = bench(
        folder.path(),
        &["control", "--set", "calibration.file=none.toml"],
    );
    assert!(code == 2 && errors.contains("none.toml"), "{errors}");
    let (code, _, errors) = bench(folder.path(), &["calibrate", "--amplitude", "6"]);
    assert!(
        code == 2 && errors.contains("soft limit") && errors.contains("calibrate.amplitude_a"),
        "{errors}"
    );
}

/// The commands that judge a calibration without a run, with the exit code for a calibration that the run refuses.
const WITHOUT_A_RUN: [(&[&str], i32); 4] = [
    (&["config", "check"], 2),
    (&["margins"], 2),
    (&["chirp", "--plan"], 2),
    (&["doctor"], 1),
];

/// What a command says about the calibration.
fn complaint(report: &Value, errors: &str) -> String {
    let findings = report["findings"].as_array();
    let failure = findings
        .into_iter()
        .flatten()
        .find(|finding| finding["subject"] == "calibration" && finding["verdict"] == "failure");
    failure.map_or(errors.to_string(), |failure| failure["what"].to_string())
}

#[test]
fn refuses_without_a_run_the_calibration_that_the_run_refuses() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (_, text) = calibrate(folder.path());
    let cases = [
        ("damaged.toml", "not toml [".to_string(), "TOML"),
        (
            "nan.toml",
            text.replace("current_gain = 1.0", "current_gain = nan"),
            "current_gain",
        ),
        (
            "gain.toml",
            text.replace("current_gain = 1.0", "current_gain = 0.5"),
            "amplifier.current_gain = 0.5",
        ),
        (
            "other.toml",
            text.replacen("device = \"simulated\"", "device = \"canopen 0x1-0x2\"", 1),
            "canopen 0x1-0x2",
        ),
    ];
    for (name, text, _) in &cases {
        std::fs::write(folder.path().join(name), text).expect("a good disk");
    }
    let absent = ("absent.toml", String::new(), "absent.toml");
    for (name, _, word) in cases.iter().chain([&absent]) {
        let file = format!("calibration.file={name}");
        for (command, expected) in WITHOUT_A_RUN {
            let refused = [command, &["--set", &file]].concat();
            let (code, report, errors) = bench(folder.path(), &refused);
            let complaint = complaint(&report, &errors);
            assert!(
                code == expected && complaint.contains(word),
                "{command:?} {name}: {code} {complaint}"
            );
        }
    }
}

#[test]
fn accepts_without_a_run_the_calibration_that_the_run_accepts() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    calibrate(folder.path());
    for (command, _) in WITHOUT_A_RUN {
        let accepted = [command, &["--set", "calibration.file=mine.toml"]].concat();
        let (code, report, errors) = bench(folder.path(), &accepted);
        if command == ["doctor"] {
            let findings = report["findings"].as_array().expect("a list");
            let mut findings = findings.iter();
            let found = findings.find(|finding| finding["subject"] == "calibration");
            assert_eq!(found.expect("a finding")["verdict"], "ok", "{report}");
        } else {
            assert_eq!(code, 0, "{command:?}: {errors}");
        }
        assert!(!errors.contains("calibration"), "{command:?}: {errors}");
    }
}

#[test]
fn states_that_the_amplifier_of_a_calibration_was_not_checked() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    calibrate(folder.path());
    let devices = [
        "--config",
        "lab",
        "--set",
        "amplifier.device.interface=no-such-can",
        "--set",
        "probe.device.line.port=/dev/ttyNONE9",
        "--set",
        "calibration.file=mine.toml",
    ];
    // The identity of the probe is its port, which the configuration names.
    for (reaction, expected) in [("warn", 0), ("refuse", 2)] {
        let reaction = format!("calibration.when_other_devices={reaction}");
        let check = [&["config", "check"], &devices[..], &["--set", &reaction]].concat();
        let (code, _, errors) = bench(folder.path(), &check);
        assert_eq!(code, expected, "{errors}");
        assert!(
            errors.contains("made for the probe \"simulated\""),
            "{errors}"
        );
        let is_stated =
            errors.contains("not checked whether it belongs to the connected amplifier");
        assert_eq!(is_stated, expected == 0, "{errors}");
    }
}

#[test]
fn config_check_refuses_absent_controller_and_reference() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let reference = "[control.reference]\nkind = \"file\"\npath = \"absent.csv\"\n";
    std::fs::write(folder.path().join("reference.toml"), reference).expect("a good disk");
    let cases = [
        ("--set", "control.controller=absent.toml", "absent.toml"),
        ("--config", "reference.toml", "absent.csv"),
    ];
    for (option, value, file) in cases {
        let (code, _, errors) = bench(folder.path(), &["config", "check", option, value]);
        assert!(
            code == 2 && errors.contains(file),
            "{value}: {code} {errors}"
        );
    }
}
