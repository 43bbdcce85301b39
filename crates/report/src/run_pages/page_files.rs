//! The plots and the page of a record as files.

use std::collections::BTreeMap;

use serde::Serialize;

use super::RecordReport;
use super::control_page::ControlReport;
use super::page::page;
use super::plots::{Plot, PlotKind, plots};
use super::result_files::{OutputError, ResultFiles};

/// Plots by kind; `None` where the data give none.
pub type Plots = BTreeMap<&'static str, Option<String>>;

/// The plots and the page of a record.
#[derive(Clone, Debug, Serialize)]
pub struct PageFiles {
    /// The Bode plot.
    pub plot: Option<String>,
    /// All plots.
    pub plots: Plots,
    /// The page.
    pub report: Option<String>,
}

impl Default for PageFiles {
    fn default() -> Self {
        PageFiles {
            plot: None,
            plots: no_plots(&PlotKind::ALL),
            report: None,
        }
    }
}

impl PageFiles {
    /// Draws a record and writes its plots and its page.
    ///
    /// # Errors
    /// When a plot cannot be drawn, or a file cannot be written.
    pub fn write(
        report: &RecordReport<'_>,
        results: ResultFiles<'_>,
    ) -> Result<PageFiles, OutputError> {
        let drawn = plots(report)?;
        let plots = write_plots(&PlotKind::ALL, &drawn, results)?;
        Ok(PageFiles {
            plot: plots.get(PlotKind::Bode.name()).cloned().flatten(),
            plots,
            report: Some(results.write("report", "html", &page(report, &drawn))?),
        })
    }

    /// Adds the plots and the page of a closed-loop run that has no analysis, because it did not come to its end.
    pub fn extend(&mut self, files: Option<ControlFiles>) {
        let Some(files) = files else {
            return;
        };
        let drawn = files.plots.into_iter().filter(|(_, path)| path.is_some());
        self.plots.extend(drawn);
        self.report = files.report;
    }
}

/// The plots and the page of a closed-loop run; the names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct ControlFiles {
    /// All plots.
    pub plots: Plots,
    /// The page.
    pub report: Option<String>,
}

impl ControlFiles {
    /// Draws a run and writes its plots and its page.
    ///
    /// # Errors
    /// When a plot cannot be drawn, or a file cannot be written.
    pub fn write(
        report: &ControlReport<'_>,
        results: ResultFiles<'_>,
    ) -> Result<ControlFiles, OutputError> {
        let drawn = report.plots()?;
        let plots = write_plots(&PlotKind::CONTROL, &drawn, results)?;
        let page = report.page(&drawn);
        let report = Some(results.write("report", "html", &page)?);
        Ok(ControlFiles { plots, report })
    }
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

fn no_plots(kinds: &[PlotKind]) -> Plots {
    kinds.iter().map(|kind| (kind.name(), None)).collect()
}
