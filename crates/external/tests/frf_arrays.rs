//! Frequency responses in files of arrays: units are stated, never guessed.

use std::f64::consts::TAU;
use std::path::PathBuf;

use bench_external::frf::{ImportedFrf, read};
use num_complex::Complex;

/// A mode at 30 Hz with a scatter of one part in 10 000, which gives the standard deviations.
fn stage(hz: f64) -> Complex<f64> {
    let x = hz / 30.0;
    let mode = Complex::from(1e-4) / Complex::new(1.0 - x * x, 0.04 * x);
    mode * (1.0 + 1e-4 * (1e3 * hz * hz).sin())
}

fn grid() -> Vec<f64> {
    (1..=200).map(|k| 0.5 * f64::from(k)).collect()
}

/// A file in a folder of its own.
struct File {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl File {
    fn new(bytes: impl AsRef<[u8]>) -> File {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("response");
        std::fs::write(&path, bytes).expect("a file");
        File {
            path,
            _folder: folder,
        }
    }

    fn response(&self) -> ImportedFrf {
        read(&self.path, None).unwrap_or_else(|error| panic!("{error}"))
    }

    fn refusal(&self) -> String {
        read(&self.path, None).expect_err("refused").to_string()
    }
}

/// An NPY file with the fields of a name for the frequency and a complex response.
fn npy(name: &str, per_hz: f64) -> Vec<u8> {
    let grid = grid();
    let count = grid.len();
    let header = format!(
        "{{'descr': [('{name}', '<f8'), ('response', '<c16')], 'fortran_order': False, 'shape': ({count},), }}\n"
    );
    let length = (header.len() as u16).to_le_bytes();
    let row = |hz: &f64| {
        let h = stage(*hz);
        [per_hz * hz, h.re, h.im].map(f64::to_le_bytes).concat()
    };
    let data: Vec<u8> = grid.iter().flat_map(row).collect();
    [&b"\x93NUMPY\x01\0"[..], &length, header.as_bytes(), &data].concat()
}

/// A universal file with a response for each ID; units of frequency, numerator and denominator.
fn universal(ids: &[&str], [frequency, numerator, denominator]: [&str; 3]) -> String {
    let axis =
        |code: u32, unit: &str| format!("{code:10}    0    0    0 {:<20} {unit:<20}\n", "NONE");
    let axes = axis(18, frequency) + &axis(8, numerator) + &axis(0, denominator) + &axis(0, "NONE");
    let grid = grid();
    let rows: Vec<String> = grid
        .iter()
        .map(|hz| {
            format!(
                "{hz:13.5}{:20.11E}{:20.11E}\n",
                stage(*hz).re,
                stage(*hz).im
            )
        })
        .collect();
    let dataset = |id: &&str| {
        let nodes = format!(" NONE      {:10}   3 NONE               1   3", 1);
        format!(
            "    -1\n    58\n{id}\nNONE\nNONE\nNONE\nNONE\n    4         0    0         0{nodes}\n\
             {:10}{:10}{:10} 0.0 0.0 0.0\n{axes}{}    -1\n",
            6,
            grid.len(),
            0,
            rows.concat()
        )
    };
    ids.iter().map(dataset).collect()
}

#[track_caller]
fn is_stage(found: &ImportedFrf, tolerance: f64) {
    assert_eq!(found.frf.frequency_hz.len(), grid().len());
    for (k, hz) in grid().iter().enumerate() {
        assert!((found.frf.frequency_hz[k] / hz - 1.0).abs() < 1e-14);
        let ratio = found.frf.response[k] / stage(*hz);
        assert!((ratio - 1.0).norm() <= tolerance, "{hz} Hz: {ratio}");
    }
}

#[test]
fn units_of_frequencies_are_those_of_the_names_or_stated_as_assumed() {
    for (name, per_hz, assumptions) in [
        ("frequency_hz", 1.0, 0),
        ("f_khz", 1e-3, 0),
        ("frequency_rad_s", TAU, 0),
        ("omega", TAU, 0),
        ("f", 1.0, 1),
    ] {
        let found = File::new(npy(name, per_hz)).response();
        is_stage(&found, 0.0);
        assert_eq!(
            found.assumptions.len(),
            assumptions,
            "{name}: {:?}",
            found.assumptions
        );
    }
}

#[test]
fn response_of_a_universal_file_is_read() {
    // The ordinates have 12 digits.
    let file = File::new(universal(&["H"], ["Hz", "m", "A"]));
    is_stage(&file.response(), 1e-11);
    let file = File::new(universal(&["H"], ["NONE", "NONE", "NONE"]));
    is_stage(&file.response(), 1e-11);
}

#[test]
fn other_units_and_several_responses_are_refused() {
    for (ids, units, words) in [
        (&["H"][..], ["rpm", "m", "A"], "`rpm`, not Hz or rad/s"),
        (&["H"], ["Hz", "m", "N"], "not in m/A"),
        (&["H"], ["Hz", "mm", "A"], "not in m/A"),
        (&["H"], ["Hz", "mm", "NONE"], "not in m/A"),
        (&["H"], ["Hz", "mm/A", "NONE"], "not in m/A"),
        (
            &["H", "G"],
            ["Hz", "m", "A"],
            "2 frequency responses (H 1:+Z, G 1:+Z)",
        ),
        (&[], ["Hz", "m", "A"], "no frequency response"),
    ] {
        let text = universal(ids, units);
        let text = if text.is_empty() {
            "    -1\n   151\n    -1\n".into()
        } else {
            text
        };
        let why = File::new(text).refusal();
        assert!(why.contains(words), "`{words}` is not in {why}");
    }
}
