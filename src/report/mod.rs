//! What a person looks at: plots as self-contained SVG.
//!
//! ```text
//! sheet -> chart (axes, marks, in values) -> clip -> panel -> canvas
//! bode -> trace (checked, unwrapped by phase) -> panel (axis: scales and ticks, curve: thinned out) -> canvas (SVG)
//! quadrants (actuator and probe in the plane of two shapes) -> canvas
//! ```
//!
//! Text stays text in the SVG, in the viewer's own sans-serif: no font is needed to make a plot.

mod axis;
pub mod bode;
mod canvas;
mod chart;
mod clip;
pub mod colours;
mod curve;
mod error;
mod header;
mod panel;
pub mod phase;
mod quadrants;
mod sheet;
mod trace;

pub use bode::bode_svg;
pub use chart::{Chart, Mark, Pen, Scale, ScaleKind, Stroke, Symbol};
pub use error::ReportError;
pub use quadrants::{QuadrantPanel, quadrants_svg};
pub use sheet::{Row, sheet_svg};
pub use trace::{Curve, Trace};
