//! What is done of a campaign, in a folder: `campaign.json` with all settings, and below `points/` one file a point.
//!
//! Each file is written under another name, brought to the disk, and then renamed: it is there as a whole or not at all. A
//! file of a point that is torn, or of other settings (each carries the checksum of its `campaign.json`), does not count: its
//! point is measured again. While a process works on the folder it holds a lock on it, which the system takes back however
//! the process ends.

use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{CampaignError, Grid, Place, PutOn};
use crate::config::Config;
use crate::identify::verdict::Cnmp;
use crate::util::atomic_file::write_whole;
use crate::util::checkpoint::differences;

const FORMAT: &str = "bench campaign 1";
/// Differences that are told one by one.
const TOLD: usize = 12;

/// What a chirp said at one point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// What is said of CNMP zeros.
    pub cnmp: Cnmp,
    /// Why.
    pub why: String,
    /// Frequencies of the modes that were seen, in hertz, slowest first.
    pub modes_hz: Vec<f64>,
    /// Signs of their residues.
    pub signs: String,
    /// The zeros with damping in the band of the verdict, real and imaginary part in rad/s, those above the real axis.
    pub zeros_rad_s: Vec<[f64; 2]>,
    /// Equal for two runs whose loops saw and did the same, bit for bit.
    pub loop_digest: String,
    /// What a person put on for it, and how that was checked; none on the simulated stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub put_on: Option<PutOn>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Header<'a> {
    format: &'static str,
    version: &'static str,
    /// Whether devices measured it: of the same settings, the simulated stage says nothing of the real one.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    on_devices: bool,
    #[serde(flatten)]
    grid: &'a Grid,
    config: &'a Config,
}

/// A point's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    /// Checksum of the campaign's settings.
    campaign: String,
    place: Place,
    point: Point,
}

/// The folder of a campaign that is being worked on.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Checksum of the settings.
    campaign: String,
    /// Holds the lock.
    _lock: File,
}

/// A folder as it was found or made.
#[derive(Debug)]
pub struct Found {
    /// The folder, to add to.
    pub store: Store,
    /// The points that are done, in the order of the grid.
    pub done: Vec<(Place, Point)>,
    /// Files of points that do not count, and why.
    pub dropped: Vec<String>,
}

impl Store {
    /// Opens the folder of a campaign, or makes it. Refuses one of other settings, one that was simulated for one on devices
    /// and the other way round, one that another process works on, and one whose `campaign.json` is something else; leaves these
    /// as they are.
    pub fn open(
        folder: &Path,
        grid: &Grid,
        config: &Config,
        on_devices: bool,
    ) -> Result<Found, CampaignError> {
        let points = folder.join("points");
        std::fs::create_dir_all(&points).map_err(|e| failed("make", &points, &e))?;
        let lock = File::open(folder).map_err(|e| failed("open", folder, &e))?;
        locked(lock.try_lock(), folder)?;
        let header = json(&Header {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            on_devices,
            grid,
            config,
        })?;
        let path = folder.join("campaign.json");
        match std::fs::read_to_string(&path) {
            Ok(theirs) => same(&path, folder, &theirs, &header)?,
            Err(e) if e.kind() == ErrorKind::NotFound => write(&path, &header)?,
            Err(e) => return Err(failed("read", &path, &e)),
        }
        let store = Store {
            folder: folder.into(),
            campaign: checksum(&header),
            _lock: lock,
        };
        let (mut done, mut dropped) = (Vec::new(), Vec::new());
        for place in grid.places() {
            match store.read(place) {
                Ok(Some(point)) => done.push((place, point)),
                Ok(None) => {}
                Err(why) => dropped.push(format!("{} {why}", store.path(place).display())),
            }
        }
        Ok(Found {
            store,
            done,
            dropped,
        })
    }

    /// Writes the result of a point.
    pub fn add(&self, place: Place, point: &Point) -> Result<(), CampaignError> {
        let record = Record {
            campaign: self.campaign.clone(),
            place,
            point: point.clone(),
        };
        write(&self.path(place), &json(&record)?)
    }

    /// Where the run of a point is recorded.
    pub fn recordings(&self, place: Place) -> PathBuf {
        self.folder.join("recordings").join(name(place))
    }

    fn path(&self, place: Place) -> PathBuf {
        self.folder.join("points").join(name(place) + ".json")
    }

    /// The result of a point, if it is there; why it does not count.
    fn read(&self, place: Place) -> Result<Option<Point>, String> {
        let text = match std::fs::read_to_string(self.path(place)) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|e| format!("cannot be read ({e})"))?,
        };
        let record: Record =
            serde_json::from_str(&text).map_err(|e| format!("is torn or damaged ({e})"))?;
        match record.campaign == self.campaign && record.place == place {
            true => Ok(Some(record.point)),
            false => Err("is of another campaign or another point".into()),
        }
    }
}

fn name(place: Place) -> String {
    format!("{:04}-{:04}", place.row, place.column)
}

fn write(path: &Path, text: &str) -> Result<(), CampaignError> {
    write_whole(path, text).map_err(|e| failed("write", path, &e))
}

/// Refuses what is no campaign, or one of other settings.
fn same(path: &Path, folder: &Path, theirs: &str, ours: &str) -> Result<(), CampaignError> {
    let wrong = |why: String| CampaignError::NotACampaign {
        path: path.display().to_string(),
        why,
    };
    let found: Value =
        serde_json::from_str(theirs).map_err(|e| wrong(format!("it is not JSON: {e}")))?;
    match found.get("format").and_then(Value::as_str) {
        Some(FORMAT) => {}
        Some(other) => return Err(wrong(format!("its format is `{other}`, not `{FORMAT}`"))),
        None => return Err(wrong("it names no format".into())),
    }
    let mut differences = differences(theirs, ours);
    let more = differences.len().saturating_sub(TOLD);
    differences.truncate(TOLD);
    if more > 0 {
        differences.push(format!("  and {more} more"));
    }
    let folder = folder.display().to_string();
    if differences.is_empty() {
        Ok(())
    } else {
        Err(CampaignError::Other {
            folder,
            differences,
        })
    }
}

fn json(value: &impl Serialize) -> Result<String, CampaignError> {
    let wrong = |e: serde_json::Error| {
        CampaignError::Grid(format!("the settings cannot be written as JSON: {e}"))
    };
    Ok(serde_json::to_string_pretty(value).map_err(wrong)? + "\n")
}

fn checksum(text: &str) -> String {
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}

fn locked(locked: Result<(), TryLockError>, folder: &Path) -> Result<(), CampaignError> {
    match locked {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(CampaignError::File {
            what: "use",
            path: folder.display().to_string(),
            why: "another `bench` is at work on it".into(),
            remedy: "wait for it, or name another folder with --out",
        }),
        Err(TryLockError::Error(e)) => Err(failed("lock", folder, &e)),
    }
}

fn failed(what: &'static str, path: &Path, error: &std::io::Error) -> CampaignError {
    let remedy = match what {
        "write" => {
            "the points done so far are kept: make room and start it again with the same arguments"
        }
        _ => "check that the folder can be read and written, or name another with --out",
    };
    CampaignError::File {
        what,
        path: path.display().to_string(),
        why: error.to_string(),
        remedy,
    }
}
