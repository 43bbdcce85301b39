//! The extremes of current and travel of an excitation, by the model of the plant.

use serde::Serialize;

use super::limits::Limits;
use super::waveform::Excitation;
use bench_base::numeric::larger;

/// The extremes of an excitation. An extreme is not a number if a value of any tick is not a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Extremes {
    /// Largest travel in metres.
    pub travel_m: f64,
    /// The tick of the largest travel.
    #[serde(skip)]
    pub travel_tick: u64,
    /// Largest current in amperes.
    pub current_a: f64,
    /// RMS of the current in amperes over the whole run, including the zero current before and after.
    pub rms_current_a: f64,
    /// Largest thermal current in amperes.
    pub thermal_current_a: f64,
    /// Largest change of the current in amperes per second.
    pub slew_a_per_s: f64,
    /// Length of the run in seconds, including the zero current before and after.
    pub duration_s: f64,
}

impl Extremes {
    /// Runs the whole excitation. `position_m` is the model of the plant: it takes the command of each tick and returns the
    /// position after it.
    pub fn of(
        excitation: &(impl Excitation + ?Sized),
        limits: &Limits,
        mut position_m: impl FnMut(f64) -> f64,
    ) -> Extremes {
        let signals = (0..excitation.ticks()).map(|tick| {
            let command_a = excitation.current_a(tick);
            (command_a, position_m(command_a))
        });
        Extremes::over(signals, limits)
    }

    /// The extremes of commands (A) and positions (m), one pair for each tick.
    pub fn over(signals: impl Iterator<Item = (f64, f64)>, limits: &Limits) -> Extremes {
        let period_s = limits.period_s;
        let mut running = RunningExtremes::new(limits);
        signals.for_each(|(command_a, position_m)| running.push(command_a, position_m));
        let ticks = running.ticks;
        Extremes {
            rms_current_a: (running.square_a2 / ticks.max(1) as f64).sqrt(),
            duration_s: ticks as f64 * period_s,
            ..running.extremes
        }
    }
}

/// Extremes of the ticks so far.
struct RunningExtremes {
    extremes: Extremes,
    period_s: f64,
    cooling: f64,
    before_a: f64,
    square_a2: f64,
    heat_a2: f64,
    ticks: u64,
}

impl RunningExtremes {
    fn new(limits: &Limits) -> RunningExtremes {
        RunningExtremes {
            extremes: Extremes::default(),
            period_s: limits.period_s,
            cooling: limits.period_s / limits.thermal_time_constant_s,
            before_a: 0.0,
            square_a2: 0.0,
            heat_a2: 0.0,
            ticks: 0,
        }
    }

    fn push(&mut self, command_a: f64, position_m: f64) {
        self.push_command(command_a);
        let travel_m = larger(self.extremes.travel_m, position_m.abs());
        if travel_m > self.extremes.travel_m {
            self.extremes.travel_tick = self.ticks;
        }
        self.extremes.travel_m = travel_m;
        self.ticks += 1;
    }

    fn push_command(&mut self, command_a: f64) {
        let extremes = &mut self.extremes;
        let slew_a_per_s = (command_a - self.before_a).abs() / self.period_s;
        extremes.current_a = larger(extremes.current_a, command_a.abs());
        extremes.slew_a_per_s = larger(extremes.slew_a_per_s, slew_a_per_s);
        self.before_a = command_a;
        self.square_a2 += command_a * command_a;
        self.heat_a2 += self.cooling * (command_a * command_a - self.heat_a2);
        extremes.thermal_current_a = larger(extremes.thermal_current_a, self.heat_a2.sqrt());
    }
}
