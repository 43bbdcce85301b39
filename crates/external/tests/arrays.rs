//! Files of arrays as records: columns by name, their times, and what is refused.

use std::path::PathBuf;

use bench_external::{Columns, Record, Sampling, TimeBase, TimeUnit, listing, names, read};

const SAMPLES: usize = 100_000;

/// A file in a folder of its own.
struct File {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl File {
    fn new(bytes: impl AsRef<[u8]>) -> File {
        let folder = tempfile::tempdir().expect("a folder");
        // The kind of a file is decided by its content.
        let path = folder.path().join("record.csv");
        std::fs::write(&path, bytes).expect("a file");
        File {
            path,
            _folder: folder,
        }
    }
}

/// An NPY file of an array of structures.
fn npy(descr: &str, count: usize, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': ({count},), }}\n");
    let length = (header.len() as u16).to_le_bytes();
    [&b"\x93NUMPY\x01\0"[..], &length, header.as_bytes(), data].concat()
}

/// Times t of a type, and 32-bit integers u and y.
fn record(time: &str, write: impl Fn(usize) -> Vec<u8>) -> Vec<u8> {
    let row = |k: usize| {
        let signals = [k as i32 % 7, k as i32 % 11].map(i32::to_le_bytes);
        [&write(k)[..], signals.as_flattened()].concat()
    };
    let rows: Vec<u8> = (0..SAMPLES).flat_map(row).collect();
    npy(
        &format!("[('t', '{time}'), ('u', '<i4'), ('y', '<i4')]"),
        SAMPLES,
        &rows,
    )
}

fn columns(time: &str, unit: Option<TimeUnit>) -> Columns {
    Columns {
        input: "u".into(),
        output: "y".into(),
        reference: None,
        sampling: Sampling::TimeColumn {
            name: time.into(),
            unit,
        },
    }
}

fn read_record(bytes: Vec<u8>, unit: Option<TimeUnit>) -> Record {
    let file = File::new(bytes);
    read(&file.path, &columns("t", unit)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn times_of_every_binary_type_are_regular_with_the_exact_rate() {
    let (s, ns) = (Some(TimeUnit::S), Some(TimeUnit::Ns));
    let time = |k: usize| k as f64 * 1e-3;
    // Nanoseconds since 1970: doubles of this size are 256 ns apart.
    let since_1970 = |k: usize| 1_700_000_000_000_000_000_i64 + 1_000_000 * k as i64;
    for (bytes, unit) in [
        (record("<f8", |k| time(k).to_le_bytes().to_vec()), s),
        // At 100 s they are 7.6 us apart.
        (
            record("<f4", |k| (time(k) as f32).to_le_bytes().to_vec()),
            s,
        ),
        (
            record(">f4", |k| (time(k) as f32).to_be_bytes().to_vec()),
            None,
        ),
        (record("<i8", |k| since_1970(k).to_le_bytes().to_vec()), ns),
        (
            record("<f8", |k| (since_1970(k) as f64).to_le_bytes().to_vec()),
            ns,
        ),
        (
            record("<M8[ns]", |k| since_1970(k).to_le_bytes().to_vec()),
            None,
        ),
        (
            record("<u4", |k| (k as u32).to_le_bytes().to_vec()),
            Some(TimeUnit::Ms),
        ),
    ] {
        let found = read_record(bytes, unit);
        assert_eq!(found.times, TimeBase::Regular);
        assert_eq!(found.signals.rate_hz, 1000.0);
        assert_eq!(found.signals.input[13], 6.0);
        assert_eq!(found.signals.output[13], 2.0);
    }
}

#[test]
fn decimals_of_binary_times_are_recognised_as_those_of_a_text() {
    // 1.5 kHz in milliseconds, stored as doubles.
    let time = |k: usize| (k as f64 / 1.5).round() / 1000.0;
    let found = read_record(record("<f8", |k| time(k).to_le_bytes().to_vec()), None);
    assert_eq!(found.times, TimeBase::Regular);
    assert!((found.signals.rate_hz / 1500.0 - 1.0).abs() < 1e-9);
}

#[test]
fn drift_of_single_times_is_true() {
    let time = |k: usize| k as f64 * 1e-3 * (1.0 + 1e-7 * k as f64);
    let found = read_record(
        record("<f4", |k| (time(k) as f32).to_le_bytes().to_vec()),
        None,
    );
    let TimeBase::Resampled {
        largest_deviation_s,
    } = found.times
    else {
        panic!("{:?}", found.times);
    };
    // c k^2 deviates most from its line of least squares at the ends: c n^2/6.
    let expected_s = 1e-10 * (SAMPLES as f64).powi(2) / 6.0;
    assert!(
        (largest_deviation_s / expected_s - 1.0).abs() < 1e-3,
        "{largest_deviation_s}"
    );
}

fn refusal(file: &File, columns: &Columns) -> String {
    read(&file.path, columns).expect_err("refused").to_string()
}

/// Two datasets of a universal file: u with three samples and y with these lines.
fn universal(points: usize, lines: &str) -> String {
    let dataset = |id: &str, kind: u32, points: usize, lines: &str| {
        let nodes = format!(" NONE      {:10}   3 NONE               1   3", 1);
        let axis = format!("{:10}    0    0    0 NONE                 NONE\n", 0).repeat(4);
        format!(
            "    -1\n    58\n{id}\nNONE\nNONE\nNONE\nNONE\n    1         0    0         0{nodes}\n\
             {kind:10}{points:10}         1 0.0 1.0e-3 0.0\n{axis}{lines}    -1\n"
        )
    };
    dataset("u", 4, 3, " 1.0 2.0 3.0\n")
        + &dataset("y", 4, points, lines)
        + &dataset("z", 6, 1, " 1.0 2.0\n")
}

#[test]
fn what_is_no_column_is_refused_with_what_it_is() {
    let file = File::new(universal(3, " 4.0 5.0 nan\n"));
    let at_rate = |input: &str, output: &str| Columns {
        input: input.into(),
        output: output.into(),
        reference: None,
        sampling: Sampling::RateHz(1000.0),
    };
    for (input, output, words) in [
        ("v", "y", &["no column `v`", "u.time, u, y.time, y"][..]),
        ("u", "u", &["`u` is selected twice"]),
        ("u", "y", &["sample 3: \"NaN\" in column `y`"]),
        ("u", "z", &["`z` in", "a complex number"]),
    ] {
        let why = refusal(&file, &at_rate(input, output));
        for word in words {
            assert!(why.contains(word), "`{word}` is not in {why}");
        }
    }
    let file = File::new(universal(2, " 4.0 5.0\n"));
    let why = refusal(&file, &at_rate("u", "y"));
    assert!(why.contains("`u` has 3 numbers and `y` has 2"), "{why}");
}

#[test]
fn axis_in_another_unit_is_no_time() {
    let text = universal(3, " 4.0 5.0 6.0\n");
    for (unit, is_refused) in [
        ("rev", true),
        ("Hz", true),
        ("msec", false),
        ("NONE", false),
    ] {
        let label = format!("NONE                 {unit}\n");
        let file = File::new(text.replace("NONE                 NONE\n", &label));
        let found = read(&file.path, &columns("u.time", None));
        let why = found.err().map(|error| error.to_string());
        assert_eq!(why.is_some(), is_refused, "{unit}: {why:?}");
        let is_named = |why: String| why.contains(&format!("`u.time` is in `{unit}`"));
        assert!(why.is_none_or(is_named), "{unit}");
        let found = read(&file.path, &columns("u.time", Some(TimeUnit::S)));
        assert!(found.is_ok(), "{unit}: the given unit decides");
    }
}

#[test]
fn name_of_a_matrix_or_a_structure_is_no_unit_of_time() {
    let row = |k: usize| {
        [k as f64 * 1e-3, (k % 7) as f64, (k % 11) as f64]
            .map(f64::to_le_bytes)
            .concat()
    };
    let data: Vec<u8> = (0..1000).flat_map(row).collect();
    for (descr, [time, input, output], is_assumed) in [
        ("[('d', '<f8', (3,))]", ["d:1", "d:2", "d:3"], true),
        (
            "[('time_s', '<f8', (3,))]",
            ["time_s:1", "time_s:2", "time_s:3"],
            false,
        ),
        (
            "[('h', [('t', '<f8'), ('u', '<f8'), ('y', '<f8')])]",
            ["h.t", "h.u", "h.y"],
            true,
        ),
        (
            "[('h', [('t_s', '<f8'), ('u', '<f8'), ('y', '<f8')])]",
            ["h.t_s", "h.u", "h.y"],
            false,
        ),
    ] {
        let file = File::new(npy(descr, 1000, &data));
        let columns = Columns {
            input: input.into(),
            output: output.into(),
            ..columns(time, None)
        };
        let record = read(&file.path, &columns).unwrap_or_else(|error| panic!("{error}"));
        let error = (record.signals.rate_hz / 1000.0 - 1.0).abs();
        assert!(error < 1e-9, "{time}: {}", record.signals.rate_hz);
        assert_eq!(record.seconds_assumed, is_assumed, "{time}");
    }
}

#[test]
fn a_matrix_without_a_name_has_numbered_columns() {
    let header = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 2), }\n";
    let length = (header.len() as u16).to_le_bytes();
    let bytes = [
        &b"\x93NUMPY\x01\0"[..],
        &length,
        header.as_bytes(),
        &[0, 1, 2, 3, 4, 5],
    ]
    .concat();
    let file = File::new(bytes);
    assert_eq!(names(&file.path).expect("columns"), ["1", "2"]);
    assert_eq!(listing(&file.path).expect("columns"), "1, 2");
}

#[test]
fn every_prefix_is_refused_or_a_record() {
    let row = |k: u8| [f64::from(k).to_le_bytes(), [k; 8]].concat();
    let data: Vec<u8> = (0..4).flat_map(row).collect();
    let npy = npy("[('t', '<f8'), ('u', '<f4'), ('y', '<f4')]", 4, &data);
    for whole in [npy, universal(3, " 4.0 5.0 6.0\n").into_bytes()] {
        for length in 0..whole.len() {
            let file = File::new(&whole[..length]);
            let _ = (
                read(&file.path, &columns("t", Some(TimeUnit::S))),
                listing(&file.path),
            );
        }
    }
}
