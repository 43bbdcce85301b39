//! The times of samples: their unit, and whether they are regular.
//!
//! ```text
//! d_k = t_k - (t + k T)            deviation from the regular times of least squares
//! |d_k| < 0.75 last digits of t_k  regular times, rounded: the period is T, which is more exact than that of both ends
//! larger                           irregular times, which are true: the samples are resampled
//! a step of 1.5 median steps       a gap, refused, unless the next steps make up for it (jitter)
//! ```

use std::fmt;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::error::{DataError, Place};
use super::stamp::{Stamp, digits};

/// Largest deviation of a step from the median step, as a ratio.
const MAX_IRREGULARITY: f64 = 0.5;
/// Largest deviation of a step from the usual one by jitter, as a ratio: neighbouring instants deviate by half of it each.
const MAX_JITTER: f64 = 0.8;
/// Number of times before and after a step whose means show whether a sample is missing.
const JITTER_SAMPLES: usize = 8;
/// Largest deviation of a rounded time from the line through all of them, as a ratio of its last digit: half a digit, and some more
/// because the line has an error as well.
const ROUNDED: f64 = 0.75;
/// A deviation from regular times of this ratio of the period changes nothing: at half the rate it turns the phase by 0.02 degrees.
const NEGLIGIBLE: f64 = 1e-4;
/// Steps outside of this range are probably not in seconds, if the file does not say so.
const STEPS_IN_SECONDS: std::ops::Range<f64> = 1e-7..0.5;
/// The line through rounded times is less accurate than the finest of them: part of the coarsest digit that counts as its error. That of
/// 64 times is 2 x 0.29/8 digits at the ends.
const LINE_ERROR: f64 = 0.1;

/// Steps that differ by less than this ratio are equal, apart from the few that rounding or a clock changes.
const EQUAL_STEPS: f64 = 0.2;
const MOST: f64 = 0.8;

/// A unit of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum TimeUnit {
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// Minutes.
    Min,
    /// Hours.
    H,
    /// Days.
    D,
}

impl TimeUnit {
    /// Length in seconds.
    pub fn seconds(self) -> f64 {
        match self {
            TimeUnit::S => 1.0,
            TimeUnit::Ms => 1e-3,
            TimeUnit::Us => 1e-6,
            TimeUnit::Ns => 1e-9,
            TimeUnit::Min => 60.0,
            TimeUnit::H => 3600.0,
            TimeUnit::D => 86_400.0,
        }
    }

    /// The unit that a name or a cell of units states: `time_ms`, `Time [ms]`, `t (us)`, `ns`.
    ///
    /// ```
    /// use bench_external::TimeUnit;
    /// assert_eq!(TimeUnit::stated_in("timestamp_ns"), Some(TimeUnit::Ns));
    /// assert_eq!(TimeUnit::stated_in("Time [s, rel.]"), Some(TimeUnit::S));
    /// assert_eq!(TimeUnit::stated_in("time"), None);
    /// ```
    pub fn stated_in(text: &str) -> Option<TimeUnit> {
        let words = text.split(|c: char| !c.is_alphanumeric());
        words.rev().find_map(TimeUnit::of_word)
    }

    /// The unit that a file states beside times. `none` and a text without letters state none.
    ///
    /// # Errors
    /// The text of a unit that is none of time, as `rev`.
    pub(crate) fn beside(text: &str) -> Result<Option<TimeUnit>, OtherUnit> {
        match TimeUnit::stated_in(text) {
            None if states_a_unit(text) => Err(OtherUnit(text.trim().into())),
            unit => Ok(unit),
        }
    }

    /// Whether a text is a unit of time.
    pub(crate) fn is_one(text: &str) -> bool {
        TimeUnit::of_word(text).is_some()
    }

    fn of_word(word: &str) -> Option<TimeUnit> {
        match word.to_lowercase().as_str() {
            "s" | "sec" | "secs" | "second" | "seconds" => Some(TimeUnit::S),
            "ms" | "msec" | "millisecond" | "milliseconds" => Some(TimeUnit::Ms),
            "us" | "µs" | "μs" | "usec" | "microsecond" | "microseconds" => Some(TimeUnit::Us),
            "ns" | "nsec" | "nanosecond" | "nanoseconds" => Some(TimeUnit::Ns),
            "min" | "mins" | "minute" | "minutes" => Some(TimeUnit::Min),
            "h" | "hr" | "hrs" | "hour" | "hours" => Some(TimeUnit::H),
            "d" | "day" | "days" => Some(TimeUnit::D),
            _ => None,
        }
    }
}

/// Whether a text has letters, apart from those of `none`.
fn states_a_unit(text: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_alphabetic());
    words.any(|word| !word.is_empty() && !word.eq_ignore_ascii_case("none"))
}

/// A unit that is none of time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OtherUnit(String);

impl OtherUnit {
    /// The error of a column of times that the file states in this unit.
    pub fn in_file(self, path: &Path, column: &str) -> DataError {
        DataError::OtherTimeUnit {
            path: path.to_owned(),
            column: column.into(),
            unit: self.0,
        }
    }
}

/// What the times of a record are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum TimeBase {
    /// The rate was given.
    Given,
    /// Regular times, apart from their rounding.
    Regular,
    /// Irregular times, at which the samples were measured; the signals are resampled at regular ones.
    Resampled {
        /// Largest deviation from regular times in seconds.
        largest_deviation_s: f64,
    },
}

impl fmt::Display for TimeBase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TimeBase::Given => f.write_str("the given rate"),
            TimeBase::Regular => f.write_str("regular times"),
            TimeBase::Resampled {
                largest_deviation_s,
            } => write!(
                f,
                "the times deviate by up to {} from regular ones, and are taken as true: the columns are resampled",
                duration(*largest_deviation_s)
            ),
        }
    }
}

/// A duration with three digits in a unit that suits it.
fn duration(seconds: f64) -> String {
    match seconds {
        1.0.. => format!("{seconds:.3} s"),
        1e-3.. => format!("{:.3} ms", 1e3 * seconds),
        1e-6.. => format!("{:.3} us", 1e6 * seconds),
        _ => format!("{:.3} ns", 1e9 * seconds),
    }
}

/// Why times are refused. Places are indices of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TimeDefect {
    TooFew,
    /// The unit is not stated, and the steps are long or short for seconds.
    NoUnit {
        step: f64,
    },
    NotRising {
        at: usize,
        time_s: f64,
        previous_s: f64,
    },
    Gap {
        at: usize,
        step_s: f64,
        usual_s: f64,
    },
}

impl TimeDefect {
    /// The error of a column of times with the places of its numbers.
    pub fn in_file(self, path: &Path, column: &str, places: &[Place]) -> DataError {
        let path = path.to_owned();
        match self {
            TimeDefect::TooFew => DataError::TooFewLines {
                path,
                lines: places.len(),
            },
            TimeDefect::NoUnit { step } => DataError::NoTimeUnit {
                path,
                column: column.into(),
                step,
            },
            TimeDefect::NotRising {
                at,
                time_s,
                previous_s,
            } => DataError::NotRising {
                path,
                place: places[at],
                column: column.into(),
                time_s,
                previous_s,
            },
            TimeDefect::Gap {
                at,
                step_s,
                usual_s,
            } => DataError::Irregular {
                path,
                place: places[at],
                step_s,
                usual_s,
            },
        }
    }
}

/// Times in seconds from the first one.
#[derive(Debug)]
pub(crate) struct Times {
    pub time_s: Vec<f64>,
    /// Of regular times that of least squares, of others the mean one.
    pub period_s: f64,
    /// 1/`period_s`, without the rounding of the times: the number of fewest digits that they allow.
    pub rate_hz: f64,
    /// Whether they are seconds only because no unit is stated.
    pub seconds_assumed: bool,
    pub base: TimeBase,
}

/// Relative rounding errors of a period of least squares: 1e5 sums in double precision leave 1e-14 to 1e-13.
const ROUNDING_OF_SUMS: f64 = 1e-13;

/// The number of fewest digits within a relative tolerance of a value.
fn roundest(value: f64, tolerance: f64) -> f64 {
    let rounded = (0..17).filter_map(|digits| format!("{value:.digits$e}").parse::<f64>().ok());
    let mut near = rounded.filter(|number| (number - value).abs() <= tolerance * value.abs());
    near.next().unwrap_or(value)
}

impl Times {
    /// The times of some stamps, in a unit if it is known.
    pub fn new(stamps: &[Stamp], unit: Option<TimeUnit>) -> Result<Times, TimeDefect> {
        let [first, _, ..] = stamps else {
            return Err(TimeDefect::TooFew);
        };
        let unit = if first.is_date() {
            Some(TimeUnit::S)
        } else {
            unit
        };
        let unit_s = unit.map_or(1.0, TimeUnit::seconds);
        let stamps_s = stamps.iter().map(|stamp| unit_s * stamp.since(first));
        let time_s: Vec<f64> = stamps_s.collect();
        check_rising(&time_s)?;
        let line = Line::through(&time_s);
        let seconds_assumed = unit.is_none();
        if seconds_assumed && !STEPS_IN_SECONDS.contains(&line.period_s) {
            let step = line.period_s;
            return Err(TimeDefect::NoUnit { step });
        }
        let deviations_s = line.deviations_s(&time_s);
        let largest_s = deviations_s.iter().copied().fold(0.0, f64::max);
        let digits_s: Vec<f64> = digits(stamps).iter().map(|digit| unit_s * digit).collect();
        let coarsest_s = digits_s.iter().copied().fold(0.0, f64::max);
        let allowed_s = |digit_s: f64| {
            let rounding_s = ROUNDED * digit_s + LINE_ERROR * coarsest_s;
            rounding_s.max(NEGLIGIBLE * line.period_s)
        };
        let mut rounded = deviations_s.iter().zip(&digits_s);
        let span_s = time_s[time_s.len() - 1];
        if rounded.all(|(deviation_s, digit_s)| *deviation_s <= allowed_s(*digit_s)) {
            let tolerance = largest_s / span_s + ROUNDING_OF_SUMS;
            return Ok(Times {
                time_s,
                period_s: line.period_s,
                rate_hz: roundest(1.0 / line.period_s, tolerance),
                seconds_assumed,
                base: TimeBase::Regular,
            });
        }
        check_gaps(&time_s, coarsest_s)?;
        let mean_s = span_s / (time_s.len() - 1) as f64;
        Ok(Times {
            time_s,
            period_s: mean_s,
            rate_hz: roundest(1.0 / mean_s, ROUNDING_OF_SUMS),
            seconds_assumed,
            base: TimeBase::Resampled {
                largest_deviation_s: largest_s,
            },
        })
    }
}

/// The line of least squares through times.
struct Line {
    start_s: f64,
    period_s: f64,
}

impl Line {
    fn through(time_s: &[f64]) -> Line {
        let centre = (time_s.len() - 1) as f64 / 2.0;
        let mean_s = time_s.iter().sum::<f64>() / time_s.len() as f64;
        let places = || (0..time_s.len()).map(|k| k as f64 - centre);
        let squares: f64 = places().map(|place| place * place).sum();
        let products: f64 = places()
            .zip(time_s)
            .map(|(place, t)| place * (t - mean_s))
            .sum();
        let period_s = products / squares;
        Line {
            start_s: mean_s - period_s * centre,
            period_s,
        }
    }

    fn deviations_s(&self, time_s: &[f64]) -> Vec<f64> {
        let regular = (0..time_s.len()).map(|k| self.start_s + k as f64 * self.period_s);
        let deviations = regular.zip(time_s).map(|(regular, t)| (t - regular).abs());
        deviations.collect()
    }
}

/// Refuses the step that differs most from the others, if it differs by more than half of them. Steps that rounding makes unequal, as 0
/// or a digit, are compared with their mean, and may differ by a digit in addition.
fn check_gaps(time_s: &[f64], digit_s: f64) -> Result<(), TimeDefect> {
    let steps_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let median_s = median(&steps_s);
    let is_equal = |step_s: &&f64| (**step_s - median_s).abs() < EQUAL_STEPS * median_s;
    let equal = steps_s.iter().filter(is_equal).count();
    let are_equal = equal as f64 > MOST * steps_s.len() as f64;
    let (usual_s, rounding_s) = if are_equal || digit_s < EQUAL_STEPS * median_s {
        (median_s, 0.0)
    } else {
        let span_s = time_s[time_s.len() - 1] - time_s[0];
        (span_s / steps_s.len() as f64, digit_s)
    };
    let limit_s = MAX_IRREGULARITY * usual_s + rounding_s;
    let difference_s = |k: &usize| (steps_s[*k] - usual_s).abs();
    let mean_step_s = step_of_several(time_s).unwrap_or(usual_s);
    let shift_s = |k: &usize| lasting_shift_s(time_s, *k, mean_step_s).abs();
    let is_jitter = |k: &usize| {
        difference_s(k) < MAX_JITTER * usual_s && shift_s(k) < MAX_IRREGULARITY * usual_s
    };
    let gaps = (0..steps_s.len()).filter(|k| difference_s(k) > limit_s && !is_jitter(k));
    // Around a gap, other steps with jitter have a part of its shift.
    let widest = gaps.max_by(|a, b| shift_s(a).total_cmp(&shift_s(b)));
    match widest {
        Some(k) if steps_s[k] <= 0.0 => Err(not_rising(time_s, k)),
        Some(k) => Err(TimeDefect::Gap {
            at: k + 1,
            step_s: steps_s[k],
            usual_s,
        }),
        None => Ok(()),
    }
}

/// The median step over several samples each, which jitter hardly changes; `None` of fewer.
fn step_of_several(time_s: &[f64]) -> Option<f64> {
    let spans = time_s.windows(JITTER_SAMPLES + 1);
    let steps = spans.map(|times| (times[JITTER_SAMPLES] - times[0]) / JITTER_SAMPLES as f64);
    let steps_s: Vec<f64> = steps.collect();
    (!steps_s.is_empty()).then(|| median(&steps_s))
}

/// By how much the mean times before and after the step from time `k` are farther apart than regular ones: a whole step for a missing
/// sample, and nearly nothing for jitter, for which the next steps make up.
fn lasting_shift_s(time_s: &[f64], k: usize, usual_s: f64) -> f64 {
    let before = &time_s[(k + 1).saturating_sub(JITTER_SAMPLES)..=k];
    let after = &time_s[k + 1..time_s.len().min(k + 1 + JITTER_SAMPLES)];
    let mean_s = |times: &[f64]| times.iter().sum::<f64>() / times.len() as f64;
    let steps = 0.5 * (before.len() + after.len()) as f64;
    mean_s(after) - mean_s(before) - steps * usual_s
}

fn not_rising(time_s: &[f64], k: usize) -> TimeDefect {
    TimeDefect::NotRising {
        at: k + 1,
        time_s: time_s[k + 1],
        previous_s: time_s[k],
    }
}

/// A time before the one of the line above is an error; equal ones may be rounded, but not all of them.
fn check_rising(time_s: &[f64]) -> Result<(), TimeDefect> {
    let constant = time_s.iter().all(|t| *t == time_s[0]);
    let is_wrong = |pair: &[f64]| {
        let rises = pair[1] >= pair[0];
        constant || !rises
    };
    let falls = time_s.windows(2).position(is_wrong);
    match falls {
        Some(k) => Err(not_rising(time_s, k)),
        None => Ok(()),
    }
}

/// The median of at least one value.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(cells: &[String], unit: Option<TimeUnit>) -> Result<Times, TimeDefect> {
        let stamps: Vec<Stamp> = cells
            .iter()
            .map(|cell| Stamp::parse(cell, false).unwrap_or_else(|| panic!("{cell}")))
            .collect();
        Times::new(&stamps, unit)
    }

    /// The period of samples at 500 Hz whose times a function writes.
    fn period_s(unit: Option<TimeUnit>, write: impl Fn(usize) -> String) -> f64 {
        let cells: Vec<String> = (0..100).map(write).collect();
        let times = times(&cells, unit).unwrap_or_else(|defect| panic!("{defect:?}"));
        assert_eq!(times.base, TimeBase::Regular, "{}", cells[1]);
        times.period_s
    }

    #[test]
    fn times_of_every_unit_and_form_are_exact() {
        let (s, ms, ns) = (Some(TimeUnit::S), Some(TimeUnit::Ms), Some(TimeUnit::Ns));
        for found in [
            period_s(s, |k| format!("{}", k as f64 * 0.002)),
            period_s(None, |k| format!("{}", k as f64 * 0.002)),
            period_s(s, |k| format!("-{}", 10.0 - k as f64 * 0.002)),
            period_s(ms, |k| format!("{}", 2 * k)),
            // Doubles of this size are 256 ns apart.
            period_s(ns, |k| {
                format!("{}", 1_700_000_000_000_000_000_u64 + 2_000_000 * k as u64)
            }),
            period_s(s, |k| format!("1700000000.{:09}", 2_000_000 * k)),
            period_s(s, |k| format!("{:e}", k as f64 * 0.002)),
            period_s(None, |k| format!("2026-11-26T12:40:48.{:03}Z", 2 * k)),
            period_s(None, |k| format!("2026-11-26 12:40:48.{:06}", 2000 * k)),
            period_s(None, |k| format!("2026-11-26T12:40:48.{:03}+01:00", 2 * k)),
        ] {
            assert!((found / 0.002 - 1.0).abs() < 1e-9, "{found}");
        }
    }

    #[test]
    fn rounded_times_are_regular() {
        // 1.5 kHz in milliseconds: steps of 0 and 1 ms.
        let cells: Vec<String> = (0..1000)
            .map(|k| format!("{:.3}", k as f64 / 1500.0))
            .collect();
        let times = times(&cells, Some(TimeUnit::S)).unwrap_or_else(|defect| panic!("{defect:?}"));
        assert_eq!(times.base, TimeBase::Regular);
        // The slope through n times with uniform errors of one digit q: q/sqrt(12) sqrt(12/n^3), 3 sigma.
        let limit = 3.0 * 1e-3 * 1500.0 / 1000_f64.powf(1.5);
        assert!(
            (times.period_s * 1500.0 - 1.0).abs() < limit,
            "{}",
            times.period_s
        );
    }

    #[test]
    fn drift_and_jitter_are_true_times() {
        let drift = |k: usize| 0.002 * k as f64 + 1e-8 * (k * k) as f64;
        let cells: Vec<String> = (0..1000).map(|k| format!("{:.9}", drift(k))).collect();
        let times = times(&cells, Some(TimeUnit::S)).unwrap_or_else(|defect| panic!("{defect:?}"));
        let TimeBase::Resampled {
            largest_deviation_s,
        } = times.base
        else {
            panic!("{:?}", times.base);
        };
        // c k^2 deviates most from its line of least squares at the ends: c n^2/6, with n = 999.
        assert!(
            (largest_deviation_s / 1.6634e-3 - 1.0).abs() < 3e-3,
            "{largest_deviation_s}"
        );
    }

    /// Instants that deviate by up to 0.35 steps; the same with a sample left out, or one too many.
    #[test]
    fn jitter_is_no_gap_and_a_missing_sample_in_it_is_one() {
        let instant = |k: usize| 1e-3 * (k as f64 + 0.35 * (7.0 * (k * k) as f64).sin());
        let instants: Vec<f64> = (0..500).map(instant).collect();
        let steps = instants.windows(2).map(|pair| pair[1] - pair[0]);
        let longest_s = steps.fold(0.0, f64::max);
        assert!((1.6e-3..1.75e-3).contains(&longest_s), "{longest_s}");
        let unit = Some(TimeUnit::S);
        let cells = |times: &[f64]| times.iter().map(|t| format!("{t:.9}")).collect::<Vec<_>>();
        assert!(times(&cells(&instants), unit).is_ok());
        // Jitter may make the step over a missing sample as short as others.
        let is_long = |place: &usize| instants[place + 1] - instants[place - 1] > 1.6e-3;
        for place in (10..490).step_by(7).filter(is_long) {
            let mut missing = instants.clone();
            missing.remove(place);
            let found = times(&cells(&missing), unit).err();
            assert!(
                matches!(found, Some(TimeDefect::Gap { at, .. }) if at.abs_diff(place) <= 2),
                "{place}: {found:?}"
            );
        }
    }

    #[test]
    fn gaps_and_times_that_fall_are_refused_with_their_place() {
        let cells = |times: &[f64]| times.iter().map(|t| format!("{t}")).collect::<Vec<_>>();
        let unit = Some(TimeUnit::S);
        let gap = times(&cells(&[0.0, 0.1, 0.2, 0.45, 0.55]), unit).err();
        assert!(
            matches!(gap, Some(TimeDefect::Gap { at: 3, .. })),
            "{gap:?}"
        );
        let falls = times(&cells(&[0.0, 0.1, 0.05]), unit).err();
        assert!(
            matches!(falls, Some(TimeDefect::NotRising { at: 2, .. })),
            "{falls:?}"
        );
        let equal = times(&cells(&[1.0, 1.0, 1.0]), unit).err();
        assert!(
            matches!(equal, Some(TimeDefect::NotRising { .. })),
            "{equal:?}"
        );
        assert_eq!(times(&cells(&[1.0]), unit).err(), Some(TimeDefect::TooFew));
    }

    #[test]
    fn long_steps_without_a_unit_are_refused() {
        let cells: Vec<String> = (0..10).map(|k| format!("{}", 2 * k)).collect();
        assert_eq!(
            times(&cells, None).err(),
            Some(TimeDefect::NoUnit { step: 2.0 })
        );
        let times = times(&cells, Some(TimeUnit::S)).unwrap_or_else(|defect| panic!("{defect:?}"));
        assert_eq!(times.period_s, 2.0);
    }

    #[test]
    fn unit_beside_times_is_none_or_one_of_time() {
        for (text, unit) in [
            ("[ms]", Some(TimeUnit::Ms)),
            ("", None),
            ("-", None),
            ("[none]", None),
        ] {
            assert_eq!(TimeUnit::beside(text), Ok(unit), "{text}");
        }
        for text in ["rev", "[Hz]", "samples"] {
            assert_eq!(TimeUnit::beside(text), Err(OtherUnit(text.into())));
        }
    }

    #[test]
    fn units_are_read_from_names() {
        for (name, unit) in [
            ("time_ms", Some(TimeUnit::Ms)),
            ("t (us)", Some(TimeUnit::Us)),
            ("Time [µs]", Some(TimeUnit::Us)),
            ("ns", Some(TimeUnit::Ns)),
            ("time/s", Some(TimeUnit::S)),
            ("seconds", Some(TimeUnit::S)),
            ("elapsed_min", Some(TimeUnit::Min)),
            ("time", None),
            ("t", None),
            ("sample", None),
        ] {
            assert_eq!(TimeUnit::stated_in(name), unit, "{name}");
        }
    }
}
