//! A file that pyarrow wrote (`tests/python/array_files.py`): two groups of rows, packed with Snappy.

use super::*;
use crate::contents::Contents;

const TABLE: &[u8] = include_bytes!("../../tests/files/table.parquet");
const MIB: u64 = 1 << 20;

fn contents(bytes: &[u8], max_bytes: u64) -> Result<Contents, ArraysError> {
    variables(bytes, &mut Budget::new(max_bytes)).map(Contents::of)
}

/// Values and format of a column of real numbers; NaN as `None`.
fn real(numbers: &Numbers) -> Option<(Vec<Option<f64>>, Precision)> {
    let Numbers::Real(values, precision) = numbers else {
        return None;
    };
    let values = values.iter().map(|x| (!x.is_nan()).then_some(*x));
    Some((values.collect(), *precision))
}

#[test]
fn columns_of_numbers_and_times_are_read_through_all_groups_of_rows() {
    assert!(is_one(TABLE));
    let found = contents(TABLE, MIB).expect("a table");
    let names: Vec<&str> = found.series.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["t", "u", "count", "on", "stamp", "s.y"]);
    let [t, u, count, on, stamp, y] = &found.series[..] else {
        panic!("{names:?}")
    };
    let times = [0.0, 0.5, 1.0, 1.5, 2.0].map(Some);
    assert_eq!(real(&t.numbers), Some((times.into(), Precision::Double)));
    let u_values = [Some(0.5), None, Some(-1.5), Some(2.5), Some(3.5)];
    assert_eq!(real(&u.numbers), Some((u_values.into(), Precision::Single)));
    let counts = [Some(1.0), Some(2.0), Some(3.0), Some(4.0), None];
    assert_eq!(
        real(&count.numbers),
        Some((counts.into(), Precision::Double))
    );
    assert_eq!(on.numbers, Numbers::Integer(vec![1, 0, 1, 1, 0]));
    // 2026-11-28T08:26:43Z is 1,795,854,403 s after 1970.
    let stamps = (0..5).map(|k| 1_795_854_403_000_000 + 500 * k);
    assert_eq!(stamp.numbers, Numbers::Integer(stamps.collect()));
    assert_eq!(stamp.unit.as_deref(), Some("us"));
    assert_eq!(y.numbers, Numbers::Integer(vec![10, 11, 12, 13, 14]));
    let others: Vec<(&str, &str)> = found
        .others
        .iter()
        .map(|(name, what)| (name.as_str(), what.as_str()))
        .collect();
    assert_eq!(
        others,
        [
            ("label", "a column without numbers"),
            ("parts.list.element", "lists"),
            ("price", "decimal numbers"),
        ]
    );
}

#[test]
fn numbers_beyond_the_limit_are_refused() {
    let limit = 1000;
    assert_eq!(contents(TABLE, limit), Err(ArraysError::TooLarge { limit }));
}

/// Every byte in turn, and some lengths: an error or other contents.
#[test]
fn damaged_files_cause_no_panic() {
    let text = |bytes: &[u8]| format!("{:?}", contents(bytes, MIB));
    let (intact, mut differing) = (text(TABLE), 0);
    for place in 0..TABLE.len() {
        for change in [0xff, 0x01] {
            let mut bytes = TABLE.to_vec();
            bytes[place] ^= change;
            differing += u32::from(text(&bytes) != intact);
        }
    }
    assert!(differing > 300, "{differing}");
    for length in (0..TABLE.len()).step_by(13) {
        assert!(contents(&TABLE[..length], MIB).is_err(), "{length}");
    }
}
