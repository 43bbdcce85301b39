//! The file that keeps the thermal state of the motor between runs and restarts of the program.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::moment::Moment;
use super::thermal::ThermalModel;
use crate::devices::can_amplifier;
use bench_base::atomic_file::write_durable;
use bench_base::checkpoint::checksum;
use bench_base::input_file::{self, MAX_SETTINGS_BYTES};
use bench_config::{AmplifierSettings, Config, MotorSettings};

/// A file of the motor that cannot be used. Nothing was moved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotorMemoryError {
    /// Neither variable of the environment is set.
    #[error(
        "no folder for the thermal state of the motor: neither XDG_STATE_HOME nor HOME is set; set interlock.heat_file to a file"
    )]
    NoFolder,
    /// The file cannot be written.
    #[error(
        "cannot write the thermal state of the motor to {path}: {why}; make the folder writable, or set interlock.heat_file to another file"
    )]
    Write {
        /// The file.
        path: String,
        /// The error of the operating system.
        why: String,
    },
}

/// From what the stored state is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotorOrigin {
    /// The interlocks at the end of a run.
    Run,
    /// A run that began and whose end is not stored: the motor is assumed at its limit.
    Running,
    /// The state was unknown: the motor was assumed at its limit.
    Assumed,
    /// The operator stated that the motor is cold.
    StatedCold,
}

/// The content of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    origin: MotorOrigin,
    thermal_a2: f64,
    /// When the entry was made.
    at: Moment,
    /// Seconds after `at` during which the state may still be `thermal_a2`: the length of a run that has begun.
    busy_s: f64,
    /// Identity of the amplifier; absent if it was not open.
    amplifier: Option<String>,
    force_constant_n_per_a: f64,
    thermal_time_constant_s: f64,
    /// CRC-32 of the entry with this text empty.
    #[serde(default)]
    checksum: String,
}

impl Entry {
    /// The text of the file.
    fn text_with_checksum(&self) -> serde_json::Result<String> {
        let complete = Entry {
            checksum: self.content_checksum()?,
            ..self.clone()
        };
        complete.text()
    }

    fn text(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// CRC-32 of the text without the checksum itself.
    fn content_checksum(&self) -> serde_json::Result<String> {
        let content = Entry {
            checksum: String::new(),
            ..self.clone()
        };
        Ok(checksum(&[&content.text()?]))
    }

    /// The entry in a text, if its checksum is right.
    fn verified(text: &str) -> Option<Entry> {
        let entry: Entry = serde_json::from_str(text).ok()?;
        let expected = entry.content_checksum().ok()?;
        (entry.checksum == expected).then_some(entry)
    }
}

/// The thermal state of the motor at a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorState {
    /// The state in A^2.
    pub thermal_a2: f64,
    /// Seconds from this moment during which the motor may not cool, because an interrupted run could still be in progress.
    pub busy_s: f64,
    /// How the state is known, and when it was stored; why it is not known otherwise.
    pub known: Result<(MotorOrigin, Moment), String>,
}

/// The file of one motor, which is known by its amplifier.
#[derive(Clone, Debug)]
pub struct MotorMemory {
    path: PathBuf,
    motor: MotorSettings,
}

impl MotorMemory {
    /// The file of the configured motor: `interlock.heat_file`, or a file in the state folder of the user with the address of the
    /// amplifier in its name.
    pub fn of(config: &Config) -> Result<MotorMemory, MotorMemoryError> {
        let path = match &config.interlock.heat_file {
            Some(file) => file.into(),
            None => state_folder()?.join(file_name(&config.amplifier)),
        };
        Ok(MotorMemory {
            path,
            motor: config.motor.clone(),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The thermal model of the motor.
    pub fn model(&self) -> ThermalModel {
        ThermalModel::of(&self.motor)
    }

    /// The state at `now`. The motor is assumed at its limit if the file is missing, damaged, of another motor or of another
    /// amplifier than `amplifier`, or if the clock was set back. `None`: the amplifier is not open.
    pub fn read(&self, amplifier: Option<&str>, now: &Moment) -> MotorState {
        self.entry(amplifier)
            .and_then(|entry| self.state(&entry, now))
            .unwrap_or_else(|why| MotorState {
                thermal_a2: self.model().limit_a2,
                busy_s: 0.0,
                known: Err(why),
            })
    }

    /// Stores the state at the end of a run.
    pub fn store(
        &self,
        thermal_a2: f64,
        amplifier: &str,
        now: &Moment,
    ) -> Result<(), MotorMemoryError> {
        let mut entry = self.new_entry(MotorOrigin::Run, thermal_a2, now);
        entry.amplifier = Some(amplifier.into());
        self.write(&entry)
    }

    /// Stores that a run of `duration_s` begins. Whoever reads this entry assumes the motor at its limit until the run must
    /// have ended.
    pub fn begin(
        &self,
        amplifier: &str,
        duration_s: f64,
        now: &Moment,
    ) -> Result<(), MotorMemoryError> {
        let mut entry = self.new_entry(MotorOrigin::Running, self.model().limit_a2, now);
        entry.amplifier = Some(amplifier.into());
        entry.busy_s = duration_s;
        self.write(&entry)
    }

    /// Stores that the motor is assumed at its limit from `now` on, so that it is known when it will have cooled.
    pub fn assume_hot(&self, amplifier: &str, now: &Moment) -> Result<(), MotorMemoryError> {
        let mut entry = self.new_entry(MotorOrigin::Assumed, self.model().limit_a2, now);
        entry.amplifier = Some(amplifier.into());
        self.write(&entry)
    }

    /// Stores the statement of the operator that the motor is cold. It holds for whichever amplifier is connected.
    pub fn state_cold(&self, now: &Moment) -> Result<(), MotorMemoryError> {
        self.write(&self.new_entry(MotorOrigin::StatedCold, 0.0, now))
    }

    fn new_entry(&self, origin: MotorOrigin, thermal_a2: f64, now: &Moment) -> Entry {
        Entry {
            origin,
            thermal_a2,
            at: now.clone(),
            busy_s: 0.0,
            amplifier: None,
            force_constant_n_per_a: self.motor.force_constant_n_per_a,
            thermal_time_constant_s: self.motor.thermal_time_constant_s,
            checksum: String::new(),
        }
    }

    fn write(&self, entry: &Entry) -> Result<(), MotorMemoryError> {
        let refused = |why: String| MotorMemoryError::Write {
            path: self.path.display().to_string(),
            why,
        };
        let text = entry
            .text_with_checksum()
            .map_err(|e| refused(e.to_string()))?;
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| refused(e.to_string()))?;
        }
        write_durable(&self.path, &text).map_err(|e| refused(e.to_string()))
    }

    /// The stored entry of this motor and amplifier, or why there is none.
    fn entry(&self, amplifier: Option<&str>) -> Result<Entry, String> {
        let path = self.path.display();
        let text = input_file::read_text(&self.path, MAX_SETTINGS_BYTES);
        let text = text.map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => format!("no earlier run is stored in {path}"),
            _ => format!("{path} cannot be read: {error}"),
        })?;
        let entry = Entry::verified(&text).ok_or_else(|| format!("{path} is damaged"))?;
        self.check(&entry, amplifier)?;
        Ok(entry)
    }

    fn check(&self, entry: &Entry, amplifier: Option<&str>) -> Result<(), String> {
        let path = self.path.display();
        let is_valid = |value: f64| value.is_finite() && value >= 0.0;
        if !is_valid(entry.thermal_a2) || !is_valid(entry.busy_s) {
            return Err(format!("{path} is damaged"));
        }
        let is_same_motor = entry.force_constant_n_per_a == self.motor.force_constant_n_per_a
            && entry.thermal_time_constant_s == self.motor.thermal_time_constant_s;
        if !is_same_motor {
            return Err(format!("{path} belongs to a motor with other settings"));
        }
        match (&entry.amplifier, amplifier) {
            (Some(stored), Some(open)) if stored != open => {
                Err(format!("{path} belongs to another amplifier, {stored}"))
            }
            (Some(_) | None, Some(_) | None) => Ok(()),
        }
    }

    fn state(&self, entry: &Entry, now: &Moment) -> Result<MotorState, String> {
        let elapsed_s = now.seconds_since(&entry.at).ok_or_else(|| {
            let path = self.path.display();
            format!("the clock was set back since {path} was written")
        })?;
        Ok(MotorState {
            thermal_a2: self
                .model()
                .after(entry.thermal_a2, elapsed_s - entry.busy_s),
            busy_s: (entry.busy_s - elapsed_s).max(0.0),
            known: Ok((entry.origin, entry.at.clone())),
        })
    }
}

/// `$XDG_STATE_HOME/bench`, or `~/.local/state/bench` [XDG Base Directory Specification].
fn state_folder() -> Result<PathBuf, MotorMemoryError> {
    let absolute = |name: &str| {
        let path = PathBuf::from(std::env::var_os(name)?);
        path.is_absolute().then_some(path)
    };
    let base = absolute("XDG_STATE_HOME")
        .or_else(|| absolute("HOME").map(|home| home.join(".local/state")));
    let base = base.ok_or(MotorMemoryError::NoFolder)?;
    Ok(base.join("bench"))
}

/// `motor-canopen-can0-1.json`: the address of the amplifier, because the motor is connected to it.
fn file_name(amplifier: &AmplifierSettings) -> String {
    let device = &amplifier.device;
    let address = can_amplifier(device).map(|can| can.address());
    let address = address.map_or(String::new(), |can| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.');
        let interface = can.interface.replace(|c: char| !is_plain(c), "_");
        format!("-{interface}-{}", can.node)
    });
    format!("motor-{}{address}.json", device.kind())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Source, load};

    const DRIVE: &str = "canopen 1";

    fn at(unix_s: f64) -> Moment {
        Moment {
            unix_s,
            boot: "boot".into(),
            since_boot_s: unix_s,
        }
    }

    /// A memory in a temporary folder, and its limit.
    fn memory() -> (tempfile::TempDir, MotorMemory, f64) {
        let folder = tempfile::tempdir().unwrap();
        let mut config = load(&Source::default()).unwrap();
        let file = folder.path().join("state").join("motor.json");
        config.interlock.heat_file = Some(file.display().to_string());
        let memory = MotorMemory::of(&config).unwrap();
        let limit_a2 = memory.model().limit_a2;
        (folder, memory, limit_a2)
    }

    fn why_unknown(memory: &MotorMemory, amplifier: &str, now: &Moment) -> String {
        let state = memory.read(Some(amplifier), now);
        assert_eq!(
            (state.thermal_a2, state.busy_s),
            (memory.model().limit_a2, 0.0),
            "unknown is hot"
        );
        state.known.expect_err("unknown")
    }

    #[test]
    fn state_decays_with_the_thermal_time_constant_across_restarts() {
        let (_folder, memory, _) = memory();
        memory.store(3.0, DRIVE, &at(1000.0)).unwrap();
        // tau of the profile `stage` is 10 s: after 10 s the state is 3/e.
        let state = memory.read(Some(DRIVE), &at(1010.0));
        assert!((state.thermal_a2 - 3.0 * (-1f64).exp()).abs() < 1e-12);
        assert_eq!(state.known, Ok((MotorOrigin::Run, at(1000.0))));
        assert_eq!(memory.read(None, &at(1010.0)), state);
    }

    #[test]
    fn missing_file_is_hot() {
        let (_folder, memory, _) = memory();
        assert!(why_unknown(&memory, DRIVE, &at(1.0)).contains("no earlier run"));
    }

    #[test]
    fn damaged_file_is_hot() {
        let (_folder, memory, _) = memory();
        memory.store(3.0, DRIVE, &at(1000.0)).unwrap();
        let good = std::fs::read_to_string(memory.path()).unwrap();
        let bad = [
            String::new(),
            good[..good.len() / 2].into(),
            good.replace("3.0", "-3.0"),
            good.replace("3.0", "2.0"),
            good.replace("3.0", "null"),
            good.replace("3.0", "1e999"),
            good.replace("thermal_a2", "thermal_a3"),
            good.replace("\"run\"", "\"ruin\""),
        ];
        for text in bad {
            std::fs::write(memory.path(), &text).unwrap();
            assert!(
                why_unknown(&memory, DRIVE, &at(2000.0)).contains("damaged"),
                "{text}"
            );
        }
        std::fs::write(memory.path(), [0xff, 0xfe]).unwrap();
        assert!(why_unknown(&memory, DRIVE, &at(2000.0)).contains("cannot be read"));
    }

    #[test]
    fn file_of_another_amplifier_or_motor_is_hot() {
        let (_folder, mut memory, _) = memory();
        memory.store(0.0, DRIVE, &at(1000.0)).unwrap();
        assert!(why_unknown(&memory, "canopen 2", &at(2000.0)).contains("another amplifier"));
        memory.motor.force_constant_n_per_a *= 2.0;
        assert!(why_unknown(&memory, DRIVE, &at(2000.0)).contains("other settings"));
    }

    #[test]
    fn clock_set_back_is_hot() {
        let (_folder, memory, _) = memory();
        memory.store(0.0, DRIVE, &at(1000.0)).unwrap();
        assert!(why_unknown(&memory, DRIVE, &at(999.0)).contains("set back"));
    }

    #[test]
    fn run_without_an_end_is_hot_until_it_must_have_ended() {
        let (_folder, memory, limit_a2) = memory();
        memory.begin(DRIVE, 30.0, &at(1000.0)).unwrap();
        let during = memory.read(Some(DRIVE), &at(1012.0));
        assert_eq!((during.thermal_a2, during.busy_s), (limit_a2, 18.0));
        let after = memory.read(Some(DRIVE), &at(1040.0));
        assert_eq!(after.busy_s, 0.0);
        assert!((after.thermal_a2 - limit_a2 * (-1f64).exp()).abs() < 1e-12);
        assert_eq!(after.known, Ok((MotorOrigin::Running, at(1000.0))));
    }

    #[test]
    fn assumed_state_cools_and_a_stated_cold_motor_is_cold_for_any_amplifier() {
        let (_folder, memory, limit_a2) = memory();
        memory.assume_hot(DRIVE, &at(1000.0)).unwrap();
        let later = memory.read(Some(DRIVE), &at(1020.0));
        assert!((later.thermal_a2 - limit_a2 * (-2f64).exp()).abs() < 1e-12);
        memory.state_cold(&at(1020.0)).unwrap();
        for amplifier in [None, Some(DRIVE), Some("canopen 2")] {
            assert_eq!(memory.read(amplifier, &at(1020.0)).thermal_a2, 0.0);
        }
    }

    #[test]
    fn file_that_cannot_be_written_is_named_with_its_setting() {
        let (folder, mut memory, _) = memory();
        std::fs::write(folder.path().join("file"), "").unwrap();
        memory.path = folder.path().join("file").join("motor.json");
        let error = memory.state_cold(&at(0.0)).unwrap_err().to_string();
        assert!(
            error.contains("file/motor.json") && error.contains("; make the folder writable"),
            "{error}"
        );
    }

    #[test]
    fn file_is_named_after_the_address_of_the_amplifier() {
        let lab = Source {
            config: Some("lab".into()),
            ..Source::default()
        };
        let config = load(&lab).unwrap();
        assert_eq!(file_name(&config.amplifier), "motor-canopen-can0-5.json");
    }
}
