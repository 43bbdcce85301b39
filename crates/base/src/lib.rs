//! Small helpers that several crates use: quantities with units, numbers, kinds of settings, atomic files, locks, checkpoints, progress.

#![deny(unsafe_code)]

pub mod atomic_file;
pub mod checkpoint;
pub mod decimal;
pub mod estimate;
pub mod finding;
pub mod input_file;
pub mod kinds;
pub mod lock_file;
pub mod locked;
pub mod nearest;
pub mod numeric;
pub mod progress;
pub mod quantity;
pub mod remedy;
pub mod running_stats;
pub mod thread_priority;
pub mod timestamp;
pub mod units;
