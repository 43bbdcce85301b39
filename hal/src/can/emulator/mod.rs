//! The other end: a simulated CANopen drive and a simulated VESC, for tests and for rehearsal without hardware.
//!
//! Both are an [`EmulatedAmplifier`]; [`AmplifierTask`] joins one to a bus. [`EmulatedDrive`], the drive, is sans-I/O:
//! [`EmulatedDrive::handle`] takes a frame, [`EmulatedDrive::poll`] the passing of time, both give frames to send. It is written from the standards, not from the driver, so the two check each
//! other: object dictionary, SDO server, NMT, heartbeat producer and consumer, PDO with the rules of their mapping, and
//! the state machine of CiA 402.
//!
//! What matters of it is [`EmulatedDrive::current_a`]: the current that a real drive would give. It is quantised as in the
//! drive, and zero unless operation is enabled, whatever the bus says.

mod amplifier;
mod dictionary;
mod objects;
mod pdo;
mod power_stage;
mod task;
mod vesc;

use std::collections::VecDeque;

pub use amplifier::EmulatedAmplifier;
pub use dictionary::ObjectDictionary;
pub use objects::EmulatedDriveSettings;
pub use power_stage::Power;
pub use task::{AmplifierTask, FrameCounts, Observer};
pub use vesc::EmulatedVesc;

use super::emcy::Emergency;
use super::frame::CanFrame;
use super::sdo::{self, Address, Server};
use super::{cia402, heartbeat, nmt, sync};
use objects as object;

/// A misbehaviour on request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceFault {
    /// Sends nothing any more, but still hears.
    Mute,
    /// The cable is out: neither sends nor hears.
    Unplugged,
    /// Sends status frames of a wrong length.
    ShortFrames,
    /// Sends statuswords that no state has.
    InvalidStatusword,
    /// The power stage fails: emergency message with this code, then the state Fault.
    Drive(u16),
    /// An emergency message without a change of state.
    EmergencyOnly(u16),
    /// Operation stays enabled, but the target is not followed (bit 12 falls).
    TargetIgnored,
    /// Takes no set-points any more, but obeys NMT.
    SetPointsIgnored,
    /// Takes neither set-points nor NMT, but still watches the heartbeat.
    CommandsIgnored,
    /// Switches itself off without a fault.
    SwitchesOff,
    /// Sends everything this much later, in milliseconds.
    Late(u64),
    /// Restarts as after a loss of power.
    Reset,
    /// Back to a sound cable and interface.
    None,
}

/// A simulated drive.
#[derive(Debug)]
pub struct EmulatedDrive {
    settings: EmulatedDriveSettings,
    objects: ObjectDictionary,
    server: Server,
    power: Power,
    state: nmt::State,
    pdos: pdo::Pdos,
    heard: Option<u64>,
    heartbeat_due_ns: u64,
    misbehaviour: DeviceFault,
    outbox: VecDeque<(u64, CanFrame)>,
    now_ns: u64,
}

impl EmulatedDrive {
    /// A drive that has just got power; the first [`EmulatedDrive::poll`] sends the boot-up message.
    pub fn new(settings: EmulatedDriveSettings) -> EmulatedDrive {
        let objects = objects::dictionary(&settings);
        EmulatedDrive {
            settings,
            objects,
            server: Server::default(),
            power: Power::default(),
            state: nmt::State::BootUp,
            pdos: pdo::Pdos::default(),
            heard: None,
            heartbeat_due_ns: 0,
            misbehaviour: DeviceFault::None,
            outbox: VecDeque::new(),
            now_ns: 0,
        }
    }

    /// The current that flows, in amperes, as the drive would give it.
    pub fn current_a(&self) -> f64 {
        if !self.power.follows() {
            return 0.0;
        }
        let per_mille = f64::from(self.objects.number(object::TARGET) as u16 as i16);
        per_mille * self.settings.reference_a() / 1000.0
    }

    /// What the drive measures as its current, in amperes, for a simulation of the motor. Otherwise it measures what it
    /// commands.
    pub fn set_measured_current_a(&mut self, current_a: Option<f64>) {
        self.pdos.measured = current_a
            .map(|current_a| (current_a / self.settings.reference_a() * 1000.0).round() as i16);
    }

    /// Misbehaves from now on.
    pub fn inject(&mut self, fault: DeviceFault) {
        self.misbehaviour = fault;
        match fault {
            DeviceFault::Drive(code) => {
                self.emergency(code);
                self.power.fail();
            }
            DeviceFault::EmergencyOnly(code) => self.emergency(code),
            DeviceFault::SwitchesOff => self.power.switch_off(),
            DeviceFault::Reset => self.restart(),
            DeviceFault::Unplugged => self.outbox.clear(),
            _ => {}
        }
        self.power.ignores_target = fault == DeviceFault::TargetIgnored;
    }

    /// State of the power stage.
    pub fn power_state(&self) -> cia402::State {
        self.power.state()
    }

    /// State of communication.
    pub fn nmt_state(&self) -> nmt::State {
        self.state
    }

    /// The objects, as they are.
    pub fn objects(&self) -> &ObjectDictionary {
        &self.objects
    }

    /// Takes a frame of the bus at time `now_ns`; frames to send are added to `out`.
    pub fn handle(&mut self, frame: &CanFrame, now_ns: u64, out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        if self.misbehaviour != DeviceFault::Unplugged {
            self.dispatch(frame);
            self.reflect();
        }
        self.release(out);
    }

    /// Lets time pass until `now_ns`; frames to send are added to `out`.
    pub fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        if self.state == nmt::State::BootUp {
            self.state = nmt::State::PreOperational;
            self.send(heartbeat::frame(self.settings.node, nmt::State::BootUp));
        }
        self.power.settle();
        self.watch_master();
        self.beat();
        self.reflect();
        self.send_due_status();
        self.release(out);
    }

    fn dispatch(&mut self, frame: &CanFrame) {
        let (node, id) = (self.settings.node, frame.id());
        if id == nmt::COB_ID && self.misbehaviour != DeviceFault::CommandsIgnored {
            self.obey_nmt(frame.data());
        } else if id == sync::COB_ID {
            self.take_sync();
        } else if id == sdo::request_id(node) && self.state != nmt::State::Stopped {
            self.answer(frame.data());
        } else if self
            .watched()
            .is_some_and(|(master, _)| id == heartbeat::cob_id(master))
        {
            self.heard = heartbeat::decode(frame.data())
                .map(|_| self.now_ns)
                .or(self.heard);
        } else if self.state == nmt::State::Operational && !self.ignores_set_points() {
            self.take_set_point(frame);
        }
    }

    fn ignores_set_points(&self) -> bool {
        matches!(
            self.misbehaviour,
            DeviceFault::SetPointsIgnored | DeviceFault::CommandsIgnored
        )
    }

    fn obey_nmt(&mut self, data: &[u8]) {
        match nmt::Command::decode(data) {
            Some((_, node)) if node != 0 && node != self.settings.node => {}
            Some((nmt::Command::Start, _)) => self.state = nmt::State::Operational,
            Some((nmt::Command::EnterPreOperational, _)) => self.state = nmt::State::PreOperational,
            Some((nmt::Command::Stop, _)) => {
                self.state = nmt::State::Stopped;
                self.abort_connection();
            }
            Some((nmt::Command::ResetNode | nmt::Command::ResetCommunication, _)) => self.restart(),
            None => {}
        }
    }

    /// All objects, states and queues as after power-on; a requested lateness or muteness is gone with them.
    fn restart(&mut self) {
        let now_ns = self.now_ns;
        *self = EmulatedDrive::new(self.settings.clone());
        self.now_ns = now_ns;
    }

    fn answer(&mut self, request: &[u8]) {
        if let Some(answer) = self.server.answer(request, &mut self.objects) {
            self.send(CanFrame::new(sdo::answer_id(self.settings.node), answer));
        }
        if self.objects.take_written(object::CONTROLWORD) {
            self.power
                .obey(self.objects.number(object::CONTROLWORD) as u16);
        }
    }

    /// The watched master and its time limit in milliseconds.
    fn watched(&self) -> Option<(u8, u16)> {
        heartbeat::watched(self.objects.number(object::HEARTBEAT_CONSUMER))
    }

    /// Heartbeat consumer: begins with the first heartbeat, reacts once to its loss (CiA 301, 7.2.8.3.2.2).
    fn watch_master(&mut self) {
        let (Some((_, limit_ms)), Some(heard_ns)) = (self.watched(), self.heard) else {
            return;
        };
        if self.now_ns.saturating_sub(heard_ns) > u64::from(limit_ms) * 1_000_000 {
            self.heard = None;
            self.emergency(0x8130);
            self.state = nmt::State::PreOperational;
            self.abort_connection();
        }
    }

    /// Abort connection option code, 0x6007: 1 fault, 2 disable voltage, 3 quick stop.
    fn abort_connection(&mut self) {
        match self.objects.number(object::ABORT_CONNECTION) as u16 {
            1 => self.power.fail(),
            2 => self.power.switch_off(),
            3 => self.power.quick_stop(),
            _ => {}
        }
    }

    fn beat(&mut self) {
        let period_ns = u64::from(self.objects.number(object::HEARTBEAT_PRODUCER)) * 1_000_000;
        if period_ns > 0 && self.now_ns >= self.heartbeat_due_ns {
            self.heartbeat_due_ns = self.now_ns + period_ns;
            self.send(heartbeat::frame(self.settings.node, self.state));
        }
    }

    fn emergency(&mut self, code: u16) {
        let emergency = Emergency {
            code,
            register: 0x01,
            vendor: [0; 5],
        };
        self.send(emergency.frame(self.settings.node));
    }

    /// What the objects show of the states.
    fn reflect(&mut self) {
        self.power
            .set_mode(self.objects.number(object::MODE) as u8 as i8);
        let status = match self.misbehaviour {
            DeviceFault::InvalidStatusword => 0x0048,
            _ => self.power.statusword(),
        };
        let commanded = (self.current_a() / self.settings.reference_a() * 1000.0).round() as i16;
        self.objects.set(object::STATUSWORD, u32::from(status));
        self.objects.set(
            object::ACTUAL,
            u32::from(self.pdos.measured.unwrap_or(commanded) as u16),
        );
        self.objects
            .set(object::MODE_DISPLAY, u32::from(self.power.mode() as u8));
    }

    fn send(&mut self, frame: CanFrame) {
        let late_ns = match self.misbehaviour {
            DeviceFault::Mute | DeviceFault::Unplugged => return,
            DeviceFault::Late(late_ms) => late_ms.saturating_mul(1_000_000),
            _ => 0,
        };
        self.outbox
            .push_back((self.now_ns.saturating_add(late_ns), frame));
    }

    fn release(&mut self, out: &mut Vec<CanFrame>) {
        while let Some(&(due_ns, frame)) = self.outbox.front() {
            if due_ns > self.now_ns {
                break;
            }
            self.outbox.pop_front();
            out.push(frame);
        }
    }

    /// Reads an object as an SDO would, for tests and displays.
    pub fn read(&self, address: Address) -> u32 {
        self.objects.number(address)
    }
}

#[cfg(test)]
mod tests;
