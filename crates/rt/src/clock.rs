//! The two clocks of the loop, virtual and real time. The clock is the only difference between a simulation and a rig.

use std::time::Duration;

use bench_hal::Tick;
use nix::sys::time::TimeSpec;
use nix::time::{ClockId, ClockNanosleepFlags, clock_gettime, clock_nanosleep};

use super::publisher::Publisher;
use super::record::ClockTimes;

/// Pause of the virtual clock while the ring is full, in which a recorder takes some hundred records. Without a pause, the waiting
/// loop needs as much processor time as the recorder.
const FULL_RING_PAUSE: Duration = Duration::from_micros(200);

/// When a tick was due and when it began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickTiming {
    /// The tick to serve.
    pub tick: Tick,
    /// When it began, in nanoseconds since the loop started.
    pub woke_ns: u64,
    /// Scheduled ticks before it that passed unserved.
    pub missed: u32,
}

/// The source of ticks.
pub trait Clock {
    /// Waits for the tick `number`. If that is late by more than a period, it returns at once with the latest tick due and
    /// the number of missed ticks.
    fn wait(&mut self, number: u64, publisher: &Publisher) -> TickTiming;

    /// Nanoseconds since the loop started, read within `tick`. Runs in the tick: must not allocate or block.
    fn now_ns(&self, tick: Tick) -> u64;

    /// The clocks of the system at this moment; `None` if the ticks do not follow them. Runs in the tick: must not allocate or
    /// block.
    fn times(&self) -> Option<ClockTimes> {
        None
    }
}

/// Scheduled time of a tick in nanoseconds since the loop started, without an error that grows with the number.
pub fn scheduled_ns(number: u64, period_s: f64) -> u64 {
    (number as f64 * period_s * 1e9).round() as u64
}

fn tick(number: u64, period_s: f64) -> Tick {
    Tick {
        number,
        scheduled_ns: scheduled_ns(number, period_s),
    }
}

/// Ticks in immediate succession: each begins and ends at its scheduled time. The clock waits for room in the ring, so that no
/// record is lost.
#[derive(Clone, Copy, Debug)]
pub struct Virtual {
    /// Length of a tick in seconds.
    pub period_s: f64,
}

impl Clock for Virtual {
    fn wait(&mut self, number: u64, publisher: &Publisher) -> TickTiming {
        while !publisher.has_room() && !publisher.is_abandoned() {
            std::thread::sleep(FULL_RING_PAUSE);
        }
        let tick = tick(number, self.period_s);
        TickTiming {
            tick,
            woke_ns: tick.scheduled_ns,
            missed: 0,
        }
    }

    fn now_ns(&self, tick: Tick) -> u64 {
        tick.scheduled_ns
    }
}

/// Ticks at absolute times of the monotonic clock of the system.
#[derive(Clone, Copy, Debug)]
pub struct Realtime {
    period_s: f64,
    /// The clock's reading, in nanoseconds, at the loop's time zero.
    origin_ns: i128,
    /// The thread wakes this long before a tick, and waits awake.
    awake_ns: i128,
}

impl Realtime {
    /// A clock whose tick 0 is due one period from now. It sleeps up to each tick.
    pub fn new(period_s: f64) -> Self {
        Realtime {
            period_s,
            origin_ns: monotonic_ns() + (period_s * 1e9) as i128,
            awake_ns: 0,
        }
    }

    /// Wakes `awake_s` before each tick and waits awake, which takes this share of a processor. The time that the system takes
    /// to wake a thread then does not delay the tick.
    pub fn awake_before_ticks(self, awake_s: f64) -> Self {
        Realtime {
            awake_ns: (awake_s * 1e9) as i128,
            ..self
        }
    }

    fn elapsed_ns(&self) -> i128 {
        monotonic_ns() - self.origin_ns
    }
}

fn monotonic_ns() -> i128 {
    clock_ns(ClockId::CLOCK_MONOTONIC)
}

/// A clock of the system. The two that are read here always exist on Linux, so the call cannot fail.
fn clock_ns(clock: ClockId) -> i128 {
    clock_gettime(clock).map_or(0, |t| {
        i128::from(t.tv_sec()) * 1_000_000_000 + i128::from(t.tv_nsec())
    })
}

/// Sleeps until the monotonic clock reaches `until_ns`. A signal may end a sleep early; then it sleeps again.
fn sleep_until(until_ns: i128) {
    const SECOND_NS: i128 = 1_000_000_000;
    let until = TimeSpec::new((until_ns / SECOND_NS) as i64, (until_ns % SECOND_NS) as i64);
    let clock = ClockId::CLOCK_MONOTONIC;
    while monotonic_ns() < until_ns {
        let _ = clock_nanosleep(clock, ClockNanosleepFlags::TIMER_ABSTIME, &until);
    }
}

/// Reads the monotonic clock until it reaches `until_ns`.
fn wait_awake_until(until_ns: i128) {
    while monotonic_ns() < until_ns {
        std::hint::spin_loop();
    }
}

impl Clock for Realtime {
    fn wait(&mut self, number: u64, _publisher: &Publisher) -> TickTiming {
        let due_ns = tick(number, self.period_s).scheduled_ns;
        let until_ns = self.origin_ns + i128::from(due_ns);
        sleep_until(until_ns - self.awake_ns);
        wait_awake_until(until_ns);
        let woke_ns = self.elapsed_ns().max(0) as u64;
        let late_ns = woke_ns.saturating_sub(due_ns);
        let missed = (late_ns as f64 * 1e-9 / self.period_s) as u32;
        TickTiming {
            tick: tick(number + u64::from(missed), self.period_s),
            woke_ns,
            missed,
        }
    }

    fn now_ns(&self, _tick: Tick) -> u64 {
        self.elapsed_ns().max(0) as u64
    }

    fn times(&self) -> Option<ClockTimes> {
        let monotonic_ns = monotonic_ns();
        Some(ClockTimes {
            loop_ns: (monotonic_ns - self.origin_ns).max(0) as u64,
            monotonic_ns: monotonic_ns.max(0) as u64,
            wall_ns: clock_ns(ClockId::CLOCK_REALTIME).max(0) as u64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_awake_for_the_given_time_only() {
        assert_eq!(Realtime::new(0.001).awake_ns, 0);
        let clock = Realtime::new(0.001).awake_before_ticks(80e-6);
        assert_eq!((clock.awake_ns, clock.period_s), (80_000, 0.001));
    }
}
