//! `bench identify --output-kind`: the velocity of a stage by closed form.
use std::f64::consts::TAU;
use std::fmt::Write;

use nalgebra::Complex;

use crate::external::program::{Bench, number};
use crate::external::signals::normal;

/// Modes: hertz, damping ratio, residue. The zero is at -2.058 +- 194.31j rad/s.
const STAGE: [(f64, f64, f64); 2] = [(12.0, 0.02, 1.0), (38.0, 0.01, 0.6)];
const RATE_HZ: f64 = 500.0;
const COLUMNS: &str =
    "identify velocity.csv --time time_s --input force_n --output vel --hold zoh --out results";

/// The velocities by a held chirp from 2 to 90 Hz: with the pole p, x[k + 1] = e x[k] + (e - 1)/p f[k], e = exp(p T), and the velocity
/// r Im(p x)/Im p.
fn velocity_csv() -> String {
    let mut noise = normal(3);
    let poles =
        STAGE.map(|(hz, zeta, _)| Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * TAU * hz);
    let mut states = [Complex::new(0.0, 0.0); 2];
    let mut text = "time_s,force_n,vel\n".to_string();
    for k in 0..10_000 {
        let t = f64::from(k) / RATE_HZ;
        let ends = ((t - 0.5).min(14.5 - t) / 0.7).clamp(0.0, 1.0);
        let force = (TAU * (2.0 + 44.0 * (t - 0.5) / 14.0) * (t - 0.5)).sin() * ends;
        let mut velocity = 2e-6 * noise();
        for ((x, p), (_, _, residue)) in states.iter_mut().zip(poles).zip(STAGE) {
            velocity += residue * (p * *x).im / p.im;
            let e = (p / RATE_HZ).exp();
            *x = e * *x + (e - 1.0) / p * force;
        }
        writeln!(text, "{t},{force},{velocity:e}").expect("a text");
    }
    text
}

#[test]
fn velocity_gives_the_modes_of_the_position_and_states_its_kind() {
    let bench = Bench::new();
    bench.write("velocity.csv", velocity_csv());
    let answer = bench.json(&format!("{COLUMNS} --output-kind velocity"));
    assert_eq!(answer["output_kind"], "velocity");
    assert_eq!(answer["cnmp"], "excluded", "{}", answer["why"]);
    let modes = answer["modes"].as_array().expect("modes");
    assert_eq!(modes.len(), 2, "{modes:?}");
    for (mode, (hz, zeta, residue)) in modes.iter().zip(STAGE) {
        for (name, truth) in [
            ("frequency_hz", hz),
            ("damping_ratio", zeta),
            ("residue", residue),
        ] {
            let sigma = number(&mode[format!("{name}_sigma")]);
            assert!(
                (number(&mode[name]) - truth).abs() < 5.0 * sigma,
                "{name}: {mode}"
            );
            assert!(sigma < 2e-3 * truth, "{name}: {mode}");
        }
    }
    let text = bench.run(&format!("{COLUMNS} --output-kind velocity")).out;
    assert!(text.contains("output     velocity"), "{text}");
    assert!(text.contains("`vel`/(`force_n` s)"), "{text}");
}

#[test]
fn velocity_without_the_option_or_as_an_acceleration_is_named_and_gives_no_verdict() {
    let bench = Bench::new();
    bench.write("velocity.csv", velocity_csv());
    for (option, assumed) in [
        ("", "position"),
        ("--output-kind acceleration", "acceleration"),
    ] {
        let answer = bench.json(&format!("{COLUMNS} {option}"));
        assert_eq!(answer["cnmp"], "undecided");
        assert_eq!(answer["output_kind"], assumed);
        let message = format!(
            "modes describe the output as velocity, but not as {assumed}; give --output-kind velocity"
        );
        assert_eq!(answer["why"], message);
    }
}

#[test]
fn unknown_kind_is_refused_with_those_that_exist() {
    let answer = Bench::new().run(&format!("{COLUMNS} --output-kind jerk"));
    answer.is_refused(&["position", "velocity", "acceleration"]);
}
