//! The rig whose constraints are not linearised: it is what Lagrange says, it tends to the linear rig, and it shows how large
//! a chirp may be.

use serde_json::json;

use crate::program::{Bench, near, number};
use crate::recording::Recording;
use crate::truth;

/// No noise, no floor, and the plant alone.
const CLEAN: &str =
    "--set sim.probe_noise_rms_m=0 --set sim.probe_quantisation_m=0 --set sim.floor=[] --set sim.unmodelled=[]";

/// A short sweep through all modes at 1 kHz.
const SHORT: &str = "--set loop.rate_hz=1000 --set chirp.quiet_before_s=0.05 --set chirp.quiet_after_s=0.05 --set chirp.fade_in_s=0.05 --set chirp.fade_out_s=0.05 --sweep linear --start 15 --stop 120 --duration 0.6";

/// Commands in amperes and positions in metres, tick by tick.
fn course(bench: &Bench, options: &str) -> (Vec<f64>, Vec<f64>) {
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
fn the_motion_is_that_of_all_coordinates_under_their_constraints() {
    let bench = Bench::new();
    let options = format!("{CLEAN} {SHORT} --amplitude 1.2 --set sim.geometry=quadratic");
    let (commands, positions) = course(&bench, &options);
    // A command acts from the next tick on.
    let held: Vec<f64> = std::iter::once(0.0).chain(commands.iter().copied()).take(commands.len()).collect();
    let config = bench.json(&format!("config show {CLEAN} --set loop.rate_hz=1000 --set sim.geometry=quadratic"));
    let question = json!({"what": "trajectory", "config": config, "setpoint_a": held});
    let Some(answers) = truth::ask_of("plants.py", &[question]) else { return };
    let truth: Vec<f64> = answers[0]["position_m"].as_array().expect("a list").iter().map(number).collect();
    let error = largest(positions.iter().zip(&truth).map(|(ours, truth)| ours - truth));
    let linear = course(&bench, &format!("{CLEAN} {SHORT} --amplitude 1.2")).1;
    let bent = largest(positions.iter().zip(&linear).map(|(quadratic, linear)| quadratic - linear));
    // Both integrate 1e-4 m to some 1e-9 of it; what is not linear is ten thousand times more.
    assert!(error < 1e-12, "{error} m");
    assert!(bent > 1e-7, "{bent} m");
}

#[test]
fn the_difference_to_the_linear_rig_falls_with_the_square_of_the_amplitude() {
    let bench = Bench::new();
    let difference = |amplitude: f64| {
        let at = |geometry: &str| {
            course(&bench, &format!("{CLEAN} {SHORT} --amplitude {amplitude} --set sim.geometry={geometry}")).1
        };
        largest(at("quadratic").iter().zip(&at("linear")).map(|(quadratic, linear)| quadratic - linear))
    };
    let differences = [0.01, 0.02, 0.04].map(difference);
    // The equations' first term beyond the linear ones is quadratic; the next one is 1e-3 of it at 0.04 A.
    for pair in differences.windows(2) {
        near("the ratio at twice the amplitude", pair[1] / pair[0], 4.0, 0.05);
    }
    assert!(differences[0] > 1e-12, "{differences:?}");
}

/// A sweep through a mode or a pair of them, and the band in which the responses are compared.
struct Band {
    name: &'static str,
    sweep: &'static str,
    inside_hz: (f64, f64),
    /// The amplitude in amperes, and the travel in metres, at which the response changes by 1 % or by 1 degree.
    limit_a: f64,
    limit_m: f64,
}

const BANDS: [Band; 2] = [
    Band {
        name: "R",
        sweep: "--start 24 --stop 35 --duration 40",
        inside_hz: (27.5, 31.0),
        limit_a: 0.1,
        limit_m: 1e-4,
    },
    Band {
        name: "u, v",
        sweep: "--start 74 --stop 95 --duration 40",
        inside_hz: (80.0, 88.0),
        limit_a: 0.1,
        limit_m: 1e-4,
    },
];

/// What a flat sweep of an amplitude changes against the linear rig: the larger of per cent and degrees at any frequency of
/// the band; and the largest travel in metres.
fn change(band: &Band, amplitude_a: f64) -> (f64, f64) {
    let bench = Bench::new();
    let quiet = "--set chirp.quiet_after_s=20 --set chirp.fade_in_s=1 --set chirp.fade_out_s=1 --sweep linear";
    let run = |geometry: &str| {
        let answer = bench.json(&format!(
            "chirp {CLEAN} {quiet} {} --amplitude {amplitude_a:?} --set sim.geometry={geometry}",
            band.sweep
        ));
        let text = bench.read(answer["frf_csv"].as_str().expect("a path"));
        let row = |line: &str| line.split(',').map(|field| field.parse().expect("a number")).collect::<Vec<f64>>();
        (number(&answer["expected_travel_m"]), text.lines().skip(1).map(row).collect::<Vec<_>>())
    };
    let ((travel_m, linear), (_, quadratic)) = (run("linear"), run("quadratic"));
    let inside = |row: &&Vec<f64>| (band.inside_hz.0..band.inside_hz.1).contains(&row[0]);
    let changes = linear.iter().zip(&quadratic).filter(|(row, _)| inside(row)).map(|(linear, quadratic)| {
        assert_eq!(linear[0], quadratic[0]);
        let turns = (quadratic[2] - linear[2]) / 360.0;
        f64::max(100.0 * (quadratic[1] / linear[1] - 1.0).abs(), 360.0 * (turns - turns.round()).abs())
    });
    (changes.fold(0.0, f64::max), travel_m)
}

#[test]
fn a_chirp_may_be_as_large_as_the_documents_say_before_the_response_changes() {
    for band in BANDS {
        let (at_limit, travel_m) = change(&band, band.limit_a);
        println!("{} {at_limit} {travel_m}", band.name);
        // The figures are given with two digits; the change goes with the square of the amplitude: twice their error.
        near(&format!("the change around mode {} in per cent or degrees", band.name), at_limit, 1.0, 0.1);
        near("the travel in metres", travel_m, band.limit_m, 0.05 * band.limit_m);
        let (at_half, _) = change(&band, 0.5 * band.limit_a);
        near(&format!("the same at half the amplitude around mode {}", band.name), at_half / at_limit, 0.25, 0.03);
    }
}
