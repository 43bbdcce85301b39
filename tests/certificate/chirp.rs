//! What a completed chirp leaves.
use std::process::Command;

use bench_experiment::certificate::{SignAgreement, SignCheck};
use bench_experiment::evidence::{ResponseFile, certify};
use bench_experiment::{AnalysedRun, Plan, ReadSignals, analyse, never_cancels};
use bench_identify::modal::FittedMode;
use bench_identify::{Estimate, SIGMAS_95};
use bench_plant::{ModalModel, build};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;
use serde_json::Value;

use crate::certificate::stage::{Chirp, chirp, config, reversed_chirp};

fn certificate(chirp: &Chirp) -> Value {
    serde_json::from_str(&chirp.text("certificate")).expect("JSON")
}

/// SHA-256 by the program of the system.
fn sha256sum(chirp: &Chirp, key: &str) -> String {
    let output = Command::new("sha256sum").arg(chirp.file(key)).output();
    let output = output.expect("sha256sum of coreutils");
    let text = String::from_utf8(output.stdout).expect("text");
    text.split_whitespace().next().expect("a digest").into()
}

#[test]
fn certificate_names_devices_loop_load_and_the_digest_of_the_response() {
    let found = certificate(chirp());
    assert_eq!(found["frf"]["sha256"], sha256sum(chirp(), "frf_csv"));
    assert_eq!(found["devices"]["amplifier"], "simulated");
    assert_eq!(found["devices"]["probe"], "simulated");
    assert_eq!(found["loop"]["rate_hz"], 5000.0);
    assert_eq!(found["loop"]["computing_delay_periods"], 1);
    // 8 % of L = 47.5 mm, and D = +10 %.
    assert_eq!(found["load"]["operating_point_m"], 0.0038);
    assert_eq!(found["load"]["mass_asymmetry"], 0.1);
    assert_eq!(found["valid_days"], 30.0);
    assert!(found["digests"]["calibration"].is_null());
    assert_eq!(found["digests"]["motor"].as_str().map(str::len), Some(64));
    let made = found["made"].as_str().expect("a date");
    assert!(made.starts_with("20") && made.ends_with('Z'), "{made}");
    // The thesis: + - + for a positive asymmetry (modes R, u, v).
    assert_eq!(found["signs"]["measured"], "+-+");
    assert_eq!(found["signs"]["agreement"], "agree");
    let modes = found["modes"].as_array().expect("modes");
    // 183.9 rad/s (READING of the thesis: modes at 8 % of L and D = +10 %).
    let first_hz = modes[0]["frequency_hz"].as_f64().expect("a frequency");
    assert!(
        (first_hz - 183.9 / std::f64::consts::TAU).abs() < 0.05,
        "{first_hz}"
    );
    assert!(
        modes
            .iter()
            .all(|mode| mode["residue_sigma"].as_f64() > Some(0.0))
    );
}

#[test]
fn chirp_on_another_stage_says_in_large_letters_that_the_signs_differ() {
    // The stage has D = -10 %, whose signs are ++- (thesis, section 6.2.3); the model has +10 %.
    let other = reversed_chirp();
    assert_eq!(other.report["signs"]["measured"], "++-");
    assert_eq!(other.report["signs"]["model"], "+-+");
    assert_eq!(other.report["signs"]["agreement"], "differ");
    assert_eq!(certificate(other)["signs"]["agreement"], "differ");
    let large = "THE SIGNS OF THE RESIDUES DIFFER FROM THE MODEL";
    assert!(other.text("report").contains(large));
    assert!(!chirp().text("report").contains(large));
    let recording = other.file("recording");
    let again = recording.parent().expect("a folder");
    let arguments = ["identify".as_ref(), recording.as_os_str()];
    let answer = bench_test_support::program::run_in(again, arguments);
    let line = "*".repeat(80);
    assert!(
        answer.out.contains(large) && answer.out.contains(&line),
        "{}",
        answer.out
    );
    assert!(
        answer.out.contains("MEASURED ++-, MODEL +-+"),
        "{}",
        answer.out
    );
}

#[test]
fn uncertain_or_missing_signs_do_not_differ() {
    let model = ModalModel::of(&build(&config(&[]).plant).expect("a model")).expect("modes");
    let exact = |residue_sigma: f64| -> Vec<FittedMode> {
        let modes = model
            .modes
            .iter()
            .filter(|mode| mode.residue_per_kg().abs() > 1e-6);
        modes
            .map(|mode| FittedMode {
                omega_rad_s: Estimate {
                    value: mode.omega_rad_s,
                    sigma: 0.01,
                },
                damping_ratio: Estimate {
                    value: mode.damping_ratio,
                    sigma: 1e-5,
                },
                residue_per_kg: Estimate {
                    value: mode.residue_per_kg(),
                    sigma: residue_sigma,
                },
                residue_imaginary_per_kg: None,
                turned_by_one_more: 0.0,
            })
            .collect()
    };
    let band_hz = (0.5, 200.0);
    let agreement = |modes: &[FittedMode]| SignCheck::of(modes, &model, band_hz).agreement;
    assert_eq!(agreement(&exact(1e-4)), SignAgreement::Agree);
    let mut reversed = exact(1e-4);
    reversed[1].residue_per_kg.value *= -1.0;
    assert_eq!(agreement(&reversed), SignAgreement::Differ);
    // The interval of 95 % contains zero.
    let size = reversed[1].residue_per_kg.value.abs();
    reversed[1].residue_per_kg.sigma = 1.01 * size / SIGMAS_95;
    assert_eq!(agreement(&reversed), SignAgreement::Incomplete);
    assert_eq!(agreement(&exact(1e-4)[..2]), SignAgreement::Incomplete);
}

/// A recording of a run of the simulated stage with more settings.
fn recorded(plan: impl FnOnce(bench_config::Config) -> Plan, more: &[&str]) -> Recording {
    let folder = tempfile::tempdir().expect("a folder");
    let config = config(more);
    let rig = Box::new(SimulatedRig::new(&config).expect("a rig"));
    let run = bench_experiment::run(
        &plan(config),
        rig,
        Pace::Virtual,
        folder.path(),
        &mut |_, _| {},
    );
    let run = run.expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    Recording::open(&path).expect("a recording")
}

#[test]
fn only_a_completed_chirp_leaves_a_certificate() {
    let config = config(&[]);
    let complete = Recording::open(&chirp().file("recording")).expect("a recording");
    let analysis = analyse(
        &complete,
        ReadSignals::default(),
        &config,
        &mut never_cancels,
    )
    .expect("an analysis");
    let certificate = |run: AnalysedRun<'_>| {
        let response = ResponseFile {
            name: "frf.csv",
            csv: "",
        };
        certify(&run, response).expect("TOML")
    };
    let run = |recording| AnalysedRun::new(recording, &analysis, &config);
    assert!(certificate(run(&complete)).is_some());
    let last_of_shots = AnalysedRun::of_shots(&complete, &analysis, &config);
    assert_eq!(certificate(last_of_shots), None);
    // 5 um of travel: the chirp trips.
    let tripped = recorded(
        Plan::chirp,
        &["interlock.soft_limit_m=5e-6", "control.reference.kind=hold"],
    );
    let other = recorded(Plan::quiet, &[]);
    for recording in [&tripped, &other] {
        assert_eq!(certificate(run(recording)), None);
    }
}
