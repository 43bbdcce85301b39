//! `bench margins --frf`: the margins with a measured plant.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::in_folder;
use super::error::CliError;
use super::output::warn;
use super::table::{figure_lines, wrap};
use bench_base::units::hz;
use bench_config::Config;
use bench_control::ClosedLoop;
use bench_control::measured::{NyquistCount, OutsideBand, RangeBound, Stability};
use bench_experiment::outputs::{ExistingFile, ResultFiles};
use bench_experiment::{LoopCurves, MeasuredFrf, MeasuredLoopMargins};
use bench_external::frf::PhaseUnit;
use bench_identify::scatter::SigmaSource;
use bench_report::figures::{Figure, loop_peaks, measured_margins};
use bench_report::run_pages::{MeasuredLoopFiles, MeasuredLoopReport};

/// The margins with a measured plant, and the files of the loop.
#[derive(Debug, Serialize)]
pub(super) struct Measured {
    /// The file of the plant.
    frf: String,
    /// Number of measured frequencies.
    frequencies: usize,
    /// Where the standard deviations of the plant come from.
    sigma: SigmaSource,
    #[serde(flatten)]
    result: MeasuredLoopMargins,
    /// Margins and peaks as shown.
    figures: Vec<Figure>,
    /// The files with --out.
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<MeasuredLoopFiles>,
}

impl Measured {
    /// Whether the loop with the measured plant is stable.
    pub fn is_stable(&self) -> bool {
        self.result.is_stable()
    }
}

/// The margins of a control law around the plant of a file; files of the loop in a folder.
pub(super) fn measured(
    path: &Path,
    phase: Option<PhaseUnit>,
    out: Option<&Path>,
    closed_loop: &ClosedLoop,
    config: &Config,
) -> Result<Measured, CliError> {
    let measured = MeasuredFrf::read(path, phase)?;
    warn(&measured.cautions);
    warn(&measured.differences(config));
    let result = bench_experiment::measured_margins(&measured, closed_loop, config)?;
    let files = out.map(|folder| write(folder, path, &measured, &result, closed_loop, config));
    Ok(Measured {
        frf: path.display().to_string(),
        frequencies: measured.frf.len(),
        sigma: measured.sigma,
        figures: figures(&result),
        result,
        files: files.transpose()?,
    })
}

fn figures(result: &MeasuredLoopMargins) -> Vec<Figure> {
    let margins = result.margins.as_ref().map(measured_margins);
    let peaks = result.peaks.as_ref().map(loop_peaks);
    margins.into_iter().chain(peaks).flatten().collect()
}

fn write(
    folder: &Path,
    path: &Path,
    measured: &MeasuredFrf,
    result: &MeasuredLoopMargins,
    closed_loop: &ClosedLoop,
    config: &Config,
) -> Result<MeasuredLoopFiles, CliError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let estimated = match measured.sigma {
        SigmaSource::Estimated => ", standard deviations estimated from its scatter",
        _ => "",
    };
    let report = MeasuredLoopReport {
        title: config.title.clone(),
        subtitle: format!(
            "{} controller with the plant of {name}{estimated}",
            config.control.controller
        ),
        curves: &LoopCurves::of(&measured.frf, closed_loop, config),
        margins: result.margins.as_ref(),
        min_modulus_margin: config.control.min_modulus_margin,
        model: closed_loop,
    };
    let beside = in_folder(Some(folder), path)?;
    let results = ResultFiles {
        beside: &beside,
        existing: ExistingFile::Keep,
    };
    Ok(MeasuredLoopFiles::write(&report, results)?)
}

/// Margins, peaks, bounds outside of the band, and files.
pub(super) fn text(measured: &Measured) -> String {
    let result = &measured.result;
    let [first_hz, last_hz] = result.band_hz;
    let title = format!(
        "with the measured plant, {} ({} frequencies from {first_hz:.4} to {last_hz:.4} Hz), ± 95 % confidence interval",
        measured.frf, measured.frequencies
    );
    [
        wrap(&title, 0),
        sigma_text(measured.sigma).map_or(String::new(), |text| wrap(text, 2)),
        wrap(&stability_text(&result.count), 2),
        figure_lines(&measured.figures),
        outside_text(&result.outside_band),
        measured.files.as_ref().map_or(String::new(), files_text),
    ]
    .concat()
}

/// What a reader of the intervals must know about the standard deviations.
pub(super) fn sigma_text(sigma: SigmaSource) -> Option<&'static str> {
    match sigma {
        SigmaSource::Estimated => Some(
            "the file has no standard deviations: they are estimated from the scatter of the response over neighbouring frequencies",
        ),
        _ => None,
    }
}

fn stability_text(count: &NyquistCount) -> String {
    let (poles, sigmas) = (count.unstable_poles, count.distance_sigmas);
    match count.stability {
        Stability::Stable => "stable by Nyquist's criterion".into(),
        Stability::Unstable => format!(
            "UNSTABLE: by Nyquist's criterion the closed loop has {poles} unstable poles, and so no margins"
        ),
        Stability::Undecided => format!(
            "UNDECIDED: the measured curve passes -1 at a distance of {sigmas:.1} standard deviations, too close to decide about stability; measure longer, or choose a controller with more margin"
        ),
    }
}

fn outside_text(outside: &OutsideBand) -> String {
    let (below, above) = (&outside.below, &outside.above);
    let below = format!(
        "not measured, below {:.4} Hz: by the model {}",
        hz(below.to_rad_s),
        bound_text(below)
    );
    let above = format!(
        "not measured, above {:.4} Hz: by the model {}",
        hz(above.from_rad_s),
        bound_text(above)
    );
    wrap(&below, 2) + &wrap(&above, 2)
}

fn bound_text(bound: &RangeBound) -> String {
    let (least, most) = (bound.min_loop_gain, bound.max_loop_gain);
    let loop_gain = if least > 1.0 {
        format!("|L| is at least {least:.3e}")
    } else {
        format!("|L| is at most {most:.3e}")
    };
    format!("{loop_gain}, |S| at most {:.4}", bound.max_sensitivity)
}

fn files_text(files: &MeasuredLoopFiles) -> String {
    let paths = files.paths();
    let lines = paths.map(|(label, path)| format!("  {label:<11}{path}\n"));
    lines.concat()
}
