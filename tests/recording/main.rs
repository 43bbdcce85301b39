//! What a recording promises, as tests.
mod common;
mod damage;
mod disk_full;
mod round_trip;
mod thread;
