//! What all acting amplifiers have in common, so that one task carries each of them.

use super::super::cia402::State;
use super::super::frame::CanFrame;
use super::{DeviceFault, EmulatedDrive};

/// The device's side of a current amplifier on a CAN bus: frames and time go in, frames come out.
pub trait EmulatedAmplifier: Send {
    /// Takes a frame of the bus at time `now_ns`; frames to send are added to `out`.
    fn handle(&mut self, frame: &CanFrame, now_ns: u64, out: &mut Vec<CanFrame>);

    /// Lets time pass until `now_ns`; frames to send are added to `out`.
    fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>);

    /// The current that a real device would give, in amperes.
    fn current_a(&self) -> f64;

    /// What the device measures as its current, in amperes; `None`: what it commands.
    fn set_measured_current_a(&mut self, current_a: Option<f64>);

    /// State of the power stage in words.
    fn state(&self) -> &'static str;

    /// Whether current may flow.
    fn is_enabled(&self) -> bool;

    /// Whether this device can misbehave so.
    fn knows(&self, fault: DeviceFault) -> bool;

    /// Misbehaves from now on. What the device does not know changes nothing.
    fn inject(&mut self, fault: DeviceFault);
}

impl EmulatedAmplifier for EmulatedDrive {
    fn handle(&mut self, frame: &CanFrame, now_ns: u64, out: &mut Vec<CanFrame>) {
        EmulatedDrive::handle(self, frame, now_ns, out);
    }

    fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>) {
        EmulatedDrive::poll(self, now_ns, out);
    }

    fn current_a(&self) -> f64 {
        EmulatedDrive::current_a(self)
    }

    fn set_measured_current_a(&mut self, current_a: Option<f64>) {
        EmulatedDrive::set_measured_current_a(self, current_a);
    }

    fn state(&self) -> &'static str {
        self.power_state().name()
    }

    fn is_enabled(&self) -> bool {
        self.power_state() == State::OperationEnabled
    }

    fn knows(&self, _fault: DeviceFault) -> bool {
        true
    }

    fn inject(&mut self, fault: DeviceFault) {
        EmulatedDrive::inject(self, fault);
    }
}
