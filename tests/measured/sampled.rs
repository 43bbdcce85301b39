//! The response of a model as if it were measured.

use bench_base::units::{hz, rad_s};
use bench_config::{Config, Source, load};
use bench_control::ClosedLoop;
use bench_control::measured::ResponsePoint;
use bench_identify::{Frf, FrfPoint};
use nalgebra::Complex;

/// The default configuration with some settings.
pub fn config(sets: &[&str]) -> Config {
    load(&Source {
        sets: sets.iter().map(|set| set.to_string()).collect(),
        ..Source::default()
    })
    .expect("valid settings")
}

/// The plant of a model as an FRF between two frequencies: at those at which the model is evaluated, with a relative error of 1e-9
/// that is not there.
pub fn frf(model: &ClosedLoop, (low_hz, high_hz): (f64, f64)) -> Frf {
    let mut frf = Frf::default();
    for w in model.frequencies(rad_s(low_hz), rad_s(high_hz)) {
        let response = model.sampled_plant(w);
        frf.push(FrfPoint {
            frequency_hz: hz(w),
            response,
            coherence: 1.0,
            variance: (1e-9 * response.norm()).powi(2),
            resolution_hz: 0.01 * hz(w),
        });
    }
    frf
}

/// The points of a response with a constant relative standard deviation E|dP/P|^2 = sigma^2. Errors of different points are
/// independent.
pub fn points(
    omega_rad_s: &[f64],
    sigma: f64,
    response: impl Fn(f64) -> Complex<f64>,
) -> Vec<ResponsePoint> {
    let point = |&w: &f64| ResponsePoint {
        omega_rad_s: w,
        response: response(w),
        variance: (sigma * response(w).norm()).powi(2),
        resolution_rad_s: 0.0,
    };
    omega_rad_s.iter().map(point).collect()
}
