//! The serial port of the probe: whether it exists and may be opened, which process uses it, and which line settings it accepted.

use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use bench_hal::serial::{Note, Parity, PortSettings, SerialError};
use nix::unistd::{AccessFlags, Gid, Group, User, eaccess, getegid, geteuid, getgroups};

use super::finding::{Finding, Subject, read_line};
use super::usb::Usb;
use bench_rig::devices::ProbeError;

const PORT: Subject = Subject::SerialPort;
/// A longer latency of the adapter is a warning, in milliseconds.
const MAX_LATENCY_MS: u32 = 2;

/// Facts about a port, before it is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortFacts {
    /// The configured path.
    pub path: PathBuf,
    /// The device behind the path; `None` if it does not exist.
    pub device: Option<PathBuf>,
    /// Whether that is a character device, as terminals are.
    pub is_character_device: bool,
    /// Whether this process may read and write it.
    pub may_open: bool,
    /// Group of the device.
    pub group: String,
    /// Permission bits.
    pub mode: u32,
    /// This user.
    pub user: String,
    /// The groups of this user.
    pub groups: Vec<String>,
    /// The links in /dev/serial/by-id, with their devices.
    pub by_id: Vec<(PathBuf, PathBuf)>,
    /// The USB adapter.
    pub usb: Option<Usb>,
    /// Other processes that have the device open, as far as this user may see them.
    pub holders: Vec<u32>,
}

/// Examines the port of `line` without opening it.
pub fn gather(line: &PortSettings) -> PortFacts {
    let (user, groups) = user_and_groups();
    let facts = PortFacts {
        path: line.path.clone(),
        by_id: links(Path::new("/dev/serial/by-id")),
        user,
        groups,
        ..PortFacts::default()
    };
    match line.path.canonicalize() {
        Ok(device) => with_device(facts, device),
        Err(_) => facts,
    }
}

fn with_device(facts: PortFacts, device: PathBuf) -> PortFacts {
    let Ok(metadata) = device.metadata() else {
        return facts;
    };
    let name = device.file_name().unwrap_or_default().to_string_lossy();
    let access = eaccess(&device, AccessFlags::R_OK | AccessFlags::W_OK);
    PortFacts {
        is_character_device: metadata.file_type().is_char_device(),
        may_open: access.is_ok(),
        group: group_name(Gid::from_raw(metadata.gid())),
        mode: metadata.mode() & 0o777,
        usb: Usb::of(Path::new("/sys/class/tty"), &name),
        holders: holders(&device),
        device: Some(device.clone()),
        ..facts
    }
}

fn links(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let mut links = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let link = entry.path();
        if let Ok(device) = link.canonicalize() {
            links.push((link, device));
        }
    }
    links.sort();
    links
}

fn group_name(gid: Gid) -> String {
    match Group::from_gid(gid) {
        Ok(Some(group)) => group.name,
        _ => gid.to_string(),
    }
}

fn user_and_groups() -> (String, Vec<String>) {
    let uid = geteuid();
    let user = match User::from_uid(uid) {
        Ok(Some(user)) => user.name,
        _ => uid.to_string(),
    };
    let mut gids = getgroups().unwrap_or_default();
    gids.push(getegid());
    let mut groups: Vec<String> = gids.into_iter().map(group_name).collect();
    groups.sort();
    groups.dedup();
    (user, groups)
}

/// Processes that have `device` open. Only root sees those of other users.
fn holders(device: &Path) -> Vec<u32> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_string_lossy().parse().ok());
    let others = pids.filter(|pid| *pid != std::process::id());
    others.filter(|pid| has_open(*pid, device)).collect()
}

fn has_open(pid: u32, device: &Path) -> bool {
    let files = std::fs::read_dir(format!("/proc/{pid}/fd"));
    let mut files = files.into_iter().flatten().flatten();
    files.any(|file| std::fs::read_link(file.path()).is_ok_and(|open| open == device))
}

/// Evaluates the facts.
pub fn finding(facts: &PortFacts) -> Finding {
    let path = facts.path.display();
    let Some(device) = &facts.device else {
        return PORT.failure(format!("{path} does not exist"), existing_ports(facts));
    };
    if !facts.is_character_device {
        let what = format!("{path} is not a terminal");
        return PORT.failure(what, existing_ports(facts));
    }
    if !facts.may_open {
        return no_permission(facts, device);
    }
    let what = format!("{path} exists, and {} may open it", facts.user);
    match permanent_link(facts, device) {
        None => PORT.ok(what),
        Some(link) => {
            let link = link.display();
            let remedy =
                format!("{link} keeps its name when the adapters are connected in another order");
            PORT.note(what, remedy)
        }
    }
}

/// A link to the device by the name of the adapter, if the configuration does not use it.
fn permanent_link<'a>(facts: &'a PortFacts, device: &Path) -> Option<&'a Path> {
    let mut links = facts.by_id.iter();
    let (link, _) = links.find(|(link, target)| target == device && *link != facts.path)?;
    Some(link)
}

fn existing_ports(facts: &PortFacts) -> String {
    if facts.by_id.is_empty() {
        return "connect the adapter (/dev/serial/by-id is empty), or correct probe.device.line.port".into();
    }
    let links = facts.by_id.iter();
    let links: Vec<String> = links.map(|(link, _)| link.display().to_string()).collect();
    format!("set probe.device.line.port to one of {}", links.join(", "))
}

fn no_permission(facts: &PortFacts, device: &Path) -> Finding {
    let PortFacts {
        group, user, mode, ..
    } = facts;
    let what = format!(
        "{user} may not open {}: group {group}, mode {mode:04o}; {user} is in {}",
        device.display(),
        facts.groups.join(", ")
    );
    PORT.failure(what, permission_remedy(facts, device))
}

fn permission_remedy(facts: &PortFacts, device: &Path) -> String {
    let PortFacts { group, user, .. } = facts;
    let group_may_open = facts.mode & 0o060 == 0o060 && group != "root";
    // The group of root would grant more than a port.
    let new_group = if group == "root" { "dialout" } else { group };
    let by_group = if group_may_open && !facts.groups.contains(group) {
        format!("`sudo usermod -aG {group} {user}` and log in again")
    } else {
        format!(
            "`sudo chgrp {new_group} {0} && sudo chmod g+rw {0}`, and add {user} to the group {new_group} (`sudo usermod -aG {new_group} {user}`)",
            device.display()
        )
    };
    let Some(usb) = &facts.usb else {
        return by_group;
    };
    let rule = usb.rule(new_group);
    format!(
        "{by_group}; or add this line to /etc/udev/rules.d/70-bench.rules and reconnect the adapter: {rule}"
    )
}

/// Why the probe could not be opened.
pub fn refusal(error: &ProbeError, facts: &PortFacts) -> Finding {
    let ProbeError::Serial(SerialError::PortInUse { pid, .. }) = error else {
        return PORT.refused(error);
    };
    let path = facts.path.display();
    let pids = match pid {
        Some(pid) => &[*pid][..],
        None => &facts.holders,
    };
    if pids.is_empty() {
        let what = format!("{path} is used by another process");
        let remedy = format!("find it with `sudo fuser {path}` and end it: {TWO_READERS}");
        return PORT.failure(what, remedy);
    }
    let names: Vec<String> = pids.iter().map(process_name).collect();
    PORT.failure(
        format!("{path} is used by {}", names.join(", ")),
        format!("wait until it ends, or end it: {TWO_READERS}"),
    )
}

const TWO_READERS: &str = "each of two readers loses bytes";

fn process_name(pid: &u32) -> String {
    match read_line(format!("/proc/{pid}/comm")) {
        Some(name) => format!("process {pid} ({name})"),
        None => format!("process {pid}"),
    }
}

/// Findings on the line settings that an open port accepted.
pub fn opened(facts: &PortFacts, line: &PortSettings, notes: &[Note]) -> Vec<Finding> {
    let parity = match line.parity {
        Parity::None => "no",
        Parity::Even => "even",
    };
    let what = format!("opened at {} baud with {parity} parity", line.baud);
    let mut findings = vec![PORT.ok(what)];
    for note in notes {
        findings.push(PORT.note(note.what.clone(), note.remedy));
    }
    let latency_ms = facts.usb.as_ref().and_then(|usb| usb.latency_ms);
    findings.extend(latency_ms.map(latency));
    findings
}

fn latency(latency_ms: u32) -> Finding {
    let what = format!(
        "the latency timer of the USB adapter delays received bytes by up to {latency_ms} ms"
    );
    if latency_ms <= MAX_LATENCY_MS {
        return PORT.ok(what);
    }
    let remedy = "set probe.device.line.low_latency = true, which requests 1 ms; if that is refused, use a udev rule \
                  with ATTR{latency_timer}=\"1\"";
    PORT.warning(what, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{Failure, Note as Noted, Ok, Warning};

    fn healthy() -> PortFacts {
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
        finding(facts)
    }

    #[test]
    fn a_refused_permission_names_groups_and_a_udev_rule() {
        let found = only(&PortFacts {
            may_open: false,
            usb: usb(None),
            ..healthy()
        });
        assert_eq!(found.severity, Failure);
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
    fn suggests_permission_bits_for_a_port_without_group_access() {
        let remedy = |group: &str, groups: &[&str], mode| {
            let groups = groups.iter().map(|group| group.to_string()).collect();
            let facts = PortFacts {
                may_open: false,
                group: group.into(),
                groups,
                mode,
                ..healthy()
            };
            only(&facts).remedy.unwrap()
        };
        let changed = "`sudo chgrp dialout /dev/ttyUSB0 && sudo chmod g+rw /dev/ttyUSB0`, and add ada to the group dialout (`sudo usermod -aG dialout ada`)";
        assert_eq!(remedy("dialout", &["dialout"], 0o600), changed);
        assert_eq!(
            remedy("root", &["users"], 0o660),
            changed,
            "not into the group root"
        );
    }

    #[test]
    fn a_missing_port_is_reported_with_the_permanent_names() {
        let missing = PortFacts {
            device: None,
            ..healthy()
        };
        let found = only(&missing);
        assert_eq!(
            (found.severity, found.what.as_str()),
            (Failure, "/dev/ttyUSB0 does not exist")
        );
        assert!(found.remedy.unwrap().contains("/dev/serial/by-id is empty"));
        let by_id = vec![("/dev/serial/by-id/usb-FTDI".into(), "/dev/ttyUSB1".into())];
        let remedy = only(&PortFacts { by_id, ..missing }).remedy.unwrap();
        assert_eq!(
            remedy,
            "set probe.device.line.port to one of /dev/serial/by-id/usb-FTDI"
        );
    }

    #[test]
    fn a_name_that_may_change_is_a_note_with_the_permanent_name() {
        let by_id = vec![("/dev/serial/by-id/usb-FTDI".into(), "/dev/ttyUSB0".into())];
        let found = only(&PortFacts {
            by_id: by_id.clone(),
            ..healthy()
        });
        assert_eq!(found.severity, Noted);
        let path = "/dev/serial/by-id/usb-FTDI".into();
        assert_eq!(
            only(&PortFacts {
                by_id,
                path,
                ..healthy()
            })
            .severity,
            Ok
        );
        assert_eq!(
            only(&PortFacts {
                is_character_device: false,
                ..healthy()
            })
            .severity,
            Failure
        );
    }

    #[test]
    fn the_process_that_uses_a_port_is_named_by_lock_or_open_files() {
        let held = |pid| {
            ProbeError::Serial(SerialError::PortInUse {
                path: "/dev/ttyUSB0".into(),
                pid,
            })
        };
        assert!(
            refusal(&held(Some(999_999_999)), &healthy())
                .what
                .ends_with("used by process 999999999")
        );
        let me = std::process::id();
        let found = refusal(
            &held(None),
            &PortFacts {
                holders: vec![me],
                ..healthy()
            },
        );
        assert!(
            found.what.contains(&format!("process {me} (")),
            "{}",
            found.what
        );
        assert!(
            refusal(&held(None), &healthy())
                .remedy
                .unwrap()
                .contains("sudo fuser /dev/ttyUSB0")
        );
        let other = ProbeError::Serial(SerialError::Permission {
            path: "/dev/ttyUSB0".into(),
        });
        assert_eq!(
            refusal(&other, &healthy()).what,
            "/dev/ttyUSB0: permission denied"
        );
    }

    #[test]
    fn a_high_latency_of_the_adapter_is_a_warning() {
        let mut line = PortSettings::new("/dev/ttyUSB0", 230_400);
        line.parity = Parity::Even;
        let severities = |ms| {
            let found = opened(
                &PortFacts {
                    usb: usb(ms),
                    ..healthy()
                },
                &line,
                &[],
            );
            found
                .iter()
                .map(|finding| finding.severity)
                .collect::<Vec<_>>()
        };
        assert_eq!(severities(Some(16)), [Ok, Warning]);
        assert_eq!(severities(Some(1)), [Ok, Ok]);
        assert_eq!(severities(None), [Ok]);
        let note = Note {
            what: "no low latency: EPERM".into(),
            remedy: "ask root",
        };
        assert_eq!(opened(&healthy(), &line, &[note])[1].severity, Noted);
    }
}
