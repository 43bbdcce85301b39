//! Verdicts and stated causes on records with the difficulties of real laboratories, by independent code
//! (`tests/python/impaired_records.py`).

use crate::external::program::Bench;
use crate::external::python;

/// The seed is not one that was used for development.
const SEED: &str = "20261128";
/// Records of which a verdict is expected.
const DECIDABLE: [&str; 13] = [
    "plain",
    "inverted sensor",
    "delay",
    "hum within the band",
    "spike",
    "jump",
    "stated velocity",
    "rate that drifts, true times",
    "coarse resolution",
    "hammer",
    "digital filter of first order that is not given",
    "one damper",
    "lag of the drive that is not given",
];
/// Records with a defect that is to be named.
const DEFECTS: [&str; 8] = [
    "stuck samples",
    "acceleration, not stated",
    "slow probe",
    "milliseconds without a unit",
    "missing rows, with times",
    "swapped columns",
    "output before the input",
    "unrelated columns",
];

/// Verdict, stated cause, and number of wrong signs of a record of each kind: see the script. `None` without Python.
fn judged(kinds: &[&str]) -> Option<Vec<Vec<f64>>> {
    let bench = Bench::new();
    let folder = bench.path("records").display().to_string();
    let first = [SEED, "1", &folder, "numbers", env!("CARGO_BIN_EXE_bench")];
    python::numbers("impaired_records.py", &[&first, kinds].concat(), "")
}

#[test]
fn records_without_a_defect_are_decided_and_none_wrongly() {
    let Some(records) = judged(&DECIDABLE) else {
        return;
    };
    assert_eq!(records.len(), DECIDABLE.len());
    assert!(records.iter().all(|record| record[0] >= 0.0), "{records:?}");
    assert!(records.iter().all(|record| record[2] == 0.0), "{records:?}");
    let decided = records.iter().filter(|record| record[0] > 0.0).count();
    assert!(decided + 1 >= DECIDABLE.len(), "{records:?}");
}

#[test]
fn cause_of_no_verdict_is_stated_and_none_wrongly() {
    let Some(records) = judged(&DEFECTS) else {
        return;
    };
    assert_eq!(records.len(), DEFECTS.len());
    assert!(records.iter().all(|record| record[0] >= 0.0), "{records:?}");
    let is_stated = |record: &Vec<f64>| record[1] > 0.0;
    assert!(records.iter().all(is_stated), "{records:?}");
}
