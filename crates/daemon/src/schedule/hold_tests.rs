//! Random sequences of stops, trips, resumes, hung and lost clients, beside expectations that do not use the queue: a plain note of who
//! holds the lease, and of every stop, trip and resume.

use std::time::Duration;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::tests::order;
use super::*;
use crate::run_entry::OnDisconnect;

/// Sequences: some thousands in each test run, 100,000 with BENCH_HOLDS=100000.
const SEQUENCES: u64 = 4_000;
const STEPS: usize = 60;
/// After a stop nothing has its turn, this time after the end of its run.
const FREE: Duration = Duration::from_secs(1);
const OPERATORS: usize = 2;

/// Random numbers of a sequence.
struct Chance(Pcg64Mcg);

impl Chance {
    /// A number from 0 to `limit - 1`.
    fn below(&mut self, limit: usize) -> usize {
        (self.0.next_u32() as usize) % limit
    }

    fn coin(&mut self) -> bool {
        self.below(2) == 0
    }
}

/// What the test knows, and what it expects.
struct Expected {
    schedule: Schedule,
    now: Now,
    secrets: u64,
    /// The last lease that each operator received.
    given: [String; OPERATORS],
    /// Whether a stop or a trip happened after the last resume.
    is_held: bool,
    /// When a stop or the end of a stopped run left the command that has its turn without a run.
    idle_since_stop: Option<(u64, Instant)>,
}

impl Expected {
    fn new() -> Expected {
        Expected {
            schedule: Schedule::default(),
            now: Now {
                instant: Instant::now(),
                unix_s: 0.0,
            },
            secrets: 0,
            given: [String::new(), String::new()],
            is_held: false,
            idle_since_stop: None,
        }
    }

    fn secret(&mut self) -> Secret {
        self.secrets += 1;
        Secret::known(format!("secret {}", self.secrets))
    }

    fn turn(&self) -> Option<(u64, Phase)> {
        self.schedule.current().map(|entry| (entry.id, entry.phase))
    }

    /// The test has stopped the bench.
    fn note_stop(&mut self) {
        self.is_held = true;
        self.note_idle();
    }

    /// A stopped command has no run from now on.
    fn note_idle(&mut self) {
        match self.turn() {
            Some((id, phase)) if phase != Phase::Running => {
                let is_known = self.idle_since_stop.is_some_and(|(known, _)| known == id);
                if !is_known {
                    self.idle_since_stop = Some((id, self.now.instant));
                }
            }
            _ => {}
        }
    }

    fn queue(&mut self, random: &mut Chance) {
        let who = random.below(OPERATORS);
        let commands = [Command::Chirp, Command::Control, Command::Linearity];
        let behaviours = [
            OnDisconnect::Default,
            OnDisconnect::Stop,
            OnDisconnect::Continue,
        ];
        let is_attached = random.coin();
        let ticket = self.secret();
        let new = NewEntry {
            request: RunRequest {
                order: order(commands[random.below(commands.len())]),
                name: String::new(),
                note: String::new(),
                on_disconnect: behaviours[random.below(behaviours.len())],
            },
            carrier: if is_attached {
                Carrier::Attached
            } else {
                Carrier::Started { ticket }
            },
            operator: format!("operator {who}"),
            lease: (!is_attached).then(|| Secret::known(self.given[who].clone())),
        };
        let queued = self.schedule.enqueue(new, self.now);
        if let Ok(id) = queued {
            let phase = self.schedule.entry(id).map(|entry| entry.phase);
            let expected = if self.is_held {
                Phase::Held
            } else {
                Phase::Queued
            };
            assert_eq!(phase, Ok(expected), "a new command says whether it waits");
        }
    }

    fn take_lease(&mut self, who: usize) {
        let secret = self.secret();
        let operator = format!("operator {who}");
        let taken = self
            .schedule
            .take_lease(&operator, secret.clone(), self.now);
        if taken.is_ok() {
            self.given[who] = secret.reveal().into();
        }
    }

    fn advance(&mut self) {
        let before = self.turn().map(|(id, _)| id);
        let secret = self.secret();
        let begun = self.schedule.advance(|| Some(secret), self.now);
        assert!(
            !(self.is_held && begun.is_some()),
            "a command got its turn between a stop or trip and a resume"
        );
        let after = self.turn().map(|(id, _)| id);
        assert!(begun.is_some() || after.is_none() || after == before);
    }

    fn begin_run(&mut self, random: &mut Chance) {
        let ids: Vec<u64> = self.schedule.open().map(|entry| entry.id).collect();
        // Also a command that has ended, or waits, may order a run.
        let id = if ids.is_empty() {
            random.below(5) as u64
        } else {
            ids[random.below(ids.len())]
        };
        let had_turn = self.turn().is_some_and(|(turn, _)| turn == id);
        let begun = self.schedule.begin_run(id, |entry| {
            assert!(!entry.stop.was_raised(), "a stopped command began a run");
        });
        assert!(
            begun.is_err() || had_turn && !self.is_held,
            "a run began between a stop or trip and a resume, or without its turn"
        );
    }

    fn end_run(&mut self, trips: bool) {
        let Some((id, Phase::Running)) = self.turn() else {
            return;
        };
        let was_stopped = self
            .schedule
            .current()
            .is_some_and(|entry| entry.stop.was_raised());
        let ended = EndedRun {
            outcome: if trips {
                EndKind::Tripped
            } else {
                EndKind::Stopped
            },
            recording: None,
            message: None,
            tripped_by: trips.then(|| "the interlock travel".into()),
        };
        self.schedule.end_run(id, ended, self.now);
        self.is_held |= trips;
        if was_stopped {
            self.note_idle();
        }
    }

    /// An operator resumes, with the lease or with one that is not valid any more.
    fn resume(&mut self, who: usize) {
        let secret = self.given[who].clone();
        let is_holder = self.schedule.require_lease(&secret, self.now).is_ok();
        let resumed = self.schedule.resume(&secret, self.now);
        assert_eq!(resumed.is_ok(), is_holder, "only the holder of the lease");
        if is_holder {
            assert_eq!(resumed.is_ok_and(|hold| hold.is_some()), self.is_held);
            self.is_held = false;
        }
    }

    /// Somebody stops a command: the one that has its turn, or one that waits.
    fn stop_one(&mut self, which: usize, kind: StopKind) {
        let Some(id) = self.schedule.open().nth(which).map(|entry| entry.id) else {
            return;
        };
        let has_turn = self.turn().is_some_and(|(turn, _)| turn == id);
        let stopped = self.schedule.stop(id, kind, "somebody", self.now);
        assert_eq!(stopped, Ok(()));
        if has_turn {
            self.note_stop()
        } else {
            assert!(self.schedule.open().all(|entry| entry.id != id))
        }
    }

    /// The connection of a command closes, as when its process is killed.
    fn lose_client(&mut self, which: usize, random: &mut Chance) {
        let Some(id) = self.schedule.open().nth(which).map(|entry| entry.id) else {
            return;
        };
        self.schedule.lose_client(id, self.now);
        // Without a run the session ends at once; otherwise it follows the run.
        let is_idle = self
            .turn()
            .is_some_and(|(turn, phase)| turn == id && phase != Phase::Running);
        if is_idle && random.coin() {
            self.schedule.finish(id, EndKind::Stopped, None, self.now);
        }
    }

    /// Time passes; the queue is looked at every 0.2 s, as the daemon does.
    fn wait(&mut self, ms: usize) {
        for _ in 0..ms / 200 {
            self.now.instant += Duration::from_millis(200);
            self.now.unix_s += 0.2;
            self.advance();
        }
    }

    fn step(&mut self, random: &mut Chance) {
        let which = random.below(3);
        let who = random.below(OPERATORS);
        let kind = if random.coin() {
            StopKind::Cut
        } else {
            StopKind::Settle
        };
        match random.below(24) {
            0..3 => self.take_lease(who),
            3 => drop(
                self.schedule
                    .renew_lease(&self.given[who].clone(), self.now),
            ),
            4 => drop(
                self.schedule
                    .release_lease(&self.given[who].clone(), self.now),
            ),
            5..9 => self.queue(random),
            9..12 => self.advance(),
            12..15 => self.begin_run(random),
            15 => self.end_run(false),
            16 => self.end_run(true),
            17 => self.stop_one(which, kind),
            18 => {
                self.schedule.stop_bench(kind, "somebody", self.now);
                self.note_stop();
            }
            19..21 => self.resume(who),
            21 => self.lose_client(which, random),
            22 => self.wait(random.below(2_000)),
            // The process of a command ends by itself.
            _ => {
                if let Some((id, Phase::Starting | Phase::Analysing)) = self.turn() {
                    self.schedule.finish(id, EndKind::Completed, None, self.now);
                }
            }
        }
    }

    /// What holds after every step.
    fn check(&self) {
        let hold = self.schedule.hold();
        assert_eq!(hold.is_some(), self.is_held, "{hold:?}");
        let waits = |entry: &RunEntry| entry.phase == Phase::Held;
        assert!(
            self.schedule
                .queue()
                .all(|entry| waits(entry) == self.is_held)
        );
        if let Some((stopped, since)) = self.idle_since_stop {
            let has_turn = self
                .turn()
                .is_some_and(|(id, phase)| id == stopped && phase != Phase::Running);
            let idle = self.now.instant - since;
            assert!(
                !has_turn || idle < FREE,
                "stopped, and its turn lasts {idle:?}"
            );
        }
    }
}

fn sequences() -> u64 {
    let wanted = std::env::var("BENCH_HOLDS").ok();
    wanted
        .and_then(|text| text.parse().ok())
        .unwrap_or(SEQUENCES)
}

#[test]
fn nothing_begins_between_a_stop_or_trip_and_a_resume() {
    let (mut turns, mut stops) = (0, 0);
    for seed in 0..sequences() {
        let mut random = Chance(Pcg64Mcg::seed_from_u64(seed));
        let mut expected = Expected::new();
        for _ in 0..STEPS {
            expected.step(&mut random);
            expected.check();
        }
        turns += expected.schedule.ended().values().sum::<u64>();
        stops += u64::from(expected.is_held);
    }
    // The sequences reach what they test: several commands end in each, and a good part ends held.
    assert!(
        turns > 2 * sequences() && stops > sequences() / 10,
        "{turns} {stops}"
    );
}
