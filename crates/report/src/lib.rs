//! Plots as self-contained SVG, pages as self-contained HTML.
//!
//! ```text
//! trace (checked responses, phases) -> bode, identification, nyquist ------.
//!                      |-> coherence --------------------------------------+
//!                      |-> overlay (several recordings) -------------------+
//!                      `-> loops (L, S and T: model, measured, designed) --+
//! run_signals, error_spectrum (closed loop) -------------------------------+
//! model_pictures (map, locus, veering, step, study), amplitudes -----------+
//! pole_zero (ellipse), stability, distortion, quadrants -------------------+-> chart (the engine) -> SVG
//! run_pages (plots and page of one record) -> html, number
//! ```

#![deny(unsafe_code)]

mod amplitudes;
pub mod bode;
mod campaign;
mod chart;
mod coherence;
mod conditions;
mod design_page;
mod distortion;
pub mod ellipse;
mod error;
mod error_spectrum;
pub mod figures;
pub mod html;
mod identification;
mod labels;
mod loops;
mod magnitude;
mod model_pictures;
pub mod number;
mod nyquist;
mod overlay;
pub mod phase;
mod picture_page;
mod pole_zero;
mod quadrants;
pub mod run_pages;
mod run_signals;
mod stability;
pub mod table;
mod trace;

pub use amplitudes::{AmplitudeOverview, amplitudes_svg};
pub use bode::bode_svg;
pub use campaign::{PictureError, campaign_picture};
pub use chart::{
    Anchor, Chart, Mark, Pen, Row, Scale, ScaleKind, SeriesPoint, Stroke, Symbol, colours,
    sheet_svg,
};
pub use coherence::coherence_svg;
pub use conditions::{joined, plant_conditions};
pub use design_page::DesignPage;
pub use distortion::{DistortionLevels, distortion_svg};
pub use error::ReportError;
pub use error_spectrum::error_spectrum_svg;
pub use identification::{Identification, identification_svg};
pub use loops::{
    DesignLimits, LoopPlot, MeasuredLoopPlot, MeasuredMark, MeasuredSensitivityPlot,
    design_loop_svg, design_nyquist_svg, loop_bode_svg, loop_nyquist_svg, loop_svg,
    measured_bode_svg, measured_nyquist_svg, measured_sensitivity_svg, sensitivity_svg,
};
pub use magnitude::MagnitudeAxis;
pub use model_pictures::{
    CnmpMap, locus_svg, map_svg, model_step_svg, study_svg, veering_caption, veering_svg,
};
pub use nyquist::nyquist_svg;
pub use overlay::{StepCurve, StepPlot, overlay_bode_svg, overlay_steps_svg, step_svg};
pub use picture_page::Picture;
pub use pole_zero::{PoleZeroMap, UncertainPoint, pole_zero_svg};
pub use quadrants::{QuadrantPanel, quadrants_svg};
pub use run_signals::{Envelope, SettlingBand, SignalsPlot, signals_svg};
pub use stability::{OrderedMode, StabilityChart, stability_svg};
pub use trace::{Curve, Trace, has_ambiguous_phase};
