//! `bench model study`: how likely CNMP zeros are within manufacturing tolerances.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::outcome::Outcome;
use super::super::output::{print_json, print_text};
use super::super::progress::ProgressLine;
use super::super::table::table;
use crate::config::Purpose;
use crate::experiment::stop_on_signal;
use crate::model::study::{
    Answer, Block, Counted, Deviation, Effect, Interaction, Opened, Plan, Probability, Results,
    Shard, StudyError, StudyFile, Tolerance, Varied, count, joined,
};
use crate::util::progress::Progress;

/// What varies, and how often it is drawn.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// A setting of the plant and its tolerance, repeatable: KEY=uniform:LOW:HIGH, KEY=normal:SIGMA or KEY=+-LIMIT, added to
    /// the setting, or in % of it; * in the key stands for any name: plant.secondary_mass_deviation.*=+-0.15
    #[arg(long, value_name = "KEY=TOLERANCE", required_unless_present = "join")]
    vary: Vec<Tolerance>,
    /// How many draws; --seed chooses which
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    draws: u64,
    /// Do the I-th of N parts alone, for --join to put together
    #[arg(long, value_name = "I/N", requires = "file")]
    shard: Option<Shard>,
    /// Keep in this file what is done; started again with the same arguments, the study goes on from there
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    /// Count the CNMP pairs of the zeros with damping as well
    #[arg(long)]
    damped: bool,
    /// Threads [default: one a processor]; the answer does not depend on them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// The answer of the shards in these files together
    #[arg(
        long,
        value_name = "FILE",
        num_args = 1..,
        conflicts_with_all = ["vary", "draws", "shard", "file", "damped", "threads", "config", "sets", "operating_point", "asymmetry", "seed"]
    )]
    join: Vec<PathBuf>,
    #[command(flatten)]
    table: TableOptions,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    args.table.check()?;
    let results = if args.join.is_empty() {
        drawn(args)?
    } else {
        joined(&args.join)?
    };
    if !results.is_done() {
        eprintln!("bench: {}", stopped(args, &results));
        return Ok(Outcome::Failed);
    }
    args.table.write(|| columns(&results))?;
    let answer = Answer::of(&results);
    if args.bench.json {
        print_json(&answer)?
    } else {
        print_text(&(text(&answer) + &args.table.told("draws")))?
    }
    Ok(Outcome::Done)
}

/// The results of the draws that this process is asked for; not all of them if a person stops it.
fn drawn(args: &Args) -> Result<Results, CliError> {
    let config = args.bench.load(Purpose::Model, &[])?;
    let plan = Plan::new(&config, &args.vary, args.draws, args.damped)?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let (mut file, mut results) = match &args.file {
        Some(path) => {
            let Opened {
                file,
                results,
                dropped,
            } = StudyFile::open(path, &plan, shard)?;
            went_on(&results, dropped);
            (Some(file), results)
        }
        None => (None, Results::none(plan.clone(), shard)),
    };
    let worked = stop_on_signal(|stop| fill(&mut results, file.as_mut(), threads(args), stop));
    worked.map_err(|error| CliError::Failed(error.to_string()))??;
    Ok(results)
}

/// Does what is missing.
fn fill(
    results: &mut Results,
    mut file: Option<&mut StudyFile>,
    threads: usize,
    stop: &AtomicBool,
) -> Result<(), CliError> {
    let (plan, ranges) = (results.plan.clone(), results.missing());
    let progress = Progress::default();
    progress.begin(
        "draws",
        ranges.iter().map(|range| range.end - range.start).sum(),
    );
    let _line = ProgressLine::show(&progress);
    let counted = count(&plan, &ranges, threads, stop, |block| {
        if let Some(file) = file.as_mut() {
            file.append(&block)?;
        }
        progress.advance(block.cnmp_pairs.len() as u64);
        results.add(block);
        Ok::<(), StudyError>(())
    });
    counted?;
    Ok(file.map_or(Ok(()), |file| file.sync())?)
}

fn threads(args: &Args) -> usize {
    args.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    )
}

fn went_on(results: &Results, dropped: usize) {
    if dropped > 0 {
        eprintln!("bench: {dropped} damaged lines do not count; their draws are done again");
    }
    if results.done() > 0 {
        let draws = results.shard.draws(&results.plan);
        eprintln!(
            "bench: {} of {} draws are done already",
            results.done(),
            draws.end - draws.start
        );
    }
}

fn stopped(args: &Args, results: &Results) -> String {
    let draws = results.shard.draws(&results.plan);
    let kept = args.file.as_ref().map_or(
        "nothing is kept: with --file FILE it can go on".into(),
        |path| {
            format!(
                "started again with the same arguments it goes on from {}",
                path.display()
            )
        },
    );
    format!(
        "stopped after {} of {} draws; {kept}",
        results.done(),
        draws.end - draws.start
    )
}

/// A row a draw: what it gave each setting, and its pairs.
fn columns(results: &Results) -> Vec<Column> {
    let plan = &results.plan;
    let numbers = || {
        results
            .blocks()
            .flat_map(|block| (block.first..).take(block.cnmp_pairs.len()))
    };
    let values = |index: usize| -> Vec<f64> {
        let of = |block: &Block| plan.from_draw(block.first).take(block.cnmp_pairs.len());
        results
            .blocks()
            .flat_map(of)
            .map(|drawn| drawn.values[index])
            .collect()
    };
    let counts = |of: fn(&Block) -> &Vec<Option<u32>>| {
        results
            .blocks()
            .flat_map(move |block| of(block).iter().map(|pairs| pairs.map(u64::from)))
    };
    let draw = [Column::count("draw", numbers().map(Some))];
    let settings = plan
        .varied
        .iter()
        .enumerate()
        .map(|(index, one)| Column::real(&one.key, values(index)));
    let pairs = [Column::count(
        "cnmp_pairs",
        counts(|block| &block.cnmp_pairs),
    )];
    let damped = plan.damped.then(|| {
        Column::count(
            "damped_cnmp_pairs",
            counts(|block| &block.damped_cnmp_pairs),
        )
    });
    draw.into_iter()
        .chain(settings)
        .chain(pairs)
        .chain(damped)
        .collect()
}

fn text(answer: &Answer) -> String {
    let shard = answer
        .shard
        .as_ref()
        .map_or(String::new(), |shard| format!(" of shard {shard}"));
    let tolerances: Vec<Vec<String>> = answer.varied.iter().map(tolerance).collect();
    format!(
        "{}: {} draws{shard}, seed {}\n\n{}\nwithout damping\n{}{}{}",
        answer.model,
        answer.draws,
        answer.seed,
        table(&["setting", "nominal", "tolerance"], &tolerances),
        counted(&answer.cnmp_pairs),
        answer
            .damped_cnmp_pairs
            .as_ref()
            .map_or(String::new(), |part| format!(
                "\nwith damping\n{}",
                counted(part)
            )),
        not_analysed(answer),
    )
}

fn tolerance(one: &Varied) -> Vec<String> {
    let deviation = match one.deviation {
        Deviation::Uniform { low, high } => {
            format!("{:+} to {:+}, uniform", rounded(low), rounded(high))
        }
        Deviation::Normal { sigma } => format!("sigma {}, normal", rounded(sigma)),
    };
    vec![one.key.clone(), rounded(one.nominal).to_string(), deviation]
}

/// To six digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

fn counted(counted: &Counted) -> String {
    let line = |p: &Probability| {
        let pairs = p.pairs.map_or("any".into(), |pairs| pairs.to_string());
        vec![
            pairs,
            p.draws.to_string(),
            percent(p.probability),
            format!("{} to {}", percent(p.low), percent(p.high)),
        ]
    };
    let probabilities: Vec<Vec<String>> = counted
        .probabilities
        .iter()
        .chain([&counted.any])
        .map(line)
        .collect();
    let settings: Vec<Vec<String>> = counted.settings.iter().map(effect).collect();
    format!(
        "{}\nwhat decides whether there are pairs: share of the variance that a setting explains alone\n{}{}",
        table(
            &["CNMP pairs", "draws", "probability %", "95 % by Wilson"],
            &probabilities
        ),
        table(
            &[
                "setting",
                "share %",
                "noise %",
                "direction",
                "pairs in % in its lower third",
                "middle",
                "upper"
            ],
            &settings
        ),
        couples(counted),
    )
}

fn couples(counted: &Counted) -> String {
    let rows: Vec<Vec<String>> = counted.couples.iter().map(couple).collect();
    let header = [
        "settings",
        "share %",
        "noise %",
        "pairs in % on one side of both medians",
        "on opposite sides",
    ];
    let strong = if rows.is_empty() {
        String::new()
    } else {
        format!("\n{}", table(&header, &rows))
    };
    format!(
        "alone they explain {} %, couples of them beyond that {} %; the rest takes three or more together\n{strong}",
        maybe(counted.share_alone),
        maybe(counted.share_of_couples)
    )
}

fn effect(effect: &Effect) -> Vec<String> {
    let shares = [effect.share, effect.share_noise].map(maybe);
    let thirds = effect.probability_by_third.map(maybe);
    [effect.key.clone()]
        .into_iter()
        .chain(shares)
        .chain([effect.direction.to_string()])
        .chain(thirds)
        .collect()
}

fn couple(couple: &Interaction) -> Vec<String> {
    let sides = [
        couple.probability_same_side,
        couple.probability_opposite_sides,
    ]
    .map(maybe);
    let shares = [couple.share, couple.share_noise].map(percent);
    [couple.keys.join(" x ")]
        .into_iter()
        .chain(shares)
        .chain(sides)
        .collect()
}

fn percent(ratio: f64) -> String {
    format!("{:.2}", 100.0 * ratio)
}

fn maybe(ratio: Option<f64>) -> String {
    ratio.map_or("-".into(), percent)
}

fn not_analysed(answer: &Answer) -> String {
    if answer.not_analysed.draws == 0 {
        return String::new();
    }
    let examples = answer
        .not_analysed
        .examples
        .iter()
        .map(|failure| format!("  draw {}: {}\n", failure.draw, failure.why));
    format!(
        "\n{} draws could not be analysed, and are in no probability:\n{}",
        answer.not_analysed.draws,
        examples.collect::<String>()
    )
}
