//! A discrete controller in the loop: sample by sample, margins, recording and replay.

use bench_control::{ControllerText, LawInput};
use bench_test_support::python;
use serde_json::{Value, json};

use crate::controllers::program::{Bench, number};

const SAMPLES: usize = 400;

/// A discrete filter of order 4, whose poles have magnitudes of 0.5 to 0.9, as a transfer function: the rounding of 400 samples is
/// far below 1e-12.
const NUMERATOR: [f64; 5] = [0.3, -0.41, 0.25, 0.1, -0.07];
/// (z^2 - 1.6 z + 0.81)(z - 0.5)(z + 0.6)
const DENOMINATOR: [f64; 5] = [1.0, -1.5, 0.35, 0.561, -0.243];

fn numbers(list: &[f64]) -> String {
    format!("{list:?}")
}

fn tf() -> String {
    format!(
        "title = \"t\"\n[tf]\ngain_unit = \"A/um\"\nrate_hz = 5000\nnumerator = {}\ndenominator = {}\n",
        numbers(&NUMERATOR),
        numbers(&DENOMINATOR)
    )
}

const A: [[f64; 3]; 3] = [[0.5, 0.3, 0.0], [-0.3, 0.5, 0.1], [0.0, 0.2, -0.4]];
const B: [f64; 3] = [1.0, -0.5, 0.25];
const C: [f64; 3] = [0.7, 0.1, -0.3];
const D: f64 = 0.2;

fn ss() -> String {
    format!(
        "title = \"t\"\n[ss]\ngain_unit = \"A/m\"\nrate_hz = 5000\na = {A:?}\nb = {B:?}\nc = {C:?}\nd = {D}\n"
    )
}

/// Errors in micrometres.
fn input() -> Vec<f64> {
    (0..SAMPLES)
        .map(|k| f64::sin(0.7 * k as f64) + f64::from(u8::from(k % 50 < 20)))
        .collect()
}

/// The commands for errors in metres.
fn commands(text: String, errors_m: &[f64]) -> Vec<f64> {
    let text = ControllerText {
        name: "t.toml".into(),
        text,
    };
    let mut law = text.design(5000.0).expect("accepted").law(2e-4);
    law.reset(0.0);
    let input = |error_m: &f64| LawInput {
        reference_m: *error_m,
        ..LawInput::default()
    };
    errors_m
        .iter()
        .map(|error_m| law.update(&input(error_m)))
        .collect()
}

#[test]
fn discrete_controllers_run_sample_by_sample_like_lfilter_and_dlsim() {
    let input = input();
    let cases = json!([
        { "num": NUMERATOR, "den": DENOMINATOR, "input": input },
        { "A": A, "B": B.map(|x| [x]), "C": [C], "D": [[D]], "input": input },
    ]);
    let modules = "control, mpmath, scipy.signal";
    let Some(expected) =
        python::numbers_with(modules, "controllers.py", &["runs"], &cases.to_string())
    else {
        return;
    };
    let micrometres: Vec<f64> = input.iter().map(|x| x * 1e-6).collect();
    let runs = [commands(tf(), &micrometres), commands(ss(), &input)];
    for (run, expected) in runs.iter().zip(&expected) {
        let scale = expected
            .iter()
            .fold(0.0, |scale: f64, x| scale.max(x.abs()));
        assert_eq!((run.len(), expected.len()), (SAMPLES, SAMPLES));
        for (ours, theirs) in run.iter().zip(expected) {
            assert!((ours - theirs).abs() < 1e-12 * scale, "{ours} {theirs}");
        }
    }
}

/// The slow controller, 0.12/s w^2/(s^2 + 2 zeta w s + w^2), as Eq. (6-6) has it: w = 89.5 rad/s, 2 zeta w = 125.3 rad/s.
const SLOW: &str = "title = \"slow\"\n[zpk]\ngain_unit = \"A/um\"\ngain = 961.23\npoles = [[0, 0], [-62.65, 63.915784435458505], [-62.65, -63.915784435458505]]\n";

#[test]
fn continuous_zpk_has_the_margins_of_the_same_sections() {
    let bench = Bench::new();
    bench.write("slow.toml", SLOW);
    for time in ["", "--continuous"] {
        let ours = bench.json(&format!("margins --controller slow.toml {time}"));
        let sections = bench.json(&format!("margins --slow {time}"));
        for name in [
            "crossover_rad_s",
            "phase_margin_deg",
            "gain_margin_db",
            "modulus_margin",
        ] {
            let (a, b) = (number(&ours[name]), number(&sections[name]));
            // Rounding of the poles.
            assert!((a / b - 1.0).abs() < 1e-8, "{name}: {a} {b}");
        }
    }
}

/// The discrete slow controller: Tustin's rule applied by hand to poles and gain, at 5 kHz.
fn discrete_slow() -> String {
    let (period_s, poles) = (
        2e-4,
        [(-62.65, 63.915784435458505), (-62.65, -63.915784435458505)],
    );
    let half =
        |(re, im): (f64, f64)| nalgebra::Complex::new(re * period_s / 2.0, im * period_s / 2.0);
    let z = poles.map(|pole| (half(pole) + 1.0) / (-half(pole) + 1.0));
    // k prod(T/2)/prod(1 - p T/2), with three zeros at z = -1.
    let denominator: nalgebra::Complex<f64> = poles.map(|pole| -half(pole) + 1.0).iter().product();
    let gain = 961.23 * f64::powi(period_s / 2.0, 3) / denominator.re;
    format!(
        "title = \"slow\"\n[zpk]\ngain_unit = \"A/um\"\nrate_hz = 5000\ngain = {gain:e}\nzeros = [[-1, 0], [-1, 0], [-1, 0]]\npoles = [[1, 0], [{}, {}], [{}, {}]]\n",
        z[0].re, z[0].im, z[1].re, z[1].im
    )
}

#[test]
fn discrete_zpk_has_the_margins_of_the_sections_that_the_loop_discretises() {
    let bench = Bench::new();
    bench.write("slow.toml", discrete_slow());
    let ours = bench.json("margins --controller slow.toml");
    let sections = bench.json("margins --slow");
    for name in [
        "crossover_rad_s",
        "phase_margin_deg",
        "gain_margin_db",
        "modulus_margin",
    ] {
        let (a, b) = (number(&ours[name]), number(&sections[name]));
        assert!((a / b - 1.0).abs() < 1e-6, "{name}: {a} {b}");
    }
    let poles = |report: &Value| report["poles"].as_array().expect("poles").len();
    assert_eq!(poles(&ours), poles(&sections));
    bench
        .run("margins --controller slow.toml --continuous")
        .is_refused(&["continuous sections", "rate_hz"]);
}

#[test]
fn run_with_a_discrete_controller_is_predicted_recorded_and_replayed() {
    let bench = Bench::new();
    bench.write("slow.toml", discrete_slow());
    let run = bench.json("control --controller slow.toml --duration 2s --out run");
    let slow = bench.json("control --slow --duration 2s --out reference");
    // The same controller around the same stage with the same noise: measured and predicted agree to the digits of its poles.
    for name in ["measured", "predicted"] {
        let (a, b) = (
            number(&run[name]["settling_time_s"]),
            number(&slow[name]["settling_time_s"]),
        );
        assert!((a - b).abs() <= 2e-4, "{name}: {a} {b}");
    }
    let recording = run["recording"].as_str().expect("a recording").to_string();
    std::fs::remove_file(bench.path("slow.toml")).expect("the file exists");
    // The recording contains the controller.
    assert_eq!(bench.run(&format!("replay {recording}")).code, 0);
}
