//! The faults and their times.

use std::ops::Range;

use bench_hal::Validity;
use bench_test_support::faulty_rig::Fault;
use rand_core::Rng;
use rand_pcg::Pcg64;

/// A current in amperes as a function of the time since the fault in seconds.
pub type Current = fn(f64) -> f64;

/// Where a fault is injected.
#[derive(Clone, Copy)]
pub enum Injection {
    /// In the rig, during a run.
    Rig(Fault),
    /// In the rig, while the amplifier is enabled.
    Enabling(Fault),
    /// In the program: it commands this current.
    Program(Current),
    /// In the rig and in the program.
    Both(Fault, Current),
    /// In the clock: this many ticks are missed at once.
    MissedTicks(u32),
}

/// A kind of fault, and how it must end the run.
pub struct Case {
    pub injection: Injection,
    /// The reason of the trip.
    pub reason: &'static str,
    /// Longest time from the fault to the trip in seconds.
    pub within_s: f64,
}

/// Time for a trip by the first bad reading, command or status, in seconds. A program starts 100 ticks after its request.
const AT_ONCE_S: f64 = 0.05;

/// A fault while the amplifier is enabled begins this time before the request to arm, in seconds. In real time the supervisor begins
/// earlier than the first tick, by the time in which the thread of the loop is scheduled.
const ENABLING_LEAD_S: f64 = 1.0;

const fn case(injection: Injection, reason: &'static str, within_s: f64) -> Case {
    Case {
        injection,
        reason,
        within_s,
    }
}

const fn rig(fault: Fault, reason: &'static str) -> Case {
    case(Injection::Rig(fault), reason, AT_ONCE_S)
}

/// Slow enough not to swing the stage. The thermal current reaches 2.34 A after about 5 s.
fn heating_a(time_s: f64) -> f64 {
    (2.0 * time_s).min(4.0)
}

/// All kinds of faults.
pub const CASES: [Case; 21] = [
    rig(Fault::Validity(Validity::Faulty), "probe_invalid"),
    rig(Fault::Validity(Validity::OutOfRange), "probe_invalid"),
    rig(Fault::Validity(Validity::Missing), "probe_invalid"),
    rig(Fault::Position(f64::NAN), "probe_invalid"),
    rig(Fault::Position(0.00095), "travel"),
    rig(Fault::Age(2_000_000), "probe_stale"),
    rig(Fault::RepeatedSample, "probe_stale"),
    case(Injection::Both(Fault::Stuck, |_| 1.0), "probe_stuck", 0.25),
    rig(Fault::AmplifierFault(9), "amplifier"),
    rig(Fault::ReportsDisabled, "amplifier_disabled"),
    rig(Fault::RefusedCommand(8), "amplifier"),
    rig(Fault::ReturnedCurrent(f64::NAN), "amplifier"),
    rig(Fault::ReturnedCurrent(5.0), "set_point_not_accepted"),
    case(
        Injection::Rig(Fault::MeasuredOffset(2.0)),
        "current_not_followed",
        0.15,
    ),
    case(
        Injection::Enabling(Fault::RefusedEnable(7)),
        "amplifier",
        ENABLING_LEAD_S + AT_ONCE_S,
    ),
    case(
        Injection::Enabling(Fault::FailedEnable(6)),
        "amplifier",
        ENABLING_LEAD_S + AT_ONCE_S,
    ),
    case(
        Injection::Program(|_| f64::NAN),
        "command_not_finite",
        AT_ONCE_S,
    ),
    case(
        Injection::Program(|_| f64::NEG_INFINITY),
        "command_not_finite",
        AT_ONCE_S,
    ),
    case(Injection::Program(|_| -11.0), "peak_current", AT_ONCE_S),
    case(Injection::Program(heating_a), "continuous_current", 8.0),
    // 0.12 s, more than `REALTIME_OVERRUNS_PER_S`.
    case(Injection::MissedTicks(600), "overruns", 0.2),
];

/// The times of a soak.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    seed: u64,
    rate_hz: f64,
    period_ticks: u64,
    /// Number of periods.
    pub periods: u64,
}

/// The times of a period, in ticks since the loop started.
#[derive(Clone)]
pub struct Period {
    /// Number of the period.
    pub number: u64,
    /// All its ticks. At the first one a trip is cleared and the first run starts.
    pub ticks: Range<u64>,
    /// Start of the second run.
    pub second_run: u64,
    /// Ticks with the fault.
    pub fault: Range<u64>,
    /// Ticks in which the fault must trip.
    pub trip: Range<u64>,
    /// The fault.
    pub case: &'static Case,
}

impl Schedule {
    /// A soak of at least `ticks` with a fault every `every_s`.
    pub fn new(seed: u64, rate_hz: f64, every_s: f64, ticks: u64) -> Schedule {
        let period_ticks = (every_s * rate_hz) as u64;
        Schedule {
            seed,
            rate_hz,
            period_ticks,
            periods: ticks.div_ceil(period_ticks),
        }
    }

    /// All ticks.
    pub fn ticks(&self) -> u64 {
        self.periods * self.period_ticks
    }

    /// Length of a period in seconds.
    pub fn period_s(&self) -> f64 {
        self.period_ticks as f64 / self.rate_hz
    }

    /// Number of the period of a tick. Ticks after the last period belong to it.
    pub fn number(&self, tick: u64) -> u64 {
        (tick / self.period_ticks).min(self.periods - 1)
    }

    /// The times of a period. The faults follow each other in the order of [`CASES`], from a place that depends on the seed.
    pub fn period(&self, number: u64) -> Period {
        let begin = number * self.period_ticks;
        let second_run = begin + self.period_ticks / 5;
        let index = (self.seed.wrapping_add(number)) % CASES.len() as u64;
        let case = &CASES[index as usize];
        let at = match case.injection {
            Injection::Enabling(_) => second_run - (ENABLING_LEAD_S * self.rate_hz) as u64,
            Injection::Rig(_)
            | Injection::Program(_)
            | Injection::Both(..)
            | Injection::MissedTicks(_) => begin + self.fault_offset(number),
        };
        let within = (case.within_s * self.rate_hz) as u64;
        Period {
            number,
            ticks: begin..begin + self.period_ticks,
            second_run,
            fault: at..begin + self.period_ticks * 9 / 10,
            trip: at..at + within,
            case,
        }
    }

    /// From 0.3 to 0.5 periods.
    fn fault_offset(&self, number: u64) -> u64 {
        let mut random = Pcg64::new(u128::from(self.seed), u128::from(number));
        self.period_ticks * 3 / 10 + random.next_u64() % (self.period_ticks / 5)
    }
}
