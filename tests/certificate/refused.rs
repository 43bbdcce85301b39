//! Each defect of a certificate is refused on devices, with its remedy.

use bench_experiment::certificate::{CertificateError, sha256};
use bench_experiment::evidence::{Agreement, OpenRig, Subject, require_evidence};
use bench_experiment::{DeviceNames, ExperimentError, Plan, PlanError, Stage, closed_loop};
use bench_rig::calibration::Calibration;
use serde_json::json;

use crate::certificate::altered::{
    column, date, defect, defects, edited, only_defect, required, simulated, with_response,
};
use crate::certificate::stage::{chirp, config, plan};

#[test]
fn matching_certificate_is_accepted_with_a_lower_bound_of_the_margin() {
    let evidence = required(&plan(&[]), &simulated()).expect("accepted");
    assert_eq!(evidence.defects, [""; 0]);
    let lower = evidence.modulus_margin_lower.expect("a bound");
    // The stage is the model, apart from the unmodelled modes, which are above the band. The bound is below the margin of the
    // model, by the noise of a chirp of 40 s: at most a tenth.
    let model = closed_loop(&config(&[]))
        .expect("a loop")
        .margins()
        .modulus_margin;
    assert!(
        lower < model + 0.01 && lower > model - 0.1,
        "{lower} {model}"
    );
}

#[test]
fn rejects_missing_certificate() {
    let without = Plan::control(config(&[])).expect("a plan");
    assert_eq!(defect(&without), CertificateError::Missing);
}

#[test]
fn rejects_stale_and_future_certificate() {
    const DAY_S: i64 = 86_400;
    let valid = edited(plan(&[]), |json| json["made"] = date(-29 * DAY_S));
    assert!(required(&valid, &simulated()).is_ok());
    let stale = edited(plan(&[]), |json| json["made"] = date(-31 * DAY_S));
    assert!(
        matches!(defect(&stale), CertificateError::Stale { age_days, .. } if (age_days - 31.0).abs() < 0.01)
    );
    let future = edited(plan(&[]), |json| json["made"] = date(DAY_S));
    assert!(matches!(defect(&future), CertificateError::Future { .. }));
    let undated = edited(plan(&[]), |json| json["made"] = json!("yesterday"));
    assert!(matches!(defect(&undated), CertificateError::Damaged { .. }));
}

#[test]
fn rejects_other_rate_and_computing_delay() {
    let rate = edited(plan(&[]), |json| json["loop"]["rate_hz"] = json!(2000.0));
    assert!(matches!(
        defect(&rate),
        CertificateError::OtherRate {
            certified_hz: 2000.0,
            rate_hz: 5000.0,
            ..
        }
    ));
    let delay = plan(&["loop.computing_delay_periods=0"]);
    assert!(matches!(
        defect(&delay),
        CertificateError::OtherRate {
            certified_periods: 1,
            periods: 0,
            ..
        }
    ));
}

#[test]
fn rejects_other_settings_of_motor_amplifier_and_probe_but_not_of_the_model() {
    for (table, set) in [
        ("motor", "motor.force_constant_n_per_a=11.0"),
        ("amplifier", "amplifier.latency_s=0.0001"),
        ("probe", "probe.range_m=0.0021"),
    ] {
        assert_eq!(
            defect(&plan(&[set])),
            CertificateError::OtherSettings { table }
        );
    }
    assert!(required(&plan(&["plant.motion_stage_mass_kg=0.41"]), &simulated()).is_ok());
}

#[test]
fn rejects_other_devices() {
    let swapped = |amplifier: &str, probe: &str| DeviceNames {
        amplifier: amplifier.into(),
        probe: probe.into(),
    };
    for (devices, kind) in [
        (swapped("canopen 0x1-0x2", "simulated"), "amplifier"),
        (swapped("simulated", "capancdt /dev/ttyUSB0"), "probe"),
    ] {
        let error = required(&plan(&[]), &devices).expect_err("refused");
        let CertificateError::OtherDevice { kind: found, .. } = only_defect(&error) else {
            panic!("{error}");
        };
        assert_eq!(found, kind);
    }
    // Before the devices are open, their identities are not known.
    assert!(require_evidence(&plan(&[]), Stage::Devices, None).is_ok());
}

#[test]
fn rejects_other_calibration() {
    let calibration: Calibration = toml::from_str(
        "made = \"2026-01-01T00:00:00Z\"\nrecording = \"a.mcap\"\n[amplifier]\ndevice = \"simulated\"\ncurrent_gain = 1.0\n\
         current_offset_a = 0.0\nmeasures_current = false\n[probe]\ndevice = \"simulated\"\ngain = 1.01\noffset_m = 0.0\n\
         noise_rms_m = 1e-8\n[chain]\ncompliance_m_per_a = 1.5e-4\ncompliance_sigma_m_per_a = 1e-7\nmodel_m_per_a = 1.5e-4\n\
         nonlinearity_ratio = 0.0\nhysteresis_ratio = 0.0\n",
    )
    .expect("a calibration");
    let rig = OpenRig {
        devices: &simulated(),
        calibration: Some(&calibration),
    };
    let error = require_evidence(&plan(&[]), Stage::Devices, Some(rig)).expect_err("refused");
    assert_eq!(only_defect(&error), CertificateError::OtherCalibration);
    // The same calibration in both is accepted.
    let digest = sha256(&calibration.to_toml().expect("TOML"));
    let same = edited(plan(&[]), |json| {
        json["digests"]["calibration"] = json!(digest)
    });
    assert!(require_evidence(&same, Stage::Devices, Some(rig)).is_ok());
}

#[test]
fn rejects_other_load() {
    for (quantity, set) in [
        ("plant.operating_point_m", "plant.operating_point_m=0.003"),
        ("plant.mass_asymmetry", "plant.mass_asymmetry=0.05"),
    ] {
        let CertificateError::OtherLoad {
            quantity: found, ..
        } = defect(&plan(&[set]))
        else {
            panic!("{set}");
        };
        assert_eq!(found, quantity);
    }
}

#[test]
fn rejects_other_signs_than_those_of_the_model() {
    let reversed = edited(plan(&[]), |json| {
        let residue = json["modes"][1]["residue"].as_f64().expect("a residue");
        json["modes"][1]["residue"] = json!(-residue);
        json["modes"][1]["sign"] = json!("+");
    });
    let CertificateError::Signs { measured, model } = defect(&reversed) else {
        panic!("another defect");
    };
    assert_eq!((measured.as_str(), model.as_str()), ("+++", "+-+"));
}

#[test]
fn rejects_changed_damaged_and_missing_files() {
    let mut changed = plan(&[]);
    changed
        .certificate
        .as_mut()
        .expect("a certificate")
        .frf_csv
        .push(' ');
    let error = required(&changed, &simulated()).expect_err("refused");
    let is_changed = matches!(
        error,
        ExperimentError::Plan(PlanError::Certificate(
            CertificateError::ChangedResponse { .. }
        ))
    );
    assert!(is_changed, "{error}");
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |name: &str, text: Option<&str>| {
        let path = folder.path().join(name);
        if let Some(text) = text {
            std::fs::write(&path, text).expect("a good disk");
        }
        let mut config = config(&[]);
        config.control.certificate = Some(path.display().to_string());
        match Plan::control(config) {
            Err(PlanError::Certificate(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    assert!(matches!(
        refused("none.json", None),
        CertificateError::Unreadable { .. }
    ));
    assert!(matches!(
        refused("text.json", Some("not JSON")),
        CertificateError::Damaged { .. }
    ));
    assert!(matches!(
        refused("empty.json", Some("{}")),
        CertificateError::Damaged { .. }
    ));
    let json = chirp().text("certificate");
    // Its response is not beside it.
    assert!(matches!(
        refused("alone.json", Some(&json)),
        CertificateError::Unreadable { .. }
    ));
    let outside = json.replace("\"file\": \"", "\"file\": \"../");
    assert!(matches!(
        refused("outside.json", Some(&outside)),
        CertificateError::Damaged { .. }
    ));
    let newer = json.replacen("\"format\": 1", "\"format\": 2", 1);
    assert!(matches!(
        refused("newer.json", Some(&newer)),
        CertificateError::Damaged { .. }
    ));
}

#[test]
fn all_defects_are_refused_in_one_list() {
    let several = edited(
        plan(&[
            "motor.force_constant_n_per_a=11.0",
            "plant.operating_point_m=0.003",
        ]),
        |json| {
            json["made"] = date(-31 * 86_400);
            json["loop"]["rate_hz"] = json!(2000.0);
            json["devices"]["probe"] = json!("another probe");
        },
    );
    let error = required(&several, &simulated()).expect_err("refused");
    assert_eq!(defects(&error).len(), 5, "{error}");
    let text = error.to_string();
    for part in [
        "refused: the certificate has 5 defects; correct each of them, or add --override",
        "\n  1. the certificate is stale",
        "\n  2. the certificate was made at 2000 Hz",
        "\n  3. the settings in [motor] differ",
        "\n  4. the certificate was made with the probe \"another probe\"",
        "\n  5. the certificate was made at plant.operating_point_m = 0.0038, but it is 0.003 now",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // On the simulated stage the same list is only reported.
    let rig = OpenRig {
        devices: &simulated(),
        calibration: None,
    };
    let reported = require_evidence(&several, Stage::Simulated, Some(rig)).expect("reported");
    assert_eq!(reported.defects.len(), 5);
}

/// The table of conditions contains both values, and which of them agree.
#[test]
fn conditions_are_listed_with_both_values() {
    let evidence = required(&plan(&[]), &simulated()).expect("accepted");
    let found: Vec<Subject> = evidence.conditions.iter().map(|c| c.subject).collect();
    for subject in [
        Subject::Age,
        Subject::Loop,
        Subject::MotorSettings,
        Subject::AmplifierSettings,
        Subject::ProbeSettings,
        Subject::Amplifier,
        Subject::Probe,
        Subject::Calibration,
        Subject::OperatingPoint,
        Subject::MassAsymmetry,
        Subject::Signs,
        Subject::Band,
        Subject::ModulusMargin,
        Subject::Plant,
        Subject::Controller,
    ] {
        assert_eq!(found.iter().filter(|s| **s == subject).count(), 1);
    }
    for condition in &evidence.conditions {
        // Model and controller may change after the chirp.
        let is_free = matches!(condition.subject, Subject::Plant | Subject::Controller);
        let expected = if is_free {
            Agreement::NotCompared
        } else {
            Agreement::Agrees
        };
        assert_eq!(condition.agreement, expected, "{condition:?}");
    }
    let mut conditions = evidence.conditions.iter();
    let load = conditions.find(|c| c.subject == Subject::OperatingPoint);
    let load = load.expect("the operating point");
    assert_eq!(
        (load.certificate.as_str(), load.today.as_str()),
        ("0.0038", "0.0038")
    );
    // The devices are not known before they are open.
    let closed = require_evidence(&plan(&[]), Stage::Devices, None).expect("accepted");
    let not_open = closed.conditions.iter().filter(|c| c.today == "not open");
    assert_eq!(not_open.count(), 3);
}

#[test]
fn each_defect_has_its_own_remedy() {
    let remedy = |defect: CertificateError| {
        let text = defect.to_string();
        let (_, remedy) = text.split_once("; ").expect("a remedy");
        remedy.to_string()
    };
    let stale = edited(plan(&[]), |json| json["made"] = date(-31 * 86_400));
    let load = plan(&["plant.mass_asymmetry=0.05"]);
    let band = with_response(plan(&[]), |row| {
        (column(row, 0) > 30.0).then(|| row.to_string())
    });
    let foreign = DeviceNames {
        amplifier: "canopen 0x1-0x2".into(),
        probe: "simulated".into(),
    };
    let foreign = only_defect(&required(&plan(&[]), &foreign).expect_err("refused"));
    for (defect, words) in [
        (defect(&stale), "repeat `bench chirp`"),
        (
            defect(&load),
            "load the stage as in the chirp and set plant.mass_asymmetry to 0.1",
        ),
        (defect(&band), "with --start below 22."),
        (foreign, "connect that device"),
        (
            defect(&plan(&["control.min_modulus_margin=0.9"])),
            "--controller FILE",
        ),
    ] {
        let remedy = remedy(defect);
        assert!(remedy.contains(words), "{words}: {remedy}");
    }
}
