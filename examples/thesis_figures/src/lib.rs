//! The figures and tables of the thesis, drawn anew from what the commands compute.
//!
//! ```text
//!  registry (number, title, function) -> Content (charts in values, printed beside computed, commands) -> SVG, page
//!                                           |  model: settings as a command takes them
//!                                           |  bode, plane: charts that several figures have
//!                                           v  measured: runs of the simulated stage, through the session
//! ```
//!
//! No figure has a computation of its own: zeros, loci, sequences, margins, steps and runs are those of the commands that
//! stand below it. To add one: a function that gives a [`Content`], and a line in `registry.rs`.

mod bode;
mod chapter1;
mod chapter2;
mod chapter3;
mod chapter4;
mod chapter5;
mod chapter6;
mod content;
mod error;
mod measured;
mod model;
mod page;
mod plane;
mod registry;
mod tables;
mod write;

pub use content::{Comparison, Content, Verdict};
pub use error::FigureError;
pub use measured::Workshop;
pub use page::page;
pub use registry::{Entry, FIGURES, Make, selected};
pub use write::{Made, make_all};
