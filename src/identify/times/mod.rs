//! Readings and set-points of irregular times on the regular ones of a loop.

pub mod align;
pub mod edges;
mod kernel;
