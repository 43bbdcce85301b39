//! Recordings: writing, reading, damaged files, full disks.
mod common;
mod damage;
mod disk_full;
mod python;
mod round_trip;
mod syncing;
mod thread;
