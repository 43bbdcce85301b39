//! Files that scipy, numpy and JSON writers make, imported without a change of a bit.

use bench_test_support::python;
use serde_json::{Value, json};

use crate::controllers::program::Bench;

/// Numbers with all 53 bits.
fn controller() -> Value {
    json!({
        "num": [0.123_456_789_012_345_67, -1.0 / 7.0, 3.0],
        "den": [1.0, -1.7, 0.72],
        "z": [[-0.4, 0.1], [-0.4, -0.1]],
        "p": [[0.9, 0.0], [0.8, 0.0]],
        "k": 1.0 / 3.0,
        "A": [[0.5, 0.1], [-0.1, 0.3]],
        "B": [[1.0], [1.0 / 9.0]],
        "C": [[0.25, -2.0]],
        "D": [[0.7]],
        "Ts": 0.0002,
    })
}

fn import(bench: &Bench, file: &str, options: &str) -> toml::Table {
    let out = format!("{file}.toml");
    let report = bench.json(&format!(
        "controller import {file} --gain-unit A/um --out {out} {options}"
    ));
    assert_eq!(report["file"], out.as_str());
    let difference = report["max_difference"].as_f64().expect("a number");
    assert!((0.0..1e-9).contains(&difference), "{report}");
    // The file can be used.
    assert!(bench.run(&format!("margins --controller {out}")).code <= 1);
    bench.read(&out).parse().expect("TOML")
}

fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(flat).collect(),
        other => vec![other.as_f64().expect("a number")],
    }
}

fn numbers(value: &toml::Value) -> Vec<f64> {
    match value {
        toml::Value::Array(items) => items.iter().flat_map(numbers).collect(),
        toml::Value::Integer(n) => vec![*n as f64],
        other => vec![other.as_float().expect("a number")],
    }
}

fn assert_imported(table: &toml::Table, form: &str) {
    let given = controller();
    let names: &[(&str, &str)] = match form {
        "tf" => &[("numerator", "num"), ("denominator", "den")],
        "zpk" => &[("zeros", "z"), ("poles", "p"), ("gain", "k")],
        _ => &[("a", "A"), ("b", "B"), ("c", "C"), ("d", "D")],
    };
    for (key, name) in names {
        assert_eq!(
            numbers(&table[form][key]),
            flat(&given[name]),
            "{form} {key}"
        );
    }
    assert_eq!(numbers(&table[form]["rate_hz"]), [5000.0]);
    assert_eq!(table[form]["gain_unit"].as_str(), Some("A/um"));
}

#[test]
fn files_of_scipy_and_numpy_are_imported_bit_for_bit() {
    let bench = Bench::new();
    let folder = bench.path("").display().to_string();
    let modules = "control, mpmath, scipy.signal";
    let input = controller().to_string();
    if python::numbers_with(modules, "controllers.py", &["files", &folder], &input).is_none() {
        return;
    }
    for form in ["tf", "zpk", "ss"] {
        for file in [
            "-0.mat",
            "-1.mat",
            "-struct.mat",
            "-columns.mat",
            ".npz",
            "-compressed.npz",
        ] {
            let table = import(&bench, &format!("{form}{file}"), "");
            assert_imported(&table, form);
        }
    }
    assert_imported(&import(&bench, "tf-cells.mat", ""), "tf");
    assert_imported(&import(&bench, "ss-control.mat", ""), "ss");
}

#[test]
fn json_is_imported_bit_for_bit() {
    let bench = Bench::new();
    let all = controller();
    for (form, names) in [
        ("tf", &["num", "den"][..]),
        ("zpk", &["z", "p", "k"]),
        ("ss", &["A", "B", "C", "D"]),
    ] {
        let parts = names
            .iter()
            .map(|name| (name.to_string(), all[name].clone()));
        let mut parts: serde_json::Map<String, Value> = parts.collect();
        let without_period = Value::Object(parts.clone()).to_string();
        parts.insert("Ts".into(), all["Ts"].clone());
        bench.write(&format!("{form}.json"), Value::Object(parts).to_string());
        assert_imported(&import(&bench, &format!("{form}.json"), ""), form);
        let nested = format!("{{\"C\": {without_period}, \"D2\": {{\"num\": [1], \"den\": [1]}}}}");
        bench.write(&format!("{form}-2.json"), nested);
        let table = import(
            &bench,
            &format!("{form}-2.json"),
            "--variable C --rate 5kHz",
        );
        assert_imported(&table, form);
    }
}

#[test]
fn a_period_of_zero_is_continuous() {
    let bench = Bench::new();
    bench.write("c.json", r#"{"num": [1], "den": [1, 2], "Ts": 0}"#);
    let table = import(&bench, "c.json", "");
    assert_eq!(table["tf"].get("rate_hz"), None);
    assert_eq!(table["title"].as_str(), Some("c"));
}

#[test]
fn rejects_files_without_a_usable_controller() {
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "{}",
            "",
            &["no controller", "no variable", "num, den and Ts"],
        ),
        (r#"{"num": [1], "x": 3}"#, "", &["num (1)", "x (scalar)"]),
        (
            r#"{"num": [1], "den": [1, 2]}"#,
            "",
            &["Ts", "--continuous", "--rate HZ"],
        ),
        (
            r#"{"num": [1], "den": [1, 2], "dt": null}"#,
            "",
            &["--continuous"],
        ),
        (
            r#"{"num": [1], "den": [1, 2], "Ts": -1}"#,
            "",
            &["--continuous"],
        ),
        (
            r#"{"num": [1], "den": [1, 2], "Ts": 0}"#,
            "--rate 5kHz",
            &["continuous by its sampling period", "leave out"],
        ),
        (
            r#"{"num": [[1, 2], [3, 4]], "den": [1, 2], "Ts": 0}"#,
            "",
            &["`num` has the size 2x2", "one input"],
        ),
        (r#"{"num": [1, 2], "den": [1], "Ts": 0}"#, "", &["improper"]),
        (
            r#"{"num": [1], "den": [1, -2], "Ts": 0}"#,
            "",
            &["unstable", "s = 2"],
        ),
        (
            r#"{"num": [1], "den": [1, -0.5], "Ts": 1e-9}"#,
            "",
            &["rate_hz", "100000"],
        ),
        (
            r#"{"num": "1", "den": [1, 2], "Ts": 0}"#,
            "",
            &["num (text)"],
        ),
        (
            r#"{"z": [[1, 2, 3]], "p": [], "k": 1, "Ts": 0}"#,
            "",
            &["z (an array whose entries"],
        ),
        (
            r#"{"A": [[1, 2]], "B": [1], "C": [1], "Ts": 0}"#,
            "",
            &["`A` has the size 1x2 (rows x columns)"],
        ),
        (
            r#"{"num": [1], "den": [1, 2], "Ts": 0, "P": {"z": [], "p": [], "k": 1}}"#,
            "",
            &[
                "several controllers",
                "tf at the top level",
                "zpk in P",
                "--variable",
            ],
        ),
        (
            r#"{"num": [1], "den": [1, 2], "Ts": 0}"#,
            "--variable Q",
            &["--variable", "name Q"],
        ),
        ("[1, 2]", "", &["not a MAT-file of level 5"]),
        ("{\"num\": ", "", &["not a JSON object"]),
        (
            "MATLAB 7.3 MAT-file, Platform: GLNXA64",
            "",
            &["7.3", "'-v7'"],
        ),
    ];
    for (content, options, words) in cases {
        let bench = Bench::new();
        bench.write("c.dat", content);
        let answer = bench.run(&format!(
            "controller import c.dat --gain-unit A/m --json {options}"
        ));
        answer.is_refused(&[words, &["c.dat", "; "][..]].concat());
        assert_eq!(bench.files(), ["c.dat"], "{content}");
    }
}

#[test]
fn rejects_a_missing_unit_and_keeps_existing_files() {
    let bench = Bench::new();
    bench.write("c.json", r#"{"num": [1], "den": [1, 2], "Ts": 0}"#);
    bench
        .run("controller import c.json --json")
        .is_refused(&["--gain-unit"]);
    bench
        .run("controller import absent.mat --gain-unit A/m --json")
        .is_refused(&["absent.mat", "cannot read"]);
    bench.write("controller.toml", "mine");
    let answer = bench.run("controller import c.json --gain-unit A/um");
    assert_eq!(answer.code, 1, "{answer:?}");
    assert!(answer.err.contains("--out"), "{answer:?}");
    assert_eq!(bench.read("controller.toml"), "mine");
}
