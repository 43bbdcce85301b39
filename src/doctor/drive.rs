//! The CANopen drive: is it the configured one, and would it take the configured run?

use bench_hal::can::cia402::{CYCLIC_TORQUE, REMOTE, State};
use bench_hal::can::drive::{ABORT_CONNECTION, DriveSettings, Inspection};
use bench_hal::can::emcy;
use bench_hal::can::scale::{Reference, Scale};
use serde::Serialize;

use super::finding::Finding;

const SUBJECT: &str = "drive";
/// The device profile of drives, in the lower half of 0x1000.
const DRIVES: u32 = 402;

/// What the drive says of itself; `null` where it does not.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DriveFigures {
    /// Its name.
    pub name: Option<String>,
    /// Vendor, product, revision and serial number.
    pub identity: [Option<u32>; 4],
    /// Statusword.
    pub statusword: Option<u16>,
    /// Error register.
    pub error_register: Option<u8>,
    /// Supported modes, bit n - 1 is mode n.
    pub modes: Option<u32>,
    /// Rated current in amperes.
    pub rated_current_a: Option<f64>,
    /// Codes of past errors, the latest first.
    pub past_errors: Vec<u16>,
}

/// The figures of an inspection.
pub fn figures(seen: &Inspection) -> DriveFigures {
    DriveFigures {
        name: seen.name.clone(),
        identity: seen.identity,
        statusword: seen.statusword,
        error_register: seen.error_register,
        modes: seen.modes,
        rated_current_a: seen.rated_current_a,
        past_errors: seen.past_errors.clone(),
    }
}

/// What an inspection means for a run with these settings; `maximum_ratio` is the configured one of 0x6072.
pub fn findings(seen: &Inspection, settings: &DriveSettings, maximum_ratio: f64) -> Vec<Finding> {
    let mut findings = vec![identity(seen, settings)];
    findings.extend(profile(seen));
    findings.push(rated_current(seen, settings));
    findings.extend(scale(seen, settings, maximum_ratio));
    findings.push(mode(seen, settings));
    findings.extend(watch(seen, settings));
    findings.extend(state(seen));
    findings.extend(errors(seen));
    findings
}

fn identity(seen: &Inspection, settings: &DriveSettings) -> Finding {
    let expected = [
        settings.identity.vendor,
        settings.identity.product,
        settings.identity.revision,
        settings.identity.serial,
    ];
    let fields = ["vendor", "product", "revision", "serial"];
    let number =
        |number: Option<u32>| number.map_or("none".into(), |number| format!("0x{number:08X}"));
    let said: Vec<String> = fields
        .iter()
        .zip(seen.identity)
        .map(|(name, have)| format!("{name} {}", number(have)))
        .collect();
    let name = seen.name.as_deref().unwrap_or("without a name");
    let what = format!("node {} is {name}: {}", settings.node, said.join(", "));
    let wrong = fields
        .iter()
        .zip(expected)
        .zip(seen.identity)
        .find(|((_, want), have)| want.is_some() && want != have);
    match wrong {
        Some(((field, want), _)) => Finding::failure(
            SUBJECT,
            format!("{what}; the configuration says {field} {}", number(want)),
            "connect the right drive, or correct amplifier.device.identity",
        ),
        None if seen.identity[0].is_none() => Finding::failure(
            SUBJECT,
            format!("{what}; every CANopen node must tell its vendor"),
            "is this a CANopen drive?",
        ),
        None => Finding::ok(SUBJECT, what),
    }
}

fn profile(seen: &Inspection) -> Option<Finding> {
    let profile = seen.device_type? & 0xFFFF;
    let what = format!("it keeps device profile {profile}, drives keep {DRIVES}");
    (profile != DRIVES).then(|| {
        Finding::warning(
            SUBJECT,
            what,
            "is this the node of the drive? See amplifier.device.node",
        )
    })
}

/// The driver refuses a difference of half a milliampere, the step of 0x6075.
fn rated_current(seen: &Inspection, settings: &DriveSettings) -> Finding {
    let (node, want_a) = (settings.node, settings.rated_current_a);
    match seen.rated_current_a {
        Some(have_a) if (have_a - want_a).abs() < 0.5e-3 => {
            Finding::ok(SUBJECT, format!("rated current {have_a} A, as configured"))
        }
        Some(have_a) => Finding::failure(
            SUBJECT,
            format!(
                "the rated current (0x6075) is {have_a} A, the configuration says {want_a} A: every ampere would be wrong"
            ),
            "correct amplifier.device.rated_current_a, or the drive by its commissioning program",
        ),
        None => Finding::failure(
            SUBJECT,
            format!("node {node} does not tell its rated current (0x6075)"),
            "commission its motor first: without it nobody knows what a count is",
        ),
    }
}

/// The step of the current and its limit.
fn scale(seen: &Inspection, settings: &DriveSettings, maximum_ratio: f64) -> Option<Finding> {
    let rated_a = seen.rated_current_a?;
    let limit_a = settings.current_limit_a;
    let reference_a = match settings.reference {
        Reference::Rated => rated_a,
        Reference::Maximum => match maximum(seen.maximum_current_ratio, maximum_ratio) {
            Ok(ratio) => rated_a * ratio,
            Err(finding) => return Some(finding),
        },
    };
    Some(match Scale::new(reference_a, limit_a) {
        Some(scale) => Finding::ok(
            SUBJECT,
            format!(
                "a count is {:.3} mA, commands end at {limit_a} A",
                scale.step_a() * 1e3
            ),
        ),
        None => Finding::failure(
            SUBJECT,
            format!("a count is {reference_a} mA, more than the limit of {limit_a} A"),
            "raise amplifier.current_limit_a",
        ),
    })
}

/// The maximum that the target refers to, as a ratio of the rated current.
fn maximum(said: Option<f64>, configured: f64) -> Result<f64, Finding> {
    match said {
        Some(ratio) if (ratio - configured).abs() < 0.5e-3 => Ok(ratio),
        Some(ratio) => Err(Finding::warning(
            SUBJECT,
            format!(
                "the maximum (0x6072) is {ratio} of the rated current, the configuration says {configured}"
            ),
            "correct amplifier.device.maximum_current_ratio: the step of the current follows from it",
        )),
        None => Err(Finding::failure(
            SUBJECT,
            "it does not tell the maximum (0x6072) that its target refers to",
            "commission it first, or set amplifier.device.target_reference",
        )),
    }
}

fn mode(seen: &Inspection, settings: &DriveSettings) -> Finding {
    let Some(supported) = seen.modes else {
        let remedy = "none: the run sets a mode and looks whether the drive took it";
        return Finding::note(
            SUBJECT,
            "it does not tell its modes of operation (0x6502)",
            remedy,
        );
    };
    match settings.mode.choose(supported) {
        Some(CYCLIC_TORQUE) => Finding::ok(
            SUBJECT,
            "it would run in cyclic synchronous torque (mode 10)",
        ),
        Some(mode) => Finding::ok(
            SUBJECT,
            format!("it would run in profile torque (mode {mode}), with its slope"),
        ),
        None => Finding::failure(
            SUBJECT,
            format!("it has none of the configured modes (0x6502 is 0x{supported:08X})"),
            "set amplifier.device.mode to one that it has: bit 9 is cyclic synchronous torque, bit 3 profile torque",
        ),
    }
}

/// Without these objects it would not stop when nobody is left to stop it.
fn watch(seen: &Inspection, settings: &DriveSettings) -> Option<Finding> {
    let needed =
        |address: &&_| settings.abort_connection.is_some() || **address != ABORT_CONNECTION;
    let lacking: Vec<String> = seen
        .missing_objects
        .iter()
        .filter(needed)
        .map(|address| address.to_string())
        .collect();
    let remedy = "choose a drive that watches its master; where only 0x6007 is missing, prove by unplugging the bus that it \
                  stops, then set amplifier.device.when_unheard = \"own_reaction\"";
    let what = || {
        format!(
            "it lacks {}: it would not stop when it no longer hears us",
            lacking.join(", ")
        )
    };
    (!lacking.is_empty()).then(|| Finding::failure(SUBJECT, what(), remedy))
}

fn state(seen: &Inspection) -> Vec<Finding> {
    let Some(statusword) = seen.statusword else {
        let remedy = "is this a drive of CiA 402? See amplifier.device.node";
        return vec![Finding::failure(
            SUBJECT,
            "it has no statusword (0x6041)",
            remedy,
        )];
    };
    let remote = (statusword & REMOTE == 0).then(|| {
        let what = format!("it says that it does not listen to CAN (statusword 0x{statusword:04X}, bit 9)");
        let remedy = "switch it from local to remote, and close its commissioning program; some drives say so only until \
                      the run has made them operational";
        Finding::warning(SUBJECT, what, remedy)
    });
    [of_state(statusword)].into_iter().chain(remote).collect()
}

fn of_state(statusword: u16) -> Finding {
    let say = |words: &str| format!("state {words} (statusword 0x{statusword:04X})");
    let fault = "remove the cause (error register and past errors tell), then clear the fault with the drive's own \
                 program or by switching its supply off and on";
    match State::decode(statusword) {
        Some(State::SwitchOnDisabled) => Finding::ok(SUBJECT, say("switch on disabled: off")),
        Some(State::ReadyToSwitchOn) => Finding::ok(SUBJECT, say("ready to switch on: off")),
        Some(State::SwitchedOn) => Finding::ok(SUBJECT, say("switched on: no current")),
        Some(State::NotReadyToSwitchOn) => Finding::warning(
            SUBJECT,
            say("not ready to switch on: it is starting"),
            "wait, and check the supply of its power stage",
        ),
        Some(State::OperationEnabled) => Finding::warning(
            SUBJECT,
            say("operation enabled, and not by this program"),
            "end what drives it; a run would switch it off first",
        ),
        Some(State::QuickStopActive) => Finding::warning(
            SUBJECT,
            say("quick stop"),
            "find out what stopped it; a run would switch it off first",
        ),
        Some(State::FaultReactionActive) => Finding::failure(SUBJECT, say("fault reaction"), fault),
        Some(State::Fault) => Finding::failure(SUBJECT, say("FAULT"), fault),
        None => Finding::failure(
            SUBJECT,
            say("that no standard knows"),
            "is this a drive of CiA 402?",
        ),
    }
}

fn errors(seen: &Inspection) -> Vec<Finding> {
    let register = seen
        .error_register
        .filter(|register| *register != 0)
        .map(|register| {
            let words: Vec<&str> = emcy::register_names(register).collect();
            let what = format!("error register 0x{register:02X}: {}", words.join(", "));
            Finding::warning(
                SUBJECT,
                what,
                "the drive's manual says more; an error that is over clears the register",
            )
        });
    let past: Vec<String> = seen
        .past_errors
        .iter()
        .map(|code| format!("0x{code:04X} {}", emcy::text(*code)))
        .collect();
    let past = (!past.is_empty()).then(|| {
        let what = format!("past errors, the latest first: {}", past.join(", "));
        Finding::note(
            SUBJECT,
            what,
            "none if you know them; writing 0 to 0x1003 forgets them",
        )
    });
    register.into_iter().chain(past).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Note, Warning};
    use bench_hal::can::drive::{ExpectedIdentity, REQUIRED_OBJECTS, TorqueMode};

    fn sound() -> Inspection {
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

    fn bad(seen: Inspection, settings: &DriveSettings) -> Vec<(Severity, String)> {
        let found = findings(&seen, settings, 1.5).into_iter();
        found
            .filter(|finding| finding.verdict != Severity::Ok)
            .map(|finding| (finding.verdict, finding.what))
            .collect()
    }

    #[test]
    fn a_sound_drive_is_ok_in_everything() {
        assert_eq!(bad(sound(), &DriveSettings::default()), []);
        let maximum = DriveSettings {
            reference: Reference::Maximum,
            ..DriveSettings::default()
        };
        let found = findings(&sound(), &maximum, 1.5);
        assert!(
            found
                .iter()
                .any(|f| f.what == "a count is 6.000 mA, commands end at 4 A"),
            "{found:?}"
        );
    }

    #[test]
    fn each_trouble_of_a_drive_has_its_verdict_and_words() {
        let cases = [
            (
                Inspection {
                    rated_current_a: Some(2.0),
                    ..sound()
                },
                Failure,
                "is 2 A, the configuration says 4 A",
            ),
            (
                Inspection {
                    rated_current_a: None,
                    ..sound()
                },
                Failure,
                "0x6075",
            ),
            (
                Inspection {
                    modes: Some(1),
                    ..sound()
                },
                Failure,
                "0x6502 is 0x00000001",
            ),
            (
                Inspection {
                    modes: None,
                    ..sound()
                },
                Note,
                "0x6502",
            ),
            (
                Inspection {
                    statusword: Some(0x0208),
                    ..sound()
                },
                Failure,
                "FAULT (statusword 0x0208)",
            ),
            (
                Inspection {
                    statusword: Some(0x020F),
                    ..sound()
                },
                Failure,
                "fault reaction",
            ),
            (
                Inspection {
                    statusword: Some(0x0237),
                    ..sound()
                },
                Warning,
                "operation enabled",
            ),
            (
                Inspection {
                    statusword: Some(0x0217),
                    ..sound()
                },
                Warning,
                "quick stop",
            ),
            (
                Inspection {
                    statusword: Some(0x0200),
                    ..sound()
                },
                Warning,
                "starting",
            ),
            (
                Inspection {
                    statusword: Some(0x0248),
                    ..sound()
                },
                Failure,
                "no standard knows",
            ),
            (
                Inspection {
                    statusword: Some(0x0040),
                    ..sound()
                },
                Warning,
                "does not listen to CAN",
            ),
            (
                Inspection {
                    statusword: None,
                    ..sound()
                },
                Failure,
                "0x6041",
            ),
            (
                Inspection {
                    error_register: Some(0x09),
                    ..sound()
                },
                Warning,
                "0x09: generic, temperature",
            ),
            (
                Inspection {
                    past_errors: vec![0x4210, 0x8130],
                    ..sound()
                },
                Note,
                "0x4210 drive too hot, 0x8130 heartbeat",
            ),
            (
                Inspection {
                    missing_objects: vec![ABORT_CONNECTION],
                    ..sound()
                },
                Failure,
                "lacks 0x6007:00",
            ),
            (
                Inspection {
                    device_type: Some(0x0001_0191),
                    ..sound()
                },
                Warning,
                "profile 401",
            ),
            (
                Inspection {
                    identity: [None; 4],
                    ..sound()
                },
                Failure,
                "vendor",
            ),
        ];
        for (seen, verdict, words) in cases {
            let found = bad(seen.clone(), &DriveSettings::default());
            assert_eq!(
                (found.len(), found[0].0),
                (1, verdict),
                "{seen:?}: {found:?}"
            );
            assert!(found[0].1.contains(words), "{}: {words}", found[0].1);
        }
    }

    #[test]
    fn another_drive_than_configured_is_refused_by_the_field_that_differs() {
        for (identity, words) in [
            (
                ExpectedIdentity {
                    vendor: Some(7),
                    ..ExpectedIdentity::default()
                },
                "says vendor 0x00000007",
            ),
            (
                ExpectedIdentity {
                    serial: Some(4),
                    ..ExpectedIdentity::default()
                },
                "says serial 0x00000004",
            ),
        ] {
            let found = bad(
                sound(),
                &DriveSettings {
                    identity,
                    ..DriveSettings::default()
                },
            );
            assert_eq!(found.len(), 1);
            assert!(
                found[0].0 == Failure && found[0].1.contains(words),
                "{found:?}"
            );
        }
        let same = ExpectedIdentity {
            vendor: Some(0x402),
            serial: Some(3),
            ..ExpectedIdentity::default()
        };
        assert_eq!(
            bad(
                sound(),
                &DriveSettings {
                    identity: same,
                    ..DriveSettings::default()
                }
            ),
            []
        );
    }

    #[test]
    fn what_only_some_settings_need_is_only_then_missed() {
        let own = DriveSettings {
            abort_connection: None,
            ..DriveSettings::default()
        };
        assert_eq!(
            bad(
                Inspection {
                    missing_objects: vec![ABORT_CONNECTION],
                    ..sound()
                },
                &own
            ),
            []
        );
        assert_eq!(
            bad(
                Inspection {
                    missing_objects: REQUIRED_OBJECTS.to_vec(),
                    ..sound()
                },
                &own
            )[0]
            .0,
            Failure
        );
        let maximum = DriveSettings {
            reference: Reference::Maximum,
            ..DriveSettings::default()
        };
        assert_eq!(
            bad(
                Inspection {
                    maximum_current_ratio: None,
                    ..sound()
                },
                &maximum
            )[0]
            .0,
            Failure
        );
        assert_eq!(
            bad(
                Inspection {
                    maximum_current_ratio: Some(2.0),
                    ..sound()
                },
                &maximum
            )[0]
            .0,
            Warning
        );
        let cyclic = DriveSettings {
            mode: TorqueMode::Cyclic,
            ..DriveSettings::default()
        };
        assert_eq!(
            bad(
                Inspection {
                    modes: Some(1 << 3),
                    ..sound()
                },
                &cyclic
            )[0]
            .0,
            Failure
        );
        let tiny = DriveSettings {
            current_limit_a: 0.001,
            ..DriveSettings::default()
        };
        assert!(bad(sound(), &tiny)[0].1.contains("a count is 4 mA"));
    }
}
