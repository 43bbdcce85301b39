//! The CAN interface: is it there, up, at the configured bit rate, and in good health?

use std::path::Path;

use bench_hal::can::bus::{Interface, KernelError, check_can_support};

use super::finding::Finding;
use super::system::line;

const SUBJECT: &str = "CAN interface";
/// `ARPHRD_CAN` [Linux, include/uapi/linux/if_arp.h].
const CAN: &str = "280";
/// Errors from which on a controller warns [ISO 11898-1].
const MANY_ERRORS: u16 = 96;

/// What is known of an interface.
#[derive(Clone, Debug, PartialEq)]
pub struct InterfaceFacts {
    /// Its name in the configuration.
    pub name: String,
    /// The configured bit rate, in bit/s.
    pub bit_rate: u32,
    /// Whether the kernel speaks CAN at all.
    pub kernel: Result<(), KernelError>,
    /// What it is.
    pub link: Link,
    /// CAN interfaces that there are.
    pub others: Vec<String>,
    /// Frames that may wait to be sent.
    pub queue_length: Option<u32>,
}

/// What stands under a name.
#[derive(Clone, Debug, PartialEq)]
pub enum Link {
    /// Nothing.
    Missing,
    /// An interface of another kind.
    NotCan,
    /// Something that cannot be asked; the system's words.
    Unasked(String),
    /// A CAN interface.
    Known(Interface),
}

/// Asks the kernel.
pub fn gather(name: &str, bit_rate: u32) -> InterfaceFacts {
    let net = Path::new("/sys/class/net");
    let property = |property: &str| {
        if name.contains('/') {
            None
        } else {
            line(net.join(name).join(property))
        }
    };
    let link = match (Interface::read(name), property("type").as_deref()) {
        (_, Some(kind)) if kind != CAN => Link::NotCan,
        (Ok(interface), _) => Link::Known(interface),
        (Err(_), None) => Link::Missing,
        (Err(error), Some(_)) => Link::Unasked(error.cause),
    };
    InterfaceFacts {
        name: name.to_string(),
        bit_rate,
        kernel: check_can_support(),
        link,
        others: can_interfaces(net),
        queue_length: property("tx_queue_len").and_then(|text| text.parse().ok()),
    }
}

fn can_interfaces(net: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(net).into_iter().flatten().flatten();
    let is_can =
        |entry: &std::fs::DirEntry| line(entry.path().join("type")).as_deref() == Some(CAN);
    let mut names: Vec<String> = entries
        .filter(is_can)
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// What that means; a failure among it means that nothing can be sent.
pub fn findings(facts: &InterfaceFacts) -> Vec<Finding> {
    if let Err(error) = &facts.kernel {
        return vec![Finding::refused("CAN kernel", error)];
    }
    match &facts.link {
        Link::Known(interface) => known(facts, interface),
        _ => vec![absent(facts)],
    }
}

fn absent(facts: &InterfaceFacts) -> Finding {
    let name = &facts.name;
    let there = if facts.others.is_empty() {
        "no CAN interface at all".into()
    } else {
        facts.others.join(", ")
    };
    let fitting = "plug the adapter in and load its driver (`dmesg` names it), or name one of these in amplifier.device.interface";
    match &facts.link {
        Link::NotCan => Finding::failure(
            SUBJECT,
            format!("{name} is no CAN interface; there is {there}"),
            fitting,
        ),
        Link::Unasked(why) => Finding::failure(
            SUBJECT,
            format!("{name} cannot be asked: {why}"),
            format!("`ip -details link show {name}` may tell more"),
        ),
        Link::Missing | Link::Known(_) => Finding::failure(
            SUBJECT,
            format!("there is no {name}; there is {there}"),
            fitting,
        ),
    }
}

fn known(facts: &InterfaceFacts, interface: &Interface) -> Vec<Finding> {
    let (name, want) = (&facts.name, facts.bit_rate);
    let again =
        format!("`ip link set {name} down` and `ip link set {name} up type can bitrate {want}`");
    if !interface.is_up {
        let up = format!(
            "`ip link set {name} up type can bitrate {want}` (a virtual one: `ip link set {name} up`)"
        );
        return vec![Finding::failure(SUBJECT, format!("{name} is down"), up)];
    }
    let findings = [
        Some(bit_rate(facts, interface, &again)),
        state(name, interface, &again),
        errors(name, interface),
        restart(interface),
        facts.queue_length.map(|length| queue(name, length)),
    ];
    findings.into_iter().flatten().collect()
}

fn bit_rate(facts: &InterfaceFacts, interface: &Interface, again: &str) -> Finding {
    let (name, want) = (&facts.name, facts.bit_rate);
    match interface.bit_rate {
        Some(have) if have == want => Finding::ok(SUBJECT, format!("{name} is up at {have} bit/s")),
        Some(have) => Finding::failure(
            SUBJECT,
            format!("{name} runs at {have} bit/s, the configuration says {want}"),
            format!("{again}, or change amplifier.device.bit_rate"),
        ),
        None => Finding::note(
            SUBJECT,
            format!("{name} is up and virtual: it has no bit rate and no wire"),
            "for rehearsals only: name the real interface in amplifier.device.interface",
        ),
    }
}

fn state(name: &str, interface: &Interface, again: &str) -> Option<Finding> {
    let state = interface.state?;
    let what = format!("the controller of {name} is in state {state}");
    let check =
        "check cable, termination (120 ohms at both ends), bit rate, and that the drive is powered";
    Some(match (interface.is_healthy, state) {
        (false, _) => Finding::failure("CAN state", what, format!("{check}; then {again}")),
        (true, "error active") => Finding::ok("CAN state", what),
        (true, _) => Finding::warning("CAN state", what, check),
    })
}

fn errors(name: &str, interface: &Interface) -> Option<Finding> {
    let (sent, received) = interface.error_counters?;
    let what = format!("{name} counts {sent} errors sending, {received} receiving");
    let check = "frames are damaged or not acknowledged: check cable, termination, bit rate and other nodes";
    Some(match sent.max(received) {
        0 => Finding::ok("CAN errors", what),
        MANY_ERRORS.. => Finding::warning("CAN errors", what, check),
        _ => Finding::note("CAN errors", what, check),
    })
}

fn restart(interface: &Interface) -> Option<Finding> {
    interface.state?;
    Some(match interface.restart_ms {
        None | Some(0) => Finding::ok(
            "CAN restart",
            "after a bus-off the interface waits for a person",
        ),
        Some(ms) => Finding::note(
            "CAN restart",
            format!(
                "after a bus-off the interface comes back by itself within {ms} ms; the run has tripped by then"
            ),
            "`ip link set IFACE type can restart-ms 0` leaves that to a person",
        ),
    })
}

/// A short queue loses bursts, a long one keeps set-points that nobody wants any more.
fn queue(name: &str, length: u32) -> Finding {
    let (what, remedy) = (
        format!("{length} frames may wait to be sent on {name}"),
        format!("`ip link set {name} txqueuelen 10`"),
    );
    match length {
        0..4 => Finding::warning(
            "CAN queue",
            format!("{what}: too few for a tick and the heartbeat"),
            remedy,
        ),
        4..=100 => Finding::ok("CAN queue", what),
        _ => Finding::note(
            "CAN queue",
            format!("{what}: on a bus that stalls, old set-points would"),
            remedy,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Note, Ok, Warning};

    fn sound() -> Interface {
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
        let (kernel, queue_length) = (Result::Ok(()), Some(10));
        InterfaceFacts {
            name: "can0".into(),
            bit_rate: 1_000_000,
            kernel,
            link,
            others: vec!["can1".into()],
            queue_length,
        }
    }

    fn found(interface: Interface) -> Vec<Finding> {
        findings(&facts(Link::Known(interface)))
    }

    /// What is not ok.
    fn verdicts(found: &[Finding]) -> Vec<(&'static str, Severity)> {
        found
            .iter()
            .map(|f| (f.subject, f.verdict))
            .filter(|(_, verdict)| *verdict != Ok)
            .collect()
    }

    #[test]
    fn a_sound_interface_is_ok_in_everything() {
        assert_eq!(verdicts(&found(sound())), []);
        assert_eq!(found(sound()).len(), 5);
    }

    #[test]
    fn each_trouble_of_an_interface_has_its_verdict() {
        let bus_off = Interface {
            state: Some("bus off"),
            is_healthy: false,
            error_counters: Some((248, 0)),
            ..sound()
        };
        let cases = [
            (
                Interface {
                    is_up: false,
                    ..sound()
                },
                vec![(SUBJECT, Failure)],
            ),
            (
                Interface {
                    bit_rate: Some(500_000),
                    ..sound()
                },
                vec![(SUBJECT, Failure)],
            ),
            (
                bus_off,
                vec![("CAN state", Failure), ("CAN errors", Warning)],
            ),
            (
                Interface {
                    state: Some("error passive"),
                    is_healthy: false,
                    ..sound()
                },
                vec![("CAN state", Failure)],
            ),
            (
                Interface {
                    state: Some("error warning"),
                    ..sound()
                },
                vec![("CAN state", Warning)],
            ),
            (
                Interface {
                    error_counters: Some((0, 3)),
                    ..sound()
                },
                vec![("CAN errors", Note)],
            ),
            (
                Interface {
                    restart_ms: Some(100),
                    ..sound()
                },
                vec![("CAN restart", Note)],
            ),
        ];
        for (interface, expected) in cases {
            assert_eq!(
                verdicts(&found(interface.clone())),
                expected,
                "{interface:?}"
            );
        }
    }

    #[test]
    fn remedies_name_the_interface_and_the_bit_rate() {
        let down = &found(Interface {
            is_up: false,
            ..sound()
        })[0];
        assert!(
            down.remedy
                .as_deref()
                .unwrap()
                .starts_with("`ip link set can0 up type can bitrate 1000000`")
        );
        let slow = &found(Interface {
            bit_rate: Some(500_000),
            ..sound()
        })[0];
        assert_eq!(
            slow.what,
            "can0 runs at 500000 bit/s, the configuration says 1000000"
        );
    }

    #[test]
    fn a_virtual_interface_is_a_note() {
        let virtual_one = Interface {
            is_up: true,
            is_healthy: true,
            ..Interface::default()
        };
        assert_eq!(verdicts(&found(virtual_one)), [(SUBJECT, Note)]);
    }

    #[test]
    fn what_is_not_there_is_told_with_what_is() {
        for (link, words) in [
            (Link::Missing, "there is no can0; there is can1"),
            (Link::NotCan, "can0 is no CAN interface; there is can1"),
            (Link::Unasked("EPERM".into()), "can0 cannot be asked: EPERM"),
        ] {
            let found = findings(&facts(link));
            assert_eq!(
                (found.len(), found[0].verdict, found[0].what.as_str()),
                (1, Failure, words)
            );
        }
    }

    #[test]
    fn a_kernel_without_can_is_the_only_finding() {
        let found = findings(&InterfaceFacts {
            kernel: Err(KernelError::Missing),
            ..facts(Link::Missing)
        });
        assert_eq!(
            (found.len(), found[0].what.as_str()),
            (1, "this kernel has no CAN")
        );
        assert!(
            found[0]
                .remedy
                .as_deref()
                .unwrap()
                .contains("modprobe can_raw")
        );
    }

    #[test]
    fn a_queue_is_neither_too_short_nor_too_long() {
        let verdict = |length| queue("can0", length).verdict;
        assert_eq!(
            [2, 4, 10, 100, 1000].map(verdict),
            [Warning, Ok, Ok, Ok, Note]
        );
    }
}
