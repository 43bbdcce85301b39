//! The traffic on the bus, by listening only.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use bench_hal::can::budget::{base_frame_bits, extended_frame_bits};
use bench_hal::can::bus::{BusError, BusEvent, Condition, Host};
use bench_hal::can::emcy::{self, Emergency};
use bench_hal::can::frame::{CanFrame, Id};
use bench_hal::can::{heartbeat, nmt, sync, vesc};
use serde::Serialize;

use super::can_interface::CHECK_BUS;
use super::finding::{Finding, Subject};

/// The received traffic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BusTraffic {
    /// Duration in seconds.
    pub seconds: f64,
    /// Frames.
    pub frames: u64,
    /// Bits of the frames, with worst-case stuffing.
    pub bits: u64,
    /// Heartbeats: node and its latest state.
    pub nodes: BTreeMap<u8, nmt::State>,
    /// Emergency messages: node and message.
    pub emergencies: Vec<(u8, Emergency)>,
    /// STATUS frames of VESCs: node, number of frames, and the latest current in units of 0.1 A.
    pub vescs: BTreeMap<u8, (u64, i16)>,
    /// Nodes that received set-points (their first receive PDO).
    pub commanded: BTreeSet<u8>,
    /// Whether a master sent SYNC or NMT commands.
    pub master: bool,
    /// Conditions that the controller reported, each once.
    pub conditions: Vec<Condition>,
}

/// Figures of the traffic.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BusFigures {
    /// Duration in seconds.
    pub listened_s: f64,
    /// Frames received.
    pub frames: u64,
    /// Worst-case bus load, as a ratio of the bit rate.
    pub load: f64,
    /// Nodes that sent a heartbeat.
    pub nodes: Vec<u8>,
}

/// Listens for `time`; sends nothing.
pub fn listen(host: &dyn Host, time: Duration) -> Result<BusTraffic, BusError> {
    let mut bus = host.endpoint(&[])?;
    let mut traffic = BusTraffic {
        seconds: time.as_secs_f64(),
        ..BusTraffic::default()
    };
    let end_ns = host.now_ns().saturating_add(time.as_nanos() as u64);
    loop {
        let left_ns = end_ns.saturating_sub(host.now_ns());
        if left_ns == 0 {
            return Ok(traffic);
        }
        if let Some(event) = bus.receive(Duration::from_nanos(left_ns))? {
            traffic.add(event);
        }
    }
}

impl BusTraffic {
    fn add(&mut self, event: BusEvent) {
        match event {
            BusEvent::Frame(frame) => self.add_frame(&frame),
            BusEvent::Condition(condition) => {
                if !self.conditions.contains(&condition) {
                    self.conditions.push(condition);
                }
            }
        }
    }

    fn add_frame(&mut self, frame: &CanFrame) {
        let (id, data) = (frame.id(), frame.data());
        let bytes = data.len() as u32;
        self.frames += 1;
        if id.is_extended() {
            self.bits += u64::from(extended_frame_bits(bytes));
            self.add_vesc_status(id, data);
        } else {
            self.bits += u64::from(base_frame_bits(bytes));
            self.add_canopen(id, data);
        }
    }

    fn add_canopen(&mut self, id: Id, data: &[u8]) {
        let node = (id.raw() & 0x7F) as u8;
        if id == nmt::COB_ID || id == sync::FRAME.id() {
            self.master = true;
            return;
        }
        match id.raw() & 0x780 {
            0x080 => {
                let emergency = Emergency::decode(data);
                self.emergencies.extend(emergency.map(|e| (node, e)));
            }
            0x200 => self.commanded.extend([node]),
            0x700 => {
                let state = heartbeat::decode(data);
                self.nodes.extend(state.map(|state| (node, state)));
            }
            _ => {}
        }
    }

    fn add_vesc_status(&mut self, id: Id, data: &[u8]) {
        let node = (id.raw() & 0xFF) as u8;
        if id != vesc::status_id(node) {
            return;
        }
        if let Some(current) = vesc::status_current(data) {
            let (count, latest) = self.vescs.entry(node).or_default();
            (*count, *latest) = (*count + 1, current);
        }
    }

    /// The figures, on a bus of `bit_rate` bit/s.
    pub fn figures(&self, bit_rate: u32) -> BusFigures {
        let capacity_bits = f64::from(bit_rate) * self.seconds;
        BusFigures {
            listened_s: self.seconds,
            frames: self.frames,
            load: self.bits as f64 / capacity_bits.max(1.0),
            nodes: self.nodes.keys().copied().collect(),
        }
    }
}

/// Evaluates the traffic for a run with `node`, which no other process of this program uses.
pub fn findings(traffic: &BusTraffic, node: u8, bit_rate: u32) -> Vec<Finding> {
    let mut findings = vec![nodes(traffic, bit_rate)];
    findings.extend(traffic.conditions.iter().filter_map(|c| condition(*c)));
    let emergencies = traffic.emergencies.iter();
    findings.extend(emergencies.map(|(from, e)| emergency(*from, e)));
    findings.extend(other_master(traffic, node));
    findings
}

fn other_master(traffic: &BusTraffic, node: u8) -> Option<Finding> {
    let remedy = "end the other program, or disconnect the other controller";
    if traffic.commanded.contains(&node) {
        let what = format!("another master sends set-points to node {node}");
        return Some(Subject::CanNodes.warning(what, remedy));
    }
    let remedy = format!("{remedy}, unless it is intended");
    let what = "another master sends SYNC or NMT commands";
    traffic
        .master
        .then(|| Subject::CanNodes.warning(what, remedy))
}

fn nodes(traffic: &BusTraffic, bit_rate: u32) -> Finding {
    let heartbeats = traffic.nodes.iter();
    let heartbeats = heartbeats.map(|(node, state)| format!("node {node} {}", state_name(*state)));
    let vescs = traffic.vescs.keys().map(|node| format!("VESC {node}"));
    let names: Vec<String> = heartbeats.chain(vescs).collect();
    let names = if names.is_empty() {
        "no heartbeat and no STATUS".into()
    } else {
        names.join(", ")
    };
    let percent = 100.0 * traffic.figures(bit_rate).load;
    Subject::CanNodes.ok(format!(
        "received within {} s: {names}; {} frames, {percent:.1} % of the bus",
        traffic.seconds, traffic.frames
    ))
}

/// The name of an NMT state.
pub(super) fn state_name(state: nmt::State) -> &'static str {
    match state {
        nmt::State::BootUp => "starting",
        nmt::State::Stopped => "stopped",
        nmt::State::Operational => "operational",
        nmt::State::PreOperational => "pre-operational",
    }
}

fn condition(condition: Condition) -> Option<Finding> {
    let what = match condition {
        Condition::BusOff => "the controller went into bus-off",
        Condition::Passive => "the controller became error passive",
        Condition::Overflow => "frames were lost",
        Condition::Warning => "the controller reports many errors",
        Condition::NoAcknowledge => "no node acknowledges frames",
        Condition::Noise => "errors on the wire",
        Condition::Active => return None,
    };
    Some(match condition {
        Condition::BusOff | Condition::Passive => Subject::CanState.failure(what, CHECK_BUS),
        _ => Subject::CanState.warning(what, CHECK_BUS),
    })
}

fn emergency(node: u8, emergency: &Emergency) -> Finding {
    let code = emergency.code;
    let what = format!(
        "node {node} sent emergency 0x{code:04X}: {}",
        emcy::text(code)
    );
    match code {
        0 => Subject::CanNodes.note(what, "none: the error is over"),
        _ => Subject::CanNodes.warning(
            what,
            "remove the cause; the manual of the drive explains the vendor's bytes",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn traffic(frames: &[CanFrame]) -> BusTraffic {
        let mut traffic = BusTraffic {
            seconds: 0.3,
            ..BusTraffic::default()
        };
        for frame in frames {
            traffic.add(BusEvent::Frame(*frame));
        }
        traffic
    }

    fn worst(traffic: &BusTraffic) -> Severity {
        let findings = findings(traffic, 5, 1_000_000);
        findings.iter().map(|f| f.severity).max().unwrap()
    }

    #[test]
    fn nodes_are_detected_by_their_heartbeats() {
        let traffic = traffic(&[
            heartbeat::frame(5, nmt::State::PreOperational),
            heartbeat::frame(9, nmt::State::Operational),
            heartbeat::frame(9, nmt::State::Stopped),
        ]);
        let found = findings(&traffic, 5, 1_000_000);
        assert_eq!(found.len(), 1);
        // Three heartbeats of 65 bits in 300 000 bits.
        assert_eq!(
            found[0].what,
            "received within 0.3 s: node 5 pre-operational, node 9 stopped; 3 frames, 0.1 % of the bus"
        );
        assert_eq!(traffic.figures(1_000_000).load, 195.0 / 300_000.0);
    }

    #[test]
    fn another_master_is_a_warning() {
        assert_eq!(worst(&traffic(&[sync::FRAME])), Severity::Warning);
        let start = nmt::Command::Start.frame(9);
        assert_eq!(worst(&traffic(&[start])), Severity::Warning);
        let set_point = |id| CanFrame::new(Id::standard(id), [0; 4]);
        let commanded = traffic(&[set_point(0x205)]);
        let found = findings(&commanded, 5, 1_000_000);
        assert!(found[1].what.contains("set-points to node 5"));
        let other = traffic(&[set_point(0x206)]);
        assert_eq!(worst(&other), Severity::Ok, "of another drive");
    }

    #[test]
    fn emergencies_are_reported_with_their_meaning() {
        let frame = Emergency {
            code: 0x4210,
            register: 8,
            vendor: [0; 5],
        }
        .frame(5);
        let found = findings(&traffic(&[frame]), 5, 1_000_000);
        let code = "node 5 sent emergency 0x4210: ";
        assert!(found[1].what.starts_with(code), "{}", found[1].what);
        assert_eq!(found[1].severity, Severity::Warning);
        let over = Emergency::default().frame(5);
        assert_eq!(worst(&traffic(&[over])), Severity::Note);
    }

    #[test]
    fn conditions_of_the_controller_are_reported_once() {
        let mut traffic = traffic(&[]);
        for condition in [
            Condition::BusOff,
            Condition::NoAcknowledge,
            Condition::BusOff,
            Condition::Active,
        ] {
            traffic.add(BusEvent::Condition(condition));
        }
        let found = findings(&traffic, 5, 1_000_000);
        let severities: Vec<Severity> = found.iter().map(|f| f.severity).collect();
        assert_eq!(
            severities,
            [Severity::Ok, Severity::Failure, Severity::Warning]
        );
    }

    #[test]
    fn a_vesc_is_detected_by_its_status() {
        let data = [0, 0, 0, 0, 0xFF, 0xFB, 0, 0];
        let status = CanFrame::new(vesc::status_id(23), data);
        let vescs = traffic(&[status, status]).vescs;
        assert_eq!(vescs, BTreeMap::from([(23, (2, -5))]));
        assert!(traffic(&[vesc::set_current(23, 1000)]).vescs.is_empty());
    }
}
