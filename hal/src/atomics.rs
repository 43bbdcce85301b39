//! The atomics that the tick shares with the thread of a driver. With `--cfg loom` they are those of `loom`, which executes all
//! interleavings of a test that the memory model permits:
//!
//! `RUSTFLAGS="--cfg loom" cargo test -p bench-hal --lib interleavings --release --target-dir target/loom`

#[cfg(loom)]
pub(crate) use loom::sync::atomic::{
    AtomicBool, AtomicI32, AtomicU8, AtomicU32, AtomicU64, Ordering,
};
#[cfg(not(loom))]
pub(crate) use std::sync::atomic::{
    AtomicBool, AtomicI32, AtomicU8, AtomicU32, AtomicU64, Ordering,
};
