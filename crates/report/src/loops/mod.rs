//! Plots of a loop: Bode and Nyquist plot of L, S and T.
//!
//! ```text
//! model     a loop by its model, with its margins and limits
//! measured  a loop with a measured plant, with confidence circles and bands
//! design    a designed loop with each of its plants
//!    \--- plane: what every Nyquist plot of L has; level: a horizontal line over frequency
//! ```

mod design;
mod measured;
mod model;
mod plane;

pub use design::{DesignLimits, design_loop_svg, design_nyquist_svg};
pub use measured::{
    MeasuredLoopPlot, MeasuredMark, MeasuredSensitivityPlot, measured_bode_svg,
    measured_nyquist_svg, measured_sensitivity_svg,
};
pub use model::{LoopPlot, loop_bode_svg, loop_nyquist_svg, loop_svg, sensitivity_svg};
