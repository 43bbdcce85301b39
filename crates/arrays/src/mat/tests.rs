//! MAT-files of bytes by the description of the format.

use super::*;
use crate::contents::Contents;

/// Writes the parts of a file in a byte order.
#[derive(Clone, Copy)]
struct Writer(ByteOrder);

impl Writer {
    fn word(self, x: u32) -> [u8; 4] {
        match self.0 {
            ByteOrder::Little => x.to_le_bytes(),
            ByteOrder::Big => x.to_be_bytes(),
        }
    }

    fn double(self, x: f64) -> [u8; 8] {
        match self.0 {
            ByteOrder::Little => x.to_le_bytes(),
            ByteOrder::Big => x.to_be_bytes(),
        }
    }

    fn file(self, elements: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = vec![b' '; HEADER_BYTES - 4];
        bytes[..10].copy_from_slice(b"MATLAB 5.0");
        bytes.extend(match self.0 {
            ByteOrder::Little => b"\x00\x01IM",
            ByteOrder::Big => b"\x01\x00MI",
        });
        bytes.extend(elements.concat());
        bytes
    }

    /// An element, filled up to a multiple of eight bytes.
    fn element(self, kind: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = [self.word(kind), self.word(data.len() as u32)].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    }

    /// An element of at most four bytes in the short form.
    fn short(self, kind: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = self.word((data.len() as u32) << 16 | kind).to_vec();
        bytes.extend(data);
        bytes.resize(8, 0);
        bytes
    }

    fn array(self, name: &str, flags: u32, shape: &[u32], contents: &[Vec<u8>]) -> Vec<u8> {
        let sizes: Vec<[u8; 4]> = shape.iter().map(|size| self.word(*size)).collect();
        let head = [
            self.element(6, [self.word(flags), [0; 4]].as_flattened()),
            self.element(5, sizes.as_flattened()),
            self.element(1, name.as_bytes()),
        ];
        self.element(MATRIX, &[head.concat(), contents.concat()].concat())
    }

    fn doubles(self, numbers: &[f64]) -> Vec<u8> {
        let bytes: Vec<[u8; 8]> = numbers.iter().map(|x| self.double(*x)).collect();
        self.element(9, bytes.as_flattened())
    }
}

const ORDERS: [Writer; 2] = [Writer(ByteOrder::Little), Writer(ByteOrder::Big)];
const LITTLE: Writer = Writer(ByteOrder::Little);

fn read(bytes: &[u8]) -> Result<Contents, ArraysError> {
    variables(bytes, &mut Budget::new(1 << 20)).map(Contents::of)
}

fn numbers_of(bytes: &[u8]) -> Numbers {
    let mut contents = read(bytes).expect("valid");
    contents.series.pop().expect("a series").numbers
}

#[test]
fn numbers_of_both_byte_orders_and_of_every_class_are_read() {
    for writer in ORDERS {
        let vector = |class: u32, contents: &[Vec<u8>]| {
            numbers_of(&writer.file(&[writer.array("u", class, &[1, 2], contents)]))
        };
        let real = |precision| Numbers::Real(vec![-2.0, 300.0], precision);
        assert_eq!(
            vector(6, &[writer.doubles(&[-2.0, 300.0])]),
            real(Precision::Double)
        );
        // Doubles with integer values are stored in fewer bytes, and in the short form.
        let words = [-2_i16, 300].map(|x| match writer.0 {
            ByteOrder::Little => x.to_le_bytes(),
            ByteOrder::Big => x.to_be_bytes(),
        });
        let short = writer.short(3, words.as_flattened());
        assert_eq!(
            vector(6, std::slice::from_ref(&short)),
            real(Precision::Double)
        );
        assert_eq!(
            vector(7, std::slice::from_ref(&short)),
            real(Precision::Single)
        );
        assert_eq!(vector(10, &[short]), Numbers::Integer(vec![-2, 300]));
        let parts = [writer.doubles(&[1.0, 2.0]), writer.doubles(&[3.0, 4.0])];
        let complex = vec![Complex::new(1.0, 3.0), Complex::new(2.0, 4.0)];
        assert_eq!(
            vector(6 | COMPLEX_FLAG as u32, &parts),
            Numbers::Complex(complex)
        );
    }
}

/// A file with the structure `s` of the fields u and note, a cell, an object and a matrix.
fn mixed() -> Vec<u8> {
    let names = LITTLE.element(1, b"u\0\0\0\0\0\0\0note\0\0\0\0");
    let field = |class, shape: &[u32], contents| LITTLE.array("", class, shape, &[contents]);
    let text = LITTLE.element(16, b"run 7");
    let fields = [
        LITTLE.short(5, &8_u32.to_le_bytes()),
        names,
        field(6, &[3, 1], LITTLE.doubles(&[1.0, 2.0, 3.0])),
        field(4, &[1, 5], text),
    ];
    let object = [
        LITTLE.element(6, &[17, 0, 0, 0, 0, 0, 0, 0]),
        LITTLE.element(1, b"ts"),
        LITTLE.element(1, b"MCOS"),
    ];
    let matrix = LITTLE.doubles(&[0.0, 0.1, 0.2, 5.0, 6.0, 7.0]);
    LITTLE.file(&[
        LITTLE.array("s", 2, &[1, 1], &fields),
        LITTLE.array("c", 1, &[1, 1], &[]),
        LITTLE.element(MATRIX, &object.concat()),
        LITTLE.array("data", 6, &[3, 2], &[matrix]),
        LITTLE.array("fs", 6, &[1, 1], &[LITTLE.doubles(&[1000.0])]),
    ])
}

#[test]
fn structures_matrices_and_single_numbers_are_read_and_others_named() {
    let contents = read(&mixed()).expect("valid");
    let names: Vec<&str> = contents
        .series
        .iter()
        .map(|series| series.name.as_str())
        .collect();
    assert_eq!(names, ["s.u", "data:1", "data:2"]);
    assert_eq!(
        contents.series[2].numbers.to_real(),
        Some(vec![5.0, 6.0, 7.0])
    );
    assert_eq!(contents.scalars, [("fs".to_string(), 1000.0)]);
    assert_eq!(
        contents.texts,
        [("s.note".to_string(), "run 7".to_string())]
    );
    let others: Vec<&str> = contents
        .others
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(others, ["c", "ts"]);
}

#[test]
fn elements_of_an_array_of_structures_are_numbered() {
    let value = |x: f64| LITTLE.array("", 6, &[1, 2], &[LITTLE.doubles(&[x, x])]);
    let fields = [
        LITTLE.short(5, &4_u32.to_le_bytes()),
        LITTLE.element(1, b"y\0\0\0"),
        value(1.0),
        value(2.0),
    ];
    let contents = read(&LITTLE.file(&[LITTLE.array("s", 2, &[1, 2], &fields)])).expect("valid");
    let names: Vec<&str> = contents
        .series
        .iter()
        .map(|series| series.name.as_str())
        .collect();
    assert_eq!(names, ["s(1).y", "s(2).y"]);
}

fn packed(element: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(element).expect("memory");
    let data = encoder.finish().expect("memory");
    // A compressed element is not filled up.
    [
        &LITTLE.word(COMPRESSED)[..],
        &LITTLE.word(data.len() as u32),
        &data,
    ]
    .concat()
}

#[test]
fn compressed_variables_are_read_up_to_the_limit() {
    let ones = vec![1.0; 1000];
    let element = LITTLE.array("u", 6, &[1000, 1], &[LITTLE.doubles(&ones)]);
    let bytes = LITTLE.file(&[packed(&element), packed(&element)]);
    let contents = read(&bytes).expect("valid");
    assert_eq!(contents.series.len(), 2);
    assert_eq!(contents.series[1].numbers.to_real(), Some(ones));
    // 1000 numbers, and not 2000, fit in 10 000 bytes.
    let refused = variables(&bytes, &mut Budget::new(10_000));
    assert_eq!(refused, Err(ArraysError::TooLarge { limit: 10_000 }));
}

#[test]
fn a_size_that_does_not_agree_is_refused_with_variable_and_place() {
    let array = |shape: &[u32]| {
        let contents = [LITTLE.doubles(&[1.0, 2.0])];
        read(&LITTLE.file(&[LITTLE.array("num", 6, shape, &contents)]))
    };
    assert!(array(&[1, 2]).is_ok());
    for shape in [&[1, 3][..], &[1, 1], &[u32::MAX, u32::MAX, u32::MAX]] {
        let text = array(shape).expect_err("damaged").to_string();
        assert!(
            text.contains("`num`") && text.contains("at byte "),
            "{text}"
        );
    }
}

#[test]
fn every_prefix_and_every_changed_byte_is_refused_or_read() {
    for whole in [
        mixed(),
        LITTLE.file(&[packed(&mixed()[HEADER_BYTES..][..200])]),
    ] {
        for length in 0..whole.len() {
            let _ = read(&whole[..length]);
            for byte in [0, 1, 0x7f, 0xff] {
                let mut changed = whole.clone();
                changed[length] = byte;
                let _ = read(&changed);
            }
        }
    }
    // Within a variable the end is noticed.
    let one = LITTLE.file(&[LITTLE.array("u", 6, &[1, 2], &[LITTLE.doubles(&[1.0, 2.0])])]);
    for length in HEADER_BYTES + 1..one.len() {
        assert!(read(&one[..length]).is_err(), "{length}");
    }
}

#[test]
fn deep_structures_are_named() {
    let mut inner = LITTLE.array("", 6, &[1, 2], &[LITTLE.doubles(&[1.0, 2.0])]);
    for depth in (0..100).rev() {
        let name = if depth == 0 { "s" } else { "" };
        let fields = [
            LITTLE.short(5, &4_u32.to_le_bytes()),
            LITTLE.element(1, b"s\0\0\0"),
            inner,
        ];
        inner = LITTLE.array(name, 2, &[1, 1], &fields);
    }
    let contents = read(&LITTLE.file(&[inner])).expect("valid");
    assert!(contents.series.is_empty());
    assert!(
        contents.others[0].1.contains("nested"),
        "{:?}",
        contents.others
    );
}
