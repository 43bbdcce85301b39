//! A moment that can be compared across restarts of the program and of the machine.

use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use nix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

/// A moment by the wall clock and, within one boot of the machine, by a clock that nobody sets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moment {
    /// Seconds since 1970 by the wall clock.
    pub unix_s: f64,
    /// Identity of the boot.
    pub boot: String,
    /// Seconds since this boot, including sleep.
    pub since_boot_s: f64,
}

impl Moment {
    /// This moment.
    pub fn now() -> Moment {
        let boot = std::fs::read_to_string(Path::new("/proc/sys/kernel/random/boot_id"));
        let since_boot = clock_gettime(ClockId::CLOCK_BOOTTIME);
        Moment {
            unix_s: unix_s(SystemTime::now()),
            boot: boot.map_or(String::new(), |id| id.trim().to_string()),
            since_boot_s: since_boot.map_or(0.0, |time| Duration::from(time).as_secs_f64()),
        }
    }

    /// The moment `seconds` later.
    pub fn later(&self, seconds: f64) -> Moment {
        Moment {
            unix_s: self.unix_s + seconds,
            boot: self.boot.clone(),
            since_boot_s: self.since_boot_s + seconds,
        }
    }

    /// The seconds since `earlier`; `None` if the clock was set back. Within one boot it is the shorter time of both clocks, so
    /// that a wall clock that was set forward does not shorten a wait.
    pub fn seconds_since(&self, earlier: &Moment) -> Option<f64> {
        let by_wall_s = self.unix_s - earlier.unix_s;
        let elapsed_s = if !self.boot.is_empty() && self.boot == earlier.boot {
            by_wall_s.min(self.since_boot_s - earlier.since_boot_s)
        } else {
            by_wall_s
        };
        (elapsed_s >= 0.0).then_some(elapsed_s)
    }

    /// Date and time in UTC at the next full second, as in the names of recordings: `2026-11-22T14:03:20Z`.
    pub fn utc(&self) -> String {
        // The largest time that the format can write.
        let seconds = self.unix_s.ceil().clamp(0.0, 253_402_300_799.0);
        humantime::format_rfc3339_seconds(UNIX_EPOCH + Duration::from_secs(seconds as u64))
            .to_string()
    }

    /// The time of day in UTC: `14:03:20 UTC`.
    pub fn time_of_day(&self) -> String {
        let utc = self.utc();
        let time = utc.get(11..19).unwrap_or(&utc);
        format!("{time} UTC")
    }
}

fn unix_s(time: SystemTime) -> f64 {
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => since.as_secs_f64(),
        Err(before) => -before.duration().as_secs_f64(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(unix_s: f64, boot: &str, since_boot_s: f64) -> Moment {
        Moment {
            unix_s,
            boot: boot.into(),
            since_boot_s,
        }
    }

    #[test]
    fn rejects_clock_that_was_set_back() {
        let earlier = moment(1000.0, "a", 50.0);
        assert_eq!(moment(999.0, "a", 60.0).seconds_since(&earlier), None);
        assert_eq!(moment(999.0, "b", 60.0).seconds_since(&earlier), None);
    }

    #[test]
    fn clock_set_forward_within_a_boot_does_not_count() {
        let earlier = moment(1000.0, "a", 50.0);
        assert_eq!(
            moment(9e9, "a", 60.0).seconds_since(&earlier),
            Some(10.0),
            "same boot"
        );
        assert_eq!(
            moment(1100.0, "b", 1.0).seconds_since(&earlier),
            Some(100.0),
            "after a restart of the machine only the wall clock is known"
        );
    }

    #[test]
    fn time_of_day_is_in_utc() {
        // 2026-11-22T14:03:20Z is 1795356200 s after 1970 (date -u -d @1795356200).
        let at = moment(1_795_356_199.6, "", 0.0);
        assert_eq!(at.utc(), "2026-11-22T14:03:20Z");
        assert_eq!(at.time_of_day(), "14:03:20 UTC");
    }
}
