//! The margins of the same data by python-control.

use bench_experiment::closed_loop;
use bench_identify::frf_csv::{self, METRES_PER_AMPERE};
use serde_json::{Value, json};

use crate::measured::program::{Bench, near, number};
use crate::measured::sampled::{config, frf};
use crate::measured::truth;

const CASES: [&[&str]; 4] = [
    &["control.controller=fast"],
    &["control.controller=slow"],
    &["control.controller=fast", "plant.operating_point_m=0.001"],
    &["control.controller=fast", "plant.mass_asymmetry=0.05"],
];

#[test]
fn margins_equal_those_of_python_control_from_the_same_file() {
    let bench = Bench::new();
    let mut asked = Vec::new();
    for (index, sets) in CASES.iter().enumerate() {
        let model = closed_loop(&config(sets)).expect("a loop");
        let text = frf_csv::to_string(&frf(&model, (0.1, 500.0)), METRES_PER_AMPERE);
        let path = bench.write(&format!("{index}_frf.csv"), text);
        let options: String = sets.iter().map(|set| format!(" --set {set}")).collect();
        asked.push((path.display().to_string(), options));
    }
    let question = |(path, options): &(String, String)| json!({"frf": path, "config": bench.json(&format!("config show{options}"))});
    let questions: Vec<Value> = asked.iter().map(question).collect();
    let Some(answers) = truth::ask_of("measured_margins.py", &questions) else {
        return;
    };
    for ((path, options), expected) in asked.iter().zip(&answers) {
        let found = bench.json(&format!("margins --frf {path}{options}"));
        assert_same(&found["measured"], expected, options);
    }
}

/// Both interpolate between points at a distance of 0.6 % or less: a cubic errs by (0.006)^4/384 in the curve, and a peak on the
/// grid by a quarter of (0.006)^2 of its relative curvature, which is 1/damping^2 at most at a resonance of the law (its grid is
/// finer).
fn assert_same(found: &Value, expected: &Value, case: &str) {
    assert_eq!(found["stability"], "stable", "{case}");
    let same = |name: &str, found: f64, tolerance: f64| {
        let expected = number(&expected[name]);
        near(
            &format!("{name}{case}"),
            found,
            expected,
            tolerance * expected.abs(),
        );
    };
    let (margins, peaks) = (&found["margins"], &found["peaks"]);
    for name in ["phase_margin_deg", "gain_margin_db", "modulus_margin"] {
        same(name, number(&margins[name]["value"]), 1e-4);
    }
    same(
        "sensitivity_peak_rad_s",
        number(&margins["sensitivity_peak_rad_s"]),
        1e-3,
    );
    for name in [
        "control_peak_a_per_m",
        "disturbance_peak_m_per_a",
        "complementary_peak",
    ] {
        same(name, number(&peaks[name]["value"]), 1e-3);
    }
    let crossings = margins["crossings"].as_array().expect("a list");
    let expected = expected["crossings_rad_s"].as_array().expect("a list");
    assert_eq!(crossings.len(), expected.len(), "{case}");
    for (crossing, expected) in crossings.iter().zip(expected) {
        let (found, expected) = (number(&crossing["rad_s"]["value"]), number(expected));
        near(&format!("crossing{case}"), found, expected, 1e-5 * expected);
    }
}
