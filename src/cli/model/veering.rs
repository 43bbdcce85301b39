//! `bench model veering`: two close modes as one setting varies (section 4.1).

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::figure_options::PictureOptions;
use super::super::output::print_result;
use super::super::table::{table, wrap};
use super::sweep::CloseModesArgs;
use super::{evenly_spread_rows, meeting_text};
use bench_base::decimal::Decimal;
use bench_base::units::hz;
use bench_config::{Config, Purpose};
use bench_order::BenchOptions;
use bench_report::{Picture, ReportError, plant_conditions, veering_caption, veering_svg};
use bench_thesis::veering::report::{Shares, VeeringReport};
use bench_thesis::veering::{Loci, ModesAt, close_pair};

/// The setting that varies, and the two modes.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("from", |arg| arg.default_value("0")))]
pub(super) struct Args {
    #[command(flatten)]
    modes: CloseModesArgs,
    #[command(flatten)]
    table: TableOptions,
    #[command(flatten)]
    picture: PictureOptions,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    profile: &'a str,
    vary: &'a str,
    coordinates: Vec<String>,
    #[serde(flatten)]
    veering: VeeringReport,
    csv: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    args.table.check()?;
    let sweep = &args.modes.sweep;
    let coordinates = coordinates(&sweep.bench)?;
    let report = Report {
        profile: sweep.bench.profile(),
        vary: &sweep.vary,
        veering: veering(args, &coordinates)?,
        coordinates,
        csv: args.table.csv(),
    };
    let config = sweep.bench.load(Purpose::Model, &[])?;
    args.picture.write(|| drawn(&report, &config))?;
    print_result(sweep.bench.json, &report, |report| {
        text(report) + &args.table.files_text("loci and shapes") + &args.picture.files_text()
    })
}

fn drawn(report: &Report, config: &Config) -> Result<Picture, ReportError> {
    let (vary, [u, v]) = (report.vary, report.veering.point.modes);
    let title = format!("{}: modes {u} and {v} over {vary}", config.title);
    let conditions = plant_conditions(&config.plant, &[vary]);
    Ok(Picture {
        svg: veering_svg(&report.veering, vary, &title, &conditions)?,
        caption: veering_caption(&report.veering.point, vary),
        title,
    })
}

/// Follows the modes over the sweep, and writes the table.
fn veering(args: &Args, coordinates: &[String]) -> Result<VeeringReport, CliError> {
    let sweep = &args.modes.sweep;
    let values = sweep.values()?;
    let mut loci = Loci::follow(&values, |value| sweep.structure(value))?;
    let pair = close_pair(&args.modes.modes, &loci)?;
    let (meeting, closest) = loci.meeting(pair)?;
    let grid: Vec<&ModesAt> = values.iter().map(|&value| loci.near(value)).collect();
    args.table.write(|| {
        let names = names(&sweep.vary, coordinates, &closest, pair);
        Column::of_rows(names, grid.iter().map(|at| row(at, pair)))
    })?;
    Ok(VeeringReport::of(&grid, pair, meeting, &closest))
}

fn coordinates(bench: &BenchOptions) -> Result<Vec<String>, CliError> {
    let plant = bench.load(Purpose::Model, &[])?.plant;
    Ok(plant.coordinates().into_iter().map(String::from).collect())
}

fn names(vary: &str, coordinates: &[String], at: &ModesAt, pair: [usize; 2]) -> Vec<String> {
    let mut names = vec![vary.to_string()];
    names.extend((1..=at.omega_rad_s.len()).map(|mode| format!("mode_{mode}_hz")));
    for mode in pair {
        let shape = coordinates.iter();
        names.extend(shape.map(|name| format!("mode_{}_{name}", mode + 1)));
    }
    names
}

fn row(at: &ModesAt, pair: [usize; 2]) -> Vec<f64> {
    let mut row = vec![at.value];
    row.extend(at.omega_rad_s.iter().map(|&w| hz(w)));
    row.extend(pair.iter().flat_map(|&mode| at.shape(mode)));
    row
}

fn text(report: &Report) -> String {
    let point = &report.veering.point;
    let [u, v] = point.modes;
    let [[uu, uv], [vu, vv]] = report.veering.mac_across;
    let title = format!("{}: modes {u} and {v} over {}", report.profile, report.vary);
    let meeting = meeting_text(point);
    let mac = format!(
        "MAC from the first value to the last: {u} to {u} {uu:.4}, {u} to {v} {uv:.4}, {v} to {u} {vu:.4}, {v} to {v} {vv:.4}"
    );
    format!(
        "{}\n{}\n{}{}\nshares of the coordinates in the shapes\n{}",
        wrap(&title, 0),
        loci_table(&report.veering),
        wrap(&meeting, 0),
        wrap(&mac, 0),
        shares_table(report),
    )
}

fn loci_table(report: &VeeringReport) -> String {
    let [u, v] = report.point.modes;
    let frequency = |mode: usize, k: usize| format!("{:.4}", report.frequencies_hz[mode - 1][k]);
    let places: Vec<usize> = (0..report.values.len()).collect();
    let rows: Vec<Vec<String>> = evenly_spread_rows(&places)
        .map(|&k| {
            vec![
                format!("{:.6}", Decimal(report.values[k])),
                frequency(u, k),
                frequency(v, k),
            ]
        })
        .collect();
    table(
        &["value", &format!("mode {u} Hz"), &format!("mode {v} Hz")],
        &rows,
    )
}

fn shares_table(report: &Report) -> String {
    let mut header = vec!["value", "mode"];
    header.extend(report.coordinates.iter().map(String::as_str));
    let VeeringReport {
        before,
        closest,
        after,
        point,
        ..
    } = &report.veering;
    let mut rows = Vec::new();
    for at in [before, closest, after] {
        for which in [0, 1] {
            rows.push(shares_row(at, which, point.modes[which]));
        }
    }
    table(&header, &rows)
}

fn shares_row(at: &Shares, which: usize, mode: usize) -> Vec<String> {
    let mut row = vec![format!("{:.6}", Decimal(at.value)), mode.to_string()];
    row.extend(at.shares[which].iter().map(|share| format!("{share:.4}")));
    row
}
