//! The CANopen drive: whether it is the configured one and accepts the configured run.

use bench_hal::can::cia402::{CYCLIC_TORQUE, REMOTE, State};
use bench_hal::can::drive::{ABORT_CONNECTION, DriveSettings, Inspection};
use bench_hal::can::emcy;
use bench_hal::can::scale::{Reference, Scale};
use bench_hal::can::sdo::Address;
use serde::Serialize;

use super::finding::{Finding, Subject};

const DRIVE: Subject = Subject::Drive;
/// The device profile of drives, in the lower 16 bits of 0x1000.
const DRIVE_PROFILE: u32 = 402;
/// Half the resolution of 0x6075 and 0x6072. The driver refuses larger differences.
const TOLERANCE: f64 = 0.5e-3;

/// Properties that the drive reports; `null` for objects that it does not have.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DriveFigures {
    /// Name.
    pub name: Option<String>,
    /// Vendor, product, revision and serial number.
    pub identity: [Option<u32>; 4],
    /// Statusword.
    pub statusword: Option<u16>,
    /// Error register.
    pub error_register: Option<u8>,
    /// Supported modes; bit n - 1 is mode n.
    pub modes: Option<u32>,
    /// Rated current in amperes.
    pub rated_current_a: Option<f64>,
    /// Codes of past errors, the latest first.
    pub past_errors: Vec<u16>,
}

/// The figures of an inspection.
pub fn figures(inspection: &Inspection) -> DriveFigures {
    DriveFigures {
        name: inspection.name.clone(),
        identity: inspection.identity,
        statusword: inspection.statusword,
        error_register: inspection.error_register,
        modes: inspection.modes,
        rated_current_a: inspection.rated_current_a,
        past_errors: inspection.past_errors.clone(),
    }
}

/// Evaluates an inspection for a run with these settings; `maximum_ratio` is the configured value of 0x6072.
pub fn findings(
    inspection: &Inspection,
    settings: &DriveSettings,
    maximum_ratio: f64,
) -> Vec<Finding> {
    let mut findings = vec![identity(inspection, settings)];
    findings.extend(inspection.device_type.and_then(profile));
    findings.push(rated_current(inspection.rated_current_a, settings));
    findings.extend(resolution(inspection, settings, maximum_ratio));
    findings.push(mode(inspection.modes, settings));
    findings.extend(missing_objects(inspection, settings));
    findings.extend(state(inspection.statusword));
    findings.extend(inspection.error_register.and_then(error_register));
    findings.extend(past_errors(&inspection.past_errors));
    findings
}

fn identity(inspection: &Inspection, settings: &DriveSettings) -> Finding {
    let expected = &settings.identity;
    let [vendor, product, revision, serial] = inspection.identity;
    let fields = [
        ("vendor", vendor, expected.vendor),
        ("product", product, expected.product),
        ("revision", revision, expected.revision),
        ("serial", serial, expected.serial),
    ];
    let name = inspection.name.as_deref().unwrap_or("without a name");
    let actual = fields.map(|(field, actual, _)| format!("{field} {}", hexadecimal(actual)));
    let what = format!("node {} is {name}: {}", settings.node, actual.join(", "));
    if let Some(difference) = identity_difference(fields) {
        let remedy = "connect the right drive, or correct amplifier.device.identity";
        return DRIVE.failure(format!("{what}; {difference}"), remedy);
    }
    if vendor.is_none() {
        let what = format!("{what}; every CANopen node must report its vendor");
        return DRIVE.failure(what, "check that this is a CANopen drive");
    }
    DRIVE.ok(what)
}

/// The first configured field (name, actual value, configured value) that the drive reports differently.
fn identity_difference(fields: [(&str, Option<u32>, Option<u32>); 4]) -> Option<String> {
    let mut fields = fields.into_iter();
    let differs =
        |&(_, actual, expected): &(_, _, Option<u32>)| expected.is_some() && actual != expected;
    let (field, _, expected) = fields.find(differs)?;
    let expected = hexadecimal(expected);
    Some(format!("the configuration states {field} {expected}"))
}

fn hexadecimal(number: Option<u32>) -> String {
    match number {
        Some(number) => format!("0x{number:08X}"),
        None => "none".into(),
    }
}

fn profile(device_type: u32) -> Option<Finding> {
    let profile = device_type & 0xFFFF;
    let what = format!("device profile {profile} instead of {DRIVE_PROFILE} (drives)");
    let remedy = "check that amplifier.device.node is the node of the drive";
    (profile != DRIVE_PROFILE).then(|| DRIVE.warning(what, remedy))
}

fn rated_current(actual_a: Option<f64>, settings: &DriveSettings) -> Finding {
    let (node, configured_a) = (settings.node, settings.rated_current_a);
    let Some(actual_a) = actual_a else {
        let what = format!("node {node} does not report its rated current (0x6075)");
        let remedy = "commission its motor first: the scale of the current depends on it";
        return DRIVE.failure(what, remedy);
    };
    if (actual_a - configured_a).abs() < TOLERANCE {
        return DRIVE.ok(format!("rated current {actual_a} A, as configured"));
    }
    DRIVE.failure(
        format!(
            "the rated current (0x6075) is {actual_a} A, but {configured_a} A is configured: every current would be wrong by the factor {:.3}",
            actual_a / configured_a
        ),
        "correct amplifier.device.rated_current_a, or the drive with its commissioning program",
    )
}

/// The resolution of the current and its limit.
fn resolution(
    inspection: &Inspection,
    settings: &DriveSettings,
    maximum_ratio: f64,
) -> Option<Finding> {
    let rated_a = inspection.rated_current_a?;
    let reference_a = match settings.reference {
        Reference::Rated => rated_a,
        Reference::Maximum => match maximum(inspection.maximum_current_ratio, maximum_ratio) {
            Ok(ratio) => rated_a * ratio,
            Err(finding) => return Some(finding),
        },
    };
    Some(count(reference_a, settings.current_limit_a))
}

fn count(reference_a: f64, limit_a: f64) -> Finding {
    let Some(scale) = Scale::new(reference_a, limit_a) else {
        let what = format!("a count is {reference_a} mA, more than the limit of {limit_a} A");
        return DRIVE.failure(what, "raise amplifier.current_limit_a");
    };
    let count_ma = scale.step_a() * 1e3;
    DRIVE.ok(format!(
        "resolution of the current {count_ma:.3} mA per count, current limit {limit_a} A"
    ))
}

/// The maximum that the target refers to, as a ratio of the rated current.
fn maximum(actual: Option<f64>, configured: f64) -> Result<f64, Finding> {
    match actual {
        Some(ratio) if (ratio - configured).abs() < TOLERANCE => Ok(ratio),
        Some(ratio) => Err(DRIVE.warning(
            format!("the maximum (0x6072) is {ratio} of the rated current, but {configured} is configured"),
            "correct amplifier.device.maximum_current_ratio: the resolution of the current depends on it",
        )),
        None => Err(DRIVE.failure(
            "the drive does not report the maximum (0x6072) that its target refers to",
            "commission it first, or set amplifier.device.target_reference",
        )),
    }
}

fn mode(supported: Option<u32>, settings: &DriveSettings) -> Finding {
    let Some(supported) = supported else {
        return DRIVE.note(
            "the drive does not report its modes of operation (0x6502)",
            "none: the run sets a mode and checks that the drive accepts it",
        );
    };
    match settings.mode.choose(supported) {
        Some(CYCLIC_TORQUE) => DRIVE.ok("mode of a run: cyclic synchronous torque (10)"),
        Some(mode) => DRIVE.ok(format!(
            "mode of a run: profile torque ({mode}), whose torque slope (0x6087) limits the rate of the current"
        )),
        None => DRIVE.failure(
            format!("the drive has none of the configured modes (0x6502 is 0x{supported:08X})"),
            MODE_REMEDY,
        ),
    }
}

const MODE_REMEDY: &str = "set amplifier.device.mode to a mode of the drive: bit 9 is cyclic synchronous torque, bit 3 profile torque";

/// Without these objects the drive does not stop when communication is lost.
fn missing_objects(inspection: &Inspection, settings: &DriveSettings) -> Option<Finding> {
    let is_needed =
        |address: &Address| settings.abort_connection.is_some() || *address != ABORT_CONNECTION;
    let missing = inspection.missing_objects.iter();
    let missing = missing.filter(|address| is_needed(address));
    let missing: Vec<String> = missing.map(|address| address.to_string()).collect();
    if missing.is_empty() {
        return None;
    }
    let missing = missing.join(", ");
    let what = format!("the drive lacks {missing}: it would not stop when communication is lost");
    Some(DRIVE.failure(what, MISSING_OBJECTS_REMEDY))
}

const MISSING_OBJECTS_REMEDY: &str = "choose a drive that monitors its master; if only 0x6007 is missing, unplug the bus \
    to verify that the drive stops, then set amplifier.device.on_communication_loss = \"own_reaction\"";

fn state(statusword: Option<u16>) -> Vec<Finding> {
    let Some(statusword) = statusword else {
        let remedy = "check that amplifier.device.node is a drive (CiA 402)";
        return vec![DRIVE.failure("the drive has no statusword (0x6041)", remedy)];
    };
    let mut findings = vec![power_state(statusword)];
    if statusword & REMOTE == 0 {
        findings.push(DRIVE.warning(
            format!("the drive does not accept commands from CAN (statusword 0x{statusword:04X}, bit 9)"),
            "switch it from local to remote, and close its commissioning program; some drives report this only until \
             the run has made them operational",
        ));
    }
    findings
}

fn power_state(statusword: u16) -> Finding {
    let state = State::decode(statusword);
    let what = format!(
        "state {} (statusword 0x{statusword:04X})",
        state_text(state)
    );
    match state {
        Some(State::SwitchOnDisabled | State::ReadyToSwitchOn | State::SwitchedOn) => {
            DRIVE.ok(what)
        }
        Some(State::NotReadyToSwitchOn) => {
            DRIVE.warning(what, "wait, and check the supply of its power stage")
        }
        Some(State::OperationEnabled) => {
            let remedy = "end the program that drives it; a run would switch it off first";
            DRIVE.warning(what, remedy)
        }
        Some(State::QuickStopActive) => {
            let remedy = "find out what stopped it; a run would switch it off first";
            DRIVE.warning(what, remedy)
        }
        Some(State::FaultReactionActive | State::Fault) => DRIVE.failure(what, FAULT_REMEDY),
        None => DRIVE.failure(what, "check that this is a drive (CiA 402)"),
    }
}

const FAULT_REMEDY: &str = "remove the cause (see error register and past errors), then clear the fault with the program of \
    the drive or by switching its supply off and on";

fn state_text(state: Option<State>) -> &'static str {
    match state {
        Some(State::SwitchOnDisabled) => "switch on disabled",
        Some(State::ReadyToSwitchOn) => "ready to switch on",
        Some(State::SwitchedOn) => "switched on, without current",
        Some(State::NotReadyToSwitchOn) => "not ready to switch on, the drive is starting",
        Some(State::OperationEnabled) => "operation enabled, by another program",
        Some(State::QuickStopActive) => "quick stop",
        Some(State::FaultReactionActive) => "fault reaction",
        Some(State::Fault) => "FAULT",
        None => "undefined by CiA 402",
    }
}

fn error_register(register: u8) -> Option<Finding> {
    if register == 0 {
        return None;
    }
    let names: Vec<&str> = emcy::register_names(register).collect();
    Some(DRIVE.warning(
        format!("error register 0x{register:02X}: {}", names.join(", ")),
        "see the manual of the drive; the register is cleared when the error is over",
    ))
}

fn past_errors(codes: &[u16]) -> Option<Finding> {
    if codes.is_empty() {
        return None;
    }
    let errors = codes.iter();
    let errors = errors.map(|code| format!("0x{code:04X} {}", emcy::text(*code)));
    let errors: Vec<String> = errors.collect();
    Some(DRIVE.note(
        format!("past errors, the latest first: {}", errors.join(", ")),
        "none, if the errors are known; writing 0 to 0x1003 clears the list",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Note, Warning};
    use bench_hal::can::drive::{ExpectedIdentity, REQUIRED_OBJECTS, TorqueMode};

    fn healthy() -> Inspection {
        Inspection {
            device_type: Some(0x0002_0192),
            name: Some("a drive".into()),
            identity: [Some(0x402), Some(1), Some(2), Some(3)],
            error_register: Some(0),
            statusword: Some(0x0240),
            modes: Some(1 << 9 | 1 << 3),
            rated_current_a: Some(4.0),
            maximum_current_ratio: Some(1.5),
            past_errors: vec![],
            missing_objects: vec![],
        }
    }

    fn not_ok(inspection: &Inspection, settings: &DriveSettings) -> Vec<(Severity, String)> {
        let found = findings(inspection, settings, 1.5).into_iter();
        found
            .filter(|finding| finding.severity != Severity::Ok)
            .map(|finding| (finding.severity, finding.what))
            .collect()
    }

    fn settings(change: fn(&mut DriveSettings)) -> DriveSettings {
        let mut settings = DriveSettings::default();
        change(&mut settings);
        settings
    }

    fn maximum_reference() -> DriveSettings {
        settings(|s| s.reference = Reference::Maximum)
    }

    #[test]
    fn a_healthy_drive_is_ok() {
        assert_eq!(not_ok(&healthy(), &DriveSettings::default()), []);
        let found = findings(&healthy(), &maximum_reference(), 1.5);
        let expected = "resolution of the current 6.000 mA per count, current limit 4 A";
        assert!(found.iter().any(|f| f.what == expected), "{found:?}");
    }

    #[test]
    fn each_defect_of_a_drive_has_its_severity_and_text() {
        type Change = fn(&mut Inspection);
        let cases: [(Change, Severity, &str); 17] = [
            (
                |i| i.rated_current_a = Some(2.0),
                Failure,
                "is 2 A, but 4 A is configured: every current would be wrong by the factor 0.500",
            ),
            (|i| i.rated_current_a = None, Failure, "0x6075"),
            (|i| i.modes = Some(1), Failure, "0x6502 is 0x00000001"),
            (|i| i.modes = None, Note, "0x6502"),
            (
                |i| i.statusword = Some(0x0208),
                Failure,
                "FAULT (statusword 0x0208)",
            ),
            (|i| i.statusword = Some(0x020F), Failure, "fault reaction"),
            (
                |i| i.statusword = Some(0x0237),
                Warning,
                "operation enabled",
            ),
            (|i| i.statusword = Some(0x0217), Warning, "quick stop"),
            (|i| i.statusword = Some(0x0200), Warning, "starting"),
            (|i| i.statusword = Some(0x0248), Failure, "undefined"),
            (
                |i| i.statusword = Some(0x0040),
                Warning,
                "does not accept commands from CAN",
            ),
            (|i| i.statusword = None, Failure, "0x6041"),
            (|i| i.error_register = Some(0x09), Warning, "0x09: generic"),
            (
                |i| i.past_errors = vec![0x4210, 0x8130],
                Note,
                "latest first: 0x4210 ",
            ),
            (
                |i| i.missing_objects = vec![ABORT_CONNECTION],
                Failure,
                "lacks 0x6007:00",
            ),
            (
                |i| i.device_type = Some(0x0001_0191),
                Warning,
                "profile 401",
            ),
            (|i| i.identity = [None; 4], Failure, "vendor"),
        ];
        for (change, severity, text) in cases {
            let mut inspection = healthy();
            change(&mut inspection);
            let found = not_ok(&inspection, &DriveSettings::default());
            assert_eq!(found.len(), 1, "{inspection:?}: {found:?}");
            assert_eq!(found[0].0, severity, "{found:?}");
            assert!(found[0].1.contains(text), "{}: {text}", found[0].1);
        }
    }

    #[test]
    fn another_drive_is_refused_with_the_field_that_differs() {
        let with = |identity| DriveSettings {
            identity,
            ..DriveSettings::default()
        };
        let vendor = ExpectedIdentity {
            vendor: Some(7),
            ..ExpectedIdentity::default()
        };
        let serial = ExpectedIdentity {
            serial: Some(4),
            ..ExpectedIdentity::default()
        };
        for (identity, text) in [
            (vendor, "states vendor 0x00000007"),
            (serial, "states serial 0x00000004"),
        ] {
            let found = not_ok(&healthy(), &with(identity));
            assert_eq!(found.len(), 1);
            assert!(
                found[0].0 == Failure && found[0].1.contains(text),
                "{found:?}"
            );
        }
        let same = ExpectedIdentity {
            vendor: Some(0x402),
            serial: Some(3),
            ..ExpectedIdentity::default()
        };
        assert_eq!(not_ok(&healthy(), &with(same)), []);
    }

    #[test]
    fn objects_are_required_only_if_the_settings_need_them() {
        let mut inspection = healthy();
        let own_reaction = settings(|s| s.abort_connection = None);
        inspection.missing_objects = vec![ABORT_CONNECTION];
        assert_eq!(not_ok(&inspection, &own_reaction), []);
        inspection.missing_objects = REQUIRED_OBJECTS.to_vec();
        assert_eq!(not_ok(&inspection, &own_reaction)[0].0, Failure);
    }

    #[test]
    fn maximum_and_mode_must_fit_the_settings() {
        let mut inspection = healthy();
        inspection.maximum_current_ratio = None;
        assert_eq!(not_ok(&inspection, &maximum_reference())[0].0, Failure);
        inspection.maximum_current_ratio = Some(2.0);
        assert_eq!(not_ok(&inspection, &maximum_reference())[0].0, Warning);
        let mut inspection = healthy();
        inspection.modes = Some(1 << 3);
        let cyclic = settings(|s| s.mode = TorqueMode::Cyclic);
        assert_eq!(not_ok(&inspection, &cyclic)[0].0, Failure);
        let tiny = settings(|s| s.current_limit_a = 0.001);
        assert!(not_ok(&healthy(), &tiny)[0].1.contains("a count is 4 mA"));
    }
}
