//! What the loop publishes: one [`TickRecord`] per tick and an [`Event`] at every change. Plain copies without
//! allocation, so that they can leave the tick through a wait-free ring.

use bench_hal::{DeviceError, FaultText, Validity};
use serde::{Deserialize, Serialize};

use super::arming::{State, Trip};
use super::tuning::Tune;

/// All signals of one tick, taken together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickRecord {
    /// Number of the tick; a gap means ticks missed (see `missed_ticks`) or records lost.
    pub tick: u64,
    /// When the tick was due, in nanoseconds since the loop started.
    pub scheduled_ns: u64,
    /// When it began (equal to `scheduled_ns` in virtual pace).
    pub woke_ns: u64,
    /// When its command was written (equal to `scheduled_ns` in virtual pace).
    pub done_ns: u64,
    /// Reference r in metres.
    pub reference_m: f64,
    /// Measurement y in metres.
    pub position_m: f64,
    /// Request of the program in amperes, before the interlocks.
    pub requested_a: f64,
    /// Command u in amperes as the amplifier gives it: after the interlocks, quantised and limited. It takes effect after the
    /// configured computing delay; a trip or a stop in the meantime cancels it.
    pub command_a: f64,
    /// Reading of the probe in metres before the correction by a calibration; `None` if no calibration is in use.
    pub raw_position_m: Option<f64>,
    /// Set-point in amperes as the amplifier accepted it, before the correction by a calibration; `None` if no calibration is
    /// in use.
    pub raw_command_a: Option<f64>,
    /// The current in amperes that the amplifier measures, if it measures one: as of its last status.
    pub actual_a: Option<f64>,
    /// The probe's own count of measurements.
    pub probe_sequence: u64,
    /// Age of the measurement in nanoseconds.
    pub probe_age_ns: u64,
    /// Whether the measurement may be used.
    pub validity: Validity,
    /// State of the arming machine after the tick.
    pub state: State,
    /// See [`flag`].
    pub flags: u32,
    /// Scheduled ticks that passed unserved right before this one.
    pub missed_ticks: u32,
}

/// Bits of [`TickRecord::flags`].
pub mod flag {
    /// The program was running and the loop closed (or the excitation on): not in the zero-current intervals before
    /// and after.
    pub const ACTIVE: u32 = 1;
    /// The amplifier gives another current than requested.
    pub const LIMITED: u32 = 2;
    /// This tick began more than one period late; `missed_ticks` is the number of lost ticks.
    pub const OVERRUN: u32 = 4;
    /// The reading was not valid.
    pub const INVALID: u32 = 8;
    /// The interlocks tripped in this tick.
    pub const TRIPPED: u32 = 16;
}

/// Something changed at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// The tick at which it took effect.
    pub tick: u64,
    /// Kind of the event.
    pub kind: EventKind,
}

/// Kind of an [`Event`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind {
    /// A request was taken, and accepted or refused.
    Request(RequestEvent),
    /// The arming machine went from one state to another.
    State {
        /// State before.
        from: State,
        /// State after.
        to: State,
    },
    /// The interlocks tripped.
    Trip(Trip),
    /// The amplifier did not reset its fault after the operator's request to clear the trip; the trip remains.
    ResetFailed {
        /// The device's number.
        code: i64,
        /// Meaning and remedy. A recording stores them as text.
        text: Option<FaultText>,
    },
    /// The program came to its end.
    Completed,
    /// Records did not fit into the ring since the last event of this kind.
    Lost {
        /// How many.
        records: u64,
    },
    /// The operator closes the loop without a valid certificate. The recorder writes it before the first tick; the reason is in
    /// the text and in the metadata of the recording.
    Override,
    /// The clocks at one moment in the tick; only in real time, at the start and once per second.
    Clock(ClockTimes),
}

impl EventKind {
    /// The event of a reset that failed with `error`.
    pub(super) fn reset_failed(error: DeviceError) -> EventKind {
        let DeviceError { what, remedy, code } = error;
        EventKind::ResetFailed {
            code,
            text: Some(FaultText { what, remedy }),
        }
    }
}

/// Three clocks at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockTimes {
    /// Nanoseconds since the loop started, as [`TickRecord::scheduled_ns`].
    pub loop_ns: u64,
    /// The monotonic clock of the system (CLOCK_MONOTONIC) in nanoseconds.
    pub monotonic_ns: u64,
    /// The wall clock (CLOCK_REALTIME) in nanoseconds since 1970.
    pub wall_ns: u64,
}

/// Requests that one tick takes; more wait for the next.
pub const REQUESTS_PER_TICK: usize = 16;

/// Requests, as they appear in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RequestKind {
    /// Enable the amplifier.
    Arm,
    /// Run the program that came with the request.
    Start,
    /// End the run: current to zero along a ramp, disarm.
    Finish,
    /// Zero current at once, disarm.
    Stop,
    /// The operator clears a trip.
    Clear,
    /// Change reference or loop gain of the run along a ramp.
    Tune(Tune),
}

/// The answer of the loop to a request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequestEvent {
    /// Number of a request of the supervisor, from 1; 0 for another origin, and in recordings of older versions.
    pub id: u64,
    /// Who requested it.
    pub origin: Origin,
    /// What was requested.
    pub kind: RequestKind,
    /// Why it was refused; `None` if it was accepted, and in recordings of older versions.
    pub refusal: Option<Refusal>,
}

/// Who requested something of the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The supervisor, through the ring of requests.
    #[default]
    Supervisor,
    /// A signal of the operator or the system.
    Signal,
    /// The arm lease, which was not renewed in time.
    Lease,
}

/// Why the loop refused a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// Only a disarmed loop can be armed.
    NotDisarmed,
    /// Only an armed loop can start a program.
    NotArmed,
    /// There is no run that could end.
    NoRun,
    /// There is no trip that could be cleared.
    NoTrip,
    /// The loop has tripped; the trip must be cleared first.
    Tripped,
    /// The program has no reference and no loop gain.
    NotTunable,
}

impl Refusal {
    /// All refusals.
    pub const ALL: [Refusal; 6] = [
        Refusal::NotDisarmed,
        Refusal::NotArmed,
        Refusal::NoRun,
        Refusal::NoTrip,
        Refusal::Tripped,
        Refusal::NotTunable,
    ];

    /// The name used in recordings.
    pub fn name(self) -> &'static str {
        match self {
            Refusal::NotDisarmed => "not_disarmed",
            Refusal::NotArmed => "not_armed",
            Refusal::NoRun => "no_run",
            Refusal::NoTrip => "no_trip",
            Refusal::Tripped => "tripped",
            Refusal::NotTunable => "not_tunable",
        }
    }
}

/// A message from the loop to the recorder, through the ring.
#[derive(Clone, Copy, Debug)]
pub enum LoopMessage {
    /// The signals of a tick.
    Tick(TickRecord),
    /// A change.
    Event(Event),
}
