//! All plants except SR4DoF: the XY stage, masses and springs, and plants given by their modes.

mod random;
mod rejected;
mod runs;
mod zeros;

use serde_json::Value;

use crate::answer::list;
use crate::program::number;

fn kinds(answer: &Value) -> Vec<&str> {
    list(answer, "zeros")
        .iter()
        .map(|zero| zero["kind"].as_str().expect("a kind"))
        .collect()
}

/// The zero with the largest real part in the upper half plane.
fn rightmost(answer: &Value) -> (f64, f64) {
    let at = |zero: &Value| (number(&zero["re_rad_s"]), number(&zero["im_rad_s"]));
    let upper = list(answer, "zeros")
        .iter()
        .map(at)
        .filter(|zero| zero.1 >= 0.0);
    upper.max_by(|a, b| a.0.total_cmp(&b.0)).expect("a zero")
}

const LAYOUTS: [&str; 3] = ["pinwheel", "mirror_away", "mirror_toward"];
