//! `bench controller`: controllers of other programs.

use std::fs::{File, remove_file};
use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::output::print_result;
use super::table::labelled;
use bench_base::atomic_file::write_atomic;
use bench_base::quantity::{OfFrequency, si};
use bench_control::{
    Agreement, Cascade, Domain, GainUnit, ImportOptions, Imported, Roots, Section, TransferTable,
    import,
};

/// What to do with a controller.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    what: ControllerCommand,
}

#[derive(Clone, Debug, Subcommand)]
enum ControllerCommand {
    /// Convert a controller that MATLAB or Python has saved to a controller file
    ///
    /// FILE is a MAT-file of level 5 (MATLAB `save`, without `-v7.3`; `scipy.io.savemat`), a numpy archive (`numpy.savez`) or a
    /// JSON object. It contains the arrays `num`, `den` (falling powers), or `z`, `p`, `k`, or `A`, `B`, `C`, `D`, or `sos` or `b`, `a`
    /// of scipy.signal, and the sampling period `Ts` in seconds (0: continuous), at the top level or in a structure, which may be that of
    /// `get(C)` in MATLAB. A `tf`, `zpk` or `ss` object of MATLAB cannot be read: save `S = get(C)`, or its arrays, for example with
    /// `[num, den, Ts] = tfdata(C, 'v'); save('c.mat', 'num', 'den', 'Ts', '-v7')`.
    ///
    /// The controller file has the numbers as they were saved. Delays of whole samples, E, the unit of time and the variable are used;
    /// every other field that may change the response is refused by its name. The controller is converted to first and second order
    /// sections whose response must be that of the original to a millionth of its largest magnitude; otherwise it is refused.
    Import(ImportArgs),
}

/// Which file, and what it does not say.
#[derive(Clone, Debug, clap::Args)]
struct ImportArgs {
    /// The file of the other program
    file: PathBuf,
    /// Unit of the controller's output over its input
    #[arg(long, value_name = "UNIT")]
    gain_unit: UnitChoice,
    /// The controller file (TOML), which must not exist
    #[arg(long, value_name = "FILE", default_value = "controller.toml")]
    out: PathBuf,
    /// Title of the controller [default: the name of FILE]
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// The structure of the controller, if FILE contains several (`A.B` for a structure in a structure)
    #[arg(long, value_name = "NAME")]
    variable: Option<String>,
    /// The controller is continuous, if FILE has no sampling period
    #[arg(long, conflicts_with = "rate")]
    continuous: bool,
    /// The controller is discrete with this servo rate, if FILE has no sampling period
    #[arg(long, value_name = "HZ", value_parser = si::<OfFrequency>)]
    rate: Option<f64>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum UnitChoice {
    /// Amperes per micrometre
    #[value(name = "A/um")]
    AmperesPerMicrometre,
    /// Amperes per metre
    #[value(name = "A/m")]
    AmperesPerMetre,
}

impl UnitChoice {
    fn unit(self) -> GainUnit {
        match self {
            UnitChoice::AmperesPerMicrometre => GainUnit::AmperesPerMicrometre,
            UnitChoice::AmperesPerMetre => GainUnit::AmperesPerMetre,
        }
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    file: String,
    form: TransferTable,
    gain_unit: GainUnit,
    /// `null` of a continuous controller.
    rate_hz: Option<f64>,
    order: usize,
    /// Zeros and poles as [re, im], in rad/s or in the z plane.
    zeros: Vec<[f64; 2]>,
    poles: Vec<[f64; 2]>,
    /// In amperes per micrometre, by falling powers of s or z.
    sections: Vec<SectionReport>,
    /// Largest difference of the responses of the sections and of the original, over the largest magnitude.
    max_difference: f64,
    max_difference_rad_s: f64,
    remarks: Vec<String>,
}

#[derive(Debug, Serialize)]
struct SectionReport {
    numerator: Vec<f64>,
    denominator: Vec<f64>,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    match &args.what {
        ControllerCommand::Import(args) => run_import(args),
    }
}

fn run_import(args: &ImportArgs) -> Result<Exit, CliError> {
    let title = args.title.clone().unwrap_or_else(|| stem(&args.file));
    let imported = import(&args.file, &title, &options(args))?;
    write_new(&args.out, &imported.text)?;
    let report = Report::of(&args.out, &imported);
    print_result(args.json, &report, text)?;
    Ok(Exit::Done)
}

fn options(args: &ImportArgs) -> ImportOptions {
    let discrete = args.rate.map(|rate_hz| Domain::Discrete { rate_hz });
    ImportOptions {
        gain_unit: args.gain_unit.unit(),
        domain: discrete.or(args.continuous.then_some(Domain::Continuous)),
        variable: args.variable.clone(),
    }
}

fn stem(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Writes a file that does not exist yet; it is complete, or absent after an error.
fn write_new(file: &Path, text: &str) -> Result<(), CliError> {
    let failed = |e: std::io::Error| {
        let file = file.display();
        CliError::Failed(format!(
            "cannot write {file}: {e}; choose another file with --out"
        ))
    };
    // The empty file holds the name.
    File::create_new(file).map_err(failed)?;
    let written = write_atomic(file, text);
    if written.is_err() {
        // The error of writing is the one to report.
        let _ = remove_file(file);
    }
    written.map_err(failed)
}

impl Report {
    fn of(file: &Path, imported: &Imported) -> Report {
        let Cascade {
            sections,
            factors,
            agreement,
            ..
        } = &imported.cascade;
        let Agreement { difference, rad_s } = *agreement;
        Report {
            file: file.display().to_string(),
            form: imported.settings.table(),
            gain_unit: imported.settings.gain_unit(),
            rate_hz: imported.settings.rate_hz(),
            order: factors.poles.count(),
            zeros: pairs(&factors.zeros),
            poles: pairs(&factors.poles),
            sections: sections.iter().map(SectionReport::of).collect(),
            max_difference: difference,
            max_difference_rad_s: rad_s,
            remarks: imported.remarks.clone(),
        }
    }
}

impl SectionReport {
    fn of(section: &Section) -> SectionReport {
        let order = section.poles().len();
        let falling = |rising: &[f64; 3]| rising[..=order].iter().rev().copied().collect();
        SectionReport {
            numerator: falling(&section.numerator),
            denominator: falling(&section.denominator),
        }
    }
}

fn pairs(roots: &Roots) -> Vec<[f64; 2]> {
    roots.all().map(|root| [root.re, root.im]).collect()
}

fn text(report: &Report) -> String {
    let time = match report.rate_hz {
        Some(rate_hz) => format!("discrete at {rate_hz} Hz"),
        None => "continuous".into(),
    };
    let (form, unit) = (report.form.key(), report.gain_unit.symbol());
    let (zeros, sections) = (report.zeros.len(), report.sections.len());
    let (difference, rad_s) = (report.max_difference, report.max_difference_rad_s);
    let lines = [
        ("form", format!("[{form}], {time}, gain in {unit}")),
        ("order", format!("{} poles, {zeros} zeros", report.order)),
        ("sections", sections.to_string()),
        (
            "response",
            format!(
                "largest difference {difference:.1e} of the largest magnitude, at {rad_s:.4} rad/s"
            ),
        ),
    ];
    let remarks = report
        .remarks
        .iter()
        .map(|remark| ("remark", remark.clone()));
    let lines = lines.into_iter().chain(remarks);
    let lines: String = lines.map(|(name, value)| labelled(name, &value)).collect();
    let file = &report.file;
    format!("{file} written; `bench margins --controller {file}` evaluates it\n{lines}")
}
