//! The response of the sections against 60 digits (mpmath) and python-control.

use bench_control::{ControllerText, continuous_response};
use bench_test_support::python;
use nalgebra::Complex;

const UM_PER_M: f64 = 1e6;

/// A line of the script.
struct Point {
    index: usize,
    rate_hz: f64,
    omega_rad_s: f64,
    /// The response with 60 digits.
    exact: Complex<f64>,
    /// The response of python-control.
    control: Complex<f64>,
    /// Relative error from the rounding of the numbers.
    rounding: f64,
    stable: bool,
}

impl Point {
    fn of(line: &[f64]) -> Point {
        let &[
            index,
            rate_hz,
            omega_rad_s,
            re,
            im,
            control_re,
            control_im,
            rounding,
            stable,
        ] = line
        else {
            panic!("a line has nine numbers: {line:?}");
        };
        Point {
            index: index as usize,
            rate_hz,
            omega_rad_s,
            exact: Complex::new(re, im),
            control: Complex::new(control_re, control_im),
            rounding,
            stable: stable == 1.0,
        }
    }
}

/// C in amperes per micrometre as the loop uses it.
fn response(text: &ControllerText, point: &Point) -> Result<Complex<f64>, String> {
    let failed = |e: bench_control::ControllerError| e.to_string();
    if point.rate_hz == 0.0 {
        let sections = text.sections(5000.0).map_err(failed)?;
        let s = Complex::new(0.0, point.omega_rad_s);
        return Ok(continuous_response(&sections, s) / UM_PER_M);
    }
    let period_s = 1.0 / point.rate_hz;
    let law = text.design(point.rate_hz).map_err(failed)?.law(period_s);
    let z = Complex::from_polar(1.0, point.omega_rad_s * period_s);
    Ok(law.linear().expect("a linear law").response(z) / UM_PER_M)
}

fn points(mode: &str, folder: &std::path::Path) -> Option<Vec<Point>> {
    let folder = folder.display().to_string();
    let lines = python::numbers_with(
        "control, mpmath, scipy.signal",
        "controllers.py",
        &[mode, &folder],
        "",
    )?;
    Some(lines.iter().map(|line| Point::of(line)).collect())
}

fn text(folder: &std::path::Path, index: usize) -> ControllerText {
    ControllerText {
        name: format!("{index}.toml"),
        text: std::fs::read_to_string(folder.join(format!("{index}.toml")))
            .expect("written by the script"),
    }
}

/// Tolerance of the response of the sections. They have the roots of the numbers as given: what remains is the rounding of their own
/// coefficients, 6e-10 at most (six pairs of 30 rad/s at 5 kHz: 16 roundings of 2.2e-16 over (w T)^2 = 4e-5 each). Roots of
/// matrices, and a discrete integrator that the polynomial has beside z = 1, differ by the rounding of the numbers.
fn tolerance(text: &str, point: &Point) -> f64 {
    let is_exact = text.contains("[zpk]") || (text.contains("[tf]") && point.rate_hz == 0.0);
    if is_exact {
        1e-9
    } else {
        1e-9 + point.rounding
    }
}

/// A controller is accepted if its response is right to a millionth from a tenth of its slowest pole, which is faster than 30 rad/s.
/// Below, an integrator that rounding has moved is one again, and the response differs by the rounding of the numbers.
fn limit(tolerance: f64, omega_rad_s: f64) -> f64 {
    if omega_rad_s < 3.0 {
        tolerance
    } else {
        tolerance.min(1e-6)
    }
}

#[test]
fn sections_of_random_controllers_have_the_response_of_the_original() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(points) = points("random", folder.path()) else {
        return;
    };
    let (mut accepted, mut refused) = (0, 0);
    for point in &points {
        let text = text(folder.path(), point.index);
        match response(&text, point) {
            Ok(ours) => {
                accepted += 1;
                let tolerance = tolerance(&text.text, point);
                let difference = (ours / point.exact - 1.0).norm();
                assert!(
                    difference < limit(tolerance, point.omega_rad_s),
                    "{}: {difference} at {}\n{}",
                    point.index,
                    point.omega_rad_s,
                    text.text
                );
                let difference = (ours - point.control).norm() / point.exact.norm();
                assert!(
                    difference < 1e-9 + 2.0 * point.rounding,
                    "{}: {difference}",
                    point.index
                );
            }
            Err(why) => {
                refused += 1;
                // Only an unstable controller may be refused, or one that rounding of its numbers changes noticeably. Zeros and poles
                // are always reproduced.
                let sensitive = points.iter().filter(|other| other.index == point.index);
                let worst = sensitive.map(|other| other.rounding).fold(0.0, f64::max);
                assert!(
                    !text.text.contains("[zpk]") && (!point.stable || worst > 1e-9),
                    "{}: {why}\n{}",
                    point.index,
                    text.text
                );
            }
        }
    }
    println!("{accepted} responses compared, {refused} of refused controllers");
    assert_eq!(accepted + refused, 12 * 2 * 4 * 2 * 5);
    assert!(accepted > 800, "{accepted}");
}

#[test]
fn the_fast_controller_is_that_of_the_thesis_in_every_form() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(points) = points("fast", folder.path()) else {
        return;
    };
    for point in &points {
        let ours = response(&text(folder.path(), point.index), point).expect("accepted");
        // As above; the matrices of the controllable form are sensitive to 1e-9.
        let tolerance = 1e-11 + point.rounding;
        let difference = (ours / point.exact - 1.0).norm();
        assert!(
            difference < tolerance.min(1e-7),
            "{}: {difference} at {}",
            point.index,
            point.omega_rad_s
        );
    }
    assert_eq!(points.len(), 28);
}
