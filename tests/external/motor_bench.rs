//! An external record of a two-mass motor bench, 20 periods of a multisine (`../shared/data/README.md`; `BENCH_SHARED_DATA` names
//! another folder): antiresonance, resonance, damping and signs, compared with the fit of an independent program to the same file.
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::external::program::{Bench, number};
use crate::external::python;

/// The path of the record; `None` with a message on standard error if it is missing.
fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("BENCH_SHARED_DATA").map_or(beside, PathBuf::from);
    let path = folder.join("motor-bench-multisine.csv");
    if !path.is_file() {
        eprintln!(
            "not tested: {} is missing; BENCH_SHARED_DATA names the folder that has it",
            path.display()
        );
        return None;
    }
    Some(path)
}

/// The result of `bench identify` for the angle of one side, motor or load.
struct Side {
    /// The modes with a residue above 20 % of the largest; smaller ones fit the distortion.
    modes: Vec<Value>,
    answer: Value,
    frf: Vec<Vec<f64>>,
}

fn side(path: &Path, output: &str, options: &str) -> Side {
    let bench = Bench::new();
    let path = path.display();
    let columns = format!("--input current_a --output {output} --time time_s");
    let answer = bench.json(&format!(
        "identify {path} {columns} --period 2500 {options} --out results"
    ));
    let residue = |mode: &Value| number(&mode["residue"]).abs();
    let all = answer["modes"].as_array().expect("modes");
    let largest = all.iter().map(residue).fold(0.0, f64::max);
    let modes = all
        .iter()
        .filter(|mode| residue(mode) > 0.2 * largest)
        .cloned()
        .collect();
    let text = bench.read(answer["frf_csv"].as_str().expect("a path"));
    let row = |line: &str| {
        line.split(',')
            .map(|cell| cell.parse().expect("a number"))
            .collect()
    };
    Side {
        modes,
        frf: text.lines().skip(1).map(row).collect(),
        answer,
    }
}

impl Side {
    /// |H| at a frequency.
    fn magnitude(&self, hz: f64) -> f64 {
        self.frf.iter().find(|row| row[0] == hz).expect("a line")[1]
    }

    /// The frequency in a range where sign |H| is smallest: the minimum of |H| with 1, the maximum with -1.
    fn extreme_hz(&self, from_hz: f64, to_hz: f64, sign: f64) -> f64 {
        let within = self
            .frf
            .iter()
            .filter(|row| (from_hz..=to_hz).contains(&row[0]));
        within
            .min_by(|a, b| (sign * a[1]).total_cmp(&(sign * b[1])))
            .expect("lines")[0]
    }
}

/// Compares the residue of the rigid-body mode and frequency, damping and residue of the flexible mode with those of the other program.
fn compare(path: &Path, output: &str, side: &Side, sign: &str) {
    assert_eq!(side.modes.len(), 2, "{}", side.answer["modes"]);
    let (rigid, flexible) = (&side.modes[0], &side.modes[1]);
    assert!(
        number(&rigid["frequency_hz"]) < 6.0,
        "the rigid-body mode with friction: {rigid}"
    );
    assert_eq!(
        (rigid["sign"].as_str(), flexible["sign"].as_str()),
        (Some("+"), Some(sign))
    );
    for mode in &side.modes {
        assert!(number(&mode["sign_error_probability"]) < 1e-6, "{mode}");
    }
    let text = path.display().to_string();
    let Some(reference) = python::numbers("motor_bench.py", &[&text, output], "") else {
        return;
    };
    let distortion = number(&side.answer["distortion_ratio"]) / reference[4][0];
    assert!((0.5..2.0).contains(&distortion), "{output}: {distortion}");
    // A sum of modes does not describe friction and play. They bias the two programs differently, because of different weights; both treat
    // the residual as noise. The probability that one of eight differences exceeds 3 sigma is 1/50.
    let compared = [
        (rigid, "residue"),
        (flexible, "frequency_hz"),
        (flexible, "damping_ratio"),
        (flexible, "residue"),
    ];
    for ((mode, name), row) in compared.into_iter().zip(&reference) {
        let (value, sigma) = (number(&mode[name]), number(&mode[&format!("{name}_sigma")]));
        let bound = 3.0 * sigma.hypot(row[1]);
        eprintln!(
            "{output} {name}: {value} +- {:.2e}, by scipy {} +- {:.2e}",
            2.0 * sigma,
            row[0],
            2.0 * row[1]
        );
        assert!(
            (value - row[0]).abs() < bound,
            "{output} {name}: {value} +- {sigma}, by scipy {row:?}"
        );
        assert!(
            sigma > 0.0 && sigma < 0.2 * value.abs(),
            "{output} {name}: {value} +- {sigma}"
        );
    }
}

#[test]
fn residues_have_equal_signs_at_the_motor_and_opposite_signs_at_the_load() {
    check("--skip-periods 2 --band 11:250", 17);
}

/// The excited lines and the period in which the bench settles are found from the record.
#[test]
fn motor_bench_without_band_and_skipped_periods_gives_the_same() {
    check("", 18);
}

fn check(options: &str, periods: u64) {
    let Some(path) = data() else { return };
    let [motor, load] =
        ["motor_angle_rad", "load_angle_rad"].map(|output| side(&path, output, options));
    // The README of the data states these values of the periodic average, with three digits.
    for (side, hz, expected) in [
        (&motor, 40.0, 1.03e-3),
        (&load, 40.0, 2.25e-3),
        (&motor, 100.0, 8.83e-4),
        (&load, 100.0, 3.62e-4),
    ] {
        assert!(
            (side.magnitude(hz) / expected - 1.0).abs() < 0.006,
            "{hz} Hz: {}",
            side.magnitude(hz)
        );
    }
    assert!(
        (51.0..=55.0).contains(&motor.extreme_hz(40.0, 65.0, 1.0)),
        "antiresonance at the motor"
    );
    let zeros_hz = |side: &Side| -> Vec<f64> {
        let zeros = side.answer["zeros"].as_array().expect("zeros");
        let hz = |zero: &Value| {
            number(&zero["re_rad_s"]).hypot(number(&zero["im_rad_s"])) / std::f64::consts::TAU
        };
        zeros
            .iter()
            .map(hz)
            .filter(|hz| (20.0..120.0).contains(hz))
            .collect()
    };
    assert!(
        matches!(zeros_hz(&motor)[..], [hz] if (52.0..55.0).contains(&hz)),
        "{:?}",
        zeros_hz(&motor)
    );
    assert_eq!(
        zeros_hz(&load),
        [0.0; 0],
        "between modes of opposite residues there is no zero"
    );
    for side in [&motor, &load] {
        assert!(
            (75.0..=77.0).contains(&side.extreme_hz(60.0, 90.0, -1.0)),
            "resonance"
        );
        assert_eq!(side.answer["periods"], periods);
        assert_eq!(side.answer["frequencies"], 240);
        // The errors by friction and play are more than 100 times the noise of 17 periods: the verdict is undecided, with the reason.
        assert!(number(&side.answer["fit_chi2_per_freedom"]) > 10.0);
        assert_eq!(side.answer["cnmp"], "undecided");
        assert!(
            side.answer["why"]
                .as_str()
                .is_some_and(|why| why.contains("reduced chi-square"))
        );
    }
    compare(&path, "motor_angle_rad", &motor, "+");
    compare(&path, "load_angle_rad", &load, "-");
}
