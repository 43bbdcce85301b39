//! `bench model modes`: the tables of Chapter 2, the signs of Chapter 6, and the zeros.

use serde_json::{Value, json};

use crate::answer::{assert_same_zeros, list};
use crate::program::{Bench, Draw, near, number};
use crate::truth;

/// The modes at Table 2-2's operating point.
fn table_2_2(asymmetry: &str) -> Value {
    Bench::new().json(&format!(
        "model modes --config chapter2 --operating-point 5% --asymmetry {asymmetry}"
    ))
}

fn signs(answer: &Value) -> String {
    list(answer, "modes")
        .iter()
        .map(|mode| mode["sign"].as_str().expect("a sign"))
        .collect()
}

/// `model modes` at an operating point (ratio to L) and an asymmetry (ratio).
fn modes_at(bench: &Bench, profile: &str, point: f64, asymmetry: f64) -> Value {
    bench.json(&format!(
        "model modes --config {profile} --operating-point {}% --asymmetry {asymmetry}",
        point * 100.0
    ))
}

#[test]
fn frequencies_match_table_2_2() {
    for (asymmetry, expected) in [
        ("0", [18.164, 27.580, 153.240, 154.301]),
        ("5%", [18.151, 27.569, 150.126, 153.859]),
    ] {
        let answer = table_2_2(asymmetry);
        assert_eq!(list(&answer, "modes").len(), 4);
        for (mode, hz) in list(&answer, "modes").iter().zip(expected) {
            near(
                "a frequency of Table 2-2",
                number(&mode["frequency_hz"]),
                hz,
                0.01,
            );
            near(
                "its rad/s",
                number(&mode["omega_rad_s"]),
                hz * std::f64::consts::TAU,
                0.01 * std::f64::consts::TAU,
            );
        }
    }
}

#[test]
fn eigenvectors_match_table_2_2() {
    // Printed values of [x1, y1, y2, y3]. In mode 1 at D = 5 % the printed signs of y2 and y3 are inverted. Four digits are printed: half
    // of the last one is 5e-5. The masses of the table are rounded to 0.1 %. 5e-4 covers both.
    let symmetric = [
        [0.9999, 0.0, 0.0068, -0.0068],
        [0.0, 0.8075, 0.4171, 0.4171],
        [-0.0231, 0.0, -0.7069, 0.7069],
        [0.0, 0.0481, -0.7063, -0.7063],
    ];
    let asymmetric = [
        [0.9999, 0.0, 0.0068, -0.0068],
        [0.0, 0.8073, 0.4176, 0.4169],
        [-0.0189, 0.0294, -0.9845, 0.1718],
        [-0.0139, -0.0387, 0.1384, 0.9895],
    ];
    for (asymmetry, expected) in [("0", symmetric), ("5%", asymmetric)] {
        let answer = table_2_2(asymmetry);
        for (number_of, (mode, printed)) in list(&answer, "modes").iter().zip(expected).enumerate()
        {
            let shape: Vec<f64> = list(mode, "shape").iter().map(number).collect();
            let sign = shape
                .iter()
                .zip(printed)
                .map(|(ours, theirs)| ours * theirs)
                .sum::<f64>()
                .signum();
            for (ours, theirs) in shape.iter().zip(printed) {
                near(
                    &format!("an element of mode {} at {asymmetry}", number_of + 1),
                    sign * ours,
                    theirs,
                    5e-4,
                );
            }
        }
    }
}

#[test]
fn signs_alternate_only_where_stage_2_is_heavier() {
    let bench = Bench::new();
    for (asymmetry, sequence) in [("10%", "+-+"), ("-10%", "++-")] {
        let answer = bench.json(&format!("model modes --asymmetry {asymmetry}"));
        assert_eq!(answer["sign_sequence"], sequence, "at {asymmetry}");
        // The Y mode is the slowest. It has no residue between motor and probe.
        assert_eq!(signs(&answer), format!("0{sequence}"), "at {asymmetry}");
        for mode in list(&answer, "modes")
            .iter()
            .filter(|mode| mode["sign"] != "0")
        {
            let positive = number(&mode["residue"]) > 0.0;
            assert_eq!(mode["sign"], if positive { "+" } else { "-" });
        }
    }
}

#[test]
fn symmetric_stage_has_two_modes_without_residue() {
    let answer = table_2_2("0");
    assert_eq!(signs(&answer), "+0-0");
    assert_eq!(answer["sign_sequence"], "+-");
    // By symmetry x1 = 0 in modes 2 and 4: the residue is rounding, about 1e-16 of the largest one.
    for index in [1, 3] {
        near(
            "a residue of zero",
            number(&list(&answer, "modes")[index]["residue"]),
            0.0,
            1e-12,
        );
    }
}

#[test]
fn only_the_rigid_body_mode_is_observed_at_rest_in_y() {
    // At Y1o = 0 X and Y are not coupled: a single mode has the whole static compliance 1/(k4 + k5).
    for profile in ["stage", "chapter2"] {
        for asymmetry in [-0.1, 0.0, 0.1] {
            let answer = modes_at(&Bench::new(), profile, 0.0, asymmetry);
            assert_eq!(answer["sign_sequence"], "+");
            assert_eq!(answer["cnmp_pairs"], 0);
            let observed = list(&answer, "modes")
                .iter()
                .find(|mode| mode["sign"] == "+")
                .expect("the mode");
            let stiffness = if profile == "stage" {
                72_000.0
            } else {
                8_800.0
            };
            let compliance =
                number(&observed["residue"]) / number(&observed["omega_rad_s"]).powi(2);
            near(
                "the compliance times the stiffness",
                compliance * stiffness,
                1.0,
                1e-12,
            );
        }
    }
}

#[test]
fn stage_as_built_has_zeros_at_12_8_and_530_3_rad_s() {
    let answer = Bench::new().json("model modes --operating-point 8% --asymmetry 10%");
    assert_eq!(answer["cnmp_pairs"], 1);
    assert_eq!(answer["phase_drop_deg"], 360.0);
    assert_eq!(answer["dominant_sequence"], "[R]-[u]-[v]");
    let quartet: Vec<&Value> = list(&answer, "zeros")
        .iter()
        .filter(|zero| ["CMP", "CNMP"].contains(&zero["kind"].as_str().unwrap()))
        .collect();
    assert_eq!(quartet.len(), 4);
    for zero in quartet {
        let (re, im) = (number(&zero["re_rad_s"]), number(&zero["im_rad_s"]));
        // One decimal is printed: half of it is 0.05.
        near("the real part", re.abs(), 12.8, 0.05);
        near("the imaginary part", im.abs(), 530.3, 0.06);
        assert_eq!(zero["kind"], if re > 0.0 { "CNMP" } else { "CMP" });
    }
}

#[test]
fn no_cnmp_zeros_without_excess_mass_on_stage_2() {
    let bench = Bench::new();
    for profile in ["stage", "chapter2"] {
        for asymmetry in [-0.2, -0.05, -0.01, -0.001, 0.0] {
            for step in 0..=30 {
                let point = 0.005 * f64::from(step);
                let answer = modes_at(&bench, profile, point, asymmetry);
                assert_eq!(
                    answer["cnmp_pairs"], 0,
                    "{profile} at {point} of L, D = {asymmetry}"
                );
                assert!(
                    list(&answer, "zeros")
                        .iter()
                        .all(|zero| number(&zero["re_rad_s"]) <= 0.0)
                );
            }
        }
    }
}

#[test]
fn one_percent_excess_mass_gives_cnmp_zeros_from_3_40_to_6_75_percent() {
    // The printed limits, in steps of 0.05 %, are the first and the last point with CNMP zeros; the next points have none.
    let bench = Bench::new();
    let pairs = |per_cent: f64| {
        let at = format!("--operating-point {per_cent}% --asymmetry 1%");
        let answer = bench.json(&format!(
            "model modes --config chapter2 --set plant.secondary_stage_mass_kg=0.018 {at}"
        ));
        number(&answer["cnmp_pairs"])
    };
    let found: Vec<(f64, f64)> = [3.35, 3.40, 3.45, 5.0, 6.70, 6.75, 6.80]
        .map(|point| (point, pairs(point)))
        .into();
    assert_eq!(
        found,
        [
            (3.35, 0.0),
            (3.40, 1.0),
            (3.45, 1.0),
            (5.0, 1.0),
            (6.70, 1.0),
            (6.75, 1.0),
            (6.80, 0.0)
        ]
    );
}

#[test]
fn close_modes_of_a_symmetric_stage_cross_at_6_580_percent() {
    // Modes are sorted by frequency: at the crossing the mode without residue changes from fourth to third.
    let bench = Bench::new();
    let below = modes_at(&bench, "chapter2", 0.06575, 0.0);
    let above = modes_at(&bench, "chapter2", 0.06585, 0.0);
    assert_eq!(
        (signs(&below), signs(&above)),
        ("+0-0".to_string(), "+00-".to_string())
    );
    for answer in [&below, &above] {
        for mode in &list(answer, "modes")[2..] {
            // The frequencies change by some 10 Hz per 1 % of L: 0.05 Hz over the 0.005 % to the crossing.
            near("a close mode", number(&mode["frequency_hz"]), 152.42, 0.06);
        }
    }
}

#[test]
fn transfer_function_is_even_in_the_operating_point() {
    // In Eq. (2-5), replacing Y1o by -Y1o is the same as replacing y by -y.
    let bench = Bench::new();
    for (point, asymmetry) in [(0.08, 0.1), (0.034, -0.03)] {
        let (positive, negative) = (
            modes_at(&bench, "stage", point, asymmetry),
            modes_at(&bench, "stage", -point, asymmetry),
        );
        assert_eq!(positive["sign_sequence"], negative["sign_sequence"]);
        for (key, field) in [
            ("modes", "residue"),
            ("modes", "omega_rad_s"),
            ("zeros", "im_rad_s"),
        ] {
            for (a, b) in list(&positive, key).iter().zip(list(&negative, key)) {
                near(
                    field,
                    number(&a[field]),
                    number(&b[field]),
                    1e-9 * number(&a[field]).abs().max(1e-3),
                );
            }
        }
    }
}

#[test]
fn cnmp_band_and_crossing_agree_with_python() {
    let bench = Bench::new();
    let one = "--config chapter2 --set plant.secondary_stage_mass_kg=0.018 --asymmetry 1%";
    let points: Vec<f64> = (0..=60).map(|i| 0.0025 * f64::from(i)).collect();
    let questions = [
        json!({"what": "bands", "config": bench.json(&format!("config show {one}")), "operating_points": points}),
        json!({"what": "crossing", "config": bench.json("config show --config chapter2 --asymmetry 0")}),
    ];
    let Some(answers) = truth::ask(&questions) else {
        return;
    };
    let edges: Vec<f64> = list(&answers[0], "edges").iter().map(number).collect();
    assert_eq!(edges.len(), 2);
    near("the lower limit of the band", edges[0], 0.0340, 5e-5);
    near("the upper limit of the band", edges[1], 0.0675, 2e-4);
    let pairs = |point: f64| {
        number(
            &bench.json(&format!(
                "model modes {one} --operating-point {}%",
                point * 100.0
            ))["cnmp_pairs"],
        )
    };
    for (edge, inwards) in [(edges[0], 1e-6), (edges[1], -1e-6)] {
        // Checks 1e-6 of L inside and outside each limit (1/34,000 of the lower one).
        assert_eq!(
            (pairs(edge - inwards), pairs(edge + inwards)),
            (0.0, 1.0),
            "around {edge}"
        );
    }
    near(
        "the crossing",
        number(&answers[1]["operating_point"]),
        0.06580,
        5e-6,
    );
    near(
        "its frequency",
        number(&answers[1]["frequency_hz"]),
        152.42,
        5e-3,
    );
}

/// Random settings around both profiles.
fn settings(draw: &mut Draw) -> String {
    let mut sets = vec![format!("--config {}", draw.one_of(&["stage", "chapter2"]))];
    let mut set = |key: &str, value: String| sets.push(format!("--set plant.{key}={value}"));
    set(
        "motion_stage_mass_kg",
        format!("{:?}", draw.between(0.1, 0.6)),
    );
    set(
        "secondary_stage_mass_kg",
        format!("{:?}", draw.between(0.01, 0.09)),
    );
    set(
        "intermediate_stage_mass_kg",
        format!("{:?}", draw.between(0.1, 1.0)),
    );
    set(
        "spring_stiffness_n_per_m",
        format!("{:?}", draw.over_decades(2e3, 6e4)),
    );
    set(
        "beam_thickness_m",
        format!("{:?}", draw.between(0.5e-3, 0.8e-3)),
    );
    set("beam_length_m", format!("{:?}", draw.between(0.04, 0.06)));
    set("poisson_ratio", format!("{:?}", draw.between(0.2, 0.4)));
    let damping = match draw.one_of(&[0, 1, 2]) {
        0 => format!(
            "{{kind=\"uniform\",ratio={:?}}}",
            draw.over_decades(1e-4, 0.05)
        ),
        1 => {
            let (mass, stiffness) = (draw.over_decades(1e-3, 10.0), draw.over_decades(1e-7, 1e-4));
            format!("{{kind=\"rayleigh\",mass_per_s={mass:?},stiffness_s={stiffness:?}}}")
        }
        _ => {
            let (first, second) = (draw.between(0.005, 0.02), draw.between(0.003, 0.01));
            format!(
                "{{kind=\"measured\",first={{omega_rad_s=150.0,ratio={first:?}}},second={{omega_rad_s=600.0,ratio={second:?}}}}}"
            )
        }
    };
    set("damping", damping);
    let (point, asymmetry) = (draw.between(-12.0, 12.0), draw.between(-20.0, 20.0));
    format!(
        "{} --operating-point {point}% --asymmetry {asymmetry}%",
        sets.join(" ")
    )
}

#[test]
fn random_stages_agree_with_python() {
    let (bench, mut draw) = (Bench::new(), Draw(2_718));
    let drawn: Vec<String> = (0..48).map(|_| settings(&mut draw)).collect();
    let question =
        |s: &String| json!({"what": "model", "config": bench.json(&format!("config show {s}"))});
    let Some(answers) = truth::ask(&drawn.iter().map(question).collect::<Vec<_>>()) else {
        return;
    };
    let mut with_cnmp = 0;
    for (settings, truth) in drawn.iter().zip(&answers) {
        let ours = bench.json(&format!("model modes {settings}"));
        assert_eq!(ours["cnmp_pairs"], truth["cnmp_pairs"], "{settings}");
        with_cnmp += usize::from(ours["cnmp_pairs"] == 1);
        assert_same_modes(list(&ours, "modes"), list(truth, "modes"), settings);
        for kind in ["zeros", "damped_zeros"] {
            assert_same_zeros(
                list(&ours, kind),
                list(truth, kind),
                &format!("{kind} of {settings}"),
            );
        }
    }
    assert!(
        (5..=43).contains(&with_cnmp),
        "the sample must contain stages with and without CNMP zeros: {with_cnmp} of 48 have them"
    );
}

/// Asserts equality within 1e-6; residues within 1e-6 or 1e-12 of the largest one (small residues are differences of large numbers).
fn assert_same_modes(ours: &[Value], truth: &[Value], settings: &str) {
    assert_eq!(ours.len(), truth.len());
    let largest = truth
        .iter()
        .map(|mode| number(&mode["residue"]).abs())
        .fold(0.0, f64::max);
    for (mode, truth) in ours.iter().zip(truth) {
        for field in ["omega_rad_s", "damping_ratio"] {
            let expected = number(&truth[field]);
            near(
                &format!("{field} of {settings}"),
                number(&mode[field]),
                expected,
                1e-6 * expected,
            );
        }
        let expected = number(&truth["residue"]);
        let tolerance = (1e-6 * expected.abs()).max(1e-12 * largest);
        near(
            &format!("a residue of {settings}"),
            number(&mode["residue"]),
            expected,
            tolerance,
        );
    }
}
