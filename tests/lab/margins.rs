//! Margins at 1 kHz with a slow probe, and rejected configurations.
use std::path::Path;

use assert_cmd::Command;
use nalgebra::Complex;
use serde_json::Value;

use crate::lab::aliases::{lab, modes, response};

/// Devices that do not exist in place of those of the profile `lab`, which this machine may have.
const NO_DEVICES: [&str; 4] = [
    "--set",
    "amplifier.device.interface=no-such-can",
    "--set",
    "probe.device.line.port=/dev/ttyNONE9",
];

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

fn margins(arguments: &[&str]) -> Value {
    bench(
        Path::new("."),
        &[&["margins", "--config", "lab"], arguments].concat(),
    )
    .1
}

/// The slow controller, Eq. (6-6), discretised by Tustin's rule as each section is, in amperes per metre.
fn slow(omega_rad_s: f64, period_s: f64) -> Complex<f64> {
    let z = Complex::new(0.0, omega_rad_s * period_s).exp();
    let s = (z - 1.0) / (z + 1.0) * (2.0 / period_s);
    let w = 89.5;
    (s * s + s * 2.0 * 0.7 * w + w * w).inv() * (w * w) / s * 0.12e6
}

#[test]
fn margins_of_the_slow_controller_match_the_closed_form() {
    let (config, ours) = (lab(&[]), margins(&["--slow"]));
    let (modes, period_s) = (modes(&config), config.servo.period_s());
    let open = |w: f64| response(&config, &modes, w, false) * slow(w, period_s);
    let closest = (1..30_000)
        .map(|k| (open(f64::from(k) * 0.1) + 1.0).norm())
        .fold(f64::INFINITY, f64::min);
    let modulus_margin = ours["modulus_margin"].as_f64().expect("a number");
    // The grid is 0.1 rad/s, the half-width of mode R is 184 x 0.009 = 1.7 rad/s: the relative error is at most (0.05/1.7)^2/2.
    assert!(
        (modulus_margin / closest - 1.0).abs() < 2e-3,
        "{modulus_margin} for {closest}"
    );
    let crossover_rad_s = ours["crossover_rad_s"].as_f64().expect("a number");
    assert!(
        (open(crossover_rad_s).norm() - 1.0).abs() < 1e-3,
        "{crossover_rad_s}"
    );
    let phase_deg = ours["phase_margin_deg"].as_f64().expect("a number");
    assert!(
        (open(crossover_rad_s).arg().to_degrees() + 180.0 - phase_deg).abs() < 0.05,
        "{phase_deg}"
    );
}

#[test]
fn each_delay_reduces_the_phase_margin_and_the_sum_is_reported() {
    let phase = |sets: &[&str]| {
        let ours = margins(&[&["--slow"], sets].concat());
        let number = |key: &str| ours[key].as_f64().expect("a number");
        (
            number("phase_margin_deg"),
            number("crossover_rad_s"),
            number("delay_s"),
        )
    };
    let (base_deg, crossover_rad_s, delay_s) = phase(&[]);
    assert!(
        (delay_s - (0.0004 + 0.0003 + 0.0014 + 0.5 / 650.0)).abs() < 1e-12,
        "{delay_s}"
    );
    for set in [
        "amplifier.latency_s=0.0024",
        "probe.latency_s=0.0023",
        "probe.transport_s=0.0034",
    ] {
        let (deg, _, later_s) = phase(&["--set", set]);
        assert!((later_s - delay_s - 0.002).abs() < 1e-12, "{set}");
        // 2 ms at the crossover frequency, which changes by less than 1 %.
        let cost_deg = (crossover_rad_s * 0.002).to_degrees();
        assert!(
            (base_deg - deg - cost_deg).abs() < 0.02 * cost_deg + 0.02,
            "{set}: {deg} from {base_deg}"
        );
    }
    // At half the rate of the probe the mean age increases by half a period, 0.77 ms.
    let (deg, _, _) = phase(&["--set", "probe.rate_hz=325"]);
    assert!(
        (base_deg - deg - (crossover_rad_s * 0.5 / 650.0).to_degrees()).abs() < 0.05,
        "{deg} from {base_deg}"
    );
}

#[test]
fn rejects_controller_below_the_modulus_margin_limit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let control = |arguments: &[&str]| {
        let common = [
            "control",
            "--config",
            "lab",
            "--simulate",
            "--duration",
            "2",
        ];
        bench(folder.path(), &[&common[..], arguments].concat())
    };
    let (code, _, errors) = control(&["--fast"]);
    assert_eq!(code, 2, "{errors}");
    for word in [
        "modulus margin",
        "control.min_modulus_margin",
        "0.4",
        "--controller",
        "nothing was moved",
    ] {
        assert!(errors.contains(word), "{word}: {errors}");
    }
    assert!(
        !folder.path().join("recordings").exists(),
        "no recording is created"
    );
    for chosen in [&["--slow"][..], &[]] {
        let (code, report, errors) = control(chosen);
        assert_eq!(
            (code, report["outcome"].as_str()),
            (0, Some("completed")),
            "{errors}"
        );
    }
    // The threshold is a setting: the slow controller has 0.69.
    let (code, _, errors) = control(&["--slow", "--set", "control.min_modulus_margin=0.75"]);
    assert!(
        code == 2 && errors.contains("0.69") && errors.contains("0.75"),
        "{errors}"
    );
    // On devices an unstable loop is refused even without a threshold.
    let devices = [
        "control",
        "--config",
        "lab",
        "--fast",
        "--set",
        "control.min_modulus_margin=0",
    ];
    let devices = [&devices[..], &NO_DEVICES].concat();
    let (code, _, errors) = bench(folder.path(), &devices);
    assert_eq!(code, 2, "{errors}");
    for word in [
        "unstable by the model",
        "never run on devices",
        "--simulate",
        "nothing was moved",
    ] {
        assert!(errors.contains(word), "{word}: {errors}");
    }
    // On the simulated stage with min_modulus_margin = 0 the run starts; the interlocks still trip.
    let (code, report, _) = control(&["--fast", "--set", "control.min_modulus_margin=0"]);
    assert_eq!((code, report["outcome"].as_str()), (1, Some("tripped")));
}

#[test]
fn rejects_rates_beyond_bus_and_line_capacity() {
    let refused = |sets: &[&str], words: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let (code, _, errors) = bench(
            Path::new("."),
            &[&["margins", "--config", "lab"], &sets[..]].concat(),
        );
        assert_eq!(code, 2, "{errors}");
        words
            .iter()
            .for_each(|word| assert!(errors.contains(word), "{word}: {errors}"));
    };
    let synchronous = "amplifier.device.exchange={ kind = \"synchronous\", status_every = 1 }";
    refused(
        &["loop.rate_hz=5000", synchronous],
        &["245 us of the 200 us", "123.2 %", "80 %", "3239 Hz"],
    );
    refused(
        &["loop.rate_hz=20000"],
        &["asynchronous set-point", "loads the bus", "allows"],
    );
    // 6 + 17 characters of 11 bits at 230,400 baud take 1.098 ms.
    refused(
        &["probe.transport_s=0.001"],
        &["0.001 s", "23 characters", "0.001098"],
    );
    refused(&["interlock.probe_stale_s=0.003"], &["0.003", "rate_hz"]);
    refused(
        &["amplifier.device.node=127"],
        &["own_node", "not that of the drive"],
    );
    let (code, _, errors) = bench(
        Path::new("."),
        &["chirp", "--config", "lab", "--simulate", "--stop", "400"],
    );
    assert!(
        code == 2 && errors.contains("half the rate of the probe, 325 Hz"),
        "{errors}"
    );
}

#[test]
fn rejects_virtual_pace_mixed_devices_and_missing_interfaces() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (code, _, errors) = bench(
        folder.path(),
        &[
            &["chirp", "--config", "lab", "--pace", "virtual"],
            &NO_DEVICES[..],
        ]
        .concat(),
    );
    assert!(code == 2 && errors.contains("--simulate"), "{errors}");
    let (code, _, errors) = bench(
        folder.path(),
        &[
            "chirp",
            "--config",
            "lab",
            "--set",
            "amplifier.device.kind=simulated",
            "--set",
            "probe.device.line.port=/dev/ttyNONE9",
        ],
    );
    assert!(
        code == 2 && errors.contains("capancdt") && errors.contains("both"),
        "{errors}"
    );
    // No motion; the error names the missing device.
    let (code, _, errors) = bench(
        folder.path(),
        &[
            &["control", "--config", "lab", "--slow"][..],
            &["--override", "no certificate in this test"],
            &NO_DEVICES[..],
        ]
        .concat(),
    );
    assert!(
        code == 2 && errors.contains("/dev/ttyNONE9") && errors.contains("nothing was moved"),
        "{errors}"
    );
}
