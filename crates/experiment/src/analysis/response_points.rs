//! A measured FRF as points of a loop.

use nalgebra::Complex;

use bench_base::units::rad_s;
use bench_control::measured::{MeasuredLoop, MeasuredLoopError, MeasuredMargins, ResponsePoint};
use bench_identify::Frf;
use bench_plant::SignalPath;

/// The margins of a measured L, without a model.
///
/// # Errors
/// Less than three points.
pub(super) fn margins_of_loop(loop_gain: &Frf) -> Result<MeasuredMargins, MeasuredLoopError> {
    let points: Vec<ResponsePoint> = (0..loop_gain.len()).map(|k| point(loop_gain, k)).collect();
    let law = |_| Complex::new(1.0, 0.0);
    Ok(MeasuredMargins::of(&MeasuredLoop::new(&points, &law, &[])?))
}

/// The points of a measured plant as the loop sees it. The FRF refers to readings of the mean age; the loop uses the newest reading
/// of a probe with its own clock, whose age varies.
pub(crate) fn points(frf: &Frf, path: &SignalPath) -> Vec<ResponsePoint> {
    let points = (0..frf.len()).map(|k| point(frf, k));
    points
        .map(|point| {
            let factor = roll_off(path, point.omega_rad_s);
            ResponsePoint {
                response: point.response * factor,
                variance: point.variance * factor.norm_sqr(),
                ..point
            }
        })
        .collect()
}

/// The mean of exp(-j w delay) over the delays of a path, over that of the mean delay.
pub(crate) fn roll_off(path: &SignalPath, omega_rad_s: f64) -> Complex<f64> {
    let count = path.delays_s.len() as f64;
    let mean_s = path.delays_s.iter().sum::<f64>() / count;
    let delays = path.delays_s.iter();
    let sum: Complex<f64> = delays
        .map(|delay_s| Complex::from_polar(1.0, -omega_rad_s * (delay_s - mean_s)))
        .sum();
    sum / count
}

fn point(frf: &Frf, k: usize) -> ResponsePoint {
    ResponsePoint {
        omega_rad_s: rad_s(frf.frequency_hz[k]),
        response: frf.response[k],
        variance: variance(frf, k),
        resolution_rad_s: rad_s(frf.resolution_hz[k]),
    }
}

/// E|error|^2: twice the variance of the magnitude.
pub(crate) fn variance(frf: &Frf, k: usize) -> f64 {
    2.0 * frf.magnitude_sigma[k] * frf.magnitude_sigma[k]
}
