//! The arming machine: the states in which current may flow.
//!
//! ```text
//!              arm                start
//!  Disarmed ---------->  Armed  ---------->  Running
//!     ^  ^                 |  |                |  |
//!     |  |   stop, done    |  |   stop, done   |  |
//!     |  +-----------------+--|----------------+  |
//!     |                       |                   |
//!     |  clear (operator)     v      trip         |
//!     +-------------------  Tripped  <------------+
//! ```
//!
//! In `Disarmed` and `Tripped` the amplifier is disabled. In `Armed` it is enabled and commanded zero. Only `clear`
//! leaves `Tripped`, to `Disarmed`: a new run must be armed again.

pub use super::trip::Trip;

/// State of the arming machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Amplifier disabled, no program.
    #[default]
    Disarmed,
    /// Amplifier enabled, zero current, no program.
    Armed,
    /// A program commands current, below the interlocks.
    Running,
    /// An interlock switched everything off; waits for the operator.
    Tripped,
}

/// An event that may change the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transition {
    /// The amplifier was enabled.
    Arm,
    /// A program was passed to the loop.
    Start,
    /// The program ended, or the operator stopped it.
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
            (State::Disarmed, Transition::Arm) => Some(State::Armed),
            (State::Armed, Transition::Start) => Some(State::Running),
            (State::Armed | State::Running, Transition::Stop) => Some(State::Disarmed),
            (State::Armed | State::Running, Transition::Trip) => Some(State::Tripped),
            (State::Tripped, Transition::Clear) => Some(State::Disarmed),
            _ => None,
        }
    }

    /// The name used in recordings.
    pub fn name(self) -> &'static str {
        match self {
            State::Disarmed => "disarmed",
            State::Armed => "armed",
            State::Running => "running",
            State::Tripped => "tripped",
        }
    }
}
