//! The figures and tables of the thesis, computed: one SVG a figure and one page of HTML.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bench::experiment::abandon_on_signal;
use clap::Parser;
use serde::Serialize;
use thesis_figures::{Comparison, FigureError, Made, Verdict, Workshop, make_all, selected};

/// Compute the figures and tables of the thesis: one SVG a figure and one HTML page.
#[derive(Clone, Debug, Parser)]
#[command(name = "thesis-figures", version)]
struct Args {
    /// Figures by their numbers, tables as table-2-2 [default: all]
    #[arg(long, value_name = "2-5,6-12,table-2-2", value_delimiter = ',')]
    only: Vec<String>,
    /// Folder for one SVG a figure and the page index.html
    #[arg(long, value_name = "FOLDER", default_value = "figures")]
    output: PathBuf,
    /// Print one JSON object on standard output, and nothing else there
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    page: String,
    figures: Vec<FigureJson>,
}

#[derive(Debug, Serialize)]
struct FigureJson {
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
        Err((code, message)) => {
            eprintln!("thesis-figures: {message}");
            ExitCode::from(code)
        }
    }
}

/// Exit code and message of a failure.
type Failure = (u8, String);

fn failure(error: FigureError) -> Failure {
    match error {
        FigureError::Unknown { .. } => (2, error.to_string()),
        other => (1, other.to_string()),
    }
}

fn run(args: &Args) -> Result<(), Failure> {
    let entries = selected(&args.only).map_err(failure)?;
    let runs = args.output.join(format!(".runs-{}", std::process::id()));
    let (folder, recordings) = (args.output.clone(), runs.clone());
    let work = move || {
        make_all(
            &entries,
            &folder,
            &Workshop::new(&recordings),
            &mut show_progress,
        )
    };
    let made = abandon_on_signal(work);
    // The recordings were only there to be measured; if some stay, they are hidden and named after the process.
    let _ = std::fs::remove_dir_all(&runs);
    let Some(made) = made.map_err(|error| (1, error.to_string()))? else {
        let folder = args.output.display();
        return Err((
            1,
            format!("stopped; the files in {folder} so far are complete"),
        ));
    };
    let report = report(&args.output, made.map_err(failure)?);
    let text = if args.json {
        serde_json::to_string_pretty(&report).map_err(|error| (1, error.to_string()))? + "\n"
    } else {
        text(&report)
    };
    let written = std::io::stdout().lock().write_all(text.as_bytes());
    written.map_err(|error| (1, format!("cannot write to standard output: {error}")))
}

fn show_progress(done: u64, all: u64) {
    use std::io::IsTerminal as _;
    if std::io::stderr().is_terminal() && done < all {
        eprintln!("figure {} of {all}", done + 1);
    }
}

fn report(folder: &Path, made: Vec<Made>) -> Report {
    let page = folder.join("index.html").display().to_string();
    Report {
        page,
        figures: made.into_iter().map(|made| figure(folder, made)).collect(),
    }
}

fn figure(folder: &Path, made: Made) -> FigureJson {
    let (reason, content, drawn) = match made.outcome {
        Err(reason) => (Some(reason), Default::default(), false),
        Ok((content, svg)) => (None, content, svg.is_some()),
    };
    FigureJson {
        number: made.entry.number,
        title: made.entry.title,
        svg: drawn.then(|| folder.join(made.entry.file()).display().to_string()),
        reason,
        drawn: content.drawn,
        settings: content.settings,
        assumed: content.assumed,
        compared: content.compared,
        commands: content.commands,
    }
}

fn text(report: &Report) -> String {
    let count = |figure: &FigureJson, verdict| {
        figure
            .compared
            .iter()
            .filter(|row| row.verdict == verdict)
            .count()
    };
    let line = |figure: &FigureJson| match figure.reason {
        Some(reason) => format!(
            "  {:<9}  {}: not computed: {reason}\n",
            figure.number, figure.title
        ),
        None => {
            let (agree, differ) = (
                count(figure, Verdict::Agrees),
                count(figure, Verdict::Differs),
            );
            let differ = if differ > 0 {
                format!(", {differ} differ")
            } else {
                String::new()
            };
            format!(
                "  {:<9}  {}: {agree} printed figures agree{differ}\n",
                figure.number, figure.title
            )
        }
    };
    format!(
        "{}{}\n",
        report.figures.iter().map(line).collect::<String>(),
        report.page
    )
}
