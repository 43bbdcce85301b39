//! The probe's side of a protocol.

/// The probe's side of a protocol.
pub trait Responder: Send {
    /// Takes a measurement at `position_m`, in metres of the probe. Returns the bytes that the probe sends without a
    /// request; empty for a polled probe.
    fn measure(&mut self, position_m: f64) -> Vec<u8>;

    /// Receives one byte from the host. Returns the answer if the byte completes a request.
    fn receive(&mut self, byte: u8) -> Vec<u8>;

    /// Restarts the probe: its counter starts again and an unfinished message is cut off.
    fn restart(&mut self);

    /// A position outside the measuring range, in metres of the probe, for [`Fault::OutOfRange`](super::Fault::OutOfRange).
    fn out_of_range_m(&self) -> f64;
}
