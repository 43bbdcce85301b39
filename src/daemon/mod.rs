//! The daemon: one process owns the bench and serves clients.

pub mod live;
