//! The plot of distortion and noise of a periodic record.

use super::plots::Plot;
use crate::{DistortionLevels, ReportError, distortion_svg};
use bench_experiment::outputs::PlotKind;
use bench_identify::linearity::Linearity;

/// The plot of the levels of a quantity, such as `Displacement (m)`.
///
/// # Errors
/// When no line was excited.
pub(super) fn distortion_plot(
    linearity: &Linearity,
    quantity: &str,
    title: &str,
    subtitle: &str,
) -> Result<Plot, ReportError> {
    let levels = DistortionLevels::from(&linearity.harmonics);
    let svg = distortion_svg(&levels, quantity, title, subtitle)?;
    Ok(Plot::new(PlotKind::Linearity, caption(linearity), svg))
}

fn caption(linearity: &Linearity) -> String {
    let (periods, why) = (linearity.harmonics.periods, &linearity.why);
    format!(
        "RMS of the output at each line, mean of {periods} periods: excited lines, and odd and even lines that are not \
         excited, averaged over neighbours. Without distortion the latter lie on the noise of the mean. {why}."
    )
}
