//! Random sequences of requests from several clients: with and without token and lease, malformed, cut off, and at the same time.
//!
//! The test keeps its own list of what it was allowed to do. Whatever the daemon shows beyond this list is a fault.
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};

use crate::daemon::asks::{Access, Action, Ask, Form, Sent, Step, command, steps};
use crate::daemon::common::{Daemon, TIME_LIMIT};
use crate::daemon::wire::{exchange, request, send_and_leave, status, tcp, unix};

/// Sequences in a test run; `BENCH_API_SEQUENCES` for more.
const SEQUENCES: u32 = 10;
/// Growth of the daemon that is not a leak: buffers of its threads, results that it remembers.
const MAX_GROWTH_KIB: u64 = 64 << 10;
const MAX_MORE_DESCRIPTORS: usize = 4;

/// What the test has been given by the daemon.
#[derive(Default)]
struct Rights {
    lease: Option<String>,
    former: Option<String>,
    /// Commands that were queued with token and lease.
    commands: BTreeSet<u64>,
}

impl Rights {
    fn lease(&self, sent: Sent) -> String {
        let text = match sent {
            Sent::Own => self.lease.as_deref(),
            Sent::Former => self.former.as_deref(),
            Sent::Wrong => Some("0123456789abcdef0123456789abcdef"),
            Sent::None => None,
        };
        text.unwrap_or_default().into()
    }

    /// Whether the daemon must refuse a request.
    fn forbid(&self, ask: Ask) -> bool {
        let has_token = matches!(ask.access, Access::Socket | Access::Token);
        let has_lease = ask.sent == Sent::Own && self.lease.is_some();
        ask.action.needs_token() && !has_token || ask.action.needs_lease() && !has_lease
    }

    /// Takes note of an answer.
    fn note(&mut self, ask: Ask, sent: &str, answer: &[u8]) {
        let end_of_head = answer.windows(4).position(|four| four == b"\r\n\r\n");
        let body = end_of_head.map_or(&answer[..0], |at| &answer[at + 4..]);
        let body: Value = serde_json::from_slice(body).unwrap_or_default();
        match (ask.action, status(answer)) {
            (Action::TakeLease, Some(201)) => {
                self.former = self.lease.take().or(self.former.take());
                self.lease = body["lease"].as_str().map(String::from);
            }
            (Action::ReleaseLease, Some(204)) => {
                // Another one may have been taken at the same time.
                if self.lease.as_deref() == Some(sent) {
                    self.lease = None;
                }
                self.former = Some(sent.into());
            }
            (Action::Start, Some(202)) => {
                self.commands.extend(body["id"].as_u64());
            }
            _ => {}
        }
    }
}

/// The bytes of a request. One that is cut off lacks the end of its body, or of its head if it has no body.
fn bytes_of(ask: Ask, rights: &Rights, daemon: &Daemon) -> Vec<u8> {
    let (method, path, body) = ask.action.request();
    let authorization = match ask.access {
        Access::Token => format!("Bearer {}", daemon.token()),
        Access::WrongToken => "Bearer 0123456789abcdef0123456789abcdef".into(),
        Access::Socket | Access::NoToken => String::new(),
    };
    let lease = rights.lease(ask.sent);
    let media_type = match ask.form {
        Form::OtherType => "text/html",
        _ => "application/json",
    };
    let headers = [
        ("Host", "localhost"),
        ("Authorization", &authorization),
        ("Bench-Lease", &lease),
        ("Content-Type", media_type),
    ];
    let valid = body.map_or(Vec::new(), |body| body.to_string().into_bytes());
    let body = match ask.form {
        Form::Valid | Form::OtherType | Form::CutOff => valid,
        Form::Malformed => [valid.as_slice(), b"}"].concat(),
        Form::NotUtf8 => [b"{\"\xff\":1,", valid.get(1..).unwrap_or_default()].concat(),
        Form::Oversized => [valid, vec![b' '; 2 << 20]].concat(),
    };
    let mut bytes = request(method, &path, &headers, &body);
    if ask.form == Form::CutOff {
        bytes.truncate(bytes.len() - 3);
    }
    bytes
}

/// Sends a request; the answer is empty if the connection was closed.
fn send(ask: Ask, bytes: &[u8], daemon: &Daemon) -> Vec<u8> {
    match (ask.form, ask.access) {
        (Form::CutOff, Access::Socket) => send_and_leave(unix(daemon), bytes),
        (Form::CutOff, _) => send_and_leave(tcp(daemon), bytes),
        (_, Access::Socket) => return exchange(unix(daemon), bytes),
        (_, _) => return exchange(tcp(daemon), bytes),
    }
    Vec::new()
}

fn take(step: &Step, rights: &mut Rights, daemon: &Daemon) -> Result<(), TestCaseError> {
    let sent_leases: Vec<String> = step.iter().map(|ask| rights.lease(ask.sent)).collect();
    let answers: Vec<(Ask, bool, Vec<u8>)> = std::thread::scope(|scope| {
        let sent = step.iter().map(|ask| {
            let bytes = bytes_of(*ask, rights, daemon);
            let is_forbidden = rights.forbid(*ask);
            let answer = scope.spawn(move || send(*ask, &bytes, daemon));
            (*ask, is_forbidden, answer)
        });
        let sent: Vec<_> = sent.collect();
        let answers = sent.into_iter();
        answers
            .map(|(ask, is_forbidden, answer)| {
                (ask, is_forbidden, answer.join().expect("an answer"))
            })
            .collect()
    });
    for ((ask, is_forbidden, answer), lease) in answers.into_iter().zip(&sent_leases) {
        let status = status(&answer);
        let may_close = matches!(ask.form, Form::CutOff | Form::Oversized);
        prop_assert!(status.is_some() || may_close, "no answer: {ask:?}");
        prop_assert!(
            status < Some(500),
            "{ask:?}: {}",
            String::from_utf8_lossy(&answer)
        );
        let is_refused = status.is_none_or(|status| (400..500).contains(&status));
        prop_assert!(
            is_refused || !is_forbidden,
            "{ask:?} was not refused: {status:?}"
        );
        if ask.form == Form::Valid && is_forbidden && ask.action.needs_token() {
            let is_for_rights = matches!(status, Some(401 | 403));
            prop_assert!(is_for_rights, "{ask:?}: {status:?}");
        }
        rights.note(ask, lease, &answer);
    }
    Ok(())
}

/// Waits until no command is about to run.
fn wait_for_run(daemon: &Daemon) {
    daemon.wait("the next command runs", "", |state| {
        let waits = state["queue"]
            .as_array()
            .is_some_and(|queue| !queue.is_empty());
        match state["run"]["phase"].as_str() {
            None => !waits || !state["held"].is_null(),
            Some("starting") => false,
            Some("running") => state["loop"]["state"] == "running",
            Some(_) => true,
        }
    });
}

/// What the daemon shows is what the test was allowed to do.
fn check(rights: &Rights, daemon: &Daemon) -> Result<Value, TestCaseError> {
    let runs = daemon.get("/api/v1/runs");
    let known =
        ["queue", "finished"].map(|list| runs[list].as_array().cloned().unwrap_or_default());
    let current = runs["current"].as_object().map(|_| runs["current"].clone());
    for run in known.concat().into_iter().chain(current) {
        let id = run["id"].as_u64().unwrap_or_default();
        prop_assert!(
            rights.commands.contains(&id),
            "{run} was queued without lease"
        );
    }
    let state = daemon.state();
    prop_assert!(
        !rights.commands.is_empty() || is_idle(&state),
        "moved without lease: {state}"
    );
    if let Some(holder) = state["lease"]["operator"].as_str() {
        prop_assert_eq!(holder, "anna", "the operator of the test: {}", state);
    }
    Ok(state)
}

/// Nothing has its turn, the amplifier is off, and the current is zero.
fn is_idle(state: &Value) -> bool {
    let current_a = state["loop"]["current_a"].as_f64().unwrap_or(0.0);
    state["run"].is_null() && state["loop"]["state"] == "disarmed" && current_a == 0.0
}

/// Ends what a sequence has begun. A lease of which the test has lost the answer expires.
fn settle(rights: &mut Rights, daemon: &Daemon) {
    if let Some(lease) = rights.lease.take() {
        daemon.ask("DELETE", "/api/v1/lease", &lease, None);
        rights.former = Some(lease);
    }
    let begun = Instant::now();
    loop {
        daemon.ask("POST", "/api/v1/stop", "", None);
        let state = daemon.state();
        if is_idle(&state) && state["queue"] == json!([]) && state["lease"].is_null() {
            return;
        }
        assert!(begun.elapsed() < TIME_LIMIT, "{state}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Open file descriptors of the daemon.
fn descriptors(daemon: &Daemon) -> usize {
    let open = std::fs::read_dir(format!("/proc/{}/fd", daemon.pid()));
    open.expect("a process").count()
}

/// Memory of the daemon in KiB.
fn memory_kib(daemon: &Daemon) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{}/status", daemon.pid()));
    let text = text.expect("a process");
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next());
    kib.and_then(|kib| kib.parse().ok()).expect("a number")
}

#[test]
fn random_sequences_never_move_without_token_and_lease() {
    let daemon = Daemon::start();
    daemon.wait("the rig is open", "", |state| {
        is_idle(state) && !state["daemon"]["probe"].is_null()
    });
    let wanted = std::env::var("BENCH_API_SEQUENCES").ok();
    let cases = wanted
        .and_then(|text| text.parse().ok())
        .unwrap_or(SEQUENCES);
    let mut runner = TestRunner::new(ProptestConfig {
        cases,
        failure_persistence: None,
        // The daemon remembers what it was asked: a shorter sequence may not fail again.
        max_shrink_iters: 0,
        ..ProptestConfig::default()
    });
    let rights = std::cell::RefCell::new(Rights::default());
    let before = std::cell::Cell::new((0, 0));
    let runs_seen = std::cell::Cell::new(0);
    let outcome = runner.run(&steps(), |steps| {
        let mut rights = rights.borrow_mut();
        for step in &steps {
            if step.is_empty() {
                wait_for_run(&daemon)
            } else {
                take(step, &mut rights, &daemon)?
            }
            let state = check(&rights, &daemon)?;
            runs_seen.set(runs_seen.get() + u32::from(state["loop"]["state"] == "running"));
        }
        settle(&mut rights, &daemon);
        if before.get() == (0, 0) {
            before.set((descriptors(&daemon), memory_kib(&daemon)));
        }
        Ok(())
    });
    outcome.expect("no fault");
    assert!(runs_seen.get() > 0, "no sequence closed the loop");
    let (open, kib) = before.get();
    let begun = Instant::now();
    while descriptors(&daemon) > open + MAX_MORE_DESCRIPTORS {
        let now = descriptors(&daemon);
        assert!(
            begun.elapsed() < TIME_LIMIT,
            "{open} descriptors became {now}"
        );
        std::thread::sleep(Duration::from_millis(100));
    }
    let now = memory_kib(&daemon);
    assert!(now < kib + MAX_GROWTH_KIB, "{kib} KiB became {now} KiB");
    assert!(is_idle(&daemon.state()));
}

#[test]
fn expired_and_released_leases_start_tune_and_renew_nothing() {
    let daemon = Daemon::start();
    let released = daemon.take_lease("anna");
    assert_eq!(
        daemon
            .ask("DELETE", "/api/v1/lease", &released, None)
            .status,
        204
    );
    let expired = daemon.take_lease("anna");
    daemon.wait("the lease expires", "", |state| state["lease"].is_null());
    let refuses_all = |lease: &str| {
        for (method, path, body) in [
            ("POST", "/api/v1/runs", Some(command())),
            ("POST", "/api/v1/tune", Some(json!({ "gain": 0.9 }))),
            ("POST", "/api/v1/clear", None),
            ("POST", "/api/v1/resume", None),
            ("PUT", "/api/v1/lease", None),
            ("DELETE", "/api/v1/lease", None),
        ] {
            let answer = daemon.ask(method, path, lease, body);
            assert_eq!(answer.status, 403, "{method} {path}");
        }
    };
    refuses_all(&released);
    refuses_all(&expired);
    let other = daemon.take_lease("bert");
    refuses_all(&released);
    refuses_all(&expired);
    assert_eq!(daemon.get("/api/v1/runs")["finished"], json!([]));
    assert!(is_idle(&daemon.state()));
    assert_eq!(
        daemon.ask("DELETE", "/api/v1/lease", &other, None).status,
        204
    );
}
