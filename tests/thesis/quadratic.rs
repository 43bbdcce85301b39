//! The simulated stage with nonlinear constraints: agreement with Lagrange multipliers, the limit of small amplitudes, and the amplitude
//! up to which a chirp measures the linear response.

use serde_json::json;

use crate::program::{Bench, near, number};
use crate::recording::Recording;
use crate::truth;

/// No noise, no quantisation, no floor vibration, no unmodelled modes.
const CLEAN: &str = "--set sim.probe_noise_rms_m=0 --set sim.probe_quantisation_m=0 --set sim.floor=[] --set sim.unmodelled=[]";

/// A short sweep through all modes at 1 kHz.
const SHORT: &str = "--set loop.rate_hz=1000 --set chirp.quiet_before_s=0.05 --set chirp.quiet_after_s=0.05 --set chirp.fade_in_s=0.05 --set chirp.fade_out_s=0.05 --sweep linear --start 15 --stop 120 --duration 0.6";

/// Commands in amperes and positions in metres of all ticks.
fn commands_and_positions(bench: &Bench, options: &str) -> (Vec<f64>, Vec<f64>) {
    let answer = bench.json(&format!("chirp {options}"));
    let recording = Recording::open(&bench.path(answer["recording"].as_str().expect("a path")));
    let ticks = recording.messages("/loop");
    let column = |key: &str| ticks.iter().map(|tick| number(&tick[key])).collect();
    (column("command_a"), column("position_m"))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn quadratic_motion_agrees_with_lagrange_multipliers() {
    let bench = Bench::new();
    let options = format!("{CLEAN} {SHORT} --amplitude 0.7 --set sim.geometry=quadratic");
    let (commands, positions) = commands_and_positions(&bench, &options);
    // A command takes effect in the next tick.
    let held: Vec<f64> = std::iter::once(0.0)
        .chain(commands.iter().copied())
        .take(commands.len())
        .collect();
    let config = bench.json(&format!(
        "config show {CLEAN} --set loop.rate_hz=1000 --set sim.geometry=quadratic"
    ));
    let question = json!({"what": "trajectory", "config": config, "setpoint_a": held});
    let Some(answers) = truth::ask_of("plants.py", &[question]) else {
        return;
    };
    let truth: Vec<f64> = answers[0]["position_m"]
        .as_array()
        .expect("a list")
        .iter()
        .map(number)
        .collect();
    let error = largest(
        positions
            .iter()
            .zip(&truth)
            .map(|(ours, truth)| ours - truth),
    );
    let linear = commands_and_positions(&bench, &format!("{CLEAN} {SHORT} --amplitude 0.7")).1;
    let nonlinear_part = largest(
        positions
            .iter()
            .zip(&linear)
            .map(|(quadratic, linear)| quadratic - linear),
    );
    // The reference integrates in steps of 20 us, in which the phase of the close modes advances by 0.011 rad with a relative error of
    // (0.011)^4/120: 5e-8 rad over the 380 rad of the sweep, or 2e-12 m of the 40 um of these modes. The nonlinear part is 10,000 times
    // larger.
    assert!(error < 1e-11, "{error} m");
    assert!(nonlinear_part > 1e-7, "{nonlinear_part} m");
}

#[test]
fn nonlinearity_is_quadratic_in_the_amplitude() {
    let bench = Bench::new();
    let difference = |amplitude: f64| {
        let at = |geometry: &str| {
            commands_and_positions(
                &bench,
                &format!("{CLEAN} {SHORT} --amplitude {amplitude} --set sim.geometry={geometry}"),
            )
            .1
        };
        largest(
            at("quadratic")
                .iter()
                .zip(&at("linear"))
                .map(|(quadratic, linear)| quadratic - linear),
        )
    };
    let differences = [0.01, 0.02, 0.04].map(difference);
    // The lowest nonlinear term of the equations is quadratic; the next one is 1e-3 of it at 0.04 A.
    for pair in differences.windows(2) {
        near(
            "the ratio at twice the amplitude",
            pair[1] / pair[0],
            4.0,
            0.05,
        );
    }
    assert!(differences[0] > 1e-12, "{differences:?}");
}

/// The largest difference from the linear stage in a band, in per cent of the magnitude or in degrees, whichever is larger; and the
/// predicted travel in metres.
fn change(options: &str, (low_hz, high_hz): (f64, f64)) -> (f64, f64) {
    let bench = Bench::new();
    let run = |geometry: &str| {
        let arguments = format!("chirp {CLEAN} {options} --set sim.geometry={geometry}");
        let answer = bench.json(&arguments);
        let text = bench.read(answer["frf_csv"].as_str().expect("a path"));
        let row = |line: &str| {
            line.split(',')
                .map(|field| field.parse().expect("a number"))
                .collect::<Vec<f64>>()
        };
        (
            number(&answer["expected_travel_m"]),
            text.lines().skip(1).map(row).collect::<Vec<_>>(),
        )
    };
    let ((travel_m, linear), (_, quadratic)) = (run("linear"), run("quadratic"));
    let pairs = linear
        .iter()
        .zip(&quadratic)
        .filter(|(row, _)| (low_hz..high_hz).contains(&row[0]));
    let changes = pairs.map(|(linear, quadratic)| {
        assert_eq!(linear[0], quadratic[0]);
        let turns = (quadratic[2] - linear[2]) / 360.0;
        f64::max(
            100.0 * (quadratic[1] / linear[1] - 1.0).abs(),
            360.0 * (turns - turns.round()).abs(),
        )
    });
    (changes.fold(0.0, f64::max), travel_m)
}

/// A sweep with constant amplitude at 0.5 Hz/s, slow enough that the modes reach their steady state.
const SLOW_SWEEP: &str = "--set chirp.quiet_after_s=20 --set chirp.fade_in_s=1 --set chirp.fade_out_s=1 --sweep linear --duration 40";

/// Around modes u and v.
const CLOSE_MODES_HZ: (f64, f64) = (79.0, 90.0);

#[test]
fn response_changes_by_1_degree_at_17_um_around_modes_u_and_v() {
    let at = |amplitude_a: f64| {
        change(
            &format!("{SLOW_SWEEP} --start 74 --stop 95 --amplitude {amplitude_a}"),
            CLOSE_MODES_HZ,
        )
    };
    // The change is proportional to the square of the amplitude. The amplitude of the limit has three digits.
    let ((limit, travel_m), (half, _)) = (at(0.114), at(0.057));
    near("the change in degrees or per cent", limit, 1.0, 0.02);
    near("the travel", travel_m, 16.9e-6, 0.1e-6);
    near(
        "the change at half the amplitude",
        half / limit,
        0.25,
        0.005,
    );
}

#[test]
fn response_around_mode_r_is_linear_within_the_soft_limit() {
    let (change, travel_m) = change(
        &format!("{SLOW_SWEEP} --start 24 --stop 35 --amplitude 0.1"),
        (27.5, 31.0),
    );
    // In mode R all stages move together in X, so that the beams hardly bend. The soft limit is 0.9 mm.
    assert!(travel_m > 0.8e-3, "{travel_m}");
    assert!(change < 0.002, "{change}");
}

#[test]
fn profile_chirp_is_six_times_the_amplitude_of_1_percent_change() {
    let points = [
        (0.1, 0.4),
        (8.0, 0.4),
        (20.0, 0.1),
        (45.0, 0.1),
        (70.0, 1.0),
        (150.0, 3.0),
    ];
    let scaled = |share: f64| {
        let point = |(hz, a): (f64, f64)| {
            let current_a = if hz > 50.0 { share * a } else { a };
            format!("{{frequency_hz={hz:?},current_a={current_a:?}}}")
        };
        change(
            &format!("--set chirp.amplitude=[{}]", points.map(point).join(",")),
            CLOSE_MODES_HZ,
        )
        .0
    };
    near("the change in per cent, as it is", scaled(1.0), 33.2, 0.5);
    near(
        "the change in per cent, at a sixth",
        scaled(1.0 / 6.0),
        1.0,
        0.03,
    );
}
