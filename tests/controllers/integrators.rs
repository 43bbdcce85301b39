//! Controllers with two integrators: the loop follows a ramp without error.

use bench_config::{Purpose, Source, load};
use bench_control::ClosedLoop;
use bench_experiment::closed_loop;

use crate::controllers::program::Bench;

/// A stage of one well damped mode at 180 rad/s: P(0) = 3/180^2 m/N times the force constant.
const STAGE: &str = "title = \"ramp\"\n[plant]\nmodel = \"modal\"\n[plant.modes]\na = { omega_rad_s = 180.0, residue_per_kg = 3.0, damping_ratio = 0.7 }\n[sim]\nunmodelled = []\nfloor = []\n";
const RATE_HZ: f64 = 5000.0;
const SLOPE_M_S: f64 = 1e-5;

fn config(bench: &Bench, controller: &str) -> bench_config::Config {
    let path = |name: &str| bench.path(name).display().to_string();
    load(&Source {
        config: Some(path("stage.toml")),
        sets: vec![format!("control.controller={}", path(controller))],
        options: Vec::new(),
        purpose: Purpose::Control,
    })
    .expect("a valid configuration")
}

fn static_gain_m_per_a(bench: &Bench) -> f64 {
    let force_constant = config(bench, "single.toml").motor.force_constant_n_per_a;
    3.0 / (180.0 * 180.0) * force_constant
}

/// Following error in metres after a ramp of 4 s.
fn ramp_error_m(model: &ClosedLoop) -> f64 {
    let ticks = (4.0 * RATE_HZ) as usize;
    let ramp = |tick: usize| SLOPE_M_S * tick as f64 / RATE_HZ;
    let readings = model.simulate(ticks, ramp);
    ramp(ticks - 1) - readings[ticks - 1]
}

fn bench_with_single() -> (Bench, f64) {
    let bench = Bench::new();
    bench.write("stage.toml", STAGE);
    let single = |k: f64| {
        format!(
            "title = \"single\"\n[tf]\ngain_unit = \"A/m\"\nnumerator = [{k:e}]\ndenominator = [1, 0]\n"
        )
    };
    bench.write("single.toml", single(1.0));
    let static_gain = static_gain_m_per_a(&bench);
    bench.write("single.toml", single(20.0 / static_gain));
    (bench, static_gain)
}

/// k (s + 5)/s^2 with k P(0) = 19.4 rad/s: crossover near 20 rad/s, phase margin near 67 degrees. In every form.
fn double_integrators(k: f64) -> Vec<(&'static str, String)> {
    let table = |name: &str, body: String| {
        format!("title = \"double\"\n[{name}]\ngain_unit = \"A/m\"\n{body}\n")
    };
    // Tustin: s = c (z - 1)/(z + 1), c = 2/T; k ((c + 5) z + 5 - c)(z + 1)/(c (z - 1))^2.
    let c = 2.0 * RATE_HZ;
    let (first, second) = (k / (c * c) * (c + 5.0), k / (c * c) * (5.0 - c));
    vec![
        (
            "tf.toml",
            table(
                "tf",
                format!(
                    "numerator = [{k:e}, {:e}]\ndenominator = [1, 0, 0]",
                    5.0 * k
                ),
            ),
        ),
        (
            "zpk.toml",
            table(
                "zpk",
                format!("zeros = [[-5, 0]]\npoles = [[0, 0], [0, 0]]\ngain = {k:e}"),
            ),
        ),
        (
            "ss.toml",
            table(
                "ss",
                format!(
                    "a = [[0, 1], [0, 0]]\nb = [0, 1]\nc = [{:e}, {k:e}]",
                    5.0 * k
                ),
            ),
        ),
        (
            "tf-z.toml",
            table(
                "tf",
                format!(
                    "rate_hz = 5000\nnumerator = [{first:e}, {:e}, {second:e}]\ndenominator = [1, -2, 1]",
                    first + second
                ),
            ),
        ),
        (
            "zpk-z.toml",
            table(
                "zpk",
                format!(
                    "rate_hz = 5000\nzeros = [[-1, 0], [{:e}, 0]]\npoles = [[1, 0], [1, 0]]\ngain = {first:e}",
                    -second / first
                ),
            ),
        ),
        (
            "section.toml",
            format!(
                "title = \"double\"\n[[section]]\nkind = \"coefficients\"\nnumerator = [{:e}, {:e}]\ndenominator = [1, 0, 0]\n",
                1e-6 * k,
                5e-6 * k
            ),
        ),
    ]
}

#[test]
fn loop_with_two_integrators_follows_a_ramp_without_error() {
    let (bench, static_gain) = bench_with_single();
    // With one integrator, L = Kv/s at low frequency, and the error of a ramp is slope/Kv = 1e-5/20 m.
    let single = closed_loop(&config(&bench, "single.toml")).expect("a loop");
    let expected_m = SLOPE_M_S / 20.0;
    assert!((ramp_error_m(&single) / expected_m - 1.0).abs() < 1e-6);
    for (name, text) in double_integrators(19.4 / static_gain) {
        bench.write(name, text);
        let double = closed_loop(&config(&bench, name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(double.is_stable(), "{name}");
        // The slowest pole is near -6 rad/s: exp(-24) = 4e-11 of the largest error.
        let error_m = ramp_error_m(&double);
        assert!(error_m.abs() < 1e-7 * expected_m, "{name}: {error_m:e}");
        let open = double.open_loop_poles().expect("poles");
        assert_eq!((open.integrators, open.unstable), (2, 0), "{name}");
    }
}

#[test]
fn two_integrators_have_margins_and_run() {
    let (bench, static_gain) = bench_with_single();
    for (name, text) in double_integrators(19.4 / static_gain) {
        bench.write(name, text);
        let margins = bench.json(&format!("margins --config stage.toml --controller {name}"));
        let phase = margins["phase_margin_deg"].as_f64().expect("a margin");
        // 180 - 180 + atan(w/5) = 76 degrees less those of the mode, 9, and of the delays, below 3.
        assert!((62.0..70.0).contains(&phase), "{name}: {phase}");
    }
    let command = "control --config stage.toml --controller tf-z.toml --duration 1s --out run";
    let run = bench.run(command);
    assert_eq!(run.code, 0, "{run:?}");
}

#[test]
fn import_of_two_integrators_is_accepted_with_a_remark() {
    let bench = Bench::new();
    bench.write(
        "c.json",
        r#"{"num": [5000, 0, 0], "den": [1, -2, 1], "Ts": 0.0002}"#,
    );
    let report = bench.json("controller import c.json --gain-unit A/m --out c.toml");
    let poles: Vec<f64> = report["poles"]
        .as_array()
        .expect("poles")
        .iter()
        .flat_map(|p| [p[0].as_f64(), p[1].as_f64()])
        .flatten()
        .collect();
    assert_eq!(poles, [1.0, 0.0, 1.0, 0.0]);
    let remark = report["remarks"][0].as_str().expect("a remark");
    assert!(remark.contains("two integrators"), "{remark}");
}

#[test]
fn double_integrator_of_a_polynomial_of_higher_order_is_found() {
    let bench = Bench::new();
    // (z - 1)^2 (z - 0.5)(z + 0.25) = z^4 - 2.25 z^3 + 1.375 z^2 - 0 z - 0.125, exact in double precision.
    bench.write(
        "c.json",
        r#"{"num": [1, -0.9, 0], "den": [1, -2.25, 1.375, 0, -0.125], "Ts": 0.0002}"#,
    );
    let report = bench.json("controller import c.json --gain-unit A/m --out c.toml");
    let poles = report["poles"].as_array().expect("poles").iter();
    assert_eq!(
        poles
            .filter(|pole| pole[0] == 1.0 && pole[1] == 0.0)
            .count(),
        2
    );
}

#[test]
fn rejects_a_third_integrator_and_unstable_poles_by_name() {
    let bench = Bench::new();
    for (file, words) in [
        (
            r#"{"z": [], "p": [1, 1, 1], "k": 1, "Ts": 0.0002}"#,
            ["3 integrators", "limit is 2"],
        ),
        (
            r#"{"num": [1], "den": [1, 0, 0, 0], "Ts": 0}"#,
            ["3 integrators", "s = 0"],
        ),
        (
            r#"{"z": [], "p": [1.05], "k": 1, "Ts": 0.0002}"#,
            ["unstable", "no anti-windup"],
        ),
        (
            r#"{"num": [1], "den": [1, -20], "Ts": 0}"#,
            ["unstable", "no anti-windup"],
        ),
        (
            r#"{"A": [[1.2]], "B": [1], "C": [1], "Ts": 0.0002}"#,
            ["unstable", "z = 1.2"],
        ),
        // An integrator that was moved by 1e-5.
        (
            r#"{"num": [1], "den": [1, -1.50001, 0.500005], "Ts": 0.0002}"#,
            ["z = 1.00001", "not an integrator"],
        ),
    ] {
        bench.write("c.json", file);
        let answer = bench.run("controller import c.json --gain-unit A/m --json");
        answer.is_refused(&[&words[..], &["c.json", "; "]].concat());
    }
    let three = "title = \"x\"\n[[section]]\nkind = \"integrator\"\ngain_a_per_um = 1\n"
        .to_string()
        + "[[section]]\nkind = \"coefficients\"\nnumerator = [1]\ndenominator = [1, 0, 0]\n";
    bench.write("three.toml", three);
    let answer = bench.run("margins --controller three.toml --json");
    answer.is_refused(&["three.toml", "3 integrators"]);
}

#[test]
fn slow_pole_beside_an_integrator_is_accepted_with_a_remark() {
    let bench = Bench::new();
    bench.write(
        "c.json",
        r#"{"z": [], "p": [0.9999999], "k": 1, "Ts": 0.0002}"#,
    );
    let report = bench.json("controller import c.json --gain-unit A/m --out c.toml");
    let remark = report["remarks"][0].as_str().expect("a remark");
    assert!(remark.contains("not an integrator"), "{remark}");
}
