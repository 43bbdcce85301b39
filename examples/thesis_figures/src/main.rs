//! Computes the figures and tables of the thesis: one SVG per figure and one page of HTML.

use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bench_experiment::abandon_on_signal;
use clap::Parser;
use serde::Serialize;
use thesis_figures::{
    Comparison, Content, Figure, FigureError, Outcome, Runs, Verdict, make_all, selected,
};

/// Compute the figures and tables of the thesis: one SVG a figure and one HTML page.
#[derive(Clone, Debug, Parser)]
#[command(name = "thesis-figures", version)]
struct Args {
    /// Numbers of figures, and of tables as table-2-2 [default: all]
    #[arg(long, value_name = "2-5,6-12,table-2-2", value_delimiter = ',')]
    only: Vec<String>,
    /// Folder for one SVG a figure and the page index.html
    #[arg(long, value_name = "FOLDER", default_value = "figures")]
    out: PathBuf,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    page: String,
    figures: Vec<FigureReport>,
}

#[derive(Debug, Serialize)]
struct FigureReport {
    number: &'static str,
    title: &'static str,
    svg: Option<String>,
    /// Why it is not computed; null where it is.
    reason: Option<&'static str>,
    drawn: String,
    settings: Vec<String>,
    assumed: Vec<String>,
    compared: Vec<Comparison>,
    commands: Vec<String>,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("thesis-figures: {error}");
            let usage = matches!(error, FigureError::Unknown { .. });
            ExitCode::from(if usage { 2 } else { 1 })
        }
    }
}

fn run(args: &Args) -> Result<(), FigureError> {
    let figures = make(args)?;
    let figures = figures
        .into_iter()
        .map(|figure| figure_report(&args.out, figure));
    let report = Report {
        page: args.out.join("index.html").display().to_string(),
        figures: figures.collect(),
    };
    let text = if args.json {
        serde_json::to_string_pretty(&report)
            .map_err(|error| FigureError::Output(error.to_string()))?
            + "\n"
    } else {
        text(&report)
    };
    let written = std::io::stdout().lock().write_all(text.as_bytes());
    written.map_err(|error| FigureError::Output(error.to_string()))
}

/// Makes the selected figures; the recordings of their runs are removed afterwards.
fn make(args: &Args) -> Result<Vec<Figure>, FigureError> {
    let entries = selected(&args.only)?;
    let runs = args.out.join(format!(".runs-{}", std::process::id()));
    let (folder, recordings) = (args.out.clone(), runs.clone());
    let work = move || {
        make_all(
            &entries,
            &folder,
            &Runs::new(&recordings),
            &mut show_progress,
        )
    };
    let made = abandon_on_signal(work);
    // If removal fails, the folder stays: it is hidden and named after the process.
    let _ = std::fs::remove_dir_all(&runs);
    let made = made.map_err(|error| FigureError::Output(error.to_string()))?;
    made.unwrap_or_else(|| {
        let folder = args.out.display();
        Err(FigureError::Output(format!(
            "stopped; the files in {folder} so far are complete"
        )))
    })
}

fn show_progress(done: u64, all: u64) {
    if std::io::stderr().is_terminal() && done < all {
        eprintln!("figure {} of {all}", done + 1);
    }
}

fn figure_report(folder: &Path, figure: Figure) -> FigureReport {
    let (reason, content, svg) = match figure.outcome {
        Outcome::NotComputed(reason) => (Some(reason), Content::default(), None),
        Outcome::Computed { content, svg } => (None, content, svg),
    };
    let file = folder.join(figure.entry.file()).display().to_string();
    FigureReport {
        number: figure.entry.number,
        title: figure.entry.title,
        svg: svg.map(|_| file),
        reason,
        drawn: content.drawn,
        settings: content.settings,
        assumed: content.assumed,
        compared: content.compared,
        commands: content.commands,
    }
}

fn text(report: &Report) -> String {
    let lines: String = report.figures.iter().map(line).collect();
    format!("{lines}{}\n", report.page)
}

fn line(figure: &FigureReport) -> String {
    let comparison = match figure.reason {
        Some(reason) => format!("not computed: {reason}"),
        None => agreement(&figure.compared),
    };
    format!("  {:<9}  {}: {comparison}\n", figure.number, figure.title)
}

/// `12 of 14 printed values agree`.
fn agreement(compared: &[Comparison]) -> String {
    let count = |verdict| compared.iter().filter(|row| row.verdict == verdict).count();
    let (agree, differ) = (count(Verdict::Agrees), count(Verdict::Differs));
    match agree + differ {
        0 => "no printed value to compare".into(),
        all => format!("{agree} of {all} printed values agree"),
    }
}
