//! Requests to the loop, each with a number. The loop answers each with an event that carries the number and whether the
//! request was accepted.

use rtrb::{Consumer, Producer, PushError, RingBuffer};

use super::arming::{State, Transition};
use super::program::Program;
use super::record::{Refusal, RequestKind};
use super::tuning::Tune;

/// A request to the loop, taken at the start of a tick. Its content is complete and immutable.
pub enum Request {
    /// Enable the amplifier.
    Arm,
    /// Run a program from the next tick on.
    Start(Box<dyn Program>),
    /// End the run: current to zero along a ramp, disarm.
    Finish,
    /// Zero current at once, disarm.
    Stop,
    /// The operator clears a trip.
    Clear,
    /// Change reference or loop gain of the run along a ramp.
    Tune(Tune),
}

impl Request {
    /// Its kind, as it appears in a recording.
    pub fn kind(&self) -> RequestKind {
        match self {
            Request::Arm => RequestKind::Arm,
            Request::Start(_) => RequestKind::Start,
            Request::Finish => RequestKind::Finish,
            Request::Stop => RequestKind::Stop,
            Request::Clear => RequestKind::Clear,
            Request::Tune(tune) => RequestKind::Tune(*tune),
        }
    }
}

/// A request with its number.
pub struct NumberedRequest {
    /// The number, from 1.
    pub id: u64,
    /// The request.
    pub request: Request,
}

/// The end of the ring of requests that stays outside the loop. It numbers the requests from 1.
pub struct RequestSender {
    ring: Producer<NumberedRequest>,
    last_id: u64,
}

impl RequestSender {
    /// A ring for `slots` requests: the sender, and the end of the loop.
    pub fn ring(slots: usize) -> (RequestSender, Consumer<NumberedRequest>) {
        let (ring, taken) = RingBuffer::new(slots);
        (RequestSender { ring, last_id: 0 }, taken)
    }

    /// Sends a request and returns its number.
    ///
    /// # Errors
    /// The request itself if the ring is full. It then has no number.
    pub fn send(&mut self, request: Request) -> Result<u64, Request> {
        let id = self.last_id + 1;
        match self.ring.push(NumberedRequest { id, request }) {
            Ok(()) => {
                self.last_id = id;
                Ok(id)
            }
            Err(PushError::Full(refused)) => Err(refused.request),
        }
    }
}

impl RequestKind {
    /// Why a loop in `state` refuses the request; `None` if it accepts it. [`RequestKind::Stop`] is accepted in every state.
    pub fn refusal(self, state: State) -> Option<Refusal> {
        let allows = |transition| state.after(transition).is_some();
        let (is_accepted, reason) = match self {
            RequestKind::Arm => (allows(Transition::Arm), Refusal::NotDisarmed),
            // While the amplifier is being enabled, the program waits.
            RequestKind::Start => (
                allows(Transition::Start) || state == State::Enabling,
                Refusal::NotArmed,
            ),
            RequestKind::Finish => (
                allows(Transition::Stop) && state != State::Settling,
                Refusal::NoRun,
            ),
            RequestKind::Stop => return None,
            RequestKind::Clear => (allows(Transition::Clear), Refusal::NoTrip),
            RequestKind::Tune(_) => (state == State::Running, Refusal::NoRun),
        };
        match (is_accepted, state) {
            (true, _) => None,
            (false, State::Tripped) => Some(Refusal::Tripped),
            (false, _) => Some(reason),
        }
    }
}
