//! `bench model step`: the beginning of the response to a step, compared with the prediction from the zeros (Chapter 3).

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::figure_options::PictureOptions;
use super::super::output::print_result;
use super::super::table::wrap;
use bench_base::decimal::Decimal;
use bench_base::numeric::linspace;
use bench_base::quantity::{OfTime, si};
use bench_config::{Config, Purpose};
use bench_order::BenchOptions;
use bench_plant::ModalModel;
use bench_plant::zeros::{ModalSum, ZeroCounts};
use bench_report::{Picture, ReportError, model_step_svg, plant_conditions};
use bench_thesis::{Sequence, StepFeatures, StepPrediction, StepResponse};

/// The table of the response.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    table: TableOptions,
    /// Length of the response in the file [default: the time window in which zero
    /// crossings are counted]
    #[arg(long, value_name = "TIME", value_parser = si::<OfTime>)]
    duration: Option<f64>,
    /// Rows of the file
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    count: u32,
    #[command(flatten)]
    picture: PictureOptions,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    profile: &'a str,
    dominant_sequence: String,
    /// Number of zeros of each kind without damping, of the observable modes.
    zeros: ZeroCounts,
    end_m_per_n: Option<f64>,
    initial_undershoot: bool,
    undershoot_m_per_n: f64,
    zero_crossings: usize,
    zero_crossings_s: Vec<f64>,
    reversals: usize,
    reversals_s: Vec<f64>,
    window_s: f64,
    initial_s: f64,
    predicted: StepPrediction,
    csv: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    check_duration(args.duration)?;
    args.table.check()?;
    let config = args.bench.load(Purpose::Model, &[])?;
    let sum = ModalSum::visible(&ModalModel::of(&bench_plant::build(&config.plant)?)?)?;
    let response = StepResponse::new(&sum);
    let features = response.initial();
    let end_s = args.duration.unwrap_or(features.window_s);
    args.table
        .write(|| columns(&sum, &response, end_s, args.count as usize))?;
    args.picture
        .write(|| picture(&config, &response, &features, end_s))?;
    let report = report(args, &sum, &response, features)?;
    print_result(args.bench.json, &report, |report| {
        text(report) + &args.table.files_text("  response           ") + &args.picture.files_text()
    })
}

fn picture(
    config: &Config,
    response: &StepResponse,
    features: &StepFeatures,
    end_s: f64,
) -> Result<Picture, ReportError> {
    let title = format!("{}: step response", config.title);
    let conditions = plant_conditions(&config.plant, &[]);
    Ok(Picture {
        svg: model_step_svg(response, features, end_s, &title, &conditions)?,
        caption:
            "Displacement after a step of force of 1 N at the actuator, and the part of each mode."
                .into(),
        title,
    })
}

fn check_duration(duration_s: Option<f64>) -> Result<(), CliError> {
    match duration_s {
        Some(seconds) if !(seconds > 0.0 && seconds.is_finite()) => Err(CliError::Usage(format!(
            "--duration is {seconds} s; give a time above 0 s"
        ))),
        _ => Ok(()),
    }
}

fn columns(sum: &ModalSum, response: &StepResponse, end_s: f64, count: usize) -> Vec<Column> {
    let times_s = linspace(0.0, end_s, count);
    Column::of_rows(names(sum), times_s.map(|t| row(response, t)))
}

fn names(sum: &ModalSum) -> Vec<String> {
    let mut names = vec!["time_s".to_string(), "displacement_m_per_n".to_string()];
    names.extend((1..=sum.terms().len()).map(|number| format!("mode_{number}_m_per_n")));
    names
}

fn row(response: &StepResponse, time_s: f64) -> Vec<f64> {
    let mut row = vec![time_s, response.position_m(time_s)];
    row.extend(response.parts_m(time_s));
    row
}

fn report<'a>(
    args: &'a Args,
    sum: &ModalSum,
    response: &StepResponse,
    features: StepFeatures,
) -> Result<Report<'a>, CliError> {
    let zeros = ZeroCounts::of(&sum.undamped_zeros()?);
    Ok(Report {
        profile: args.bench.profile(),
        dominant_sequence: Sequence::of(sum)?.to_string(),
        zeros,
        end_m_per_n: Some(response.end_m()).filter(|end| end.is_finite()),
        initial_undershoot: features.has_undershoot(),
        undershoot_m_per_n: features.undershoot_m,
        zero_crossings: features.zero_crossings_s.len(),
        reversals: features.reversals_s.len(),
        window_s: features.window_s,
        initial_s: features.initial_s,
        predicted: StepPrediction::of(&zeros, &features),
        zero_crossings_s: features.zero_crossings_s,
        reversals_s: features.reversals_s,
        csv: args.table.csv(),
    })
}

fn text(report: &Report) -> String {
    let end = report.end_m_per_n.map_or("unlimited".into(), |end| {
        format!("{:.4} um/N", Decimal(end * 1e6))
    });
    let disagreement = if report.predicted.agrees {
        ""
    } else {
        "  the features DISAGREE with the prediction\n"
    };
    format!(
        "{}: {}, {}\n  end                 {end}\n{}{}{}{disagreement}",
        report.profile,
        report.dominant_sequence,
        report.zeros,
        undershoot_text(report),
        crossings_text(report),
        reversals_text(report),
    )
}

fn undershoot_text(report: &Report) -> String {
    let yes = |yes: bool| if yes { "yes" } else { "no" };
    format!(
        "  initial undershoot  {}, {:.4} um/N (predicted: {})\n",
        yes(report.initial_undershoot),
        Decimal(report.undershoot_m_per_n * 1e6),
        yes(report.predicted.initial_undershoot),
    )
}

fn crossings_text(report: &Report) -> String {
    let predicted = &report.predicted;
    format!(
        "  zero crossings      {} in the first {:.3} ms\n                      (predicted: at least {}, as a rule at most {})\n{}",
        report.zero_crossings,
        report.window_s * 1e3,
        predicted.least_zero_crossings,
        predicted.usual_zero_crossings,
        times_text(&report.zero_crossings_s),
    )
}

fn reversals_text(report: &Report) -> String {
    format!(
        "  reversals           {} in the first {:.3} ms\n{}",
        report.reversals,
        report.initial_s * 1e3,
        times_text(&report.reversals_s),
    )
}

/// A line with the times in milliseconds.
fn times_text(times_s: &[f64]) -> String {
    if times_s.is_empty() {
        return String::new();
    }
    let times: Vec<String> = times_s.iter().map(|t| format!("{:.3}", t * 1e3)).collect();
    wrap(&format!("at {} ms", times.join(", ")), 22)
}
