//! Following error of the current: does the current that the amplifier measures follow the commands?
//!
//! A drive that takes no more set-points keeps its last current and may report no fault. The measured current shows it: over
//! a window it must stay within the commands of this window and the one before, and move where the commands moved much.

use bench_hal::Tick;

use super::arming::Trip;

/// A constant current is an error once the commands have moved by this many tolerances.
const MOVED: f64 = 4.0;

/// Lowest and highest current in amperes.
#[derive(Clone, Copy, Debug)]
struct Band(f64, f64);

impl Band {
    const NONE: Band = Band(f64::INFINITY, f64::NEG_INFINITY);

    fn with(self, current_a: f64) -> Band {
        Band(self.0.min(current_a), self.1.max(current_a))
    }

    fn width(self) -> f64 {
        self.1 - self.0
    }
}

/// Bands of commanded and measured currents, window by window.
#[derive(Clone, Copy, Debug)]
pub(super) struct FollowingError {
    error_a: f64,
    window_ns: u64,
    began_ns: Option<u64>,
    before: Band,
    commanded: Band,
    measured: Band,
}

impl FollowingError {
    /// Currents may differ by `error_a` over a window.
    pub(super) fn new(error_a: f64, window_ns: u64) -> Self {
        let (before, commanded, measured) = (Band(0.0, 0.0), Band::NONE, Band::NONE);
        FollowingError {
            error_a,
            window_ns,
            began_ns: None,
            before,
            commanded,
            measured,
        }
    }

    /// Discards all windows: the amplifier is off.
    pub(super) fn reset(&mut self) {
        *self = FollowingError::new(self.error_a, self.window_ns);
    }

    /// Takes the command of the last tick and the current measured since; checks at the end of each window.
    pub(super) fn check(&mut self, command_a: f64, actual_a: f64, now: Tick) -> Result<(), Trip> {
        let began_ns = *self.began_ns.get_or_insert(now.scheduled_ns);
        self.commanded = self.commanded.with(command_a);
        self.measured = self.measured.with(actual_a);
        if now.scheduled_ns.saturating_sub(began_ns) < self.window_ns {
            return Ok(());
        }
        let checked = self.check_window();
        self.before = self.commanded;
        (self.commanded, self.measured, self.began_ns) =
            (Band::NONE, Band::NONE, Some(now.scheduled_ns));
        checked
    }

    fn check_window(&self) -> Result<(), Trip> {
        let asked = self.before.with(self.commanded.0).with(self.commanded.1);
        let not_followed = |actual_a, command_a| {
            Err(Trip::CurrentNotFollowed {
                actual_a,
                command_a,
            })
        };
        let stands_still =
            self.commanded.width() > MOVED * self.error_a && self.measured.width() < self.error_a;
        match self.measured {
            Band(lowest_a, _) if lowest_a < asked.0 - self.error_a => {
                not_followed(lowest_a, asked.0)
            }
            Band(_, highest_a) if highest_a > asked.1 + self.error_a => {
                not_followed(highest_a, asked.1)
            }
            Band(_, highest_a) if stands_still => not_followed(highest_a, self.commanded.1),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of 1 ms through a window of 50 ms with a tolerance of 0.1 A: the first tick that trips.
    fn first_trip(
        ticks: u64,
        command_a: impl Fn(u64) -> f64,
        actual_a: impl Fn(u64) -> f64,
    ) -> Option<u64> {
        let mut following = FollowingError::new(0.1, 50_000_000);
        (0..ticks).find(|&number| {
            let tick = Tick {
                number,
                scheduled_ns: number * 1_000_000,
            };
            following
                .check(command_a(number), actual_a(number), tick)
                .is_err()
        })
    }

    fn sine(hz: f64, tick: f64) -> f64 {
        (std::f64::consts::TAU * hz * tick * 1e-3).sin()
    }

    #[test]
    fn accepts_a_lagging_and_quantised_current() {
        for hz in [0.3, 3.0, 30.0, 150.0] {
            let late = |tick: u64| (500.0 * sine(hz, tick as f64 - 3.3)).round() / 500.0;
            assert_eq!(
                first_trip(20_000, |tick| sine(hz, tick as f64), late),
                None,
                "{hz} Hz"
            );
        }
        let step = |tick: u64| if tick < 777 { 0.0 } else { 2.0 };
        assert_eq!(
            first_trip(5_000, step, |tick| step(tick.saturating_sub(4))),
            None
        );
    }

    #[test]
    fn trips_within_two_windows_when_a_drive_keeps_its_last_current() {
        let stuck = |hz: f64| move |tick: u64| sine(hz, tick.min(1000) as f64);
        for hz in [3.0, 30.0, 150.0] {
            let found = first_trip(5_000, |tick| sine(hz, tick as f64), stuck(hz))
                .expect("it stands still");
            assert!((1000..=1150).contains(&found), "{hz} Hz: {found}");
        }
        // The commands go to zero and stay there: outside of what was asked for in the last two windows.
        let found = first_trip(5_000, |tick| if tick < 1000 { 0.5 } else { 0.0 }, |_| 0.5);
        assert!(
            found.is_some_and(|tick| (1000..=1151).contains(&tick)),
            "{found:?}"
        );
    }

    #[test]
    fn reset_discards_earlier_windows() {
        let mut following = FollowingError::new(0.1, 50_000_000);
        let tick = |number: u64| Tick {
            number,
            scheduled_ns: number * 1_000_000,
        };
        (0..49).for_each(|n| assert!(following.check(0.0, 3.0, tick(n)).is_ok()));
        following.reset();
        (100..300).for_each(|n| assert!(following.check(0.2, 0.2, tick(n)).is_ok()));
    }
}
