//! Universal files by the description of the format.

use num_complex::Complex;

use super::*;
use crate::contents::Contents;
use crate::number::{Numbers, Precision};

/// A dataset: line with its number, ID, function, response node and direction, line 7, data.
fn dataset_of(
    kind: &str,
    id: &str,
    function: u32,
    place: (u32, i32),
    form: &str,
    data: &[u8],
) -> Vec<u8> {
    let (node, direction) = place;
    let nodes = format!(" NONE      {node:10}{direction:4} NONE               1   3");
    let axis = |unit: &str| format!("{:10}    0    0    0 {:<20} {unit:<20}\n", 0, "NONE");
    let head = format!(
        "    -1\n{kind}\n{id}\nNONE\nNONE\nNONE\nNONE\n{function:5}         0    0         0{nodes}\n{form}\n{}{}{}{}",
        axis("s"),
        axis("N"),
        axis("NONE"),
        axis("NONE"),
    );
    [head.as_bytes(), data, b"    -1\n"].concat()
}

fn read(bytes: &[u8]) -> Result<Vec<Dataset>, ArraysError> {
    datasets(bytes, &mut Budget::new(1 << 20))
}

fn one(kind: &str, form: &str, data: &[u8]) -> Dataset {
    let bytes = dataset_of(kind, "force", 1, (2, 3), form, data);
    let mut found = read(&bytes).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(found.len(), 1);
    found.remove(0)
}

/// Line 7: data type, points, spacing, first abscissa, step.
fn form(kind: u32, points: usize, is_even: bool) -> String {
    let (spacing, step) = if is_even {
        (1, "1.00000e-03")
    } else {
        (0, "0.00000e+00")
    };
    format!("{kind:10}{points:10}{spacing:10}  0.50000e+00  {step}  0.00000e+00")
}

#[test]
fn text_of_every_case_of_the_standard_is_read() {
    let (ordinates, pairs) = (vec![1.0, -2.0, 3.5], vec![(1.0, -1.0), (2.0, -2.0)]);
    let pairs = pairs
        .into_iter()
        .map(|(re, im)| Complex::new(re, im))
        .collect();
    let (real, complex) = (
        Numbers::Real(ordinates, Precision::Double),
        Numbers::Complex(pairs),
    );
    let even_s = [0.5, 0.501, 0.502];
    let uneven_s = [0.25, 0.5, 2.0];
    for (kind, is_even, text) in [
        (2, true, "  1.00000E+00 -2.00000E+00  3.50000E+00\n"),
        (
            4,
            true,
            "  1.000000000000D+00 -2.000000000000D+00\n  3.500000000000D+00\n",
        ),
        (2, false, " 2.5e-01 1.0 5.0e-01 -2.0\n 2.0e+00 3.5\n"),
        (4, false, " 2.5e-01 1.0 5.0e-01 -2.0\r\n 2.0e+00 3.5\r\n"),
        (5, true, " 1.0 -1.0 2.0 -2.0\n"),
        (6, true, " 1.0 -1.0\n 2.0 -2.0\n"),
        (5, false, " 0.25 1.0 -1.0 0.5 2.0 -2.0\n"),
        (6, false, " 0.25 1.0 -1.0\n 0.5 2.0 -2.0\n"),
    ] {
        let points = if kind < 5 { 3 } else { 2 };
        let found = one("    58", &form(kind, points, is_even), text.as_bytes());
        assert_eq!(
            found.ordinates,
            if kind < 5 {
                real.clone()
            } else {
                complex.clone()
            }
        );
        let expected_s = if is_even { even_s } else { uneven_s };
        let found_s = found.abscissas.to_real().expect("real");
        for (found_s, expected_s) in found_s.iter().zip(expected_s) {
            assert!(
                (found_s - expected_s).abs() < 1e-15,
                "{kind} {is_even}: {found_s}"
            );
        }
        assert_eq!(found_s.len(), points);
        assert_eq!(
            (found.place.as_str(), found.unit.as_deref()),
            ("2:+Z", Some("N"))
        );
        assert_eq!(found.abscissa_unit.as_deref(), Some("s"));
    }
}

#[test]
fn binary_numbers_of_both_orders_are_read_whatever_the_stated_size() {
    let ordinates = [1.0_f64, -2.0, 3.5];
    let times = [0.25_f64, 0.5, 2.0];
    let expected = Numbers::Real(ordinates.to_vec(), Precision::Double);
    for (order, double, single) in [
        (
            1,
            f64::to_le_bytes as fn(f64) -> [u8; 8],
            f32::to_le_bytes as fn(f32) -> [u8; 4],
        ),
        (2, f64::to_be_bytes, f32::to_be_bytes),
    ] {
        let kind = format!(
            "    58b{order:6}     2          11          24     0     0           0           0"
        );
        let even: Vec<u8> = ordinates.map(double).concat();
        let found = one(&kind, &form(4, 3, true), &even);
        assert_eq!(found.ordinates, expected);
        let points = || times.iter().zip(ordinates);
        // As pyuff writes them, and as the standard describes.
        let doubles = points()
            .flat_map(|(t, y)| [double(*t), double(y)])
            .collect::<Vec<_>>();
        let mixed = points().map(|(t, y)| [&single(*t as f32)[..], &double(y)].concat());
        for data in [doubles.concat(), mixed.collect::<Vec<_>>().concat()] {
            let found = one(&kind, &form(4, 3, false), &data);
            assert_eq!(found.ordinates, expected);
            assert_eq!(found.abscissas.to_real(), Some(times.to_vec()));
        }
        let singles: Vec<u8> = ordinates.map(|y| single(y as f32)).concat();
        let found = one(&kind, &form(2, 3, true), &singles);
        assert_eq!(found.ordinates.to_real(), Some(ordinates.to_vec()));
    }
    let vax = b"    58b     1     1          11          24".as_slice();
    assert_eq!(header::form(vax), Some(header::Form::OtherBinary));
}

#[test]
fn a_rounded_step_is_that_of_the_nearest_round_rate_and_one_of_few_digits_exact() {
    for (step, rate_hz, tolerance) in [
        ("3.33333e-04", 3000.0, 1e-12),
        ("4.88281E-04", 2048.0, 1e-12),
        ("0.33333E-03", 3000.0, 1e-12),
        ("2.1E-4", 1.0 / 2.1e-4, 1e-12),
        ("2.44140625E-4", 4096.0, 1e-12),
        // No rate of few digits: as accurate as the step.
        ("8.10372e-04", 1.0 / 8.10372e-4, 6e-7),
    ] {
        let line = format!("{:10}{:10}{:10} 0.0 {step} 0.0", 4, 101, 1);
        let zeros = " 0.0\n".repeat(101);
        let found = one("    58", &line, zeros.as_bytes())
            .abscissas
            .to_real()
            .expect("real");
        let found_hz = 100.0 / found[100];
        assert!(
            (found_hz / rate_hz - 1.0).abs() < tolerance,
            "{step}: {found_hz}"
        );
    }
}

fn names(datasets: &[Vec<u8>]) -> Vec<String> {
    let variables = records(&read(&datasets.concat()).expect("valid"));
    let series = Contents::of(variables).series.into_iter();
    series.map(|series| series.name).collect()
}

#[test]
fn responses_have_the_name_that_tells_them_apart() {
    let at = |id: &str, place: (u32, i32)| {
        dataset_of("    58", id, 1, place, &form(4, 2, true), b" 1.0 2.0\n")
    };
    assert_eq!(
        names(&[at("force", (1, 3)), at("position", (1, 3))]),
        ["time", "force", "position"]
    );
    assert_eq!(
        names(&[at("NONE", (1, 3)), at("NONE", (2, -4))]),
        ["time", "1:+Z", "2:-RX"]
    );
    assert_eq!(
        names(&[at("x", (1, 0)), at("x", (1, 0))]),
        ["time", "x 1 1", "x 1 2"]
    );
    let longer = dataset_of(
        "    58",
        "y",
        1,
        (1, 3),
        &form(4, 3, true),
        b" 1.0 2.0 3.0\n",
    );
    assert_eq!(
        names(&[at("u", (1, 3)), longer]),
        ["u.time", "u", "y.time", "y"]
    );
    let response = dataset_of("    58", "H", 4, (1, 3), &form(6, 1, true), b" 1.0 2.0\n");
    assert_eq!(names(&[response, at("u", (1, 3))]), ["time", "u"]);
}

#[test]
fn other_datasets_are_skipped() {
    let other = b"    -1\n   151\nname\n    -1\n".to_vec();
    let ours = dataset_of("    58", "u", 1, (1, 3), &form(4, 2, true), b" 1.0 2.0\n");
    assert_eq!(names(&[other.clone(), ours.clone(), other]), ["time", "u"]);
    assert_eq!(names(&[b"    -1\n".to_vec(), ours]), ["time", "u"]);
}

#[test]
fn data_that_do_not_agree_with_the_header_are_refused_with_their_place() {
    let text = |points: usize, data: &str| {
        let bytes = dataset_of(
            "    58",
            "force",
            1,
            (2, 3),
            &form(4, points, true),
            data.as_bytes(),
        );
        read(&bytes).map(drop)
    };
    assert_eq!(text(2, " 1.0 2.0\n"), Ok(()));
    for (points, data) in [
        (3, " 1.0 2.0\n"),
        (1, " 1.0 2.0\n"),
        (2, " 1.0 x\n"),
        (999_999_999, " 1.0\n"),
    ] {
        let error = text(points, data).expect_err("damaged").to_string();
        let words = if points == 999_999_999 {
            "bytes of numbers"
        } else {
            "`force` is damaged"
        };
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn every_prefix_is_refused_or_empty_and_every_changed_byte_refused_or_read() {
    let kind = "    58b     1     2          11          16     0     0           0           0";
    let binary = dataset_of(kind, "u", 1, (1, 3), &form(4, 2, true), &[0; 16]);
    let text = dataset_of("    58", "u", 1, (1, 3), &form(4, 2, true), b" 1.0 2.0\n");
    for whole in [binary, text] {
        for length in 0..whole.len() {
            // The last line needs no more than its number.
            let is_complete = length >= whole.len() - 1;
            let found = read(&whole[..length]);
            assert!(
                found.is_err() || found.is_ok_and(|all| all.is_empty() || is_complete),
                "{length}"
            );
            for byte in [0, b' ', b'9', b'\n', 0xff] {
                let mut changed = whole.clone();
                changed[length] = byte;
                let _ = read(&changed);
            }
        }
    }
}
