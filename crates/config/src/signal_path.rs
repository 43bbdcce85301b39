//! The signal path between command and reading, from the settings of loop, motor, amplifier and probe.

use super::Config;
use bench_plant::{OutputKind, SignalPath};

impl From<&Config> for SignalPath {
    fn from(config: &Config) -> SignalPath {
        let period_s = config.servo.period_s();
        let computing_s = f64::from(config.servo.computing_delay_periods) * period_s;
        let least_s = computing_s + config.amplifier.latency_s + config.probe.age_at_arrival_s();
        let probe_period_s = config.probe.rate_hz.map(|rate_hz| 1.0 / rate_hz);
        SignalPath {
            period_s,
            amplifier_bandwidth_hz: config.amplifier.bandwidth_hz,
            force_constant_n_per_a: config.motor.force_constant_n_per_a,
            delays_s: SignalPath::delays_of_probe_s(least_s, probe_period_s),
            output: OutputKind::Position,
        }
    }
}

#[cfg(test)]
mod tests {
    use bench_plant::{LoopPlant, Mode};
    use nalgebra::{Complex, DMatrix};

    use crate::{Config, Source, load};

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
    fn response_is_the_sum_of_its_aliases() {
        for sets in CASES {
            let config = config(sets);
            let chain = LoopPlant::new(&config, &[mode()]);
            for omega_rad_s in [1.0, 150.0, 949.0, 1300.0, 2800.0] {
                let (ours, exact) = (
                    chain.response(omega_rad_s),
                    by_aliases(&config, omega_rad_s),
                );
                // The midpoint rule errs by (w Tp)^2/(24 64^2) = 4e-4 at 2800 rad/s and 2.3 ms. The aliases add as
                // much again; they have more weight where the roll-off of the hold (w Tp near 2 pi) attenuates the
                // first harmonic.
                assert!(
                    (ours / exact - 1.0).norm() < 8e-4,
                    "{sets:?} at {omega_rad_s}: {ours} for {exact}"
                );
            }
        }
    }

    #[test]
    fn response_state_space_and_simulation_agree() {
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
    fn delay_is_the_sum_of_its_parts() {
        let chain = LoopPlant::new(&config(CASES[3]), &[mode()]);
        // A period of computing, 1.2 ms of transport, half the probe's period.
        assert!((chain.delay_s() - (0.001 + 0.0012 + 0.5 / 430.0)).abs() < 1e-12);
    }
}
