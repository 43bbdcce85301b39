//! Lateness and compute time of the loop, for each second and for the whole run.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use super::continuity::Continuity;
use super::messages::Timing;
use bench_rt::record::TickRecord;

const SECOND_NS: u64 = 1_000_000_000;

/// Quantiles of a duration in nanoseconds. `max_ns` is exact. The others are exact below 2048 ns and otherwise at most 0.1 %
/// above the true quantile (three significant digits); durations above 10 s count as 10 s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Quantiles {
    /// Median.
    #[serde(rename = "p50")]
    pub p50_ns: u64,
    /// 99 %.
    #[serde(rename = "p99")]
    pub p99_ns: u64,
    /// 99.99 %.
    #[serde(rename = "p9999")]
    pub p9999_ns: u64,
    /// Largest.
    #[serde(rename = "max")]
    pub max_ns: u64,
}

/// A histogram that allocates only when it is created.
struct Spread {
    histogram: Histogram<u64>,
    max_ns: u64,
}

impl Spread {
    fn new() -> Spread {
        // Fails only if the bounds are not in order, or for more than five digits.
        let histogram =
            Histogram::new_with_bounds(1, 10 * SECOND_NS, 3).expect("constant bounds are in order");
        Spread {
            histogram,
            max_ns: 0,
        }
    }

    fn add(&mut self, duration_ns: u64) {
        self.histogram.saturating_record(duration_ns);
        self.max_ns = self.max_ns.max(duration_ns);
    }

    fn quantiles(&self) -> Quantiles {
        let at = |quantile| self.histogram.value_at_quantile(quantile).min(self.max_ns);
        Quantiles {
            p50_ns: at(0.5),
            p99_ns: at(0.99),
            p9999_ns: at(0.9999),
            max_ns: self.max_ns,
        }
    }

    fn clear(&mut self) {
        self.histogram.reset();
        self.max_ns = 0;
    }
}

/// Lateness (woke - due) and compute time (done - woke). A tick that is served in place of missed ones was due with the first
/// of them, so it is late by all missed periods.
struct Pair {
    lateness: Spread,
    compute: Spread,
}

impl Pair {
    fn new() -> Pair {
        Pair {
            lateness: Spread::new(),
            compute: Spread::new(),
        }
    }

    fn add(&mut self, tick: &TickRecord, period_ns: u64) {
        let missed_ns = u64::from(tick.missed_ticks).saturating_mul(period_ns);
        let late_ns = tick.woke_ns.saturating_add(missed_ns);
        self.lateness.add(late_ns.saturating_sub(tick.scheduled_ns));
        self.compute.add(tick.done_ns.saturating_sub(tick.woke_ns));
    }

    fn quantiles(&self) -> (Quantiles, Quantiles) {
        (self.lateness.quantiles(), self.compute.quantiles())
    }
}

/// The current second.
struct Second {
    number: u64,
    first_tick: u64,
    last: TickRecord,
    ticks: u64,
}

/// Summarises every second of scheduled time that contains ticks as a [`Timing`], and all ticks as quantiles.
pub(super) struct Tally {
    period_ns: u64,
    second: Option<Second>,
    within: Pair,
    all: Pair,
    reported_overruns: u64,
    reported_lost: u64,
}

impl Tally {
    pub(super) fn new(period_ns: u64) -> Tally {
        Tally {
            period_ns,
            second: None,
            within: Pair::new(),
            all: Pair::new(),
            reported_overruns: 0,
            reported_lost: 0,
        }
    }

    /// Whether `tick` belongs to a later second than the current one, which must then be closed first.
    pub(super) fn is_over(&self, tick: &TickRecord) -> bool {
        self.second
            .as_ref()
            .is_some_and(|s| s.number != tick.scheduled_ns / SECOND_NS)
    }

    /// Adds a tick.
    pub(super) fn add(&mut self, tick: &TickRecord) {
        self.within.add(tick, self.period_ns);
        self.all.add(tick, self.period_ns);
        let number = tick.scheduled_ns / SECOND_NS;
        let second = self.second.get_or_insert(Second {
            number,
            first_tick: tick.tick,
            last: *tick,
            ticks: 0,
        });
        second.last = *tick;
        second.ticks += 1;
    }

    /// Ends the current second; returns the scheduled time of its last tick, and its summary. `account` includes that tick.
    pub(super) fn close(&mut self, account: &Continuity) -> Option<(u64, Timing)> {
        let second = self.second.take()?;
        let timing = Timing {
            overruns: account.overruns() - self.reported_overruns,
            lost_records: account.lost_records() - self.reported_lost,
            ..self.summary(&second)
        };
        self.reported_overruns = account.overruns();
        self.reported_lost = account.lost_records();
        self.within.lateness.clear();
        self.within.compute.clear();
        Some((second.last.scheduled_ns, timing))
    }

    /// Lateness and compute time of all ticks so far.
    pub(super) fn totals(&self) -> (Quantiles, Quantiles) {
        self.all.quantiles()
    }

    fn summary(&self, second: &Second) -> Timing {
        let (late, compute) = self.within.quantiles();
        Timing {
            first_tick: second.first_tick,
            last_tick: second.last.tick,
            ticks: second.ticks,
            lateness_p50_ns: late.p50_ns,
            lateness_p99_ns: late.p99_ns,
            lateness_p9999_ns: late.p9999_ns,
            lateness_max_ns: late.max_ns,
            compute_p50_ns: compute.p50_ns,
            compute_p99_ns: compute.p99_ns,
            compute_p9999_ns: compute.p9999_ns,
            compute_max_ns: compute.max_ns,
            ..Timing::default()
        }
    }
}
