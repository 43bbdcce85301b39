//! `bench model veering`: two close modes as one setting varies (section 4.1).

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::super::table::table;
use super::sweep::Sweep;
use crate::config::Purpose;
use crate::model::veering::{Loci, Meeting, ModesAt};

/// What varies, and which modes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// The setting that varies: any number
    #[arg(long, value_name = "KEY", default_value = "plant.operating_point_m", requires_all = ["from", "to"])]
    vary: String,
    /// First value; 3.8mm for a length, 8% for a ratio or of the beam length
    #[arg(
        long,
        value_name = "A",
        default_value = "0",
        allow_hyphen_values = true
    )]
    from: String,
    /// Last value
    #[arg(
        long,
        value_name = "B",
        default_value = "15%",
        allow_hyphen_values = true
    )]
    to: String,
    /// Values of the grid; between them it is refined where it must be
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    count: u32,
    /// The two modes, slowest first at the first value [default: the pair that comes closest]
    #[arg(long, value_name = "I,J", value_delimiter = ',')]
    modes: Vec<usize>,
    #[command(flatten)]
    table: TableOptions,
}

#[derive(Debug, Serialize)]
struct Report {
    profile: String,
    vary: String,
    coordinates: Vec<String>,
    /// From 1, slowest first at the first value.
    modes: [usize; 2],
    /// What the two do where they are closest.
    meeting: &'static str,
    value: f64,
    frequency_hz: f64,
    gap_hz: f64,
    /// MAC of each of the two at the first value (rows) with each at the last (columns).
    mac_across: [[f64; 2]; 2],
    /// MAC of each at the first value (rows) with each at the closest point (columns): one half each in a veering.
    mac_to_closest: [[f64; 2]; 2],
    before: Shares,
    closest: Shares,
    after: Shares,
    values: Vec<f64>,
    /// One list a mode.
    frequencies_hz: Vec<Vec<f64>>,
    csv: Option<String>,
}

/// Shares of the coordinates in the shapes of the two modes: squares of the elements at unit length.
#[derive(Debug, Serialize)]
struct Shares {
    value: f64,
    shares: [Vec<f64>; 2],
}

impl Shares {
    fn of(at: &ModesAt, pair: [usize; 2]) -> Shares {
        Shares {
            value: at.value,
            shares: pair.map(|mode| at.shares(mode)),
        }
    }
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    args.table.check()?;
    let sweep = Sweep {
        bench: &args.bench,
        vary: &args.vary,
        from: &args.from,
        to: &args.to,
        count: args.count,
    };
    let values = sweep.values()?;
    let config = args.bench.load(Purpose::Model, &[])?;
    let coordinates: Vec<String> = config
        .plant
        .coordinates()
        .into_iter()
        .map(String::from)
        .collect();
    let mut loci = Loci::follow(&values, |value| sweep.at(value))?;
    let pair = pair(
        &args.modes,
        loci.path()[0].omega_rad_s.len(),
        loci.closest_pair(),
    )?;
    let (meeting, closest) = loci.meeting(pair)?;
    let grid: Vec<&ModesAt> = values.iter().map(|&value| loci.near(value)).collect();
    let names = || names(&args.vary, &coordinates, &closest, pair);
    args.table
        .write(|| Column::of_rows(names(), grid.iter().map(|at| row(at, pair))))?;
    let report = report(args, coordinates, &grid, pair, (meeting, &closest));
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&(text(&report) + &args.table.told("loci and shapes")))
    }
}

/// The two modes from 0.
pub(super) fn pair(
    asked: &[usize],
    count: usize,
    closest: Option<[usize; 2]>,
) -> Result<[usize; 2], CliError> {
    let places =
        |&[i, j]: &[usize; 2]| i != j && [i, j].iter().all(|mode| (1..=count).contains(mode));
    match asked {
        [] => closest.ok_or_else(|| {
            CliError::Usage(
                "this plant has fewer than two modes that a spring holds: there is no pair to follow".into(),
            )
        }),
        &[i, j] if places(&[i, j]) => Ok([i.min(j) - 1, i.max(j) - 1]),
        _ => Err(CliError::Usage(format!("--modes {asked:?}: give two different modes, I,J, of 1 to {count}"))),
    }
}

pub(super) fn hz(omega_rad_s: f64) -> f64 {
    omega_rad_s / (2.0 * std::f64::consts::PI)
}

fn report(
    args: &Args,
    coordinates: Vec<String>,
    grid: &[&ModesAt],
    pair: [usize; 2],
    (meeting, closest): (Meeting, &ModesAt),
) -> Report {
    let (first, last) = (grid[0], grid[grid.len() - 1]);
    let mac = |to: &ModesAt| pair.map(|i| pair.map(|j| first.mac(i, to, j)));
    let frequencies = |mode: usize| grid.iter().map(|at| hz(at.omega_rad_s[mode])).collect();
    Report {
        profile: args.bench.profile().into(),
        vary: args.vary.clone(),
        coordinates,
        modes: pair.map(|mode| mode + 1),
        meeting: meeting.name(),
        value: closest.value,
        frequency_hz: hz(0.5 * (closest.omega_rad_s[pair[0]] + closest.omega_rad_s[pair[1]])),
        gap_hz: hz(closest.gap_rad_s(pair)),
        mac_across: mac(last),
        mac_to_closest: mac(closest),
        before: Shares::of(first, pair),
        closest: Shares::of(closest, pair),
        after: Shares::of(last, pair),
        values: grid.iter().map(|at| at.value).collect(),
        frequencies_hz: (0..first.omega_rad_s.len()).map(frequencies).collect(),
        csv: args.table.csv(),
    }
}

fn names(vary: &str, coordinates: &[String], at: &ModesAt, pair: [usize; 2]) -> Vec<String> {
    let frequencies = (1..=at.omega_rad_s.len()).map(|mode| format!("mode_{mode}_hz"));
    let shapes = pair.iter().flat_map(|mode| {
        coordinates
            .iter()
            .map(move |name| format!("mode_{}_{name}", mode + 1))
    });
    [vary.to_string()]
        .into_iter()
        .chain(frequencies)
        .chain(shapes)
        .collect()
}

fn row(at: &ModesAt, pair: [usize; 2]) -> Vec<f64> {
    let frequencies = at.omega_rad_s.iter().map(|&w| hz(w));
    let shapes = pair.iter().flat_map(|&mode| at.shape(mode));
    [at.value]
        .into_iter()
        .chain(frequencies)
        .chain(shapes)
        .collect()
}

fn text(report: &Report) -> String {
    let [u, v] = report.modes;
    let verb = match report.meeting {
        "at the end" => "are closest at an end of the range",
        "crossing" => "cross",
        _ => "veer",
    };
    let [[uu, uv], [vu, vv]] = report.mac_across;
    format!(
        "{}: modes {u} and {v} over {}\n\n{}\nthey {verb} at {:.9}: {:.4} Hz, {:.3e} Hz apart\nMAC from the first value to the last: {u} to {u} {uu:.4}, {u} to {v} {uv:.4}, {v} to {u} {vu:.4}, {v} to {v} {vv:.4}\n\nshares of the coordinates in the shapes\n{}",
        report.profile,
        report.vary,
        loci_table(report),
        report.value,
        report.frequency_hz,
        report.gap_hz,
        shares_table(report),
    )
}

/// A screen of rows; the file and the JSON have all.
fn loci_table(report: &Report) -> String {
    let [u, v] = report.modes;
    let row = |k: usize| {
        let frequency = |mode: usize| format!("{:.4}", report.frequencies_hz[mode - 1][k]);
        vec![
            format!("{:.6}", report.values[k]),
            frequency(u),
            frequency(v),
        ]
    };
    let step = report.values.len().div_ceil(25);
    let rows: Vec<Vec<String>> = (0..report.values.len()).step_by(step).map(row).collect();
    table(
        &[
            &report.vary,
            &format!("mode {u} Hz"),
            &format!("mode {v} Hz"),
        ],
        &rows,
    )
}

fn shares_table(report: &Report) -> String {
    let header: Vec<&str> = [report.vary.as_str(), "mode"]
        .into_iter()
        .chain(report.coordinates.iter().map(String::as_str))
        .collect();
    let places = [&report.before, &report.closest, &report.after];
    let row = |at: &Shares, which: usize| {
        let shares = at.shares[which].iter().map(|share| format!("{share:.4}"));
        [format!("{:.6}", at.value), report.modes[which].to_string()]
            .into_iter()
            .chain(shares)
            .collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = places
        .into_iter()
        .flat_map(|at| [row(at, 0), row(at, 1)])
        .collect();
    table(&header, &rows)
}
