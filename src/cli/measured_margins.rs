//! `bench margins --frf`: the margins with a measured plant.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::in_folder;
use super::error::CliError;
use super::output::warn;
use super::table::wrap;
use bench_base::units::{UM_PER_M, hz};
use bench_config::Config;
use bench_control::ClosedLoop;
use bench_control::measured::{
    LoopPeaks, MeasuredMargins, NyquistCount, OutsideBand, RangeBound, Stability,
};
use bench_experiment::outputs::{ExistingFile, ResultFiles};
use bench_experiment::{LoopCurves, MeasuredFrf, MeasuredLoopMargins, measured_margins};
use bench_identify::Estimate;
use bench_report::number::interval;
use bench_report::run_pages::{MeasuredLoopFiles, MeasuredLoopReport};
use bench_report::{crossing_count, place};

/// The margins with a measured plant, and the files of the loop.
#[derive(Debug, Serialize)]
pub(super) struct Measured {
    /// The file of the plant.
    frf: String,
    /// Number of measured frequencies.
    frequencies: usize,
    #[serde(flatten)]
    result: MeasuredLoopMargins,
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
    out: Option<&Path>,
    closed_loop: &ClosedLoop,
    config: &Config,
) -> Result<Measured, CliError> {
    let measured = MeasuredFrf::read(path)?;
    warn(&measured.cautions);
    warn(&measured.differences(config));
    let result = measured_margins(&measured, closed_loop, config)?;
    let files = out.map(|folder| write(folder, path, &measured, &result, closed_loop, config));
    Ok(Measured {
        frf: path.display().to_string(),
        frequencies: measured.frf.len(),
        result,
        files: files.transpose()?,
    })
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
    let report = MeasuredLoopReport {
        title: config.title.clone(),
        subtitle: format!(
            "{} controller with the plant of {name}",
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
        wrap(&stability_text(&result.count), 2),
        result.margins.as_ref().map_or(String::new(), margin_lines),
        result.peaks.as_ref().map_or(String::new(), peak_lines),
        outside_text(&result.outside_band),
        measured.files.as_ref().map_or(String::new(), files_text),
    ]
    .concat()
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

fn margin_lines(margins: &MeasuredMargins) -> String {
    let peak = format!(
        "{} dB at {:.3} Hz",
        number(margins.sensitivity_peak_db, 1.0),
        hz(margins.sensitivity_peak_rad_s)
    );
    [
        line("crossover", margins.crossover_rad_s.map(frequency)),
        line("phase margin", phase_margin_text(margins)),
        line(
            "gain margin",
            at(margins.gain_margin_db, margins.gain_margin_rad_s, 1.0, "dB"),
        ),
        gain_margin_lines(margins),
        line(
            "delay margin",
            at(
                margins.delay_margin_s,
                margins.delay_margin_rad_s,
                1e3,
                "ms",
            ),
        ),
        line("modulus margin", Some(number(margins.modulus_margin, 1.0))),
        line("peak of S", Some(peak)),
        line(
            "sensitivity bandwidth",
            margins.sensitivity_bandwidth_rad_s.map(frequency),
        ),
    ]
    .concat()
}

/// A margin and its frequency.
fn at(margin: Option<Estimate>, rad_s: Option<f64>, factor: f64, unit: &str) -> Option<String> {
    let (margin, rad_s) = margin.zip(rad_s)?;
    Some(format!(
        "{} {unit} {}",
        number(margin, factor),
        place(rad_s)
    ))
}

fn phase_margin_text(margins: &MeasuredMargins) -> Option<String> {
    let text = at(
        margins.phase_margin_deg,
        margins.phase_margin_rad_s,
        1.0,
        "deg",
    )?;
    Some(text + &crossing_count(margins.crossings.len()))
}

/// Both gain margins, if the loop gain may not fall without limit.
fn gain_margin_lines(margins: &MeasuredMargins) -> String {
    if margins.lower_gain_margin_db.is_none() {
        return String::new();
    }
    let (upper_db, upper_rad_s) = (
        margins.upper_gain_margin_db,
        margins.upper_gain_margin_rad_s,
    );
    let (lower_db, lower_rad_s) = (
        margins.lower_gain_margin_db,
        margins.lower_gain_margin_rad_s,
    );
    line("upper gain margin", at(upper_db, upper_rad_s, 1.0, "dB"))
        + &line("lower gain margin", at(lower_db, lower_rad_s, 1.0, "dB"))
}

fn peak_lines(peaks: &LoopPeaks) -> String {
    let control = Some(peaks.control_peak_a_per_m).map(unit(1.0 / UM_PER_M, "A/um"));
    let disturbance = Some(peaks.disturbance_peak_m_per_a).map(unit(UM_PER_M, "um/A"));
    [
        line("peak of T", Some(number(peaks.complementary_peak, 1.0))),
        line("peak of C S", control),
        line("peak of P S", disturbance),
    ]
    .concat()
}

fn line(name: &str, value: Option<String>) -> String {
    let value = value.unwrap_or("none in the band".into());
    format!("  {name:<23}{value}\n")
}

fn number(estimate: Estimate, factor: f64) -> String {
    let scaled = estimate.scaled(factor);
    interval(scaled.value, scaled.half_width_95())
}

fn unit(factor: f64, unit: &'static str) -> impl Fn(Estimate) -> String {
    move |estimate| format!("{} {unit}", number(estimate, factor))
}

fn frequency(rad_s: Estimate) -> String {
    format!("{} rad/s ({:.3} Hz)", number(rad_s, 1.0), hz(rad_s.value))
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
