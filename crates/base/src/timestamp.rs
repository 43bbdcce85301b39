//! Times of day as text, in UTC.

use std::time::{Duration, SystemTime};

/// The last second of the year 9999.
const LAST_S: u64 = 253_402_300_799;

/// RFC 3339 with seconds: `2026-11-21T16:21:09Z`.
///
/// A time before 1970 or after 9999, as of a clock that is not set, is the nearest one between.
pub fn seconds(time: SystemTime) -> String {
    humantime::format_rfc3339_seconds(displayable(time)).to_string()
}

/// The same for seconds since 1970.
pub fn seconds_since_1970(unix_s: f64) -> String {
    let since = Duration::try_from_secs_f64(unix_s.min(LAST_S as f64));
    seconds(SystemTime::UNIX_EPOCH + since.unwrap_or_default())
}

/// RFC 3339 with milliseconds, in the same range as [`seconds`].
pub fn milliseconds(time: SystemTime) -> String {
    humantime::format_rfc3339_millis(displayable(time)).to_string()
}

/// Nanoseconds since 1970; 0 for a clock before 1970.
pub fn unix_ns(time: SystemTime) -> u64 {
    let since = time.duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
    })
}

fn displayable(time: SystemTime) -> SystemTime {
    let first = SystemTime::UNIX_EPOCH;
    time.clamp(first, first + Duration::from_secs(LAST_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_before_1970_or_after_9999_has_a_text() {
        let epoch = SystemTime::UNIX_EPOCH;
        let second = Duration::from_secs(1);
        assert_eq!(seconds(epoch - second), "1970-01-01T00:00:00Z");
        assert_eq!(unix_ns(epoch - second), 0);
        for (unix_s, text) in [
            (2.9, "1970-01-01T00:00:02Z"),
            (-1.0, "1970-01-01T00:00:00Z"),
            (f64::NAN, "9999-12-31T23:59:59Z"),
            (1e300, "9999-12-31T23:59:59Z"),
        ] {
            assert_eq!(seconds_since_1970(unix_s), text);
        }
        assert_eq!(unix_ns(epoch + 2 * second), 2_000_000_000);
        assert_eq!(milliseconds(epoch - second), "1970-01-01T00:00:00.000Z");
        let last = Duration::from_secs(LAST_S);
        assert_eq!(seconds(epoch + last + second), "9999-12-31T23:59:59Z");
        // 10,000 days after 1970 are 27 years of 365 days, 7 leap days and 138 days: 19 May 1997.
        let days = Duration::from_secs(10_000 * 86_400);
        assert_eq!(seconds(epoch + days), "1997-05-19T00:00:00Z");
    }
}
