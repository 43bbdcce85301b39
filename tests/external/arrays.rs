//! Files of scipy, numpy, h5py, pyarrow and pyuff, and of the format of LabVIEW (`tests/python/record_files.py`), give the modes of the CSV with the same numbers.
use serde_json::Value;

use crate::external::program::{Bench, number};
use crate::external::python;
use crate::external::signals::{STAGE, csv, multisine};

/// File, names of its columns, and how far frequencies, dampings and residues may differ from those of the CSV: only by what the file
/// rounds. Single times have the same rate as double ones; pyuff writes text with 12 digits.
const FILES: [(&str, [&str; 3], f64); 23] = [
    ("row.mat", NAMES, 0.0),
    ("column.mat", NAMES, 0.0),
    ("struct.mat", FIELDS, 0.0),
    ("matrix.mat", MATRIX, 0.0),
    ("lying.mat", MATRIX, 0.0),
    ("single.mat", NAMES, 0.0),
    ("plain.npz", NAMES, 0.0),
    ("compressed.npz", NAMES, 0.0),
    ("structured.npy", NAMES, 0.0),
    ("structured.npz", FIELDS, 0.0),
    ("big_endian.npy", NAMES, 0.0),
    ("matrix.npy", NUMBERS, 0.0),
    ("fortran.npy", NUMBERS, 0.0),
    ("v73.mat", FIELDS, 0.0),
    ("v73.mat", MATRIX, 0.0),
    ("plain.h5", NAMES, 0.0),
    ("structured.h5", FIELDS, 0.0),
    ("matrix.h5", MATRIX, 0.0),
    ("text.uff", NODES, 1e-6),
    ("binary.uff", NODES, 0.0),
    ("uneven.uff", NODES, 0.0),
    ("steps.lvm", CHANNELS, 0.0),
    ("comma.lvm", CHANNELS, 0.0),
];

/// With the feature `parquet`.
const PARQUET: [&str; 4] = [
    "snappy.parquet",
    "zstd.parquet",
    "gzip.parquet",
    "stamps.parquet",
];

const NAMES: [&str; 3] = ["time_s", "force_n", "position_m"];
const FIELDS: [&str; 3] = ["rec.time_s", "rec.force_n", "rec.position_m"];
const MATRIX: [&str; 3] = ["data:1", "data:2", "data:3"];
const NUMBERS: [&str; 3] = ["1", "2", "3"];
const NODES: [&str; 3] = ["time", "1:+Z", "2:+Z"];
const CHANNELS: [&str; 3] = ["time", "force_n", "position_m"];

/// A folder with the record as CSV and as the other files. `None` without Python.
fn bench() -> Option<Bench> {
    let bench = Bench::new();
    bench.write(
        "data.csv",
        csv(&multisine(&(5..=200).collect::<Vec<_>>(), 5, 0.0, 1e-8, 21)),
    );
    let [table, folder] = ["data.csv", ""].map(|name| bench.path(name).display().to_string());
    let modules = "numpy, scipy.io, h5py, pyarrow, pyuff";
    python::numbers_with(modules, "record_files.py", &[&table, &folder], "")?;
    Some(bench)
}

fn identify(bench: &Bench, file: &str, [time, input, output]: [&str; 3]) -> Value {
    bench.json(&format!(
        "identify {file} --time {time} --input {input} --output {output} --period 1000 --out results"
    ))
}

/// Frequency, damping ratio and residue of each mode.
fn modes(answer: &Value) -> Vec<[f64; 3]> {
    let modes = answer["modes"].as_array().expect("modes");
    let figures = ["frequency_hz", "damping_ratio", "residue"];
    modes
        .iter()
        .map(|mode| figures.map(|figure| number(&mode[figure])))
        .collect()
}

#[test]
fn every_file_of_arrays_gives_the_modes_of_the_csv() {
    let Some(bench) = bench() else { return };
    let expected = modes(&identify(&bench, "data.csv", NAMES));
    assert_eq!(expected.len(), STAGE.len());
    let parquet = PARQUET.map(|file| (file, NAMES, 0.0));
    let parquet = parquet.into_iter().filter(|_| cfg!(feature = "parquet"));
    for (file, names, tolerance) in FILES.into_iter().chain(parquet) {
        let answer = identify(&bench, file, names);
        assert_eq!(number(&answer["rate_hz"]), 1000.0, "{file}");
        assert_eq!(answer["times"]["kind"], "regular", "{file}");
        let found = modes(&answer);
        assert_eq!(found.len(), expected.len(), "{file}");
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!(
                (found / expected - 1.0).abs() <= tolerance,
                "{file}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_missing_time_is_answered_with_the_columns_and_the_single_numbers() {
    let Some(bench) = bench() else { return };
    let options = "--input data:2 --output data:3";
    bench
        .run(&format!("identify matrix.mat {options}"))
        .is_refused(&[
            "--time COLUMN",
            "data:1, data:2, data:3",
            "fs = 1000",
            "--rate",
        ]);
    bench
        .run(&format!("identify matrix.mat {options} --time fs"))
        .is_refused(&["`fs`", "the single number 1000", "--rate 1000"]);
}
