//! The arming machine: the states in which current may flow.
//!
//! ```text
//!              arm               enabled             start              finish, done
//!  Disarmed ---------> Enabling ---------->  Armed  ---------->  Running ----------> Settling
//!     ^  ^               |  |                |  |                |  |                |  |
//!     |  |     stop      |  |      stop      |  |      stop      |  |  stop, settled |  |
//!     |  +---------------+--|----------------+--|----------------+--|----------------+  |
//!     |                     |                   |                   |                   |
//!     |  clear (operator)   v       trip        v       trip        v       trip        |
//!     +----------------  Tripped  <-------------------------------------------------------+
//! ```
//!
//! In `Disarmed` and `Tripped` the amplifier is disabled. In `Enabling` the readings are judged first, for the time
//! `loop.healthy_s`; then the amplifier is enabled, within the time limit of its driver. A trip or a stop ends it at once. A
//! program that is started in `Enabling` waits for `Armed`. In `Armed` the amplifier is enabled and commanded zero. In `Settling`
//! the current of an ended run goes to zero along a ramp. Only `clear` leaves `Tripped`, to `Disarmed`: a new run must be armed
//! again. While the amplifier resets its fault, the state remains `Tripped`.

pub use super::trip::Trip;

/// State of the arming machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Amplifier disabled, no program.
    #[default]
    Disarmed,
    /// The readings are judged, then the amplifier is enabled; zero current.
    Enabling,
    /// Amplifier enabled, zero current, no program.
    Armed,
    /// A program commands current, below the interlocks.
    Running,
    /// The run has ended; reference and current go to zero along a ramp, below the interlocks.
    Settling,
    /// An interlock switched everything off; waits for the operator.
    Tripped,
}

/// An event that may change the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transition {
    /// The operator armed the loop.
    Arm,
    /// The amplifier is enabled.
    Enabled,
    /// A program was passed to the loop.
    Start,
    /// The program ended, or the operator ended it: the current goes to zero along a ramp.
    Finish,
    /// The ramp ended, or the operator cut the current.
    Stop,
    /// An interlock tripped.
    Trip,
    /// The operator cleared the trip.
    Clear,
}

impl State {
    /// The state after `transition`, or `None` where the diagram has no such arrow.
    pub fn after(self, transition: Transition) -> Option<State> {
        match (self, transition) {
            (State::Disarmed, Transition::Arm) => Some(State::Enabling),
            (State::Enabling, Transition::Enabled) => Some(State::Armed),
            (State::Armed, Transition::Start) => Some(State::Running),
            (State::Running, Transition::Finish) => Some(State::Settling),
            (
                State::Enabling | State::Armed | State::Running | State::Settling,
                Transition::Stop,
            ) => Some(State::Disarmed),
            (
                State::Enabling | State::Armed | State::Running | State::Settling,
                Transition::Trip,
            ) => Some(State::Tripped),
            (State::Tripped, Transition::Clear) => Some(State::Disarmed),
            _ => None,
        }
    }

    /// The name used in recordings.
    pub fn name(self) -> &'static str {
        match self {
            State::Disarmed => "disarmed",
            State::Enabling => "enabling",
            State::Armed => "armed",
            State::Running => "running",
            State::Settling => "settling",
            State::Tripped => "tripped",
        }
    }
}
