//! What ends or changes a run: requests of the supervisor, signals, and an expired arm lease.

use super::Servo;
use crate::arming::{State, Transition};
use crate::clock::TickTiming;
use crate::record::{EventKind, Origin, REQUESTS_PER_TICK, Refusal, RequestEvent, RequestKind};
use crate::request::{NumberedRequest, Request};
use crate::tuning::Tune;

impl Servo {
    pub(super) fn take_requests(&mut self, tick: u64) {
        for _ in 0..REQUESTS_PER_TICK {
            let Ok(NumberedRequest { id, request }) = self.run.connections.requests.pop() else {
                return;
            };
            self.answer(id, Origin::Supervisor, request.kind(), tick);
            self.take(request, tick);
        }
    }

    /// Why a request is refused; `None` if it is accepted.
    fn refusal(&self, kind: RequestKind) -> Option<Refusal> {
        let waits = self.state == State::Enabling && self.run.program.is_some();
        match kind {
            RequestKind::Start if waits => Some(Refusal::NotArmed),
            RequestKind::Tune(_) if self.state == State::Running && !self.is_tunable() => {
                Some(Refusal::NotTunable)
            }
            _ => kind.refusal(self.state),
        }
    }

    /// Publishes a request and whether this state allows it.
    fn answer(&mut self, id: u64, origin: Origin, kind: RequestKind, tick: u64) {
        let request = RequestEvent {
            id,
            origin,
            kind,
            refusal: self.refusal(kind),
        };
        self.event(tick, EventKind::Request(request));
    }

    pub(super) fn take_signals(&mut self, tick: u64) {
        for request in self.run.supervision.signalled() {
            self.end(request, Origin::Signal, tick);
        }
    }

    /// An expired arm lease ends a run, and disarms an armed loop.
    pub(super) fn check_lease(&mut self, timing: &TickTiming) {
        let expired = self.run.supervision.lease_expired(timing.missed);
        if expired && RequestKind::Finish.refusal(self.state).is_none() {
            self.end(Request::Finish, Origin::Lease, timing.tick.number);
        }
    }

    /// Ends the run without a request of the supervisor.
    fn end(&mut self, request: Request, origin: Origin, tick: u64) {
        self.answer(0, origin, request.kind(), tick);
        self.run.stopped_by.get_or_insert(origin);
        self.take(request, tick);
    }

    fn take(&mut self, request: Request, tick: u64) {
        match request {
            Request::Arm => self.arm(tick),
            Request::Start(program) => self.start(program, tick),
            Request::Finish => self.finish(tick),
            Request::Stop => self.switch_off(Transition::Stop, tick),
            Request::Clear => self.clear(tick),
            Request::Tune(tune) => self.tune(tune),
        }
    }

    fn is_tunable(&self) -> bool {
        let program = self.run.program.as_ref();
        program.is_some_and(|program| program.is_tunable())
    }

    fn tune(&mut self, tune: Tune) {
        if self.state == State::Running && self.is_tunable() {
            self.run.tuning.begin(tune);
        }
    }
}
