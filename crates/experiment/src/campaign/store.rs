//! The folder of a campaign: `campaign.json` with all settings, and one file for each point in `points/`.
//!
//! Each file is written completely or not at all. The file of a point that is damaged or belongs to other settings (each file
//! contains the checksum of its `campaign.json` and one of its own content) is ignored: the point is measured again. Files of
//! earlier versions have no checksum of their content; they are used and counted. A process that works on the folder
//! holds a lock on it. The operating system releases the lock when the process ends, in any way.

use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::{CampaignError, file_error};
use super::grid::{Grid, GridPoint};
use super::measure::Method;
use super::point::PointResult;
use bench_base::atomic_file::write_durable;
use bench_base::checkpoint::{FileAction, checksum, differences, lock};
use bench_base::input_file::{self, MAX_SETTINGS_BYTES};
use bench_base::locked::Locked;
use bench_config::Config;

const FORMAT: &str = "bench campaign 1";
/// Largest number of differences that are listed.
const MAX_DIFFERENCES: usize = 12;

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Header<'a> {
    format: &'static str,
    version: &'static str,
    /// Whether it was measured on devices. Results of the simulated stage are not valid for a real stage.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    on_devices: bool,
    /// Folders of earlier versions do not have it: one chirp at each point.
    #[serde(skip_serializing_if = "Method::is_single_chirp")]
    method: Method,
    #[serde(flatten)]
    grid: &'a Grid,
    config: &'a Config,
}

/// The file of a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    /// Checksum of the settings of the campaign.
    campaign: String,
    place: GridPoint,
    point: PointResult,
    /// Checksum of the record without this entry. Earlier versions wrote none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    checksum: Option<String>,
}

impl Record {
    /// CRC-32 of the text of the record without its checksum.
    fn content_checksum(&self) -> Result<String, CampaignError> {
        let content = Record {
            checksum: None,
            ..self.clone()
        };
        Ok(checksum(&[&json(&content)?]))
    }
}

/// The result in the file of a point.
enum StoredPoint {
    Verified(PointResult),
    /// Without a checksum.
    Unverified(PointResult),
}

/// The folder of a campaign in progress.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Checksum of the settings.
    campaign: String,
    /// Holds the lock.
    _lock: Locked,
}

/// A folder with the finished points that it holds.
#[derive(Debug)]
pub struct OpenedStore {
    /// The folder.
    pub store: Store,
    /// The finished points, in the order of the grid.
    pub done: Vec<(GridPoint, PointResult)>,
    /// Files of points that are ignored, with the reason.
    pub rejected: Vec<String>,
    /// Number of finished points whose files have no checksum.
    pub unverified: usize,
}

impl Store {
    /// Opens the folder of a campaign, or creates it. Refuses a folder with other settings, one of the simulated stage for a
    /// campaign on devices and the reverse, one that another process uses, and one whose `campaign.json` is not of a campaign.
    /// A refused folder is not changed.
    pub fn open(
        folder: &Path,
        grid: &Grid,
        config: &Config,
        on_devices: bool,
        method: Method,
    ) -> Result<OpenedStore, CampaignError> {
        let points = folder.join("points");
        std::fs::create_dir_all(&points)
            .map_err(|e| file_error(FileAction::Create, &points, &e))?;
        let held = File::open(folder).map_err(|e| file_error(FileAction::Open, folder, &e))?;
        let held = lock(held, folder)?;
        let header = json(&Header {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            on_devices,
            method,
            grid,
            config,
        })?;
        check_or_write_header(folder, &header)?;
        let store = Store {
            folder: folder.into(),
            campaign: checksum(&[&header]),
            _lock: held,
        };
        Ok(store.read_points(grid))
    }

    fn read_points(self, grid: &Grid) -> OpenedStore {
        let (mut done, mut rejected, mut unverified) = (Vec::new(), Vec::new(), 0);
        for point in grid.points() {
            match self.read(point) {
                Ok(Some(StoredPoint::Verified(result))) => done.push((point, result)),
                Ok(Some(StoredPoint::Unverified(result))) => {
                    unverified += 1;
                    done.push((point, result));
                }
                Ok(None) => {}
                Err(why) => rejected.push(format!("{} {why}", self.path(point).display())),
            }
        }
        OpenedStore {
            store: self,
            done,
            rejected,
            unverified,
        }
    }

    /// Writes the result of a point.
    pub fn add(&self, point: GridPoint, result: &PointResult) -> Result<(), CampaignError> {
        let mut record = Record {
            campaign: self.campaign.clone(),
            place: point,
            point: result.clone(),
            checksum: None,
        };
        record.checksum = Some(record.content_checksum()?);
        write(&self.path(point), &json(&record)?)
    }

    /// The folder of the campaign.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The folder for the recording of a point.
    pub fn recordings(&self, point: GridPoint) -> PathBuf {
        self.folder.join("recordings").join(name(point))
    }

    fn path(&self, point: GridPoint) -> PathBuf {
        self.folder.join("points").join(name(point) + ".json")
    }

    /// The result of a point, if it exists; or why its file is ignored.
    fn read(&self, point: GridPoint) -> Result<Option<StoredPoint>, String> {
        let text = match input_file::read_text(&self.path(point), MAX_SETTINGS_BYTES) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|e| format!("cannot be read ({e})"))?,
        };
        let record: Record =
            serde_json::from_str(&text).map_err(|e| format!("is torn or damaged ({e})"))?;
        if record.campaign != self.campaign || record.place != point {
            return Err("is of another campaign or another point".into());
        }
        let expected = record.content_checksum().map_err(|e| e.to_string())?;
        match record.checksum {
            None => Ok(Some(StoredPoint::Unverified(record.point))),
            Some(checksum) if checksum == expected => Ok(Some(StoredPoint::Verified(record.point))),
            Some(_) => Err("is torn or damaged (its checksum is wrong)".into()),
        }
    }
}

/// The name of the files of a point.
pub(super) fn name(point: GridPoint) -> String {
    format!("{:04}-{:04}", point.row, point.column)
}

fn write(path: &Path, text: &str) -> Result<(), CampaignError> {
    write_durable(path, text).map_err(|e| file_error(FileAction::Write, path, &e))
}

fn check_or_write_header(folder: &Path, header: &str) -> Result<(), CampaignError> {
    let path = folder.join("campaign.json");
    match input_file::read_text(&path, MAX_SETTINGS_BYTES) {
        Ok(stored) => check_header(&path, folder, &stored, header),
        Err(e) if e.kind() == ErrorKind::NotFound => write(&path, header),
        Err(e) => Err(file_error(FileAction::Read, &path, &e)),
    }
}

/// Refuses a file that does not belong to a campaign, or has other settings.
fn check_header(path: &Path, folder: &Path, stored: &str, ours: &str) -> Result<(), CampaignError> {
    check_format(stored).map_err(|why| CampaignError::NotACampaign {
        path: path.display().to_string(),
        why,
    })?;
    match differences(stored, ours) {
        differences if differences.is_empty() => Ok(()),
        differences => Err(CampaignError::OtherSettings {
            folder: folder.display().to_string(),
            differences: shortened(differences),
        }),
    }
}

/// The first [`MAX_DIFFERENCES`] lines, and the number of the others.
fn shortened(mut differences: Vec<String>) -> Vec<String> {
    let more = differences.len().saturating_sub(MAX_DIFFERENCES);
    differences.truncate(MAX_DIFFERENCES);
    if more > 0 {
        differences.push(format!("  and {more} more"));
    }
    differences
}

/// Refuses a text that is not the settings of a campaign.
pub(super) fn check_format(stored: &str) -> Result<(), String> {
    let value: Value = serde_json::from_str(stored).map_err(|e| format!("it is not JSON: {e}"))?;
    match value.get("format").and_then(Value::as_str) {
        Some(FORMAT) => Ok(()),
        Some(other) => Err(format!("its format is `{other}`, not `{FORMAT}`")),
        None => Err("it names no format".into()),
    }
}

fn json(value: &impl Serialize) -> Result<String, CampaignError> {
    let text = serde_json::to_string_pretty(value).map_err(|e| {
        CampaignError::Grid(format!(
            "the settings cannot be written as JSON: {e}; report this with the configuration"
        ))
    })?;
    Ok(text + "\n")
}
