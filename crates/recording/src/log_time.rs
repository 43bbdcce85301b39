//! Log times of the messages: the wall clock at the scheduled times of the ticks.

use bench_rt::record::ClockTimes;

/// Converts times since the loop started to nanoseconds since 1970.
///
/// The first [`ClockTimes`] of a recording fix the difference between wall clock and monotonic clock. A wall clock that is set
/// later does not move messages, so that their order and their distances are those of the ticks. If the schedule of the loop
/// restarts, the times follow its new origin on the monotonic clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogTime {
    /// The log time of the start of the loop.
    zero_ns: u64,
    wall_minus_monotonic_ns: Option<i128>,
}

impl LogTime {
    /// Log times of a loop that started at `zero_ns` since 1970, until its clocks are known.
    pub(super) fn new(zero_ns: u64) -> LogTime {
        LogTime {
            zero_ns,
            wall_minus_monotonic_ns: None,
        }
    }

    /// Takes clocks that the loop has read.
    pub(super) fn follow(&mut self, times: &ClockTimes) {
        let [started_ns, monotonic_ns, wall_ns] =
            [times.loop_ns, times.monotonic_ns, times.wall_ns].map(i128::from);
        let difference_ns = *self
            .wall_minus_monotonic_ns
            .get_or_insert(wall_ns - monotonic_ns);
        let zero_ns = monotonic_ns - started_ns + difference_ns;
        self.zero_ns = u64::try_from(zero_ns).unwrap_or(self.zero_ns);
    }

    /// The log time of a moment, in nanoseconds since the loop started.
    pub(super) fn at(&self, loop_ns: u64) -> u64 {
        self.zero_ns.saturating_add(loop_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const YEAR_2026_NS: u64 = 1_790_000_000_000_000_000;

    #[test]
    fn follows_the_origin_of_the_loop_but_not_a_wall_clock_that_is_set() {
        let mut log = LogTime::new(YEAR_2026_NS);
        assert_eq!(log.at(5), YEAR_2026_NS + 5);
        log.follow(&ClockTimes {
            loop_ns: 100,
            monotonic_ns: 1_100,
            wall_ns: YEAR_2026_NS + 7_100,
        });
        assert_eq!(log.at(0), YEAR_2026_NS + 7_000);
        // An hour back on the wall clock.
        log.follow(&ClockTimes {
            loop_ns: 200,
            monotonic_ns: 1_200,
            wall_ns: YEAR_2026_NS - 3_600_000_000_000,
        });
        assert_eq!(log.at(0), YEAR_2026_NS + 7_000);
        // The schedule restarted 50 ns later.
        log.follow(&ClockTimes {
            loop_ns: 250,
            monotonic_ns: 1_300,
            wall_ns: 0,
        });
        assert_eq!(log.at(0), YEAR_2026_NS + 7_050);
    }

    #[test]
    fn absurd_clocks_change_nothing() {
        let mut log = LogTime::new(3);
        log.follow(&ClockTimes {
            loop_ns: u64::MAX,
            monotonic_ns: 0,
            wall_ns: 0,
        });
        assert_eq!(log.at(u64::MAX), u64::MAX);
        assert_eq!(log.at(1), 4);
    }
}
