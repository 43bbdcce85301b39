//! The recordings in the folder of a campaign, for a design from them.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::CampaignError;
use super::grid::{Grid, GridPoint};
use super::measure::Method;
use super::store::{check_format, name};
use bench_base::input_file::{self, MAX_SETTINGS_BYTES};

/// Asymmetries that differ by less than this are equal: they were typed in percent.
const SAME_ASYMMETRY: f64 = 1e-6;

/// The recording of one point of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedPoint {
    /// Y1o/L.
    pub operating_point: f64,
    /// m2/m3 - 1 as intended.
    pub asymmetry: f64,
    /// The recording of its chirp.
    pub recording: PathBuf,
}

/// The part of `campaign.json` that tells how the points were measured.
#[derive(Deserialize)]
struct Measured {
    #[serde(default)]
    method: Method,
}

const SHORT_CHIRPS: &str = "has short chirps, which do not measure the response over the whole band; measure the campaign with --single-chirp \
    --keep-recordings in a new folder, or give recordings with --frf";

/// The recordings of all points of a campaign; with an asymmetry only those of its points.
///
/// # Errors
/// When the folder is not that of a campaign, or lacks the recording of a point.
pub fn recorded_points(
    folder: &Path,
    asymmetry: Option<f64>,
) -> Result<Vec<RecordedPoint>, CampaignError> {
    let unusable = |why: String| CampaignError::Unusable {
        folder: folder.display().to_string(),
        why,
    };
    let grid = grid(folder).map_err(unusable)?;
    let is_chosen = |point: &GridPoint| {
        let there = grid.asymmetries.get(point.column);
        asymmetry
            .is_none_or(|wanted| there.is_some_and(|there| (there - wanted).abs() < SAME_ASYMMETRY))
    };
    let points: Vec<GridPoint> = grid.points().filter(is_chosen).collect();
    let found = points
        .iter()
        .map(|point| (*point, recording(folder, *point)));
    let (found, missing): (Vec<_>, Vec<_>) = found.partition(|(_, path)| path.is_some());
    let count = points.len();
    match (found.len(), missing.len()) {
        (0, 0) => Err(unusable(format!(
            "has no point with the asymmetry of --asymmetry; its asymmetries are {}",
            percents(&grid.asymmetries)
        ))),
        (0, _) => Err(unusable(
            "has no recordings of its points: `bench campaign` keeps them only with --keep-recordings; measure the campaign with --single-chirp --keep-recordings in a new folder".into(),
        )),
        (_, 0) => Ok(with_values(&grid, found)),
        (found, _) => Err(unusable(format!(
            "has recordings of only {found} of {count} points; finish the campaign with the same command and --keep-recordings, or give the recordings of the others with --frf"
        ))),
    }
}

fn with_values(grid: &Grid, found: Vec<(GridPoint, Option<PathBuf>)>) -> Vec<RecordedPoint> {
    let recorded = found.into_iter().filter_map(|(point, path)| {
        Some(RecordedPoint {
            operating_point: *grid.operating_points.get(point.row)?,
            asymmetry: *grid.asymmetries.get(point.column)?,
            recording: path?,
        })
    });
    recorded.collect()
}

/// The grid in `campaign.json`.
fn grid(folder: &Path) -> Result<Grid, String> {
    let remedy = "give the folder of `bench campaign --single-chirp --keep-recordings --out DIR`, or recordings with --frf";
    let path = folder.join("campaign.json");
    let text = input_file::read_text(&path, MAX_SETTINGS_BYTES)
        .map_err(|e| format!("is not the folder of a campaign (campaign.json: {e}); {remedy}"))?;
    check_format(&text).map_err(|why| {
        format!("is not the folder of a campaign (campaign.json: {why}); {remedy}")
    })?;
    let damaged = |e| format!("has a damaged campaign.json ({e}); {remedy}");
    let grid: Grid = serde_json::from_str(&text).map_err(damaged)?;
    let measured: Measured = serde_json::from_str(&text).map_err(damaged)?;
    if measured.method == Method::UntilDecided {
        return Err(SHORT_CHIRPS.into());
    }
    if grid.operating_points.is_empty() || grid.asymmetries.is_empty() {
        Err(format!("has a campaign without points; {remedy}"))
    } else {
        Ok(grid)
    }
}

/// The recording of a point: the last one by name, which begins with its time.
fn recording(folder: &Path, point: GridPoint) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder.join("recordings").join(name(point))).ok()?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let recordings = paths.filter(|path| path.extension().is_some_and(|end| end == "mcap"));
    recordings.max()
}

fn percents(asymmetries: &[f64]) -> String {
    let texts = asymmetries
        .iter()
        .map(|ratio| format!("{:+} %", (ratio * 1e6).round() / 1e4));
    let texts: Vec<String> = texts.collect();
    texts.join(", ")
}
