//! Last values, counts and shares of the interlocks, from the messages of the loop.

use hdrhistogram::Histogram;
use schemars::JsonSchema;
use serde::Serialize;

use bench_config::Config;
use bench_rt::arming::{State, Trip};
use bench_rt::record::{TickRecord, flag};

/// Upper edges of the bars of the histogram of the lateness, in microseconds; the last bar has no upper edge.
pub const EDGES_US: [f64; 11] = [
    0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 1000.0,
];

/// The loop at one moment.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct LoopView {
    /// State of the arming machine.
    pub state: String,
    /// Sampling rate in hertz.
    pub rate_hz: f64,
    /// Ticks since the daemon started.
    pub ticks: u64,
    /// Ticks that were not served since the daemon started.
    pub overruns: u64,
    /// Records that did not fit into the ring to the recorder.
    pub lost_records: u64,
    /// Why the run in progress, or the last one, cannot be recorded; `null` if it is recorded.
    pub recording_defect: Option<String>,
    /// Messages that the live view did not take in time. The recording has them.
    pub live_dropped: u64,
    /// Reference in metres.
    pub reference_m: f64,
    /// Position in metres; `null` without a valid reading.
    pub position_m: Option<f64>,
    /// Reference minus position in metres, while the loop is closed.
    pub error_m: Option<f64>,
    /// Current in amperes.
    pub current_a: f64,
    /// Age of the reading in seconds.
    pub probe_age_s: f64,
    /// Time at which the loop woke minus time at which the tick was due, of the present run or since the last one.
    pub lateness_us: Spread,
    /// Time from waking to the written command.
    pub compute_us: Spread,
    /// Number of ticks by lateness.
    pub lateness_histogram: Bars,
    /// Pace of the loop.
    pub pace: String,
    /// Scheduling policy of the thread of the loop.
    pub policy: String,
    /// Whether the memory is locked during runs.
    pub memory_locked: bool,
    /// Requests to the system that were refused, with the remedy.
    pub refused: Vec<String>,
}

/// Quantiles of a duration in microseconds.
#[derive(Clone, Copy, Debug, Default, Serialize, JsonSchema)]
pub struct Spread {
    /// Median.
    pub p50: f64,
    /// 99 %.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

/// A histogram.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Bars {
    /// Upper edges in microseconds; the last bar has none.
    pub edges_us: Vec<f64>,
    /// Number of ticks in each bar.
    pub counts: Vec<u64>,
}

/// A quantity as a share of its interlock.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Share {
    /// Name: `travel`, `current`, `motor_heat`, `probe_age`.
    pub name: &'static str,
    /// The quantity.
    pub value: f64,
    /// Its limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// value / limit; the interlock trips at 1.
    pub share: f64,
}

/// A trip for clients.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TripView {
    /// Short name of the reason.
    pub reason: &'static str,
    /// The reason with value and limit.
    pub text: String,
    /// What to do about it.
    pub remedy: &'static str,
    /// Time in seconds since the daemon started.
    pub time_s: f64,
    /// Number of the run.
    pub run: u32,
}

impl TripView {
    /// A trip at a time.
    pub fn of(trip: &Trip, time_s: f64, run: u32) -> TripView {
        TripView {
            reason: trip.reason(),
            text: trip.to_string(),
            remedy: trip.remedy(),
            time_s,
            run,
        }
    }
}

/// Durations since they were cleared.
struct Durations {
    histogram: Histogram<u64>,
    max_ns: u64,
}

impl Durations {
    fn new() -> Durations {
        // Constant bounds: from 1 ns to 10 s with two significant digits.
        let histogram =
            Histogram::new_with_bounds(1, 10_000_000_000, 2).expect("constant bounds are in order");
        Durations {
            histogram,
            max_ns: 0,
        }
    }

    fn add(&mut self, ns: u64) {
        self.histogram.saturating_record(ns);
        self.max_ns = self.max_ns.max(ns);
    }

    fn clear(&mut self) {
        self.histogram.reset();
        self.max_ns = 0;
    }

    fn spread(&self) -> Spread {
        let at =
            |quantile| self.histogram.value_at_quantile(quantile).min(self.max_ns) as f64 * 1e-3;
        Spread {
            p50: at(0.5),
            p99: at(0.99),
            max: self.max_ns as f64 * 1e-3,
        }
    }

    fn bars(&self) -> Bars {
        let up_to = |edge_us: f64| self.histogram.count_between(0, (edge_us * 1e3) as u64);
        let mut below = 0;
        let mut counts: Vec<u64> = Vec::new();
        for edge_us in EDGES_US {
            let all = up_to(edge_us);
            counts.push(all.saturating_sub(below));
            below = all;
        }
        counts.push(self.histogram.len().saturating_sub(below));
        Bars {
            edges_us: EDGES_US.to_vec(),
            counts,
        }
    }
}

/// Lateness of all ticks since the daemon started.
#[derive(Clone, Copy, Debug, Default)]
pub struct LatenessTotals {
    /// Ticks up to each of [`EDGES_US`] that are above the edge before; later ticks are in none.
    pub counts: [u64; EDGES_US.len()],
    /// Sum in nanoseconds.
    pub sum_ns: u64,
}

impl LatenessTotals {
    fn add(&mut self, ns: u64) {
        self.sum_ns = self.sum_ns.saturating_add(ns);
        let us = ns as f64 * 1e-3;
        let bar = EDGES_US.iter().position(|edge_us| us <= *edge_us);
        if let Some(count) = bar.and_then(|bar| self.counts.get_mut(bar)) {
            *count += 1;
        }
    }
}

/// Limits of the interlocks that are shown.
#[derive(Clone, Copy, Debug)]
struct Limits {
    travel_m: f64,
    current_a: f64,
    continuous_a: f64,
    probe_age_s: f64,
    /// Sampling period over the thermal time constant of the motor.
    cooling: f64,
}

/// Follows the messages of the loop.
pub struct Status {
    limits: Limits,
    rate_hz: f64,
    last: TickRecord,
    /// Whether the last tick belongs to a closed loop.
    is_closed: bool,
    ticks: u64,
    overruns: u64,
    lost_records: u64,
    /// The thermal state of the motor in A^2, by the recursion of the interlocks.
    thermal_a2: f64,
    /// Largest |current| and |position| since the last view.
    peak_a: f64,
    peak_m: f64,
    lateness: Durations,
    compute: Durations,
    lateness_totals: LatenessTotals,
}

impl Status {
    /// The status of a loop with the limits of a configuration.
    pub fn new(config: &Config) -> Status {
        let rate_hz = config.servo.rate_hz;
        Status {
            limits: Limits {
                travel_m: config.interlock.soft_limit_m,
                current_a: config
                    .motor
                    .peak_current_a()
                    .min(config.amplifier.current_limit_a),
                continuous_a: config.motor.continuous_current_a(),
                probe_age_s: config.interlock.probe_stale_s,
                cooling: 1.0 / (rate_hz * config.motor.thermal_time_constant_s),
            },
            rate_hz,
            last: TickRecord::default(),
            is_closed: false,
            ticks: 0,
            overruns: 0,
            lost_records: 0,
            thermal_a2: 0.0,
            peak_a: 0.0,
            peak_m: 0.0,
            lateness: Durations::new(),
            compute: Durations::new(),
            lateness_totals: LatenessTotals::default(),
        }
    }

    /// Lateness of all ticks.
    pub fn lateness_totals(&self) -> LatenessTotals {
        self.lateness_totals
    }

    /// Ticks so far.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// A run begins, or the time between two runs: durations are counted anew.
    pub fn begin(&mut self) {
        self.lateness.clear();
        self.compute.clear();
    }

    /// Takes a tick of a closed loop or of another run. thermal(n) = thermal(n-1) + (i^2 - thermal(n-1)) T / tau, as in the interlocks.
    pub fn tick(&mut self, tick: &TickRecord, is_closed: bool) {
        self.ticks += 1;
        self.overruns += u64::from(tick.missed_ticks);
        let current_a = tick.actual_a.unwrap_or(tick.command_a);
        for _ in 0..=tick.missed_ticks.min(10_000) {
            self.thermal_a2 += (current_a * current_a - self.thermal_a2) * self.limits.cooling;
        }
        self.peak_a = self.peak_a.max(tick.command_a.abs());
        self.peak_m = self.peak_m.max(tick.position_m.abs());
        let late_ns = tick.woke_ns.saturating_sub(tick.scheduled_ns);
        self.lateness.add(late_ns);
        self.lateness_totals.add(late_ns);
        self.compute.add(tick.done_ns.saturating_sub(tick.woke_ns));
        self.last = *tick;
        self.is_closed = is_closed && tick.flags & flag::ACTIVE != 0;
    }

    /// Records that did not fit into the ring.
    pub fn lose(&mut self, records: u64) {
        self.lost_records += records;
    }

    /// State of the arming machine.
    pub fn state(&self) -> State {
        self.last.state
    }

    /// The loop at this moment.
    pub fn view(&self) -> LoopView {
        let tick = &self.last;
        let is_valid = tick.validity == bench_hal::Validity::Valid && tick.position_m.is_finite();
        let position_m = is_valid.then_some(tick.position_m);
        LoopView {
            state: tick.state.name().into(),
            rate_hz: self.rate_hz,
            ticks: self.ticks,
            overruns: self.overruns,
            lost_records: self.lost_records,
            reference_m: tick.reference_m,
            position_m,
            error_m: position_m
                .filter(|_| self.is_closed)
                .map(|position_m| tick.reference_m - position_m),
            current_a: tick.command_a,
            probe_age_s: tick.probe_age_ns as f64 * 1e-9,
            lateness_us: self.lateness.spread(),
            compute_us: self.compute.spread(),
            lateness_histogram: self.lateness.bars(),
            ..LoopView::default()
        }
    }

    /// Quantities as shares of their interlocks: the largest since the last call.
    pub fn take_shares(&mut self) -> Vec<Share> {
        let (travel_m, current_a) = (self.peak_m, self.peak_a);
        (self.peak_m, self.peak_a) = (0.0, 0.0);
        let heat_a = self.thermal_a2.max(0.0).sqrt();
        let age_s = self.last.probe_age_ns as f64 * 1e-9;
        vec![
            share("travel", travel_m, self.limits.travel_m, "m"),
            share("current", current_a, self.limits.current_a, "A"),
            share("motor_heat", heat_a, self.limits.continuous_a, "A"),
            share("probe_age", age_s, self.limits.probe_age_s, "s"),
        ]
    }
}

fn share(name: &'static str, value: f64, limit: f64, unit: &'static str) -> Share {
    let value = if value.is_finite() { value } else { 0.0 };
    Share {
        name,
        value,
        limit,
        unit,
        share: value / limit,
    }
}
