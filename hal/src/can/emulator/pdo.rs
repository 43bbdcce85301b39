//! Process data of the simulated drive: set-points taken, status sent, by the mapping and the transmission types in force.

use super::super::frame::{CanFrame, Id};
use super::super::nmt;
use super::super::pdo::{Direction, OFF, parameters};
use super::super::sdo::{Address, Dictionary};
use super::{DeviceFault, EmulatedDrive, objects as object};

/// What is remembered between frames.
#[derive(Debug, Default)]
pub(super) struct Pdos {
    /// A current from outside, in counts.
    pub(super) measured: Option<i16>,
    /// Synchronous set-points that wait for SYNC.
    waiting: [Option<CanFrame>; 4],
    sent: [Sent; 4],
}

#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    syncs: u32,
    at_ns: Option<u64>,
    content: Option<CanFrame>,
}

/// Parameters of one PDO, as they stand in the dictionary.
struct Parameters {
    id: Id,
    is_on: bool,
    transmission: u8,
    inhibit_ns: u64,
    timer_ns: u64,
    mapping: u16,
}

impl EmulatedDrive {
    fn pdo_parameters(&self, direction: Direction, number: u8) -> Parameters {
        let index = parameters(direction, number);
        let value = |sub| self.objects.number(Address::new(index, sub));
        Parameters {
            id: Id::standard(value(1) as u16),
            is_on: value(1) & OFF == 0,
            transmission: value(2) as u8,
            inhibit_ns: u64::from(value(3)) * 100_000,
            timer_ns: u64::from(value(5)) * 1_000_000,
            mapping: index + 0x200,
        }
    }

    /// Takes a frame if it is a set-point: now, or with the next SYNC.
    pub(super) fn take_set_point(&mut self, frame: &CanFrame) {
        for number in 1..=4 {
            let pdo = self.pdo_parameters(Direction::Receive, number);
            if !pdo.is_on || pdo.id != frame.id() {
                continue;
            }
            if pdo.transmission <= 240 {
                self.pdos.waiting[usize::from(number - 1)] = Some(*frame);
            } else {
                self.unpack(pdo.mapping, frame);
            }
        }
    }

    /// SYNC: waiting set-points take effect, then status is sampled.
    pub(super) fn take_sync(&mut self) {
        if self.state != nmt::State::Operational {
            return;
        }
        for number in 1..=4 {
            if let Some(frame) = self.pdos.waiting[usize::from(number - 1)].take() {
                let mapping = self.pdo_parameters(Direction::Receive, number).mapping;
                self.unpack(mapping, &frame);
            }
        }
        self.reflect();
        for number in 1..=4 {
            let pdo = self.pdo_parameters(Direction::Transmit, number);
            let sent = &mut self.pdos.sent[usize::from(number - 1)];
            sent.syncs = sent.syncs.saturating_add(1);
            if pdo.is_on
                && (1..=240).contains(&pdo.transmission)
                && sent.syncs >= u32::from(pdo.transmission)
            {
                sent.syncs = 0;
                self.send_status(number, &pdo);
            }
        }
    }

    /// Asynchronous status: on change, not before the inhibit time, and not later than the event timer.
    pub(super) fn send_due_status(&mut self) {
        if self.state != nmt::State::Operational {
            return;
        }
        for number in 1..=4 {
            let pdo = self.pdo_parameters(Direction::Transmit, number);
            if !pdo.is_on || pdo.transmission < 254 {
                continue;
            }
            let sent = self.pdos.sent[usize::from(number - 1)];
            let since_ns = sent
                .at_ns
                .map_or(u64::MAX, |at_ns| self.now_ns.saturating_sub(at_ns));
            let changed = sent.content != self.pack(&pdo);
            let timed = pdo.timer_ns > 0 && since_ns >= pdo.timer_ns;
            if (changed && since_ns >= pdo.inhibit_ns) || timed {
                self.send_status(number, &pdo);
            }
        }
    }

    fn send_status(&mut self, number: u8, pdo: &Parameters) {
        let Some(frame) = self.pack(pdo) else { return };
        let sent = &mut self.pdos.sent[usize::from(number - 1)];
        (sent.at_ns, sent.content) = (Some(self.now_ns), Some(frame));
        let cut = match self.misbehaviour {
            DeviceFault::ShortFrames => frame.data().len().saturating_sub(1),
            _ => frame.data().len(),
        };
        if let Some(frame) = CanFrame::from_slice(pdo.id, &frame.data()[..cut]) {
            self.send(frame);
        }
    }

    /// The mapped objects in order; nothing is mapped, nothing is sent.
    fn pack(&self, pdo: &Parameters) -> Option<CanFrame> {
        let words = self.objects.mapping(pdo.mapping);
        let bytes: Vec<u8> = words
            .iter()
            .filter_map(|word| self.objects.read(word.address()).ok())
            .flatten()
            .collect();
        if bytes.is_empty() {
            None
        } else {
            CanFrame::from_slice(pdo.id, &bytes)
        }
    }

    /// Writes the mapped objects; a frame shorter than its mapping is not taken (emergency 0x8210).
    fn unpack(&mut self, mapping: u16, frame: &CanFrame) {
        let words = self.objects.mapping(mapping);
        let wanted: usize = words.iter().map(|word| usize::from(word.bits() / 8)).sum();
        if frame.data().len() < wanted {
            return self.emergency(0x8210);
        }
        let mut rest = frame.data();
        for word in words {
            let (value, after) = rest.split_at(usize::from(word.bits() / 8).min(rest.len()));
            rest = after;
            let _ = self.objects.write(word.address(), value); // a value out of range is left out
        }
        if self.objects.take_written(object::CONTROLWORD) {
            self.power
                .obey(self.objects.number(object::CONTROLWORD) as u16);
        }
    }
}
