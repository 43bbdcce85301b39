//! The region around the response of an identified plant that contains the true response.
//!
//! ```text
//!  P = R V_0 + sum of r_k V(w_k, zeta_k)        V: a mode of residue 1, V_0: a compliance of 1 m/N, through the signal path
//!
//!  |P_true - P| <= U(w) = max(|P_measured - P| + c sigma, c sigma_fit)
//! ```
//!
//! sigma is the standard deviation of the real and of the imaginary part of the measured response, whose error is circular: the
//! measured response lies within r of the true one with the probability 1 - exp(-r^2/(2 sigma^2)), which is 95 % at r = c sigma,
//! c = sqrt(-2 ln 0.05) = 2.448. Such a disc bounds |1 + L| for every direction of the error and without linearisation. (1.96 sigma is the
//! interval of the distance alone, to first order in sigma.) sigma_fit is the largest standard deviation of the response of the fitted
//! parameters in any direction, by their covariance. Outside of the measured band the first term is that at its end.

use nalgebra::{Complex, DMatrix, DVector};

use super::unmodelled::interpolated;
use bench_plant::{FAR_RAD_S, LoopPlant, Mode, SignalPath};

/// Radius of the disc that contains 95 % of a circular normal distribution, in standard deviations of one component.
pub const DISC_SIGMAS_95: f64 = 2.447_746_830_680_816;

/// What is known of the response of an identified plant beside its modes.
#[derive(Clone, Debug)]
pub struct IdentifiedResponse {
    /// Hold, amplifier and delays, with the fitted delay.
    pub path: SignalPath,
    /// R: the compliance in m/N of modes above the band.
    pub remainder_m_per_n: f64,
    /// Covariance of w (rad/s), zeta, r (1/kg) of each mode, of R (m/N) and of the delay (s), in that order.
    pub covariance: DMatrix<f64>,
    /// Rising frequencies in rad/s, and |P_measured - P| + c sigma there in m/A.
    pub deviation: Vec<(f64, f64)>,
}

/// Hold, amplifier, modes, a constant compliance R in m/N, and delays.
pub fn loop_plant(path: &SignalPath, modes: &[Mode], remainder_m_per_n: f64) -> LoopPlant {
    let far = Mode {
        force_gain: remainder_m_per_n * FAR_RAD_S * FAR_RAD_S,
        ..Mode::unit(FAR_RAD_S, 1.0)
    };
    let mut modes = modes.to_vec();
    modes.push(far);
    LoopPlant::of(path, &modes)
}

/// Largest distance of the true response from that of the plant; none by default.
#[derive(Clone, Debug, Default)]
pub struct Uncertainty(Option<Region>);

#[derive(Clone, Debug)]
struct Region {
    /// Each mode, and the response of one with its frequency and damping ratio and the residue 1.
    modes: Vec<(Mode, LoopPlant)>,
    /// The response of a compliance of 1 m/N.
    constant: LoopPlant,
    whole: LoopPlant,
    covariance: DMatrix<f64>,
    deviation: Vec<(f64, f64)>,
}

impl Uncertainty {
    /// The region of a plant with these modes, none of them a free body.
    pub fn of(plant: &IdentifiedResponse, modes: &[Mode]) -> Uncertainty {
        let alone = modes.iter().map(|mode| {
            let unit = Mode::unit(mode.omega_rad_s, mode.damping_ratio);
            (mode.clone(), LoopPlant::of(&plant.path, &[unit]))
        });
        Uncertainty(Some(Region {
            modes: alone.collect(),
            constant: loop_plant(&plant.path, &[], 1.0),
            whole: loop_plant(&plant.path, modes, plant.remainder_m_per_n),
            covariance: plant.covariance.clone(),
            deviation: plant.deviation.clone(),
        }))
    }

    /// Whether the plant is that of a model.
    pub fn is_none(&self) -> bool {
        self.0.is_none()
    }

    /// U in m/A at a frequency in rad/s.
    pub fn at(&self, omega_rad_s: f64) -> f64 {
        let Some(region) = &self.0 else {
            return 0.0;
        };
        let by_fit = DISC_SIGMAS_95 * region.fit_sigma(omega_rad_s);
        by_fit.max(interpolated(&region.deviation, omega_rad_s))
    }
}

impl Region {
    /// The largest standard deviation of the response of the fit in any direction of the complex plane.
    fn fit_sigma(&self, omega_rad_s: f64) -> f64 {
        let gradient = self.gradient(omega_rad_s);
        let re = DVector::from_iterator(gradient.len(), gradient.iter().map(|g| g.re));
        let im = DVector::from_iterator(gradient.len(), gradient.iter().map(|g| g.im));
        let (by_re, by_im) = (&self.covariance * &re, &self.covariance * &im);
        let (a, b, c) = (re.dot(&by_re), im.dot(&by_im), im.dot(&by_re));
        let largest = 0.5 * (a + b) + libm::hypot(0.5 * (a - b), c);
        largest.max(0.0).sqrt()
    }

    /// Derivatives of the response, in the order of the covariance: with G = r/(s^2 + 2 zeta w s + w^2),
    ///
    /// ```text
    ///  dG/dw = -G (2 zeta s + 2 w)/(s^2 + ...)     dG/dzeta = -G 2 w s/(s^2 + ...)     dG/dr = G/r     dP/dtau = -s P
    /// ```
    fn gradient(&self, omega_rad_s: f64) -> Vec<Complex<f64>> {
        let s = Complex::new(0.0, omega_rad_s);
        let mut gradient = Vec::with_capacity(self.covariance.nrows());
        for (mode, alone) in &self.modes {
            let (w, zeta) = (mode.omega_rad_s, mode.damping_ratio);
            let unit = alone.response(omega_rad_s);
            let slope = -unit * mode.residue_per_kg() * mode.resonance(s);
            gradient.push(slope * (s * (2.0 * zeta) + 2.0 * w));
            gradient.push(slope * s * (2.0 * w));
            gradient.push(unit);
        }
        gradient.push(self.constant.response(omega_rad_s));
        gradient.push(-s * self.whole.response(omega_rad_s));
        gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path() -> SignalPath {
        SignalPath {
            period_s: 2e-4,
            amplifier_bandwidth_hz: 1000.0,
            force_constant_n_per_a: 11.0,
            delays_s: vec![2e-4],
            output: bench_plant::OutputKind::Position,
        }
    }

    fn mode(omega_rad_s: f64, damping_ratio: f64, residue_per_kg: f64) -> Mode {
        Mode {
            force_gain: residue_per_kg,
            ..Mode::unit(omega_rad_s, damping_ratio)
        }
    }

    fn modes() -> Vec<Mode> {
        vec![mode(180.0, 0.01, 0.5), mode(520.0, 0.004, -0.2)]
    }

    fn plant(covariance: DMatrix<f64>) -> IdentifiedResponse {
        IdentifiedResponse {
            path: path(),
            remainder_m_per_n: 2e-8,
            covariance,
            deviation: vec![(1.0, 1e-9), (3000.0, 1e-9)],
        }
    }

    /// The response with one parameter moved, in the order of the covariance.
    fn moved(index: usize, step: f64, omega_rad_s: f64) -> Complex<f64> {
        let (mut base, mut modes) = (plant(DMatrix::zeros(8, 8)), modes());
        match index {
            6 => base.remainder_m_per_n += step,
            7 => base.path.delays_s[0] += step,
            k => {
                let mode = &mut modes[k / 3];
                match k % 3 {
                    0 => mode.omega_rad_s += step,
                    1 => mode.damping_ratio += step,
                    _ => mode.force_gain += step,
                }
            }
        }
        loop_plant(&base.path, &modes, base.remainder_m_per_n).response(omega_rad_s)
    }

    #[test]
    fn radius_of_one_uncertain_parameter_is_the_change_of_the_response() {
        let steps = [1e-4, 1e-7, 1e-6, 1e-6, 1e-8, 1e-7, 1e-11, 1e-9];
        for (index, step) in steps.into_iter().enumerate() {
            let mut covariance = DMatrix::zeros(8, 8);
            covariance[(index, index)] = step * step;
            let base = plant(covariance);
            let uncertainty = Uncertainty::of(&base, &modes());
            for w in [60.0, 179.0, 522.0, 900.0] {
                let change = 0.5 * (moved(index, step, w) - moved(index, -step, w)).norm();
                let sigma = uncertainty.0.as_ref().unwrap().fit_sigma(w);
                // The derivatives are those of the continuous mode: sampling, and the mean within a period, change them by less
                // than (w T)^2, 3 % at 900 rad/s. Rounding: 1e-16 of the response over its change.
                assert!(
                    (sigma / change - 1.0).abs() < 0.04,
                    "parameter {index} at {w}: {sigma:e} for {change:e}"
                );
            }
        }
    }

    #[test]
    fn disc_contains_95_percent_of_a_circular_error() {
        // P(|e| < r) = 1 - exp(-r^2/(2 sigma^2)).
        let probability = 1.0 - (-0.5 * DISC_SIGMAS_95 * DISC_SIGMAS_95).exp();
        assert!((probability - 0.95).abs() < 1e-12, "{probability}");
    }

    #[test]
    fn measured_deviation_is_a_lower_limit_of_the_radius_everywhere() {
        let base = plant(DMatrix::zeros(8, 8));
        let uncertainty = Uncertainty::of(&base, &modes());
        for w in [0.1, 50.0, 5000.0] {
            assert!((uncertainty.at(w) / 1e-9 - 1.0).abs() < 1e-12);
        }
        assert_eq!(Uncertainty::default().at(50.0), 0.0);
    }
}
