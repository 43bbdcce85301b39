//! Each rule of the queue alone, and its times.

use super::tests::order;
use super::*;
use crate::hold::HoldCause;
use crate::run_entry::OnDisconnect;

const MILLISECOND: Duration = Duration::from_millis(1);

fn start() -> Now {
    Now {
        instant: Instant::now(),
        unix_s: 100.0,
    }
}

fn later(now: Now, time: Duration) -> Now {
    Now {
        instant: now.instant + time,
        unix_s: now.unix_s + time.as_secs_f64(),
    }
}

fn secret(text: &str) -> Secret {
    Secret::known(text.into())
}

fn new_entry(command: Command, operator: &str) -> NewEntry {
    NewEntry {
        request: RunRequest {
            order: order(command),
            name: String::new(),
            note: String::new(),
            on_disconnect: OnDisconnect::Default,
        },
        carrier: Carrier::Attached,
        operator: operator.into(),
        lease: None,
    }
}

/// A command at a terminal.
fn attach(schedule: &mut Schedule, command: Command, operator: &str, now: Now) -> u64 {
    let queued = schedule.enqueue(new_entry(command, operator), now);
    queued.expect("a place in the queue")
}

/// A command of anna's client, which has the lease.
fn queue(schedule: &mut Schedule, command: Command, ticket: &str, now: Now) -> u64 {
    let new = NewEntry {
        carrier: Carrier::Started {
            ticket: secret(ticket),
        },
        lease: Some(secret("lease of anna")),
        ..new_entry(command, "anna")
    };
    schedule.enqueue(new, now).expect("a place in the queue")
}

fn with_lease(now: Now) -> Schedule {
    let mut schedule = Schedule::default();
    let taken = schedule.take_lease("anna", secret("lease of anna"), now);
    assert_eq!(taken, Ok(()));
    schedule
}

/// A command of anna's client that has its turn: number 1.
fn with_turn(command: Command, now: Now) -> Schedule {
    let mut schedule = with_lease(now);
    let id = queue(&mut schedule, command, "ticket", now);
    assert_eq!(schedule.advance(|| None, now), Some(id));
    schedule
}

fn current(schedule: &Schedule) -> Option<u64> {
    schedule.current().map(|entry| entry.id)
}

fn ended(outcome: EndKind) -> EndedRun {
    EndedRun {
        outcome,
        recording: None,
        message: None,
        tripped_by: (outcome == EndKind::Tripped).then(|| "the interlock travel".into()),
    }
}

#[test]
fn version_counts_lease_open_ended_and_those_that_wait_for_the_lease() {
    let (now, mut schedule) = (start(), Schedule::default());
    assert_eq!(schedule.version(), (false, 0, 0, 0));
    schedule
        .take_lease("anna", secret("lease of anna"), now)
        .expect("a lease");
    assert_eq!(schedule.version(), (true, 0, 0, 0));
    for _ in 0..3 {
        attach(&mut schedule, Command::Chirp, "berta", now);
    }
    assert_eq!(schedule.version(), (true, 3, 0, 0));
    assert_eq!(schedule.advance(|| None, now), None);
    assert_eq!(schedule.version(), (true, 3, 0, 1));
    schedule.finish(1, EndKind::Stopped, None, now);
    schedule.finish(2, EndKind::Stopped, None, now);
    assert_eq!(schedule.version(), (true, 1, 2, 0));
}

#[test]
fn commands_have_rising_numbers_and_are_found_until_and_after_their_end() {
    let (now, mut schedule) = (start(), Schedule::default());
    for expected in 1..=3 {
        assert_eq!(attach(&mut schedule, Command::Chirp, "anna", now), expected);
    }
    schedule.finish(2, EndKind::Stopped, None, now);
    for id in 1..=3 {
        assert_eq!(schedule.entry(id).map(|entry| entry.id), Ok(id));
        let is_open = schedule.open_entry(id).map(|entry| entry.id);
        let unknown = Err(ScheduleError::Unknown(id));
        assert_eq!(is_open, if id == 2 { unknown } else { Ok(id) });
    }
    assert_eq!(
        schedule.entry(4).map(|entry| entry.id),
        Err(ScheduleError::Unknown(4))
    );
}

#[test]
fn ticket_is_that_of_one_open_command() {
    let now = start();
    let mut schedule = with_lease(now);
    attach(&mut schedule, Command::Chirp, "anna", now);
    for (ticket, id) in [("red", 2), ("blue", 3), ("green", 4)] {
        assert_eq!(queue(&mut schedule, Command::Chirp, ticket, now), id);
    }
    assert_eq!(schedule.by_ticket("blue"), Ok(3));
    assert_eq!(schedule.by_ticket("green"), Ok(4));
    schedule.finish(3, EndKind::Completed, None, now);
    for invalid in ["blue", "yellow", ""] {
        assert_eq!(schedule.by_ticket(invalid), Err(ScheduleError::NoTicket));
    }
}

#[test]
fn ended_commands_are_listed_newest_first_and_counted_by_command_and_end() {
    let (now, mut schedule) = (start(), Schedule::default());
    let ends = [
        (Command::Chirp, EndKind::Completed),
        (Command::Control, EndKind::Completed),
        (Command::Chirp, EndKind::Stopped),
        (Command::Chirp, EndKind::Completed),
        (Command::Chirp, EndKind::Completed),
    ];
    for (command, end) in ends {
        let id = attach(&mut schedule, command, "anna", now);
        schedule.finish(id, end, None, now);
    }
    let listed: Vec<u64> = schedule.finished().map(|entry| entry.id).collect();
    assert_eq!(listed, [5, 4, 3, 2, 1]);
    let expected = BTreeMap::from([
        ((Command::Chirp, EndKind::Completed), 3),
        ((Command::Chirp, EndKind::Stopped), 1),
        ((Command::Control, EndKind::Completed), 1),
    ]);
    assert_eq!(schedule.ended(), &expected);
}

#[test]
fn queue_is_what_waits_behind_the_command_that_has_its_turn() {
    let now = start();
    let mut schedule = with_turn(Command::Chirp, now);
    for _ in 0..2 {
        attach(&mut schedule, Command::Chirp, "berta", now);
    }
    let ids = |schedule: &Schedule| schedule.queue().map(|e| e.id).collect::<Vec<u64>>();
    assert_eq!((current(&schedule), ids(&schedule)), (Some(1), vec![2, 3]));
    assert_eq!(schedule.advance(|| None, now), None, "one turn at a time");
    schedule.finish(1, EndKind::Completed, None, now);
    assert_eq!((current(&schedule), ids(&schedule)), (None, vec![2, 3]));
}

#[test]
fn shutdown_refuses_leases_and_commands() {
    let (now, mut schedule) = (start(), Schedule::default());
    assert!(!schedule.is_shutting_down());
    schedule.shut_down(now);
    assert!(schedule.is_shutting_down());
    let taken = schedule.take_lease("anna", secret("lease of anna"), now);
    assert_eq!(taken, Err(ScheduleError::ShuttingDown));
    let queued = schedule.enqueue(new_entry(Command::Chirp, "anna"), now);
    assert_eq!(queued, Err(ScheduleError::ShuttingDown));
}

#[test]
fn lease_has_one_holder() {
    let now = start();
    let mut schedule = with_lease(now);
    let operator = "anna".into();
    assert_eq!(
        schedule.take_lease("berta", secret("lease of berta"), now),
        Err(ScheduleError::Held { operator })
    );
    for invalid in ["lease of berta", ""] {
        let refused = Err(ScheduleError::NoLease);
        let required = schedule.require_lease(invalid, now).map(|_| ());
        assert_eq!(required, refused);
        assert_eq!(schedule.renew_lease(invalid, now), refused);
        assert_eq!(schedule.release_lease(invalid, now), refused);
    }
    let lease = schedule.require_lease("lease of anna", now);
    assert!(lease.is_ok_and(|lease| lease.operator == "anna"));
}

#[test]
fn taken_lease_expires_ten_seconds_later_or_after_its_renewal() {
    let now = start();
    let mut schedule = with_lease(now);
    let ten = Duration::from_secs(10);
    let before = later(now, ten - MILLISECOND);
    schedule.expire(before);
    assert_eq!(schedule.renew_lease("lease of anna", before), Ok(()));
    schedule.expire(later(before, ten - MILLISECOND));
    assert!(schedule.lease().is_some());
    schedule.expire(later(before, ten));
    assert!(schedule.lease().is_none());
}

#[test]
fn run_keeps_the_lost_lease_of_its_client() {
    let now = start();
    let mut schedule = with_turn(Command::Chirp, now);
    assert_eq!(schedule.release_lease("lease of anna", now), Ok(()));
    let lease = schedule.lease().expect("a lease");
    assert_eq!(
        (&lease.keeper, lease.operator.as_str()),
        (&Keeper::Run(1), "anna")
    );
    let entry = schedule.current().expect("a run");
    assert_eq!((entry.is_orphan, entry.is_stopped), (true, false));
    // The end of another command does not end it.
    let other = attach(&mut schedule, Command::Chirp, "berta", now);
    schedule.finish(other, EndKind::Stopped, None, now);
    assert!(schedule.lease().is_some());
    schedule.finish(1, EndKind::Completed, None, now);
    assert!(schedule.lease().is_none());
}

#[test]
fn terminal_of_the_same_operator_begins_under_the_lease_and_goes_on_without_it() {
    let now = start();
    let mut schedule = with_lease(now);
    attach(&mut schedule, Command::Control, "anna", now);
    assert_eq!(schedule.advance(|| None, now), Some(1));
    assert_eq!(schedule.release_lease("lease of anna", now), Ok(()));
    assert!(schedule.lease().is_none());
    let entry = schedule.current().expect("a run");
    assert_eq!((entry.is_orphan, entry.is_stopped), (false, false));
}

#[test]
fn terminal_takes_a_free_lease_at_its_turn_if_there_is_a_secret_for_it() {
    let (now, mut schedule) = (start(), Schedule::default());
    attach(&mut schedule, Command::Chirp, "berta", now);
    assert_eq!(schedule.advance(|| None, now), None);
    assert_eq!(
        (current(&schedule), schedule.lease().is_some()),
        (None, false)
    );
    assert_eq!(schedule.advance(|| Some(secret("own")), now), Some(1));
    let lease = schedule.lease().expect("a lease");
    assert_eq!(
        (&lease.keeper, lease.operator.as_str()),
        (&Keeper::Run(1), "berta")
    );
}

#[test]
fn lost_client_stops_control_only_and_cancels_what_waits() {
    for (command, is_stopped) in [(Command::Control, true), (Command::Chirp, false)] {
        let now = start();
        let mut schedule = with_turn(command, now);
        let waiting = queue(&mut schedule, command, "next", now);
        schedule.lose_client(waiting, now);
        assert!(schedule.open_entry(waiting).is_err());
        let entry = schedule.current().expect("a run");
        assert_eq!((entry.is_orphan, entry.is_stopped), (false, false));
        schedule.lose_client(1, now);
        let entry = schedule.current().expect("a run");
        assert_eq!((entry.is_orphan, entry.is_stopped), (true, is_stopped));
    }
}

/// Ways in which a command is stopped.
const STOPS: [fn(&mut Schedule, Now); 5] = [
    |schedule, now| assert_eq!(schedule.stop_bench(StopKind::Settle, "berta", now), Some(1)),
    |schedule, now| assert_eq!(schedule.stop(1, StopKind::Cut, "berta", now), Ok(())),
    |schedule, now| assert_eq!(schedule.release_lease("lease of anna", now), Ok(())),
    |schedule, now| schedule.lose_client(1, now),
    |schedule, now| schedule.shut_down(now),
];

#[test]
fn stopped_command_without_a_run_keeps_its_turn_for_half_a_second() {
    for stop in STOPS {
        let now = start();
        let mut schedule = with_turn(Command::Control, now);
        stop(&mut schedule, now);
        schedule.expire(later(now, Duration::from_millis(499)));
        assert_eq!(current(&schedule), Some(1));
        schedule.expire(later(now, Duration::from_millis(500)));
        assert_eq!(current(&schedule), None);
        let outcome = schedule.entry(1).map(|entry| entry.outcome);
        assert_eq!(outcome, Ok(Some(EndKind::Stopped)));
    }
}

#[test]
fn stopped_command_keeps_its_turn_until_half_a_second_after_the_end_of_its_run() {
    for stop in STOPS {
        for outcome in [EndKind::Stopped, EndKind::Tripped] {
            let now = start();
            let mut schedule = with_turn(Command::Control, now);
            assert_eq!(schedule.begin_run(1, |_| ()), Ok(()));
            stop(&mut schedule, now);
            let end = later(now, Duration::from_secs(9));
            schedule.expire(end);
            assert_eq!(current(&schedule), Some(1), "the run goes on");
            schedule.end_run(1, ended(outcome), end);
            schedule.expire(later(end, Duration::from_millis(499)));
            assert_eq!(current(&schedule), Some(1));
            schedule.expire(later(end, Duration::from_millis(500)));
            assert_eq!(current(&schedule), None);
            let found = schedule.entry(1).map(|entry| entry.outcome);
            assert_eq!(found, Ok(Some(outcome)), "a trip remains a trip");
        }
    }
}

#[test]
fn command_that_was_not_stopped_keeps_its_turn_after_its_run() {
    let now = start();
    let mut schedule = with_turn(Command::Chirp, now);
    assert_eq!(schedule.begin_run(1, |_| ()), Ok(()));
    schedule.end_run(1, ended(EndKind::Completed), now);
    schedule.expire(later(now, Duration::from_secs(3600)));
    let entry = schedule.current().expect("its turn");
    assert_eq!(
        (entry.phase, entry.outcome),
        (Phase::Analysing, Some(EndKind::Completed))
    );
}

#[test]
fn run_begins_only_in_its_turn_unstopped_and_on_a_released_bench() {
    let now = start();
    let mut schedule = with_turn(Command::Chirp, now);
    let waiting = queue(&mut schedule, Command::Chirp, "next", now);
    for other in [waiting, 7] {
        let refused = schedule.begin_run(other, |_| ());
        assert_eq!(refused, Err(ScheduleError::Stopped));
    }
    assert_eq!(schedule.begin_run(1, |entry| entry.id), Ok(1));
    assert_eq!(
        schedule.current().map(|entry| entry.phase),
        Some(Phase::Running)
    );

    let mut schedule = with_turn(Command::Chirp, now);
    assert_eq!(schedule.stop_bench(StopKind::Settle, "berta", now), Some(1));
    let hold = schedule.hold().cloned().expect("a hold");
    let refused = schedule.begin_run(1, |_| ());
    assert_eq!(refused, Err(ScheduleError::OnHold(hold)));
    assert!(schedule.resume("lease of anna", now).is_ok());
    let refused = schedule.begin_run(1, |_| ());
    assert_eq!(refused, Err(ScheduleError::Stopped));
}

#[test]
fn stop_of_one_command_cancels_it_while_it_waits_and_holds_the_bench_in_its_turn() {
    let now = start();
    let mut schedule = with_turn(Command::Chirp, now);
    let waiting = queue(&mut schedule, Command::Chirp, "next", now);
    let mut stop = |id: u64| {
        let stopped = schedule.stop(id, StopKind::Settle, "berta", now);
        let is_stopped = schedule.current().map(|entry| entry.is_stopped);
        (stopped, is_stopped, schedule.hold().is_some())
    };
    let unknown = Err(ScheduleError::Unknown(9));
    assert_eq!(stop(9), (unknown, Some(false), false));
    assert_eq!(stop(waiting), (Ok(()), Some(false), false));
    // It has ended already.
    assert_eq!(stop(waiting), (Ok(()), Some(false), false));
    assert_eq!(stop(1), (Ok(()), Some(true), true));
    assert_eq!(schedule.ended().values().sum::<u64>(), 1);
}

#[test]
fn hold_names_the_run_and_is_released_by_the_holder_of_the_lease() {
    let now = start();
    let mut schedule = with_lease(now);
    assert_eq!(schedule.stop_bench(StopKind::Cut, "berta", now), None);
    let expected = Hold {
        cause: HoldCause::Stop,
        by: "berta".into(),
        since_unix_s: 100.0,
        how: Some(StopKind::Cut),
        run: None,
    };
    assert_eq!(schedule.hold(), Some(&expected));
    let id = queue(&mut schedule, Command::Chirp, "ticket", now);
    let phase = |schedule: &Schedule| schedule.entry(id).map(|entry| entry.phase);
    assert_eq!(phase(&schedule), Ok(Phase::Held));
    assert_eq!(schedule.advance(|| None, now), None);
    assert_eq!(
        schedule.resume("of berta", now),
        Err(ScheduleError::NoLease)
    );
    assert_eq!(schedule.resume("lease of anna", now), Ok(Some(expected)));
    assert_eq!(
        (phase(&schedule), schedule.hold()),
        (Ok(Phase::Queued), None)
    );
    assert_eq!(schedule.resume("lease of anna", now), Ok(None));

    assert_eq!(schedule.advance(|| None, now), Some(id));
    let next = queue(&mut schedule, Command::Chirp, "next", now);
    assert_eq!(schedule.begin_run(id, |_| ()), Ok(()));
    schedule.end_run(id, ended(EndKind::Tripped), now);
    let hold = schedule.hold().expect("a hold");
    assert_eq!((hold.cause, hold.run), (HoldCause::Trip, Some(id)));
    let phases: Vec<Phase> = [id, next]
        .iter()
        .filter_map(|id| schedule.entry(*id).ok())
        .map(|entry| entry.phase)
        .collect();
    assert_eq!(phases, [Phase::Analysing, Phase::Held]);
}

#[test]
fn exit_code_of_a_process_is_noted_also_after_the_end_of_its_turn() {
    let now = start();
    let mut schedule = with_turn(Command::Chirp, now);
    let next = queue(&mut schedule, Command::Chirp, "next", now);
    for id in [1, next] {
        schedule.open_entry(id).expect("open").has_process = true;
    }
    let process = |schedule: &Schedule, id: u64| {
        let entry = schedule.entry(id).expect("a command");
        (entry.has_process, entry.exit_code)
    };
    schedule.finish(1, EndKind::Stopped, None, now);
    assert_eq!(process(&schedule, 1), (true, None));
    schedule.end_process(1, Some(3));
    assert_eq!(process(&schedule, 1), (false, Some(3)));
    assert_eq!(process(&schedule, next), (true, None));
    schedule.end_process(next, None);
    assert_eq!(process(&schedule, next), (false, None));
}
