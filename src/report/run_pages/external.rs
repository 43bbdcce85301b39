//! A record of other hands: no model, and no loop of ours.

use super::page::delay_ms;
use super::{Plot, ReportSource, Shown};
use crate::experiment::ExternalAnalysis;
use crate::identify::Unit;
use crate::identify::modal::MeasurementChain;
use crate::report::ReportError;
use crate::report::page::facts;

/// A table of samples that was analysed.
#[derive(Clone, Copy, Debug)]
pub struct TableReport<'a> {
    /// What it shows.
    pub analysis: &'a ExternalAnalysis,
    /// Name of the file.
    pub file: &'a str,
    /// Column of the input.
    pub input: &'a str,
    /// Column of the output.
    pub output: &'a str,
    /// Samples a second.
    pub rate_hz: f64,
    /// How many there are.
    pub samples: usize,
}

impl ReportSource for TableReport<'_> {
    fn shown(&self) -> Shown<'_> {
        Shown {
            title: self.file.to_string(),
            subtitle: format!(
                "{} to {}; units are those of the columns",
                self.input, self.output
            ),
            unit: Unit::Bare,
            residue_unit: format!("{} per {} and s^2", self.output, self.input),
            frf: &self.analysis.frf,
            model: None,
            chain: MeasurementChain::Direct,
            fit: self.analysis.fit.as_ref().ok(),
            verdict: &self.analysis.verdict,
            judged_up_to_rad_s: self.analysis.judged_up_to_rad_s,
        }
    }

    fn record(&self) -> String {
        format!("{} samples at {} Hz", self.samples, self.rate_hz)
    }

    fn evidence(&self) -> Vec<(String, String)> {
        let fit = self.analysis.fit.as_ref().ok();
        fit.map(|fit| ("Delay by the fit".into(), delay_ms(fit.delay_s())))
            .into_iter()
            .collect()
    }

    fn more_pictures(&self) -> Result<Vec<Plot>, ReportError> {
        Ok(Vec::new())
    }

    fn sections(&self) -> (String, String) {
        let periods = self
            .analysis
            .periods
            .map(|count| ("Periods averaged".to_string(), count.to_string()));
        let pairs = [
            ("Input".to_string(), self.input.to_string()),
            ("Output".to_string(), self.output.to_string()),
            ("Samples".to_string(), self.samples.to_string()),
            ("Rate".to_string(), format!("{} Hz", self.rate_hz)),
        ];
        let pairs: Vec<_> = pairs.into_iter().chain(periods).collect();
        (
            String::new(),
            format!(
                "<section>\n<h2>The record</h2>\n{}</section>\n",
                facts(&pairs)
            ),
        )
    }
}
