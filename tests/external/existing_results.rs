//! Results of an earlier analysis in the same folder.
use serde_json::Value;

use crate::external::program::Bench;
use crate::external::signals::{csv, multisine};

fn identify(bench: &Bench, band: &str) -> Value {
    bench.json(&format!(
        "identify data.csv --input force_n --output position_m --time time_s --period 1000 --band {band}"
    ))
}

fn results(answer: &Value) -> Vec<String> {
    let plots = answer["plots"].as_object().expect("plots").values();
    let others = [&answer["frf_csv"], &answer["report"]];
    let names = plots.chain(others).filter_map(Value::as_str);
    names.map(str::to_string).collect()
}

#[test]
fn identify_of_another_band_keeps_the_results_of_the_first() {
    let lines: Vec<usize> = (5..200).collect();
    let bench = Bench::new();
    bench.write("data.csv", csv(&multisine(&lines, 6, 0.0, 1e-6, 1)));
    let first = results(&identify(&bench, "10:150"));
    let before: Vec<String> = first.iter().map(|name| bench.read(name)).collect();
    let second = identify(&bench, "20:120");
    for name in ["data_frf.csv", "data_bode.svg", "data_report.html"] {
        assert!(
            first.iter().any(|result| result == name),
            "{name}: {first:?}"
        );
    }
    assert!(results(&second).iter().all(|name| !first.contains(name)));
    assert_eq!(second["frf_csv"], "data_frf-2.csv");
    for (name, content) in first.iter().zip(before) {
        assert!(bench.read(name) == content, "{name} has changed");
    }
    // A third analysis takes the next number.
    assert_eq!(identify(&bench, "20:120")["report"], "data_report-3.html");
}
