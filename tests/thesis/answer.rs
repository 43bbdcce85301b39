//! Lists and zeros of an answer in JSON.

use serde_json::Value;

use crate::program::number;

/// The list with this key.
pub fn list<'a>(answer: &'a Value, key: &str) -> &'a [Value] {
    answer[key]
        .as_array()
        .unwrap_or_else(|| panic!("{key} is not a list: {answer}"))
}

/// Asserts that both lists have the same zeros, within 1e-6 of their magnitude.
pub fn assert_same_zeros(ours: &[Value], truth: &[Value], what: &str) {
    assert_eq!(ours.len(), truth.len(), "{what}");
    let mut left: Vec<(f64, f64)> = truth
        .iter()
        .map(|z| (number(&z[0]), number(&z[1])))
        .collect();
    for zero in ours {
        let (re, im) = (number(&zero["re_rad_s"]), number(&zero["im_rad_s"]));
        let distance = |z: &(f64, f64)| (z.0 - re).hypot(z.1 - im);
        let nearest = (0..left.len())
            .min_by(|&a, &b| distance(&left[a]).total_cmp(&distance(&left[b])))
            .expect("one");
        let found = left.swap_remove(nearest);
        assert!(
            distance(&found) <= 1e-6 * re.hypot(im),
            "{what}: {re} {im:+}j, Python has {found:?}"
        );
    }
}
