//! Makes figures and writes them. Each file is complete or absent.

use std::path::Path;

use super::{Content, Entry, FigureError, Make, Runs, page};
use bench_base::atomic_file::write_atomic;
use bench_report::sheet_svg;

/// A figure that was made, or the reason why it is not computed.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Number and title.
    pub entry: &'static Entry,
    /// What was made.
    pub outcome: Outcome,
}

/// What was made of an entry.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The figure, with its SVG if it has charts.
    Computed {
        /// What it shows.
        content: Content,
        /// The picture.
        svg: Option<String>,
    },
    /// The reason why it cannot be computed.
    NotComputed(&'static str),
}

impl Figure {
    /// What the figure shows, if it is computed.
    pub fn content(&self) -> Option<&Content> {
        match &self.outcome {
            Outcome::Computed { content, .. } => Some(content),
            Outcome::NotComputed(_) => None,
        }
    }

    /// The picture, if the figure is computed and has charts.
    pub fn svg(&self) -> Option<&str> {
        match &self.outcome {
            Outcome::Computed { svg, .. } => svg.as_deref(),
            Outcome::NotComputed(_) => None,
        }
    }
}

/// Makes figures in their order. Each is written into `folder` when it is made, the page at the end. `progress` gets the
/// number of figures made and the number of all.
pub fn make_all(
    entries: &[&'static Entry],
    folder: &Path,
    runs: &Runs,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Figure>, FigureError> {
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, &e))?;
    let count = entries.len() as u64;
    let mut figures = Vec::new();
    for (index, entry) in (0..).zip(entries) {
        progress(index, count);
        let outcome = make(entry, folder, runs)?;
        figures.push(Figure { entry, outcome });
    }
    write(&folder.join("index.html"), &page(&figures))?;
    progress(count, count);
    Ok(figures)
}

fn make(entry: &Entry, folder: &Path, runs: &Runs) -> Result<Outcome, FigureError> {
    let draw = match entry.make {
        Make::Not(reason) => return Ok(Outcome::NotComputed(reason)),
        Make::Draw(draw) => draw,
    };
    let content = draw(runs)?;
    for (name, text) in &content.files {
        write(&folder.join(name), text)?;
    }
    let has_charts = !content.rows.is_empty();
    let svg = has_charts
        .then(|| sheet_svg(&entry.heading(), "", &content.rows))
        .transpose()?;
    if let Some(svg) = &svg {
        write(&folder.join(entry.file()), svg)?;
    }
    Ok(Outcome::Computed { content, svg })
}

fn write(path: &Path, text: &str) -> Result<(), FigureError> {
    write_atomic(path, text).map_err(|e| failed(path, &e))
}

fn failed(path: &Path, error: &std::io::Error) -> FigureError {
    FigureError::Write {
        path: path.display().to_string(),
        why: error.to_string(),
    }
}
