//! The interface of all emulated amplifiers.

use super::super::frame::CanFrame;
use super::fault::DeviceFault;

/// The device's side of a current amplifier on a CAN bus, without bus and clock.
pub trait EmulatedAmplifier: Send {
    /// Receives a frame at time `now_ns`; frames to send are appended to `out`.
    fn handle(&mut self, frame: &CanFrame, now_ns: u64, out: &mut Vec<CanFrame>);

    /// Advances the time to `now_ns`; frames to send are appended to `out`.
    fn poll(&mut self, now_ns: u64, out: &mut Vec<CanFrame>);

    /// The current that a real device would give, in amperes.
    fn current_a(&self) -> f64;

    /// Sets the current that the device measures, in amperes; `None`: the commanded current.
    fn set_measured_current_a(&mut self, current_a: Option<f64>);

    /// Name of the state of the power stage.
    fn state(&self) -> &'static str;

    /// Whether current may flow.
    fn is_enabled(&self) -> bool;

    /// Whether the device can have this fault.
    fn supports(&self, fault: DeviceFault) -> bool;

    /// Injects a fault. A fault that is not supported has no effect.
    fn inject(&mut self, fault: DeviceFault);
}
