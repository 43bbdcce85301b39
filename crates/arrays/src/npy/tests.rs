//! NPY files of bytes by the description of the format.

use super::*;
use crate::contents::Contents;
use crate::number::{Numbers, Precision};

fn file(major: u8, header: &str, data: &[u8]) -> Vec<u8> {
    let length = (header.len() as u32).to_le_bytes();
    let length = if major == 1 {
        &length[..2]
    } else {
        &length[..]
    };
    [
        &b"\x93NUMPY"[..],
        &[major, 0],
        length,
        header.as_bytes(),
        data,
    ]
    .concat()
}

fn read(bytes: &[u8]) -> Result<Contents, ArraysError> {
    let value = array(bytes, &mut Budget::new(1 << 20))?;
    Ok(Contents::of(vec![("x".into(), value)]))
}

fn header(descr: &str, is_fortran: &str, shape: &str) -> String {
    format!("{{'descr': {descr}, 'fortran_order': {is_fortran}, 'shape': {shape}, }}\n")
}

#[test]
fn numbers_of_every_version_and_byte_order_are_read() {
    let expected = Numbers::Real(vec![1.5, -2.0], Precision::Double);
    for major in 1..=3 {
        for (descr, bytes) in [
            ("'<f8'", [1.5_f64, -2.0].map(f64::to_le_bytes)),
            ("'>f8'", [1.5_f64, -2.0].map(f64::to_be_bytes)),
        ] {
            let bytes = file(major, &header(descr, "False", "(2,)"), bytes.as_flattened());
            assert_eq!(read(&bytes).expect("valid").series[0].numbers, expected);
        }
    }
    let text = read(&file(4, "", &[])).expect_err("version 4").to_string();
    assert!(text.contains("version 1, 2 or 3"), "{text}");
}

#[test]
fn columns_of_a_matrix_are_those_of_both_orders() {
    let bytes = [0_u8, 1, 2, 3, 4, 5];
    for (is_fortran, columns) in [
        ("False", [[0, 2, 4], [1, 3, 5]]),
        ("True", [[0, 1, 2], [3, 4, 5]]),
    ] {
        let found = read(&file(1, &header("'|u1'", is_fortran, "(3, 2)"), &bytes)).expect("valid");
        for (series, column) in found.series.iter().zip(columns) {
            assert_eq!(series.numbers, Numbers::Integer(column.to_vec()));
        }
        assert_eq!(found.series[1].name, "x:2");
    }
}

#[test]
fn fields_and_scalars_are_read() {
    let entry = |t: f32, u: i16| [&t.to_be_bytes()[..], &u.to_le_bytes(), b"ab"].concat();
    let data = [entry(0.25, -7), entry(0.5, 300)].concat();
    let descr = "[('t', '>f4'), ('u', '<i2'), ('note', '|S2')]";
    let found = read(&file(1, &header(descr, "False", "(2,)"), &data)).expect("valid");
    assert_eq!(found.series[0].name, "x.t");
    let single = Numbers::Real(vec![0.25, 0.5], Precision::Single);
    assert_eq!(found.series[0].numbers, single);
    assert_eq!(found.series[1].numbers, Numbers::Integer(vec![-7, 300]));
    assert_eq!(found.others[0].0, "x.note");
    let scalar = read(&file(
        1,
        &header("'<i4'", "False", "()"),
        &7_i32.to_le_bytes(),
    ));
    assert_eq!(scalar.expect("valid").scalars, [("x".to_string(), 7.0)]);
}

#[test]
fn sizes_that_do_not_agree_are_refused() {
    let max = usize::MAX;
    for shape in [
        "(3,)",
        &format!("({max}, {max})"),
        &format!("({max},)"),
        "(-1,)",
        "2",
    ] {
        let bytes = file(1, &header("'<f8'", "False", shape), &[0; 16]);
        assert!(read(&bytes).is_err(), "{shape}");
    }
    let many = file(1, &header("'|u1'", "False", "(1000,)"), &[0; 1000]);
    let refused = array(&many, &mut Budget::new(1000));
    assert_eq!(refused, Err(ArraysError::TooLarge { limit: 1000 }));
}

#[test]
fn every_prefix_is_refused_and_every_changed_byte_is_refused_or_read() {
    let descr = "[('t', '<f8'), ('u', '<f4', (2,))]";
    let whole = file(1, &header(descr, "False", "(2,)"), &[0; 32]);
    assert!(read(&whole).is_ok());
    for length in 0..whole.len() {
        assert!(read(&whole[..length]).is_err(), "{length}");
        for byte in [0, b'(', b'9', 0xff] {
            let mut changed = whole.clone();
            changed[length] = byte;
            let _ = read(&changed);
        }
    }
}
