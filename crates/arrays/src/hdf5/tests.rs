//! Files that h5py wrote (`tests/python/array_files.py`).

use num_complex::Complex;

use super::*;
use crate::contents::Contents;
use crate::number::{Numbers, Precision};

const MATLAB: &[u8] = include_bytes!("../../tests/files/matlab.mat");
const LATEST: &[u8] = include_bytes!("../../tests/files/latest.h5");
const HUGE: &[u8] = include_bytes!("../../tests/files/huge.h5");
const MIB: u64 = 1 << 20;

fn contents(bytes: &[u8], max_bytes: u64) -> Result<Contents, ArraysError> {
    assert!(is_one(bytes));
    variables(bytes, &mut Budget::new(max_bytes)).map(Contents::of)
}

fn series(contents: &Contents) -> Vec<(&str, &Numbers)> {
    let series = contents.series.iter();
    series
        .map(|series| (series.name.as_str(), &series.numbers))
        .collect()
}

fn named(items: &[(&str, &str)]) -> Vec<(String, String)> {
    let pairs = items.iter();
    pairs
        .map(|(name, what)| (name.to_string(), what.to_string()))
        .collect()
}

#[test]
fn file_of_matlab_has_its_arrays_with_the_dimensions_of_matlab() {
    let found = contents(MATLAB, MIB).expect("a file");
    let z = [Complex::new(1.0, -2.0), Complex::new(3.0, 4.0)];
    assert_eq!(
        series(&found),
        [
            (
                "s.inner.y",
                &Numbers::Real(vec![7.0, 8.0], Precision::Single)
            ),
            ("square:1", &Numbers::Integer(vec![1, 3])),
            ("square:2", &Numbers::Integer(vec![2, 4])),
            ("u", &Numbers::Real(vec![0.5, -1.5, 2.5], Precision::Double)),
            ("z", &Numbers::Complex(z.into())),
        ]
    );
    assert_eq!(found.scalars, [("flag".to_string(), 1.0)]);
    assert_eq!(found.texts, named(&[("name", "N\u{b7}m")]));
    assert_eq!(
        found.others,
        named(&[
            ("c", "a cell array"),
            ("nothing", "empty"),
            (
                "s.several",
                "references, as of a cell array or an array of structures"
            ),
        ])
    );
}

/// Packed chunks with checksums, both byte orders, compound types; links to other files are not followed.
#[test]
fn file_of_h5py_has_its_arrays_with_their_units() {
    let found = contents(LATEST, MIB).expect("a file");
    let real = |values: &[f64], precision| Numbers::Real(values.into(), precision);
    let packed: Vec<f64> = (0..40).map(f64::from).collect();
    let z = [Complex::new(1.0, -2.0), Complex::new(3.0, 4.0)];
    assert_eq!(
        series(&found),
        [
            ("half", &real(&[0.5, 1.5], Precision::Half)),
            ("on", &Numbers::Integer(vec![1, 0])),
            ("packed", &real(&packed, Precision::Double)),
            ("run.table.t", &real(&[0.0, 0.1, 0.2], Precision::Double)),
            ("run.table.count", &Numbers::Integer(vec![5, 6, 7])),
            ("square:1", &Numbers::Integer(vec![1, 3])),
            ("square:2", &Numbers::Integer(vec![2, 4])),
            ("time", &real(&[0.0, 1.0, 2.0], Precision::Double)),
            ("z", &Numbers::Complex(z.into())),
        ]
    );
    let units = found.series.iter().filter_map(|series| {
        let unit = series.unit.as_deref()?;
        Some((series.name.as_str(), unit))
    });
    assert_eq!(units.collect::<Vec<_>>(), [("packed", "um")]);
    assert_eq!(found.texts, named(&[("note", "run 7")]));
    assert_eq!(
        found.others,
        named(&[
            ("cube", "an array of 2 x 2 x 2"),
            ("run.above", "a group that has several names"),
            ("run.table.label", "texts"),
        ])
    );
}

#[test]
fn stated_sizes_take_no_memory() {
    let limit = MIB;
    assert_eq!(contents(HUGE, limit), Err(ArraysError::TooLarge { limit }));
    let limit = 300;
    assert_eq!(
        contents(LATEST, limit),
        Err(ArraysError::TooLarge { limit })
    );
}

#[test]
fn header_without_its_file_is_named() {
    for bytes in [
        &b"MATLAB 7.3 MAT-file, Platform: GLNXA64"[..],
        &MATLAB[..300],
        b"\x89HDF\r\n\x1a\n\0\0",
    ] {
        let error = contents(bytes, MIB).expect_err("no file");
        assert!(matches!(error, ArraysError::Hdf5 { .. }), "{error}");
    }
    assert!(!is_one(b"t,u,y\n0,1,2\n"));
}

/// Every byte in turn, and every length: an error or other contents, within the limit of memory.
#[test]
fn damaged_files_cause_no_panic() {
    for original in [MATLAB, LATEST] {
        let mut differing = 0;
        let intact = contents(original, MIB);
        for place in (0..original.len()).step_by(3) {
            for change in [0xff, 0x01] {
                let mut bytes = original.to_vec();
                bytes[place] ^= change;
                if is_one(&bytes) {
                    differing += u32::from(contents(&bytes, MIB) != intact);
                }
            }
        }
        assert!(differing > 300, "{differing}");
        for length in (0..original.len()).step_by(101) {
            let bytes = &original[..length];
            if is_one(bytes) {
                assert_ne!(contents(bytes, MIB), intact);
            }
        }
    }
}
