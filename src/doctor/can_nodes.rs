//! Who is on the bus: listening only.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use bench_hal::can::budget::{base_frame_bits, extended_frame_bits};
use bench_hal::can::bus::{BusError, BusEvent, Condition, Host};
use bench_hal::can::emcy::{self, Emergency};
use bench_hal::can::frame::{CanFrame, Id};
use bench_hal::can::{heartbeat, nmt, sync, vesc};
use serde::Serialize;

use super::finding::Finding;

const SUBJECT: &str = "CAN nodes";

/// What was heard.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// For how long, in seconds.
    pub seconds: f64,
    /// Frames.
    pub frames: u64,
    /// Their bits with the worst stuffing.
    pub bits: u64,
    /// Heartbeats: node and its latest state.
    pub nodes: BTreeMap<u8, nmt::State>,
    /// Emergency messages: node and message.
    pub emergencies: Vec<(u8, Emergency)>,
    /// STATUS of VESCs: node, how often, and the latest current in units of 0.1 A.
    pub vescs: BTreeMap<u8, (u64, i16)>,
    /// Nodes to which somebody sent set-points (their first receive PDO).
    pub commanded: BTreeSet<u8>,
    /// Whether somebody sent SYNC or NMT orders: a master.
    pub master: bool,
    /// What the controller told meanwhile, each once.
    pub conditions: Vec<Condition>,
}

/// Figures of what was heard.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BusFigures {
    /// How long was listened, in seconds.
    pub listened_s: f64,
    /// Frames heard.
    pub frames: u64,
    /// Part of the bus's bits that they took, at worst.
    pub load: f64,
    /// Nodes whose heartbeat was heard.
    pub nodes: Vec<u8>,
}

/// Listens for `time`; sends nothing.
pub fn listen(host: &dyn Host, time: Duration) -> Result<Heard, BusError> {
    let mut bus = host.endpoint(&[])?;
    let mut heard = Heard {
        seconds: time.as_secs_f64(),
        ..Heard::default()
    };
    let end_ns = host.now_ns().saturating_add(time.as_nanos() as u64);
    while let Some(left_ns) = end_ns
        .checked_sub(host.now_ns())
        .filter(|left_ns| *left_ns > 0)
    {
        if let Some(event) = bus.receive(Duration::from_nanos(left_ns))? {
            heard.take(event);
        }
    }
    Ok(heard)
}

impl Heard {
    fn take(&mut self, event: BusEvent) {
        match event {
            BusEvent::Frame(frame) => self.frame(&frame),
            BusEvent::Condition(condition) if !self.conditions.contains(&condition) => {
                self.conditions.push(condition)
            }
            BusEvent::Condition(_) => {}
        }
    }

    fn frame(&mut self, frame: &CanFrame) {
        let (id, data) = (frame.id(), frame.data());
        self.frames += 1;
        self.bits += u64::from(bits(id, data.len() as u32));
        if id.is_extended() {
            return self.vesc(id, data);
        }
        let node = (id.raw() & 0x7F) as u8;
        match id.raw() & 0x780 {
            0x000 | 0x080 if id == nmt::COB_ID || id == sync::FRAME.id() => self.master = true,
            0x080 => self
                .emergencies
                .extend(Emergency::decode(data).map(|emergency| (node, emergency))),
            0x200 => self.commanded.extend([node]),
            0x700 => self
                .nodes
                .extend(heartbeat::decode(data).map(|state| (node, state))),
            _ => {}
        }
    }

    fn vesc(&mut self, id: Id, data: &[u8]) {
        let node = (id.raw() & 0xFF) as u8;
        let current = vesc::status_current(data).filter(|_| id == vesc::status_id(node));
        if let Some(current) = current {
            let (count, latest) = self.vescs.entry(node).or_default();
            (*count, *latest) = (*count + 1, current);
        }
    }

    /// The figures, on a bus of `bit_rate` bit/s.
    pub fn figures(&self, bit_rate: u32) -> BusFigures {
        BusFigures {
            listened_s: self.seconds,
            frames: self.frames,
            load: self.bits as f64 / (f64::from(bit_rate) * self.seconds).max(1.0),
            nodes: self.nodes.keys().copied().collect(),
        }
    }
}

fn bits(id: Id, bytes: u32) -> u32 {
    if id.is_extended() {
        extended_frame_bits(bytes)
    } else {
        base_frame_bits(bytes)
    }
}

/// What that means for a run with `node`, which nobody else of this program holds.
pub fn findings(heard: &Heard, node: u8, bit_rate: u32) -> Vec<Finding> {
    let mut findings = vec![who(heard, bit_rate)];
    findings.extend(
        heard
            .conditions
            .iter()
            .filter_map(|condition| trouble(*condition)),
    );
    findings.extend(
        heard
            .emergencies
            .iter()
            .map(|(from, emergency)| cry(*from, emergency)),
    );
    if heard.commanded.contains(&node) {
        let what = format!("somebody else sends set-points to node {node}");
        findings.push(Finding::warning(
            SUBJECT,
            what,
            "end the other program, or unplug the other controller: two masters fight",
        ));
    } else if heard.master {
        let remedy =
            "end the other program, or unplug the other controller, unless it is meant to be there";
        findings.push(Finding::warning(
            SUBJECT,
            "another master sends SYNC or NMT orders",
            remedy,
        ));
    }
    findings
}

fn who(heard: &Heard, bit_rate: u32) -> Finding {
    let heartbeats = heard
        .nodes
        .iter()
        .map(|(node, state)| format!("node {node} {}", words(*state)));
    let vescs = heard.vescs.keys().map(|node| format!("VESC {node}"));
    let all: Vec<String> = heartbeats.chain(vescs).collect();
    let names = if all.is_empty() {
        "nobody by heartbeat or STATUS".into()
    } else {
        all.join(", ")
    };
    let figures = heard.figures(bit_rate);
    let (seconds, frames, percent) = (heard.seconds, heard.frames, 100.0 * figures.load);
    Finding::ok(
        SUBJECT,
        format!("heard within {seconds} s: {names}; {frames} frames, {percent:.1} % of the bus"),
    )
}

/// A state for people.
pub(super) fn words(state: nmt::State) -> &'static str {
    match state {
        nmt::State::BootUp => "starting",
        nmt::State::Stopped => "stopped",
        nmt::State::Operational => "operational",
        nmt::State::PreOperational => "pre-operational",
    }
}

fn trouble(condition: Condition) -> Option<Finding> {
    let what = match condition {
        Condition::BusOff => "the controller went into bus-off",
        Condition::Passive => "the controller became error passive",
        Condition::Overflow => "frames were lost",
        Condition::Warning => "many errors: the controller warns",
        Condition::NoAcknowledge => "nobody acknowledges frames: no other node hears this bus",
        Condition::Noise => "errors on the wire",
        Condition::Active => return None,
    };
    let remedy =
        "check cable, termination (120 ohms at both ends), bit rate, and that the drive is powered";
    Some(match condition {
        Condition::BusOff | Condition::Passive => Finding::failure("CAN state", what, remedy),
        _ => Finding::warning("CAN state", what, remedy),
    })
}

fn cry(node: u8, emergency: &Emergency) -> Finding {
    let (code, text) = (emergency.code, emcy::text(emergency.code));
    let what = format!("node {node} sent emergency 0x{code:04X}: {text}");
    match code {
        0 => Finding::note(SUBJECT, what, "none: the error is over"),
        _ => Finding::warning(
            SUBJECT,
            what,
            "remove the cause; the drive's manual has the vendor's bytes",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn heard(frames: &[CanFrame]) -> Heard {
        let mut heard = Heard {
            seconds: 0.3,
            ..Heard::default()
        };
        frames
            .iter()
            .for_each(|frame| heard.take(BusEvent::Frame(*frame)));
        heard
    }

    fn worst(heard: &Heard) -> Severity {
        findings(heard, 5, 1_000_000)
            .iter()
            .map(|finding| finding.verdict)
            .max()
            .unwrap()
    }

    #[test]
    fn nodes_are_known_by_their_heartbeats() {
        let heard = heard(&[
            heartbeat::frame(5, nmt::State::PreOperational),
            heartbeat::frame(9, nmt::State::Operational),
            heartbeat::frame(9, nmt::State::Stopped),
        ]);
        let found = findings(&heard, 5, 1_000_000);
        assert_eq!(found.len(), 1);
        // Three heartbeats of 65 bits in 300 000 bits.
        assert_eq!(
            found[0].what,
            "heard within 0.3 s: node 5 pre-operational, node 9 stopped; 3 frames, 0.1 % of the bus"
        );
        assert_eq!(heard.figures(1_000_000).load, 195.0 / 300_000.0);
    }

    #[test]
    fn another_master_is_a_warning() {
        assert_eq!(worst(&heard(&[sync::FRAME])), Severity::Warning);
        assert_eq!(
            worst(&heard(&[nmt::Command::Start.frame(9)])),
            Severity::Warning
        );
        let commanded = heard(&[CanFrame::new(Id::standard(0x205), [0; 4])]);
        assert!(
            findings(&commanded, 5, 1_000_000)[1]
                .what
                .contains("set-points to node 5")
        );
        assert_eq!(
            worst(&heard(&[CanFrame::new(Id::standard(0x206), [0; 4])])),
            Severity::Ok,
            "another's drive"
        );
    }

    #[test]
    fn emergencies_are_put_into_words() {
        let frame = Emergency {
            code: 0x4210,
            register: 8,
            vendor: [0; 5],
        }
        .frame(5);
        let found = findings(&heard(&[frame]), 5, 1_000_000);
        assert_eq!(found[1].what, "node 5 sent emergency 0x4210: drive too hot");
        assert_eq!(found[1].verdict, Severity::Warning);
        assert_eq!(
            worst(&heard(&[Emergency::default().frame(5)])),
            Severity::Note
        );
    }

    #[test]
    fn what_the_controller_tells_is_told_once() {
        let mut heard = heard(&[]);
        for condition in [
            Condition::BusOff,
            Condition::NoAcknowledge,
            Condition::BusOff,
            Condition::Active,
        ] {
            heard.take(BusEvent::Condition(condition));
        }
        let verdicts: Vec<Severity> = findings(&heard, 5, 1_000_000)
            .iter()
            .map(|f| f.verdict)
            .collect();
        assert_eq!(
            verdicts,
            [Severity::Ok, Severity::Failure, Severity::Warning]
        );
    }

    #[test]
    fn a_vesc_is_known_by_its_status() {
        let status = CanFrame::new(vesc::status_id(23), [0, 0, 0, 0, 0xFF, 0xFB, 0, 0]);
        assert_eq!(
            heard(&[status, status]).vescs,
            BTreeMap::from([(23, (2, -5))])
        );
        assert!(heard(&[vesc::set_current(23, 1000)]).vescs.is_empty());
    }
}
