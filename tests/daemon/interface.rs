//! Every request: malformed, oversized, unauthorised, and in order.
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};

use crate::daemon::common::Daemon;

/// Methods and paths of the description, with a value for each part of a path.
fn requests(daemon: &Daemon) -> Vec<(String, String)> {
    let description = daemon.get("/api/v1/openapi.json");
    let paths = description["paths"].as_object().expect("paths");
    let mut requests = Vec::new();
    for (path, operations) in paths {
        let path = path.replace("{id}", "1").replace("{file}", "none.mcap");
        for method in operations.as_object().expect("operations").keys() {
            requests.push((method.to_uppercase(), path.clone()));
        }
    }
    requests
}

/// Answers that do not end.
fn is_stream(path: &str) -> bool {
    ["/api/v1/live", "/api/v1/events"].contains(&path)
}

#[test]
fn description_is_openapi_3_1_and_names_every_request() {
    let daemon = Daemon::start();
    let description = daemon.get("/api/v1/openapi.json");
    assert_eq!(description["openapi"], "3.1.0");
    let requests = requests(&daemon);
    assert!(requests.len() >= 24, "{requests:?}");
    for (method, path) in [
        ("POST", "/api/v1/stop"),
        ("GET", "/api/v1/state"),
        ("PUT", "/api/v1/lease"),
    ] {
        assert!(
            requests.contains(&(method.into(), path.into())),
            "{method} {path}"
        );
    }
    let state = &description["components"]["schemas"]["StateView"]["properties"];
    let shown = daemon.state();
    let names: Vec<&String> = shown.as_object().expect("an object").keys().collect();
    let described: Vec<&String> = state.as_object().expect("properties").keys().collect();
    assert_eq!(names, described, "the state is as described");
}

#[test]
fn changes_without_token_or_with_a_wrong_one_are_refused() {
    let daemon = Daemon::start();
    for (method, path) in requests(&daemon) {
        if method == "GET" || path == "/api/v1/stop" {
            continue;
        }
        for headers in [
            &[][..],
            &[("Authorization", "Bearer 0123")],
            &[("Authorization", "Basic x")],
        ] {
            let answer = daemon.raw(&method, &path, headers, b"{}");
            assert_eq!(answer.status, 401, "{method} {path}");
            assert!(answer.json()["error"]["remedy"].is_string());
        }
    }
    assert_eq!(daemon.state()["loop"]["state"], "disarmed");
}

#[test]
fn session_of_a_local_command_cannot_be_opened_over_tcp() {
    let daemon = Daemon::start();
    let upgrade = [
        ("Connection", "Upgrade"),
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "AAAAAAAAAAAAAAAAAAAAAA=="),
    ];
    let answer = daemon.raw("GET", "/api/v1/session", &upgrade, b"");
    assert_eq!(answer.status, 404);
}

#[test]
fn oversized_and_unknown_requests_are_refused() {
    let daemon = Daemon::start();
    let large = vec![b' '; 2 << 20];
    let token = format!("Bearer {}", daemon.token());
    let answer = daemon.raw("POST", "/api/v1/plan", &[("Authorization", &token)], &large);
    assert_eq!(answer.status, 413);
    assert_eq!(daemon.ask("GET", "/api/v1/nothing", "", None).status, 404);
    assert_eq!(daemon.ask("PATCH", "/api/v1/state", "", None).status, 405);
    for path in [
        "/api/v1/recordings/..%2F..%2Fetc%2Fpasswd",
        "/page/..%2Fmod.rs",
        "/api/v1/recordings/bench.token",
    ] {
        assert_eq!(daemon.ask("GET", path, "", None).status, 404, "{path}");
    }
    let outside = json!({ "command": "chirp", "config": "/etc/passwd" });
    let lease = daemon.take_lease("anna");
    for path in ["/api/v1/plan", "/api/v1/runs"] {
        let answer = daemon.ask("POST", path, &lease, Some(outside.clone()));
        assert_eq!(answer.status, 422, "{path}");
    }
}

#[test]
fn rejects_array_in_place_of_an_object() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    for (path, body) in [
        ("/api/v1/runs", json!(["control", []])),
        ("/api/v1/tune", json!([0.5])),
        ("/api/v1/plan", json!(["chirp"])),
        ("/api/v1/config/check", json!([])),
        ("/api/v1/lease", json!(["bert"])),
    ] {
        let answer = daemon.ask("POST", path, &lease, Some(body));
        assert_eq!(answer.status, 422, "{path}");
    }
    assert_eq!(daemon.get("/api/v1/runs")["finished"], json!([]));
    assert!(daemon.state()["run"].is_null());
}

#[test]
fn refused_order_names_the_field_that_is_wrong() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let token = format!("Bearer {}", daemon.token());
    let headers = [
        ("Authorization", token.as_str()),
        ("Bench-Lease", lease.as_str()),
    ];
    for (body, status, place) in [
        ("{\"command\":\"chirp\",", 400, &["line 1 column 19"][..]),
        (
            "{\"command\":\"chirp\",\"durration\":\"2s\"}",
            422,
            &["durration"],
        ),
        (
            "{\"command\":\"campaign\",\"threads\":1025}",
            422,
            &["threads"],
        ),
        (
            "{\"command\":\"control\",\"slow\":true,\"fast\":true}",
            422,
            &["slow", "fast"],
        ),
        (
            "{\"command\":\"control\",\"args\":[\"--slow\"]}",
            422,
            &["args"],
        ),
    ] {
        for path in ["/api/v1/plan", "/api/v1/runs"] {
            let answer = daemon.raw("POST", path, &headers, body.as_bytes());
            let error = &answer.json()["error"];
            assert_eq!(answer.status, status, "{path} {body}: {error}");
            let named = error["where"].as_str().expect("a place");
            assert!(place.contains(&named), "{path} {body}: {error}");
            assert!(error["remedy"].is_string(), "{path} {body}: {error}");
        }
    }
    assert_eq!(daemon.get("/api/v1/runs")["finished"], json!([]));
}

/// Bodies of requests are refused as described, and every field of an error is described.
#[test]
fn description_has_the_refusals_of_each_body_and_the_fields_of_an_error() {
    let daemon = Daemon::start();
    let description = daemon.get("/api/v1/openapi.json");
    for path in ["/api/v1/runs", "/api/v1/plan", "/api/v1/tune"] {
        let responses = &description["paths"][path]["post"]["responses"];
        for status in ["400", "408", "413", "415", "422", "4XX", "503"] {
            let schema = &responses[status]["content"]["application/json"]["schema"];
            assert_eq!(
                schema["$ref"], "#/components/schemas/ErrorBody",
                "{path} {status}: {responses}"
            );
        }
    }
    let fields = &description["components"]["schemas"]["ErrorFields"]["properties"];
    let fields = fields.as_object().expect("fields");
    let names: Vec<&String> = fields.keys().collect();
    assert_eq!(names, ["message", "kind", "where", "remedy", "defects"]);
    for (name, field) in fields {
        assert!(field["description"].is_string(), "{name}: {field}");
    }
}

/// Any JSON, with the names of the interface.
fn any_json() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        "[ -~]{0,20}".prop_map(Value::from),
        Just(json!("chirp")),
        Just(json!(["--duration", "nan"])),
    ];
    leaf.prop_recursive(3, 20, 6, |inner| {
        let names = prop_oneof![
            Just("command"),
            Just("args"),
            Just("duration"),
            Just("set"),
            Just("how"),
            Just("operator"),
            Just("reference"),
            Just("gain"),
            Just("ramp_s"),
            Just("name"),
            Just("note"),
            Just("sets"),
            Just("profile"),
            Just("on_disconnect"),
        ];
        let names = names.prop_map(String::from);
        prop_oneof![
            proptest::collection::vec(inner.clone(), 0..5).prop_map(Value::from),
            proptest::collection::hash_map(names, inner, 0..5)
                .prop_map(|map| Value::Object(map.into_iter().collect())),
        ]
    })
}

#[test]
fn random_bodies_fail_without_a_fault_and_move_nothing() {
    let daemon = Daemon::start();
    let targets: Vec<(String, String)> = requests(&daemon)
        .into_iter()
        .filter(|(_, path)| !is_stream(path) && !path.ends_with("/doctor"))
        .collect();
    let cases = std::env::var("BENCH_RANDOM_CASES")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(300);
    let mut runner = TestRunner::new(ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let strategy = (0..targets.len(), any_json(), "[ -~]{0,20}", any::<bool>());
    let outcome = runner.run(&strategy, |(target, body, raw, is_json)| {
        let (method, path) = &targets[target];
        let body = if is_json {
            Some(body)
        } else {
            Some(Value::from(raw))
        };
        let answer = daemon.ask(method, path, "no lease", body);
        prop_assert!(answer.status < 500, "{method} {path}: {answer:?}");
        Ok(())
    });
    outcome.expect("no fault");
    let state = daemon.state();
    assert_eq!(state["loop"]["state"], "disarmed");
    assert!(state["run"].is_null());
    assert_eq!(
        daemon.get("/api/v1/runs")["finished"],
        json!([]),
        "nothing was started"
    );
}

#[test]
fn page_loads_only_its_own_files() {
    let daemon = Daemon::start();
    let index = daemon.ask("GET", "/", "", None);
    let text = String::from_utf8(index.body).expect("text");
    assert_eq!(index.status, 200);
    assert!(!text.contains("://"), "no other host");
    for name in ["main.js", "page.css", "scope.js"] {
        let file = daemon.ask("GET", &format!("/page/{name}"), "", None);
        assert_eq!(file.status, 200);
        assert!(
            !String::from_utf8_lossy(&file.body).contains("http://"),
            "{name}"
        );
    }
}

#[test]
fn recordings_are_listed_noted_downloaded_in_ranges_and_removed() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let id = daemon.start_run(&lease, "control", &["--slow", "--duration", "1s"]);
    let run = daemon.wait_for_end(id, &lease);
    assert_eq!(run["outcome"], "completed", "{run}");
    let file = run["recording"].as_str().expect("a recording").to_string();
    let path = format!("/api/v1/recordings/{file}");
    let whole = daemon.ask("GET", &path, "", None).body;
    assert_eq!(
        whole,
        std::fs::read(daemon.recordings().join(&file)).unwrap()
    );
    let part = daemon.raw("GET", &path, &[("Range", "bytes=100-199")], b"");
    assert_eq!((part.status, part.body.as_slice()), (206, &whole[100..200]));
    let note = json!({ "name": "first", "note": "new flexure" });
    assert_eq!(
        daemon
            .ask("PUT", &format!("{path}/note"), "", Some(note))
            .status,
        204
    );
    let listed = &daemon.get("/api/v1/recordings")["recordings"][0];
    assert_eq!(
        (&listed["name"], &listed["operator"], &listed["outcome"]),
        (&json!("first"), &json!("anna"), &json!("completed"))
    );
    let results = daemon.get(&format!("{path}/results"));
    assert_eq!(results["outcome"], "completed");
    assert_eq!(daemon.ask("DELETE", &path, "", None).status, 204);
    assert_eq!(daemon.ask("GET", &path, "", None).status, 404);
    assert_eq!(daemon.get("/api/v1/recordings")["recordings"], json!([]));
}

#[test]
fn findings_plans_and_figures_are_those_of_the_commands() {
    let daemon = Daemon::start();
    let plan = daemon.ask(
        "POST",
        "/api/v1/plan",
        "",
        Some(json!({ "command": "chirp" })),
    );
    assert_eq!(plan.status, 200, "{plan:?}");
    let travel_m = plan.json()["expected"]["travel_m"]
        .as_f64()
        .expect("a length");
    assert!((1e-5..9e-4).contains(&travel_m), "{travel_m}");
    let model = daemon.get("/api/v1/model");
    assert!(!model["modes"].as_array().expect("modes").is_empty());
    let config = daemon.get("/api/v1/config");
    assert!(
        config["toml"]
            .as_str()
            .expect("a text")
            .contains("rate_hz = 1000.0")
    );
    let check = |sets: Value| {
        daemon
            .ask(
                "POST",
                "/api/v1/config/check",
                "",
                Some(json!({ "sets": sets })),
            )
            .status
    };
    assert_eq!(check(json!(["loop.rate_hz=2000"])), 200);
    assert_eq!(check(json!(["loop.rate_hz=-1"])), 422);
    let schema = daemon.get("/api/v1/config/schema");
    assert!(schema["properties"]["loop"].is_object() || schema["$defs"].is_object());
}

/// Samples of the text format of Prometheus as (name with labels, value), read by its description.
fn samples(text: &str) -> Vec<(String, f64)> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let pairs = lines.map(|line| line.rsplit_once(' ').expect("name and value"));
    pairs
        .map(|(name, value)| (name.to_string(), value.parse().expect("a number")))
        .collect()
}

#[test]
fn metrics_count_ticks_and_runs_and_each_has_help_and_type() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let id = daemon.start_run(&lease, "control", &["--slow", "--duration", "1s"]);
    daemon.wait_for_end(id, &lease);
    let are_shown = |state: &Value| state["loop"]["ticks"].as_u64() > Some(1500);
    daemon.wait("the ticks of the run are counted", "", are_shown);
    let read = || {
        let answer = daemon.ask("GET", "/metrics", "", None);
        assert_eq!(answer.status, 200);
        String::from_utf8(answer.body).expect("text")
    };
    let text = read();
    let found = samples(&text);
    let value = |name: &str| {
        found
            .iter()
            .find(|(other, _)| other == name)
            .map(|(_, value)| *value)
    };
    assert_eq!(
        value("bench_runs_total{command=\"control\",outcome=\"completed\"}"),
        Some(1.0)
    );
    assert_eq!(value("bench_loop_state{state=\"disarmed\"}"), Some(1.0));
    assert_eq!(value("bench_lost_records_total"), Some(0.0));
    let ticks = value("bench_ticks_total").expect("ticks");
    assert!(ticks > 1000.0);
    assert_eq!(value("bench_tick_lateness_seconds_count"), Some(ticks));
    let buckets: Vec<f64> = found
        .iter()
        .filter(|(name, _)| name.contains("_bucket"))
        .map(|(_, value)| *value)
        .collect();
    assert!(
        buckets.windows(2).all(|pair| pair[0] <= pair[1]),
        "buckets are cumulative: {buckets:?}"
    );
    for (name, _) in &found {
        let family = name.split('{').next().expect("a name");
        let family = ["_bucket", "_sum", "_count"]
            .iter()
            .find_map(|end| family.strip_suffix(end))
            .unwrap_or(family);
        for kind in ["HELP", "TYPE"] {
            assert!(
                text.contains(&format!("# {kind} {family} ")),
                "{kind} of {name}"
            );
        }
    }
    let later = samples(&read());
    let again = later
        .iter()
        .find(|(name, _)| name == "bench_ticks_total")
        .map(|(_, value)| *value);
    assert!(again >= Some(ticks), "a counter does not fall");
}
