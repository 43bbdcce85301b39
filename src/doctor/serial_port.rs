//! The serial port of the probe: is it there, may it be opened, who holds it, and did it take its line?

use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use bench_hal::serial::{Note, SerialError};
use nix::unistd::{AccessFlags, Gid, Group, User, eaccess, getegid, geteuid, getgroups};

use super::finding::Finding;
use super::system::line;
use super::usb::Usb;
use crate::config::{LineSettings, Parity};
use crate::rig::devices::ProbeError;

const SUBJECT: &str = "serial port";
/// An adapter that collects bytes for longer is told, in milliseconds.
const SLOW_MS: u32 = 2;

/// What is known of a port before it is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortFacts {
    /// Its path in the configuration.
    pub path: PathBuf,
    /// What that stands for; `None` if there is nothing.
    pub device: Option<PathBuf>,
    /// Whether that is a character device, as terminals are.
    pub is_character_device: bool,
    /// Whether this process may read and write it.
    pub may_open: bool,
    /// Group that owns it.
    pub group: String,
    /// Permission bits.
    pub mode: u32,
    /// This user.
    pub user: String,
    /// This user's groups.
    pub groups: Vec<String>,
    /// Links below /dev/serial/by-id with what they stand for.
    pub by_id: Vec<(PathBuf, PathBuf)>,
    /// The USB adapter, if it is one.
    pub usb: Option<Usb>,
    /// Other processes that have it open, as far as this user may see them.
    pub holders: Vec<u32>,
}

/// Looks at the port of `line`; does not open it.
pub fn gather(line: &LineSettings) -> PortFacts {
    let path = PathBuf::from(&line.port);
    let by_id = links(Path::new("/dev/serial/by-id"));
    let (user, groups) = who_am_i();
    let unseen = PortFacts {
        path,
        by_id,
        user,
        groups,
        ..PortFacts::default()
    };
    let found = unseen
        .path
        .canonicalize()
        .ok()
        .and_then(|device| Some((device.metadata().ok()?, device)));
    let Some((metadata, device)) = found else {
        return unseen;
    };
    let name = device
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    PortFacts {
        is_character_device: metadata.file_type().is_char_device(),
        may_open: eaccess(&device, AccessFlags::R_OK | AccessFlags::W_OK).is_ok(),
        group: group_name(Gid::from_raw(metadata.gid())),
        mode: metadata.mode() & 0o777,
        usb: Usb::of(Path::new("/sys/class/tty"), &name),
        holders: holders(&device),
        device: Some(device),
        ..unseen
    }
}

fn links(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let entries = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path());
    let mut links: Vec<_> = entries
        .filter_map(|link| Some((link.clone(), link.canonicalize().ok()?)))
        .collect();
    links.sort();
    links
}

fn group_name(gid: Gid) -> String {
    Group::from_gid(gid)
        .ok()
        .flatten()
        .map_or_else(|| gid.to_string(), |group| group.name)
}

fn who_am_i() -> (String, Vec<String>) {
    let uid = geteuid();
    let user = User::from_uid(uid)
        .ok()
        .flatten()
        .map_or_else(|| uid.to_string(), |user| user.name);
    let mut groups: Vec<String> = getgroups()
        .unwrap_or_default()
        .into_iter()
        .map(group_name)
        .collect();
    groups.push(group_name(getegid()));
    groups.sort();
    groups.dedup();
    (user, groups)
}

/// Processes with `device` open. Those of other users are seen by root only.
fn holders(device: &Path) -> Vec<u32> {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids =
        processes.filter_map(|entry| entry.file_name().to_string_lossy().parse::<u32>().ok());
    pids.filter(|pid| *pid != std::process::id() && has_open(*pid, device))
        .collect()
}

fn has_open(pid: u32, device: &Path) -> bool {
    let files = std::fs::read_dir(format!("/proc/{pid}/fd"))
        .into_iter()
        .flatten()
        .flatten();
    files
        .filter_map(|file| std::fs::read_link(file.path()).ok())
        .any(|open| open == device)
}

/// What that means, before anything is opened.
pub fn findings(facts: &PortFacts) -> Vec<Finding> {
    let path = facts.path.display();
    let Some(device) = &facts.device else {
        return vec![missing(facts)];
    };
    if !facts.is_character_device {
        return vec![Finding::failure(
            SUBJECT,
            format!("{path} is no terminal"),
            there(facts),
        )];
    }
    if !facts.may_open {
        return vec![forbidden(facts, device)];
    }
    let link = facts
        .by_id
        .iter()
        .find(|(link, target)| target == device && *link != facts.path);
    let what = format!("{path} is there, and {} may open it", facts.user);
    vec![match link {
        Some((link, _)) => {
            let remedy = format!(
                "{} keeps its name when adapters are plugged in another order",
                link.display()
            );
            Finding::note(SUBJECT, what, remedy)
        }
        None => Finding::ok(SUBJECT, what),
    }]
}

fn missing(facts: &PortFacts) -> Finding {
    Finding::failure(
        SUBJECT,
        format!("there is no {}", facts.path.display()),
        there(facts),
    )
}

/// What could be named instead.
fn there(facts: &PortFacts) -> String {
    let links: Vec<String> = facts
        .by_id
        .iter()
        .map(|(link, _)| link.display().to_string())
        .collect();
    match links.is_empty() {
        true => "plug the adapter in (there is nothing in /dev/serial/by-id), or correct probe.device.line.port".into(),
        false => format!("set probe.device.line.port to one of {}", links.join(", ")),
    }
}

fn forbidden(facts: &PortFacts, device: &Path) -> Finding {
    let PortFacts {
        group, user, mode, ..
    } = facts;
    let groups = facts.groups.join(", ");
    let what = format!(
        "{user} may not open {}: group {group}, mode {mode:04o}; {user} is in {groups}",
        device.display()
    );
    // Nobody should join root's group for a port.
    let a_group = if group == "root" { "dialout" } else { group };
    let by_group = match mode & 0o060 == 0o060 && group != "root" && !facts.groups.contains(group) {
        true => format!("`sudo usermod -aG {group} {user}` and log in again"),
        false => {
            format!(
                "`sudo chgrp {a_group} {0} && sudo chmod g+rw {0}`, with {user} in {a_group}",
                device.display()
            )
        }
    };
    let by_rule = facts.usb.as_ref().map_or(String::new(), |usb| {
        format!(
            "; or put this line into /etc/udev/rules.d/70-bench.rules and plug the adapter in again: {}",
            usb.rule(a_group)
        )
    });
    Finding::failure(SUBJECT, what, by_group + &by_rule)
}

/// Why the probe could not be opened; what [`findings`] has said already is not said twice.
pub fn refusal(error: &ProbeError, facts: &PortFacts) -> Finding {
    let ProbeError::Serial(SerialError::PortInUse { pid, .. }) = error else {
        return Finding::refused(SUBJECT, error);
    };
    let pids: Vec<u32> = pid.map_or_else(|| facts.holders.clone(), |pid| vec![pid]);
    let name = |pid: &u32| {
        let name =
            line(format!("/proc/{pid}/comm")).map_or(String::new(), |name| format!(" ({name})"));
        format!("process {pid}{name}")
    };
    let path = facts.path.display();
    match pids.is_empty() {
        true => Finding::failure(
            SUBJECT,
            format!("{path} is held by another process"),
            format!(
                "`sudo fuser {path}` names it; end it first: two readers would take each other's bytes"
            ),
        ),
        false => Finding::failure(
            SUBJECT,
            format!(
                "{path} is held by {}",
                pids.iter().map(name).collect::<Vec<_>>().join(", ")
            ),
            "wait for its end, or end it: two readers would take each other's bytes",
        ),
    }
}

/// What an open port took, and what it did not.
pub fn opened(facts: &PortFacts, line: &LineSettings, notes: &[Note]) -> Vec<Finding> {
    let parity = match line.parity {
        Parity::None => "no",
        Parity::Even => "even",
    };
    let mut findings = vec![Finding::ok(
        SUBJECT,
        format!("opened at {} baud with {parity} parity", line.baud),
    )];
    findings.extend(
        notes
            .iter()
            .map(|note| Finding::note(SUBJECT, note.what.clone(), note.remedy)),
    );
    findings.extend(facts.usb.as_ref().and_then(latency));
    findings
}

fn latency(usb: &Usb) -> Option<Finding> {
    let ms = usb.latency_ms?;
    let what = format!("the adapter collects bytes for {ms} ms at the most");
    let remedy = "probe.device.line.low_latency = true asks for 1 ms; where that is refused, a udev rule with \
                  ATTR{latency_timer}=\"1\" does it";
    Some(if ms > SLOW_MS {
        Finding::warning(SUBJECT, what, remedy)
    } else {
        Finding::ok(SUBJECT, what)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{Failure, Note as Noted, Ok, Warning};

    fn sound() -> PortFacts {
        PortFacts {
            path: "/dev/ttyUSB0".into(),
            device: Some("/dev/ttyUSB0".into()),
            is_character_device: true,
            may_open: true,
            group: "dialout".into(),
            mode: 0o660,
            user: "ada".into(),
            groups: vec!["ada".into(), "users".into()],
            ..PortFacts::default()
        }
    }

    fn usb(latency_ms: Option<u32>) -> Option<Usb> {
        Some(Usb {
            vendor: "0403".into(),
            product: "6001".into(),
            serial: None,
            latency_ms,
        })
    }

    fn only(facts: &PortFacts) -> Finding {
        let mut found = findings(facts);
        assert_eq!(found.len(), 1, "{found:?}");
        found.remove(0)
    }

    #[test]
    fn permission_denied_names_the_group_the_users_groups_and_a_rule_to_paste() {
        let found = only(&PortFacts {
            may_open: false,
            usb: usb(None),
            ..sound()
        });
        assert_eq!(found.verdict, Failure);
        assert_eq!(
            found.what,
            "ada may not open /dev/ttyUSB0: group dialout, mode 0660; ada is in ada, users"
        );
        let remedy = found.remedy.unwrap();
        assert!(
            remedy.starts_with("`sudo usermod -aG dialout ada` and log in again; or"),
            "{remedy}"
        );
        assert!(
            remedy.contains(
                "ATTRS{idVendor}==\"0403\", ATTRS{idProduct}==\"6001\", GROUP=\"dialout\""
            ),
            "{remedy}"
        );
    }

    #[test]
    fn a_port_that_its_group_may_not_open_either_needs_other_permission_bits() {
        let remedy = |group: &str, groups: &[&str], mode| {
            let groups = groups.iter().map(|group| group.to_string()).collect();
            let facts = PortFacts {
                may_open: false,
                group: group.into(),
                groups,
                mode,
                ..sound()
            };
            only(&facts).remedy.unwrap()
        };
        let changed = "`sudo chgrp dialout /dev/ttyUSB0 && sudo chmod g+rw /dev/ttyUSB0`, with ada in dialout";
        assert_eq!(remedy("dialout", &["dialout"], 0o600), changed);
        assert_eq!(
            remedy("root", &["users"], 0o660),
            changed,
            "not into the group root"
        );
    }

    #[test]
    fn a_missing_port_is_told_with_the_names_that_stay() {
        let missing = PortFacts {
            device: None,
            ..sound()
        };
        let found = only(&missing);
        assert_eq!(
            (found.verdict, found.what.as_str()),
            (Failure, "there is no /dev/ttyUSB0")
        );
        assert!(
            found
                .remedy
                .unwrap()
                .contains("nothing in /dev/serial/by-id")
        );
        let by_id = vec![("/dev/serial/by-id/usb-FTDI".into(), "/dev/ttyUSB1".into())];
        let remedy = only(&PortFacts { by_id, ..missing }).remedy.unwrap();
        assert_eq!(
            remedy,
            "set probe.device.line.port to one of /dev/serial/by-id/usb-FTDI"
        );
    }

    #[test]
    fn a_name_that_may_change_is_a_note_with_the_one_that_stays() {
        let by_id = vec![("/dev/serial/by-id/usb-FTDI".into(), "/dev/ttyUSB0".into())];
        let found = only(&PortFacts {
            by_id: by_id.clone(),
            ..sound()
        });
        assert_eq!(found.verdict, Noted);
        let path = "/dev/serial/by-id/usb-FTDI".into();
        assert_eq!(
            only(&PortFacts {
                by_id,
                path,
                ..sound()
            })
            .verdict,
            Ok
        );
        assert_eq!(
            only(&PortFacts {
                is_character_device: false,
                ..sound()
            })
            .verdict,
            Failure
        );
    }

    #[test]
    fn who_holds_a_port_is_named_by_lock_or_by_its_open_files() {
        let held = |pid| {
            ProbeError::Serial(SerialError::PortInUse {
                path: "/dev/ttyUSB0".into(),
                pid,
            })
        };
        assert!(
            refusal(&held(Some(999_999_999)), &sound())
                .what
                .ends_with("held by process 999999999")
        );
        let me = std::process::id();
        let found = refusal(
            &held(None),
            &PortFacts {
                holders: vec![me],
                ..sound()
            },
        );
        assert!(
            found.what.contains(&format!("process {me} (")),
            "{}",
            found.what
        );
        assert!(
            refusal(&held(None), &sound())
                .remedy
                .unwrap()
                .contains("sudo fuser /dev/ttyUSB0")
        );
        let other = ProbeError::Serial(SerialError::Permission {
            path: "/dev/ttyUSB0".into(),
        });
        assert_eq!(
            refusal(&other, &sound()).what,
            "/dev/ttyUSB0: permission denied"
        );
    }

    #[test]
    fn an_adapter_that_collects_bytes_is_a_warning() {
        let line = LineSettings {
            port: "/dev/ttyUSB0".into(),
            baud: 230_400,
            parity: Parity::Even,
            low_latency: true,
            lock_folder: "/run/lock".into(),
        };
        let verdicts = |ms| {
            let found = opened(
                &PortFacts {
                    usb: usb(ms),
                    ..sound()
                },
                &line,
                &[],
            );
            found
                .iter()
                .map(|finding| finding.verdict)
                .collect::<Vec<_>>()
        };
        assert_eq!(verdicts(Some(16)), [Ok, Warning]);
        assert_eq!(verdicts(Some(1)), [Ok, Ok]);
        assert_eq!(verdicts(None), [Ok]);
        let note = Note {
            what: "no low latency: EPERM".into(),
            remedy: "ask root",
        };
        assert_eq!(opened(&sound(), &line, &[note])[1].verdict, Noted);
    }
}
