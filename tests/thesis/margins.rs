//! `bench margins`: the controllers of Eqs. (6-6) and (6-7), continuous and sampled.

use serde_json::{Value, json};

use crate::program::{Bench, Draw, near, number};
use crate::truth;

fn margins(arguments: &str) -> Value {
    Bench::new().json(&format!("margins {arguments}"))
}

/// Asserts a value of the answer within a relative tolerance.
#[track_caller]
fn within(answer: &Value, key: &str, expected: f64, relative: f64) {
    near(
        key,
        number(&answer[key]),
        expected,
        relative * expected.abs(),
    );
}

#[test]
fn fast_continuous_controller_has_the_margins_of_the_thesis() {
    // Eq. (6-7) with the measured damping: crossover at 284.3 rad/s; section 6.2.2 prints a phase margin of 42 degrees.
    let found = margins("--fast --continuous");
    within(&found, "crossover_rad_s", 284.3, 0.01);
    within(&found, "phase_margin_deg", 42.0, 0.01);
    within(&found, "modulus_margin", 0.497, 0.01);
    assert_eq!(
        (&found["stable"], &found["continuous"]),
        (&json!(true), &json!(true))
    );
}

#[test]
fn fast_continuous_controller_has_41_4_degrees_with_a_damping_ratio_of_0_004() {
    let found = margins(
        "--fast --continuous --set plant.damping.kind=uniform --set plant.damping.ratio=0.004",
    );
    within(&found, "crossover_rad_s", 284.3, 0.01);
    within(&found, "phase_margin_deg", 41.4, 0.01);
    within(&found, "modulus_margin", 0.497, 0.01);
}

#[test]
fn slow_continuous_controller_has_18_7_rad_s_and_72_9_degrees() {
    let found = margins("--slow --continuous");
    within(&found, "crossover_rad_s", 18.7, 0.01);
    assert_eq!(found["stable"], true);
    // At the first mode |L| crosses 1 again, with a larger phase margin: the smallest margin is that of the first crossing.
    within(&found, "phase_margin_deg", 72.9, 0.01);
    near(
        "phase margin at the first crossing",
        number(&found["crossings"][0]["phase_margin_deg"]),
        72.9,
        0.729,
    );
}

#[test]
fn margins_of_the_fast_controller_decrease_with_the_sampling_rate() {
    for (rate_hz, phase_deg, phase_tolerance, modulus) in [
        (5000, 34.5, 1.0, Some(0.423)),
        (2000, 27.0, 1.0, None),
        (1000, 15.0, 1.0, Some(0.20)),
    ] {
        // At 1 kHz the default excitation, up to 500 Hz, would reach half of the sampling rate.
        let found = margins(&format!(
            "--fast --set loop.rate_hz={rate_hz} --set chirp.stop_hz=400"
        ));
        near(
            &format!("phase margin at {rate_hz} Hz"),
            number(&found["phase_margin_deg"]),
            phase_deg,
            phase_tolerance,
        );
        if let Some(modulus) = modulus {
            near(
                &format!("modulus margin at {rate_hz} Hz"),
                number(&found["modulus_margin"]),
                modulus,
                0.01,
            );
        }
        assert_eq!(
            (&found["stable"], &found["continuous"]),
            (&json!(true), &json!(false))
        );
    }
}

#[test]
fn with_the_lighter_stage_2_only_the_fast_controller_is_unstable() {
    for time in ["", "--continuous"] {
        let arguments = format!("margins --json --fast --asymmetry -10% {time}");
        let answer = Bench::new().run(&arguments);
        assert_eq!(answer.code, 1, "{}", answer.err);
        let unstable = answer.json();
        assert_eq!(unstable["stable"], false);
        let poles = unstable["poles"].as_array().expect("poles");
        assert!(!poles.is_empty() && unstable["modulus_margin"].is_null());
        assert_eq!(
            margins(&format!("--slow --asymmetry -10% {time}"))["stable"],
            true
        );
    }
}

#[test]
fn each_period_of_delay_reduces_the_phase_by_omega_t_at_the_same_crossover() {
    let with_delay = |delay: u32| {
        margins(&format!(
            "--fast --set loop.computing_delay_periods={delay}"
        ))
    };
    let (none, one, three) = (with_delay(0), with_delay(1), with_delay(3));
    let (w, period_s) = (number(&none["crossover_rad_s"]), 2e-4);
    for (answer, periods) in [(&one, 1.0), (&three, 3.0)] {
        near("crossover", number(&answer["crossover_rad_s"]), w, 1e-9 * w);
        let lost_deg = number(&none["phase_margin_deg"]) - number(&answer["phase_margin_deg"]);
        near(
            "the lost phase",
            lost_deg,
            (w * period_s * periods).to_degrees(),
            1e-6,
        );
    }
}

#[test]
fn sensitivity_peak_is_the_reciprocal_of_the_modulus_margin() {
    for arguments in [
        "--fast",
        "--slow",
        "--fast --continuous",
        "--slow --asymmetry -10%",
    ] {
        let found = margins(arguments);
        let from_peak = 10f64.powf(-number(&found["sensitivity_peak_db"]) / 20.0);
        within(&found, "modulus_margin", from_peak, 1e-12);
    }
}

#[test]
fn controller_without_gain_has_no_crossover_and_a_stable_loop() {
    let bench = Bench::new();
    bench.write(
        "off.toml",
        "title = \"off\"\n[[section]]\nkind = \"gain\"\ngain_a_per_um = 0.0\n",
    );
    for time in ["", "--continuous"] {
        let found = bench.json(&format!("margins --controller off.toml {time}"));
        assert_eq!(found["stable"], true, "{time}");
        assert_eq!(
            (&found["crossover_rad_s"], &found["crossings"]),
            (&Value::Null, &json!([]))
        );
        assert_eq!(found["modulus_margin"], 1.0);
    }
}

/// A random stable controller with sections of all kinds, with a crossover frequency near a random value.
fn controller(draw: &mut Draw) -> String {
    // The static response of the stage is 154.4 um/A: the crossover of an integrator with K A/um/s is at 154.4 K rad/s.
    let gain = draw.over_decades(3.0, 120.0) / 154.4;
    let (zero, pole, low_pass) = (
        draw.over_decades(20.0, 500.0),
        draw.over_decades(100.0, 3000.0),
        draw.over_decades(300.0, 5000.0),
    );
    let (notch, depth, width) = (
        draw.between(300.0, 700.0),
        draw.over_decades(0.005, 0.5),
        draw.between(0.1, 1.0),
    );
    let prewarp = if *draw.one_of(&[true, false]) {
        format!("prewarp_rad_s = {notch:?}\n")
    } else {
        String::new()
    };
    let (w, zeta) = (draw.over_decades(400.0, 4000.0), draw.between(0.3, 1.2));
    let (a, b) = (draw.over_decades(300.0, 3000.0), draw.between(0.4, 1.5));
    // All sections except the integrator have a static gain of 1 together: `low_pass` and `pole/zero` are compensated in the gain.
    let (static_gain, square, rate) = (low_pass * pole / zero, a * a, 2.0 * b * a);
    format!(
        "title = \"drawn\"\n\
         [[section]]\nkind = \"integrator\"\ngain_a_per_um = {gain:?}\n\
         [[section]]\nkind = \"zero_pole\"\nzero_rad_s = {zero:?}\npole_rad_s = {pole:?}\n\
         [[section]]\nkind = \"pole\"\npole_rad_s = {low_pass:?}\n\
         [[section]]\nkind = \"gain\"\ngain_a_per_um = {static_gain:?}\n\
         [[section]]\nkind = \"biquad\"\nzeros_rad_s = {notch:?}\nzeros_damping_ratio = {depth:?}\npoles_rad_s = {notch:?}\npoles_damping_ratio = {width:?}\n{prewarp}\
         [[section]]\nkind = \"pole_pair\"\nomega_rad_s = {w:?}\ndamping_ratio = {zeta:?}\n\
         [[section]]\nkind = \"coefficients\"\nnumerator = [0.5, {rate:?}, {square:?}]\ndenominator = [1.0, {rate:?}, {square:?}]\n"
    )
}

#[test]
fn margins_of_random_loops_equal_python() {
    let (bench, mut draw) = (Bench::new(), Draw(31_415));
    let mut drawn = Vec::new();
    for index in 0..24 {
        let name = match index % 3 {
            0 => "fast".to_string(),
            1 => "slow".to_string(),
            _ => bench
                .write(&format!("{index}.toml"), controller(&mut draw))
                .display()
                .to_string(),
        };
        let (point, rate_hz) = (
            draw.between(0.0, 9.0),
            draw.one_of(&[1000, 2000, 5000, 20_000]),
        );
        let asymmetry = draw.one_of(&["10%", "5%", "-2%", "-10%"]);
        let delay = draw.one_of(&[0, 1, 1, 2]);
        let settings = format!(
            "--set control.controller={name} --set loop.rate_hz={rate_hz} --set loop.computing_delay_periods={delay} \
             --set chirp.stop_hz=400 --set chirp.duration_s=60 --operating-point {point}% --asymmetry {asymmetry}"
        );
        drawn.extend([(settings.clone(), false), (settings, true)]);
    }
    let question = |(settings, continuous): &(String, bool)| json!({"what": "margins", "config": bench.json(&format!("config show {settings}")), "continuous": continuous});
    let Some(answers) = truth::ask(&drawn.iter().map(question).collect::<Vec<_>>()) else {
        return;
    };
    for ((settings, continuous), truth) in drawn.iter().zip(&answers) {
        let time = if *continuous { "--continuous" } else { "" };
        let answer = bench.run(&format!("margins {settings} {time} --json"));
        let exit_code = if truth["stable"] == true { 0 } else { 1 };
        assert_eq!(answer.code, exit_code, "{settings} {time}: {}", answer.err);
        assert_same_margins(&answer.json(), truth, &format!("{settings} {time}"));
    }
    let stable = answers
        .iter()
        .filter(|truth| truth["stable"] == true)
        .count();
    assert!(
        (8..=40).contains(&stable),
        "the sample must contain stable and unstable loops: {stable} of 48 are stable"
    );
}

/// Asserts equality within a relative tolerance of 1e-4, or absolute for values below 1.
fn assert_same_margins(ours: &Value, truth: &Value, settings: &str) {
    // A pole within 1e-6 rad/s of the stability limit may be on either side because of rounding.
    assert!(
        number(&truth["border_rad_s"]) > 1e-6,
        "a pole is too close to the stability limit for this test: {settings}"
    );
    assert_eq!(ours["stable"], truth["stable"], "{settings}");
    let same = |what: &str, ours: &Value, truth: &Value| match truth.as_f64() {
        None => assert!(
            ours.is_null(),
            "{what} is {ours}, Python finds none: {settings}"
        ),
        Some(expected) => {
            near(
                &format!("{what} with {settings}"),
                number(ours),
                expected,
                1e-4 * expected.abs().max(1.0),
            );
        }
    };
    let stable = truth["stable"] == true;
    for key in [
        "crossover_rad_s",
        "phase_margin_deg",
        "gain_margin_db",
        "sensitivity_bandwidth_rad_s",
        "modulus_margin",
    ] {
        // Margins of an unstable loop are not defined: the answer has its poles instead.
        let expected = if stable { &truth[key] } else { &Value::Null };
        same(key, &ours[key], expected);
    }
    if stable {
        let modulus = number(&truth["modulus_margin"]);
        near(
            &format!("modulus margin with {settings}"),
            number(&ours["modulus_margin"]),
            modulus,
            1e-4 * modulus,
        );
    } else {
        let poles = ours["poles"].as_array().expect("poles");
        assert!(
            poles.iter().any(|pole| number(&pole["re_rad_s"]) > 0.0),
            "no unstable pole: {settings}"
        );
    }
    let crossings = |answer: &Value| answer["crossings"].as_array().expect("a list").clone();
    assert_eq!(
        crossings(ours).len(),
        crossings(truth).len(),
        "crossings with {settings}"
    );
    for (ours, truth) in crossings(ours).iter().zip(&crossings(truth)) {
        same("a crossing", &ours["rad_s"], &truth["rad_s"]);
        same(
            "its phase margin",
            &ours["phase_margin_deg"],
            &truth["phase_margin_deg"],
        );
    }
}
