//! Every failure, and every pair of failures in one tick, in every state of the arming machine, on a plain and on a calibrated rig.
//!
//! A cell is a trip in the tick of the failure, with the amplifier disabled as the last call of that tick and no command afterwards, or
//! a failure that does not concern the state (see [`Failure::concerns`]). Failures that are only detected after many ticks (a stuck
//! probe, a current that is not followed, heat) are in `trips`.
use std::ops::Range;

use bench_hal::Validity;
use bench_rig::calibration::Correction;
use bench_rt::arming::{State, Trip};
use bench_rt::record::EventKind;
use bench_rt::servo::Request;

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{AmplifierCall, Bench, CurrentProgram, stage};

/// Tick of the failure.
const AT: u64 = 100;
/// Tick in which the amplifier is armed.
const ARM: u64 = AT - 10;
const MISSED: u32 = 60;
const CURRENT_A: f64 = 0.1;

/// Something that fails in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Failure {
    InvalidReading,
    PositionNotFinite,
    Travel,
    StaleReading,
    MissedTicks,
    AmplifierFault,
    AmplifierDisabled,
    RefusedCommand,
    ReturnedNotFinite,
    ReturnedOther,
    RefusedEnable,
    FailedEnable,
    RequestNotFinite,
    RequestBeyondPeak,
}

const FAILURES: [Failure; 14] = [
    Failure::InvalidReading,
    Failure::PositionNotFinite,
    Failure::Travel,
    Failure::StaleReading,
    Failure::MissedTicks,
    Failure::AmplifierFault,
    Failure::AmplifierDisabled,
    Failure::RefusedCommand,
    Failure::ReturnedNotFinite,
    Failure::ReturnedOther,
    Failure::RefusedEnable,
    Failure::FailedEnable,
    Failure::RequestNotFinite,
    Failure::RequestBeyondPeak,
];

/// What the loop does in the tick of the failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moment {
    Disarmed,
    /// The readings are judged before the amplifier is enabled.
    Judging,
    /// The amplifier begins to be enabled.
    BeginsToEnable,
    /// The amplifier is being enabled.
    Enabling,
    Armed,
    Running,
    Settling,
    /// The last tick of the program.
    Completing,
    Tripped,
    /// The amplifier resets its fault.
    Clearing,
}

const MOMENTS: [Moment; 10] = [
    Moment::Disarmed,
    Moment::Judging,
    Moment::BeginsToEnable,
    Moment::Enabling,
    Moment::Armed,
    Moment::Running,
    Moment::Settling,
    Moment::Completing,
    Moment::Tripped,
    Moment::Clearing,
];

impl Failure {
    /// Whether the failure must trip at this moment. In the others it has no effect: a disabled amplifier gives no current, and only
    /// an armed loop commands, only a run requests.
    fn concerns(self, moment: Moment) -> bool {
        let is_off = matches!(
            moment,
            Moment::Disarmed | Moment::Tripped | Moment::Clearing
        );
        let runs = matches!(
            moment,
            Moment::Running | Moment::Settling | Moment::Completing
        );
        match self {
            Failure::InvalidReading
            | Failure::PositionNotFinite
            | Failure::Travel
            | Failure::StaleReading
            | Failure::MissedTicks
            | Failure::AmplifierFault => !is_off,
            // While it is being enabled an amplifier is disabled. Armed, it is commanded zero.
            Failure::AmplifierDisabled => runs,
            Failure::RefusedCommand | Failure::ReturnedNotFinite | Failure::ReturnedOther => {
                // In `BeginsToEnable` the amplifier is enabled at once, and commanded zero in the same tick.
                runs || matches!(moment, Moment::Armed | Moment::BeginsToEnable)
            }
            Failure::RefusedEnable => moment == Moment::BeginsToEnable,
            Failure::FailedEnable => matches!(moment, Moment::BeginsToEnable | Moment::Enabling),
            Failure::RequestNotFinite | Failure::RequestBeyondPeak => runs,
        }
    }

    /// Whether the failure explains a trip.
    fn explains(self, trip: &Trip) -> bool {
        match trip {
            Trip::Travel { .. } => self == Failure::Travel,
            Trip::PeakCurrent { .. } => self == Failure::RequestBeyondPeak,
            Trip::CommandNotFinite => self == Failure::RequestNotFinite,
            Trip::ProbeInvalid => {
                matches!(self, Failure::InvalidReading | Failure::PositionNotFinite)
            }
            Trip::ProbeStale { .. } => self == Failure::StaleReading,
            Trip::SetPointNotAccepted { .. } => self == Failure::ReturnedOther,
            Trip::Overruns { .. } => self == Failure::MissedTicks,
            Trip::AmplifierDisabled => self == Failure::AmplifierDisabled,
            Trip::Amplifier { code, .. } => match self {
                Failure::AmplifierFault => *code == 9,
                Failure::RefusedCommand => *code == 8,
                Failure::RefusedEnable => *code == 7,
                Failure::FailedEnable => *code == 6,
                Failure::ReturnedNotFinite => *code == 0,
                _ => false,
            },
            // Detected after many ticks: none of the failures here.
            Trip::ContinuousCurrent { .. }
            | Trip::ProbeStuck { .. }
            | Trip::CurrentNotFollowed { .. }
            | Trip::ModelError { .. } => false,
        }
    }

    /// The fault of the rig, if it is one.
    fn fault(self) -> Option<Fault> {
        match self {
            Failure::InvalidReading => Some(Fault::Validity(Validity::Faulty)),
            Failure::PositionNotFinite => Some(Fault::Position(f64::NAN)),
            Failure::Travel => Some(Fault::Position(0.00095)),
            Failure::StaleReading => Some(Fault::Age(2_000_000)),
            Failure::AmplifierFault => Some(Fault::AmplifierFault(9)),
            Failure::AmplifierDisabled => Some(Fault::ReportsDisabled),
            Failure::RefusedCommand => Some(Fault::RefusedCommand(8)),
            Failure::ReturnedNotFinite => Some(Fault::ReturnedCurrent(f64::NAN)),
            Failure::ReturnedOther => Some(Fault::ReturnedCurrent(3.0)),
            Failure::RefusedEnable => Some(Fault::RefusedEnable(7)),
            Failure::FailedEnable => Some(Fault::FailedEnable(6)),
            Failure::MissedTicks | Failure::RequestNotFinite | Failure::RequestBeyondPeak => None,
        }
    }

    /// The request of the program in the tick of the failure, if that is what fails.
    fn requested_a(self) -> Option<f64> {
        match self {
            Failure::RequestNotFinite => Some(f64::NAN),
            Failure::RequestBeyondPeak => Some(1e6),
            _ => None,
        }
    }
}

/// A cell: failures of one tick at a moment, on a plain or a calibrated rig.
#[derive(Clone, Copy, Debug)]
struct Cell<'a> {
    moment: Moment,
    failures: &'a [Failure],
    is_calibrated: bool,
}

impl Cell<'_> {
    fn missed(&self) -> u32 {
        if self.failures.contains(&Failure::MissedTicks) {
            MISSED
        } else {
            0
        }
    }

    /// Number of the tick of the failure.
    fn tick(&self) -> u64 {
        AT + u64::from(self.missed())
    }

    /// The faults of the rig: the failures first, because the first fault of a kind counts.
    fn faults(&self) -> Vec<(Range<u64>, Fault)> {
        let now = self.tick()..self.tick() + 1;
        let failures = self.failures.iter().filter_map(|failure| failure.fault());
        let mut faults: Vec<_> = failures.map(|fault| (now.clone(), fault)).collect();
        let until = self.tick() + 1;
        match self.moment {
            Moment::Enabling => faults.push((ARM..until, Fault::PendingEnable)),
            Moment::Tripped => faults.push(earlier_trip()),
            Moment::Clearing => {
                faults.push(earlier_trip());
                faults.push((AT - 2..until + 1, Fault::PendingClear));
            }
            _ => {}
        }
        faults
    }

    /// The requests of a tick.
    fn requests(&self, tick: u64) -> Vec<Request> {
        let arm = || vec![Request::Arm];
        let start = |ticks| vec![Request::Arm, Request::Start(self.program(ticks))];
        match (self.moment, tick) {
            (Moment::BeginsToEnable, tick) if tick == AT - 49 => arm(),
            (Moment::Judging | Moment::Enabling | Moment::Armed, ARM) => arm(),
            (Moment::Running | Moment::Settling | Moment::Tripped | Moment::Clearing, ARM) => {
                start(u64::MAX)
            }
            (Moment::Completing, ARM) => start(AT - ARM + 1),
            (Moment::Settling, tick) if tick == AT - 5 => vec![Request::Finish],
            (Moment::Clearing, tick) if tick == AT - 2 => vec![Request::Clear],
            _ => Vec::new(),
        }
    }

    /// A constant current, or the request that fails.
    fn program(&self, ticks: u64) -> Box<CurrentProgram<impl FnMut(u64) -> f64 + Send + use<>>> {
        let failing = self
            .failures
            .iter()
            .find_map(|failure| failure.requested_a());
        let current_a = move |tick| match (tick == AT - ARM, failing) {
            (true, Some(failing_a)) => failing_a,
            (true, None) | (false, _) => CURRENT_A,
        };
        Box::new(CurrentProgram(current_a, ticks))
    }

    fn bench(&self) -> Bench {
        let healthy_ticks = match self.moment {
            Moment::Judging | Moment::BeginsToEnable => 50,
            _ => 0,
        };
        let bench = Bench::still(&stage(), &self.faults())
            .with_ramps(20)
            .with_healthy_ticks(healthy_ticks);
        if !self.is_calibrated {
            bench
        } else {
            bench.with_correction(Correction {
                current_gain: 1.2,
                current_offset_a: 0.02,
                probe_gain: 0.85,
                probe_offset_m: 2e-6,
            })
        }
    }

    /// The state after the tick of a failure that does not concern it.
    fn state_without_trip(&self) -> State {
        match self.moment {
            Moment::Disarmed => State::Disarmed,
            Moment::Judging | Moment::Enabling => State::Enabling,
            Moment::BeginsToEnable | Moment::Armed => State::Armed,
            Moment::Running => State::Running,
            Moment::Settling | Moment::Completing => State::Settling,
            Moment::Tripped | Moment::Clearing => State::Tripped,
        }
    }

    /// Serves the cell and checks it; returns the trip in the tick of the failure.
    fn check(&self) -> Option<Trip> {
        let mut bench = self.bench();
        for tick in 0..AT {
            (self.requests(tick).into_iter()).for_each(|request| bench.request(request));
            bench.tick();
        }
        let record = bench.late_tick(self.missed());
        assert_eq!(record.tick, self.tick());
        let state = bench.state();
        bench.run(3);
        let trip = trip_at(&bench, self.tick());
        let concerning: Vec<&Failure> = (self.failures.iter())
            .filter(|failure| failure.concerns(self.moment))
            .collect();
        match trip {
            Some(trip) => {
                let is_explained = concerning.iter().any(|failure| failure.explains(&trip));
                assert!(is_explained, "{self:?}: {trip:?}");
                assert_eq!(
                    (state, bench.state()),
                    (State::Tripped, State::Tripped),
                    "{self:?}"
                );
                self.check_tripped(&bench);
                // Writing a file takes longer than everything else here.
                if self.failures.len() == 1 {
                    bench.assert_recording_complete(self.tick(), trip.reason());
                }
            }
            None => {
                assert!(concerning.is_empty(), "{self:?}: no trip");
                assert_eq!(state, self.state_without_trip(), "{self:?}");
                self.check_without_trip(&bench);
            }
        }
        trip
    }

    /// Current flows in a run only. While the amplifier is off it receives no command. A reset that was pending ends disarmed.
    fn check_without_trip(&self, bench: &Bench) {
        for record in bench.ticks().iter() {
            let runs = matches!(record.state, State::Running | State::Settling);
            assert!(runs || record.command_a == 0.0, "{self:?}: {record:?}");
        }
        match self.moment {
            Moment::Disarmed | Moment::Tripped | Moment::Clearing => self.check_off(bench),
            _ => {}
        }
        if self.moment == Moment::Clearing {
            assert_eq!(bench.state(), State::Disarmed, "{self:?}: after the reset");
        }
    }

    /// From the tick of the trip on: zero current, disabled as the last call, no command afterwards.
    fn check_tripped(&self, bench: &Bench) {
        let calls = self.calls_since(bench);
        assert!(
            matches!(calls.last(), Some((tick, AmplifierCall::Disable)) if *tick == self.tick()),
            "{self:?}: {calls:?}"
        );
        self.check_zero(bench);
    }

    /// An amplifier that is off receives no call.
    fn check_off(&self, bench: &Bench) {
        let calls = self.calls_since(bench);
        assert!(calls.is_empty(), "{self:?}: {calls:?}");
        self.check_zero(bench);
    }

    fn calls_since(&self, bench: &Bench) -> Vec<(u64, AmplifierCall)> {
        let calls = bench.amplifier_calls().into_iter();
        calls.filter(|(tick, _)| *tick >= self.tick()).collect()
    }

    fn check_zero(&self, bench: &Bench) {
        for record in bench
            .ticks()
            .iter()
            .filter(|record| record.tick >= self.tick())
        {
            assert_eq!(record.command_a, 0.0, "{self:?}");
        }
    }
}

/// A fault that trips before the failures.
fn earlier_trip() -> (Range<u64>, Fault) {
    (AT - 5..AT - 4, Fault::Validity(Validity::Faulty))
}

fn trip_at(bench: &Bench, tick: u64) -> Option<Trip> {
    let events = bench.trips();
    let event = events.iter().find(|event| event.tick == tick)?;
    match event.kind {
        EventKind::Trip(trip) => Some(trip),
        _ => None,
    }
}

/// Checks all cells of these failures; returns the number of trips.
fn check_all(failures: &[Failure]) -> usize {
    let mut trips = 0;
    for moment in MOMENTS {
        for is_calibrated in [false, true] {
            let cell = Cell {
                moment,
                failures,
                is_calibrated,
            };
            let trip = cell.check();
            assert_eq!(trip, cell.check(), "{cell:?}: the same cause in every run");
            trips += usize::from(trip.is_some());
        }
    }
    trips
}

#[test]
fn each_failure_trips_in_each_state_that_it_concerns() {
    let trips: usize = FAILURES.iter().map(|&failure| check_all(&[failure])).sum();
    // 6 failures of 7 moments, 3 commands of 5, 1 status and 2 requests of 3, and 3 while enabling; plain and calibrated.
    assert_eq!(trips, 2 * (6 * 7 + 3 * 5 + 3 * 3 + 3));
}

#[test]
fn two_failures_in_one_tick_trip_in_each_state_that_one_of_them_concerns() {
    let (mut trips, mut concerned) = (0, 0);
    for (index, &first) in FAILURES.iter().enumerate() {
        for &second in &FAILURES[index + 1..] {
            trips += check_all(&[first, second]);
            let concerns = |moment: &&Moment| first.concerns(**moment) || second.concerns(**moment);
            concerned += 2 * MOMENTS.iter().filter(concerns).count();
        }
    }
    assert_eq!(trips, concerned);
}
