use serde_json::{Value, json};

use super::{Command, Order, OrderError};

fn order(value: Value) -> Order {
    Order::from_json(value).expect("an order")
}

fn error(value: Value) -> String {
    Order::from_json(value).expect_err("no order").to_string()
}

/// One order of each command with every kind of option.
fn orders() -> Vec<Value> {
    vec![
        json!({ "command": "chirp" }),
        json!({ "command": "chirp", "config": "stage", "set": ["loop.rate_hz=5000", "a=[1, 2]"],
            "operating_point": "-3.8mm", "asymmetry": "-10%", "seed": 9007199254740993_u64, "pace": "realtime",
            "excitation": "stepped_sine", "start": "10Hz", "stop": "200Hz", "shape": "model", "db": true, "json": true }),
        json!({ "command": "chirp", "sweep": "linear", "duration": "20s", "amplitude": "100mA",
            "simulate": true, "clear_fault": true, "motor_cold": true, "wait_for_motor": true }),
        json!({ "command": "chirp", "until_decided": true, "max_duration": "60s", "seed": 0 }),
        json!({ "command": "control", "slow": true, "reference": "s-curve", "amplitude": "50um", "speed": "1mm/s",
            "acceleration": "50mm/s^2", "jerk": "5m/s^3", "duration": "2s", "no_report": true }),
        json!({ "command": "control", "controller": "own.toml", "reference": "a b.csv", "shaper": "minimum-time",
            "max_overshoot": "5%", "prefilter": "30Hz", "feedforward": true, "certificate": "x_certificate.json",
            "override": "the load was weighed by hand" }),
        json!({ "command": "control", "fast": true, "reference": "random", "frequency": "10Hz", "period": "10s",
            "reference_seed": 3 }),
        json!({ "command": "calibrate", "amplitude": "0.1A", "write": "c.toml", "no_delay": true }),
        json!({ "command": "linearity", "scales": ["0.5", "100%"] }),
        json!({ "command": "campaign", "operating_points": "0%:8%:15", "asymmetries": "-10%:10%:3", "threads": 2,
            "single_chirp": true, "keep_recordings": true, "asymmetry_tolerance": "0.4%",
            "operating_point_tolerance": "0.1mm" }),
        json!({ "command": "identify", "recording": "-a.csv", "input": "force N", "output": "y", "time": "t",
            "input_kind": "voltage", "output_kind": "velocity", "period": "2500", "skip_periods": 1, "hold": "zoh", "input_lag": "0.16ms",
            "band": "11Hz:250Hz" }),
        json!({ "command": "identify", "recording": "a.csv", "input": "u", "output": "y", "reference": "r",
            "rate": "1000" }),
        json!({ "command": "identify", "frf": "a.frd", "frf_phase": "deg", "hold": "zoh", "rate": "5kHz",
            "input_lag": "0.16ms", "band": "11:250" }),
    ]
}

/// The fields of `sent` are in `order`; what an order adds are the default values of the command line.
fn contains(order: &Value, sent: &Value) -> bool {
    let sent = sent.as_object().expect("an object");
    sent.iter().all(|(field, value)| &order[field] == value)
}

#[test]
fn order_has_the_options_that_were_sent() {
    for sent in orders() {
        let order = serde_json::to_value(order(sent.clone())).expect("JSON");
        assert!(contains(&order, &sent), "{order} {sent}");
    }
}

#[test]
fn order_in_json_and_on_the_command_line_is_the_same() {
    for sent in orders() {
        let first = order(sent);
        let json = serde_json::to_value(&first).expect("JSON");
        assert_eq!(order(json), first);
        // No shell takes part: a space or a minus at the beginning of a value is part of it.
        assert!(first.arguments().iter().all(|word| !word.is_empty()));
    }
}

#[test]
fn options_that_exclude_each_other_are_refused_as_on_the_command_line() {
    for (sent, named) in [
        (
            json!({ "command": "control", "slow": true, "fast": true }),
            "--fast",
        ),
        (
            json!({ "command": "chirp", "amplitude": "0.1A", "shape": "model" }),
            "--shape",
        ),
        (
            json!({ "command": "chirp", "until_decided": true, "duration": "2s" }),
            "--duration",
        ),
        (
            json!({ "command": "chirp", "max_duration": "2s" }),
            "--until-decided",
        ),
        (json!({ "command": "chirp", "seed": u64::MAX }), "--seed"),
        (json!({ "command": "campaign", "threads": 0 }), "--threads"),
        (
            json!({ "command": "identify", "recording": "a.csv", "input": "u" }),
            "--output",
        ),
        (
            json!({ "command": "identify", "recording": "a.mcap", "frf": "a.csv" }),
            "--frf",
        ),
        (
            json!({ "command": "identify", "frf": "a.csv", "time": "t" }),
            "--time",
        ),
        (
            json!({ "command": "identify", "frf": "a.csv", "reference": "r" }),
            "--reference",
        ),
        (
            json!({ "command": "identify", "recording": "a.mcap", "reference": "r" }),
            "--input",
        ),
        (
            json!({ "command": "identify", "recording": "a.csv", "band": "1:2" }),
            "--frf",
        ),
        (
            json!({ "command": "chirp", "duration": "2m" }),
            "--duration",
        ),
        (json!({ "command": "chirp", "sweep": "exp" }), "--sweep"),
        (
            json!({ "command": "control", "override": "short" }),
            "--override",
        ),
    ] {
        let message = error(sent.clone());
        assert!(message.contains(named), "{sent}: {message}");
        assert!(message.contains("; "), "no remedy: {message}");
    }
}

#[test]
fn names_an_unknown_option_and_the_nearest_one() {
    let message = error(json!({ "command": "control", "durration": "2s" }));
    assert_eq!(
        message,
        "`durration` is not an option of `control`; use `duration`"
    );
    for field in [
        "out",
        "connect",
        "plan",
        "help",
        "slow=x",
        "reference-seed",
        "SLOW",
    ] {
        let mut sent = json!({ "command": "control" });
        sent[field] = json!("x");
        assert!(error(sent).contains("is not an option of"), "{field}");
    }
}

#[test]
fn states_the_type_that_an_option_needs() {
    for (field, value, needed) in [
        ("slow", json!("yes"), "true or false"),
        ("slow", json!(null), "true or false"),
        ("duration", json!(2), "a text"),
        ("duration", json!({}), "a text"),
        ("duration", json!(false), "a text"),
        ("seed", json!("4"), "a whole number"),
        ("seed", json!(-1), "a whole number"),
        ("seed", json!(1.5), "a whole number"),
        ("set", json!("a=1"), "a list of texts"),
        ("set", json!([1]), "a list of texts"),
        ("pace", json!(["virtual"]), "a text"),
    ] {
        let mut sent = json!({ "command": "control" });
        sent[field] = value;
        let message = error(sent.clone());
        assert!(message.ends_with(needed), "{sent}: {message}");
    }
}

#[test]
fn shows_the_new_form_to_a_client_with_args() {
    let sent = json!({ "command": "control", "args": ["--slow"] });
    assert_eq!(Order::from_json(sent), Err(OrderError::Args));
    assert!(error(json!({ "command": "control", "args": [] })).contains("\"slow\": true"));
}

#[test]
fn rejects_what_is_no_order() {
    assert_eq!(
        Order::from_json(json!(["control"])),
        Err(OrderError::NoObject)
    );
    for command in [json!(null), json!("reboot"), json!(1)] {
        let message = error(json!({ "command": command }));
        assert!(message.contains("give one of chirp, control"), "{message}");
    }
    assert!(error(json!({})).contains("`command` is missing"));
    assert!(error(json!({ "command": "identify" })).contains("RECORDING"));
}

#[test]
fn names_the_field_that_is_wrong() {
    for (sent, field) in [
        (json!(["control"]), None),
        (json!({}), Some("command")),
        (json!({ "command": "control", "args": [] }), Some("args")),
        (
            json!({ "command": "chirp", "durration": "2s" }),
            Some("durration"),
        ),
        (
            json!({ "command": "chirp", "duration": 2 }),
            Some("duration"),
        ),
        (
            json!({ "command": "chirp", "duration": "2m" }),
            Some("duration"),
        ),
        (
            json!({ "command": "campaign", "threads": 0 }),
            Some("threads"),
        ),
        (
            json!({ "command": "chirp", "operating_point": "x" }),
            Some("operating_point"),
        ),
        (
            json!({ "command": "chirp", "max_duration": "2s" }),
            Some("until_decided"),
        ),
        (json!({ "command": "identify" }), Some("recording")),
    ] {
        let found = Order::from_json(sent.clone())
            .expect_err("no order")
            .field();
        assert_eq!(found.as_deref(), field, "{sent}");
    }
    // Either of the two may be named.
    let sent = json!({ "command": "control", "slow": true, "fast": true });
    let found = Order::from_json(sent).expect_err("no order").field();
    assert!(
        ["slow", "fast"].map(Some).contains(&found.as_deref()),
        "{found:?}"
    );
}

#[test]
fn rejects_an_order_that_is_too_long() {
    let sets = |count: usize| json!({ "command": "chirp", "set": vec!["a=1"; count] });
    assert!(Order::from_json(sets(200)).is_ok());
    assert_eq!(Order::from_json(sets(201)), Err(OrderError::TooLong));
    for text in ["x".repeat(17 << 10), "a\0b".into()] {
        let sent = json!({ "command": "chirp", "config": text });
        assert_eq!(Order::from_json(sent), Err(OrderError::TooLong));
    }
}

#[test]
fn bench_of_the_daemon_applies_unless_the_order_names_another() {
    let sets = ["loop.rate_hz=1000".to_string()];
    let own = order(json!({ "command": "chirp", "set": ["loop.rate_hz=2000"] }));
    let own = own.on_bench(Some("stage"), &sets);
    assert_eq!(
        own.arguments(),
        [
            "--config=stage",
            "--set=loop.rate_hz=1000",
            "--set=loop.rate_hz=2000"
        ]
    );
    let other = order(json!({ "command": "chirp", "config": "other.toml" }));
    assert_eq!(
        other.on_bench(Some("stage"), &sets).arguments(),
        ["--config=other.toml"]
    );
}

#[test]
fn schema_describes_every_option_of_every_command() {
    let schema = schemars::schema_for!(Order).to_value();
    let variants = schema["oneOf"].as_array().expect("commands");
    assert_eq!(variants.len(), Command::ALL.len());
    for variant in variants {
        let (name, options) = (&variant["title"], &variant["properties"]);
        for (option, schema) in options.as_object().expect("options") {
            let is_described = schema["description"].is_string() || option == "command";
            assert!(is_described, "{name} {option}: {schema}");
        }
        assert_eq!(variant["additionalProperties"], false);
    }
}
