//! Plants that cannot be built, and options that do not apply to a plant.

use crate::program::{Bench, near, number};

#[test]
fn rejects_invalid_plants_with_key_and_remedy() {
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
            &["`plant.modes`", "no force reaches the probe"],
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
fn rejects_plants_that_a_command_cannot_use() {
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
