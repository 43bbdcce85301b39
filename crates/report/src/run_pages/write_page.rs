//! Draws a record, and writes its plots and its page.

use super::RecordReport;
use super::control_page::ControlReport;
use super::page::page;
use super::page_error::PageError;
use super::plots::{Plot, plots};
use bench_experiment::outputs::{
    ControlFiles, OutputError, PageFiles, PlotKind, Plots, ResultFiles, no_plots,
};

/// Draws a record and writes its plots and its page.
///
/// # Errors
/// When a plot cannot be drawn, or a file cannot be written.
pub fn write_page(
    report: &RecordReport<'_>,
    results: ResultFiles<'_>,
) -> Result<PageFiles, PageError> {
    let drawn = plots(report)?;
    let plots = write_plots(&PlotKind::ALL, &drawn, results)?;
    Ok(PageFiles {
        plot: plots.get(PlotKind::Bode.name()).cloned().flatten(),
        plots,
        report: Some(results.write("report", "html", &page(report, &drawn))?),
    })
}

/// Draws a closed-loop run and writes its plots and its page.
///
/// # Errors
/// When a plot cannot be drawn, or a file cannot be written.
pub fn write_control_page(
    report: &ControlReport<'_>,
    results: ResultFiles<'_>,
) -> Result<ControlFiles, PageError> {
    let drawn = report.plots()?;
    let plots = write_plots(&PlotKind::CONTROL, &drawn, results)?;
    let page = report.page(&drawn);
    let report = Some(results.write("report", "html", &page)?);
    Ok(ControlFiles { plots, report })
}

/// Writes plots; kinds without a plot have no path.
fn write_plots(
    kinds: &[PlotKind],
    drawn: &[Plot],
    results: ResultFiles<'_>,
) -> Result<Plots, OutputError> {
    let mut plots = no_plots(kinds);
    for plot in drawn {
        let path = results.write(plot.kind.name(), "svg", &plot.svg)?;
        plots.insert(plot.kind.name(), Some(path));
    }
    Ok(plots)
}
