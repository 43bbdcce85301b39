//! `bench model step`: how the response to a step begins, and what the zeros foretell of it (Chapter 3).

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use crate::config::Purpose;
use crate::model::plant::{self, ModalModel};
use crate::model::zeros::{ModalSum, Sequence, StepFeatures, StepResponse, ZeroCounts};
use crate::util::quantity::{OfTime, si};

/// Which step response.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    table: TableOptions,
    /// Length of the response in the file; until the window of the zero crossings ends if absent
    #[arg(long, value_name = "SECONDS", value_parser = si::<OfTime>)]
    duration: Option<f64>,
    /// Rows of the file
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    count: u32,
}

#[derive(Debug, Serialize)]
struct Report {
    profile: String,
    dominant_sequence: String,
    /// ZeroCounts of the zeros without damping, of the modes that show.
    zeros: String,
    end_m_per_n: Option<f64>,
    initial_undershoot: bool,
    undershoot_m_per_n: f64,
    zero_crossings: usize,
    zero_crossings_s: Vec<f64>,
    reversals: usize,
    reversals_s: Vec<f64>,
    window_s: f64,
    initial_s: f64,
    foretold: Prediction,
    csv: Option<String>,
}

/// What the number of zeros in the right half plane says.
#[derive(Debug, Serialize)]
struct Prediction {
    /// An odd number of RNMP zeros.
    initial_undershoot: bool,
    /// One a RNMP zero.
    least_zero_crossings: usize,
    /// One a zero in the right half plane: so in the thesis's examples, no law.
    usual_zero_crossings: usize,
    /// Whether undershoot and least number of crossings are as foretold.
    agrees: bool,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    if let Some(seconds) = args
        .duration
        .filter(|seconds| !(*seconds > 0.0 && seconds.is_finite()))
    {
        return Err(CliError::Usage(format!(
            "--duration is {seconds}; it is in seconds and above 0"
        )));
    }
    args.table.check()?;
    let config = args.bench.load(Purpose::Model, &[])?;
    let sum = ModalSum::visible(&ModalModel::of(&plant::build(&config.plant)?)?)?;
    let response = StepResponse::new(&sum);
    let initial = response.initial();
    let seconds = args.duration.unwrap_or(initial.window_s);
    let rows = (0..args.count).map(|k| {
        row(
            &response,
            seconds * f64::from(k) / f64::from(args.count - 1),
        )
    });
    args.table.write(|| Column::of_rows(names(&sum), rows))?;
    let report = report(args, &sum, &response, initial)?;
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&(text(&report) + &args.table.told("  response           ")))
    }
}

fn names(sum: &ModalSum) -> Vec<String> {
    let modes = (1..=sum.terms().len()).map(|number| format!("mode_{number}_m_per_n"));
    ["time_s", "displacement_m_per_n"]
        .into_iter()
        .map(String::from)
        .chain(modes)
        .collect()
}

fn row(response: &StepResponse, time_s: f64) -> Vec<f64> {
    [time_s, response.position_m(time_s)]
        .into_iter()
        .chain(response.parts_m(time_s))
        .collect()
}

fn report(
    args: &Args,
    sum: &ModalSum,
    response: &StepResponse,
    initial: StepFeatures,
) -> Result<Report, CliError> {
    let kinds = ZeroCounts::of(&sum.undamped_zeros()?);
    let crossings = initial.zero_crossings_s.len();
    let (undershoot, least, most) = (kinds.real % 2 == 1, kinds.real, kinds.in_right_half_plane());
    Ok(Report {
        profile: args.bench.profile().into(),
        dominant_sequence: Sequence::of(sum)?.to_string(),
        zeros: kinds.to_string(),
        end_m_per_n: Some(response.end_m()).filter(|end| end.is_finite()),
        initial_undershoot: initial.has_undershoot(),
        undershoot_m_per_n: initial.undershoot_m,
        zero_crossings: crossings,
        reversals: initial.reversals_s.len(),
        window_s: initial.window_s,
        initial_s: initial.initial_s,
        foretold: Prediction {
            initial_undershoot: undershoot,
            least_zero_crossings: least,
            usual_zero_crossings: most,
            agrees: undershoot == initial.has_undershoot() && crossings >= least,
        },
        zero_crossings_s: initial.zero_crossings_s,
        reversals_s: initial.reversals_s,
        csv: args.table.csv(),
    })
}

fn text(report: &Report) -> String {
    let times = |times: &[f64]| match times {
        [] => String::new(),
        _ => format!(
            " (at {} ms)",
            times
                .iter()
                .map(|t| format!("{:.3}", t * 1e3))
                .collect::<Vec<_>>()
                .join(", ")
        ),
    };
    let yes = |yes: bool| if yes { "yes" } else { "no" };
    let foretold = &report.foretold;
    let end = report.end_m_per_n.map_or("goes on for ever".into(), |end| {
        format!("{:.4} um/N", end * 1e6)
    });
    format!(
        "{}: {}, {}\n  end                 {end}\n  initial undershoot  {}, {:.4} um/N   foretold: {}\n  zero crossings      {}{} in the first {:.3} ms   foretold: at least {}, {} where each zero in the right half plane shows\n  reversals           {}{} in the first {:.3} ms\n{}",
        report.profile,
        report.dominant_sequence,
        report.zeros,
        yes(report.initial_undershoot),
        report.undershoot_m_per_n * 1e6,
        yes(foretold.initial_undershoot),
        report.zero_crossings,
        times(&report.zero_crossings_s),
        report.window_s * 1e3,
        foretold.least_zero_crossings,
        foretold.usual_zero_crossings,
        report.reversals,
        times(&report.reversals_s),
        report.initial_s * 1e3,
        if foretold.agrees {
            ""
        } else {
            "  NOT as foretold\n"
        },
    )
}
