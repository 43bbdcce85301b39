//! Process data of the emulated drive, by the mapping and the transmission types in the object dictionary.

use super::super::frame::{CanFrame, Id};
use super::super::pdo::{Direction, OFF, parameters};
use super::super::sdo::{Address, Dictionary};
use super::dictionary::ObjectDictionary;

/// Emergency code: PDO not processed because of its length.
const WRONG_LENGTH: u16 = 0x8210;

/// State of the four receive and four transmit PDOs.
#[derive(Debug, Default)]
pub(super) struct Pdos {
    /// Synchronous set-points that wait for SYNC.
    waiting: [Option<CanFrame>; 4],
    sent: [SentFrame; 4],
}

/// The last frame that was sent of a transmit PDO.
#[derive(Clone, Copy, Debug, Default)]
struct SentFrame {
    /// SYNCs since the last frame.
    syncs: u32,
    time_ns: Option<u64>,
    frame: Option<CanFrame>,
}

impl Pdos {
    /// Takes a frame if it is a set-point: immediately, or with the next SYNC. The error is an emergency code.
    pub(super) fn receive(
        &mut self,
        frame: &CanFrame,
        objects: &mut ObjectDictionary,
    ) -> Result<(), u16> {
        let mut result = Ok(());
        for (number, waiting) in (1..).zip(&mut self.waiting) {
            let pdo = Parameters::read(objects, Direction::Receive, number);
            if !pdo.is_on || pdo.id != frame.id() {
                continue;
            }
            if pdo.is_synchronous() {
                *waiting = Some(*frame);
            } else {
                result = result.and(unpack(&pdo, frame, objects));
            }
        }
        result
    }

    /// Takes the set-points that wait for SYNC. The error is an emergency code.
    pub(super) fn apply_waiting(&mut self, objects: &mut ObjectDictionary) -> Result<(), u16> {
        let mut result = Ok(());
        for (number, waiting) in (1..).zip(&mut self.waiting) {
            if let Some(frame) = waiting.take() {
                let pdo = Parameters::read(objects, Direction::Receive, number);
                result = result.and(unpack(&pdo, &frame, objects));
            }
        }
        result
    }

    /// Status frames at a SYNC: of transmission type n every n-th.
    pub(super) fn synchronous_status(
        &mut self,
        objects: &ObjectDictionary,
        now_ns: u64,
    ) -> Vec<CanFrame> {
        let mut frames = Vec::new();
        for (number, sent) in (1..).zip(&mut self.sent) {
            let pdo = Parameters::read(objects, Direction::Transmit, number);
            sent.syncs = sent.syncs.saturating_add(1);
            let is_cyclic = pdo.is_on && pdo.is_synchronous() && pdo.transmission > 0;
            if is_cyclic && sent.syncs >= u32::from(pdo.transmission) {
                sent.syncs = 0;
                frames.extend(sent.record_sent(pack(&pdo, objects), now_ns));
            }
        }
        frames
    }

    /// Asynchronous status frames: on a change, but not before the inhibit time, and not later than the event timer.
    pub(super) fn due_status(&mut self, objects: &ObjectDictionary, now_ns: u64) -> Vec<CanFrame> {
        let mut frames = Vec::new();
        for (number, sent) in (1..).zip(&mut self.sent) {
            let pdo = Parameters::read(objects, Direction::Transmit, number);
            if !pdo.is_on || pdo.transmission < 254 {
                continue;
            }
            let frame = pack(&pdo, objects);
            if sent.is_due(&pdo, frame, now_ns) {
                frames.extend(sent.record_sent(frame, now_ns));
            }
        }
        frames
    }
}

impl SentFrame {
    fn is_due(&self, pdo: &Parameters, frame: Option<CanFrame>, now_ns: u64) -> bool {
        let elapsed_ns = self
            .time_ns
            .map_or(u64::MAX, |time_ns| now_ns.saturating_sub(time_ns));
        let is_changed = self.frame != frame && elapsed_ns >= pdo.inhibit_ns;
        let is_timed = pdo.timer_ns > 0 && elapsed_ns >= pdo.timer_ns;
        is_changed || is_timed
    }

    /// Stores `frame` as sent now; without a mapping there is no frame.
    fn record_sent(&mut self, frame: Option<CanFrame>, now_ns: u64) -> Option<CanFrame> {
        if frame.is_some() {
            self.time_ns = Some(now_ns);
            self.frame = frame;
        }
        frame
    }
}

/// Parameters of a PDO in the object dictionary.
struct Parameters {
    id: Id,
    is_on: bool,
    transmission: u8,
    inhibit_ns: u64,
    timer_ns: u64,
    /// Index of the mapping.
    mapping: u16,
}

impl Parameters {
    fn read(objects: &ObjectDictionary, direction: Direction, number: u8) -> Parameters {
        let index = parameters(direction, number);
        let [cob_id, transmission, inhibit, timer] =
            [1, 2, 3, 5].map(|sub| objects.number(Address::new(index, sub)));
        Parameters {
            id: Id::standard(cob_id as u16),
            is_on: cob_id & OFF == 0,
            transmission: transmission as u8,
            inhibit_ns: u64::from(inhibit) * 100_000,
            timer_ns: u64::from(timer) * 1_000_000,
            mapping: index + 0x200,
        }
    }

    fn is_synchronous(&self) -> bool {
        self.transmission <= 240
    }
}

/// A frame with the mapped objects in order; `None` if nothing is mapped.
fn pack(pdo: &Parameters, objects: &ObjectDictionary) -> Option<CanFrame> {
    let mapping = objects.mapping(pdo.mapping);
    let values = mapping
        .iter()
        .filter_map(|mapped| objects.read(mapped.address()).ok());
    let bytes: Vec<u8> = values.flatten().collect();
    if bytes.is_empty() {
        None
    } else {
        CanFrame::from_slice(pdo.id, &bytes)
    }
}

/// Writes the mapped objects. A frame that is shorter than the mapping is refused.
fn unpack(pdo: &Parameters, frame: &CanFrame, objects: &mut ObjectDictionary) -> Result<(), u16> {
    let mapping = objects.mapping(pdo.mapping);
    let lengths = mapping.iter().map(|mapped| usize::from(mapped.bits() / 8));
    if frame.data().len() < lengths.clone().sum() {
        return Err(WRONG_LENGTH);
    }
    let mut rest = frame.data();
    for (mapped, length) in mapping.iter().zip(lengths) {
        let (value, after) = rest.split_at(length.min(rest.len()));
        rest = after;
        let _ = objects.write(mapped.address(), value); // a value out of range is ignored
    }
    Ok(())
}
