//! `bench figures`: the figures and tables of the thesis, computed.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::options::{print_json, print_text};
use super::progress::Progress;
use super::{CliError, Outcome};
use crate::figures::{Comparison, FigureError, Made, Verdict, Workshop, make_all, selected};
use crate::session::unless_stopped;

/// Which figures, and where to.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// Figures by their numbers, tables as table-2-2 [default: all]
    #[arg(long, value_name = "2-5,6-12,table-2-2", value_delimiter = ',')]
    only: Vec<String>,
    /// Folder for one SVG a figure and the page index.html
    #[arg(long, value_name = "FOLDER", default_value = "figures")]
    output: PathBuf,
    /// One JSON object on standard output, nothing else there
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

impl From<FigureError> for CliError {
    fn from(error: FigureError) -> CliError {
        match error {
            FigureError::Unknown { .. } => CliError::Usage(error.to_string()),
            other => CliError::Failed(other.to_string()),
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let entries = selected(&args.only)?;
    let runs = args.output.join(format!(".runs-{}", std::process::id()));
    let (folder, recordings) = (args.output.clone(), runs.clone());
    let work = move || {
        let progress = Progress::new("figures");
        let made = make_all(
            &entries,
            &folder,
            &Workshop::new(&recordings),
            &mut |done, all| progress.show(done, all),
        );
        progress.close();
        made
    };
    let made = unless_stopped(work);
    // The recordings were only there to be measured; if some stay, they are hidden and named after the process.
    let _ = std::fs::remove_dir_all(&runs);
    let Some(made) = made.map_err(|error| CliError::Failed(error.to_string()))? else {
        return Err(CliError::Failed(format!(
            "stopped; the files in {} so far are whole",
            args.output.display()
        )));
    };
    let report = report(&args.output, made?);
    if args.json {
        print_json(&report)?
    } else {
        print_text(&text(&report))?
    }
    Ok(Outcome::Done)
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
