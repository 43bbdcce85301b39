//! Faults of an emulated amplifier.

/// A fault of an emulated amplifier. Each replaces the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceFault {
    /// Nothing is sent; frames are still received.
    Mute,
    /// The cable is disconnected: nothing is sent or received.
    Unplugged,
    /// Status frames have a wrong length.
    ShortFrames,
    /// The statusword has a value that no state has.
    InvalidStatusword,
    /// The power stage fails: an emergency message with this code, then the state Fault.
    Drive(u16),
    /// An emergency message with this code, without a change of state.
    EmergencyOnly(u16),
    /// Operation stays enabled, but the target is not followed (bit 12 of the statusword is 0).
    TargetIgnored,
    /// Set-points are ignored, NMT commands are executed.
    SetPointsIgnored,
    /// Set-points and NMT commands are ignored; the heartbeat is still monitored.
    CommandsIgnored,
    /// The drive switches off without a fault.
    SwitchesOff,
    /// Everything is sent with this delay, in milliseconds.
    Late(u64),
    /// The device restarts as after a loss of power.
    Reset,
    /// No fault.
    None,
}
