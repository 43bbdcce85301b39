//! The variance of the error in closed loop: the motion of the floor, reduced by S, and the noise of the probe, passed by T.
//!
//! ```text
//!  sigma^2 = integral of |S|^2 Phi_d + |T|^2 Phi_n over w from 0 to pi/T
//!  sigma_i^2 = integral of |C S|^2 (Phi_d + Phi_n): the current
//! ```

use super::cascade::Cascade;
use super::sampled::SampledPlant;

/// The standard deviation of the error in metres.
pub fn sigma_m(plant: &SampledPlant, cascade: &Cascade) -> f64 {
    let points = plant.variances.iter().enumerate();
    let terms = points.map(|(point, variances)| {
        let l = plant.response[point] * cascade.response(plant.warped[point]);
        let sensitivity = (l + 1.0).inv();
        sensitivity.norm_sqr() * variances.disturbance_m2
            + (l * sensitivity).norm_sqr() * variances.noise_m2
    });
    terms.sum::<f64>().sqrt()
}

/// The derivatives of -ln sigma: with dS = -S T dlnC and dT = S T dlnC,
/// d|S|^2 = -2 |S|^2 Re(T dlnC), d|T|^2 = 2 |T|^2 Re(S dlnC).
pub fn sigma_gradient(plant: &SampledPlant, cascade: &Cascade) -> Vec<f64> {
    let mut gradient = vec![0.0; cascade.parameters().len()];
    for (point, variances) in plant.variances.iter().enumerate() {
        let l = plant.response[point] * cascade.response(plant.warped[point]);
        let sensitivity = (l + 1.0).inv();
        let complementary = l * sensitivity;
        let weight = complementary * (sensitivity.norm_sqr() * variances.disturbance_m2)
            - sensitivity * (complementary.norm_sqr() * variances.noise_m2);
        let log = cascade.log_gradient(plant.warped[point]);
        for (sum, derivative) in gradient.iter_mut().zip(log) {
            *sum += (weight * derivative).re;
        }
    }
    let sigma_m = sigma_m(plant, cascade);
    gradient
        .iter()
        .map(|sum| sum / (sigma_m * sigma_m))
        .collect()
}

/// The standard deviation of the current in A: the disturbance and the noise, both passed by C S.
pub fn current_sigma_a(plant: &SampledPlant, cascade: &Cascade) -> f64 {
    let points = plant.variances.iter().enumerate();
    let terms = points.map(|(point, variances)| {
        let controller = cascade.response(plant.warped[point]);
        let sensitivity = (plant.response[point] * controller + 1.0).inv();
        (controller * sensitivity).norm_sqr() * (variances.disturbance_m2 + variances.noise_m2)
    });
    terms.sum::<f64>().sqrt()
}

/// The derivatives of -ln sigma of the current: d ln(C S) = S dlnC, so d|C S|^2 = 2 |C S|^2 Re(S dlnC).
pub fn current_sigma_gradient(plant: &SampledPlant, cascade: &Cascade) -> Vec<f64> {
    let mut gradient = vec![0.0; cascade.parameters().len()];
    let mut variance_a2 = 0.0;
    for (point, variances) in plant.variances.iter().enumerate() {
        let controller = cascade.response(plant.warped[point]);
        let sensitivity = (plant.response[point] * controller + 1.0).inv();
        let part_a2 =
            (controller * sensitivity).norm_sqr() * (variances.disturbance_m2 + variances.noise_m2);
        variance_a2 += part_a2;
        let log = cascade.log_gradient(plant.warped[point]);
        for (sum, derivative) in gradient.iter_mut().zip(log) {
            *sum += part_a2 * (sensitivity * derivative).re;
        }
    }
    gradient.iter().map(|sum| -sum / variance_a2).collect()
}
