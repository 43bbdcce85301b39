//! An emulated CANopen drive: object dictionary, SDO server, NMT, heartbeat producer and consumer, PDO, and the state machine
//! of CiA 402.

use std::collections::VecDeque;

use super::super::emcy::Emergency;
use super::super::frame::CanFrame;
use super::super::objects as object;
use super::super::sdo::{self, Address, Server};
use super::super::{cia402, heartbeat, nmt, sync};
use super::amplifier::EmulatedAmplifier;
use super::dictionary::ObjectDictionary;
use super::drive_objects::{EmulatedDriveSettings, dictionary};
use super::fault::DeviceFault;
use super::pdo::Pdos;
use super::power_stage::PowerStage;

/// An emulated drive.
///
/// ```
/// use bench_hal::can::emulator::{EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings};
///
/// let mut drive = EmulatedDrive::new(EmulatedDriveSettings::default());
/// let mut frames = Vec::new();
/// drive.poll(0, &mut frames);
/// assert_eq!(frames[0].id().raw(), 0x705); // the boot-up message of node 5
/// assert_eq!(drive.current_a(), 0.0);
/// ```
#[derive(Debug)]
pub struct EmulatedDrive {
    settings: EmulatedDriveSettings,
    objects: ObjectDictionary,
    server: Server,
    power: PowerStage,
    state: nmt::State,
    pdos: Pdos,
    /// Measured current in counts; `None`: as commanded.
    measured: Option<i16>,
    /// Last heartbeat of the monitored master; `None` while it is not monitored.
    master_heartbeat_ns: Option<u64>,
    next_heartbeat_ns: u64,
    fault: DeviceFault,
    /// Frames to send, with the time at which they are due.
    outbox: VecDeque<(u64, CanFrame)>,
    now_ns: u64,
}

impl EmulatedDrive {
    /// A drive after power-on; the first [`poll`](EmulatedAmplifier::poll) sends the boot-up message.
    pub fn new(settings: EmulatedDriveSettings) -> EmulatedDrive {
        EmulatedDrive {
            objects: dictionary(&settings),
            settings,
            server: Server::default(),
            power: PowerStage::default(),
            state: nmt::State::BootUp,
            pdos: Pdos::default(),
            measured: None,
            master_heartbeat_ns: None,
            next_heartbeat_ns: 0,
            fault: DeviceFault::None,
            outbox: VecDeque::new(),
            now_ns: 0,
        }
    }

    /// State of the power stage.
    pub fn power_state(&self) -> cia402::State {
        self.power.state()
    }

    /// State of the communication.
    pub fn nmt_state(&self) -> nmt::State {
        self.state
    }

    /// The object dictionary.
    pub fn objects(&self) -> &ObjectDictionary {
        &self.objects
    }

    /// The value of an object, 0 if it does not exist.
    pub fn read(&self, address: Address) -> u32 {
        self.objects.number(address)
    }

    fn dispatch(&mut self, frame: &CanFrame) {
        let id = frame.id();
        if id == nmt::COB_ID {
            self.take_nmt_command(frame.data());
        } else if id == sync::COB_ID {
            self.take_sync();
        } else if id == sdo::request_id(self.settings.node) {
            self.answer_sdo(frame.data());
        } else if self.is_master_heartbeat(frame) {
            self.master_heartbeat_ns = Some(self.now_ns);
        } else {
            self.take_set_point(frame);
        }
    }

    fn take_nmt_command(&mut self, data: &[u8]) {
        let Some((command, node)) = nmt::Command::decode(data) else {
            return;
        };
        let is_addressed = node == 0 || node == self.settings.node;
        if !is_addressed || self.fault == DeviceFault::CommandsIgnored {
            return;
        }
        match command {
            nmt::Command::Start => self.state = nmt::State::Operational,
            nmt::Command::EnterPreOperational => self.state = nmt::State::PreOperational,
            nmt::Command::Stop => {
                self.state = nmt::State::Stopped;
                self.abort_connection();
            }
            nmt::Command::ResetNode | nmt::Command::ResetCommunication => self.restart(),
        }
    }

    /// Restores objects, states and queues as after power-on; this also ends an injected fault.
    fn restart(&mut self) {
        *self = EmulatedDrive {
            now_ns: self.now_ns,
            ..EmulatedDrive::new(self.settings.clone())
        };
    }

    fn answer_sdo(&mut self, request: &[u8]) {
        if self.state == nmt::State::Stopped {
            return;
        }
        if let Some(answer) = self.server.answer(request, &mut self.objects) {
            self.send(CanFrame::new(sdo::answer_id(self.settings.node), answer));
        }
        self.take_controlword();
    }

    /// Passes a controlword that was written to the power stage.
    fn take_controlword(&mut self) {
        if self.objects.take_written(object::CONTROLWORD) {
            let controlword = self.objects.number(object::CONTROLWORD) as u16;
            self.power.take_controlword(controlword);
        }
    }

    fn take_set_point(&mut self, frame: &CanFrame) {
        let is_ignored = matches!(
            self.fault,
            DeviceFault::SetPointsIgnored | DeviceFault::CommandsIgnored
        );
        if self.state == nmt::State::Operational && !is_ignored {
            let received = self.pdos.receive(frame, &mut self.objects);
            self.finish_set_points(received);
        }
    }

    /// SYNC: the waiting set-points take effect, then the status is sampled.
    fn take_sync(&mut self) {
        if self.state != nmt::State::Operational {
            return;
        }
        let received = self.pdos.apply_waiting(&mut self.objects);
        self.finish_set_points(received);
        self.update_objects();
        let frames = self.pdos.synchronous_status(&self.objects, self.now_ns);
        self.send_status(frames);
    }

    fn finish_set_points(&mut self, received: Result<(), u16>) {
        if let Err(code) = received {
            self.send_emergency(code);
        }
        self.take_controlword();
    }

    fn send_due_status(&mut self) {
        if self.state == nmt::State::Operational {
            let frames = self.pdos.due_status(&self.objects, self.now_ns);
            self.send_status(frames);
        }
    }

    fn send_status(&mut self, frames: Vec<CanFrame>) {
        for frame in frames {
            let lost = usize::from(self.fault == DeviceFault::ShortFrames);
            let length = frame.data().len().saturating_sub(lost);
            let frame = CanFrame::from_slice(frame.id(), &frame.data()[..length]);
            frame.into_iter().for_each(|frame| self.send(frame));
        }
    }

    /// The monitored master and its timeout in milliseconds.
    fn monitored_master(&self) -> Option<(u8, u16)> {
        heartbeat::monitored(self.objects.number(object::HEARTBEAT_CONSUMER))
    }

    fn is_master_heartbeat(&self, frame: &CanFrame) -> bool {
        let master = self.monitored_master();
        master.is_some_and(|(node, _)| frame.id() == heartbeat::cob_id(node))
            && heartbeat::decode(frame.data()).is_some()
    }

    /// Heartbeat consumer: starts with the first heartbeat and reacts once to its loss (CiA 301, 7.2.8.3.2.2).
    fn monitor_master(&mut self) {
        let (Some((_, timeout_ms)), Some(last_ns)) =
            (self.monitored_master(), self.master_heartbeat_ns)
        else {
            return;
        };
        if self.now_ns.saturating_sub(last_ns) > u64::from(timeout_ms) * 1_000_000 {
            self.master_heartbeat_ns = None;
            self.send_emergency(0x8130);
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

    fn send_boot_up(&mut self) {
        if self.state == nmt::State::BootUp {
            self.state = nmt::State::PreOperational;
            self.send(heartbeat::frame(self.settings.node, nmt::State::BootUp));
        }
    }

    fn send_due_heartbeat(&mut self) {
        let period_ns = u64::from(self.objects.number(object::HEARTBEAT_PRODUCER)) * 1_000_000;
        if period_ns > 0 && self.now_ns >= self.next_heartbeat_ns {
            self.next_heartbeat_ns = self.now_ns + period_ns;
            self.send(heartbeat::frame(self.settings.node, self.state));
        }
    }

    fn send_emergency(&mut self, code: u16) {
        let emergency = Emergency {
            code,
            register: 0x01,
            vendor: [0; 5],
        };
        self.send(emergency.frame(self.settings.node));
    }

    /// Updates mode, statusword and actual current.
    fn update_objects(&mut self) {
        let mode = self.objects.number(object::MODE) as u8;
        self.power.set_mode(mode as i8);
        let statusword = match self.fault {
            DeviceFault::InvalidStatusword => 0x0048,
            _ => self.power.statusword(),
        };
        let actual = self.measured.unwrap_or(self.counts(self.current_a()));
        self.objects.set(object::STATUSWORD, statusword.into());
        self.objects.set(object::ACTUAL, u32::from(actual as u16));
        self.objects.set(object::MODE_DISPLAY, mode.into());
    }

    fn counts(&self, current_a: f64) -> i16 {
        (current_a / self.settings.reference_a() * 1000.0).round() as i16
    }

    fn send(&mut self, frame: CanFrame) {
        let delay_ns = match self.fault {
            DeviceFault::Mute | DeviceFault::Unplugged => return,
            DeviceFault::Late(delay_ms) => delay_ms.saturating_mul(1_000_000),
            _ => 0,
        };
        let due_ns = self.now_ns.saturating_add(delay_ns);
        self.outbox.push_back((due_ns, frame));
    }

    fn take_due(&mut self, out: &mut Vec<CanFrame>) {
        let now_ns = self.now_ns;
        while let Some((_, frame)) = self.outbox.pop_front_if(|(due_ns, _)| *due_ns <= now_ns) {
            out.push(frame);
        }
    }
}

impl EmulatedAmplifier for EmulatedDrive {
    fn handle(&mut self, frame: &CanFrame, now_ns: u64, out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        if self.fault != DeviceFault::Unplugged {
            self.dispatch(frame);
            self.update_objects();
        }
        self.take_due(out);
    }

    fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>) {
        self.now_ns = self.now_ns.max(now_ns);
        self.send_boot_up();
        self.power.advance();
        self.monitor_master();
        self.send_due_heartbeat();
        self.update_objects();
        self.send_due_status();
        self.take_due(out);
    }

    fn current_a(&self) -> f64 {
        if !self.power.follows() {
            return 0.0;
        }
        let per_mille = self.objects.number(object::TARGET) as u16 as i16;
        f64::from(per_mille) * self.settings.reference_a() / 1000.0
    }

    fn set_measured_current_a(&mut self, current_a: Option<f64>) {
        self.measured = current_a.map(|current_a| self.counts(current_a));
    }

    fn state(&self) -> &'static str {
        self.power.state().name()
    }

    fn is_enabled(&self) -> bool {
        self.power.state() == cia402::State::OperationEnabled
    }

    fn supports(&self, _fault: DeviceFault) -> bool {
        true
    }

    fn inject(&mut self, fault: DeviceFault) {
        self.fault = fault;
        match fault {
            DeviceFault::Drive(code) => {
                self.send_emergency(code);
                self.power.fail();
            }
            DeviceFault::EmergencyOnly(code) => self.send_emergency(code),
            DeviceFault::SwitchesOff => self.power.switch_off(),
            DeviceFault::Reset => self.restart(),
            DeviceFault::Unplugged => self.outbox.clear(),
            _ => {}
        }
        self.power.ignores_target = fault == DeviceFault::TargetIgnored;
    }
}

#[cfg(test)]
mod tests;
