//! Following error of the current: whether the measured current follows the commands.
//!
//! A drive that no longer takes set-points keeps its last current, and may report no fault. The measured current reveals it:
//! over a window it must stay within the commands of this window and the previous one, and it must move if the commands moved
//! considerably.

use bench_hal::Tick;

use super::arming::Trip;

/// A constant measured current is an error if the commands moved by more than this multiple of the tolerance.
const CHANGE_RATIO: f64 = 4.0;

/// Lowest and highest current in amperes.
#[derive(Clone, Copy, Debug)]
struct Band {
    lowest_a: f64,
    highest_a: f64,
}

impl Band {
    const NONE: Band = Band {
        lowest_a: f64::INFINITY,
        highest_a: f64::NEG_INFINITY,
    };
    const ZERO: Band = Band {
        lowest_a: 0.0,
        highest_a: 0.0,
    };

    fn with(self, current_a: f64) -> Band {
        Band {
            lowest_a: self.lowest_a.min(current_a),
            highest_a: self.highest_a.max(current_a),
        }
    }

    fn with_band(self, other: Band) -> Band {
        self.with(other.lowest_a).with(other.highest_a)
    }

    fn width(self) -> f64 {
        self.highest_a - self.lowest_a
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
    /// A check with the tolerance `error_a`, in windows of `window_ns`.
    pub(super) fn new(error_a: f64, window_ns: u64) -> Self {
        FollowingError {
            error_a,
            window_ns,
            began_ns: None,
            before: Band::ZERO,
            commanded: Band::NONE,
            measured: Band::NONE,
        }
    }

    /// Discards all windows: the amplifier is off.
    pub(super) fn reset(&mut self) {
        *self = FollowingError::new(self.error_a, self.window_ns);
    }

    /// Adds the command of the previous tick and the current measured since. Checks at the end of each window.
    pub(super) fn check(&mut self, command_a: f64, actual_a: f64, now: Tick) -> Result<(), Trip> {
        // The band of the measured current would drop a value that is not a number.
        if !actual_a.is_finite() {
            return Err(Trip::CurrentNotFollowed {
                actual_a,
                command_a,
            });
        }
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

    /// A measured current beyond the commands is compared with the nearest one; a constant current with the highest.
    fn check_window(&self) -> Result<(), Trip> {
        let (measured, asked) = (self.measured, self.before.with_band(self.commanded));
        let (actual_a, command_a) = if measured.lowest_a < asked.lowest_a - self.error_a {
            (measured.lowest_a, asked.lowest_a)
        } else if measured.highest_a > asked.highest_a + self.error_a {
            (measured.highest_a, asked.highest_a)
        } else if self.is_constant() {
            (measured.highest_a, self.commanded.highest_a)
        } else {
            return Ok(());
        };
        Err(Trip::CurrentNotFollowed {
            actual_a,
            command_a,
        })
    }

    /// Whether the measured current was constant although the commands changed.
    fn is_constant(&self) -> bool {
        self.commanded.width() > CHANGE_RATIO * self.error_a && self.measured.width() < self.error_a
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
    fn rejects_nan_measured_current() {
        let actual_a = |tick: u64| if tick == 20 { f64::NAN } else { 0.0 };
        assert_eq!(first_trip(100, |_| 0.0, actual_a), Some(20));
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
                .expect("a stuck current trips");
            assert!((1000..=1150).contains(&found), "{hz} Hz: {found}");
        }
        // The commands go to zero and stay there: the measured current is outside the commands of the last two
        // windows.
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
