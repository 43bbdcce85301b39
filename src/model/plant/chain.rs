//! The plant between a command and the reading that answers it, as a loop sees it once a period.
//!
//! ```text
//!  command of tick k --delay--> hold --> amplifier --> modes --> probe measures --age--> reading of tick k
//! ```
//!
//! *Delay* is the computing delay in whole periods and the latency of bus and drive. *Age* is how old the reading is: what
//! the probe and its line take, and, for a probe with a clock of its own, any time up to its period since its last reading
//! arrived. Between hold and sampler only the sum of both counts, d = n T + r with 0 <= r < T, and
//!
//! ```text
//!  y(k T - d) = C x((k - n - 1) T + (T - r)) = C (A x + B_i i + B_u u) at tick k - n - 1,   A, B over T - r        (r > 0)
//! ```
//!
//! which is exact. A free-running probe is the mean over its ages (nodes evenly over its period): its first harmonic, with
//! the delay and the roll-off of a hold. The side bands that such a probe also makes are left out.

use nalgebra::{Complex, DMatrix};

use super::{DiscretePlant, Mode, PlantState};
use crate::config::Config;

/// Nodes of the mean over a probe's period. The midpoint rule with n nodes errs by (w Tp)^2/(24 n^2): 1e-5 at w Tp = 1.
const NODES: usize = 64;

/// Ratios of a period below which a rest of a delay is rounding.
const ROUNDING: f64 = 1e-9;

/// Hold, amplifier, modes, delays and the probe's own rate.
#[derive(Clone, Debug)]
pub struct LoopPlant {
    held: DiscretePlant,
    taps: Vec<Tap>,
    delay_s: f64,
}

/// What arrives `periods` after the tick it comes from: rows . x + current i + setpoint u.
#[derive(Clone, Debug, PartialEq)]
struct Tap {
    periods: usize,
    rows: Vec<[f64; 2]>,
    current: f64,
    setpoint: f64,
}

/// Settings of the chain between command and reading, without the mechanics.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainSettings {
    /// Period of the loop in seconds.
    pub period_s: f64,
    /// Bandwidth of the amplifier in hertz.
    pub amplifier_bandwidth_hz: f64,
    /// Force constant of the motor in newtons per ampere.
    pub force_constant_n_per_a: f64,
    /// Delays from command to reading in seconds; the chain is the mean over them.
    pub delays_s: Vec<f64>,
}

impl ChainSettings {
    /// The chain of a configuration.
    pub fn of(config: &Config) -> ChainSettings {
        ChainSettings {
            period_s: config.servo.period_s(),
            amplifier_bandwidth_hz: config.amplifier.bandwidth_hz,
            force_constant_n_per_a: config.motor.force_constant_n_per_a,
            delays_s: delays(config),
        }
    }

    /// The same with readings that all have the mean age: without the roll-off of a free-running probe.
    pub fn with_mean_age(self) -> ChainSettings {
        let mean_s = self.delays_s.iter().sum::<f64>() / self.delays_s.len() as f64;
        ChainSettings {
            delays_s: vec![mean_s],
            ..self
        }
    }
}

impl LoopPlant {
    /// The chain of a configuration around `modes`, as the loop sees it.
    pub fn new(config: &Config, modes: &[Mode]) -> LoopPlant {
        LoopPlant::of(&ChainSettings::of(config), modes)
    }

    /// The same with readings that all have the mean age.
    pub fn with_mean_age(config: &Config, modes: &[Mode]) -> LoopPlant {
        LoopPlant::of(&ChainSettings::of(config).with_mean_age(), modes)
    }

    /// A chain around `modes`.
    pub fn of(settings: &ChainSettings, modes: &[Mode]) -> LoopPlant {
        let (bandwidth_hz, force_constant) = (
            settings.amplifier_bandwidth_hz,
            settings.force_constant_n_per_a,
        );
        let (period_s, delays) = (settings.period_s, &settings.delays_s);
        let over = |span_s: f64| DiscretePlant::new(modes, bandwidth_hz, force_constant, span_s);
        let held = over(period_s);
        let share = 1.0 / delays.len() as f64;
        let taps = delays.iter().fold(Vec::new(), |taps, d| {
            add(taps, tap(&held, &over, *d), share)
        });
        LoopPlant {
            held,
            taps,
            delay_s: delays.iter().sum::<f64>() * share,
        }
    }

    /// Length of a period in seconds.
    pub fn period_s(&self) -> f64 {
        self.held.period_s
    }

    /// Mean time in seconds from a command to the position that its reading shows, without hold and lag.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Response in metres per ampere from command to reading, at w.
    pub fn response(&self, omega_rad_s: f64) -> Complex<f64> {
        let (sine, cosine) = libm::sincos(omega_rad_s * self.held.period_s);
        self.response_at(Complex::new(cosine, sine))
    }

    /// The same at z = exp(j w T).
    pub fn response_at(&self, z: Complex<f64>) -> Complex<f64> {
        let current = self.held.current_response(z);
        let of = |tap: &Tap| {
            let moved: Complex<f64> = (tap.rows.iter().zip(&self.held.blocks))
                .map(|(row, block)| DiscretePlant::state_response(block, *row, z, current))
                .sum();
            (moved + current * tap.current + tap.setpoint) * z.powi(-(tap.periods as i32))
        };
        self.taps.iter().map(of).sum()
    }

    /// x+ = A x + B u, y = C x with the states [i, q1, q1'/w1, q2, ..., what arrives next, what after that, ...].
    pub fn state_space(&self) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
        let (moving, register) = (1 + 2 * self.held.blocks.len(), self.longest());
        let n = moving + register;
        let (a0, b0, _) = self.held.state_space();
        let (mut a, mut b, mut c) = (
            DMatrix::zeros(n, n),
            DMatrix::zeros(n, 1),
            DMatrix::zeros(1, n),
        );
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

    /// The chain at rest.
    pub fn at_rest(&self) -> ChainState {
        ChainState {
            motion: self.held.at_rest(),
            coming_m: vec![0.0; self.longest() + 1],
        }
    }

    /// The reading of this tick in metres.
    pub fn reading_m(&self, state: &ChainState) -> f64 {
        let now = self.taps.iter().filter(|tap| tap.periods == 0);
        state.coming_m[0] + now.map(|tap| tap.of(&state.motion, 0.0)).sum::<f64>()
    }

    /// One period on, with the command of this tick.
    pub fn step(&self, state: &mut ChainState, command_a: f64) {
        for tap in self.taps.iter().filter(|tap| tap.periods > 0) {
            state.coming_m[tap.periods] += tap.of(&state.motion, command_a);
        }
        state.coming_m.rotate_left(1);
        state.coming_m[self.longest()] = 0.0;
        self.held.step(&mut state.motion, command_a, |_| 0.0);
    }

    /// Periods of the longest tap.
    fn longest(&self) -> usize {
        self.taps.iter().map(|tap| tap.periods).max().unwrap_or(0)
    }
}

/// Where a chain is: its motion, and the readings on their way, by the tick at which they arrive.
#[derive(Clone, Debug)]
pub struct ChainState {
    motion: PlantState,
    coming_m: Vec<f64>,
}

/// The delays whose mean the chain is.
fn delays(config: &Config) -> Vec<f64> {
    let computing_s = f64::from(config.servo.computing_delay_periods) * config.servo.period_s();
    let youngest_s = computing_s + config.amplifier.latency_s + config.probe.age_at_arrival_s();
    match config.probe.rate_hz.map(|rate_hz| 1.0 / rate_hz) {
        None => vec![youngest_s],
        Some(period_s) => (0..NODES)
            .map(|i| youngest_s + period_s * (i as f64 + 0.5) / NODES as f64)
            .collect(),
    }
}

fn tap(held: &DiscretePlant, over: &impl Fn(f64) -> DiscretePlant, delay_s: f64) -> Tap {
    let ratio = delay_s / held.period_s;
    let whole = libm::floor(ratio + ROUNDING);
    let rest = ratio - whole;
    if rest <= ROUNDING {
        let rows = held
            .blocks
            .iter()
            .map(|block| [block.output, 0.0])
            .collect();
        return Tap {
            periods: whole as usize,
            rows,
            current: 0.0,
            setpoint: 0.0,
        };
    }
    let within = over(held.period_s * (1.0 - rest));
    let sum = |of: fn(&super::Block) -> f64| {
        within
            .blocks
            .iter()
            .map(|block| block.output * of(block))
            .sum()
    };
    Tap {
        periods: whole as usize + 1,
        rows: within
            .blocks
            .iter()
            .map(|block| block.a[0].map(|a| block.output * a))
            .collect(),
        current: sum(|block| block.current[0]),
        setpoint: sum(|block| block.setpoint[0]),
    }
}

/// `taps` with `share` of `tap`, which joins one that arrives at the same time.
fn add(mut taps: Vec<Tap>, tap: Tap, share: f64) -> Vec<Tap> {
    let rows = tap.rows.iter().map(|row| row.map(|c| c * share)).collect();
    let tap = Tap {
        rows,
        current: tap.current * share,
        setpoint: tap.setpoint * share,
        ..tap
    };
    match taps.iter_mut().find(|other| other.periods == tap.periods) {
        Some(other) => other.join(&tap),
        None => taps.push(tap),
    }
    taps
}

impl Tap {
    fn join(&mut self, other: &Tap) {
        for (mine, theirs) in self
            .rows
            .iter_mut()
            .flatten()
            .zip(other.rows.iter().flatten())
        {
            *mine += theirs;
        }
        self.current += other.current;
        self.setpoint += other.setpoint;
    }

    fn of(&self, motion: &PlantState, setpoint_a: f64) -> f64 {
        let moved: f64 = self
            .rows
            .iter()
            .zip(&motion.states)
            .map(|(c, x)| c[0] * x[0] + c[1] * x[1])
            .sum();
        moved + self.current * motion.current_a + self.setpoint * setpoint_a
    }

    fn add_row(&self, matrix: &mut DMatrix<f64>, row: usize) {
        matrix[(row, 0)] += self.current;
        for (index, [position, rate]) in self.rows.iter().enumerate() {
            matrix[(row, 1 + 2 * index)] += position;
            matrix[(row, 2 + 2 * index)] += rate;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Source, load};

    fn config(sets: &[&str]) -> Config {
        let sets = sets.iter().map(|set| set.to_string()).collect();
        load(&Source {
            sets,
            ..Source::default()
        })
        .unwrap()
    }

    fn mode() -> Mode {
        let shape = nalgebra::DVector::zeros(1);
        Mode {
            omega_rad_s: 950.0,
            damping_ratio: 0.02,
            shape,
            force_gain: 0.7,
            sensor_gain: 0.6,
            floor_gain: 1.0,
        }
    }

    /// The closed form by the aliases of sampling: G = sum over k of P(j w_k) H(j w_k) E(j w_k), w_k = w + k 2 pi/T, with the
    /// hold H = (1 - exp(-s T))/(s T), the delay exp(-s d) and the mean over the ages (1 - exp(-s Tp))/(s Tp). A free-running
    /// probe averages after sampling, so its mean has the w of each alias as well.
    fn by_aliases(config: &Config, omega_rad_s: f64) -> Complex<f64> {
        let (period_s, mode) = (config.servo.period_s(), mode());
        let delay_s = f64::from(config.servo.computing_delay_periods) * period_s
            + config.amplifier.latency_s
            + config.probe.age_at_arrival_s();
        let hold = |s: Complex<f64>, span_s: f64| {
            (Complex::new(1.0, 0.0) - (-s * span_s).exp()) / (s * span_s)
        };
        let lag = 2.0 * std::f64::consts::PI * config.amplifier.bandwidth_hz;
        (-4000..=4000)
            .map(|k| {
                let s = Complex::new(
                    0.0,
                    omega_rad_s + f64::from(k) * 2.0 * std::f64::consts::PI / period_s,
                );
                let plant =
                    mode.resonance(s) * mode.residue_per_kg() * config.motor.force_constant_n_per_a;
                let probe = config
                    .probe
                    .rate_hz
                    .map_or(Complex::new(1.0, 0.0), |rate_hz| hold(s, 1.0 / rate_hz));
                plant * lag / (s + lag) * hold(s, period_s) * (-s * delay_s).exp() * probe
            })
            .sum()
    }

    const CASES: [&[&str]; 5] = [
        &[],
        &[
            "loop.rate_hz=1000.0",
            "amplifier.latency_s=0.00037",
            "loop.computing_delay_periods=0",
        ],
        &[
            "loop.rate_hz=1000.0",
            "probe.latency_s=0.0017",
            "interlock.probe_stale_s=0.01",
        ],
        &[
            "loop.rate_hz=1000.0",
            "probe.rate_hz=430.0",
            "probe.transport_s=0.0012",
            "interlock.probe_stale_s=0.01",
        ],
        &[
            "loop.rate_hz=5000.0",
            "probe.rate_hz=3900.0",
            "amplifier.latency_s=0.0001",
            "interlock.probe_stale_s=0.01",
        ],
    ];

    #[test]
    fn the_response_is_the_sum_of_its_aliases() {
        for sets in CASES {
            let config = config(sets);
            let chain = LoopPlant::new(&config, &[mode()]);
            for omega_rad_s in [1.0, 150.0, 949.0, 1300.0, 2800.0] {
                let (ours, exact) = (
                    chain.response(omega_rad_s),
                    by_aliases(&config, omega_rad_s),
                );
                // The midpoint rule errs by (w Tp)^2/(24 64^2) = 4e-4 at 2800 rad/s and 2.3 ms; as much again of the aliases,
                // which weigh more where the hold's own roll-off (w Tp near 2 pi) leaves little of the first harmonic.
                assert!(
                    (ours / exact - 1.0).norm() < 8e-4,
                    "{sets:?} at {omega_rad_s}: {ours} for {exact}"
                );
            }
        }
    }

    #[test]
    fn response_state_space_and_simulation_are_one_chain() {
        for sets in CASES {
            let chain = LoopPlant::new(&config(sets), &[mode()]);
            let (a, b, c) = chain.state_space();
            let (mut x, mut state) = (DMatrix::zeros(a.nrows(), 1), chain.at_rest());
            for tick in 0..200 {
                let command_a = f64::from(tick % 7) - 2.5;
                let (by_matrix, by_steps) = ((&c * &x)[(0, 0)], chain.reading_m(&state));
                // Two hundred steps of numbers below 1e-3, rounded at 1e-16 each.
                assert!(
                    (by_matrix - by_steps).abs() < 1e-16,
                    "{sets:?} tick {tick}: {by_matrix} {by_steps}"
                );
                x = &a * &x + &b * command_a;
                chain.step(&mut state, command_a);
            }
            let z = Complex::new(f64::cos(0.7), f64::sin(0.7));
            let complex = |m: &DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
            let inside = DMatrix::identity(a.nrows(), a.nrows()) * z - complex(&a);
            let direct = (complex(&c) * inside.lu().solve(&complex(&b)).unwrap())[(0, 0)];
            assert!(
                (chain.response(0.7 / chain.period_s()) / direct - 1.0).norm() < 1e-9,
                "{sets:?}"
            );
        }
    }

    #[test]
    fn the_delay_is_the_sum_of_its_parts() {
        let chain = LoopPlant::new(&config(CASES[3]), &[mode()]);
        // A period of computing, 1.2 ms of transport, half the probe's period.
        assert!((chain.delay_s() - (0.001 + 0.0012 + 0.5 / 430.0)).abs() < 1e-12);
    }
}
