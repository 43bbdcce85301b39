//! The HTTP interface: one line per request in [`routes`], one file per resource.

mod body;
mod download;
pub mod error;
mod extract;
mod file_check;
pub mod guard;
mod lease;
mod live;
mod page;
mod recordings;
mod reply;
mod routes;
mod runs;
mod texts;
mod tools;
pub mod views;

pub use routes::{Reach, router};
