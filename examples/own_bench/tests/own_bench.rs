//! The program with its own probe and control law, as a user runs it.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bench_test_support::program::{Answer, Bench, NO_DAEMON};
use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_own-bench");
const CONFIGURATION: &str = include_str!("../bench.toml");
const CONTROLLER: &str = include_str!("../controller.toml");

/// The law of controller.toml at 5 kHz by its matrices. With the states s (sum of e) and p (y of the tick before):
/// s+ = s + r - y, p+ = y, u = Ki T (s + r - y) - Kv/T (y - p), where Ki T = 20 A/m and Kv/T = 20000 A/m.
const AS_MATRICES: &str = "title = 'matrices'
[law]
kind = 'state_space'
rate_hz = 5000.0
a = [[1.0, 0.0], [0.0, 0.0]]
b_reference = [1.0, 0.0]
b_position = [-1.0, 1.0]
c = [20.0, 20000.0]
d_reference = 20.0
d_position = -20020.0
";

fn own_bench() -> Bench {
    let bench = Bench::of(PROGRAM);
    bench.write("bench.toml", CONFIGURATION);
    bench.write("controller.toml", CONTROLLER);
    bench.write("matrices.toml", AS_MATRICES);
    bench
}

/// Two ways to the same loop: by the law of this crate, and by matrices that the program knows.
#[test]
fn own_law_gives_the_loop_of_its_matrices() {
    let bench = own_bench();
    let margins = |controller: &str| bench.json(&format!("margins --controller {controller}"));
    let (own, matrices) = (margins("controller.toml"), margins("matrices.toml"));
    let keys = [
        "crossover_rad_s",
        "phase_margin_deg",
        "gain_margin_db",
        "modulus_margin",
    ];
    for key in keys {
        let [found, expected] = [&own, &matrices].map(|margins| margins[key].as_f64());
        let (found, expected) = (found.expect(key), expected.expect(key));
        assert!(
            (found - expected).abs() < 1e-6 * expected.abs(),
            "{key}: {found} {expected}"
        );
    }
    let measured = |controller: &str| {
        let step = format!("control --controller {controller} --reference step --amplitude 20um");
        bench.json(&step)["measured"].clone()
    };
    let (own, matrices) = (measured("controller.toml"), measured("matrices.toml"));
    let settling_s = own["settling_time_s"].as_f64().expect("settled");
    assert_eq!(own["settling_time_s"], matrices["settling_time_s"]);
    // A first-order loop of 15.4 rad/s reaches 2 % after 0.25 s; the noise of 0.06 um leaves the band of 0.4 um later.
    assert!((0.2..0.6).contains(&settling_s), "{own}");
    let error_m = own["steady_state_mean_error_m"].as_f64().expect("a mean");
    assert!(error_m.abs() < 10e-9, "{own}");
}

/// The modes that the doublet of this crate finds are those of the model of the simulated stage.
#[test]
fn own_excitation_identifies_the_modes_of_the_model() {
    let bench = own_bench();
    bench.write("doublet.toml", include_str!("../doublet.toml"));
    let model = bench.json("model modes");
    let measured = bench.json("chirp --config doublet.toml");
    assert_eq!(measured["outcome"], "completed");
    let excitation = bench.run("chirp --config doublet.toml --plan").out;
    assert!(excitation.starts_with("doublet of 0.5 A, pulses of 0.004 s"));
    let modes = |report: &Value| report["modes"].as_array().expect("modes").clone();
    // A mode of the model whose residue is zero at this operating point is not observable.
    let is_observable = |mode: &Value| mode["residue"].as_f64().expect("a residue").abs() > 0.01;
    let model: Vec<Value> = modes(&model).into_iter().filter(is_observable).collect();
    assert_eq!(model.len(), 3);
    for (mode, found) in model.iter().zip(&modes(&measured)) {
        for key in ["frequency_hz", "damping_ratio", "residue"] {
            let truth = mode[key].as_f64().expect(key);
            let value = found[key].as_f64().expect(key);
            let sigma = found[format!("{key}_sigma")].as_f64().expect("a sigma");
            // Nine comparisons: one beyond 4 sigmas in 1,700 seeds.
            assert!(
                (value - truth).abs() < 4.0 * sigma,
                "{key}: {value} {truth} {sigma}"
            );
        }
    }
    assert_eq!(measured["cnmp"], "detected");
}

#[test]
fn settings_of_own_kinds_are_checked_and_explained() {
    let bench = own_bench();
    let wrong = CONTROLLER.replace("velocity_a_s_per_m = 4.0", "velocity_a_s_per_m = -4.0");
    bench.write("wrong.toml", wrong);
    let refusal = |arguments: &str| {
        let Answer { code, err, .. } = bench.run(arguments);
        assert_eq!(code, 2, "{arguments}: {err}");
        err
    };
    let law = refusal("margins --controller wrong.toml");
    assert!(
        law.contains("line 6: `law.velocity_a_s_per_m` is -4"),
        "{law}"
    );
    let misspelt = CONFIGURATION.replace("count_m =", "coutn_m =");
    bench.write("misspelt.toml", misspelt);
    let probe = refusal("config check --config misspelt.toml");
    assert!(probe.contains("the nearest is `count_m`"), "{probe}");
    let kinds = bench.run("config schema").out;
    assert!(kinds.contains("\"interferometer\"") && kinds.contains("\"capancdt\""));
}

/// The driver reads the emulated interferometer on a pseudo terminal. At rest the stage is at 1 mm of the probe, which is position
/// 0; the floor moves it by 0.1 um.
#[test]
fn own_probe_is_read_through_its_driver() {
    let bench = own_bench();
    let folder = bench.path("").display().to_string();
    let locks = format!("probe.device.line.lock_folder={folder}");
    let link = bench.path("probe");
    let _emulator = Stopped::started(&bench, &["--set", &locks], &link);
    let port = format!("probe.device.line.port={}", link.display());
    let doctor = [
        "doctor",
        "--json",
        "--config",
        "bench.toml",
        "--set",
        &locks,
        "--set",
        &port,
    ];
    // A loaded machine reads later; the age of readings is not tested.
    let patient = ["--set", "interlock.probe_stale_s=10"];
    let answer = bench.run_with(doctor.into_iter().chain(patient));
    let probe = &answer.json()["probe"];
    assert_eq!(
        (&probe["came"], &probe["damaged_bytes"]),
        (&true.into(), &0.into()),
        "{probe}"
    );
    let position_m = probe["position_mean_m"].as_f64().expect("a position");
    assert!(position_m.abs() < 1e-6, "{probe}");
}

/// A process that ends with the test.
struct Stopped(Child);

impl Stopped {
    /// The emulated probe, when it serves the terminal.
    fn started(bench: &Bench, options: &[&str], link: &std::path::Path) -> Stopped {
        let mut command = Command::new(PROGRAM);
        command.args(["emulate", "probe", "--config", "bench.toml", "--pty"]);
        command
            .arg(link)
            .args(options)
            .env(NO_DAEMON.0, NO_DAEMON.1);
        command
            .current_dir(bench.path(""))
            .stdin(Stdio::piped())
            .stdout(Stdio::null());
        let emulator = Stopped(command.spawn().expect("the program starts"));
        let start = Instant::now();
        while !link.exists() {
            assert!(start.elapsed() < Duration::from_secs(120), "no terminal");
            std::thread::sleep(Duration::from_millis(10));
        }
        emulator
    }
}

impl Drop for Stopped {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
