//! `bench` with a configuration of devices: the state of the motor in `--plan` and `doctor`, and the options.
use assert_cmd::Command;
use bench_test_support::program::NO_DAEMON;
use serde_json::Value;

/// The profile `lab` with a hot excitation, and without its devices, which this machine may have.
const HOT_LAB: [&str; 18] = [
    "--config",
    "lab",
    "--set",
    "amplifier.device.interface=no-such-can",
    "--set",
    "probe.device.line.port=/dev/ttyNONE9",
    "--set",
    "chirp.start_hz=50",
    "--set",
    "chirp.duration_s=10",
    "--set",
    "chirp.quiet_before_s=0.1",
    "--set",
    "motor.continuous_force_n=3.3",
    "--set",
    "chirp.amplitude=[{frequency_hz=1,current_a=0.5}]",
    "--set",
    "chirp.fade_in_s=0.01",
];

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a folder"))
    }

    fn bench(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
        command.args(arguments).current_dir(self.0.path());
        command.envs([NO_DAEMON]);
        command.env("XDG_STATE_HOME", self.0.path().join("state"));
        let output = command.output().expect("it starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (
            output.status.code().expect("an exit code"),
            text(&output.stdout),
            text(&output.stderr),
        )
    }

    fn json(&self, command: &[&str]) -> Value {
        let (_, out, err) = self.bench(&[command, &HOT_LAB, &["--json"]].concat());
        serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out} {err}"))
    }
}

#[test]
fn plan_starts_from_the_heat_of_the_motor() {
    let folder = Folder::new();
    // 3.3 N over 11.12 N/A.
    let limit_a = 3.3 / 11.12;
    let unknown = &folder.json(&["chirp", "--plan"])["motor"];
    assert!((unknown["thermal_start_a"].as_f64().expect("a number") - limit_a).abs() < 1e-12);
    let known_from = unknown["known_from"].as_str().expect("a text");
    assert!(
        known_from.contains("motor-canopen-no-such-can-5.json"),
        "{known_from}"
    );
    assert!(unknown["start_after"].is_null() && unknown["wait_s"].as_f64() > Some(0.0));

    let cold = &folder.json(&["chirp", "--motor-cold", "--plan"])["motor"];
    assert_eq!(
        (&cold["thermal_start_a"], &cold["wait_s"]),
        (&0.0.into(), &0.0.into())
    );
    // 0.5^2/2 (1 - e^-1) = 0.281^2, with fades of the amplitude.
    let peak_a = cold["thermal_peak_a"].as_f64().expect("a number");
    assert!((0.26..0.285).contains(&peak_a), "{peak_a}");
}

#[test]
fn simulated_plan_has_no_motor() {
    let folder = Folder::new();
    let plan = folder.json(&["chirp", "--simulate", "--plan"]);
    assert!(plan["motor"].is_null());
    assert!(!folder.0.path().join("state").exists(), "nothing is stored");
}

#[test]
fn doctor_shows_the_motor() {
    let folder = Folder::new();
    let report = folder.json(&["doctor"]);
    let findings = report["findings"].as_array().expect("findings").iter();
    let motor: Vec<_> = findings.filter(|f| f["subject"] == "motor").collect();
    assert_eq!(motor.len(), 1, "{report}");
    assert_eq!(motor[0]["verdict"], "warning");
    let remedy = motor[0]["remedy"].as_str().expect("a remedy");
    for option in ["--wait-for-motor", "--motor-cold"] {
        assert!(remedy.contains(option), "{remedy}");
    }
    assert!(report["motor"]["thermal_start_a"].as_f64() > Some(0.29));
}

#[test]
fn rejects_motor_options_on_the_simulated_stage() {
    for option in ["--motor-cold", "--wait-for-motor"] {
        let (code, _, err) = Folder::new().bench(&["chirp", option]);
        assert!(code == 2 && err.contains(option), "{code}: {err}");
        assert!(err.contains("; leave it out"), "{err}");
    }
}
