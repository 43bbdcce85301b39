//! Responses of each kind of output against closed forms and a dense matrix exponential.

use nalgebra::DVector;

use super::*;

const PERIOD_S: f64 = 1e-3;
const OMEGA_RAD_S: f64 = 300.0;
const DAMPING_RATIO: f64 = 0.02;
const FORCE_CONSTANT_N_PER_A: f64 = 11.0;
/// Up to 0.45 of the rate.
const FREQUENCIES_RAD_S: [f64; 4] = [50.0, 290.0, 301.0, 0.9 * std::f64::consts::PI / PERIOD_S];

fn mode() -> Mode {
    Mode {
        omega_rad_s: OMEGA_RAD_S,
        damping_ratio: DAMPING_RATIO,
        shape: DVector::zeros(0),
        force_gain: 0.7,
        sensor_gain: 0.6,
        floor_gain: 0.0,
    }
}

fn plant(output: OutputKind, amplifier_bandwidth_hz: f64, delay_s: f64) -> LoopPlant {
    let path = SignalPath {
        delays_s: vec![delay_s],
        ..path(output, amplifier_bandwidth_hz)
    };
    LoopPlant::of(&path, &[mode()])
}

/// A path without a delay.
fn path(output: OutputKind, amplifier_bandwidth_hz: f64) -> SignalPath {
    SignalPath {
        period_s: PERIOD_S,
        amplifier_bandwidth_hz,
        force_constant_n_per_a: FORCE_CONSTANT_N_PER_A,
        delays_s: vec![0.0],
        output,
    }
}

fn z_at(omega_rad_s: f64) -> Complex<f64> {
    Complex::from_polar(1.0, omega_rad_s * PERIOD_S)
}

/// The response without a lag by the pole p: x' = p x + f, q = Im x/Im p, q' = Im(p x)/Im p, q'' = Im(p^2 x)/Im p + f, with f held and
/// x[k + 1] = e x[k] + (e - 1)/p f[k], e = exp(p T). The reading of tick k is that at `after` periods after the tick k - `ticks`; at a tick
/// itself the force is that of the tick before.
fn closed_form(output: OutputKind, z: Complex<f64>, ticks: i32, after: f64) -> Complex<f64> {
    let damped = (1.0 - DAMPING_RATIO * DAMPING_RATIO).sqrt();
    let pole = Complex::new(-DAMPING_RATIO, damped) * OMEGA_RAD_S;
    let power = output.derivatives();
    let part = |p: Complex<f64>| {
        let (e, within) = ((p * PERIOD_S).exp(), (p * PERIOD_S * after).exp());
        let x = (e - 1.0) / p / (z - e);
        p.powi(power) * (within * x + (within - 1.0) / p)
    };
    let modal = (part(pole) - part(pole.conj())) / Complex::new(0.0, 2.0 * pole.im);
    // The constants of both parts hold the force within the period.
    let direct = match output {
        OutputKind::Acceleration if after > 0.0 => Complex::new(1.0, 0.0),
        OutputKind::Acceleration => z.inv(),
        OutputKind::Position | OutputKind::Velocity => Complex::new(0.0, 0.0),
    };
    (modal + direct) * z.powi(-ticks) * (0.42 * FORCE_CONSTANT_N_PER_A)
}

fn assert_responses(plant: &LoopPlant, expected: impl Fn(Complex<f64>) -> Complex<f64>) {
    for omega_rad_s in FREQUENCIES_RAD_S {
        let found = plant.response(omega_rad_s);
        let expected = expected(z_at(omega_rad_s));
        // The exponential is accurate to some 1e-15 of its largest element, 1; at 0.45 of the rate the response of a position is 2e-3 of
        // its parts.
        let error = (found - expected).norm() / expected.norm();
        assert!(error < 1e-11, "{omega_rad_s} rad/s: {found} {expected}");
    }
}

#[test]
fn held_force_without_a_lag_has_the_closed_form_of_each_output() {
    for output in OutputKind::ALL {
        let at = |delay_periods: f64| plant(output, f64::INFINITY, delay_periods * PERIOD_S);
        assert_responses(&at(0.0), |z| closed_form(output, z, 0, 0.0));
        assert_responses(&at(2.0), |z| closed_form(output, z, 2, 0.0));
        assert_responses(&at(1.3), |z| closed_form(output, z, 2, 0.7));
    }
}

#[test]
fn acceleration_with_an_advance_is_that_after_the_step_of_the_force() {
    let output = OutputKind::Acceleration;
    assert_responses(&plant(output, f64::INFINITY, -0.25 * PERIOD_S), |z| {
        closed_form(output, z, 0, 0.25)
    });
    let [before, after] = [0.0, -1e-6].map(|d| plant(output, f64::INFINITY, d * PERIOD_S));
    for omega_rad_s in FREQUENCIES_RAD_S {
        let step = after.response(omega_rad_s) - before.response(omega_rad_s);
        let force = (Complex::new(1.0, 0.0) - z_at(omega_rad_s).inv()) * 4.62;
        // An advance of 1e-9 s changes the acceleration of the modes by w/(2 zeta) 1e-9 s, 1e-5, of the force.
        assert!((step - force).norm() < 1e-4, "{step} {force}");
    }
}

/// Reading of tick k = C x(k T - d) with the states [q, q', i] and scipy.linalg.expm of [[A, B], [0, 0]] t (scipy 1.17.1); amplifier of
/// 200 Hz.
#[test]
fn lagging_force_has_the_response_of_a_dense_matrix_exponential() {
    let cases = [
        (
            OutputKind::Position,
            0.0,
            290.0,
            (0.0004046671555839217, -0.000514906536659188),
        ),
        (
            OutputKind::Position,
            0.0,
            900.0 * std::f64::consts::PI,
            (2.16844897749909e-07, 7.666697723946246e-08),
        ),
        (
            OutputKind::Position,
            1.3e-3,
            290.0,
            (0.00018669296135049955, -0.0006277196050244576),
        ),
        (
            OutputKind::Position,
            1.3e-3,
            900.0 * std::f64::consts::PI,
            (-1.9427829546244026e-07, -7.571359914888495e-08),
        ),
        (
            OutputKind::Velocity,
            0.0,
            290.0,
            (0.1493250334489232, 0.11735019257482845),
        ),
        (
            OutputKind::Velocity,
            0.0,
            900.0 * std::f64::consts::PI,
            (-0.0003126630063877746, 0.00013665528323498469),
        ),
        (
            OutputKind::Velocity,
            1.3e-3,
            290.0,
            (0.18204467338725996, 0.05415191443465192),
        ),
        (
            OutputKind::Velocity,
            1.3e-3,
            900.0 * std::f64::consts::PI,
            (-0.00022659415667286556, -0.0003640402775545399),
        ),
        (
            OutputKind::Acceleration,
            0.0,
            290.0,
            (-34.0546787631495, 43.16866096841001),
        ),
        (
            OutputKind::Acceleration,
            0.0,
            900.0 * std::f64::consts::PI,
            (-2.5330841640658974, -0.6380746096796082),
        ),
        (
            OutputKind::Acceleration,
            1.3e-3,
            290.0,
            (-15.684331287128666, 52.80580383938625),
        ),
        (
            OutputKind::Acceleration,
            1.3e-3,
            900.0 * std::f64::consts::PI,
            (1.5155065576003428, 0.7747068116297148),
        ),
    ];
    for (output, delay_s, omega_rad_s, (re, im)) in cases {
        let found = plant(output, 200.0, delay_s).response(omega_rad_s);
        let expected = Complex::new(re, im);
        // As above; of the expected numbers too.
        let error = (found - expected).norm() / expected.norm();
        assert!(error < 1e-10, "{output:?} {delay_s} {omega_rad_s}: {found}");
    }
}

#[test]
fn state_space_has_the_response_of_each_output() {
    for output in OutputKind::ALL {
        for delay_s in [0.0, 1.3e-3] {
            let plant = plant(output, 200.0, delay_s);
            let (a, b, c) = plant.state_space();
            let complex = |m: DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
            let (b, c) = (complex(b), complex(c));
            for omega_rad_s in FREQUENCIES_RAD_S {
                let n = a.nrows();
                let matrix = DMatrix::identity(n, n) * z_at(omega_rad_s) - complex(a.clone());
                let direct = (&c * matrix.lu().solve(&b).expect("no pole"))[(0, 0)];
                let error = (plant.response(omega_rad_s) - direct).norm() / direct.norm();
                assert!(error < 1e-10, "{output:?} {delay_s} {omega_rad_s}: {error}");
            }
        }
    }
}

/// A free body and two modes.
fn several_modes() -> [Mode; 3] {
    let term = |w, zeta, residue_per_kg| Mode {
        sensor_gain: residue_per_kg,
        ..Mode::unit(w, zeta)
    };
    [
        term(0.0, 0.0, 0.3),
        term(120.0, 0.01, 0.5),
        term(OMEGA_RAD_S, DAMPING_RATIO, -0.4),
    ]
}

/// A sweep from 0 to 120 Hz in 2 s with a constant part; no whole number of blocks.
fn sweep_a() -> Vec<f64> {
    let phase = |t: f64| 2.0 * std::f64::consts::PI * 30.0 * t * t;
    (0..2002)
        .map(|k| 0.1 + phase(f64::from(k) * PERIOD_S).sin())
        .collect()
}

fn readings_one_by_one(plant: &LoopPlant, commands_a: &[f64]) -> Vec<f64> {
    let mut state = plant.at_rest();
    let next = |command_a: &f64| {
        let reading_m = plant.reading_m(&state);
        plant.step(&mut state, *command_a);
        reading_m
    };
    commands_a.iter().map(next).collect()
}

fn assert_readings(found: &[f64], expected: &[f64], what: &str) {
    // A step rounds a state by some 4 times 1.1e-16 of its largest value. N such errors add up at most: in the position of a mode
    // directly, in that of a free body through its velocity, whose error moves it during the steps that follow, as the velocity itself
    // does. So the difference of two ways is below 2 * 4 * 1.1e-16 N of the largest state, which is at most some 10 times the largest
    // reading: 1.8e-11 with N = 2002.
    let largest = expected.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
    assert!(largest > 0.0 && found.len() == expected.len(), "{what}");
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs() / largest;
        assert!(error < 1.8e-11, "{what}, tick {k}: {found} {expected}");
    }
}

#[test]
fn readings_of_a_sequence_are_those_of_its_ticks() {
    let delays = [0.0, 0.4, 1.0, 2.3].map(|periods| vec![periods * PERIOD_S]);
    // A probe with its own clock, of 1.7 periods: its readings arrive after one to three ticks, or at the tick itself without a least delay.
    let probes = [0.0, 0.6].map(|periods| {
        let mut delays_s = SignalPath::delays_of_probe_s(periods * PERIOD_S, Some(1.7 * PERIOD_S));
        delays_s.push(0.0);
        delays_s
    });
    for output in OutputKind::ALL {
        for amplifier_bandwidth_hz in [200.0, f64::INFINITY] {
            for delays_s in delays.iter().chain(&probes).cloned() {
                let what = format!("{output:?} {amplifier_bandwidth_hz} Hz {delays_s:?}");
                let path = SignalPath {
                    delays_s,
                    ..path(output, amplifier_bandwidth_hz)
                };
                let plant = LoopPlant::of(&path, &several_modes());
                let expected = readings_one_by_one(&plant, &sweep_a());
                assert_readings(&plant.readings_m(&sweep_a()), &expected, &what);
            }
        }
    }
}

#[test]
fn readings_with_an_advance_are_those_of_the_next_tick_with_a_delay() {
    for output in OutputKind::ALL {
        let readings_m = |periods: f64| {
            let plant = plant(output, 200.0, periods * PERIOD_S);
            plant.readings_m(&sweep_a())
        };
        let (early, late) = (readings_m(-0.25), readings_m(0.75));
        assert_readings(&early[..2001], &late[1..], &format!("{output:?}"));
    }
}

#[test]
fn sequence_that_ends_before_the_first_arrival_has_readings_of_rest() {
    let plant = plant(OutputKind::Position, 200.0, 5.3 * PERIOD_S);
    assert_eq!(plant.readings_m(&[1.0; 3]), [0.0; 3]);
    assert!(plant.readings_m(&[]).is_empty());
}

/// Responses at many frequencies are those at one of them, and have the same bits however many are computed side by side.
#[test]
fn responses_along_a_path_are_those_at_each_frequency() {
    let outputs = [
        OutputKind::Position,
        OutputKind::Velocity,
        OutputKind::Acceleration,
    ];
    let z: Vec<Complex<f64>> = (1..=37).map(|k| z_at(75.0 * f64::from(k))).collect();
    for output in outputs {
        let path = SignalPath {
            delays_s: vec![0.3 * PERIOD_S, 1.7 * PERIOD_S],
            ..path(output, 600.0)
        };
        let plant = LoopPlant::of(&path, &several_modes());
        let found = plant.responses_along(&plant.path_responses(&z));
        assert_eq!(found.len(), z.len());
        for (found, z) in found.iter().zip(&z) {
            let exact = plant.response_at(*z);
            // Some ten roundings of parts that nearly cancel between the modes.
            assert!((found - exact).norm() < 1e-12 * exact.norm(), "{output:?}");
            let alone = plant.responses_along(&plant.path_responses(&[*z]));
            assert_eq!(*found, alone[0], "{output:?}");
        }
    }
}
