//! The plants beside SR4DoF: the XY stage, masses and springs, and plants given by their modes.

use serde_json::{Value, json};

use crate::program::{Bench, Draw, near, number};
use crate::truth;

fn list<'a>(answer: &'a Value, key: &str) -> &'a [Value] {
    answer[key]
        .as_array()
        .unwrap_or_else(|| panic!("{key} is not a list: {answer}"))
}

fn kinds(answer: &Value) -> Vec<&str> {
    list(answer, "zeros")
        .iter()
        .map(|zero| zero["kind"].as_str().expect("a kind"))
        .collect()
}

/// The zero of the upper half plane that lies furthest to the right.
fn rightmost(answer: &Value) -> (f64, f64) {
    let at = |zero: &Value| (number(&zero["re_rad_s"]), number(&zero["im_rad_s"]));
    let upper = list(answer, "zeros")
        .iter()
        .map(at)
        .filter(|zero| zero.1 >= 0.0);
    upper.max_by(|a, b| a.0.total_cmp(&b.0)).expect("a zero")
}

const LAYOUTS: [&str; 3] = ["pinwheel", "mirror_away", "mirror_toward"];
const PLACES: [&str; 8] = ["sL", "sR", "sT", "sB", "gL", "gR", "gT", "gB"];

/// An XY stage with masses, operating point, layout and damping drawn.
fn xy(draw: &mut Draw) -> String {
    let deviations: Vec<String> = PLACES
        .iter()
        .map(|place| {
            format!(
                "--set plant.secondary_mass_deviation.{place}={:?}",
                draw.between(-0.15, 0.15)
            )
        })
        .collect();
    let (layout, geometric) = (*draw.one_of(&LAYOUTS), *draw.one_of(&[true, false]));
    let damping = match draw.one_of(&[0, 1]) {
        0 => format!(
            "{{kind=\"uniform\",ratio={:?}}}",
            draw.over_decades(1e-4, 0.01)
        ),
        _ => "{kind=\"rayleigh\",mass_per_s=0.1,stiffness_s=1e-6}".to_string(),
    };
    format!(
        "--config xy {} --set plant.layout={layout} --set plant.geometric_stiffness={geometric} --set plant.damping={damping} --operating-point {}mm",
        deviations.join(" "),
        draw.between(-5.0, 5.0)
    )
}

/// A chain of masses with springs across, held to ground or floating.
fn lumped(bench: &Bench, draw: &mut Draw, floating: bool) -> String {
    let nodes: String = (0..5)
        .map(|i| {
            let (mass, actuator, sensor) = (
                draw.over_decades(0.1, 10.0),
                draw.between(-1.0, 1.0),
                draw.between(-1.0, 1.0),
            );
            format!(
                "n{i} = {{ mass_kg = {mass:?}, actuator = {actuator:?}, sensor = {sensor:?} }}\n"
            )
        })
        .collect();
    let mut ends: Vec<(String, String)> = (0..4)
        .map(|i| (format!("n{i}"), format!("n{}", i + 1)))
        .collect();
    ends.push(("n0".into(), format!("n{}", draw.one_of(&[2, 3, 4]))));
    if !floating {
        ends.push((
            format!("n{}", draw.one_of(&[0, 1, 2, 3, 4])),
            "ground".into(),
        ));
    }
    let spring = |(i, (one, other)): (usize, &(String, String))| {
        let stiffness = draw.over_decades(10.0, 1e4);
        format!(
            "k{i} = {{ between = [\"{one}\", \"{other}\"], stiffness_n_per_m = {stiffness:?} }}\n"
        )
    };
    let springs: String = ends.iter().enumerate().map(spring).collect();
    let free = usize::from(floating);
    bench.write(
        "lumped.toml",
        format!(
            "[plant]\nmodel = \"lumped\"\nfree_bodies = {free}\n[plant.nodes]\n{nodes}[plant.springs]\n{springs}[plant.damping]\nkind = \"uniform\"\nratio = 0.002\n"
        ),
    );
    "--config lumped.toml".into()
}

/// Four modes of random residues, the first one a double integrator in every second plant.
fn modal(bench: &Bench, draw: &mut Draw) -> String {
    let mut text = "[plant]\nmodel = \"modal\"\n[plant.modes]\n".to_string();
    let floating = *draw.one_of(&[true, false]);
    for i in 0..4 {
        let free = floating && i == 0;
        let omega = if free {
            0.0
        } else {
            draw.over_decades(1.0, 100.0)
        };
        let ratio = if free {
            0.0
        } else {
            draw.over_decades(1e-4, 0.1)
        };
        let residue = draw.between(-1.0, 1.0);
        text += &format!(
            "m{i} = {{ omega_rad_s = {omega:?}, residue_per_kg = {residue:?}, damping_ratio = {ratio:?} }}\n"
        );
    }
    bench.write("modal.toml", text);
    "--config modal.toml".into()
}

#[test]
fn random_plants_agree_with_python() {
    let (bench, mut draw) = (Bench::new(), Draw(31_415));
    let (mut ours, mut questions) = (Vec::new(), Vec::new());
    for i in 0..60 {
        let options = match i % 4 {
            0 | 1 => xy(&mut draw),
            2 => lumped(&bench, &mut draw, i % 8 == 2),
            _ => modal(&bench, &mut draw),
        };
        questions.push(
            json!({"what": "model", "config": bench.json(&format!("config show {options}"))}),
        );
        ours.push((
            bench.json(&format!("model modes {options}")),
            questions[i]["config"]["plant"].to_string(),
        ));
    }
    let Some(answers) = truth::ask_of("plants.py", &questions) else {
        return;
    };
    for ((ours, plant), truth) in ours.iter().zip(&answers) {
        assert_eq!(ours["cnmp_pairs"], truth["cnmp_pairs"], "{plant}");
        same_modes(ours, truth, plant);
        for key in ["zeros", "damped_zeros"] {
            same_zeros(
                list(ours, key),
                list(truth, key),
                &format!("{key} of {plant}"),
            );
        }
    }
    for pairs in [0, 1] {
        assert!(
            ours.iter().any(|(ours, _)| ours["cnmp_pairs"] == pairs),
            "no draw has {pairs} pairs"
        );
    }
}

/// Frequencies, twice damping ratio times frequency, and residues. An eigenvalue comes with 1e-15 of the largest one.
fn same_modes(ours: &Value, truth: &Value, plant: &str) {
    let [omegas, rates, residues] =
        ["omega_rad_s", "damping_rate", "residue"].map(|key| list(truth, key));
    let fastest = number(omegas.last().expect("a mode"));
    let largest = residues.iter().map(|r| number(r).abs()).fold(0.0, f64::max);
    for (index, mode) in list(ours, "modes").iter().enumerate() {
        let omega = number(&mode["omega_rad_s"]);
        let truth = [&omegas[index], &rates[index], &residues[index]].map(number);
        near(
            &format!("the square of a frequency of {plant}"),
            omega.powi(2),
            truth[0].powi(2),
            1e-12 * fastest.powi(2),
        );
        let rate = 2.0 * number(&mode["damping_ratio"]) * omega;
        near(
            &format!("a damping rate of {plant}"),
            rate,
            truth[1],
            1e-7 * truth[1].abs() + 1e-8 * fastest,
        );
        near(
            &format!("a residue of {plant}"),
            number(&mode["residue"]),
            truth[2],
            1e-6 * truth[2].abs() + 1e-9 * largest,
        );
    }
}

/// Each zero of one list is one of the other's, to 1e-6 of its magnitude, and they are equally many.
fn same_zeros(ours: &[Value], truth: &[Value], what: &str) {
    assert_eq!(ours.len(), truth.len(), "{what}");
    let mut left: Vec<(f64, f64)> = truth
        .iter()
        .map(|z| (number(&z[0]), number(&z[1])))
        .collect();
    for zero in ours {
        let (re, im) = (number(&zero["re_rad_s"]), number(&zero["im_rad_s"]));
        let distance = |z: &(f64, f64)| (z.0 - re).hypot(z.1 - im);
        let nearest = (0..left.len())
            .min_by(|&a, &b| distance(&left[a]).total_cmp(&distance(&left[b])))
            .expect("one");
        let found = left.swap_remove(nearest);
        assert!(
            distance(&found) <= 1e-6 * re.hypot(im),
            "{what}: {re} {im:+}j, Python has {found:?}"
        );
    }
}

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
    // Away from the motor: from 3.5 % of L on; towards it: from 0.5 to 4.5 %.
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
        "the largest element, in parts of K's",
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
    // Four digits behind the point are printed.
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
        // The whole floats: a double integrator of 1/(22 kg).
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
        // (1 + a) s^2 + w^2 = 0.
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
fn plants_of_section_6_1_have_their_zeros() {
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
        // x x* = c/a of a pair: the magnitude of a zero is its fourth root.
        let (re, im) = rightmost(&answer);
        if discriminant < 0.0 {
            near("the magnitude", re.hypot(im), (c / a).powf(0.25), 1e-10);
        }
    }
}

#[test]
fn rejects_invalid_plants_with_place_and_remedy() {
    let lumped = |nodes: &str, springs: &str| {
        format!(
            "[plant]\nmodel = \"lumped\"\n[plant.nodes]\n{nodes}\n[plant.springs]\n{springs}\n[plant.damping]\nkind = \"uniform\"\nratio = 0.01\n"
        )
    };
    let held = "k = { between = [\"a\", \"ground\"], stiffness_n_per_m = 1.0 }";
    let node = "a = { mass_kg = 1.0, actuator = 1.0, sensor = 1.0 }";
    let modal = |modes: &str| format!("[plant]\nmodel = \"modal\"\n[plant.modes]\n{modes}\n");
    let cases: [(String, &[&str]); 14] = [
        (
            lumped("a = { mass_kg = 0.0, actuator = 1.0, sensor = 1.0 }", held),
            &[
                "mine.toml line 4",
                "`plant.nodes.a.mass_kg`",
                "give it a mass",
            ],
        ),
        (
            lumped("a = { mass_kg = -1.0, actuator = 1.0, sensor = 1.0 }", held),
            &["`plant.nodes.a.mass_kg`", "is -1", "0 to 1000000"],
        ),
        (
            lumped(
                node,
                "k = { between = [\"a\", \"grond\"], stiffness_n_per_m = 1.0 }",
            ),
            &[
                "mine.toml line 6",
                "`plant.springs.k.between`",
                "`grond`",
                "`ground`",
            ],
        ),
        (
            lumped(
                node,
                "k = { between = [\"a\", \"a\"], stiffness_n_per_m = 1.0 }",
            ),
            &["joins `a` to itself"],
        ),
        (
            lumped(node, "k = { between = [\"a\"], stiffness_n_per_m = 1.0 }"),
            &["has 1 entries", "2 to 2"],
        ),
        (
            lumped(node, ""),
            &["`plant.free_bodies`", "free are [a]", "ground"],
        ),
        (
            lumped(
                node,
                "k = { between = [\"a\", \"ground\"], stiffness_n_per_m = 0.0 }",
            ),
            &["free are [a]"],
        ),
        (
            lumped(&format!("{node}\nb = {{ mass_kg = 1.0 }}"), held),
            &["free are [b]"],
        ),
        (
            lumped("a = { mass_kg = 1.0, sensor = 1.0 }", held),
            &["`plant.nodes`", "`actuator`"],
        ),
        (
            lumped(
                "ground = { mass_kg = 1.0, sensor = 1.0, actuator = 1.0 }",
                "",
            ),
            &["give the node another name"],
        ),
        (
            lumped(&format!("{node}\n{node}"), held),
            &["mine.toml is not TOML", "duplicate key"],
        ),
        (
            lumped("a = { mass_kg = 1.0, actuater = 1.0 }", held),
            &["`plant.nodes.a.actuater`", "nearest is `actuator`"],
        ),
        (
            modal("u = { omega_rad_s = 1.0, residue_per_kg = 0.0 }"),
            &["`plant.modes`", "no force would reach the probe"],
        ),
        (
            modal("u = { omega_rad_s = 0.0, residue_per_kg = 1.0, damping_ratio = 0.1 }"),
            &["`plant.modes.u.damping_ratio`", "double integrator"],
        ),
    ];
    for (text, words) in cases {
        for command in ["config check", "model modes", "chirp", "control"] {
            let bench = Bench::new();
            bench.write("mine.toml", &text);
            bench
                .run(&format!("{command} --config mine.toml --json"))
                .is_refused(words);
            assert_eq!(bench.files(), ["mine.toml"]);
        }
    }
}

#[test]
fn rejects_invalid_matrices_where_they_are_needed() {
    let bench = Bench::new();
    let two = "[plant]\nmodel = \"lumped\"\n[plant.nodes]\na = { mass_kg = 1.0, actuator = 1.0 }\nb = { mass_kg = 1.0, sensor = 1.0 }\n[plant.springs]\nka = { between = [\"a\", \"ground\"], stiffness_n_per_m = 1.0 }\nkb = { between = [\"b\", \"ground\"], stiffness_n_per_m = 2.0 }\n[plant.damping]\nkind = \"uniform\"\nratio = 0.01\n";
    bench.write("apart.toml", two);
    bench
        .run("model modes --config apart.toml --json")
        .is_refused(&[
            "residues of all modes are zero",
            "connect the two by springs",
        ]);
    let held = "plant.damping={kind=\"rayleigh\",mass_per_s=1.0,stiffness_s=0.0}";
    bench
        .run(&format!("model modes --config four-mass --set {held}"))
        .is_refused(&["free body", "mass_per_s = 0"]);
    bench
        .run("calibrate --config four-mass")
        .is_refused(&["free body", "static compliance"]);
    bench
        .run("chirp --config xy --set sim.geometry=quadratic")
        .is_refused(&["`sim.geometry`", "only for the model `sr4dof`", "`xy`"]);
}

#[test]
fn rejects_options_that_do_not_apply_to_the_model() {
    let bench = Bench::new();
    for command in ["model modes", "margins", "chirp", "control"] {
        let refused = |options: &str, words: &[&str]| {
            bench.run(&format!("{command} {options}")).is_refused(words)
        };
        refused(
            "--config three-mass --operating-point 5%",
            &["--operating-point", "`lumped`", "--set"],
        );
        refused(
            "--config xy --asymmetry 5%",
            &["--asymmetry", "`xy`", "--set"],
        );
    }
    let point =
        bench.json("config show --config xy --operating-point 8%")["plant"]["operating_point_m"]
            .clone();
    near(
        "8 % of the beams of the XY stage",
        number(&point),
        0.0038,
        1e-17,
    );
}

/// Share of the rows in a band that are within 1 % and 1 degree of the truth.
fn share_that_is_true(profile: &str, (low_hz, high_hz): (f64, f64)) -> Option<f64> {
    let (bench, clean) = (
        Bench::new(),
        "--set sim.probe_noise_rms_m=0 --set sim.probe_quantisation_m=0 --set sim.floor=[]",
    );
    let answer = bench.json(&format!("chirp --config {profile} {clean}"));
    assert_eq!(answer["outcome"], "completed", "{profile}");
    let text = bench.read(answer["frf_csv"].as_str().expect("a path"));
    let row = |line: &str| {
        line.split(',')
            .map(|field| field.parse().expect("a number"))
            .collect::<Vec<f64>>()
    };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(row)
        .filter(|row| (low_hz..high_hz).contains(&row[0]))
        .collect();
    let frequencies: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let config = bench.json(&format!("config show --config {profile}"));
    let answers = truth::ask_of(
        "plants.py",
        &[json!({"what": "frf", "config": config, "frequency_hz": frequencies})],
    )?;
    let good = rows
        .iter()
        .zip(answers[0].as_array().expect("a list"))
        .filter(|(row, truth)| {
            let (re, im) = (number(&truth[0]), number(&truth[1]));
            let turns = (row[2] - im.atan2(re).to_degrees()) / 360.0;
            (row[1] / re.hypot(im) - 1.0).abs() < 0.01
                && (360.0 * (turns - turns.round())).abs() < 1.0
        });
    Some(good.count() as f64 / rows.len() as f64)
}

#[test]
fn chirp_measures_each_plant() {
    for (profile, band_hz) in [
        ("xy", (2.0, 350.0)),
        ("three-mass", (0.025, 0.28)),
        ("four-mass", (0.4, 8.0)),
    ] {
        let Some(share) = share_that_is_true(profile, band_hz) else {
            return;
        };
        println!("{profile} {share}");
        assert!(
            share > 0.99,
            "{profile}: {share} of the response is within 1 % and 1 degree"
        );
    }
}

#[test]
fn each_plant_has_a_controller_and_rejects_the_fast_one() {
    let bench = Bench::new();
    for profile in ["xy", "three-mass", "four-mass"] {
        let answer = bench.json(&format!("control --config {profile}"));
        assert_eq!(answer["outcome"], "completed", "{profile}");
        assert!(
            number(&answer["predicted"]["modulus_margin"]) > 0.5,
            "{profile}"
        );
        let settling = |who: &str| number(&answer[who]["settling_time_s"]);
        // Noise and what the first mode still rings with decide when the last 2 % are reached.
        near(
            "the settling time over the one predicted",
            settling("measured") / settling("predicted"),
            1.0,
            0.1,
        );
        // Made for the gain of another stage, and the fast one for a faster loop.
        let refused = |choice: &str, words: &[&str]| {
            bench
                .run(&format!("control --config {profile} {choice}"))
                .is_refused(words)
        };
        refused(
            "--slow",
            &[
                "slow controller",
                "at least 0.3 is required",
                "--controller FILE",
                "nothing was moved",
            ],
        );
        refused("--fast", &["fast"]);
    }
}
