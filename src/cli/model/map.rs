//! `bench model map`: the CNMP map of the thesis.

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::super::table::wrap;
use super::super::value_range::ValueRange;
use crate::config::{OptionSetting, PlantSettings, Purpose, Sr4dofSettings};
use crate::model::zeros;

/// The largest picture in lines and characters, which fits 80 columns.
const PICTURE: (usize, usize) = (60, 67);

/// The grid.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Operating points as ratios of the beam length: 0:0.15:31, 0%:15%:31
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "0%:15%:31",
        allow_hyphen_values = true
    )]
    operating_points: ValueRange,
    /// Mass asymmetries m2/m3 - 1: -0.1:0.1:41, -10%:10%:41
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "-10%:10%:41",
        allow_hyphen_values = true
    )]
    asymmetries: ValueRange,
    #[command(flatten)]
    table: TableOptions,
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
    let (points, asymmetries) = (&args.operating_points.0[..], &args.asymmetries.0[..]);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let cnmp_pairs = zeros::cnmp_map(&settings, points, asymmetries, threads)?;
    let report = Report {
        operating_points: points,
        asymmetries,
        cnmp_pairs,
    };
    args.table.write(|| columns(&report))?;
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&text(&report, args.bench.profile()))
    }
}

/// The plant, found valid at the ends of both grids.
fn settings(args: &Args) -> Result<Sr4dofSettings, CliError> {
    if args.bench.operating_point.is_some() || args.bench.asymmetry.is_some() {
        let what = "--operating-point and --asymmetry fix what a map varies: leave them out, or take `bench model modes`";
        return Err(CliError::Usage(what.into()));
    }
    let settings = sr4dof(args, &[])?;
    let ends = |grid: &ValueRange| [grid.0[0], grid.0[grid.0.len() - 1]];
    for (point, asymmetry) in ends(&args.operating_points)
        .into_iter()
        .zip(ends(&args.asymmetries))
    {
        let point_m = point * settings.beam_length_m;
        let settings = [
            OptionSetting::new("plant.operating_point_m", point_m, "--operating-points"),
            OptionSetting::new("plant.mass_asymmetry", asymmetry, "--asymmetries"),
        ];
        sr4dof(args, &settings)?;
    }
    Ok(settings)
}

fn sr4dof(args: &Args, settings: &[OptionSetting]) -> Result<Sr4dofSettings, CliError> {
    match args.bench.load(Purpose::Model, settings)?.plant {
        PlantSettings::Sr4dof(settings) => Ok(settings),
        other => Err(CliError::Usage(format!(
            "a map is over operating point and mass asymmetry, which the model `{}` does not have both; take one of `sr4dof` (--config stage, --config chapter2), or `bench model locus --vary KEY`",
            other.model()
        ))),
    }
}

/// A row for each point of the map.
fn columns(report: &Report) -> Vec<Column> {
    let column = |axis: usize| cells(report).map(|cell| cell[axis]).collect();
    let counts = report
        .cnmp_pairs
        .iter()
        .flatten()
        .map(|&pairs| Some(u64::from(pairs)));
    vec![
        Column::real("operating_point", column(0)),
        Column::real("mass_asymmetry", column(1)),
        Column::count("cnmp_pairs", counts),
    ]
}

/// Operating point, asymmetry and count of each point of the map.
fn cells<'a>(report: &'a Report) -> impl Iterator<Item = [f64; 3]> + 'a {
    report
        .operating_points
        .iter()
        .zip(&report.cnmp_pairs)
        .flat_map(|(&point, row)| {
            report
                .asymmetries
                .iter()
                .zip(row)
                .map(move |(&asymmetry, &pairs)| [point, asymmetry, f64::from(pairs)])
        })
}

fn text(report: &Report, profile: &str) -> String {
    let (rows, columns) = (report.operating_points.len(), report.asymmetries.len());
    let fits = rows <= PICTURE.0 && columns <= PICTURE.1;
    let rest = if fits {
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
    let all = report.operating_points.len() * report.asymmetries.len();
    let with: Vec<[f64; 3]> = cells(report).filter(|cell| cell[2] > 0.0).collect();
    let range = |axis: usize| {
        let ends = with.iter().map(|cell| 100.0 * cell[axis]);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        format!("{low:.3} to {high:.3} %")
    };
    if with.is_empty() {
        return format!("none of {all} points");
    }
    format!(
        "{} of {all} points: Y1o from {} of L, asymmetry from {}",
        with.len(),
        range(0),
        range(1)
    )
}

/// A line for each operating point, a character for each asymmetry: its CNMP pairs, `.` for none.
fn picture(report: &Report) -> String {
    let symbol = |&pairs: &u8| {
        if pairs == 0 {
            '.'
        } else {
            char::from(b'0' + pairs.min(9))
        }
    };
    let line = |(point, row): (&f64, &Vec<u8>)| {
        format!(
            "{:>9.3} %  {}\n",
            100.0 * point,
            row.iter().map(symbol).collect::<String>()
        )
    };
    let lines: String = report
        .operating_points
        .iter()
        .zip(&report.cnmp_pairs)
        .map(line)
        .collect();
    let (first, last) = (
        report.asymmetries[0],
        report.asymmetries[report.asymmetries.len() - 1],
    );
    format!(
        "{:>11}  asymmetry from {:+.2} to {:+.2} %\n{lines}",
        "Y1o/L",
        100.0 * first,
        100.0 * last
    )
}
