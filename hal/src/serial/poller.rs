//! Request and answer on a half-duplex line, without clock and port: the caller passes the times.
//!
//! ```text
//!                    due: send
//!   Idle -----------------------------------------> Waiting --+ `timeout` without a byte: timed out, send again
//!    ^ ^                                             |  |  ^--+
//!    | +- answer; or damaged answer and `quiet` -----+  |
//!    |                                                  | answer after a timeout; two answers
//!    +-- silent for long enough ---- OutOfStep <--------+
//! ```
//!
//! An answer does not identify its request. It is therefore assigned to the earliest request that it may belong to:
//!
//! * If all earlier requests were answered, this is the latest request.
//! * After timeouts it is the first request without an answer. The answers to the other requests may still arrive, at
//!   distances like those of their requests. Before the next request the line must therefore be silent for twice the longest
//!   of these distances; this is sufficient if the delays of the answers differ by at most `timeout`. Bytes that
//!   arrive in this time are discarded.
//!
//! The same silence is required after opening, because another program may have sent requests before.
//!
//! Noise between a request and its answer looks like a damaged answer if the answer comes later than `quiet` after the
//! noise. `quiet` must therefore be longer than the response time of the probe.

use std::time::Duration;

use super::protocol::Polling;

/// [`Polling`] in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Times {
    interval_ns: u64,
    timeout_ns: u64,
    quiet_ns: u64,
}

/// The action that the reader thread has to execute after it has read all bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// Call [`Poller::sent`] and send the request.
    Send,
    /// Listen until this time.
    Listen { until_ns: u64 },
    /// Count a timeout, then ask for the next action.
    TimedOut,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle {
        until_ns: u64,
    },
    Waiting {
        sent_ns: u64,
        received_ns: Option<u64>,
    },
    OutOfStep {
        silence_ns: u64,
        received_ns: u64,
    },
}

/// Decides when to send a request and which answers to use.
#[derive(Debug)]
pub(super) struct Poller {
    times: Times,
    state: State,
    /// The requests since the last answer, if one of them timed out.
    unanswered: Option<Unanswered>,
}

/// A series of requests of which the first timed out.
#[derive(Clone, Copy, Debug)]
struct Unanswered {
    first_ns: u64,
    latest_ns: u64,
    /// Longest time from one request to the next.
    longest_distance_ns: u64,
}

impl Unanswered {
    fn new(sent_ns: u64) -> Self {
        Self {
            first_ns: sent_ns,
            latest_ns: sent_ns,
            longest_distance_ns: 0,
        }
    }

    fn add_request(&mut self, now_ns: u64) {
        let distance_ns = now_ns - self.latest_ns;
        self.longest_distance_ns = self.longest_distance_ns.max(distance_ns);
        self.latest_ns = now_ns;
    }
}

impl Poller {
    /// A poller that waits for silence before its first request.
    pub(super) fn new(polling: Polling, now_ns: u64) -> Self {
        let times = Times {
            interval_ns: nanoseconds(polling.interval),
            timeout_ns: nanoseconds(polling.timeout),
            quiet_ns: nanoseconds(polling.quiet),
        };
        Self::with_times(times, now_ns)
    }

    fn with_times(times: Times, now_ns: u64) -> Self {
        Self {
            times,
            state: State::OutOfStep {
                silence_ns: 2 * times.timeout_ns,
                received_ns: now_ns,
            },
            unanswered: None,
        }
    }

    /// The time of the next action if nothing is received.
    pub(super) fn listen_until_ns(&self) -> u64 {
        match self.state {
            State::Idle { until_ns } => until_ns,
            State::OutOfStep {
                silence_ns,
                received_ns,
            } => received_ns + silence_ns,
            State::Waiting {
                received_ns: Some(received_ns),
                ..
            } => received_ns + self.times.quiet_ns,
            State::Waiting { sent_ns, .. } => sent_ns + self.times.timeout_ns,
        }
    }

    /// The next action. To be called when all bytes that arrived up to `now_ns` have been passed to
    /// [`received`](Self::received).
    pub(super) fn next_action(&mut self, now_ns: u64) -> Action {
        let until_ns = self.listen_until_ns();
        match self.state {
            _ if now_ns < until_ns => Action::Listen { until_ns },
            State::Waiting {
                sent_ns,
                received_ns: None,
            } => {
                self.unanswered.get_or_insert(Unanswered::new(sent_ns));
                self.state = State::Idle { until_ns: now_ns };
                Action::TimedOut
            }
            _ => Action::Send,
        }
    }

    /// Notes that a request is sent; `now_ns` is before its first byte.
    pub(super) fn sent(&mut self, now_ns: u64) {
        self.state = State::Waiting {
            sent_ns: now_ns,
            received_ns: None,
        };
        if let Some(unanswered) = &mut self.unanswered {
            unanswered.add_request(now_ns);
        }
    }

    /// Notes that bytes were received. Returns whether they may be part of an answer and have to be decoded.
    pub(super) fn received(&mut self, now_ns: u64) -> bool {
        match &mut self.state {
            State::Waiting { received_ns, .. } => *received_ns = Some(now_ns),
            State::OutOfStep { received_ns, .. } => *received_ns = now_ns,
            State::Idle { .. } => {}
        }
        matches!(self.state, State::Waiting { .. })
    }

    /// Notes `answers` complete answers, at least one. Returns the time of the request that the age counts from, or `None` if
    /// it is unknown.
    ///
    /// The probe sends values that it measured before it received the request. The newest of them is therefore as old as
    /// the request, however late the answer arrives.
    pub(super) fn answered(&mut self, answers: u32, now_ns: u64) -> Option<u64> {
        let State::Waiting { sent_ns, .. } = self.state else {
            return None;
        };
        match (answers, self.unanswered.take()) {
            (1, None) => {
                let until_ns = sent_ns + self.times.interval_ns;
                self.state = State::Idle { until_ns };
                Some(sent_ns)
            }
            (_, unanswered) => {
                self.wait_for_silence(unanswered, now_ns);
                let first_ns = unanswered.map_or(sent_ns, |unanswered| unanswered.first_ns);
                (answers == 1).then_some(first_ns)
            }
        }
    }

    fn wait_for_silence(&mut self, unanswered: Option<Unanswered>, now_ns: u64) {
        let longest_ns = unanswered.map_or(0, |unanswered| unanswered.longest_distance_ns);
        self.state = State::OutOfStep {
            silence_ns: 2 * longest_ns.max(self.times.timeout_ns),
            received_ns: now_ns,
        };
    }
}

/// The duration in nanoseconds, limited to one hour so that sums cannot overflow.
pub(super) fn nanoseconds(duration: Duration) -> u64 {
    duration.min(Duration::from_secs(3600)).as_nanos() as u64
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    const TIMES: Times = Times {
        interval_ns: 1000,
        timeout_ns: 500,
        quiet_ns: 100,
    };

    /// A poller after the initial silence, with a request sent at 1000 ns.
    fn poller_with_request() -> Poller {
        let mut poller = Poller::with_times(TIMES, 0);
        assert_eq!(poller.next_action(999), Action::Listen { until_ns: 1000 });
        assert_eq!(poller.next_action(1000), Action::Send);
        poller.sent(1000);
        poller
    }

    #[test]
    fn polls_at_the_interval_and_dates_the_answer_by_its_request() {
        let mut poller = poller_with_request();
        assert!(poller.received(1200));
        assert_eq!(poller.answered(1, 1200), Some(1000));
        assert_eq!(poller.next_action(1999), Action::Listen { until_ns: 2000 });
        assert_eq!(poller.next_action(2000), Action::Send);
    }

    #[test]
    fn repeats_the_request_when_the_line_is_quiet_after_a_damaged_answer() {
        let mut poller = poller_with_request();
        assert!(poller.received(1100) && poller.received(1150));
        assert_eq!(poller.next_action(1249), Action::Listen { until_ns: 1250 });
        assert_eq!(poller.next_action(1250), Action::Send);
    }

    #[test]
    fn repeats_the_request_after_a_timeout() {
        let mut poller = poller_with_request();
        assert_eq!(poller.next_action(1499), Action::Listen { until_ns: 1500 });
        assert_eq!(poller.next_action(1500), Action::TimedOut);
        assert_eq!(poller.next_action(1500), Action::Send);
    }

    #[test]
    fn dates_an_answer_after_timeouts_by_the_first_unanswered_request_and_waits_for_silence() {
        let mut poller = poller_with_request();
        for now_ns in [1500, 2000] {
            assert_eq!(poller.next_action(now_ns), Action::TimedOut);
            poller.sent(now_ns);
        }
        assert_eq!(
            poller.answered(1, 2100),
            Some(1000),
            "it may be the answer to the very first"
        );
        assert!(
            !poller.received(2600),
            "the answer to the second: thrown away"
        );
        assert_eq!(
            poller.next_action(3599),
            Action::Listen { until_ns: 3600 },
            "and it starts the silence anew"
        );
        assert_eq!(poller.next_action(3600), Action::Send);
        poller.sent(3600);
        assert_eq!(poller.answered(1, 3700), Some(3600));
    }

    #[test]
    fn two_answers_to_one_request_have_unknown_age() {
        let mut poller = poller_with_request();
        assert_eq!(poller.answered(2, 1100), None);
        assert_eq!(poller.next_action(2099), Action::Listen { until_ns: 2100 });
    }

    #[test]
    fn ignores_bytes_without_a_request() {
        let mut poller = poller_with_request();
        assert_eq!(poller.answered(1, 1200), Some(1000));
        assert!(!poller.received(1300));
        assert_eq!(poller.answered(1, 1300), None);
    }

    proptest! {
        /// For all delays of probe and reader: an answer is never assigned to a request later than the one it
        /// answers.
        #[test]
        fn never_assigns_an_answer_to_a_later_request(
            late_ns in 0u64..5000, jitter_ns in vec(0u64..400, 1..20), suspended_ns in vec(0u64..2000, 1..20), rarely in 1usize..30,
        ) {
            let (mut poller, mut now_ns, mut used) = (Poller::with_times(TIMES, 0), 0, 0);
            let mut in_transit: Vec<(u64, u64)> = Vec::new(); // sent, arrives
            let mut requests = 0;
            for turn in 0..2000 {
                let (arrived, later): (Vec<_>, Vec<_>) = in_transit.iter().partition(|(_, arrives_ns)| *arrives_ns <= now_ns);
                if let Some((sent_ns, _)) = arrived.last() {
                    let asked_ns = poller.received(now_ns).then(|| poller.answered(arrived.len() as u32, now_ns)).flatten();
                    prop_assert!(asked_ns.is_none_or(|asked_ns| asked_ns <= *sent_ns), "{:?} for {}", asked_ns, sent_ns);
                    used += u32::from(asked_ns.is_some());
                    in_transit = later;
                } else {
                    match poller.next_action(now_ns) {
                        Action::Send => {
                            poller.sent(now_ns);
                            let last_ns = in_transit.last().map_or(0, |(_, arrives_ns)| *arrives_ns);
                            let arrives_ns = last_ns.max(now_ns + late_ns + jitter_ns[requests % jitter_ns.len()]);
                            in_transit.push((now_ns, arrives_ns));
                            requests += 1;
                        }
                        Action::TimedOut => {}
                        Action::Listen { until_ns } => {
                            let next_ns = in_transit.first().map_or(until_ns, |(_, arrives_ns)| until_ns.min(*arrives_ns));
                            now_ns = next_ns.max(now_ns);
                        }
                    }
                }
                now_ns += 1 + if turn % rarely == 0 { suspended_ns[turn % suspended_ns.len()] } else { 0 };
            }
            // If the reader is suspended, it may receive two answers at once every time; it then uses none of them.
            prop_assert!(used > 0 || suspended_ns.iter().any(|suspended_ns| *suspended_ns > 50));
        }
    }
}
