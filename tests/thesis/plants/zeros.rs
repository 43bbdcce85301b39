//! Zeros of the plants of the thesis and of the XY layouts.

use serde_json::{Value, json};

use super::{LAYOUTS, kinds, rightmost};
use crate::answer::list;
use crate::program::{Bench, near, number};
use crate::truth;

#[test]
fn cnmp_pairs_of_the_xy_layouts_agree_with_python() {
    let bench = Bench::new();
    let points: Vec<f64> = (0..=30).map(|i| 0.005 * f64::from(i)).collect();
    let pairs = |layout: &str, point: f64| {
        let at = format!(
            "--set plant.layout={layout} --operating-point {}%",
            100.0 * point
        );
        number(&bench.json(&format!("model modes --config xy {at}"))["cnmp_pairs"])
    };
    let ours = |layout: &str| {
        points
            .iter()
            .map(|&point| pairs(layout, point))
            .collect::<Vec<_>>()
    };
    let [pinwheel, away, toward] = LAYOUTS.map(ours);
    assert!(pinwheel.iter().all(|pairs| *pairs == 0.0), "{pinwheel:?}");
    let question = |layout: &str| {
        let config = bench.json(&format!(
            "config show --config xy --set plant.layout={layout}"
        ));
        json!({"what": "pairs", "config": config, "operating_points": points})
    };
    let Some(answers) = truth::ask_of("plants.py", &LAYOUTS.map(question)) else {
        return;
    };
    for (ours, truth) in [pinwheel, away, toward].iter().zip(&answers) {
        let truth: Vec<f64> = list(truth, "cnmp_pairs").iter().map(number).collect();
        assert_eq!(ours, &truth);
    }
    let with = |answer: &Value| {
        list(answer, "cnmp_pairs")
            .iter()
            .filter(|pairs| number(pairs) > 0.0)
            .count()
    };
    // Number of operating points with CNMP pairs. Mirrored away from the motor: from 3.5 % of L on; towards it: from 0.5 to 4.5 %.
    assert_eq!(answers.iter().map(with).collect::<Vec<_>>(), [0, 24, 9]);
}

#[test]
fn static_load_shifts_xy_frequencies_by_at_most_0_42_hz() {
    let bench = Bench::new();
    let options = |geometric: bool| {
        format!("--config xy --operating-point 9.5% --set plant.geometric_stiffness={geometric}")
    };
    let hertz = |geometric: bool| -> Vec<f64> {
        let answer = bench.json(&format!("model modes {}", options(geometric)));
        list(&answer, "modes")
            .iter()
            .map(|mode| number(&mode["frequency_hz"]))
            .collect()
    };
    let shift_hz = hertz(true)
        .iter()
        .zip(hertz(false))
        .map(|(with, without)| (with - without).abs())
        .fold(0.0, f64::max);
    near("the largest shift", shift_hz, 0.415, 0.0005);
    let question = json!({"what": "geometric", "config": bench.json(&format!("config show {}", options(true)))});
    let Some(answers) = truth::ask_of("plants.py", &[question]) else {
        return;
    };
    near(
        "the largest shift, by Lagrange's multipliers",
        shift_hz,
        number(&answers[0]["shift_hz"]),
        1e-9,
    );
    near(
        "the largest element relative to that of K",
        number(&answers[0]["ratio"]),
        0.0568,
        0.00005,
    );
}

#[test]
fn zeros_of_three_masses_match_section_4_4_1() {
    let bench = Bench::new();
    let at = |k: f64| {
        bench.json(&format!(
            "model modes --config three-mass --set plant.springs.k.stiffness_n_per_m={k:?}"
        ))
    };
    assert_eq!(kinds(&at(0.0)), ["MMP"; 4]);
    let answer = bench.json("model modes --config three-mass");
    assert_eq!(
        (&answer["model"], &answer["cnmp_pairs"]),
        (&json!("lumped"), &json!(1))
    );
    assert_eq!(answer["operating_point_m"], Value::Null);
    let (re, im) = rightmost(&answer);
    // Four decimals are printed.
    near("the real part", re, 0.0183, 5e-5);
    near("the imaginary part", im, 1.0554, 5e-5);
    // "If one continues to increase k, the zeros move back onto the imaginary axis, with a frequency higher than mode v."
    let stiff = at(0.2);
    assert_eq!(kinds(&stiff), ["MMP"; 4]);
    let fastest = number(&list(&stiff, "modes")[2]["omega_rad_s"]);
    let mode_v = list(&stiff, "modes")
        .iter()
        .map(|mode| number(&mode["omega_rad_s"]))
        .fold(0.0, f64::max);
    assert!(rightmost(&stiff).1 > 1.1 && mode_v == fastest);
}

#[test]
fn zeros_of_four_masses_are_complex_from_50_to_200_n_per_m() {
    let bench = Bench::new();
    let at = |k: f64| {
        bench.json(&format!(
            "model modes --config four-mass --set plant.springs.k23.stiffness_n_per_m={k:?}"
        ))
    };
    for (k, pairs) in [
        (0.0, 0),
        (49.9, 0),
        (50.1, 1),
        (125.0, 1),
        (199.9, 1),
        (200.1, 0),
        (300.0, 0),
    ] {
        let answer = at(k);
        assert_eq!(answer["cnmp_pairs"], pairs, "k23 = {k}");
        // The rigid-body mode is a double integrator with the residue 1/(22 kg).
        let free = &list(&answer, "modes")[0];
        assert_eq!(
            (number(&free["omega_rad_s"]), free["sign"].as_str()),
            (0.0, Some("+"))
        );
        near(
            "the residue of the double integrator",
            number(&free["residue"]),
            1.0 / 22.0,
            1e-14,
        );
    }
}

#[test]
fn double_integrator_and_mode_have_the_zeros_of_eq_3_3() {
    let bench = Bench::new();
    for residue in [-4.0, -1.5, -0.5, 0.25, 2.0] {
        let text = format!(
            "[plant]\nmodel = \"modal\"\n[plant.modes]\nu = {{ omega_rad_s = 0, residue_per_kg = 1.0 }}\nv = {{ omega_rad_s = 10.0, residue_per_kg = {residue:?} }}\n"
        );
        bench.write("eq33.toml", text);
        let answer = bench.json("model modes --config eq33.toml");
        // The zeros satisfy (1 + a) s^2 + w^2 = 0.
        let square: f64 = -100.0 / (1.0 + residue);
        assert_eq!(
            kinds(&answer),
            if square < 0.0 {
                ["MMP", "MMP"]
            } else {
                ["RMP", "RNMP"]
            },
            "a = {residue}"
        );
        let largest = list(&answer, "zeros")
            .iter()
            .map(|z| number(&z["im_rad_s"]).max(number(&z["re_rad_s"])));
        near(
            "the zero",
            largest.fold(0.0, f64::max),
            f64::sqrt(square.abs()),
            1e-12 * 100.0,
        );
    }
}

#[test]
fn plants_of_section_6_1_have_the_zeros_of_the_closed_form() {
    let bench = Bench::new();
    let plant = |name: &str, modes: &str| {
        bench.write(
            name,
            format!("[plant]\nmodel = \"modal\"\n[plant.modes]\n{modes}"),
        );
        bench.json(&format!("model modes --config {name}"))
    };
    let one = plant(
        "eq61.toml",
        "r = { omega_rad_s = 10.0, residue_per_kg = 100.0, damping_ratio = 0.01 }\n",
    );
    assert_eq!(list(&one, "zeros").len(), 0);
    near(
        "the damping",
        number(&list(&one, "modes")[0]["damping_ratio"]),
        0.01,
        1e-15,
    );
    for (sign, wanted) in [(1.0, "+-+"), (-1.0, "++-")] {
        let (u, v): (f64, f64) = (-1.65 * sign, 1.52 * sign);
        let modes = format!(
            "R = {{ omega_rad_s = 0.0, residue_per_kg = 7.98 }}\nu = {{ omega_rad_s = 10.0, residue_per_kg = {u:?}, damping_ratio = 0.001 }}\nv = {{ omega_rad_s = 12.0, residue_per_kg = {v:?}, damping_ratio = 0.001 }}\n"
        );
        let answer = plant("eq63.toml", &modes);
        assert_eq!(answer["sign_sequence"], wanted);
        // Without damping, in x = s^2: R (x + 100)(x + 144) + u x (x + 144) + v x (x + 100) = 0.
        let (a, b, c) = (
            7.98 + u + v,
            7.98 * 244.0 + 144.0 * u + 100.0 * v,
            7.98 * 14400.0,
        );
        let discriminant = b * b - 4.0 * a * c;
        assert_eq!(
            answer["cnmp_pairs"],
            i32::from(discriminant < 0.0),
            "{discriminant}"
        );
        // For a complex pair x x* = c/a: the magnitude of a zero is the fourth root of c/a.
        let (re, im) = rightmost(&answer);
        if discriminant < 0.0 {
            near("the magnitude", re.hypot(im), (c / a).powf(0.25), 1e-10);
        }
    }
}
