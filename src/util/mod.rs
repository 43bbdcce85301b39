//! Small helpers without a subject of their own.

pub mod atomic_file;
pub mod quantity;
pub(crate) mod thread_priority;
