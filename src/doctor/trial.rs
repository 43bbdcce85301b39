//! A thread with the scheduling and the clock of the loop, but without devices.

use std::time::Duration;

use rtrb::RingBuffer;
use serde::Serialize;

use super::finding::{Finding, Subject};
use bench_config::LoopSettings;
use bench_rt::clock::{Clock, Realtime, TickTiming};
use bench_rt::publisher::Publisher;
use bench_rt::thread::{Pace, Scheduling, become_realtime};

/// Duration of the trial.
const DURATION: Duration = Duration::from_secs(1);

/// The scheduling of the thread, and how late it woke up.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// The scheduling that the system granted.
    pub scheduling: Scheduling,
    /// How late the thread woke up.
    pub lateness: Lateness,
}

/// How late a thread woke up, and how it was scheduled.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Lateness {
    /// `SCHED_FIFO 80`, `SCHED_OTHER`.
    pub policy: String,
    /// Whether the memory was locked.
    pub memory_locked: bool,
    /// The processor that it was bound to.
    pub cpu: Option<usize>,
    /// Ticks per second.
    pub rate_hz: f64,
    /// Ticks for which it woke up.
    pub ticks: u64,
    /// Ticks that it missed.
    pub missed: u64,
    /// Median lateness in seconds.
    pub p50_s: f64,
    /// 99 % quantile of the lateness in seconds.
    pub p99_s: f64,
    /// Largest lateness in seconds.
    pub max_s: f64,
}

/// Runs such a thread for about one second, and gives its privileges back afterwards.
pub fn trial(settings: &LoopSettings) -> std::io::Result<Trial> {
    let settings = settings.clone();
    let work = move || {
        let scheduling = become_realtime(&settings);
        let privileges = scheduling.hold();
        let lateness = measure(&settings, &scheduling);
        drop(privileges);
        Trial {
            scheduling,
            lateness,
        }
    };
    let thread = std::thread::Builder::new()
        .name("bench-trial".into())
        .spawn(work)?;
    thread
        .join()
        .map_err(|_| std::io::Error::other("the thread of the trial panicked"))
}

fn measure(settings: &LoopSettings, scheduling: &Scheduling) -> Lateness {
    let ticks = (settings.rate_hz * DURATION.as_secs_f64()).ceil() as u64;
    let mut late_ns: Vec<u64> = Vec::with_capacity(ticks as usize);
    let publisher = Publisher::new(RingBuffer::new(1).0);
    let mut clock = Realtime::new(settings.period_s()).awake_before_ticks(settings.awake_s());
    let (mut number, mut missed) = (0, 0);
    while number < ticks {
        let timing = clock.wait(number, &publisher);
        late_ns.push(lateness_ns(&timing, settings.period_s()));
        missed += u64::from(timing.missed);
        number = timing.tick.number + 1;
    }
    late_ns.sort_unstable();
    Lateness::of(&late_ns, missed, settings.rate_hz, scheduling)
}

/// Lateness of a tick. A tick that replaces missed ones was due with the first of them.
fn lateness_ns(timing: &TickTiming, period_s: f64) -> u64 {
    let missed_ns = (f64::from(timing.missed) * (period_s * 1e9)) as u64;
    let woke_late_ns = timing.woke_ns.saturating_sub(timing.tick.scheduled_ns);
    woke_late_ns + missed_ns
}

/// The `q` quantile of ascending nanoseconds, in seconds.
fn quantile_s(late_ns: &[u64], q: f64) -> f64 {
    let rank = (q * late_ns.len() as f64).ceil() as usize;
    let late_ns = late_ns.get(rank.saturating_sub(1));
    late_ns.map_or(0.0, |&ns| ns as f64 / 1e9)
}

impl Lateness {
    /// The figures of latenesses in ascending order, in nanoseconds.
    fn of(late_ns: &[u64], missed: u64, rate_hz: f64, scheduling: &Scheduling) -> Lateness {
        Lateness {
            policy: scheduling.policy.clone(),
            memory_locked: scheduling.memory_locked,
            cpu: scheduling.cpu,
            rate_hz,
            ticks: late_ns.len() as u64,
            missed,
            p50_s: quantile_s(late_ns, 0.5),
            p99_s: quantile_s(late_ns, 0.99),
            max_s: quantile_s(late_ns, 1.0),
        }
    }

    fn text(&self) -> String {
        let memory = if self.memory_locked {
            "memory locked"
        } else {
            "memory not locked"
        };
        format!(
            "{}, {memory}: late by {:.1} us (p50), {:.1} us (p99), {:.1} us (max) in {} ticks at {} Hz, {} missed",
            self.policy,
            self.p50_s * 1e6,
            self.p99_s * 1e6,
            self.max_s * 1e6,
            self.ticks,
            self.rate_hz,
            self.missed
        )
    }
}

/// Evaluates the lateness. A tick that is late by more than a period is missed; too many of them within one second trip.
pub fn finding(lateness: &Lateness, overruns_per_s: u32, pace: Pace) -> Finding {
    let what = lateness.text();
    let is_late = lateness.missed > 0 || lateness.max_s > 1.0 / lateness.rate_hz;
    match pace {
        _ if !is_late => Subject::Lateness.ok(what),
        Pace::Realtime if lateness.missed > u64::from(overruns_per_s) => {
            let what =
                format!("{what}; the interlock trips on more than {overruns_per_s} per second");
            Subject::Lateness.failure(what, REMEDY)
        }
        Pace::Realtime => Subject::Lateness.warning(what, REMEDY),
        Pace::Virtual => {
            let remedy = format!("none at virtual pace; before --pace realtime: {REMEDY}");
            Subject::Lateness.note(what, remedy)
        }
    }
}

const REMEDY: &str = "grant real-time scheduling, give the loop a processor of its own (loop.cpu, isolcpus=), \
    end other programs, or lower loop.rate_hz";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn lateness(late_ns: &[u64], missed: u64) -> Lateness {
        let scheduling = Scheduling {
            policy: "SCHED_FIFO 80".into(),
            memory_locked: true,
            ..Scheduling::default()
        };
        Lateness::of(late_ns, missed, 1000.0, &scheduling)
    }

    #[test]
    fn quantiles_are_order_statistics() {
        let late_ns: Vec<u64> = (1..=1000).collect();
        let lateness = lateness(&late_ns, 0);
        assert_eq!(
            (lateness.p50_s, lateness.p99_s, lateness.max_s),
            (500e-9, 990e-9, 1e-6)
        );
        assert_eq!(
            super::Lateness::of(&[], 0, 1.0, &Scheduling::default()).max_s,
            0.0
        );
    }

    #[test]
    fn a_late_tick_is_a_warning_and_a_trip_is_a_failure() {
        let verdict =
            |late_ns: &[u64], missed, pace| finding(&lateness(late_ns, missed), 50, pace).severity;
        assert_eq!(verdict(&[5000, 900_000], 0, Pace::Realtime), Severity::Ok);
        assert_eq!(
            verdict(&[5000, 1_100_000], 1, Pace::Realtime),
            Severity::Warning
        );
        assert_eq!(
            verdict(&[5000, 51_500_000], 51, Pace::Realtime),
            Severity::Failure
        );
        assert_eq!(
            verdict(&[5000, 51_500_000], 51, Pace::Virtual),
            Severity::Note
        );
    }

    #[test]
    fn the_text_begins_with_the_policy() {
        let what = finding(&lateness(&[5000, 9000], 0), 50, Pace::Realtime).what;
        assert!(
            what.starts_with("SCHED_FIFO 80, memory locked: late by 5.0 us (p50)"),
            "{what}"
        );
    }

    #[test]
    fn every_tick_of_the_trial_is_counted() {
        let settings = LoopSettings {
            rate_hz: 1000.0,
            computing_delay_periods: 0,
            priority: 80,
            cpu: None,
            stop_ramp_s: None,
            healthy_s: None,
            arm_lease_s: None,
            wake_early_s: None,
            on_recording_failure: bench_config::OnRecordingFailure::End,
        };
        let lateness = trial(&settings).unwrap().lateness;
        let all = lateness.ticks + lateness.missed;
        assert!(all >= 1000, "{lateness:?}");
        assert!(
            lateness.ticks > 0
                && lateness.p50_s <= lateness.p99_s
                && lateness.p99_s <= lateness.max_s
        );
    }
}
