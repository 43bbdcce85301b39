//! Asking and being answered on a half-duplex line, without clock or port: times go in, decisions come out.
//!
//! ```text
//!                    due: send
//!   Rest -----------------------------------------> Waiting --+ `timeout` without a byte: timed out, send again
//!    ^ ^                                             |  |  ^--+
//!    | +- answered; or damaged: bytes, then `quiet` -+  |
//!    |                                                  | answered after a timeout; two answers
//!    +-- silent for long enough ---- OutOfStep <--------+
//! ```
//!
//! An answer carries no mark of its request: it is as old as the first request that it may belong to. That is the request
//! it follows, if all before had their answers. After a timeout it is the first of those without one, and the line must
//! then fall silent, for the answers to the others may still come, as far from each other as their requests: twice the
//! longest distance between two of these is long enough, if no answer is later than another by more than `timeout`. What
//! arrives meanwhile is thrown away. So it is at the start, too: a program before us may have asked.
//!
//! Noise on the line between a request and an answer that comes later than `quiet` after it would be taken for that answer
//! damaged: `quiet` must be longer than a probe thinks.

/// Times of a polled probe, nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Times {
    pub interval_ns: u64,
    pub timeout_ns: u64,
    pub quiet_ns: u64,
}

/// What to do when nothing (more) has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Send the request, then call [`Exchange::sent`].
    Send,
    /// Listen until then.
    Listen { until_ns: u64 },
    /// The probe did not answer in time; ask again what to do.
    TimedOut,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Rest { until_ns: u64 },
    Waiting { sent_ns: u64, heard_ns: Option<u64> },
    OutOfStep { silence_ns: u64, heard_ns: u64 },
}

/// The conversation with a polled probe.
#[derive(Debug)]
pub(super) struct Exchange {
    times: Times,
    state: State,
    /// The requests since the last answer, if one of them timed out.
    unanswered: Option<Unanswered>,
}

/// Requests that timed out, and the one after them.
#[derive(Clone, Copy, Debug)]
struct Unanswered {
    first_ns: u64,
    latest_ns: u64,
    /// From one to the next, at most.
    apart_ns: u64,
}

impl Exchange {
    /// A conversation not begun.
    pub(super) fn new(times: Times, now_ns: u64) -> Self {
        let state = State::OutOfStep {
            silence_ns: 2 * times.timeout_ns,
            heard_ns: now_ns,
        };
        Self {
            times,
            state,
            unanswered: None,
        }
    }

    /// Until when there is nothing to do but listen.
    pub(super) fn listen_until_ns(&self) -> u64 {
        match self.state {
            State::Rest { until_ns } => until_ns,
            State::OutOfStep {
                silence_ns,
                heard_ns,
            } => heard_ns + silence_ns,
            State::Waiting {
                heard_ns: Some(heard_ns),
                ..
            } => heard_ns + self.times.quiet_ns,
            State::Waiting {
                sent_ns,
                heard_ns: None,
            } => sent_ns + self.times.timeout_ns,
        }
    }

    /// What to do. To be asked when all that had arrived by `now_ns` was heard.
    pub(super) fn step(&mut self, now_ns: u64) -> Step {
        let until_ns = self.listen_until_ns();
        match self.state {
            _ if now_ns < until_ns => Step::Listen { until_ns },
            State::Waiting {
                sent_ns,
                heard_ns: None,
            } => {
                self.unanswered.get_or_insert(Unanswered {
                    first_ns: sent_ns,
                    latest_ns: sent_ns,
                    apart_ns: 0,
                });
                self.state = State::Rest { until_ns: now_ns };
                Step::TimedOut
            }
            _ => Step::Send,
        }
    }

    /// A request goes out; `now_ns` is before its first byte.
    pub(super) fn sent(&mut self, now_ns: u64) {
        self.state = State::Waiting {
            sent_ns: now_ns,
            heard_ns: None,
        };
        if let Some(unanswered) = &mut self.unanswered {
            unanswered.apart_ns = unanswered.apart_ns.max(now_ns - unanswered.latest_ns);
            unanswered.latest_ns = now_ns;
        }
    }

    /// Bytes arrived: may they be part of an answer, to be decoded?
    pub(super) fn heard(&mut self, now_ns: u64) -> bool {
        match &mut self.state {
            State::Waiting { heard_ns, .. } => *heard_ns = Some(now_ns),
            State::OutOfStep { heard_ns, .. } => *heard_ns = now_ns,
            State::Rest { .. } => {}
        }
        matches!(self.state, State::Waiting { .. })
    }

    /// So many answers, one or more, are complete: when they were asked for, if that can be told.
    ///
    /// The probe sends what it measured before it heard the request, so its newest value is as old as the request, and
    /// counts from there, however late the answer.
    pub(super) fn answered(&mut self, answers: u32, now_ns: u64) -> Option<u64> {
        let State::Waiting { sent_ns, .. } = self.state else {
            return None;
        };
        let unanswered = self.unanswered.take();
        if answers == 1 && unanswered.is_none() {
            self.state = State::Rest {
                until_ns: sent_ns + self.times.interval_ns,
            };
        } else {
            let apart_ns = unanswered
                .map_or(0, |unanswered| unanswered.apart_ns)
                .max(self.times.timeout_ns);
            self.state = State::OutOfStep {
                silence_ns: 2 * apart_ns,
                heard_ns: now_ns,
            };
        }
        (answers == 1).then_some(unanswered.map_or(sent_ns, |unanswered| unanswered.first_ns))
    }
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

    /// An exchange after the silence at the start, with a request at 1000.
    fn asked() -> Exchange {
        let mut exchange = Exchange::new(TIMES, 0);
        assert_eq!(exchange.step(999), Step::Listen { until_ns: 1000 });
        assert_eq!(exchange.step(1000), Step::Send);
        exchange.sent(1000);
        exchange
    }

    #[test]
    fn a_request_goes_out_at_every_interval_and_its_answer_is_as_old_as_the_request() {
        let mut exchange = asked();
        assert!(exchange.heard(1200));
        assert_eq!(exchange.answered(1, 1200), Some(1000));
        assert_eq!(exchange.step(1999), Step::Listen { until_ns: 2000 });
        assert_eq!(exchange.step(2000), Step::Send);
    }

    #[test]
    fn a_damaged_answer_is_asked_for_again_as_soon_as_the_line_is_quiet() {
        let mut exchange = asked();
        assert!(exchange.heard(1100) && exchange.heard(1150));
        assert_eq!(exchange.step(1249), Step::Listen { until_ns: 1250 });
        assert_eq!(exchange.step(1250), Step::Send);
    }

    #[test]
    fn silence_times_out_and_is_asked_again() {
        let mut exchange = asked();
        assert_eq!(exchange.step(1499), Step::Listen { until_ns: 1500 });
        assert_eq!(exchange.step(1500), Step::TimedOut);
        assert_eq!(exchange.step(1500), Step::Send);
    }

    #[test]
    fn an_answer_after_timeouts_is_as_old_as_the_first_request_without_one_and_then_the_line_must_fall_silent()
     {
        let mut exchange = asked();
        for now_ns in [1500, 2000] {
            assert_eq!(exchange.step(now_ns), Step::TimedOut);
            exchange.sent(now_ns);
        }
        assert_eq!(
            exchange.answered(1, 2100),
            Some(1000),
            "it may be the answer to the very first"
        );
        assert!(
            !exchange.heard(2600),
            "the answer to the second: thrown away"
        );
        assert_eq!(
            exchange.step(3599),
            Step::Listen { until_ns: 3600 },
            "and it starts the silence anew"
        );
        assert_eq!(exchange.step(3600), Step::Send);
        exchange.sent(3600);
        assert_eq!(exchange.answered(1, 3700), Some(3600));
    }

    #[test]
    fn two_answers_to_one_request_are_of_unknown_age() {
        let mut exchange = asked();
        assert_eq!(exchange.answered(2, 1100), None);
        assert_eq!(exchange.step(2099), Step::Listen { until_ns: 2100 });
    }

    #[test]
    fn what_nobody_asked_for_is_not_decoded() {
        let mut exchange = asked();
        assert_eq!(exchange.answered(1, 1200), Some(1000));
        assert!(!exchange.heard(1300));
        assert_eq!(exchange.answered(1, 1300), None);
    }

    proptest! {
        /// However late a probe answers, and however late the reader looks: no answer counts as asked for after it was.
        #[test]
        fn an_answer_is_never_taken_for_that_of_a_later_request(
            late_ns in 0u64..5000, jitter_ns in vec(0u64..400, 1..20), kept_ns in vec(0u64..2000, 1..20), rarely in 1usize..30,
        ) {
            let (mut exchange, mut now_ns, mut believed) = (Exchange::new(TIMES, 0), 0, 0);
            let mut on_the_way: Vec<(u64, u64)> = Vec::new(); // sent, arrives
            let mut requests = 0;
            for turn in 0..2000 {
                let (arrived, later): (Vec<_>, Vec<_>) = on_the_way.iter().partition(|(_, arrives_ns)| *arrives_ns <= now_ns);
                if let Some((sent_ns, _)) = arrived.last() {
                    let asked_ns = exchange.heard(now_ns).then(|| exchange.answered(arrived.len() as u32, now_ns)).flatten();
                    prop_assert!(asked_ns.is_none_or(|asked_ns| asked_ns <= *sent_ns), "{:?} for {}", asked_ns, sent_ns);
                    believed += u32::from(asked_ns.is_some());
                    on_the_way = later;
                } else {
                    match exchange.step(now_ns) {
                        Step::Send => {
                            exchange.sent(now_ns);
                            let last_ns = on_the_way.last().map_or(0, |(_, arrives_ns)| *arrives_ns);
                            let arrives_ns = last_ns.max(now_ns + late_ns + jitter_ns[requests % jitter_ns.len()]);
                            on_the_way.push((now_ns, arrives_ns));
                            requests += 1;
                        }
                        Step::TimedOut => {}
                        Step::Listen { until_ns } => {
                            let next_ns = on_the_way.first().map_or(until_ns, |(_, arrives_ns)| until_ns.min(*arrives_ns));
                            now_ns = next_ns.max(now_ns);
                        }
                    }
                }
                now_ns += 1 + if turn % rarely == 0 { kept_ns[turn % kept_ns.len()] } else { 0 };
            }
            // A reader that is kept away may find two answers at once, every time: then it believes none.
            prop_assert!(believed > 0 || kept_ns.iter().any(|kept_ns| *kept_ns > 50));
        }
    }
}
