//! The lower bound of the modulus margin of a measured loop.
use bench_control::ClosedLoop;
use bench_control::measured::{LowerMargin, MeasuredLoop, ResponsePoint, Stability};
use bench_experiment::closed_loop;

use crate::certificate::stage::config;

/// The bound for exact points of the model over a band in rad/s, said to have a relative error.
fn bound(model: &ClosedLoop, band_rad_s: (f64, f64), relative: f64) -> LowerMargin {
    let frequencies = model.frequencies(band_rad_s.0, band_rad_s.1);
    let points: Vec<ResponsePoint> = frequencies
        .iter()
        .map(|w| {
            let response = model.sampled_plant(*w);
            ResponsePoint {
                omega_rad_s: *w,
                response,
                // Both components together.
                variance: 2.0 * (relative * response.norm()).powi(2),
                resolution_rad_s: 1e-9,
            }
        })
        .collect();
    let law = |w: f64| model.law_response(w);
    let measured = MeasuredLoop::new(&points, &law, &frequencies).expect("finite points");
    LowerMargin::of(&measured, model).expect("poles of the law")
}

#[test]
fn bound_of_exact_points_is_the_margin_of_the_model_inside_and_outside_of_the_band() {
    let model = closed_loop(&config(&[])).expect("a loop");
    let margins = model.margins();
    // The smallest distance is at 387 rad/s: within the first band, below the second and above the third.
    for band_rad_s in [(50.0, 3000.0), (450.0, 3000.0), (50.0, 300.0)] {
        let found = bound(&model, band_rad_s, 0.0);
        assert!(
            (found.margin - margins.modulus_margin).abs() < 1e-3,
            "{band_rad_s:?}: {found:?}"
        );
        let at_rad_s = std::f64::consts::TAU * found.at_hz;
        assert!(
            (at_rad_s / margins.sensitivity_peak_rad_s - 1.0).abs() < 0.02,
            "{band_rad_s:?}: {found:?}"
        );
        assert_eq!(found.stability, Stability::Stable);
    }
}

#[test]
fn bound_is_below_the_margin_by_its_uncertainty() {
    let model = closed_loop(&config(&[])).expect("a loop");
    let band_rad_s = (50.0, 3000.0);
    let exact = bound(&model, band_rad_s, 0.0).margin;
    // A parabola over three points or more has an error between a part of that of a point and all of it.
    let relative = 0.05;
    let noisy = bound(&model, band_rad_s, relative).margin;
    let frequencies = model.frequencies(band_rad_s.0, band_rad_s.1);
    let pointwise = frequencies.iter().map(|w| {
        let loop_gain = model.sampled_loop(*w);
        (loop_gain + 1.0).norm() - 1.96 * relative * loop_gain.norm()
    });
    let all = pointwise.fold(f64::INFINITY, f64::min);
    assert!(
        noisy < exact - 1e-3 && noisy > all - 0.01,
        "{exact} {noisy} {all}"
    );
}
