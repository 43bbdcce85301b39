//! The CAN interface: whether it exists, is up at the configured bit rate, and has no errors.

use std::path::Path;

use bench_hal::can::bus::{Interface, KernelError, check_can_support};

use super::finding::{Finding, Subject, read_line};

/// `ARPHRD_CAN` [Linux, include/uapi/linux/if_arp.h].
const CAN_TYPE: &str = "280";
/// Error count from which a controller is in the state error warning [ISO 11898-1].
const WARNING_LEVEL: u16 = 96;

/// Facts about an interface.
#[derive(Clone, Debug, PartialEq)]
pub struct InterfaceFacts {
    /// The configured name.
    pub name: String,
    /// The configured bit rate, in bit/s.
    pub bit_rate: u32,
    /// Whether the kernel supports CAN.
    pub kernel: Result<(), KernelError>,
    /// The object that the name refers to.
    pub link: Link,
    /// The CAN interfaces of this machine.
    pub others: Vec<String>,
    /// Length of the transmit queue, in frames.
    pub queue_length: Option<u32>,
}

/// The object that an interface name refers to.
#[derive(Clone, Debug, PartialEq)]
pub enum Link {
    /// Nothing.
    Missing,
    /// An interface of another kind.
    NotCan,
    /// An interface whose state cannot be read, with the reason.
    Unreadable(String),
    /// A CAN interface.
    Known(Interface),
}

/// Reads the facts from the kernel.
pub fn gather(name: &str, bit_rate: u32) -> InterfaceFacts {
    let net = Path::new("/sys/class/net");
    let link = match (Interface::read(name), property(net, name, "type")) {
        (_, Some(kind)) if kind != CAN_TYPE => Link::NotCan,
        (Ok(interface), _) => Link::Known(interface),
        (Err(_), None) => Link::Missing,
        (Err(error), Some(_)) => Link::Unreadable(error.cause),
    };
    let queue_length = property(net, name, "tx_queue_len");
    InterfaceFacts {
        name: name.to_string(),
        bit_rate,
        kernel: check_can_support(),
        link,
        others: can_interfaces(net),
        queue_length: queue_length.and_then(|text| text.parse().ok()),
    }
}

fn property(net: &Path, name: &str, property: &str) -> Option<String> {
    if name.contains('/') {
        return None;
    }
    read_line(net.join(name).join(property))
}

fn can_interfaces(net: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(net).into_iter().flatten().flatten() {
        if read_line(entry.path().join("type")).as_deref() == Some(CAN_TYPE) {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort();
    names
}

/// Evaluates the facts. With a failure among the findings nothing can be sent.
pub fn findings(facts: &InterfaceFacts) -> Vec<Finding> {
    if let Err(error) = &facts.kernel {
        return vec![Subject::CanKernel.refused(error)];
    }
    match &facts.link {
        Link::Known(interface) => judge(facts, interface),
        _ => vec![absent(facts)],
    }
}

fn absent(facts: &InterfaceFacts) -> Finding {
    let name = &facts.name;
    let others = if facts.others.is_empty() {
        "this machine has no CAN interface".into()
    } else {
        format!("the CAN interfaces are {}", facts.others.join(", "))
    };
    let what = match &facts.link {
        Link::Unreadable(why) => {
            let what = format!("the state of {name} cannot be read: {why}");
            let remedy = format!("`ip -details link show {name}` may show more");
            return Subject::CanInterface.failure(what, remedy);
        }
        Link::NotCan => format!("{name} is not a CAN interface; {others}"),
        _ => format!("{name} does not exist; {others}"),
    };
    Subject::CanInterface.failure(what, ABSENT_REMEDY)
}

const ABSENT_REMEDY: &str = "connect the adapter and load its driver (`dmesg` names it), or correct amplifier.device.interface";

fn judge(facts: &InterfaceFacts, interface: &Interface) -> Vec<Finding> {
    let name = &facts.name;
    let bits_per_s = facts.bit_rate;
    let up = format!("`ip link set {name} up type can bitrate {bits_per_s}`");
    if !interface.is_up {
        let remedy = format!("{up} (a virtual one: `ip link set {name} up`)");
        return vec![Subject::CanInterface.failure(format!("{name} is down"), remedy)];
    }
    let restart = format!("`ip link set {name} down` and {up}");
    let findings = [
        Some(bit_rate(facts, interface, &restart)),
        controller_state(name, interface, &restart),
        errors(name, interface),
        automatic_restart(name, interface),
        facts.queue_length.map(|length| queue(name, length)),
    ];
    findings.into_iter().flatten().collect()
}

fn bit_rate(facts: &InterfaceFacts, interface: &Interface, restart: &str) -> Finding {
    let (name, configured) = (&facts.name, facts.bit_rate);
    match interface.bit_rate {
        Some(actual) if actual == configured => {
            Subject::CanInterface.ok(format!("{name} is up at {actual} bit/s"))
        }
        Some(actual) => Subject::CanInterface.failure(
            format!("{name} runs at {actual} bit/s, the configuration states {configured}"),
            format!("{restart}, or change amplifier.device.bit_rate"),
        ),
        None => Subject::CanInterface.note(
            format!("{name} is up and virtual: it has no bit rate and no wire"),
            "for rehearsals only; for a real bus, set amplifier.device.interface to its interface",
        ),
    }
}

/// The remedy for errors on the bus.
pub(super) const CHECK_BUS: &str =
    "check cable, termination (120 ohms at both ends), bit rate, and the supply of the drive";

fn controller_state(name: &str, interface: &Interface, restart: &str) -> Option<Finding> {
    let state = interface.state?;
    let what = format!("the controller of {name} is in state {state}");
    Some(if !interface.is_healthy {
        Subject::CanState.failure(what, format!("{CHECK_BUS}; then {restart}"))
    } else if state == "error active" {
        Subject::CanState.ok(what)
    } else {
        Subject::CanState.warning(what, CHECK_BUS)
    })
}

fn errors(name: &str, interface: &Interface) -> Option<Finding> {
    let (sent, received) = interface.error_counters?;
    let what = format!("error counters of {name}: {sent} sending, {received} receiving");
    let remedy = "frames are damaged or not acknowledged: check cable, termination, bit rate and other nodes";
    Some(match sent.max(received) {
        0 => Subject::CanErrors.ok(what),
        WARNING_LEVEL.. => Subject::CanErrors.warning(what, remedy),
        _ => Subject::CanErrors.note(what, remedy),
    })
}

fn automatic_restart(name: &str, interface: &Interface) -> Option<Finding> {
    interface.state?;
    Some(match interface.restart_ms {
        None | Some(0) => {
            Subject::CanRestart.ok("after bus-off the interface stays off until it is restarted")
        }
        Some(ms) => Subject::CanRestart.note(
            format!(
                "after bus-off the interface restarts within {ms} ms; the run has tripped by then"
            ),
            format!(
                "`ip link set {name} type can restart-ms 0` leaves the restart to the operator"
            ),
        ),
    })
}

/// A short queue loses bursts; a long queue delays set-points until they are outdated.
fn queue(name: &str, length: u32) -> Finding {
    let what = format!("the transmit queue of {name} holds {length} frames");
    let remedy = format!("`ip link set {name} txqueuelen 10`");
    match length {
        0..4 => {
            let what = format!("{what}: too few for a set-point and a heartbeat");
            Subject::CanQueue.warning(what, remedy)
        }
        4..=100 => Subject::CanQueue.ok(what),
        _ => {
            let what = format!("{what}: set-points may be queued and arrive late");
            Subject::CanQueue.note(what, remedy)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Note, Ok, Warning};

    fn healthy() -> Interface {
        Interface {
            is_up: true,
            bit_rate: Some(1_000_000),
            state: Some("error active"),
            is_healthy: true,
            error_counters: Some((0, 0)),
            restart_ms: Some(0),
        }
    }

    fn facts(link: Link) -> InterfaceFacts {
        InterfaceFacts {
            name: "can0".into(),
            bit_rate: 1_000_000,
            kernel: Result::Ok(()),
            link,
            others: vec!["can1".into()],
            queue_length: Some(10),
        }
    }

    fn found(interface: Interface) -> Vec<Finding> {
        findings(&facts(Link::Known(interface)))
    }

    fn not_ok(found: &[Finding]) -> Vec<(Subject, Severity)> {
        let all = found.iter().map(|f| (f.subject, f.severity));
        all.filter(|(_, severity)| *severity != Ok).collect()
    }

    #[test]
    fn a_healthy_interface_is_ok() {
        assert_eq!(not_ok(&found(healthy())), []);
        assert_eq!(found(healthy()).len(), 5);
    }

    #[test]
    fn each_defect_of_an_interface_has_its_severity() {
        let mut cases: Vec<(Interface, Vec<(Subject, Severity)>)> = Vec::new();
        let mut case = |change: fn(&mut Interface), expected: &[(Subject, Severity)]| {
            let mut interface = healthy();
            change(&mut interface);
            cases.push((interface, expected.to_vec()));
        };
        case(|i| i.is_up = false, &[(Subject::CanInterface, Failure)]);
        case(
            |i| i.bit_rate = Some(500_000),
            &[(Subject::CanInterface, Failure)],
        );
        case(
            |i| {
                (i.state, i.is_healthy) = (Some("bus off"), false);
                i.error_counters = Some((248, 0));
            },
            &[(Subject::CanState, Failure), (Subject::CanErrors, Warning)],
        );
        case(
            |i| (i.state, i.is_healthy) = (Some("error passive"), false),
            &[(Subject::CanState, Failure)],
        );
        case(
            |i| i.state = Some("error warning"),
            &[(Subject::CanState, Warning)],
        );
        case(
            |i| i.error_counters = Some((0, 3)),
            &[(Subject::CanErrors, Note)],
        );
        case(|i| i.restart_ms = Some(100), &[(Subject::CanRestart, Note)]);
        for (interface, expected) in cases {
            assert_eq!(not_ok(&found(interface.clone())), expected, "{interface:?}");
        }
    }

    #[test]
    fn remedies_name_the_interface_and_the_bit_rate() {
        let mut down = healthy();
        down.is_up = false;
        let remedy = found(down)[0].remedy.clone().unwrap();
        assert!(remedy.starts_with("`ip link set can0 up type can bitrate 1000000`"));
        let mut slow = healthy();
        slow.bit_rate = Some(500_000);
        assert_eq!(
            found(slow)[0].what,
            "can0 runs at 500000 bit/s, the configuration states 1000000"
        );
    }

    #[test]
    fn a_virtual_interface_is_a_note() {
        let virtual_interface = Interface {
            is_up: true,
            is_healthy: true,
            ..Interface::default()
        };
        assert_eq!(
            not_ok(&found(virtual_interface)),
            [(Subject::CanInterface, Note)]
        );
    }

    #[test]
    fn an_absent_interface_is_reported_with_the_existing_ones() {
        for (link, text) in [
            (
                Link::Missing,
                "can0 does not exist; the CAN interfaces are can1",
            ),
            (
                Link::NotCan,
                "can0 is not a CAN interface; the CAN interfaces are can1",
            ),
            (
                Link::Unreadable("EPERM".into()),
                "the state of can0 cannot be read: EPERM",
            ),
        ] {
            let found = findings(&facts(link));
            assert_eq!(found.len(), 1);
            assert_eq!((found[0].severity, found[0].what.as_str()), (Failure, text));
        }
    }

    #[test]
    fn a_kernel_without_can_is_the_only_finding() {
        let found = findings(&InterfaceFacts {
            kernel: Err(KernelError::Missing),
            ..facts(Link::Missing)
        });
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].subject, Subject::CanKernel);
        let remedy = found[0].remedy.as_deref().unwrap();
        assert!(remedy.contains("modprobe can_raw"), "{remedy}");
    }

    #[test]
    fn detects_too_short_and_too_long_queues() {
        let severity = |length| queue("can0", length).severity;
        assert_eq!(
            [2, 4, 10, 100, 1000].map(severity),
            [Warning, Ok, Ok, Ok, Note]
        );
    }
}
