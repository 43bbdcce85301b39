//! What a person looks at: plots as self-contained SVG, pages as self-contained HTML.
//!
//! ```text
//! sheet -> chart (axes, marks, in values) -> clip -> panel -> canvas
//! bode -> trace (checked, unwrapped by phase) -> panel (axis: scales and ticks, curve: thinned out) -> canvas (SVG)
//! pole_zero (ellipse: intervals), stability, levels, responses (Nyquist, coherence) -> sheet
//! page (HTML) <- pictures, tables, number (digits by the error)
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
pub mod ellipse;
mod error;
mod header;
mod levels;
pub mod number;
pub mod page;
mod panel;
pub mod phase;
mod pole_zero;
mod quadrants;
mod responses;
pub mod run_pages;
mod sheet;
mod stability;
mod trace;

pub use bode::bode_svg;
pub use chart::{Chart, Mark, Pen, Scale, ScaleKind, Stroke, Symbol};
pub use error::ReportError;
pub use levels::{LevelLines, levels_svg};
pub use pole_zero::{Place, PoleZeroMap, pole_zero_svg};
pub use quadrants::{QuadrantPanel, quadrants_svg};
pub use responses::{coherence_svg, nyquist_svg};
pub use sheet::{Row, sheet_svg};
pub use stability::{OrderedMode, Stays, stability_svg, stays};
pub use trace::{Curve, Trace};
