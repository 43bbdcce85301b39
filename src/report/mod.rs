//! Plots as self-contained SVG, pages as self-contained HTML.
//!
//! ```text
//! trace (checked responses, unwrapped phase) -> bode, nyquist, coherence --.
//!                      `-> overlay (several recordings) -------------------+
//! pole_zero (ellipse), stability, distortion, quadrants, design -----------+-> chart (the engine) -> SVG
//! run_pages (plots and page of one record) -> html, number
//! ```

pub mod bode;
mod campaign;
mod chart;
mod coherence;
mod design;
mod distortion;
pub mod ellipse;
mod error;
pub mod html;
pub mod number;
mod nyquist;
mod overlay;
pub mod phase;
mod pole_zero;
mod quadrants;
pub mod run_pages;
mod stability;
mod trace;

pub use bode::bode_svg;
pub use campaign::{PictureError, campaign_picture};
pub use chart::{
    Chart, Mark, Pen, Row, Scale, ScaleKind, SeriesPoint, Stroke, Symbol, colours, sheet_svg,
};
pub use coherence::coherence_svg;
pub use design::{DesignLimits, design_loop_svg, design_nyquist_svg};
pub use distortion::{DistortionLevels, distortion_svg};
pub use error::ReportError;
pub use nyquist::nyquist_svg;
pub use overlay::{
    Envelope, StepCurve, StepPlot, overlay_bode_svg, overlay_steps_svg, signals_svg, step_svg,
};
pub use pole_zero::{PoleZeroMap, UncertainPoint, pole_zero_svg};
pub use quadrants::{QuadrantPanel, quadrants_svg};
pub use stability::{OrderedMode, stability_svg};
pub use trace::{Curve, Trace};
