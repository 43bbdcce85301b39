//! Distortion of a periodic record with a measured input, against an independent simulation.
use serde_json::Value;

use crate::external::program::{Bench, number};
use crate::external::python;

#[test]
fn odd_multisine_with_a_measured_current_gives_modes_verdict_and_distortion() {
    let bench = Bench::new();
    let file = bench.path("odd.csv").display().to_string();
    let Some(rows) = python::numbers("odd_multisine.py", &[&file], "") else {
        return;
    };
    let (distortion, modes) = rows.split_first().expect("rows");
    let answer = bench.json(
        "identify odd.csv --input current_a --output position_m --time time_s --period 2000 --out results",
    );
    let all = answer["modes"].as_array().expect("modes");
    // A mode that fits the distortion of a line has no certain sign.
    let is_certain = |mode: &&Value| number(&mode["sign_error_probability"]) < 1e-3;
    let found: Vec<&Value> = all.iter().filter(is_certain).collect();
    assert_eq!(found.len(), modes.len(), "{found:?}");
    for (mode, exact) in found.iter().zip(modes) {
        // The cubic spring stiffens the modes by its describing function; the residues remain.
        let [hz, residue] = ["frequency_hz", "residue"].map(|name| number(&mode[name]));
        assert!((hz / exact[0] - 1.0).abs() < 0.01, "{mode}");
        assert!((residue / exact[1] - 1.0).abs() < 0.05, "{mode}");
    }
    // All residues are positive, so that all zeros lie between the modes, left of the axis.
    assert_eq!(answer["cnmp"], "excluded", "{}", answer["why"]);
    // The lines are 4 Hz apart; nothing is known beyond the first and the last.
    let [low_hz, high_hz] = [0, 1].map(|k| number(&answer["band_hz"][k]));
    assert!(
        (low_hz - 5.0).abs() < 1e-6 && (high_hz - 249.0).abs() < 1e-6,
        "{low_hz} {high_hz}"
    );
    assert_eq!(answer["distortion_source"], "omitted_lines");
    let linearity = &answer["linearity"];
    let odd = number(&linearity["odd_distortion_ratio"]) / distortion[0];
    // The power at the 61 odd lines is that of sums with random phases, the same in both; interpolation between excited lines leaves
    // errors of the linear part.
    assert!((0.5..2.0).contains(&odd), "{linearity}");
    assert!(number(&linearity["odd_by_noise_alone"]) < 1e-3);
    let total = number(&answer["distortion_ratio"]);
    assert!(
        (0.5..2.0).contains(&(total / (distortion[0] + distortion[1]))),
        "{total}"
    );
}
