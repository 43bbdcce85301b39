//! `bench model study`: probability of CNMP zeros within manufacturing tolerances.

use std::path::PathBuf;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::exit::Exit;
use super::super::figure_options::PictureOptions;
use super::super::output::{print_note, print_result};
use super::super::progress::ProgressLine;
use super::study_text::text;
use bench_base::progress::Progress;
use bench_config::Purpose;
use bench_experiment::stop_on_signal;
use bench_order::{BenchOptions, SeedOption};
use bench_report::{Picture, ReportError, plant_conditions, study_svg};
use bench_study::{
    Answer, Block, Opened, Plan, Results, Shard, StudyFile, Tolerance, complete, joined,
};

/// The settings that vary, and the number of draws.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("seed", |arg| arg.help("Seed of the random generator that makes the draws")))]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    seed: SeedOption,
    /// A setting of the plant and its tolerance (repeatable): KEY=uniform:LOW:HIGH, KEY=normal:SIGMA or KEY=+-LIMIT. The
    /// deviation is added to the setting. It is in the unit of the setting, or in %: of the beam length for an operating
    /// point, of 1 for a ratio, of the nominal value otherwise. * in the key stands for any characters:
    /// plant.secondary_mass_deviation.*=+-0.15
    #[arg(long, value_name = "KEY=TOLERANCE", required_unless_present = "join")]
    vary: Vec<Tolerance>,
    /// Number of draws
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    draws: u64,
    /// Compute only shard I of N; combine the shards with --join
    #[arg(long, value_name = "I/N", requires = "file")]
    shard: Option<Shard>,
    /// Store completed draws in this file; the same command started again continues an interrupted study
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    /// Count the CNMP pairs of the zeros with damping as well
    #[arg(long)]
    damped: bool,
    /// Number of threads [default: one for each processor]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Combine the shards in these files
    #[arg(
        long,
        value_name = "FILE",
        num_args = 1..,
        conflicts_with_all = ["vary", "draws", "shard", "file", "damped", "threads", "config", "sets", "operating_point", "asymmetry", "seed"]
    )]
    join: Vec<PathBuf>,
    #[command(flatten)]
    table: TableOptions,
    #[command(flatten)]
    picture: PictureOptions,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    args.table.check()?;
    let results = if args.join.is_empty() {
        drawn(args)?
    } else {
        joined(&args.join)?
    };
    if !results.is_done() {
        print_note(&stopped(args, &results));
        return Ok(Exit::Failed);
    }
    args.table.write(|| columns(&results))?;
    let answer = Answer::of(&results);
    args.picture.write(|| picture(&answer, &results))?;
    print_result(args.bench.json, &answer, |answer| {
        text(answer) + &args.table.files_text("draws") + &args.picture.files_text()
    })?;
    Ok(Exit::Done)
}

fn picture(answer: &Answer, results: &Results) -> Result<Picture, ReportError> {
    let (model, draws, seed) = (answer.model, answer.draws, answer.seed);
    let title = format!("Tolerance study of the model {model}: CNMP zeros");
    let conditions = plant_conditions(&results.plan.plant, &[]);
    let subtitle = format!("{draws} draws, seed {seed}; {conditions}");
    Ok(Picture {
        svg: study_svg(answer, &title, &subtitle)?,
        caption: "Probability of each number of pairs of CNMP zeros, and the share of the variance of \"has CNMP zeros\" that the settings explain.".into(),
        title,
    })
}

/// The results of the draws that this process has to do; incomplete if it is stopped.
fn drawn(args: &Args) -> Result<Results, CliError> {
    let config = args
        .bench
        .load(Purpose::Model, args.seed.setting().as_slice())?;
    let plan = Plan::new(&config, &args.vary, args.draws, args.damped)?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let (mut file, mut results) = match &args.file {
        Some(path) => {
            let opened = StudyFile::open(path, &plan, shard)?;
            report_progress(&opened);
            (Some(opened.file), opened.results)
        }
        None => (None, Results::none(plan, shard)),
    };
    draw(&mut results, file.as_mut(), threads(args))?;
    Ok(results)
}

/// Makes the missing draws, with progress on a terminal.
fn draw(
    results: &mut Results,
    file: Option<&mut StudyFile>,
    threads: usize,
) -> Result<(), CliError> {
    let progress = Progress::default();
    progress.begin("draws", results.left());
    let _line = ProgressLine::show(&progress);
    let completed = stop_on_signal(|stop| {
        complete(results, file, threads, stop, |draws| {
            progress.advance(draws);
        })
    });
    Ok(completed.map_err(|error| CliError::Failed(error.to_string()))??)
}

fn threads(args: &Args) -> usize {
    let available = || std::thread::available_parallelism().map_or(1, usize::from);
    args.threads.map_or_else(available, usize::from)
}

fn report_progress(opened: &Opened) {
    let (dropped, results) = (opened.dropped, &opened.results);
    if dropped > 0 {
        print_note(&format!(
            "{dropped} damaged lines are ignored; their draws are done again"
        ));
    }
    if results.done() > 0 {
        let (done, total) = (results.done(), results.total());
        print_note(&format!("{done} of {total} draws are done already"));
    }
}

fn stopped(args: &Args, results: &Results) -> String {
    let remedy = match &args.file {
        None => "nothing was stored; use --file FILE for a study that can be continued".into(),
        Some(path) => format!(
            "started again with the same arguments it continues from {}",
            path.display()
        ),
    };
    let (done, total) = (results.done(), results.total());
    format!("stopped after {done} of {total} draws; {remedy}")
}

/// A row for each draw: its number, the value of each setting, and its pairs.
fn columns(results: &Results) -> Vec<Column> {
    let plan = &results.plan;
    let numbers = results
        .blocks()
        .flat_map(|block| (block.first..).take(block.cnmp_pairs.len()));
    let mut columns = vec![Column::count("draw", numbers.map(Some))];
    for (index, one) in plan.varied.iter().enumerate() {
        columns.push(Column::real(&one.key, values(results, index)));
    }
    columns.push(counts("cnmp_pairs", results, |block| &block.cnmp_pairs));
    if plan.damped {
        let damped = counts("damped_cnmp_pairs", results, |block| {
            &block.damped_cnmp_pairs
        });
        columns.push(damped);
    }
    columns
}

/// The values of one setting in all draws.
fn values(results: &Results, index: usize) -> Vec<f64> {
    let blocks = results.blocks();
    let drawn = blocks.flat_map(|block| {
        let draws = block.cnmp_pairs.len();
        results.plan.from_draw(block.first).take(draws)
    });
    drawn.map(|drawn| drawn.values[index]).collect()
}

fn counts(name: &str, results: &Results, of: fn(&Block) -> &Vec<Option<u32>>) -> Column {
    let counts = results.blocks().flat_map(of);
    Column::count(name, counts.map(|pairs| pairs.map(u64::from)))
}
