//! The result of a modal fit: modes, delay, poles and response.

use core::ops::Range;

use nalgebra::{Complex, DMatrix, DVector};
use serde::ser::{Serialize, SerializeStruct, Serializer};

use super::clusters::{cancelling, cancels};
use super::{Estimate, MeasurementChain, ModalParameters, ModelOrder, OneMoreMode, Parameter};
use crate::FrfDatum;
use crate::chi2_limits::noise_limit;
use bench_plant::Sign;
use bench_plant::zeros::ModalTerm;

/// The sign of a complex residue.
pub const COMPLEX_SIGN: char = 'c';
/// Probability of the values beyond one end of a 95 % confidence interval.
const ONE_SIDE_OF_95: f64 = 0.025;

/// The modes that fit a response.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalFit {
    /// The parameters, lowest frequency first.
    pub parameters: ModalParameters,
    /// Covariance of w (rad/s), zeta, r (1/kg) of each mode (of a free body r alone), with complex residues q (s/kg) after r, of R (m/N)
    /// and, unless it is fixed, tau (s), in that order.
    pub covariance: DMatrix<f64>,
    /// All significant model orders, for the stability chart.
    pub orders: Vec<ModelOrder>,
    /// What the data may show beyond the significant modes; `None` if as many modes are fitted as are allowed.
    pub one_more_mode: Option<OneMoreMode>,
    /// Reduced chi-square with the noise of the estimator: 1 if the residual is noise.
    pub chi2_per_freedom: f64,
    /// Its degrees of freedom: two for each datum (which are merged far from the poles) or one for each reading, less the parameters.
    pub freedom: usize,
    /// Lowest and highest fitted frequency in hertz.
    pub band_hz: (f64, f64),
    /// Frequencies in hertz, rising, at which the response alone shows a mode: as a disturbance does that repeats with the periods, or a
    /// mode that is narrower than the distance of the data. They are not fitted.
    pub left_out_hz: Vec<f64>,
}

/// A fitted mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedMode {
    /// Undamped natural frequency in rad/s; exactly 0 for a free body.
    pub omega_rad_s: Estimate,
    /// Damping ratio.
    pub damping_ratio: Estimate,
    /// Residue r in 1/kg; the real part of a complex one.
    pub residue_per_kg: Estimate,
    /// q w in 1/kg: the imaginary part of a complex residue, whose numerator at s = j w is r + j q w. `None` of a real residue.
    pub residue_imaginary_per_kg: Option<Estimate>,
    /// Probability that the stage has one more mode, with which the residue has the other sign ([`OneMoreMode`]).
    pub turned_by_one_more: f64,
}

impl FittedMode {
    /// Probability that the residue, or the real part of a complex one, has the opposite sign: by its error, which is normally distributed,
    /// or because the stage has one more mode.
    pub fn sign_error_probability(&self) -> f64 {
        let magnitude = Estimate {
            value: self.residue_per_kg.value.abs(),
            ..self.residue_per_kg
        };
        let turned = self.turned_by_one_more;
        let other = magnitude.below_zero_probability();
        turned * (1.0 - other) + (1.0 - turned) * other
    }

    /// The sign of the residue; [`COMPLEX_SIGN`] of a complex one, which has none.
    pub fn sign(&self) -> char {
        match self.residue_imaginary_per_kg {
            Some(_) => COMPLEX_SIGN,
            None => Sign::of(self.residue_per_kg.value).symbol(),
        }
    }

    /// The sign of the residue; of a real one `?` if it has the opposite one with a probability above 2.5 %, as if its 95 % confidence
    /// interval contains 0.
    pub fn certain_sign(&self) -> char {
        let is_certain = self.is_determined() && self.turned_by_one_more < ONE_SIDE_OF_95;
        if self.residue_imaginary_per_kg.is_some() || is_certain {
            self.sign()
        } else {
            '?'
        }
    }

    /// Whether the 95 % confidence interval of the residue, or of one part of a complex one, excludes 0.
    fn is_determined(&self) -> bool {
        let excludes_zero = |part: Estimate| part.value.abs() > part.half_width_95();
        let imaginary = self.residue_imaginary_per_kg;
        excludes_zero(self.residue_per_kg) || imaginary.is_some_and(excludes_zero)
    }

    /// Undamped natural frequency in hertz.
    pub fn frequency_hz(&self) -> Estimate {
        self.omega_rad_s.scaled(0.5 * std::f64::consts::FRAC_1_PI)
    }
}

impl Serialize for FittedMode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let fields = if self.residue_imaginary_per_kg.is_some() {
            10
        } else {
            8
        };
        let mut mode = serializer.serialize_struct("FittedMode", fields)?;
        mode.serialize_field("frequency_hz", &self.frequency_hz().value)?;
        mode.serialize_field("frequency_hz_sigma", &self.frequency_hz().sigma)?;
        mode.serialize_field("damping_ratio", &self.damping_ratio.value)?;
        mode.serialize_field("damping_ratio_sigma", &self.damping_ratio.sigma)?;
        mode.serialize_field("residue", &self.residue_per_kg.value)?;
        mode.serialize_field("residue_sigma", &self.residue_per_kg.sigma)?;
        if let Some(imaginary) = self.residue_imaginary_per_kg {
            mode.serialize_field("residue_imaginary", &imaginary.value)?;
            mode.serialize_field("residue_imaginary_sigma", &imaginary.sigma)?;
        }
        mode.serialize_field("sign", &self.sign())?;
        let is_real = self.residue_imaginary_per_kg.is_none();
        let error_probability = is_real.then(|| self.sign_error_probability());
        mode.serialize_field("sign_error_probability", &error_probability)?;
        mode.end()
    }
}

/// Neighbouring modes of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeGroup {
    /// Index of the lowest one.
    pub first: usize,
    /// Number of modes.
    pub count: usize,
    /// Frequencies of the lowest and the highest one in hertz.
    pub band_hz: (f64, f64),
}

/// A pole with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertainPole {
    /// The pole in rad/s; of a conjugate pair the one above the real axis.
    pub s: Complex<f64>,
    /// Covariance of real and imaginary part in (rad/s)^2.
    pub covariance: [[f64; 2]; 2],
}

impl ModalFit {
    /// The largest reduced chi-square of a residual that is noise.
    pub(crate) fn noise_limit(&self) -> f64 {
        noise_limit(self.freedom)
    }

    /// Whether the residual is noise.
    pub(crate) fn leaves_noise(&self) -> bool {
        self.chi2_per_freedom <= self.noise_limit()
    }

    /// The data that are fitted.
    pub fn used_data(&self, data: &[FrfDatum]) -> Vec<FrfDatum> {
        let is_used = |datum: &&FrfDatum| !self.left_out_hz.contains(&datum.frequency_hz);
        data.iter().filter(is_used).copied().collect()
    }

    /// The modes with their standard deviations, lowest frequency first.
    pub fn modes(&self) -> Vec<FittedMode> {
        let modes = self.parameters.modes.iter().enumerate();
        modes.map(|(k, term)| self.mode(k, term)).collect()
    }

    fn mode(&self, k: usize, term: &ModalTerm) -> FittedMode {
        FittedMode {
            omega_rad_s: self.estimate(term.omega_rad_s, Parameter::Frequency(k)),
            damping_ratio: self.estimate(term.damping_ratio, Parameter::Damping(k)),
            residue_per_kg: self.estimate(term.residue_per_kg, Parameter::Residue(k)),
            residue_imaginary_per_kg: self.residue_imaginary_per_kg(k, term),
            turned_by_one_more: self.turned_by_one_more(term),
        }
    }

    /// The probability of one more mode if that turns the sign of a residue.
    fn turned_by_one_more(&self, term: &ModalTerm) -> f64 {
        let turning = self.one_more_mode.as_ref().filter(|more| more.turns(term));
        turning.map_or(0.0, |more| more.probability)
    }

    /// q w. Its error is that of q, beside which that of w is negligible. (The rate of a free body has no such unit: 0.)
    fn residue_imaginary_per_kg(&self, k: usize, term: &ModalTerm) -> Option<Estimate> {
        let is_complex = !self.parameters.has_real_residues();
        is_complex.then(|| {
            let rate = self.estimate(self.parameters.rate_s_per_kg(k), Parameter::Rate(k));
            rate.scaled(term.omega_rad_s)
        })
    }

    /// The delay beyond that of the measurement chain, in seconds; with the standard deviation 0 if it is fixed.
    pub fn delay_s(&self) -> Estimate {
        self.estimate(self.parameters.delay_s, Parameter::Delay)
    }

    /// The delay beyond that of the measurement chain, if it is determined: complex residues leave it open.
    pub fn determined_delay_s(&self) -> Option<Estimate> {
        let is_free = !self.parameters.has_fixed_delay;
        is_free.then(|| self.delay_s())
    }

    /// The static compliance C = sum of r_k/w_k^2 + R in m/N, extrapolated by the fit to zero frequency. Its variance is g' P g, with
    /// the gradient g of C and the covariance P of the parameters. `None` for a free body, which has none.
    pub fn static_compliance_m_per_n(&self) -> Option<Estimate> {
        let modes = &self.parameters.modes;
        if modes.iter().any(|term| term.omega_rad_s == 0.0) {
            return None;
        }
        let compliance = |term: &ModalTerm| term.residue_per_kg / term.omega_rad_s.powi(2);
        let free = self.parameters.free();
        let gradient = free.iter().map(|parameter| match *parameter {
            Parameter::Frequency(k) => -2.0 * compliance(&modes[k]) / modes[k].omega_rad_s,
            Parameter::Residue(k) => modes[k].omega_rad_s.powi(-2),
            Parameter::Remainder => 1.0,
            Parameter::Damping(_) | Parameter::Rate(_) | Parameter::Delay => 0.0,
        });
        let gradient = DVector::from_iterator(free.len(), gradient);
        let variance = (&self.covariance * &gradient).dot(&gradient);
        Some(Estimate {
            value: modes.iter().map(compliance).sum::<f64>() + self.parameters.remainder_m_per_n,
            sigma: variance.max(0.0).sqrt(),
        })
    }

    /// A parameter's value with its standard deviation, 0 if it is not free.
    fn estimate(&self, value: f64, parameter: Parameter) -> Estimate {
        let sigma = self
            .index(parameter)
            .map_or(0.0, |i| self.covariance[(i, i)].sqrt());
        Estimate { value, sigma }
    }

    /// Index of a parameter in the covariance.
    fn index(&self, parameter: Parameter) -> Option<usize> {
        self.parameters
            .free()
            .iter()
            .position(|free| *free == parameter)
    }

    /// The largest group of neighbouring modes, three or more, whose residues nearly cancel.
    pub fn cancelling_modes(&self) -> Option<ModeGroup> {
        let groups = self.cancelling_groups();
        let largest = groups.into_iter().max_by_key(|group| group.count)?;
        (largest.count > 2).then_some(largest)
    }

    /// Neighbouring modes whose residues nearly cancel and of which two or more are not determined: their intervals contain 0.
    pub fn undetermined_modes(&self) -> Option<ModeGroup> {
        let modes = self.modes();
        let is_undetermined = |group: &ModeGroup| {
            let group = &modes[group.first..group.first + group.count];
            let uncertain = group.iter().filter(|mode| !mode.is_determined());
            uncertain.count() >= 2
        };
        self.cancelling_groups().into_iter().find(is_undetermined)
    }

    /// Two neighbouring modes that are not determined, and whose residues nearly cancel. (Among other modes they are no group that cancels.)
    pub(crate) fn undetermined_pair(&self) -> Option<ModeGroup> {
        let modes = self.modes();
        let residues = self.parameters.complex_residues();
        let is_pair = |k: &usize| {
            let pair = *k..*k + 2;
            let is_uncertain = modes[pair.clone()].iter().all(|mode| !mode.is_determined());
            is_uncertain && cancels(&residues[pair])
        };
        let first = (0..modes.len().saturating_sub(1)).find(is_pair)?;
        Some(self.group(first..first + 2))
    }

    fn group(&self, indices: Range<usize>) -> ModeGroup {
        let hz = |k: usize| self.parameters.modes[k].omega_rad_s / std::f64::consts::TAU;
        ModeGroup {
            first: indices.start,
            count: indices.len(),
            band_hz: (hz(indices.start), hz(indices.end - 1)),
        }
    }

    /// The groups of neighbouring modes whose residues nearly cancel.
    fn cancelling_groups(&self) -> Vec<ModeGroup> {
        cancelling(&self.parameters)
            .into_iter()
            .map(|indices| self.group(indices))
            .collect()
    }

    /// The response of the fit through `chain`, its delay included, at frequencies in hertz, in the unit of the fitted data
    /// (m/A through a bench, m/N directly).
    pub fn response(&self, chain: &MeasurementChain, frequency_hz: &[f64]) -> Vec<Complex<f64>> {
        let nodes = chain.nodes_at(frequency_hz, self.parameters.delay_s);
        let delays = nodes.delays(self.parameters.delay_s);
        let mut sum = nodes.constant(&delays);
        sum.iter_mut()
            .for_each(|h| *h *= self.parameters.remainder_m_per_n);
        for (k, term) in self.parameters.modes.iter().enumerate() {
            let of_mode = nodes.mean(&nodes.mode(term), &delays);
            add_scaled(&mut sum, &of_mode, term.residue_per_kg);
            if !self.parameters.has_real_residues() {
                let of_rate = nodes.mean(&nodes.mode_rate(term), &delays);
                add_scaled(&mut sum, &of_rate, self.parameters.rate_s_per_kg(k));
            }
        }
        sum
    }

    /// The poles, lowest frequency first: one of a mode below critical damping, both of one above, which are real.
    ///
    /// ```text
    /// s = -zeta w + j w sqrt(1 - zeta^2)             covariance J cov(w, zeta) J^T, J the derivatives of (Re s, Im s)
    /// ```
    pub fn poles(&self) -> Vec<UncertainPole> {
        let modes = self.parameters.modes.iter().enumerate();
        modes
            .flat_map(|(k, term)| self.mode_poles(k, term))
            .collect()
    }

    fn mode_poles(&self, k: usize, term: &ModalTerm) -> Vec<UncertainPole> {
        let indices = self
            .index(Parameter::Frequency(k))
            .zip(self.index(Parameter::Damping(k)));
        let poles = poles_with_derivatives(term).into_iter();
        poles
            .map(|(s, derivatives)| UncertainPole {
                s,
                covariance: self.pole_covariance(indices, derivatives),
            })
            .collect()
    }

    /// J cov J^T of a pair of parameters; zero if they are not free.
    fn pole_covariance(
        &self,
        indices: Option<(usize, usize)>,
        derivatives: [[f64; 2]; 2],
    ) -> [[f64; 2]; 2] {
        let Some((omega, damping)) = indices else {
            return [[0.0; 2]; 2];
        };
        let at = [omega, damping];
        let covariance = at.map(|i| at.map(|j| self.covariance[(i, j)]));
        derivatives.map(|a| derivatives.map(|b| quadratic_form(a, covariance, b)))
    }
}

/// Adds a multiple of a response to a sum.
fn add_scaled(sum: &mut [Complex<f64>], response: &[Complex<f64>], factor: f64) {
    for (sum, response) in sum.iter_mut().zip(response) {
        *sum += response * factor;
    }
}

/// a^T C b.
fn quadratic_form(a: [f64; 2], c: [[f64; 2]; 2], b: [f64; 2]) -> f64 {
    a[0] * c[0][0] * b[0] + a[0] * c[0][1] * b[1] + a[1] * c[1][0] * b[0] + a[1] * c[1][1] * b[1]
}

/// Each pole of a mode with d(Re s, Im s)/d(w, zeta).
fn poles_with_derivatives(term: &ModalTerm) -> Vec<(Complex<f64>, [[f64; 2]; 2])> {
    let (w, zeta) = (term.omega_rad_s, term.damping_ratio);
    if zeta < 1.0 {
        let root = (1.0 - zeta * zeta).sqrt();
        let derivatives = [[-zeta, -w], [root, -w * zeta / root]];
        return vec![(Complex::new(-zeta * w, w * root), derivatives)];
    }
    vec![real_pole(w, zeta, 1.0), real_pole(w, zeta, -1.0)]
}

/// One of the two real poles of an overdamped mode: +1 for the slower one, -1 for the faster one.
fn real_pole(w: f64, zeta: f64, sign: f64) -> (Complex<f64>, [[f64; 2]; 2]) {
    let root = (zeta * zeta - 1.0).sqrt();
    let re_per_w = -zeta + sign * root;
    let derivatives = [[re_per_w, w * (-1.0 + sign * zeta / root)], [0.0, 0.0]];
    (Complex::new(w * re_per_w, 0.0), derivatives)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modes of a damping ratio of 0.1, by frequency in rad/s, residue and its standard deviation in 1/kg.
    fn fit(modes: &[(f64, f64, f64)]) -> ModalFit {
        let term = |(omega_rad_s, residue_per_kg, _): &(f64, f64, f64)| ModalTerm {
            omega_rad_s: *omega_rad_s,
            damping_ratio: 0.1,
            residue_per_kg: *residue_per_kg,
        };
        let parameters = ModalParameters {
            modes: modes.iter().map(term).collect(),
            ..ModalParameters::default()
        };
        let free = parameters.free();
        let variance = |parameter: &Parameter| match *parameter {
            Parameter::Residue(k) => modes[k].2 * modes[k].2,
            _ => 1e-6,
        };
        let variances = DVector::from_iterator(free.len(), free.iter().map(variance));
        ModalFit {
            parameters,
            covariance: DMatrix::from_diagonal(&variances),
            orders: Vec::new(),
            one_more_mode: None,
            chi2_per_freedom: 1.0,
            freedom: 1000,
            band_hz: (1.0, 100.0),
            left_out_hz: Vec::new(),
        }
    }

    /// The four modes are near enough to each other for one group, whose residues do not cancel.
    #[test]
    fn pair_that_cancels_is_found_beside_other_modes() {
        let with_pair = |first: (f64, f64, f64), second| {
            fit(&[(90.0, -5.0, 0.01), first, second, (115.0, -9.0, 0.01)])
        };
        let found = with_pair((100.0, -0.76, 77.0), (101.0, 0.77, 77.0));
        assert_eq!(found.cancelling_modes(), None);
        let pair = found.undetermined_pair().expect("a pair");
        assert_eq!((pair.first, pair.count), (1, 2));
        // Modes that are certain, or do not cancel, are none.
        for (first, second) in [
            ((100.0, -0.76, 0.01), (101.0, 0.77, 0.01)),
            ((100.0, -0.76, 77.0), (101.0, 0.77, 0.01)),
            ((100.0, 0.76, 77.0), (101.0, 0.77, 77.0)),
        ] {
            assert_eq!(with_pair(first, second).undetermined_pair(), None);
        }
    }
}
