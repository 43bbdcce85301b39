//! Makes figures and writes them: whole files only, each under another name until it is whole.

use std::path::Path;

use super::{Content, Entry, FigureError, Make, Workshop, page};
use bench::report::sheet_svg;
use bench::util::atomic_file::write_whole;

/// A figure that was made, or why there is none.
#[derive(Clone, Debug)]
pub struct Made {
    /// Its number and title.
    pub entry: &'static Entry,
    /// What it shows, with its SVG where it has charts; the reason where it cannot be computed.
    pub outcome: Result<(Content, Option<String>), &'static str>,
}

/// Makes figures in their order, each written into `folder` as soon as it is made, and the page at last. `watch` is told
/// figures done and figures in all.
pub fn make_all(
    entries: &[&'static Entry],
    folder: &Path,
    workshop: &Workshop,
    watch: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Made>, FigureError> {
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, &e))?;
    let mut all = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        watch(index as u64, entries.len() as u64);
        all.push(made(entry, folder, workshop)?);
    }
    write(&folder.join("index.html"), &page(&all))?;
    watch(entries.len() as u64, entries.len() as u64);
    Ok(all)
}

fn made(entry: &'static Entry, folder: &Path, workshop: &Workshop) -> Result<Made, FigureError> {
    let make = match entry.make {
        Make::Not(reason) => {
            return Ok(Made {
                entry,
                outcome: Err(reason),
            });
        }
        Make::Draw(make) => make,
    };
    let content = make(workshop)?;
    for (name, text) in &content.files {
        write(&folder.join(name), text)?;
    }
    let svg = match content.rows.is_empty() {
        true => None,
        false => Some(sheet_svg(&entry.heading(), "", &content.rows)?),
    };
    if let Some(svg) = &svg {
        write(&folder.join(entry.file()), svg)?;
    }
    Ok(Made {
        entry,
        outcome: Ok((content, svg)),
    })
}

fn write(path: &Path, text: &str) -> Result<(), FigureError> {
    write_whole(path, text).map_err(|e| failed(path, &e))
}

fn failed(path: &Path, error: &std::io::Error) -> FigureError {
    FigureError::Write {
        path: path.display().to_string(),
        why: error.to_string(),
    }
}
