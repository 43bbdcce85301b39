//! The paths of the plots and of the page of a record.

use std::collections::BTreeMap;

use serde::Serialize;

use super::plot_kind::PlotKind;

/// Plots by kind; `None` where the data give none.
pub type Plots = BTreeMap<&'static str, Option<String>>;

/// The plots and the page of a record; the names in JSON must not change.
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

/// Plots of these kinds, none of which is drawn.
pub fn no_plots(kinds: &[PlotKind]) -> Plots {
    kinds.iter().map(|kind| (kind.name(), None)).collect()
}
