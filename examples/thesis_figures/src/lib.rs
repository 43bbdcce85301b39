//! The figures and tables of the thesis, computed with the `bench` library.
//!
//! ```text
//!  registry (number, title, function) -> Content (charts, comparisons, commands) -> SVG, page
//!                                           |  model: a profile and settings, as a command takes them
//!                                           |  bode, plane: charts of several figures
//!                                              measured: runs of the simulated stage
//! ```
//!
//! Zeros, loci, sequences, margins, steps and runs are computed by the library, as by the commands that the page lists. To
//! add a figure: a function that returns a [`Content`], and a line in `registry.rs`.

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
pub use measured::Runs;
pub use page::page;
pub use registry::{Entry, FIGURES, Make, selected};
pub use write::{Figure, Outcome, make_all};
