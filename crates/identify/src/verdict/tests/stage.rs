//! Stages with zeros in closed form.
//!
//! All modes have the same damping coefficient c = 2 zeta_k w_k, so that G is a rational function of u = s^2 + c s:
//!
//! ```text
//! G = R + sum of r_k/(u + w_k^2) = R prod of (u - u_i) / prod of (u + w_k^2)
//! r_k = R prod of (-w_k^2 - u_i) / prod over j != k of (w_j^2 - w_k^2)
//! ```
//!
//! Each u_i gives two zeros, s and -c - s. A pair x +- j y therefore has the companion -(c + x) +- j y.

use nalgebra::{Complex, DMatrix};

use crate::FrfDatum;
use crate::modal::{MeasurementChain, ModalFit, ModalParameters, Parameter};
use crate::verdict::{Certainty, Verdict, VerdictInput, verdict};
use bench_plant::zeros::ModalTerm;

/// c in rad/s: damping ratios of about 1 % at 100 rad/s.
pub(super) const DAMPING_RAD_S: f64 = 2.0;
/// R in m/N.
pub(super) const REMAINDER: f64 = 1e-4;
/// Imaginary part of the pairs of zeros in rad/s, between the modes at 100 and 110 rad/s.
pub(super) const PAIR_RAD_S: f64 = 105.0;
/// Upper limit of the verdict in rad/s, above all modes.
pub(super) const UP_TO_RAD_S: f64 = 230.0;
/// The lowest of the frequencies, which are 1 rad/s apart: too far for them to be merged. No limit of a band is one of them.
pub(super) const FIRST_RAD_S: f64 = 20.5;
const FREQUENCIES: usize = 220;
/// E|error of G|^2 in (m/N)^2 without noise: every datum is significant.
const NO_NOISE: f64 = 1e-30;
/// E|error of G|^2 in (m/N)^2 that hides every response.
const ALL_NOISE: f64 = 1.0;

/// A sum of modes with a remainder.
pub(super) struct Stage {
    omega_rad_s: Vec<f64>,
    /// The zeros u_i, as many as modes.
    roots: Vec<Complex<f64>>,
}

/// s^2 + c s.
pub(super) fn u(s: Complex<f64>) -> Complex<f64> {
    s * (s + DAMPING_RAD_S)
}

/// The zero with a real part, above the real axis.
pub(super) fn pair(re_rad_s: f64) -> Complex<f64> {
    Complex::new(re_rad_s, PAIR_RAD_S)
}

impl Stage {
    /// Modes of opposite signs at 100 and 110 rad/s; zeros re +- 105 j and -(c + re) +- 105 j.
    pub(super) fn with_pair(re_rad_s: f64) -> Stage {
        let root = u(pair(re_rad_s));
        Stage {
            omega_rad_s: vec![100.0, 110.0],
            roots: vec![root, root.conj()],
        }
    }

    /// The same with one more mode at 60 rad/s and zeros at -c/2 +- 80 j: signs + + -.
    pub(super) fn with_mode_below(re_rad_s: f64) -> Stage {
        let root = u(pair(re_rad_s));
        let between = u(Complex::new(-0.5 * DAMPING_RAD_S, 80.0));
        Stage {
            omega_rad_s: vec![60.0, 100.0, 110.0],
            roots: vec![between, root, root.conj()],
        }
    }

    /// Modes of equal signs at 100 and 110 rad/s; zeros at -c/2 +- 105 j and two real ones, `re` and -(c + re).
    pub(super) fn with_real_zero(re_rad_s: f64) -> Stage {
        let between = u(pair(-0.5 * DAMPING_RAD_S));
        Stage {
            omega_rad_s: vec![100.0, 110.0],
            roots: vec![between, u(Complex::new(re_rad_s, 0.0))],
        }
    }

    /// A mode at 100 rad/s; zeros at -c/2 +- j `im`.
    pub(super) fn with_one_mode(im_rad_s: f64) -> Stage {
        Stage {
            omega_rad_s: vec![100.0],
            roots: vec![u(Complex::new(-0.5 * DAMPING_RAD_S, im_rad_s))],
        }
    }

    /// G(s), from its roots.
    pub(super) fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let poles: Complex<f64> = self.omega_rad_s.iter().map(|w| u(s) + w * w).product();
        let zeros: Complex<f64> = self.roots.iter().map(|root| u(s) - root).product();
        zeros / poles * REMAINDER
    }

    /// r_k.
    pub(super) fn residue(&self, k: usize) -> f64 {
        let at = -self.omega_rad_s[k].powi(2);
        let zeros: Complex<f64> = self.roots.iter().map(|root| -root + at).product();
        let others = self.omega_rad_s.iter().enumerate().filter(|(j, _)| *j != k);
        let poles: f64 = others.map(|(_, w)| w * w + at).product();
        REMAINDER * zeros.re / poles
    }

    /// dz/dR of a simple zero: -1/(dG/dz), with dG/dz = R (2 z + c) prod of (u - u_i) over the other roots / prod of (u + w_k^2).
    pub(super) fn zero_by_remainder(&self, z: Complex<f64>) -> Complex<f64> {
        let at = u(z);
        let poles: Complex<f64> = self.omega_rad_s.iter().map(|w| at + w * w).product();
        let is_other = |root: &&Complex<f64>| (**root - at).norm() > 1e-6 * at.norm();
        let others = self.roots.iter().filter(is_other);
        let zeros: Complex<f64> = others.map(|root| at - root).product();
        -poles / (zeros * (z * 2.0 + DAMPING_RAD_S) * REMAINDER)
    }

    /// The exact fit, without uncertainty.
    pub(super) fn fit(&self) -> ModalFit {
        let modes = (0..self.omega_rad_s.len()).map(|k| self.mode(k));
        let parameters = ModalParameters {
            modes: modes.collect(),
            remainder_m_per_n: REMAINDER,
            ..ModalParameters::default()
        };
        let free = parameters.free().len();
        ModalFit {
            parameters,
            covariance: DMatrix::zeros(free, free),
            orders: Vec::new(),
            one_more_mode: None,
            chi2_per_freedom: 1.0,
            freedom: 2 * FREQUENCIES - free,
            band_hz: (hertz(FIRST_RAD_S), hertz(FIRST_RAD_S + FREQUENCIES as f64)),
            left_out_hz: Vec::new(),
        }
    }

    fn mode(&self, k: usize) -> ModalTerm {
        ModalTerm {
            omega_rad_s: self.omega_rad_s[k],
            damping_ratio: 0.5 * DAMPING_RAD_S / self.omega_rad_s[k],
            residue_per_kg: self.residue(k),
        }
    }

    /// The exact response, without noise.
    fn frf_data(&self) -> Vec<FrfDatum> {
        let omega = (0..FREQUENCIES).map(|k| FIRST_RAD_S + k as f64);
        omega.map(|omega| self.datum(omega)).collect()
    }

    /// The exact response at a frequency.
    pub(super) fn datum(&self, omega_rad_s: f64) -> FrfDatum {
        FrfDatum {
            frequency_hz: hertz(omega_rad_s),
            spread_hz: 0.0,
            response: self.response(Complex::new(0.0, omega_rad_s)),
            variance: NO_NOISE,
        }
    }
}

pub(super) fn hertz(omega_rad_s: f64) -> f64 {
    omega_rad_s / std::f64::consts::TAU
}

/// The input of a verdict, to be changed by a test.
pub(super) struct Case {
    pub(super) fit: ModalFit,
    pub(super) frf_data: Vec<FrfDatum>,
    pub(super) up_to_rad_s: f64,
    pub(super) expected_modes: Option<usize>,
    pub(super) certainty: Certainty,
}

impl Case {
    pub(super) fn of(stage: &Stage) -> Case {
        Case {
            fit: stage.fit(),
            frf_data: stage.frf_data(),
            up_to_rad_s: UP_TO_RAD_S,
            expected_modes: None,
            certainty: Certainty::ONE_LOOK,
        }
    }

    pub(super) fn input(&self) -> VerdictInput<'_> {
        VerdictInput {
            fit: &self.fit,
            chain: &MeasurementChain::Direct,
            frf_data: &self.frf_data,
            up_to_rad_s: self.up_to_rad_s,
            expected_modes: self.expected_modes,
            certainty: self.certainty,
            duration_s: None,
        }
    }

    pub(super) fn verdict(&self) -> Verdict {
        verdict(&self.input()).expect("zeros")
    }

    pub(super) fn with_covariance(mut self, a: Parameter, b: Parameter, value: f64) -> Case {
        let index = [a, b].map(|parameter| index(&self.fit, parameter));
        self.fit.covariance[(index[0], index[1])] = value;
        self.fit.covariance[(index[1], index[0])] = value;
        self
    }

    /// With a standard deviation of one parameter.
    pub(super) fn with_sigma(self, parameter: Parameter, sigma: f64) -> Case {
        self.with_covariance(parameter, parameter, sigma * sigma)
    }

    /// With the real part of a zero at a number of its standard deviations off the axis: only R is uncertain.
    pub(super) fn with_zero_at_sigmas(
        self,
        stage: &Stage,
        zero: Complex<f64>,
        sigmas: f64,
    ) -> Case {
        let by_remainder = stage.zero_by_remainder(zero).re.abs();
        self.with_sigma(Parameter::Remainder, zero.re.abs() / sigmas / by_remainder)
    }

    /// With nothing but noise above a frequency.
    pub(super) fn with_noise_above(mut self, omega_rad_s: f64) -> Case {
        let above = self.frf_data.iter_mut();
        above
            .filter(|datum| datum.omega_rad_s() > omega_rad_s)
            .for_each(|datum| datum.variance = ALL_NOISE);
        self
    }

    /// With the data of the stage that has a pair of zeros on the other side of the axis, of the same magnitude.
    pub(super) fn with_mirrored_data(mut self, zero: Complex<f64>) -> Case {
        for datum in &mut self.frf_data {
            let s = Complex::new(0.0, datum.omega_rad_s());
            let own = (s - zero) * (s - zero.conj());
            let mirrored = (s + zero) * (s + zero.conj());
            datum.response *= mirrored / own;
        }
        self
    }
}

/// Index of a parameter in the covariance.
pub(super) fn index(fit: &ModalFit, parameter: Parameter) -> usize {
    let free = fit.parameters.free();
    let index = free.iter().position(|free| *free == parameter);
    index.expect("a free parameter")
}

/// The lag in degrees of the all-pass filter of a pair of zeros between two frequencies:
/// 2 (atan((b - y)/x) - atan((a - y)/x)), with +-y.
pub(super) fn all_pass_lag_deg(zero: Complex<f64>, from_rad_s: f64, to_rad_s: f64) -> f64 {
    let angle = |omega: f64, y: f64| ((omega - y) / zero.re).atan();
    let turn = |y: f64| angle(to_rad_s, y) - angle(from_rad_s, y);
    2.0 * (turn(zero.im) + turn(-zero.im)).to_degrees()
}
