//! Random stops, trips and resumes of two operators at a real daemon: no current flows between a stop or trip and a resume, judged by the
//! state that the daemon shows.
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};

use crate::daemon::common::{Daemon, NO_OVERRUN_LIMIT, TIME_LIMIT, freeze, order, signal};

/// Sequences in a test run, some 10 s each; `BENCH_HELD_SEQUENCES` for more.
const SEQUENCES: u64 = 4;
const STEPS: usize = 14;
const OPERATORS: [&str; 2] = ["anna", "ben"];
const SLOW: [&str; 5] = ["--slow", "--duration", "20s", "--pace", "realtime"];
/// Unstable, so that an interlock trips.
const TRIPS: [&str; 8] = [
    "--fast",
    "--asymmetry",
    "-10%",
    "--duration",
    "20s",
    "--pace",
    "realtime",
    "--seed=1",
];

/// What the test knows of the daemon.
struct Bench {
    daemon: Daemon,
    random: Pcg64Mcg,
    leases: [String; 2],
    terminals: Vec<Child>,
    /// Whether a stop or a trip was seen after the last resume.
    is_held: bool,
    /// Whether the loop was seen without current since then.
    was_at_rest: bool,
    turns: usize,
    holds: usize,
}

impl Bench {
    fn start(seed: u64) -> Bench {
        Bench {
            daemon: Daemon::start(),
            random: Pcg64Mcg::seed_from_u64(seed),
            leases: [String::new(), String::new()],
            terminals: Vec::new(),
            is_held: false,
            was_at_rest: false,
            turns: 0,
            holds: 0,
        }
    }

    fn below(&mut self, limit: usize) -> usize {
        self.random.next_u32() as usize % limit
    }

    fn lease_of(&mut self, who: usize) {
        let body = json!({ "operator": OPERATORS[who] });
        let answer = self.daemon.ask("POST", "/api/v1/lease", "", Some(body));
        if answer.status == 201 {
            let lease = answer.json()["lease"].as_str().map(String::from);
            self.leases[who] = lease.expect("a lease");
        }
    }

    fn note_hold(&mut self) {
        self.holds += usize::from(!self.is_held);
        self.was_at_rest &= self.is_held;
        self.is_held = true;
    }

    fn step(&mut self) {
        let who = self.below(2);
        let lease = self.leases[who].clone();
        match self.below(10) {
            0 | 1 => self.lease_of(who),
            2 | 3 => {
                let args = match self.below(3) {
                    0 => &TRIPS[..],
                    _ => &SLOW,
                };
                let body = order("control", args);
                self.daemon.ask("POST", "/api/v1/runs", &lease, Some(body));
            }
            4 => self.start_terminal(who),
            5 => {
                let how = ["settle", "cut"][self.below(2)];
                let body = json!({ "how": how }).to_string();
                let answer = self
                    .daemon
                    .raw("POST", "/api/v1/stop", &[], body.as_bytes());
                assert_eq!(answer.status, 200);
                self.note_hold();
            }
            6 | 7 => {
                self.watch(Duration::from_millis(400));
                let resumed = self.daemon.ask("POST", "/api/v1/resume", &lease, None);
                if resumed.status == 204 {
                    self.is_held = false;
                }
            }
            8 => self.disturb_terminal(),
            _ => drop(self.daemon.ask("DELETE", "/api/v1/lease", &lease, None)),
        }
        self.watch(Duration::from_millis(600));
    }

    fn start_terminal(&mut self, who: usize) {
        let arguments = [&["control"], &SLOW[..], &NO_OVERRUN_LIMIT].concat();
        let mut command = self.daemon.bench(self.daemon.path(), &arguments);
        command.env("USER", OPERATORS[who]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        self.terminals.push(command.spawn().expect("a process"));
    }

    /// Kills a command at a terminal, or suspends it.
    fn disturb_terminal(&mut self) {
        if self.terminals.is_empty() {
            return;
        }
        let which = self.below(self.terminals.len());
        let is_killed = self.below(2) == 0;
        let terminal = &mut self.terminals[which];
        if terminal.try_wait().expect("a process").is_some() {
            return;
        }
        if is_killed {
            signal(terminal, Signal::SIGKILL)
        } else {
            freeze(terminal)
        }
    }

    /// Looks at the state for some time.
    fn watch(&mut self, time: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < time {
            let state = self.daemon.state();
            self.check(&state);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn check(&mut self, state: &Value) {
        if !state["held"].is_null() {
            self.note_hold();
        }
        let servo = &state["loop"];
        let rests = matches!(servo["state"].as_str(), Some("disarmed" | "tripped"));
        if self.is_held {
            assert!(!state["held"].is_null(), "the hold was lost: {state}");
            assert!(
                rests || !self.was_at_rest,
                "the stage moves between a stop or trip and a resume: {state}"
            );
            assert!(!rests || servo["current_a"] == 0.0, "{state}");
        }
        // The live view of the loop may be older than the stop: a run in progress may still look like the rest before it.
        let is_over = state["run"].is_null();
        self.was_at_rest |= rests && is_over && self.is_held;
        self.turns += usize::from(servo["state"] == "running");
    }

    /// After a stop the bench is free, whatever its clients do.
    fn end(mut self) -> (usize, usize) {
        self.daemon.raw("POST", "/api/v1/stop", &[], b"");
        self.note_hold();
        let is_free =
            |state: &Value| state["run"].is_null() && state["loop"]["state"] == "disarmed";
        let begun = Instant::now();
        loop {
            let state = self.daemon.state();
            self.check(&state);
            if is_free(&state) {
                break;
            }
            assert!(begun.elapsed() < TIME_LIMIT, "{state}");
            std::thread::sleep(Duration::from_millis(20));
        }
        for terminal in &mut self.terminals {
            let _ = terminal.kill();
            let _ = terminal.wait();
        }
        (self.turns, self.holds)
    }
}

#[test]
fn no_current_flows_between_a_stop_or_trip_and_a_resume_of_two_operators() {
    let wanted = std::env::var("BENCH_HELD_SEQUENCES").ok();
    let sequences = wanted.and_then(|text| text.parse().ok());
    let (mut turns, mut holds) = (0, 0);
    for seed in 0..sequences.unwrap_or(SEQUENCES) {
        let mut bench = Bench::start(seed);
        bench.lease_of(0);
        for _ in 0..STEPS {
            bench.step();
        }
        let (more_turns, more_holds) = bench.end();
        (turns, holds) = (turns + more_turns, holds + more_holds);
    }
    assert!(turns > 0 && holds > 0, "{turns} {holds}");
}
