//! Sequences of requests, lost clients, and times, beside rules that are written independently of the queue.

use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::hold::HoldCause;
use crate::run_entry::OnDisconnect;
use bench_order::Order;

/// What may happen.
#[derive(Clone, Debug)]
enum Step {
    TakeLease(u8),
    Renew(u8),
    Release(u8),
    /// A command of the client with this lease.
    Queue(u8, Command, OnDisconnect),
    /// A command at a terminal of an operator.
    Attach(u8, Command),
    Advance,
    /// The n-th open command ends.
    Finish(usize),
    Stop(usize, bool),
    StopBench(bool),
    /// The session of the command that has its turn orders a run.
    BeginRun,
    /// Its run ends, perhaps by an interlock.
    EndRun(bool),
    Resume(u8),
    LoseClient(usize),
    Wait(u64),
    ShutDown,
}

fn command() -> impl Strategy<Value = Command> {
    prop_oneof![
        Just(Command::Chirp),
        Just(Command::Control),
        Just(Command::Identify)
    ]
}

fn on_disconnect() -> impl Strategy<Value = OnDisconnect> {
    prop_oneof![
        Just(OnDisconnect::Default),
        Just(OnDisconnect::Stop),
        Just(OnDisconnect::Continue)
    ]
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        3 => (0..3_u8).prop_map(Step::TakeLease),
        3 => (0..3_u8).prop_map(Step::Renew),
        1 => (0..3_u8).prop_map(Step::Release),
        4 => (0..3_u8, command(), on_disconnect()).prop_map(|(who, command, on)| Step::Queue(who, command, on)),
        4 => (0..3_u8, command()).prop_map(|(who, command)| Step::Attach(who, command)),
        8 => Just(Step::Advance),
        4 => (0..3_usize).prop_map(Step::Finish),
        1 => (0..4_usize, any::<bool>()).prop_map(|(which, cut)| Step::Stop(which, cut)),
        1 => any::<bool>().prop_map(Step::StopBench),
        6 => Just(Step::BeginRun),
        4 => (0..4_u8).prop_map(|n| Step::EndRun(n == 0)),
        4 => (0..3_u8).prop_map(Step::Resume),
        2 => (0..4_usize).prop_map(Step::LoseClient),
        4 => (0..12_000_u64).prop_map(Step::Wait),
        1 => Just(Step::ShutDown),
    ]
}

fn kind(cut: bool) -> StopKind {
    if cut { StopKind::Cut } else { StopKind::Settle }
}

/// An order without options.
pub(super) fn order(command: Command) -> Order {
    let order = serde_json::json!({ "command": command.name() });
    let of_recording = serde_json::json!({ "command": command.name(), "recording": "a.mcap" });
    let made = Order::from_json(order).or_else(|_| Order::from_json(of_recording));
    made.expect("an order")
}

fn request(command: Command, on_disconnect: OnDisconnect) -> RunRequest {
    RunRequest {
        order: order(command),
        name: String::new(),
        note: String::new(),
        on_disconnect,
    }
}

/// The schedule with its clock and the secrets that each client has received.
struct Bench {
    schedule: Schedule,
    now: Now,
    given: [Option<Secret>; 3],
    secrets: u64,
}

impl Bench {
    fn new() -> Bench {
        Bench {
            schedule: Schedule::default(),
            now: Now {
                instant: Instant::now(),
                unix_s: 0.0,
            },
            given: [None, None, None],
            secrets: 0,
        }
    }

    fn secret(&mut self) -> Secret {
        self.secrets += 1;
        Secret::known(format!("secret {}", self.secrets))
    }

    fn known(&self, who: u8) -> String {
        let given = self.given[usize::from(who)].as_ref();
        given.map_or(String::new(), |secret| secret.reveal().into())
    }

    fn open_id(&self, which: usize) -> Option<u64> {
        self.schedule.open().nth(which).map(|entry| entry.id)
    }

    fn take(&mut self, step: &Step) {
        let now = self.now;
        match step {
            Step::TakeLease(who) => {
                let secret = self.secret();
                let taken =
                    self.schedule
                        .take_lease(&format!("operator {who}"), secret.clone(), now);
                if taken.is_ok() {
                    self.given[usize::from(*who)] = Some(secret);
                }
            }
            Step::Renew(who) => drop(self.schedule.renew_lease(&self.known(*who), now)),
            Step::Release(who) => drop(self.schedule.release_lease(&self.known(*who), now)),
            Step::Queue(who, command, on) => {
                let new = NewEntry {
                    request: request(*command, *on),
                    carrier: Carrier::Started {
                        ticket: self.secret(),
                    },
                    operator: format!("operator {who}"),
                    lease: Some(Secret::known(self.known(*who))),
                };
                drop(self.schedule.enqueue(new, now));
            }
            Step::Attach(who, command) => {
                let new = NewEntry {
                    request: request(*command, OnDisconnect::Default),
                    carrier: Carrier::Attached,
                    operator: format!("operator {who}"),
                    lease: None,
                };
                drop(self.schedule.enqueue(new, now));
            }
            Step::Advance => {
                let secret = self.secret();
                self.schedule.advance(|| Some(secret), now);
            }
            Step::Finish(which) => {
                if let Some(id) = self.open_id(*which) {
                    self.schedule.finish(id, EndKind::Completed, None, now);
                }
            }
            Step::Stop(which, cut) => {
                if let Some(id) = self.open_id(*which) {
                    drop(self.schedule.stop(id, kind(*cut), "somebody", now));
                }
            }
            Step::StopBench(cut) => {
                self.schedule.stop_bench(kind(*cut), "somebody", now);
            }
            Step::BeginRun => {
                if let Some(id) = self.open_id(0) {
                    drop(self.schedule.begin_run(id, |_| ()));
                }
            }
            Step::EndRun(trips) => self.end_run(*trips),
            Step::Resume(who) => drop(self.schedule.resume(&self.known(*who), now)),
            Step::LoseClient(which) => {
                if let Some(id) = self.open_id(*which) {
                    self.schedule.lose_client(id, now);
                }
            }
            Step::Wait(ms) => {
                self.now.instant += Duration::from_millis(*ms);
                self.schedule.expire(self.now);
            }
            Step::ShutDown => self.schedule.shut_down(now),
        }
    }

    /// Ends the run in progress.
    fn end_run(&mut self, trips: bool) {
        let current = self.schedule.current();
        let Some(running) = current.filter(|entry| entry.phase == Phase::Running) else {
            return;
        };
        let id = running.id;
        let ended = EndedRun {
            outcome: if trips {
                EndKind::Tripped
            } else {
                EndKind::Completed
            },
            recording: None,
            message: None,
            tripped_by: trips.then(|| "the interlock travel".into()),
        };
        self.schedule.end_run(id, ended, self.now);
    }

    /// A settling stop by somebody, or a trip of the command that has its turn.
    fn hold(&mut self, cause: HoldCause, by: &str) {
        match cause {
            HoldCause::Stop => drop(self.schedule.stop_bench(StopKind::Settle, by, self.now)),
            HoldCause::Trip => {
                let id = self.open_id(0).expect("a command");
                self.schedule.trip(id, by.into(), self.now);
            }
        }
    }

    /// The rules of the module.
    fn check(&self) -> Result<(), TestCaseError> {
        let schedule = &self.schedule;
        let current: Vec<&RunEntry> = schedule.open().filter(|entry| entry.is_current()).collect();
        prop_assert!(current.len() <= 1, "one command has its turn");
        for entry in current {
            self.check_current(entry)?;
        }
        if let Some(lease) = schedule.lease() {
            prop_assert!(
                !lease.has_expired(self.now.instant),
                "an expired lease was kept"
            );
            if let Keeper::Run(id) = lease.keeper {
                let holder = schedule.current().map(|entry| entry.id);
                prop_assert_eq!(holder, Some(id), "the lease of a run ends with it");
            }
        }
        Ok(())
    }

    fn check_current(&self, entry: &RunEntry) -> Result<(), TestCaseError> {
        let lease = self.schedule.lease();
        let holds = match (&entry.lease, lease) {
            (Some(own), Some(lease)) => own.is(lease.secret.reveal()),
            // An attached command of the operator who holds the lease.
            (None, Some(lease)) => lease.operator == entry.operator,
            (_, None) => false,
        };
        // Without its lease a command may only come to its end: it has been stopped, or it was asked to go on.
        prop_assert!(
            holds || entry.is_stopped || entry.is_orphan || self.outlives(entry),
            "a command has its turn without a lease: {entry:?}, {lease:?}"
        );
        if entry.is_orphan && entry.request.ends_with_client() {
            prop_assert!(
                entry.is_stopped,
                "a run that ends with its client was not stopped"
            );
            prop_assert!(entry.stop.is_raised(), "its stop flag is not raised");
        }
        Ok(())
    }

    /// An attached command began under the lease of its operator's client, which has been released since.
    fn outlives(&self, entry: &RunEntry) -> bool {
        entry.lease.is_none()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    #[test]
    fn no_command_has_its_turn_without_a_lease(steps in proptest::collection::vec(step(), 1..60)) {
        let mut bench = Bench::new();
        let mut before: Vec<u64> = Vec::new();
        for step in steps {
            let may_begin = bench.may_begin();
            bench.take(&step);
            bench.check()?;
            let begun: Vec<u64> = bench.schedule.current().map(|entry| entry.id).into_iter().collect();
            let is_new = begun.iter().any(|id| !before.contains(id));
            prop_assert!(!is_new || matches!(step, Step::Advance), "only its turn begins a command");
            prop_assert!(!is_new || may_begin, "a command began against the lease");
            before = begun;
        }
    }
}

/// Sequences: some hundreds in each test run, 100,000 with BENCH_SCHEDULES.
fn cases() -> u32 {
    let wanted = std::env::var("BENCH_SCHEDULES").ok();
    wanted.and_then(|text| text.parse().ok()).unwrap_or(500)
}

impl Bench {
    /// Whether the next command may have its turn, by the rules 1 to 3.
    fn may_begin(&self) -> bool {
        let mut open = self.schedule.open();
        let Some(next) = open.next().filter(|entry| !entry.is_current()) else {
            return false;
        };
        match (&next.lease, self.schedule.lease()) {
            (_, None) => next.lease.is_none(),
            (Some(own), Some(lease)) => own.is(lease.secret.reveal()),
            (None, Some(lease)) => lease.operator == next.operator,
        }
    }
}

fn bench_with_lease() -> Bench {
    let mut bench = Bench::new();
    bench.take(&Step::TakeLease(0));
    bench
}

#[test]
fn control_stops_and_chirp_goes_on_when_the_lease_expires() {
    for (command, is_stopped) in [(Command::Control, true), (Command::Chirp, false)] {
        let mut bench = bench_with_lease();
        bench.take(&Step::Queue(0, command, OnDisconnect::Default));
        bench.take(&Step::Advance);
        bench.take(&Step::Wait(9_900));
        assert!(
            !bench.schedule.current().expect("a run").is_stopped,
            "the lease is valid"
        );
        bench.take(&Step::Wait(200));
        let current = bench.schedule.current().expect("a run");
        assert_eq!((current.is_stopped, current.is_orphan), (is_stopped, true));
        assert!(
            bench.schedule.lease().is_some(),
            "the run keeps the lease until its end"
        );
        bench.take(&Step::Finish(0));
        assert!(bench.schedule.lease().is_none());
    }
}

#[test]
fn queued_commands_are_cancelled_with_their_lease() {
    let mut bench = bench_with_lease();
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Continue));
    bench.take(&Step::Release(0));
    assert_eq!(bench.schedule.open().count(), 0);
    let ended = bench.schedule.finished().next().expect("an ended command");
    assert_eq!(ended.outcome, Some(EndKind::Stopped));
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Continue));
    assert_eq!(
        bench.schedule.open().count(),
        0,
        "the lease is not valid any more"
    );
}

#[test]
fn expired_lease_that_a_run_keeps_queues_nothing_until_it_is_renewed() {
    let mut bench = bench_with_lease();
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Continue));
    bench.take(&Step::Advance);
    bench.take(&Step::Wait(10_000));
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Continue));
    assert_eq!(bench.schedule.open().count(), 1, "only the run in progress");
    bench.take(&Step::Renew(0));
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Continue));
    assert_eq!(bench.schedule.open().count(), 2);
}

#[test]
fn released_lease_that_a_run_keeps_cannot_be_renewed() {
    let mut bench = bench_with_lease();
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Continue));
    bench.take(&Step::Advance);
    let secret = bench.known(0);
    bench.take(&Step::Release(0));
    assert!(bench.schedule.lease().is_some(), "the run keeps it");
    let (schedule, now) = (&mut bench.schedule, bench.now);
    assert_eq!(
        schedule.renew_lease(&secret, now),
        Err(ScheduleError::NoLease)
    );
    assert!(schedule.require_lease(&secret, now).is_err());
}

#[test]
fn lease_is_invalid_at_its_expiry_also_before_anyone_has_looked() {
    let mut bench = bench_with_lease();
    let secret = bench.known(0);
    bench.now.instant += Duration::from_secs(10);
    let (schedule, now) = (&mut bench.schedule, bench.now);
    assert!(schedule.require_lease(&secret, now).is_err());
    assert_eq!(
        schedule.release_lease(&secret, now),
        Err(ScheduleError::NoLease)
    );
    assert_eq!(
        schedule.renew_lease(&secret, now),
        Err(ScheduleError::NoLease)
    );
}

#[test]
fn terminal_of_another_operator_waits_for_the_lease() {
    let mut bench = bench_with_lease();
    bench.take(&Step::Attach(1, Command::Chirp));
    bench.take(&Step::Advance);
    let waiting = bench.schedule.open().next().map(|entry| entry.phase);
    assert_eq!(waiting, Some(Phase::WaitingForLease));
    bench.take(&Step::Release(0));
    bench.take(&Step::Advance);
    let begun = bench.schedule.current().map(|entry| entry.phase);
    assert_eq!(begun, Some(Phase::Starting));
}

#[test]
fn settling_twice_does_not_cut_and_a_cut_raises_both_flags() {
    let raised = |stops: &[StopKind]| {
        let mut bench = Bench::new();
        bench.take(&Step::Attach(0, Command::Control));
        bench.take(&Step::Advance);
        for stop in stops {
            bench.schedule.stop_bench(*stop, "somebody", bench.now);
        }
        let entry = bench.schedule.current().expect("a run");
        let flags = entry.stop.flags().iter();
        flags
            .filter(|flag| flag.load(std::sync::atomic::Ordering::Relaxed))
            .count()
    };
    use StopKind::{Cut, Settle};
    assert_eq!(raised(&[Settle]), 1);
    assert_eq!(raised(&[Settle, Settle, Settle]), 1);
    assert_eq!(raised(&[Cut]), 2);
    assert_eq!(raised(&[Settle, Cut]), 2);
}

#[test]
fn first_cause_of_a_hold_remains() {
    use HoldCause::{Stop, Trip};
    for first in [Stop, Trip] {
        for second in [Stop, Trip] {
            let mut bench = Bench::new();
            bench.take(&Step::Attach(0, Command::Control));
            bench.take(&Step::Advance);
            bench.take(&Step::BeginRun);
            bench.hold(first, "the first");
            let held = bench.schedule.hold().cloned().expect("a hold");
            assert_eq!((held.cause, held.by.as_str()), (first, "the first"));
            bench.now.unix_s += 1.0;
            bench.hold(second, "the second");
            assert_eq!(bench.schedule.hold(), Some(&held), "{first:?}, {second:?}");
        }
    }
}

#[test]
fn shutdown_cancels_the_queue_and_refuses_commands() {
    let mut bench = bench_with_lease();
    for _ in 0..3 {
        bench.take(&Step::Queue(0, Command::Control, OnDisconnect::Continue));
    }
    bench.take(&Step::Advance);
    bench.take(&Step::ShutDown);
    assert_eq!(bench.schedule.open().count(), 1);
    assert!(bench.schedule.current().expect("a run").is_stopped);
    bench.take(&Step::Queue(0, Command::Chirp, OnDisconnect::Default));
    assert_eq!(bench.schedule.open().count(), 1);
}

#[test]
fn full_queue_is_refused() {
    let mut bench = Bench::new();
    for _ in 0..MAX_QUEUED + 5 {
        bench.take(&Step::Attach(0, Command::Chirp));
    }
    assert_eq!(bench.schedule.open().count(), MAX_QUEUED + 1);
}
