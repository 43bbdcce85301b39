//! The response of the sections in the JSON object of `bench controller import`.

use nalgebra::Complex;
use serde_json::Value;

use crate::controllers::program::{Bench, number};

fn polynomial(falling: &Value, v: Complex<f64>) -> Complex<f64> {
    let coefficients = falling.as_array().expect("coefficients").iter();
    coefficients.fold(Complex::new(0.0, 0.0), |value, c| value * v + number(c))
}

/// The product of the sections in A/um at s or z.
pub fn of_sections(report: &Value, v: Complex<f64>) -> Complex<f64> {
    let sections = report["sections"].as_array().expect("sections").iter();
    let responses =
        sections.map(|s| polynomial(&s["numerator"], v) / polynomial(&s["denominator"], v));
    responses.product()
}

/// Imports a JSON object with the unit A/um.
pub fn imported(bench: &Bench, content: &Value, options: &str) -> Value {
    bench.write("c.json", content.to_string());
    let _ = std::fs::remove_file(bench.path("c.toml"));
    bench.json(&format!(
        "controller import c.json --gain-unit A/um --out c.toml {options}"
    ))
}

/// Asserts that the sections have the response `expected`, to rounding, at a frequency in rad/s.
pub fn assert_response(
    report: &Value,
    omega_rad_s: f64,
    expected: impl Fn(Complex<f64>) -> Complex<f64>,
) {
    let v = match report["rate_hz"].as_f64() {
        None => Complex::new(0.0, omega_rad_s),
        Some(rate_hz) => Complex::from_polar(1.0, omega_rad_s / rate_hz),
    };
    let (found, expected) = (of_sections(report, v), expected(v));
    let difference = (found / expected - 1.0).norm();
    // The coefficients of the sections are rounded: 1e-16 over (w T)^2 = 4e-4 at 100 rad/s and 5 kHz.
    assert!(difference < 1e-11, "{omega_rad_s}: {difference}\n{report}");
}
