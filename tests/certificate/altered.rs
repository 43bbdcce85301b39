//! Certificates with a change, and the defects for which they are refused.

use std::time::{Duration, SystemTime};

use bench_experiment::certificate::{CertificateError, sha256};
use bench_experiment::evidence::{Evidence, OpenRig, require_evidence};
use bench_experiment::{DeviceNames, ExperimentError, Plan, Stage};
use serde_json::{Value, json};

/// The devices with which the certificate was made.
pub fn simulated() -> DeviceNames {
    DeviceNames {
        amplifier: "simulated".into(),
        probe: "simulated".into(),
    }
}

pub fn required(plan: &Plan, devices: &DeviceNames) -> Result<Evidence, ExperimentError> {
    let rig = OpenRig {
        devices,
        calibration: None,
    };
    require_evidence(plan, Stage::Devices, Some(rig))
}

/// The defect for which a plan is refused on devices. It is only reported on the simulated stage, and with an override.
pub fn defect(plan: &Plan) -> CertificateError {
    let rig = OpenRig {
        devices: &simulated(),
        calibration: None,
    };
    let error = required(plan, &simulated()).expect_err("refused");
    let reported = require_evidence(plan, Stage::Simulated, Some(rig)).expect("only reported");
    assert!(!reported.defects.is_empty() || plan.certificate.is_none());
    let reason = "a reason of an operator".parse().expect("long enough");
    let overridden = plan.clone().with_override(Some(reason));
    let evidence = required(&overridden, &simulated()).expect("overridden");
    assert!(!evidence.defects.is_empty());
    assert_eq!(
        evidence.override_reason.as_deref(),
        Some("a reason of an operator")
    );
    let text = error.to_string();
    assert!(
        text.contains("; ") && text.contains("--override") && text.ends_with("nothing was moved"),
        "{text}"
    );
    only_defect(&error)
}

/// The defect of a refusal that has one.
pub fn only_defect(error: &ExperimentError) -> CertificateError {
    match defects(error) {
        [defect] => defect.clone(),
        several => panic!("{several:?}"),
    }
}

pub fn defects(error: &ExperimentError) -> &[CertificateError] {
    match error {
        ExperimentError::Certificate(defects) => defects.as_slice(),
        other => panic!("{other}"),
    }
}

/// The plan with a changed certificate.
pub fn edited(mut plan: Plan, edit: impl FnOnce(&mut Value)) -> Plan {
    let text = plan.certificate.as_mut().expect("a certificate");
    let mut json: Value = serde_json::from_str(&text.json).expect("JSON");
    edit(&mut json);
    text.json = json.to_string();
    plan
}

/// The plan with a changed response, whose digest is that of the change.
pub fn with_response(mut plan: Plan, edit: impl Fn(&str) -> Option<String>) -> Plan {
    let text = plan.certificate.as_mut().expect("a certificate");
    let mut lines = text.frf_csv.lines();
    let header = lines.next().expect("a header").to_string();
    let rows = lines.filter_map(edit);
    text.frf_csv = std::iter::once(header)
        .chain(rows)
        .collect::<Vec<_>>()
        .join("\n")
        + "\n";
    let digest = sha256(&text.frf_csv);
    edited(plan, |json| json["frf"]["sha256"] = json!(digest))
}

pub fn column(row: &str, index: usize) -> f64 {
    row.split(',')
        .nth(index)
        .expect("a column")
        .parse()
        .expect("a number")
}

/// A row with another value in a column.
pub fn with_column(row: &str, index: usize, value: f64) -> String {
    let mut columns: Vec<String> = row.split(',').map(String::from).collect();
    columns[index] = value.to_string();
    columns.join(",")
}

pub fn date(offset_s: i64) -> Value {
    let now = SystemTime::now();
    let offset = Duration::from_secs(offset_s.unsigned_abs());
    let time = if offset_s < 0 {
        now - offset
    } else {
        now + offset
    };
    json!(humantime_text(time))
}

/// RFC 3339 with seconds, by the program of the system.
fn humantime_text(time: SystemTime) -> String {
    let seconds = time
        .duration_since(SystemTime::UNIX_EPOCH)
        .expect("after 1970")
        .as_secs();
    let output = std::process::Command::new("date")
        .args(["-u", "-d", &format!("@{seconds}"), "+%Y-%m-%dT%H:%M:%SZ"])
        .output()
        .expect("date of coreutils");
    String::from_utf8(output.stdout)
        .expect("text")
        .trim()
        .into()
}
