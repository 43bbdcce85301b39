//! Invalid studies are rejected before the first draw, with reason and remedy; failed draws are counted.

use serde_json::json;

use crate::study::figures::{XY, list};
use crate::study::program::{Bench, number};

#[test]
fn rejects_invalid_tolerances() {
    let bench = Bench::new();
    for (tolerance, words) in [
        (
            "plant.motion_mass_kg=+-1%",
            &[
                "`plant.motion_mass_kg` is not a setting",
                "nearest is `plant.motion_stage_mass_kg`",
            ][..],
        ),
        (
            "plant.*.zz=+-1%",
            &["`plant.*.zz` is not a setting of this plant"],
        ),
        (
            "loop.rate_hz=+-1%",
            &["`loop.rate_hz` is not a setting of the plant", "`plant.`"],
        ),
        ("plant.layout=+-1", &["`plant.layout` is not a quantity"]),
        ("plant.beam_length_m", &["KEY=uniform:LOW:HIGH"]),
        ("plant.beam_length_m=1%", &["KEY=+-LIMIT"]),
        ("plant.beam_length_m=uniform:x:y", &["`x` is not a number"]),
        (
            "plant.beam_length_m=uniform:1um:-1um",
            &[
                "plant.beam_length_m",
                "is empty",
                "lower and a higher limit",
            ],
        ),
        ("plant.beam_length_m=normal:0", &["above zero"]),
        ("plant.youngs_modulus_pa=+-1mm", &["a length in m", "Pa"]),
        // A percentage of a ratio refers to 1.
        (
            "plant.secondary_mass_deviation.sL=+-100%",
            &["reaches -1", "give a value from -0.9 to 9"],
        ),
        // Uniform tolerance out of range at one end; normal tolerance out of range at 6 sigma; violated relation between two
        // settings.
        (
            "plant.secondary_mass_deviation.sL=uniform:-1:0",
            &["reaches -1", "give a value from -0.9 to 9", "narrow it"],
        ),
        (
            "plant.motion_stage_mass_kg=normal:20%",
            &[
                "`plant.motion_stage_mass_kg` reaches -0.05",
                "give a value from",
            ],
        ),
        (
            "plant.operating_point_m=+-50mm",
            &["beyond the length of the beams"],
        ),
    ] {
        let answer = bench.run_with(["model", "study", "--config", "xy", "--vary", tolerance]);
        answer.is_refused(words);
    }
    bench
        .run(&format!(
            "{XY} --vary plant.secondary_mass_deviation.sL=+-0.1"
        ))
        .is_refused(&["varies already"]);
    bench
        .run("model study --config four-mass --vary plant.free_bodies=+-1")
        .is_refused(&["not a quantity"]);
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn rejects_invalid_arguments() {
    let bench = Bench::new();
    for (arguments, words) in [
        (format!("{XY} --draws 0"), &["0 draws", "from 1 to"][..]),
        (format!("{XY} --draws 1000000000"), &["from 1 to 100000000"]),
        (format!("{XY} --draws -1"), &["'-1'"]),
        (
            format!("{XY} --shard 3/2 --file a"),
            &["invalid shard `3/2`", "1 <= I <= N"],
        ),
        (
            format!("{XY} --shard 0/2 --file a"),
            &["invalid shard `0/2`"],
        ),
        (
            format!("{XY} --shard one --file a"),
            &["invalid shard `one`"],
        ),
        (format!("{XY} --shard 1/2"), &["--file"]),
        (format!("{XY} --threads 0"), &["--threads"]),
        (format!("{XY} --join a"), &["--join"]),
        ("model study --join".into(), &["--join"]),
        ("model study --config xy".into(), &["--vary"]),
    ] {
        bench.run(&arguments).is_refused(words);
        assert_eq!(bench.files(), [""; 0], "{arguments}");
    }
}

const APART: &str = "[plant]\nmodel = \"lumped\"\n[plant.nodes]\na = { mass_kg = 1.0, actuator = 1.0 }\nb = { mass_kg = 1.0, sensor = 1.0 }\n[plant.springs]\nka = { between = [\"a\", \"ground\"], stiffness_n_per_m = 1.0 }\nkb = { between = [\"b\", \"ground\"], stiffness_n_per_m = 2.0 }\n[plant.damping]\nkind = \"uniform\"\nratio = 0.01\n";

#[test]
fn rejects_a_plant_without_response() {
    let bench = Bench::new();
    bench.write("apart.toml", APART);
    bench
        .run("model study --config apart.toml --vary plant.nodes.*.mass_kg=+-10%")
        .is_refused(&[
            "nominal plant cannot be analysed",
            "residues of all modes are zero",
            "connect the two by springs",
        ]);
    bench.write(
        "silent.toml",
        "[plant]\nmodel = \"modal\"\n[plant.modes]\nu = { omega_rad_s = 1.0, residue_per_kg = 0.0 }\n",
    );
    bench
        .run("model study --config silent.toml --vary plant.modes.u.omega_rad_s=+-10%")
        .is_refused(&["`plant.modes`", "no force reaches the probe"]);
}

#[test]
fn failed_draws_are_reported_separately() {
    let bench = Bench::new();
    // Beam length of 10 to 30 mm, operating point of 0 to 19.9 mm: each limit is valid with the nominal value of the other setting,
    // but an operating point beyond the length of the beams is not.
    let stage = "--config chapter2 --set plant.beam_length_m=0.02 --set plant.operating_point_m=0.01 --set plant.beam_thickness_m=2e-4";
    let vary =
        "--vary plant.beam_length_m=+-10mm --vary plant.operating_point_m=uniform:-10mm:9.9mm";
    let answer = bench.json(&format!(
        "model study {stage} {vary} --draws 4000 --csv draws.csv"
    ));
    // Length u uniform on 10..30 mm, operating point v on 0..19.9 mm: P(u < v) = (9.9 x 9.9/2)/(20 x 19.9).
    let expected = 9.9 * 9.9 / 2.0 / (20.0 * 19.9);
    let failed = number(&answer["not_analysed"]["draws"]);
    assert!(
        (failed / 4000.0 - expected).abs() < 5.0 * f64::sqrt(expected * (1.0 - expected) / 4000.0),
        "{failed}"
    );
    let examples = list(&answer["not_analysed"], "examples");
    assert!(
        examples.len() == 5
            && examples[0]["why"]
                .as_str()
                .is_some_and(|why| why.contains("beyond the length")),
        "{answer}"
    );
    let counted: f64 = list(&answer["cnmp_pairs"], "probabilities")
        .iter()
        .map(|one| number(&one["draws"]))
        .sum();
    assert_eq!(counted + failed, 4000.0);
    let table = bench.read("draws.csv");
    let missing: Vec<&str> = table.lines().filter(|line| line.ends_with(',')).collect();
    assert_eq!(missing.len() as f64, failed);
    let first = format!("{},", examples[0]["draw"]);
    assert!(missing[0].starts_with(&first), "{} {first}", missing[0]);
    let text = bench.run(&format!("model study {stage} {vary} --draws 400"));
    assert!(
        text.out
            .contains("draws could not be analysed; no probability includes them"),
        "{}",
        text.out
    );
    // Without failed draws the object is present and empty.
    assert_eq!(
        bench.json(&format!("{XY} --draws 1"))["not_analysed"],
        json!({"draws": 0, "examples": []})
    );
}
