//! The daemon: one process owns the bench and serves clients.

#![deny(unsafe_code)]

mod api;
mod catalogue;
pub mod client;
mod computations;
mod connections;
mod descriptors;
mod dispatch;
mod files;
#[cfg(feature = "foxglove")]
mod foxglove;
mod heap;
mod hold;
pub mod http_client;
mod lease;
pub mod live;
mod metrics;
mod order_files;
mod output;
mod owner;
mod ownership;
mod page;
mod peer;
mod places;
mod private_files;
mod reserve;
mod run_entry;
mod run_record;
mod same_rig;
mod schedule;
mod secret;
mod serve;
mod session;
mod session_messages;
mod shared;
mod socket;
mod start;
mod warnings;
mod worker;

pub use hold::Hold;
pub use output::OutputPiece;
pub use run_entry::{OnDisconnect, RunRequest};
pub use serve::serve;
pub use shared::DaemonConfig;
pub use socket::own_socket;
pub use start::{ServeError, ServeOptions, Started};
pub use warnings::WarningCopies;
