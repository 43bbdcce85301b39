//! `bench doctor`: exit codes, text and JSON.

use serde_json::Value;

use crate::doctor::program::{Answer, Bench};

/// The profile `lab` without its devices, which this machine may have, and without an effective limit of missed ticks, because
/// the timing of the machine is not tested.
const LAB: &str = "--config lab --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9 --set interlock.overruns_per_s=1000000";

/// Checks structure and consistency of the JSON object, and returns it.
pub fn checked_report(answer: &Answer) -> Value {
    let report = answer.json();
    let findings = report["findings"].as_array().expect("a list of findings");
    assert!(!findings.is_empty());
    for finding in findings {
        let verdict = finding["verdict"].as_str().expect("a verdict");
        assert!(
            ["ok", "note", "warning", "failure"].contains(&verdict),
            "{finding}"
        );
        assert!(
            finding["subject"].is_string()
                && finding["what"]
                    .as_str()
                    .is_some_and(|what| !what.is_empty())
        );
        assert!(
            finding["remedy"].is_null() || finding["remedy"].is_string(),
            "{finding}"
        );
        assert!(
            verdict == "ok" || finding["remedy"].is_string(),
            "without a remedy: {finding}"
        );
    }
    let failed = findings
        .iter()
        .any(|finding| finding["verdict"] == "failure");
    assert_eq!(
        (report["ready"].as_bool(), answer.code),
        (Some(!failed), i32::from(failed)),
        "{report}"
    );
    for figures in [
        "lateness",
        "bus_load",
        "bus",
        "drive",
        "probe",
        "recordings",
        "control",
    ] {
        assert!(
            report[figures].is_null() || report[figures].is_object(),
            "{figures}: {report}"
        );
    }
    report
}

/// `verdict: what` of the findings on a subject.
pub fn findings_on(report: &Value, subject: &str) -> Vec<String> {
    let findings = report["findings"]
        .as_array()
        .expect("findings")
        .iter()
        .filter(|f| f["subject"] == subject);
    findings
        .map(|f| {
            format!(
                "{}: {}",
                f["verdict"].as_str().unwrap(),
                f["what"].as_str().unwrap()
            )
        })
        .collect()
}

#[test]
fn default_profile_is_ready_and_no_file_is_left() {
    let bench = Bench::new();
    let answer = bench.run("doctor");
    assert_eq!(
        (answer.code, answer.err.as_str()),
        (0, ""),
        "{}",
        answer.out
    );
    let last = answer.out.lines().last().unwrap();
    assert!(
        last.starts_with("ready (")
            && last.ends_with("`bench chirp` and `bench control` could start now"),
        "{last}"
    );
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn suggested_command_has_the_given_options() {
    let answer = Bench::new().run("doctor --asymmetry -2% --set loop.rate_hz=4000 --out monday");
    let suggested =
        "`bench control --set loop.rate_hz=4000 --asymmetry -2% --out monday` could start now\n";
    assert!(
        answer.code == 0 && answer.out.ends_with(suggested),
        "{}",
        answer.out
    );
}

#[test]
fn json_has_findings_and_figures_in_si_units() {
    let report = checked_report(&Bench::new().run("doctor --json"));
    let lateness = &report["lateness"];
    assert_eq!(lateness["rate_hz"], 5000.0);
    assert!(
        lateness["policy"]
            .as_str()
            .is_some_and(|policy| policy.starts_with("SCHED_")),
        "{lateness}"
    );
    assert!(
        ["p50_s", "p99_s", "max_s"]
            .iter()
            .all(|key| lateness[key].is_f64()),
        "{lateness}"
    );
    // The chirp: 2 + 110 + 8 s at 5 kHz.
    assert_eq!(
        report["recordings"]["needed_bytes"],
        600_000 * bench_recording::BYTES_PER_TICK
    );
    assert!(
        report["control"]["modulus_margin"].is_f64()
            && report["drive"].is_null()
            && report["probe"].is_null()
    );
    assert_eq!(
        report["could_start"],
        serde_json::json!(["chirp", "control"])
    );
}

#[test]
fn rejects_invalid_configuration_like_other_commands() {
    Bench::new()
        .run("doctor --set loop.rate=1")
        .is_refused(&["loop.rate", "rate_hz"]);
    Bench::new()
        .run("doctor --frobnicate")
        .is_refused(&["--frobnicate"]);
    let overload = "doctor --config lab --set loop.rate_hz=5000 --set amplifier.device.bit_rate=125000 --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9";
    Bench::new()
        .run(overload)
        .is_refused(&["125000 bit/s", "the limit of 80 %"]);
}

#[test]
fn too_small_margin_excludes_control_but_not_chirp() {
    let answer = Bench::new().run("doctor --set control.min_modulus_margin=0.9 --json");
    let report = checked_report(&answer);
    assert_eq!(
        (answer.code, &report["could_start"]),
        (1, &serde_json::json!(["chirp"]))
    );
    let found = findings_on(&report, "control");
    assert!(
        found[0].starts_with("failure: refused:") && found[0].contains("the limit of 0.9"),
        "{found:?}"
    );
}

#[test]
fn predicted_trip_excludes_chirp_but_not_control() {
    let flat = "chirp.amplitude=[{ frequency_hz = 1.0, current_a = 0.3 }]";
    let answer = Bench::new().run_with(["doctor", "--json", "--set", flat]);
    let report = checked_report(&answer);
    assert_eq!(
        (answer.code, &report["could_start"]),
        (1, &serde_json::json!(["control"]))
    );
    assert!(
        findings_on(&report, "chirp")[0].contains("travel"),
        "{report}"
    );
}

#[test]
fn unwritable_folder_is_a_failure() {
    let bench = Bench::new();
    bench.write("file", "");
    let report = checked_report(&bench.run("doctor --json --out file/in"));
    let found = findings_on(&report, "recordings");
    assert!(
        found[0].starts_with("failure: ") && found[0].ends_with("file is not a folder"),
        "{found:?}"
    );
    let report = checked_report(&bench.run("doctor --json --out /proc/recordings"));
    let found = findings_on(&report, "recordings");
    assert!(
        found.len() == 1 && found[0].starts_with("failure: "),
        "{found:?}"
    );
}

#[test]
fn mixing_a_real_and_a_simulated_device_is_a_failure() {
    let answer = Bench::new()
        .run("doctor --json --set amplifier.device={kind=\"vesc\",interface=\"no-such-can\",bit_rate=500000,node=1}");
    let found = findings_on(&checked_report(&answer), "configuration");
    assert!(
        answer.code == 1
            && found[0].contains("amplifier.device is vesc and probe.device is simulated"),
        "{found:?}"
    );
}

#[test]
fn missing_interface_is_reported_as_failure_with_remedy() {
    for device in [
        "",
        "--set amplifier.device={kind=\"vesc\",interface=\"no-such-can\",bit_rate=500000,node=1}",
    ] {
        let report = checked_report(&Bench::new().run(&format!("doctor {LAB} --json {device}")));
        let found = [
            findings_on(&report, "CAN kernel"),
            findings_on(&report, "CAN interface"),
        ]
        .concat();
        let known = [
            "failure: this kernel has no CAN",
            "failure: no-such-can does not exist",
        ];
        assert!(
            found.len() == 1 && known.iter().any(|known| found[0].starts_with(known)),
            "{found:?}"
        );
        assert!(
            report["bus_load"]["load"]
                .as_f64()
                .is_some_and(|load| load > 0.0 && load < 0.8),
            "{report}"
        );
        assert_eq!(report["could_start"], serde_json::json!([]));
    }
}

#[test]
fn unavailable_processor_is_not_a_failure() {
    let report = checked_report(&Bench::new().run("doctor --json --set loop.cpu=1023"));
    let found = findings_on(&report, "processor");
    assert!(
        found[0].starts_with("note: loop.cpu is 1023, this process may use"),
        "{found:?}"
    );
    let lab =
        checked_report(&Bench::new().run(&format!("doctor {LAB} --json --set loop.cpu=1023")));
    assert!(
        findings_on(&lab, "processor")[0].starts_with("warning: loop.cpu is 1023"),
        "{lab}"
    );
}

#[test]
fn recorded_tick_size_is_within_the_disk_space_estimate() {
    let bench = Bench::new();
    for command in [
        "control --fast --duration 4 --json --out a",
        "chirp --duration 10 --json --out b",
    ] {
        let answer = bench.run(command);
        let run = answer.json();
        let bytes = std::fs::metadata(bench.path(run["recording"].as_str().unwrap()))
            .unwrap()
            .len();
        let per_tick = bytes / run["ticks"].as_u64().unwrap();
        assert!(
            (40..=bench_recording::BYTES_PER_TICK).contains(&per_tick),
            "{command}: {per_tick} bytes"
        );
    }
}
