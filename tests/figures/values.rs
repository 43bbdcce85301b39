//! Curves and counts of several figures, against Python and closed forms, both independent of the program.

use bench_report::Mark;
use serde_json::{Value, json};

use crate::figures::all::{chart, curves, sampled};
use crate::figures::program::{Bench, near, number};
use crate::figures::truth;

/// Pairs of numbers of an answer.
fn pairs(answer: &Value) -> Vec<(f64, f64)> {
    answer
        .as_array()
        .expect("a list")
        .iter()
        .map(|pair| (number(&pair[0]), number(&pair[1])))
        .collect()
}

/// The curve of this name, or the only one.
fn curve(number: &str, heading: &str, name: &str) -> &'static [(f64, f64)] {
    let curves = curves(chart(number, heading));
    curves
        .into_iter()
        .find(|(known, _)| *known == name)
        .expect("a curve of that name")
        .1
}

#[test]
fn open_loops_of_figs_6_8_and_6_10_equal_python() {
    let bench = Bench::new();
    for (figure, controller) in [("6-8", "slow"), ("6-10", "fast")] {
        let config = bench.json(&format!(
            "config show --set control.controller={controller}"
        ));
        let points = sampled(curve(figure, "(a)", ""), 40);
        let omega: Vec<f64> = points.iter().map(|point| point.0).collect();
        let question =
            json!({"what": "points", "of": "loop", "config": config, "omega_rad_s": omega});
        let Some(answers) = truth::ask(&[question]) else {
            return;
        };
        for (point, truth) in points.iter().zip(pairs(&answers[0])) {
            let size = truth.0.hypot(truth.1);
            // At a resonance with a damping ratio of 0.004, |L| amplifies the relative rounding of the frequency by 250.
            near(
                &format!("|L| of Fig {figure} at {} rad/s", point.0),
                point.1,
                size,
                1e-9 * size,
            );
        }
    }
}

#[test]
fn transfer_functions_of_fig_2_4_equal_eq_2_5() {
    let bench = Bench::new();
    for (heading, asymmetry) in [("Asymmetry 0", 0.0), ("Asymmetry 5", 0.05)] {
        for (name, point) in [("2.5 % of L", 2.5), ("5 % of L", 5.0)] {
            let config = bench.json(&format!(
                "config show --config chapter2 --operating-point {point}% --asymmetry {asymmetry}"
            ));
            let points = sampled(curve("2-4", heading, name), 30);
            let omega: Vec<f64> = points
                .iter()
                .map(|point| point.0 * std::f64::consts::TAU)
                .collect();
            let question =
                json!({"what": "points", "of": "plant", "config": config, "omega_rad_s": omega});
            let Some(answers) = truth::ask(&[question]) else {
                return;
            };
            for (point, truth) in points.iter().zip(pairs(&answers[0])) {
                let size = truth.0.hypot(truth.1);
                // The figure omits negligible modes: those below 0.1 % of the other modes at their own resonance.
                near(
                    &format!("|G| at {} Hz", point.0),
                    point.1,
                    size,
                    2e-3 * size,
                );
            }
        }
    }
}

#[test]
fn step_responses_of_figs_3_5_and_3_12_equal_python() {
    let u_v = |r: f64| json!([[1.0, 0.001, 1.0], [10.0, 0.001, r]]);
    let r_u_v = |size: f64| {
        json!([
            [1.0, 0.0005, 1.0],
            [10.0, 0.001, -size],
            [11.0, 0.001, size]
        ])
    };
    let cases = [
        ("3-5", "(c) Step", "", u_v(-0.5)),
        ("3-5", "(d) Step", "", u_v(-5.0)),
        ("3-12", "(b)", "α0 = 5", r_u_v(5.0)),
        ("3-12", "(b)", "α0 = 21", r_u_v(21.0)),
    ];
    for (figure, heading, name, terms) in cases {
        let points = sampled(curve(figure, heading, name), 60);
        let times: Vec<f64> = points.iter().map(|point| point.0).collect();
        let Some(answers) =
            truth::ask(&[json!({"what": "course", "terms": terms, "time_s": times})])
        else {
            return;
        };
        for (point, truth) in points.iter().zip(answers[0].as_array().expect("a list")) {
            near(
                &format!("Fig {figure} {name} at {} s", point.0),
                point.1,
                number(truth),
                1e-9,
            );
        }
    }
}

#[test]
fn zeros_of_fig_3_12_equal_those_with_60_digits() {
    let map = chart("3-12", "(c)");
    for size in [0.5, 5.0, 10.0, 15.0, 21.0] {
        let is_zeros = |mark: &'_ Mark| matches!(mark, Mark::Points { name, .. } if *name == format!("α0 = {size}"));
        let Some(Mark::Points { points, .. }) = map.marks.iter().find(|mark| is_zeros(mark)) else {
            panic!("no zeros of {size}")
        };
        let terms = json!([[0.0, 0.0, 1.0], [10.0, 0.0, -size], [11.0, 0.0, size]]);
        let Some(answers) =
            truth::ask(&[json!({"what": "modal", "terms": terms, "constant": 0.0})])
        else {
            return;
        };
        let truth = pairs(&answers[0]["zeros"]);
        for (re, im) in points {
            let distance = truth
                .iter()
                .map(|zero| (zero.0 - re).hypot(zero.1 - im))
                .fold(f64::MAX, f64::min);
            // At 21 two zeros meet: their error is the square root of the rounding.
            assert!(
                distance < 1e-6 * re.hypot(*im),
                "{re} {im:+}j of α0 = {size} is {distance} off"
            );
        }
    }
}

#[test]
fn maps_of_figs_2_5_and_5_2_equal_python() {
    let bench = Bench::new();
    for (figure, heading, profile) in [
        ("2-5", "(a)", "chapter2"),
        ("5-2", "(a)", "chapter2"),
        ("5-2", "(b)", "stage"),
    ] {
        let cells = chart(figure, heading)
            .marks
            .iter()
            .find(|mark| matches!(mark, Mark::Cells { .. }));
        let Some(Mark::Cells {
            x,
            y,
            rows,
            colours,
        }) = cells
        else {
            panic!("no map")
        };
        let black = colours.len() - 1;
        let mut questions = Vec::new();
        let mut expected = Vec::new();
        for k in 0..24 {
            // Cells spread over both axes, in different rows and columns.
            let (i, j) = ((17 * k + 61) % rows[0].len(), (29 * k + 7) % rows.len());
            let middle = |edges: &[f64], k: usize| 0.5 * (edges[k] + edges[k + 1]) / 100.0;
            let (asymmetry, point) = (middle(x, i), middle(y, j));
            let config = bench.json(&format!("config show --config {profile} --set plant.mass_asymmetry={asymmetry:?} --set plant.operating_point_m={:?}", point * 0.0475));
            questions.push(json!({"what": "model", "config": config}));
            expected.push((asymmetry, point, usize::from(rows[j][i] == black)));
        }
        let Some(answers) = truth::ask(&questions) else {
            return;
        };
        let mut with = 0;
        for ((asymmetry, point, ours), truth) in expected.into_iter().zip(answers) {
            assert_eq!(
                json!(ours),
                truth["cnmp_pairs"],
                "Fig {figure} at asymmetry {asymmetry}, {point} of L"
            );
            with += ours;
        }
        assert!(
            (1..24).contains(&with),
            "the sample must contain cells with and without CNMP zeros: {with} of 24 have them"
        );
    }
}

#[test]
fn circles_of_fig_1_3_have_a_constant_angle() {
    for (heading, angle) in [("(a)", 90.0), ("(b)", 50.0)] {
        let circle = curve("1-3", heading, "same Θ");
        for (x, y) in sampled(circle, 97).into_iter().filter(|(x, _)| *x > 0.05) {
            // The angle between the two rays to +-j, by the cosine rule.
            let (a, b) = ((-x, 1.0 - y), (-x, -1.0 - y));
            let cosine = (a.0 * b.0 + a.1 * b.1) / (a.0.hypot(a.1) * b.0.hypot(b.1));
            near("the angle", cosine.acos().to_degrees(), angle, 1e-6);
        }
    }
}

#[test]
fn parabolas_of_fig_4_2_follow_eq_4_3_and_touch_zero() {
    for (name, residue) in [
        ("αR = −1.0", -1.0),
        ("αR = 0.1", 0.1),
        ("αR = 2.0", 2.0),
        ("αR = 10.0", 10.0),
    ] {
        for (x, y) in sampled(curve("4-2", "(a)", name), 40) {
            // b2 x^2 + b1 x + b0 with au = -1, av = 1, wu^2 = 1, wv^2 = 2.
            let expected = residue * x * x + (3.0 * residue - 2.0 + 1.0) * x + 2.0 * residue;
            near("N(x)", y, expected, 1e-12 * (1.0 + expected.abs()));
        }
    }
    for (_, points) in curves(chart("4-2", "(b)"))
        .into_iter()
        .filter(|(name, _)| name.starts_with("αR"))
    {
        let least = points
            .iter()
            .map(|point| point.1.abs())
            .fold(f64::MAX, f64::min);
        // With a grid of 0.02 the nearest point is at most 0.01 from the point of contact, where N is at most 5.83 x 0.01^2 = 6e-4.
        assert!(
            points.iter().all(|point| point.1 > -1e-9) && least < 4e-3,
            "{least}"
        );
    }
}

#[test]
fn crossing_of_the_loci_of_fig_2_6_equals_python() {
    let bench = Bench::new();
    let config = bench.json("config show --config chapter2 --asymmetry 0");
    let Some(answers) = truth::ask(&[json!({"what": "crossing", "config": config})]) else {
        return;
    };
    let lines: Vec<&[(f64, f64)]> = curves(chart("2-6", "(a)"))
        .into_iter()
        .map(|(_, points)| points)
        .collect();
    // The first two lines are modes 3 and 4 at asymmetry 0. They are closest at the crossing.
    let gap = |k: &usize| (lines[0][*k].1 - lines[1][*k].1).abs();
    let closest = (0..lines[0].len())
        .min_by(|a, b| gap(a).total_cmp(&gap(b)))
        .expect("points");
    near(
        "the crossing in % of L",
        lines[0][closest].0,
        100.0 * number(&answers[0]["operating_point"]),
        0.1,
    );
    near(
        "its frequency in Hz",
        lines[0][closest].1,
        number(&answers[0]["frequency_hz"]),
        0.2,
    );
}
