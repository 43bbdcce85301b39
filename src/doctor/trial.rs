//! A thread like the loop's: scheduled as the loop asks for it, waiting by the loop's own clock, but without devices.

use std::time::Duration;

use rtrb::RingBuffer;
use serde::Serialize;

use super::finding::Finding;
use crate::config::LoopSettings;
use crate::rt::clock::{Clock, Realtime};
use crate::rt::publisher::Publisher;
use crate::rt::thread::{Pace, Scheduling, become_realtime};

/// How long it is watched.
const WATCHED: Duration = Duration::from_secs(1);

/// What such a thread was granted, and how punctually it was woken.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// What was granted.
    pub scheduling: Scheduling,
    /// How late it was woken.
    pub lateness: Lateness,
}

/// How late a thread was woken, beside how it was scheduled.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Lateness {
    /// `SCHED_FIFO 80`, `SCHED_OTHER`.
    pub policy: String,
    /// Whether the memory was locked.
    pub memory_locked: bool,
    /// The processor it was bound to.
    pub cpu: Option<usize>,
    /// Ticks in a second.
    pub rate_hz: f64,
    /// Ticks it was woken for.
    pub ticks: u64,
    /// Ticks that passed while it slept.
    pub missed: u64,
    /// Half of the ticks began no later than this, in seconds.
    pub p50_s: f64,
    /// 99 of 100 ticks began no later than this, in seconds.
    pub p99_s: f64,
    /// The latest, in seconds.
    pub max_s: f64,
}

/// RunChecks such a thread for about a second. Its memory is unlocked again.
pub fn trial(settings: &LoopSettings) -> std::io::Result<Trial> {
    let settings = settings.clone();
    let work = move || {
        let scheduling = become_realtime(&settings);
        let lateness = watch(&settings, &scheduling);
        let _ = nix::sys::mman::munlockall(); // what was not locked is no harm
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
        .map_err(|_| std::io::Error::other("the trial's thread died"))
}

fn watch(settings: &LoopSettings, scheduling: &Scheduling) -> Lateness {
    let ticks = (settings.rate_hz * WATCHED.as_secs_f64()).ceil() as u64;
    let mut late_ns: Vec<u64> = Vec::with_capacity(ticks as usize);
    let (publisher, mut clock) = (
        Publisher::new(RingBuffer::new(1).0),
        Realtime::new(settings.period_s()),
    );
    let (mut number, mut missed) = (0, 0);
    while number < ticks {
        let moment = clock.wait(number, &publisher);
        let slept_through_ns = f64::from(moment.missed) * settings.period_s() * 1e9;
        late_ns.push(
            moment.woke_ns.saturating_sub(moment.tick.scheduled_ns) + slept_through_ns as u64,
        );
        missed += u64::from(moment.missed);
        number = moment.tick.number + 1;
    }
    late_ns.sort_unstable();
    Lateness::of(&late_ns, missed, settings.rate_hz, scheduling)
}

impl Lateness {
    /// Of rising latenesses in nanoseconds.
    fn of(late_ns: &[u64], missed: u64, rate_hz: f64, scheduling: &Scheduling) -> Lateness {
        let quantile = |q: f64| {
            let rank = (q * late_ns.len() as f64).ceil() as usize;
            late_ns
                .get(rank.saturating_sub(1))
                .map_or(0.0, |&ns| ns as f64 / 1e9)
        };
        Lateness {
            policy: scheduling.policy.clone(),
            memory_locked: scheduling.memory_locked,
            cpu: scheduling.cpu,
            rate_hz,
            ticks: late_ns.len() as u64,
            missed,
            p50_s: quantile(0.5),
            p99_s: quantile(0.99),
            max_s: quantile(1.0),
        }
    }

    fn words(&self) -> String {
        let us = |s: f64| format!("{:.1} us", s * 1e6);
        let memory = if self.memory_locked {
            "locked"
        } else {
            "not locked"
        };
        format!(
            "{}, memory {memory}: woken {} late (p50), {} (p99), {} (max) in {} ticks at {} Hz, {} missed",
            self.policy,
            us(self.p50_s),
            us(self.p99_s),
            us(self.max_s),
            self.ticks,
            self.rate_hz,
            self.missed
        )
    }
}

/// A tick that begins later than the next one is due is missed; too many within a second trip.
pub fn finding(lateness: &Lateness, overruns_per_s: u32, pace: Pace) -> Finding {
    let remedy = "grant real-time scheduling, give the loop a processor of its own (loop.cpu, isolcpus=), \
                  stop what else runs here, or lower loop.rate_hz";
    let (what, is_late) = (
        lateness.words(),
        lateness.missed > 0 || lateness.max_s > 1.0 / lateness.rate_hz,
    );
    match pace {
        Pace::Realtime if lateness.missed > u64::from(overruns_per_s) => {
            let what =
                format!("{what}; the interlock trips on more than {overruns_per_s} a second");
            Finding::failure("lateness", what, remedy)
        }
        Pace::Realtime if is_late => Finding::warning("lateness", what, remedy),
        Pace::Virtual if is_late => {
            let remedy = "none for virtual pace, which waits for no clock; before --pace realtime: "
                .to_string() + remedy;
            Finding::note("lateness", what, remedy)
        }
        _ => Finding::ok("lateness", what),
    }
}

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
    fn quantiles_are_ranks() {
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
    fn a_tick_late_is_a_warning_and_what_trips_the_interlock_a_failure() {
        let verdict =
            |late_ns: &[u64], missed, pace| finding(&lateness(late_ns, missed), 50, pace).verdict;
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
    fn the_policy_stands_beside_the_figures() {
        let what = finding(&lateness(&[5000, 9000], 0), 50, Pace::Realtime).what;
        assert!(
            what.starts_with("SCHED_FIFO 80, memory locked: woken 5.0 us late (p50)"),
            "{what}"
        );
    }

    #[test]
    fn the_trial_counts_every_tick_of_its_second_as_woken_or_missed() {
        let settings = LoopSettings {
            rate_hz: 1000.0,
            computing_delay_periods: 0,
            priority: 80,
            cpu: None,
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
