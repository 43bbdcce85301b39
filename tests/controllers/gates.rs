//! Which controllers are accepted: those whose sections have their response to a millionth of its largest magnitude.

use std::collections::BTreeMap;

use bench_control::{GainUnit, ImportOptions, Imported, import};
use bench_test_support::python;
use nalgebra::Complex;

use crate::controllers::program::Bench;

/// A line of the script: the response of the numbers in a file with 60 digits.
struct Point {
    index: usize,
    omega_rad_s: f64,
    exact: Complex<f64>,
    /// Largest magnitude in the band.
    largest: f64,
    /// Whether all poles of the numbers are inside of the unit circle, or at exactly z = 1.
    is_stable: bool,
    /// 0: num/den, 1: zeros and poles, 2: matrices.
    form: f64,
}

fn points(mode: &str, folder: &std::path::Path) -> Option<BTreeMap<usize, Vec<Point>>> {
    let folder = folder.display().to_string();
    let modules = "control, mpmath, scipy.signal";
    let lines = python::numbers_with(modules, "controllers.py", &[mode, &folder], "")?;
    let mut files: BTreeMap<usize, Vec<Point>> = BTreeMap::new();
    for line in &lines {
        let &[index, omega_rad_s, re, im, largest, stable, form] = line.as_slice() else {
            panic!("a line has seven numbers: {line:?}");
        };
        let point = Point {
            index: index as usize,
            omega_rad_s,
            exact: Complex::new(re, im),
            largest,
            is_stable: stable == 1.0,
            form,
        };
        files.entry(point.index).or_default().push(point);
    }
    Some(files)
}

fn imported(folder: &std::path::Path, index: usize) -> Result<Imported, String> {
    let options = ImportOptions {
        gain_unit: GainUnit::AmperesPerMicrometre,
        domain: None,
        variable: None,
    };
    let path = folder.join(format!("{index}.npz"));
    import(&path, "x", &options).map_err(|e| e.to_string())
}

fn assert_true(imported: &Imported, points: &[Point]) {
    for point in points {
        let difference = (imported.cascade.response(point.omega_rad_s) - point.exact).norm();
        let relative = difference / point.largest;
        assert!(
            relative < 1e-6,
            "{}: {relative:e} at {} rad/s",
            point.index,
            point.omega_rad_s
        );
    }
}

#[test]
fn sixty_butterworth_filters_are_accepted_as_polynomials_and_matrices() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(files) = points("butterworth", folder.path()) else {
        return;
    };
    assert_eq!(files.len(), 120);
    for (index, points) in &files {
        let imported = imported(folder.path(), *index);
        let imported = imported.unwrap_or_else(|why| panic!("{index}: {why}"));
        assert_true(&imported, points);
    }
}

/// PI, lead, notches and a low-pass at 1 to 20 kHz, by Tustin's rule and with a zero-order hold. A controller whose saved polynomial has
/// a pole outside of the unit circle may be refused; the message must then say that the pole is not an integrator.
#[test]
fn forty_controllers_with_an_integrator_are_accepted_unless_their_numbers_are_unstable() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(files) = points("integrators", folder.path()) else {
        return;
    };
    assert_eq!(files.len(), 40 * 2 * 3);
    let mut refused = 0;
    for (index, points) in &files {
        match imported(folder.path(), *index) {
            Ok(imported) => assert_true(&imported, points),
            Err(why) => {
                refused += 1;
                let first = &points[0];
                assert!(!first.is_stable && first.form != 1.0, "{index}: {why}");
                assert!(why.contains("not an integrator"), "{index}: {why}");
            }
        }
    }
    println!("{refused} of {} refused", files.len());
    assert!(refused < 40, "{refused}");
}

#[test]
fn static_gain_as_matrices_is_a_gain_in_every_format() {
    let bench = Bench::new();
    let gain = "title = \"gain\"\n[ss]\ngain_unit = \"A/m\"\na = []\nb = []\nc = []\nd = 2e4\n";
    bench.write("gain.toml", gain);
    bench.write(
        "a.json",
        r#"{"A": [], "B": [], "C": [], "D": 2e4, "Ts": 0}"#,
    );
    bench.write(
        "b.json",
        r#"{"A": [[]], "B": [[]], "C": [[]], "D": [[2e4]], "Ts": 0.0002}"#,
    );
    let folder = bench.path("").display().to_string();
    let mut files = vec!["a.json", "b.json"];
    let modules = "control, mpmath, scipy.signal";
    if python::numbers_with(modules, "controllers.py", &["gain", &folder], "").is_some() {
        files.extend(["gain.mat", "gain.npz"]);
    }
    let expected = bench.run("margins --controller gain.toml --json");
    assert!(expected.code <= 1, "{expected:?}");
    for file in files {
        let report = bench.json(&format!(
            "controller import {file} --gain-unit A/m --out {file}.toml"
        ));
        assert_eq!(report["order"], 0);
        // 2e4 A/m are 0.02 A/um.
        let gain = report["sections"][0]["numerator"][0].as_f64();
        assert!((gain.expect("a gain") - 0.02).abs() < 1e-16, "{report}");
        let found = bench.run(&format!("margins --controller {file}.toml --json"));
        assert_eq!(
            found.json()["modulus_margin"],
            expected.json()["modulus_margin"]
        );
    }
    bench.write(
        "zero.json",
        r#"{"A": [], "B": [], "C": [], "D": 0, "Ts": 0}"#,
    );
    let answer = bench.run("controller import zero.json --gain-unit A/m --json");
    answer.is_refused(&["response is 0"]);
}
