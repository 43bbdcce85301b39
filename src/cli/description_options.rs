//! `--name`, `--note` and `--operator`: what the operator says about a run.

use super::arguments::arguments;
use bench_daemon::client::is_started_by_daemon;
use bench_daemon::{OnDisconnect, RunRequest};
use bench_experiment::{Description, Invocation, operator_name, run_name, run_note};
use bench_order::Order;

/// Name, note and operator of a run.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct DescriptionOptions {
    /// Name of the run, kept in its recording and shown on its page (at most 200 characters)
    #[arg(long, value_name = "TEXT", value_parser = run_name, allow_hyphen_values = true)]
    name: Option<String>,
    /// Note on the run, kept in its recording (at most 2000 characters)
    #[arg(long, value_name = "TEXT", value_parser = run_note, allow_hyphen_values = true)]
    note: Option<String>,
    /// Who makes the run (at most 100 characters) [default: the user; at a daemon the holder of the arm lease]
    #[arg(long, value_name = "NAME", value_parser = operator_name, allow_hyphen_values = true)]
    operator: Option<String>,
}

impl DescriptionOptions {
    /// What the recording contains; `profile` is the profile or the file of the configuration. In a process that the daemon started,
    /// the daemon adds the operator of the lease.
    pub fn description(&self, profile: &str) -> Description {
        Description {
            name: self.name.clone(),
            note: self.note.clone(),
            operator: if is_started_by_daemon() {
                self.operator.clone()
            } else {
                self.operator.clone().or_else(user)
            },
            invocation: Some(Invocation::new(arguments(), profile)),
        }
    }

    /// What is asked of a daemon: the order with its name and note. If this process disappears, the daemon
    /// does what is its default for the command.
    pub fn request(&self, order: &Order) -> RunRequest {
        RunRequest {
            order: order.clone(),
            name: self.name.clone().unwrap_or_default(),
            note: self.note.clone().unwrap_or_default(),
            on_disconnect: OnDisconnect::Default,
        }
    }

    /// The operator, by default the user of this process.
    pub fn operator(&self) -> String {
        let operator = self.operator.clone().or_else(user);
        operator.unwrap_or_else(|| "unknown".into())
    }
}

/// The user of this process, if it is known.
pub(super) fn user() -> Option<String> {
    let user = std::env::var("USER").ok();
    user.and_then(|user| operator_name(&user).ok())
}
