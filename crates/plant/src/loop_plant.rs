//! The plant between a command and the reading of its effect, as a control loop samples it once per period.
//!
//! ```text
//!  command of tick k --delay--> hold --> amplifier --> modes --> probe measures --age--> reading of tick k
//! ```
//!
//! *Delay* is the computing delay in whole periods plus the latency of bus and drive. *Age* is the time from measurement to
//! use: latency and transport of the probe, and, for a probe with its own clock, up to its own period. Between hold and
//! sampler only the sum of both matters, d = n T + r with 0 <= r < T, and
//!
//! ```text
//!  y(k T - d) = C x((k - n - 1) T + (T - r)) = C (A x + B_i i + B_u u) at tick k - n - 1,   A, B over T - r        (r > 0)
//! ```
//!
//! which is exact. C is that of the output: the displacement q, the velocity q', or the acceleration
//!
//! ```text
//!  q'' = -w^2 q - 2 zeta w q' + b Kf i
//! ```
//!
//! with the current of the time of measurement. Without a lag of the amplifier the acceleration is discontinuous at the ticks. A
//! reading without delay is then measured before the step of its tick; an advance, a delay below 0, gives the value after it.
//!
//! A free-running probe is represented by the mean over its ages (nodes evenly over its period): its first
//! harmonic, with the delay and the roll-off of a hold. The side bands of such a probe are left out.

use nalgebra::{Complex, DMatrix};

use super::discrete::{RowResponse, zero_system};
use super::lifted::{BLOCK, LiftedMode, Output};
use super::path_responses::{Parts, PathResponses, TapResponse, add_response};
use super::{DiscretePlant, Mode, OutputKind, PlantState};

/// Nodes of the mean over a probe's period. The midpoint rule with n nodes errs by (w Tp)^2/(24 n^2): 1e-5 at w Tp = 1.
const NODES: usize = 64;

/// A remainder of a delay below this ratio of a period is rounding.
const ROUNDING: f64 = 1e-9;

/// Timing and gains between command and reading, beside the modes.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalPath {
    /// Period of the loop in seconds.
    pub period_s: f64,
    /// Bandwidth of the amplifier's current loop in hertz; infinite without a lag.
    pub amplifier_bandwidth_hz: f64,
    /// Force constant of the motor in newtons per ampere.
    pub force_constant_n_per_a: f64,
    /// Delays in seconds from a command to the position of its reading, hold and amplifier lag excluded. The response is
    /// the mean over them. A response exists for advances (above minus a period) as well, a simulation does not.
    pub delays_s: Vec<f64>,
    /// What the probe measures.
    pub output: OutputKind,
}

impl SignalPath {
    /// Evenly spread delays of a probe with its own clock, from the least delay on; the least delay alone without one.
    pub fn delays_of_probe_s(least_s: f64, probe_period_s: Option<f64>) -> Vec<f64> {
        let Some(period_s) = probe_period_s else {
            return vec![least_s];
        };
        let age_s = |i| period_s * (i as f64 + 0.5) / NODES as f64;
        (0..NODES).map(|i| least_s + age_s(i)).collect()
    }

    /// The same path with the mean delay alone: without the roll-off of a free-running probe.
    #[must_use]
    pub fn with_mean_age(&self) -> SignalPath {
        SignalPath {
            delays_s: vec![self.mean_delay_s()],
            ..self.clone()
        }
    }

    /// The same path with each delay increased, or decreased to 0 at least.
    #[must_use]
    pub fn with_added_delay(&self, delay_s: f64) -> SignalPath {
        let delays = self.delays_s.iter();
        SignalPath {
            delays_s: delays.map(|delay| (delay + delay_s).max(0.0)).collect(),
            ..self.clone()
        }
    }

    /// The mean delay in seconds.
    pub fn mean_delay_s(&self) -> f64 {
        self.delays_s.iter().sum::<f64>() / self.delays_s.len() as f64
    }

    fn discrete(&self, modes: &[Mode], span_s: f64) -> DiscretePlant {
        let (bandwidth_hz, force_constant) =
            (self.amplifier_bandwidth_hz, self.force_constant_n_per_a);
        DiscretePlant::new(modes, bandwidth_hz, force_constant, span_s)
    }
}

/// Hold, amplifier, modes, delays and the probe's own rate.
#[derive(Clone, Debug)]
pub struct LoopPlant {
    held: DiscretePlant,
    taps: Vec<Tap>,
    delay_s: f64,
}

/// The output of a mode at a time: state . [q, q'/w] + current i.
struct OutputRow {
    state: [f64; 2],
    current: f64,
}

impl OutputRow {
    fn new(mode: &Mode, path: &SignalPath) -> OutputRow {
        let (w, gain) = (mode.omega_rad_s, mode.sensor_gain);
        let rate = gain * mode.rate_scale_rad_s();
        let (state, current) = match path.output {
            OutputKind::Position => ([gain, 0.0], 0.0),
            OutputKind::Velocity => ([0.0, rate], 0.0),
            OutputKind::Acceleration => (
                [-w * w * gain, -2.0 * mode.damping_ratio * w * rate],
                gain * mode.force_gain * path.force_constant_n_per_a,
            ),
        };
        OutputRow { state, current }
    }

    /// state . column.
    fn along(&self, column: [f64; 2]) -> f64 {
        self.state[0] * column[0] + self.state[1] * column[1]
    }
}

/// The part of a reading that arrives `periods` after its tick: rows . x + current i + setpoint u.
#[derive(Clone, Debug, PartialEq)]
struct Tap {
    periods: usize,
    rows: Vec<[f64; 2]>,
    current: f64,
    setpoint: f64,
}

/// State of a [`LoopPlant`]: the state of the plant, and the delayed readings, indexed by the tick of their arrival.
#[derive(Clone, Debug)]
pub struct LoopPlantState {
    plant: PlantState,
    coming_m: Vec<f64>,
}

impl LoopPlantState {
    /// Returns to rest, without an allocation.
    pub fn clear(&mut self) {
        self.plant.current_a = 0.0;
        self.plant.states.fill([0.0; 2]);
        self.coming_m.fill(0.0);
    }
}

impl LoopPlant {
    /// The plant with these modes at the end of a signal path, for example that of a configuration.
    pub fn new(path: impl Into<SignalPath>, modes: &[Mode]) -> LoopPlant {
        LoopPlant::of(&path.into(), modes)
    }

    /// As [`LoopPlant::new`], with the mean age of all readings: without the roll-off of a free-running probe.
    pub fn with_mean_age(path: impl Into<SignalPath>, modes: &[Mode]) -> LoopPlant {
        LoopPlant::of(&path.into().with_mean_age(), modes)
    }

    /// As [`LoopPlant::new`], from a borrowed path.
    pub fn of(path: &SignalPath, modes: &[Mode]) -> LoopPlant {
        let held = path.discrete(modes, path.period_s);
        let share = 1.0 / path.delays_s.len() as f64;
        let mut taps = Vec::new();
        for delay_s in &path.delays_s {
            let tap = Tap::new(&held, path, modes, *delay_s).scaled(share);
            join(&mut taps, tap);
        }
        LoopPlant {
            held,
            taps,
            delay_s: path.mean_delay_s(),
        }
    }

    /// Length of a period in seconds.
    pub fn period_s(&self) -> f64 {
        self.held.period_s
    }

    /// Mean time in seconds from a command to the position of its reading, without hold and lag.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Response from command to reading, at w: in metres per ampere, or in m/s or m/s^2 per ampere by the output.
    pub fn response(&self, omega_rad_s: f64) -> Complex<f64> {
        let (sine, cosine) = libm::sincos(omega_rad_s * self.held.period_s);
        self.response_at(Complex::new(cosine, sine))
    }

    /// The same at z = exp(j w T).
    pub fn response_at(&self, z: Complex<f64>) -> Complex<f64> {
        let current = self.held.current_response(z);
        let taps = self.taps.iter();
        taps.map(|tap| tap.response(tap.along_modes(&self.held), z, current) * tap.arrival(z))
            .sum()
    }

    /// The part of the responses at these z = exp(j w T) that all plants at the end of this signal path have in common.
    pub fn path_responses(&self, z: &[Complex<f64>]) -> PathResponses {
        let arrivals = |tap: &Tap| Parts::of(z.iter().map(|z| tap.arrival(*z)));
        let arrivals = self.taps.iter().map(arrivals).collect();
        PathResponses::new(z, |z| self.held.current_response(z), arrivals)
    }

    /// As [`LoopPlant::response_at`] at each z, with the [`LoopPlant::path_responses`] of any plant at the end of the same signal path.
    pub fn responses_along(&self, path: &PathResponses) -> Vec<Complex<f64>> {
        let mut sums = vec![Complex::new(0.0, 0.0); path.len()];
        for (tap, arrivals) in self.taps.iter().zip(&path.arrivals) {
            for (index, mode) in tap.along_modes(&self.held).enumerate() {
                let (current, setpoint) = tap.direct_of_mode(index);
                let tap = TapResponse {
                    mode,
                    current,
                    setpoint,
                };
                add_response(&mut sums, tap, path, arrivals);
            }
        }
        sums
    }

    /// x+ = A x + B u, y = C x with the states [i, q1, q1'/w1, q2, ..., next reading, the one after it, ...].
    pub fn state_space(&self) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
        let (a0, b0, _) = self.held.state_space();
        let (moving, register) = (a0.nrows(), self.longest());
        let (mut a, mut b, mut c) = zero_system(moving + register);
        a.view_mut((0, 0), (moving, moving)).copy_from(&a0);
        b.view_mut((0, 0), (moving, 1)).copy_from(&b0);
        for place in 1..register {
            a[(moving + place - 1, moving + place)] = 1.0;
        }
        for tap in &self.taps {
            match tap.periods.checked_sub(1) {
                Some(place) => {
                    b[(moving + place, 0)] += tap.setpoint;
                    tap.add_row(&mut a, moving + place);
                }
                None => tap.add_row(&mut c, 0),
            }
        }
        if register > 0 {
            c[(0, moving)] += 1.0;
        }
        (a, b, c)
    }

    /// The state at rest.
    pub fn at_rest(&self) -> LoopPlantState {
        LoopPlantState {
            plant: self.held.at_rest(),
            coming_m: vec![0.0; self.longest() + 1],
        }
    }

    /// The reading of this tick in metres.
    pub fn reading_m(&self, state: &LoopPlantState) -> f64 {
        let now = self.taps.iter().filter(|tap| tap.periods == 0);
        state.coming_m[0] + now.map(|tap| tap.output_m(&state.plant, 0.0)).sum::<f64>()
    }

    /// Advances the state by one period, with the command of this tick.
    pub fn step(&self, state: &mut LoopPlantState, command_a: f64) {
        for tap in self.taps.iter().filter(|tap| tap.periods > 0) {
            state.coming_m[tap.periods] += tap.output_m(&state.plant, command_a);
        }
        state.coming_m.rotate_left(1);
        state.coming_m[self.longest()] = 0.0;
        self.held.step(&mut state.plant, command_a, |_| 0.0);
    }

    /// The readings of all ticks from rest, in metres, of a known sequence of commands in amperes: those of
    /// [`LoopPlant::reading_m`] and [`LoopPlant::step`] at each tick but for rounding, and faster. With an advance, which
    /// a loop cannot read, they are the readings that belong to the response.
    pub fn readings_m(&self, commands_a: &[f64]) -> Vec<f64> {
        let mut readings_m = vec![0.0; commands_a.len() + BLOCK + self.longest()];
        for (index, mode) in self.held.modes.iter().enumerate() {
            let outputs: Vec<Output> = self.taps.iter().map(|tap| tap.of_mode(index)).collect();
            let mode = LiftedMode::new(mode, self.held.lag, &outputs);
            mode.add_to(&mut readings_m, commands_a);
        }
        readings_m.truncate(commands_a.len());
        readings_m
    }

    /// Periods of the longest tap.
    fn longest(&self) -> usize {
        self.taps.iter().map(|tap| tap.periods).max().unwrap_or(0)
    }
}

impl Tap {
    fn new(held: &DiscretePlant, path: &SignalPath, modes: &[Mode], delay_s: f64) -> Tap {
        let ratio = delay_s / held.period_s;
        let whole = libm::floor(ratio + ROUNDING);
        let rest = ratio - whole;
        let outputs = modes.iter().map(|mode| OutputRow::new(mode, path));
        let outputs: Vec<OutputRow> = outputs.collect();
        if rest > ROUNDING {
            let within = path.discrete(modes, held.period_s * (1.0 - rest));
            return Tap::within_period(&within, &outputs, (whole + 1.0) as usize);
        }
        Tap {
            periods: whole as usize,
            rows: outputs.iter().map(|output| output.state).collect(),
            current: outputs.iter().map(|output| output.current).sum(),
            setpoint: 0.0,
        }
    }

    /// The reading within a period, after the time span of `within`.
    fn within_period(within: &DiscretePlant, outputs: &[OutputRow], periods: usize) -> Tap {
        let mut tap = Tap {
            periods,
            rows: Vec::with_capacity(outputs.len()),
            current: 0.0,
            setpoint: 0.0,
        };
        for (mode, output) in within.modes.iter().zip(outputs) {
            let [[a11, a12], [a21, a22]] = mode.a;
            tap.rows
                .push([[a11, a21], [a12, a22]].map(|column| output.along(column)));
            tap.current += output.along(mode.current) + output.current * within.lag;
            tap.setpoint += output.along(mode.setpoint) + output.current * (1.0 - within.lag);
        }
        tap
    }

    fn scaled(self, share: f64) -> Tap {
        let rows = self.rows.iter().map(|row| row.map(|c| c * share));
        Tap {
            rows: rows.collect(),
            current: self.current * share,
            setpoint: self.setpoint * share,
            ..self
        }
    }

    /// The response of each mode along its row.
    fn along_modes(&self, held: &DiscretePlant) -> impl Iterator<Item = RowResponse> {
        let rows = self.rows.iter().zip(&held.modes);
        rows.map(|(row, mode)| mode.along(*row))
    }

    /// The response at z without the whole periods of the delay, with its [`Tap::along_modes`] and the
    /// [`DiscretePlant::current_response`] there.
    fn response(
        &self,
        modes: impl Iterator<Item = RowResponse>,
        z: Complex<f64>,
        current: Complex<f64>,
    ) -> Complex<f64> {
        let moved: Complex<f64> = modes.map(|mode| mode.at(z, current)).sum();
        moved + current * self.current + self.setpoint
    }

    /// The whole periods of the delay: z^-periods.
    fn arrival(&self, z: Complex<f64>) -> Complex<f64> {
        z.powi(-(self.periods as i32))
    }

    fn output_m(&self, state: &PlantState, setpoint_a: f64) -> f64 {
        let rows = self.rows.iter().zip(&state.states);
        let moved: f64 = rows.map(|(c, x)| c[0] * x[0] + c[1] * x[1]).sum();
        moved + self.current * state.current_a + self.setpoint * setpoint_a
    }

    /// The parts of the current and of the set-point, which are those of all modes, with the first one.
    fn direct_of_mode(&self, index: usize) -> (f64, f64) {
        match index {
            0 => (self.current, self.setpoint),
            _ => (0.0, 0.0),
        }
    }

    /// The part of one mode, see [`Tap::direct_of_mode`].
    fn of_mode(&self, index: usize) -> Output {
        let (current, setpoint) = self.direct_of_mode(index);
        Output {
            periods: self.periods,
            row: self.rows[index],
            current,
            setpoint,
        }
    }

    fn add_row(&self, matrix: &mut DMatrix<f64>, row: usize) {
        matrix[(row, 0)] += self.current;
        for (index, [position, rate]) in self.rows.iter().enumerate() {
            matrix[(row, 1 + 2 * index)] += position;
            matrix[(row, 2 + 2 * index)] += rate;
        }
    }

    fn add(&mut self, other: &Tap) {
        let rows = self.rows.iter_mut().flatten();
        for (row, other) in rows.zip(other.rows.iter().flatten()) {
            *row += other;
        }
        self.current += other.current;
        self.setpoint += other.setpoint;
    }
}

/// Adds a tap to the one that arrives at the same time, or as a new one.
fn join(taps: &mut Vec<Tap>, tap: Tap) {
    match taps.iter_mut().find(|other| other.periods == tap.periods) {
        Some(other) => other.add(&tap),
        None => taps.push(tap),
    }
}

#[cfg(test)]
mod tests;
