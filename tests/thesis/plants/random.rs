//! Plants with random parameters, against Python.

use serde_json::{Value, json};

use super::LAYOUTS;
use crate::answer::{assert_same_zeros, list};
use crate::program::{Bench, Draw, near, number};
use crate::truth;

const PLACES: [&str; 8] = ["sL", "sR", "sT", "sB", "gL", "gR", "gT", "gB"];

/// An XY stage with random masses, operating point, layout and damping.
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

/// A chain of masses with an additional spring across it, with or without a spring to ground.
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

/// Four modes with random residues. The first is a double integrator in half of the plants.
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
        assert_same_modes(ours, truth, plant);
        for key in ["zeros", "damped_zeros"] {
            assert_same_zeros(
                list(ours, key),
                list(truth, key),
                &format!("{key} of {plant}"),
            );
        }
    }
    for pairs in [0, 1] {
        assert!(
            ours.iter().any(|(ours, _)| ours["cnmp_pairs"] == pairs),
            "no plant of the sample has {pairs} pairs"
        );
    }
}

/// Asserts equal frequencies, damping rates 2 zeta w and residues. An eigenvalue has an error of 1e-15 of the largest one.
fn assert_same_modes(ours: &Value, truth: &Value, plant: &str) {
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
