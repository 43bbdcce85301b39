//! The plots of a result, by their names in files and JSON.

use serde::Serialize;

/// The kinds of plots of an analysed record and of a closed-loop run. Pole-zero map and stability chart need modes, loop and
/// sensitivity a closed loop, and the distortion needs a multisine with lines that are not excited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PlotKind {
    /// Bode plot.
    Bode,
    /// Coherence.
    Coherence,
    /// Nyquist plot.
    Nyquist,
    /// Map of poles and zeros.
    PoleZero,
    /// Stability chart.
    Stability,
    /// Bode plot of L.
    Loop,
    /// Bode plot of S and T.
    Sensitivity,
    /// Output, noise and distortion of a multisine.
    Linearity,
    /// Reference, position, error and current of a closed-loop run.
    Signals,
    /// Step response of a closed-loop run.
    Step,
    /// Spectrum of the error of a closed-loop run.
    Spectrum,
    /// Nyquist plot of L.
    LoopNyquist,
}

impl PlotKind {
    /// The kinds of a closed-loop run.
    pub const CONTROL: [PlotKind; 6] = [
        PlotKind::Signals,
        PlotKind::Step,
        PlotKind::Spectrum,
        PlotKind::Loop,
        PlotKind::LoopNyquist,
        PlotKind::Sensitivity,
    ];

    /// The kinds of an analysed record.
    pub const ALL: [PlotKind; 9] = [
        PlotKind::Bode,
        PlotKind::Coherence,
        PlotKind::Nyquist,
        PlotKind::PoleZero,
        PlotKind::Stability,
        PlotKind::Loop,
        PlotKind::LoopNyquist,
        PlotKind::Sensitivity,
        PlotKind::Linearity,
    ];

    /// The name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            PlotKind::Bode => "bode",
            PlotKind::Coherence => "coherence",
            PlotKind::Nyquist => "nyquist",
            PlotKind::PoleZero => "pole_zero",
            PlotKind::Stability => "stability",
            PlotKind::Loop => "loop",
            PlotKind::Sensitivity => "sensitivity",
            PlotKind::Linearity => "linearity",
            PlotKind::Signals => "signals",
            PlotKind::Step => "step",
            PlotKind::Spectrum => "spectrum",
            PlotKind::LoopNyquist => "loop_nyquist",
        }
    }
}
