//! Requests of random sequences: what is asked, by whom, with which lease and in which form.
use proptest::collection::vec;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::daemon::common::order;

/// How a client reaches the daemon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Access {
    Socket,
    Token,
    WrongToken,
    NoToken,
}

/// The lease that a client sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sent {
    Own,
    Former,
    Wrong,
    None,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    Valid,
    Malformed,
    NotUtf8,
    OtherType,
    Oversized,
    /// The connection is closed in the middle of the body.
    CutOff,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    TakeLease,
    RenewLease,
    ReleaseLease,
    Start,
    Tune,
    Clear,
    Resume,
    Plan,
    Stop,
    Read(usize),
    /// A method that the path does not know.
    WrongMethod,
    LongPath,
}

#[derive(Clone, Copy, Debug)]
pub struct Ask {
    pub action: Action,
    pub access: Access,
    pub sent: Sent,
    pub form: Form,
}

/// One request, or several at the same time. Without any, the test waits until the next command runs.
pub type Step = Vec<Ask>;

const READS: [&str; 10] = [
    "/api/v1/state",
    "/api/v1/runs",
    "/api/v1/runs/1",
    "/api/v1/runs/18446744073709551616",
    "/api/v1/runs/%FF",
    "/api/v1/recordings",
    "/api/v1/recordings/%00.mcap",
    "/api/v1/recordings/..%2f..%2fetc%2fpasswd.toml",
    "/api/v1/config",
    "/metrics",
];

fn access() -> impl Strategy<Value = Access> {
    use Access::{NoToken, Socket, Token, WrongToken};
    prop_oneof![3 => Just(Socket), 3 => Just(Token), 1 => Just(WrongToken), 1 => Just(NoToken)]
}

fn sent() -> impl Strategy<Value = Sent> {
    prop_oneof![
        4 => Just(Sent::Own),
        1 => Just(Sent::Former),
        1 => Just(Sent::Wrong),
        1 => Just(Sent::None),
    ]
}

fn form() -> impl Strategy<Value = Form> {
    prop_oneof![
        8 => Just(Form::Valid),
        1 => Just(Form::Malformed),
        1 => Just(Form::NotUtf8),
        1 => Just(Form::OtherType),
        1 => Just(Form::Oversized),
        2 => Just(Form::CutOff),
    ]
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        3 => Just(Action::TakeLease),
        1 => Just(Action::RenewLease),
        1 => Just(Action::ReleaseLease),
        4 => Just(Action::Start),
        2 => Just(Action::Tune),
        1 => Just(Action::Clear),
        2 => Just(Action::Resume),
        1 => Just(Action::Plan),
        2 => Just(Action::Stop),
        3 => (0..READS.len()).prop_map(Action::Read),
        1 => Just(Action::WrongMethod),
        1 => Just(Action::LongPath),
    ]
}

fn ask() -> impl Strategy<Value = Ask> {
    (action(), access(), sent(), form()).prop_map(|(action, access, sent, form)| Ask {
        action,
        access,
        sent,
        form,
    })
}

pub fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![8 => vec(ask(), 1), 2 => vec(ask(), 2..6), 1 => Just(Vec::new())];
    (any::<bool>(), vec(step, 5..25)).prop_map(|(begins_with_run, steps)| {
        if begins_with_run {
            [run_under_lease(), steps].concat()
        } else {
            steps
        }
    })
}

/// A closed loop that the test may start. The sequence before has stopped the bench.
fn run_under_lease() -> Vec<Step> {
    let valid = |action| Ask {
        action,
        access: Access::Token,
        sent: Sent::Own,
        form: Form::Valid,
    };
    let actions = [Action::TakeLease, Action::Resume, Action::Start];
    let asks = actions.map(|action| vec![valid(action)]);
    [&asks[..], &[Vec::new()], &[vec![valid(Action::Tune)]]].concat()
}

impl Action {
    pub fn request(self) -> (&'static str, String, Option<Value>) {
        let (method, path, body) = match self {
            Action::TakeLease => ("POST", "lease", Some(json!({ "operator": "anna" }))),
            Action::RenewLease => ("PUT", "lease", None),
            Action::ReleaseLease => ("DELETE", "lease", None),
            Action::Start => ("POST", "runs", Some(command())),
            Action::Tune => ("POST", "tune", Some(json!({ "reference": 0.5 }))),
            Action::Clear => ("POST", "clear", None),
            Action::Resume => ("POST", "resume", None),
            Action::Plan => ("POST", "plan", Some(json!({ "command": "chirp" }))),
            Action::Stop => ("POST", "stop", Some(json!({ "how": "settle" }))),
            Action::Read(which) => return ("GET", READS[which].into(), None),
            Action::WrongMethod => ("PATCH", "state", None),
            Action::LongPath => return ("GET", format!("/{}", "x".repeat(70_000)), None),
        };
        (method, format!("/api/v1/{path}"), body)
    }

    pub fn needs_token(self) -> bool {
        !matches!(self, Action::Stop | Action::Read(_) | Action::LongPath)
    }

    pub fn needs_lease(self) -> bool {
        use Action::{Clear, ReleaseLease, RenewLease, Resume, Start, Tune};
        matches!(
            self,
            RenewLease | ReleaseLease | Start | Tune | Clear | Resume
        )
    }
}

pub fn command() -> Value {
    let args = ["--slow", "--duration", "5s", "--pace", "realtime"];
    order("control", &args)
}
