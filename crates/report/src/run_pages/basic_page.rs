//! The page of a run without a frequency response: static steps, a rest position, a stage check, or a run that was not completed.

use super::comparison::signals_section;
use super::page::{named, table_section, with_interval};
use super::run_facts;
use crate::ReportError;
use crate::conditions::lines;
use crate::html::{escaped, facts, row, section};
use crate::number::plain;
use bench_config::Config;
use bench_experiment::calibration::StaircaseResult;
use bench_experiment::campaign::RestPosition;
use bench_experiment::stage_check::{PhaseComparison, StageCheck};
use bench_experiment::{BasicResults, Overview};
use bench_identify::Estimate;
use bench_recording::Recording;

/// A recorded run with its results.
#[derive(Clone, Copy, Debug)]
pub struct BasicReport<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// The configuration of the run.
    pub config: &'a Config,
    /// What the run has found.
    pub results: &'a BasicResults,
    /// Its signals.
    pub overview: &'a Overview,
}

impl BasicReport<'_> {
    /// The page as an HTML document.
    ///
    /// # Errors
    /// When there is nothing to draw.
    pub fn page(&self) -> Result<String, ReportError> {
        let title = &self.config.title;
        let signals = if self.overview.current_a.is_empty() {
            String::new()
        } else {
            signals_section(self.overview)?
        };
        let rate = format!("{} Hz", self.config.servo.rate_hz);
        let conditions = run_facts::conditions(self.recording, self.config);
        let subtitle = lines(&[&rate, &conditions]);
        let body = [
            run_facts::heading(self.recording, title, &subtitle),
            run_facts::ending(self.recording),
            results(self.results),
            run_facts::command_and_settings(self.recording, self.config),
            signals,
            run_facts::events(self.recording),
            run_facts::scheduling(self.recording, &[]),
            run_facts::configuration(self.recording, title),
        ];
        Ok(run_facts::document(self.recording, title, &body.concat()))
    }
}

fn results(results: &BasicResults) -> String {
    match results {
        BasicResults::Staircase(found) => static_steps(found),
        BasicResults::Rest(rest) => rest_position(rest),
        BasicResults::StageCheck(check) => stage_check(check),
        BasicResults::Nothing(why) => {
            let why = escaped(why);
            format!("<p class=\"verdict\"><strong>no result</strong><br>{why}</p>\n")
        }
    }
}

fn static_steps(found: &StaircaseResult) -> String {
    let fit = &found.fit;
    let compliance = Estimate {
        value: fit.compliance_m_per_a,
        sigma: fit.compliance_sigma_m_per_a,
    };
    let percent = |ratio: f64| format!("{} %", plain(100.0 * ratio, 4));
    let none = String::new;
    let mut rows = vec![
        [
            "Static compliance (µm/A)".into(),
            with_interval(compliance, 1e6),
            plain(1e6 * found.model_m_per_a, 3),
        ],
        [
            "Deviation from a straight line".into(),
            percent(fit.nonlinearity_ratio),
            none(),
        ],
        [
            "Difference between rising and falling current".into(),
            percent(fit.hysteresis_ratio),
            none(),
        ],
        [
            "Reading without current (µm)".into(),
            plain(1e6 * fit.rest_m, 3),
            none(),
        ],
        [
            "Noise of the readings (µm RMS)".into(),
            plain(1e6 * fit.noise_rms_m, 4),
            none(),
        ],
    ];
    if let Some((gain, offset_a)) = fit.current {
        rows.push(["Measured current per ampere".into(), plain(gain, 5), none()]);
        rows.push([
            "Measured current at zero (mA)".into(),
            plain(1e3 * offset_a, 3),
            none(),
        ]);
    }
    let rows: String = rows.iter().map(|cells| row(cells)).collect();
    let header = ["", "Measured", "By the model"];
    table_section(
        "Static steps",
        "± is the 95 % confidence interval.",
        &header,
        &rows,
    )
}

fn rest_position(rest: &RestPosition) -> String {
    let position = Estimate {
        value: rest.mean_m,
        sigma: rest.sigma_m,
    };
    let text = format!(
        "{} µm (95 % confidence interval)",
        with_interval(position, 1e6)
    );
    section(
        "Rest position",
        &facts(&named([("Mean reading without current", Some(text))])),
    )
}

fn stage_check(check: &StageCheck) -> String {
    let (class, verdict) = if check.agrees {
        ("excluded", "the stage agrees with the certificate")
    } else {
        ("detected", "the stage does not agree with the certificate")
    };
    let why = check.refusal().map(|refusal| refusal.to_string());
    let why = escaped(&why.unwrap_or_default());
    let verdict = format!("<p class=\"verdict {class}\"><strong>{verdict}</strong><br>{why}</p>\n");
    let compliance = &check.compliance;
    let compliance = row(&[
        "Static compliance (µm/A)".into(),
        plain(1e6 * compliance.measured_m_per_a, 3),
        plain(1e6 * compliance.certified_m_per_a, 3),
        format!("{} %", plain(100.0 * compliance.limit_ratio, 2)),
    ]);
    let phases: String = check.phases.iter().map(phase_row).collect();
    let header = ["", "Measured", "By the certificate", "Largest difference"];
    let note = "A larger difference from the certificate refuses the closed loop.";
    verdict + &table_section("Stage check", note, &header, &(compliance + &phases))
}

fn phase_row(phase: &PhaseComparison) -> String {
    row(&[
        format!("Phase at {} Hz (deg)", plain(phase.frequency_hz, 2)),
        plain(phase.measured_deg, 2),
        plain(phase.certified_deg, 2),
        plain(phase.limit_deg, 2),
    ])
}
