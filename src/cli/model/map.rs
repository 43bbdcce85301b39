//! `bench model map`: the CNMP map of the thesis.

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::figure_options::PictureOptions;
use super::super::output::print_result;
use super::super::table::wrap;
use bench_base::decimal::Decimal;
use bench_base::quantity::{OperatingPoint, Ratio};
use bench_config::{OptionSetting, PlantSettings, Purpose, Sr4dofSettings};
use bench_order::{BenchOptions, ValueRange, asymmetries, operating_points};
use bench_report::{CnmpMap, Picture, ReportError, map_svg};

/// The largest picture in lines and characters, which fits 80 columns.
const PICTURE: (usize, usize) = (60, 67);

/// The grid.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("operating_point", |arg| arg.hide(true)))]
#[command(mut_arg("asymmetry", |arg| arg.hide(true)))]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Operating points, FROM and TO with a unit: in % of the beam length (0%:15%:31) or as lengths (0mm:7mm:31)
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "0%:15%:31",
        allow_hyphen_values = true,
        value_parser = operating_points
    )]
    operating_points: ValueRange<OperatingPoint>,
    /// Mass asymmetries m2/m3 - 1: -10%:10%:41 or -0.1:0.1:41
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "-10%:10%:41",
        allow_hyphen_values = true,
        value_parser = asymmetries
    )]
    asymmetries: ValueRange<Ratio>,
    #[command(flatten)]
    table: TableOptions,
    #[command(flatten)]
    picture: PictureOptions,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    operating_points: &'a [f64],
    asymmetries: &'a [f64],
    /// One row for each operating point.
    cnmp_pairs: Vec<Vec<u8>>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    args.table.check()?;
    let settings = settings(args)?;
    let points = args.operating_points.ratios(settings.beam_length_m)?;
    let asymmetries = args.asymmetries.ratios()?;
    check_ends(args, &settings, &points, &asymmetries)?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let cnmp_pairs = bench_plant::zeros::cnmp_map(&settings, &points, &asymmetries, threads)?;
    let report = Report {
        operating_points: &points,
        asymmetries: &asymmetries,
        cnmp_pairs,
    };
    args.table.write(|| columns(&report))?;
    let profile = args.bench.profile();
    args.picture.write(|| drawn(&report, profile))?;
    print_result(args.bench.json, &report, |report| {
        text(report, profile) + &args.picture.files_text()
    })
}

fn drawn(report: &Report, profile: &str) -> Result<Picture, ReportError> {
    let title = format!("CNMP map of the configuration {profile}");
    let map = CnmpMap {
        operating_points: report.operating_points,
        asymmetries: report.asymmetries,
        pairs: &report.cnmp_pairs,
    };
    Ok(Picture {
        svg: map_svg(&map, &title, &format!("without damping: {}", summary(report)))?,
        caption: "Number of pairs of CNMP zeros without damping, over operating point and mass asymmetry. Each cell is a point of the grid.".into(),
        title,
    })
}

const FIXED: &str = "--operating-point and --asymmetry cannot be fixed here, because a map varies both; leave them out, or use `bench model modes`";

/// The settings of the plant, without what the grid varies.
fn settings(args: &Args) -> Result<Sr4dofSettings, CliError> {
    if args.bench.operating_point.is_some() || args.bench.asymmetry.is_some() {
        return Err(CliError::Usage(FIXED.into()));
    }
    sr4dof(args, &[])
}

/// Refuses a grid whose ends are not allowed.
fn check_ends(
    args: &Args,
    settings: &Sr4dofSettings,
    points: &[f64],
    asymmetries: &[f64],
) -> Result<(), CliError> {
    let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
    for (point, asymmetry) in ends(points).into_iter().zip(ends(asymmetries)) {
        let point_m = point * settings.beam_length_m;
        let settings = [
            OptionSetting::new("plant.operating_point_m", point_m, "--operating-points"),
            OptionSetting::new("plant.mass_asymmetry", asymmetry, "--asymmetries"),
        ];
        sr4dof(args, &settings)?;
    }
    Ok(())
}

fn sr4dof(args: &Args, settings: &[OptionSetting]) -> Result<Sr4dofSettings, CliError> {
    match args.bench.load(Purpose::Model, settings)?.plant {
        PlantSettings::Sr4dof(settings) => Ok(settings),
        other => Err(CliError::Usage(format!(
            "a map varies operating point and mass asymmetry, but the model `{}` does not have both; use a profile with the model `sr4dof` (--config stage, --config chapter2), or `bench model locus --vary KEY`",
            other.model()
        ))),
    }
}

/// A point of the map.
struct Point {
    operating_point: f64,
    asymmetry: f64,
    pairs: u8,
}

impl Report<'_> {
    fn points(&self) -> Vec<Point> {
        let mut points = Vec::new();
        for (&operating_point, row) in self.operating_points.iter().zip(&self.cnmp_pairs) {
            for (&asymmetry, &pairs) in self.asymmetries.iter().zip(row) {
                points.push(Point {
                    operating_point,
                    asymmetry,
                    pairs,
                });
            }
        }
        points
    }
}

/// A row for each point of the map.
fn columns(report: &Report) -> Vec<Column> {
    let points = report.points();
    let operating_points = points.iter().map(|point| point.operating_point);
    let asymmetries = points.iter().map(|point| point.asymmetry);
    let counts = points.iter().map(|point| Some(u64::from(point.pairs)));
    vec![
        Column::real("operating_point", operating_points.collect()),
        Column::real("mass_asymmetry", asymmetries.collect()),
        Column::count("cnmp_pairs", counts),
    ]
}

fn text(report: &Report, profile: &str) -> String {
    let (rows, columns) = (report.operating_points.len(), report.asymmetries.len());
    let rest = if rows <= PICTURE.0 && columns <= PICTURE.1 {
        picture(report)
    } else {
        format!("no picture above {} x {} points\n", PICTURE.0, PICTURE.1)
    };
    let summary = format!(
        "{profile}: CNMP zeros without damping at {}",
        summary(report)
    );
    wrap(&summary, 0) + &rest
}

fn summary(report: &Report) -> String {
    let points = report.points();
    let with: Vec<&Point> = points.iter().filter(|point| point.pairs > 0).collect();
    if with.is_empty() {
        return format!("none of {} points", points.len());
    }
    format!(
        "{} of {} points: Y1o from {} of L, asymmetry from {}",
        with.len(),
        points.len(),
        range(with.iter().map(|point| point.operating_point)),
        range(with.iter().map(|point| point.asymmetry))
    )
}

/// The range of some ratios in %.
fn range(ratios: impl Iterator<Item = f64> + Clone) -> String {
    let low = ratios.clone().fold(f64::INFINITY, f64::min);
    let high = ratios.fold(f64::NEG_INFINITY, f64::max);
    format!(
        "{:.3} to {:.3} %",
        Decimal(100.0 * low),
        Decimal(100.0 * high)
    )
}

/// A line for each operating point, a character for each asymmetry: its CNMP pairs, `.` for none.
fn picture(report: &Report) -> String {
    let asymmetries = report.asymmetries;
    let (first, last) = (asymmetries[0], asymmetries[asymmetries.len() - 1]);
    let mut picture = format!(
        "{:>11}  asymmetry from {:+.2} to {:+.2} %\n",
        "Y1o/L",
        Decimal(100.0 * first),
        Decimal(100.0 * last)
    );
    for (point, row) in report.operating_points.iter().zip(&report.cnmp_pairs) {
        let symbols: String = row.iter().map(|pairs| symbol(*pairs)).collect();
        picture += &format!("{:>9.3} %  {symbols}\n", Decimal(100.0 * point));
    }
    picture
}

fn symbol(pairs: u8) -> char {
    match pairs {
        0 => '.',
        pairs => char::from(b'0' + pairs.min(9)),
    }
}
