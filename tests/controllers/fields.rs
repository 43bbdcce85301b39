//! Fields beside the parts of a controller are used, have no effect, or are refused by their name.

use bench_test_support::python;
use nalgebra::Complex;
use serde_json::{Map, Value, json};

use crate::controllers::program::Bench;
use crate::controllers::response::{assert_response, imported};

const FREQUENCIES_RAD_S: [f64; 4] = [1.0, 30.0, 400.0, 3000.0];

/// The same controller 2 (s + 30)/(s + 400) in three forms; s in rad/s.
fn continuous() -> [Value; 3] {
    [
        json!({"num": [2, 60], "den": [1, 400], "Ts": 0}),
        json!({"z": [-30], "p": [-400], "k": 2, "Ts": 0}),
        // 2 + (60 - 800)/(s + 400)
        json!({"A": [[-400]], "B": [[1]], "C": [[-740]], "D": [[2]], "Ts": 0}),
    ]
}

/// 0.5 (z - 0.3)/(z - 0.9) in three forms.
fn discrete() -> [Value; 3] {
    [
        json!({"num": [0.5, -0.15], "den": [1, -0.9], "Ts": 0.0002}),
        json!({"z": [0.3], "p": [0.9], "k": 0.5, "Ts": 0.0002}),
        json!({"A": [[0.9]], "B": [[1]], "C": [[0.3]], "D": [[0.5]], "Ts": 0.0002}),
    ]
}

fn discrete_response(z: Complex<f64>) -> Complex<f64> {
    (z - 0.3) / (z - 0.9) * 0.5
}

fn with(controller: &Value, name: &str, value: &Value) -> Value {
    let mut fields = controller.as_object().expect("an object").clone();
    fields.insert(name.into(), value.clone());
    Value::Object(fields)
}

/// Fields that change the response and cannot be used, with words of the message; for a continuous or a discrete controller.
fn refused_fields(is_discrete: bool) -> Vec<(&'static str, Value, &'static str)> {
    let mut fields = vec![
        ("InternalDelay", json!(0.001), "InternalDelay"),
        ("TimeUnit", json!("fortnights"), "fortnights"),
        ("TimeUnit", json!(3), "TimeUnit"),
        ("Variable", json!("w"), "Variable"),
        ("InputUnit", json!("mm"), "--gain-unit"),
        ("OutputUnit", json!("V"), "--gain-unit"),
        ("SamplingGrid", json!({"mass": [1, 2]}), "SamplingGrid"),
        ("Offsets", json!({"u": 0.1}), "Offsets"),
        ("Saturation", json!(1.5), "Saturation"),
        ("Nonlinearity", json!("deadzone"), "Nonlinearity"),
        ("Next", json!({"gain_2": 3}), "Next"),
    ];
    let delays = [
        "InputDelay",
        "OutputDelay",
        "IODelay",
        "ioDelay",
        "input_delay",
    ];
    for name in delays {
        fields.push((name, json!([1e-3, 2e-3]), name));
        if is_discrete {
            fields.extend([(name, json!(1.5), "whole"), (name, json!(-2), "whole")])
        } else {
            fields.push((name, json!(0.03), "pade"))
        }
    }
    let variables: &[&'static str] = if is_discrete {
        &["s", "p"]
    } else {
        &["z", "q", "z^-1", "q^-1"]
    };
    fields.extend(
        variables
            .iter()
            .map(|name| ("Variable", json!(name), "Variable")),
    );
    fields
}

#[test]
fn rejects_every_field_that_changes_the_response_and_cannot_be_used() {
    let bench = Bench::new();
    for (is_discrete, controllers) in [(false, continuous()), (true, discrete())] {
        for controller in &controllers {
            for (name, value, word) in refused_fields(is_discrete) {
                let file = with(controller, name, &value);
                // At the top level, and in a structure.
                for file in [file.clone(), json!({"S": file})] {
                    bench.write("c.json", file.to_string());
                    let answer = bench.run("controller import c.json --gain-unit A/um --json");
                    answer.is_refused(&["c.json", name, word, "; "]);
                }
            }
        }
    }
    assert_eq!(bench.files(), ["c.json"]);
}

#[test]
fn rejects_a_delay_beside_the_structure_of_the_controller() {
    let bench = Bench::new();
    let file = json!({"C": {"num": [1], "den": [1, 2]}, "Ts": 0, "InputDelay": 0.03});
    bench.write("c.json", file.to_string());
    let answer = bench.run("controller import c.json --gain-unit A/um --json");
    answer.is_refused(&["InputDelay", "0.03"]);
}

#[test]
fn fields_without_effect_do_not_change_a_bit() {
    let bench = Bench::new();
    let neutral = json!({
        "InputDelay": 0, "OutputDelay": [0], "IODelay": [[0]], "InternalDelay": [], "TimeUnit": "seconds",
        "InputName": ["e"], "OutputName": "u", "InputGroup": {}, "OutputGroup": {"all": [1]}, "Name": "C1", "Notes": ["by hand"],
        "UserData": {"mass": 3}, "SamplingGrid": {}, "StateName": ["x"], "StateUnit": "m", "InputUnit": "um", "OutputUnit": "A",
        "Scaled": true, "DisplayFormat": "roots", "Offsets": {"u": 0, "y": []}, "Other": [], "Nothing": null,
    });
    for (variables, controllers) in [(["s", "p"], continuous()), (["z", "q"], discrete())] {
        for controller in &controllers {
            let plain = imported(&bench, controller, "");
            for variable in variables {
                let mut fields = controller.as_object().expect("an object").clone();
                fields.extend(neutral.as_object().expect("an object").clone());
                fields.insert("Variable".into(), json!(variable));
                for file in [Value::Object(fields.clone()), json!({"S": fields})] {
                    assert_eq!(imported(&bench, &file, ""), plain);
                }
            }
        }
    }
}

#[test]
fn time_unit_of_a_continuous_controller_is_converted_to_seconds() {
    let bench = Bench::new();
    for (unit, unit_s) in [
        ("nanoseconds", 1e-9),
        ("microseconds", 1e-6),
        ("milliseconds", 1e-3),
        ("minutes", 60.0),
        ("hours", 3600.0),
        ("days", 86_400.0),
    ] {
        for controller in &continuous() {
            let report = imported(&bench, &with(controller, "TimeUnit", &json!(unit)), "");
            // v = s unit: the frequency of v = j 400 is 400/unit rad/s.
            for v in [3.0, 30.0, 400.0, 5000.0] {
                assert_response(&report, v / unit_s, |s| {
                    (s * unit_s + 30.0) / (s * unit_s + 400.0) * 2.0
                });
            }
            assert!(
                report["remarks"][0]
                    .as_str()
                    .expect("a remark")
                    .contains("unit of time")
            );
        }
    }
    // The sampling period is in the same unit: 0.2 ms is 5 kHz.
    let mut controller = with(&discrete()[0], "TimeUnit", &json!("milliseconds"));
    controller["Ts"] = json!(0.2);
    let report = imported(&bench, &controller, "");
    assert_eq!(report["rate_hz"], 5000.0);
}

#[test]
fn whole_samples_of_delay_are_poles_at_the_origin() {
    let bench = Bench::new();
    for controller in &discrete() {
        for (fields, samples) in [
            (json!({"InputDelay": 1}), 1),
            (json!({"OutputDelay": 3, "InputDelay": 2}), 5),
            (json!({"ioDelay": [[20]]}), 20),
        ] {
            let mut file = controller.as_object().expect("an object").clone();
            file.extend(fields.as_object().expect("an object").clone());
            let report = imported(&bench, &Value::Object(file), "");
            for w in FREQUENCIES_RAD_S {
                assert_response(&report, w, |z| discrete_response(z) * z.powi(-samples));
            }
            assert_eq!(report["order"], 1 + samples);
        }
        let long = with(controller, "InputDelay", &json!(32));
        bench.write("c.json", long.to_string());
        let answer = bench.run("controller import c.json --gain-unit A/um --json");
        answer.is_refused(&["InputDelay", "32 samples", "order is 33", "limit of 32"]);
    }
}

#[test]
fn polynomials_of_the_delay_operator_have_rising_powers() {
    let bench = Bench::new();
    for variable in ["z^-1", "q^-1"] {
        // 1e4/(1 - 0.5 z^-1) = 1e4 z/(z - 0.5); as powers of z it would be 1e4/(z - 0.5).
        let first = json!({"num": [1e4], "den": [1, -0.5], "Ts": 0.0002, "Variable": variable});
        let report = imported(&bench, &first, "");
        assert_response(&report, 100.0, |z| z / (z - 0.5) * 1e4);
        // (0 + 2 z^-1 + z^-2)/(1 - 0.5 z^-1) = (2 z + 1)/(z (z - 0.5))
        let second =
            json!({"num": [0, 2, 1], "den": [1, -0.5], "Ts": 0.0002, "Variable": variable});
        let report = imported(&bench, &second, "");
        assert_response(&report, 100.0, |z| (z * 2.0 + 1.0) / (z * (z - 0.5)));
    }
}

#[test]
fn descriptor_matrix_is_solved_or_refused() {
    let bench = Bench::new();
    // 2 x1' = -10 x1 + e, x2' = -20 x2 + e: 2.5/(s + 5) + 7/(s + 20).
    let file = json!({"A": [[-10, 0], [0, -20]], "B": [1, 1], "C": [5, 7], "D": 0, "E": [[2, 0], [0, 1]], "Ts": 0});
    let report = imported(&bench, &file, "");
    for w in FREQUENCIES_RAD_S {
        assert_response(&report, w, |s| {
            (s + 5.0).inv() * 2.5 + (s + 20.0).inv() * 7.0
        });
    }
    // x1' + x2' = -10 x1 + e, x2' = -20 x2 + e: x2 = e/(s + 20), x1 = (e - s x2)/(s + 10) = 20 e/((s + 10)(s + 20)).
    let coupled = with(&file, "E", &json!([[1, 1], [0, 1]]));
    let report = imported(&bench, &coupled, "");
    for w in FREQUENCIES_RAD_S {
        assert_response(&report, w, |s| {
            (s + 10.0).inv() * (s + 20.0).inv() * 100.0 + (s + 20.0).inv() * 7.0
        });
    }
    for (e, word) in [
        (json!([[1, 1], [1, 1]]), "condition"),
        (json!([[1, 0], [0, 1e-9]]), "condition"),
        (json!([[1, 0]]), "1x2"),
    ] {
        bench.write("c.json", with(&file, "E", &e).to_string());
        let answer = bench.run("controller import c.json --gain-unit A/um --json");
        answer.is_refused(&["`E`", word]);
    }
}

#[test]
fn unspecified_period_of_a_discrete_controller_needs_the_rate() {
    let bench = Bench::new();
    for period in [json!(true), json!(-1)] {
        let file = json!({"num": [1, 0.5], "den": [1, -0.5], "Ts": period});
        bench.write("c.json", file.to_string());
        for option in ["", "--continuous"] {
            let command = format!("controller import c.json --gain-unit A/m --json {option}");
            let answer = bench.run(&command);
            answer.is_refused(&["`Ts`", "discrete", "--rate HZ"]);
        }
        let report = imported(&bench, &file, "--rate 5kHz");
        assert_eq!(report["rate_hz"], 5000.0);
    }
    for (period, word) in [
        (json!(false), "false"),
        (json!("fast"), "fast"),
        (json!(-2), "-0.5 Hz"),
        (json!(2e-6), "500000"),
    ] {
        let file = json!({"num": [1, 0.5], "den": [1, -0.5], "Ts": period});
        bench.write("c.json", file.to_string());
        let answer = bench.run("controller import c.json --gain-unit A/m --json");
        answer.is_refused(&["`Ts`", word]);
    }
}

#[test]
fn forms_of_get_and_of_scipy_are_read() {
    let bench = Bench::new();
    let expected = |z: Complex<f64>| discrete_response(z);
    let forms = [
        json!({"Numerator": [[0.5, -0.15]], "Denominator": [[1, -0.9]], "Ts": 0.0002, "Variable": "z"}),
        json!({"Z": [0.3], "P": [0.9], "K": 0.5, "Ts": 0.0002}),
        json!({"b": [0.5, -0.15], "a": [1, -0.9], "fs": 5000}),
        json!({"sos": [[0.5, -0.15, 0, 1, -0.9, 0]], "fs": 5000}),
    ];
    for file in &forms {
        let report = imported(&bench, file, "");
        for w in FREQUENCIES_RAD_S {
            assert_response(&report, w, expected);
        }
        assert_eq!(report["order"], 1);
    }
    // Two rows: (z - 0.3) (z^2 + 0.5)/((z - 0.9)(z^2 - z + 0.5)) times 0.5.
    let two = json!({"sos": [[0.5, -0.15, 0, 1, -0.9, 0], [1, 0, 0.5, 1, -1, 0.5]]});
    let report = imported(&bench, &two, "--rate 5000");
    for w in FREQUENCIES_RAD_S {
        assert_response(&report, w, |z| {
            expected(z) * (z * z + 0.5) / (z * z - z + 0.5)
        });
    }
    for (file, words) in [
        (
            json!({"b": [1], "a": [1, -0.5], "fs": 5000}),
            ["`b` has 1", "lfilter"],
        ),
        (
            json!({"sos": [[1, 2, 3]], "fs": 5000}),
            ["`sos`", "six numbers"],
        ),
        (json!({"sos": [[1, 0, 0, 1, -0.5, 0]]}), ["Ts", "--rate"]),
        (
            json!({"Z": [[-1, 0]], "P": [-2], "K": 1, "Ts": 0}),
            ["Z (", "two real ones"],
        ),
    ] {
        bench.write("c.json", file.to_string());
        let answer = bench.run("controller import c.json --gain-unit A/m --json");
        answer.is_refused(&words);
    }
}

#[test]
fn errors_name_the_field_of_the_file() {
    let bench = Bench::new();
    let long: Vec<f64> = (0..40).map(f64::from).collect();
    for (file, words) in [
        (
            json!({"num": [1], "den": long, "Ts": 0}),
            ["`den` has 40", "limit is 33"],
        ),
        (
            json!({"A": [[1, 2], [3, 4], [5, 6]], "B": [1, 1], "C": [1, 1], "Ts": 0}),
            ["`A`", "3x2 (rows x columns)"],
        ),
        (
            json!({"A": [[-1]], "B": [1, 1], "C": [1], "Ts": 0}),
            ["`B`", "size 2"],
        ),
        (json!({"num": [1], "den": [], "Ts": 0}), ["`den`", "empty"]),
    ] {
        bench.write("c.json", file.to_string());
        let answer = bench.run("controller import c.json --gain-unit A/m --json");
        answer.is_refused(&[&words[..], &["c.json"]].concat());
        assert!(!answer.err.contains("line "), "{answer:?}");
    }
}

/// Fields in MAT-files (in a structure and at the top level) and in archives of numpy.
#[test]
fn fields_of_mat_files_and_archives_are_refused_or_used() {
    let bench = Bench::new();
    let folder = bench.path("").display().to_string();
    let mut cases: Vec<(Map<String, Value>, Option<&str>)> = Vec::new();
    let mut add = |controller: &Value, name: &str, value: Value, refused: Option<&'static str>| {
        let file = with(controller, name, &value);
        cases.push((file.as_object().expect("an object").clone(), refused));
    };
    for controller in continuous() {
        for name in ["InputDelay", "OutputDelay", "IODelay", "InternalDelay"] {
            add(&controller, name, json!(0.03), Some("Delay"));
        }
        add(&controller, "Variable", json!("z"), Some("Variable"));
        add(&controller, "Gadget", json!(2), Some("Gadget"));
        add(&controller, "Ts", json!(true), Some("`Ts`"));
        add(&controller, "TimeUnit", json!("milliseconds"), None);
    }
    for controller in discrete() {
        add(&controller, "InputDelay", json!(2.5), Some("InputDelay"));
        add(&controller, "Variable", json!("s"), Some("Variable"));
    }
    let input = json!(cases.iter().map(|(file, _)| file).collect::<Vec<_>>());
    let modules = "control, mpmath, scipy.signal";
    let input = input.to_string();
    if python::numbers_with(modules, "controllers.py", &["fields", &folder], &input).is_none() {
        return;
    }
    for (index, (file, refused)) in cases.iter().enumerate() {
        for kind in ["-struct.mat", "-top.mat", ".npz"] {
            let command = format!(
                "controller import {index}{kind} --gain-unit A/um --out {index}{kind}.toml --json"
            );
            let answer = bench.run(&command);
            match refused {
                Some(word) => {
                    answer.is_refused(&[word]);
                }
                None => assert_eq!(answer.code, 0, "{kind} {file:?}: {}", answer.err),
            }
            if answer.code == 0 {
                assert_response(&answer.json(), 4e5, |s| {
                    (s * 1e-3 + 30.0) / (s * 1e-3 + 400.0) * 2.0
                });
            }
        }
    }
}

/// A failed import leaves no file, so that it can be repeated.
#[test]
fn failed_write_leaves_no_file() {
    let bench = Bench::new();
    bench.write("c.json", continuous()[0].to_string());
    let script = "trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\"";
    let arguments = ["controller", "import", "c.json", "--gain-unit", "A/m"];
    let output = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_bench")])
        .args(arguments)
        .current_dir(bench.path(""))
        .output()
        .expect("a shell");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("controller.toml"));
    assert_eq!(bench.files(), ["c.json"]);
    assert_eq!(bench.run_with(arguments).code, 0);
}
