use std::path::Path;
use std::sync::OnceLock;

use super::*;
use crate::MarginError;
use crate::certificate::{CertificateError, CertificateText};
use crate::evidence::{ResponseFile, certify};
use crate::stage_check::StageCheckError;
use crate::{AnalysedRun, ReadSignals, analyse, never_cancels};
use bench_config::{Purpose, Source, load};
use bench_identify::frf_csv::{self, METRES_PER_AMPERE};

/// A loop on devices that do not exist.
fn refused(controller: &str) -> ExperimentError {
    let sets = [
        &format!("control.controller={controller}"),
        "control.min_modulus_margin=0",
        "amplifier.device.interface=no-such-can",
        "probe.device.line.port=/dev/ttyNONE9",
    ];
    let config = load(&Source {
        config: Some("lab".into()),
        sets: sets.map(String::from).to_vec(),
        options: Vec::new(),
        purpose: Purpose::Control,
    })
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let runner = Runner::new(Setup::on_devices(folder.path().into()));
    let refused = runner.run(&Plan::control(config).unwrap(), "control");
    refused.err().expect("a refusal")
}

#[test]
fn refuses_loop_without_certificate_before_a_device_is_opened() {
    let error = refused("slow");
    assert_eq!(defects(&error), [CertificateError::Missing]);
}

#[test]
fn refuses_unstable_loop_before_a_device_is_opened() {
    let error = refused("fast");
    let is_unstable = matches!(
        error,
        ExperimentError::Margin(MarginError::UnstableOnDevices { .. })
    );
    assert!(is_unstable, "{error}");
}

fn defects(error: &ExperimentError) -> &[CertificateError] {
    match error {
        ExperimentError::Certificate(defects) => defects.as_slice(),
        other => panic!("{other}"),
    }
}

/// The loop of `lab` with the slow controller on its devices, which are emulated by the simulated stage.
fn device_config(more: &[&str]) -> Config {
    let sets = [
        "control.controller=slow",
        "control.duration_s=0.5",
        "chirp.start_hz=0.5",
        "chirp.stop_hz=200",
        "chirp.duration_s=40",
    ];
    let sets = sets.iter().chain(more).map(|set| set.to_string());
    load(&Source {
        config: Some("lab".into()),
        sets: sets.collect(),
        options: Vec::new(),
        purpose: Purpose::Control,
    })
    .expect("valid settings")
}

fn setup(folder: &Path) -> Setup {
    let mut setup = Setup::on_devices(folder.into());
    setup.conditions.pace = Pace::Virtual;
    setup.conditions.motor = MotorHandling::Simulated;
    setup
}

/// A runner whose devices are open already: the simulated stage of `rig`.
fn runner_on(rig: &Config, folder: &Path) -> Runner {
    let setup = setup(folder);
    let bench = OpenBench::emulated(rig, setup.opening(rig));
    Runner::on_bench(setup, Some(bench), RunHooks::default())
}

/// The certificate of a chirp on the emulated devices.
fn certificate() -> CertificateText {
    static CERTIFICATE: OnceLock<CertificateText> = OnceLock::new();
    CERTIFICATE.get_or_init(chirped).clone()
}

fn chirped() -> CertificateText {
    let folder = tempfile::tempdir().expect("a folder");
    let config = device_config(&[]);
    let runner = runner_on(&config, folder.path());
    let run = runner.run(&Plan::chirp(config.clone()), "chirp");
    let run = run.expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    let recording = Recording::open(&path).expect("a recording");
    let analysis = analyse(
        &recording,
        ReadSignals::default(),
        &config,
        &mut never_cancels,
    )
    .expect("an analysis");
    let csv = frf_csv::to_string(&analysis.frf, METRES_PER_AMPERE);
    let response = ResponseFile {
        name: "frf.csv",
        csv: &csv,
    };
    let certificate = certify(&AnalysedRun::new(&recording, &analysis, &config), response);
    let certificate = certificate.expect("TOML").expect("a completed chirp");
    CertificateText {
        name: "certificate.json".into(),
        json: certificate.to_json(),
        frf_csv: csv,
    }
}

/// The loop of the emulated devices with their certificate, changed as text.
fn certified_plan(config: Config, edit: impl Fn(String) -> String) -> Plan {
    let mut plan = Plan::control(config).expect("a plan");
    let text = certificate();
    plan.certificate = Some(CertificateText {
        json: edit(text.json.clone()),
        ..text
    });
    plan
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = names.map(|name| name.to_string_lossy().into()).collect();
    names.sort();
    names
}

#[test]
fn closes_the_loop_on_devices_after_the_check_of_their_stage() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = device_config(&[]);
    let runner = runner_on(&config, folder.path());
    let run = runner.run(&certified_plan(config, |json| json), "control");
    let run = run.expect("a run");
    assert!(run.end.servo.completed, "{:?}", run.end.servo);
    let names = names(folder.path());
    assert!(
        names.len() == 2 && names.iter().any(|name| name.ends_with("_stage-check.mcap")),
        "{names:?}"
    );
}

#[test]
fn refuses_other_devices_after_they_are_open_and_before_any_motion() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = device_config(&[]);
    let runner = runner_on(&config, folder.path());
    let other =
        |json: String| json.replace("\"amplifier\": \"simulated\"", "\"amplifier\": \"another\"");
    let error = runner.run(&certified_plan(config, other), "control");
    let error = error.err().expect("a refusal");
    assert!(
        matches!(defects(&error), [CertificateError::OtherDevice { .. }]),
        "{error}"
    );
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn refuses_another_stage_on_devices_before_the_loop_closes() {
    let config = device_config(&[]);
    // Springs that are softer by a sixth than those of the certificate.
    let soft = device_config(&["plant.spring_stiffness_n_per_m=30000"]);
    let reason = "a reason of an operator".parse().expect("long enough");
    for (reason, is_refused) in [(None, true), (Some(reason), false)] {
        let folder = tempfile::tempdir().expect("a folder");
        let runner = runner_on(&soft, folder.path());
        let plan = certified_plan(config.clone(), |json| json).with_override(reason);
        let result = runner.run(&plan, "control");
        let names = names(folder.path());
        match result {
            Err(ExperimentError::StageCheck(StageCheckError::Compliance(_))) => assert!(is_refused),
            Err(other) => panic!("{other}"),
            Ok(run) => assert!(!is_refused, "{names:?}: {:?}", run.end.servo),
        }
        let closed = names.iter().filter(|name| name.contains("_control-"));
        assert_eq!(closed.count(), usize::from(!is_refused), "{names:?}");
    }
}

#[test]
fn loop_does_not_close_after_a_stage_check_that_tripped() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = device_config(&[]);
    // The stage moves 36 times as far as the model: an interlock trips.
    let soft = device_config(&["plant.spring_stiffness_n_per_m=1000"]);
    let runner = runner_on(&soft, folder.path());
    let run = runner.run(&certified_plan(config, |json| json), "control");
    let run = run.expect("a run that tripped");
    assert!(run.end.servo.trip.is_some(), "{:?}", run.end.servo);
    let names = names(folder.path());
    assert!(
        names.iter().all(|name| name.ends_with("_stage-check.mcap")),
        "{names:?}"
    );
}
