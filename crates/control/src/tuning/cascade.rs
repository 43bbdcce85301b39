//! The controller that a design varies: an integrator, at most one lead or lag, and biquads.
//!
//! ```text
//!  C(s) = K/s  (1 + s/z)/(1 + s/p)  product of (1 + 2 zz s/wz + s^2/wz^2)/(1 + 2 zp s/wp + s^2/wp^2)
//! ```
//!
//! Every factor has the gain 1 at low frequency, so that K alone sets the rejection of slow disturbances. The parameters are
//! logarithms: ln K, then ln z, ln p, then ln wz, ln zz, ln wp, ln zp of each biquad.

use nalgebra::Complex;

use crate::SectionSettings;
use bench_base::units::UM_PER_M;

/// A factor of the cascade beside the integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Factor {
    /// ln z, ln p.
    ZeroPole,
    /// ln wz, ln zz, ln wp, ln zp.
    Biquad,
}

impl Factor {
    fn parameters(self) -> usize {
        match self {
            Factor::ZeroPole => 2,
            Factor::Biquad => 4,
        }
    }
}

/// Limits of the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterLimits {
    /// Largest frequency of a pole in rad/s.
    pub pole_rad_s: f64,
    /// Smallest frequency of a zero or pole in rad/s.
    pub lowest_rad_s: f64,
    /// Smallest damping ratio of a pair of poles.
    pub pole_damping_ratio: f64,
}

/// Smallest and largest damping ratio of a pair of zeros.
const ZERO_DAMPING: (f64, f64) = (1e-3, 3.0);
/// Largest damping ratio of a pair of poles: real poles need no pair.
const MOST_POLE_DAMPING: f64 = 1.0;
/// Largest frequency of a zero, as a multiple of that of a pole: a zero far above all poles has no effect.
const ZERO_RANGE: f64 = 5.0;
/// ln of the smallest and of the largest gain in A/(m s).
const GAIN_RANGE: (f64, f64) = (-40.0, 60.0);

/// A cascade with the values of its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade {
    factors: Vec<Factor>,
    /// The logarithms.
    parameters: Vec<f64>,
    /// Their exponentials: gain, frequencies and damping ratios.
    values: Vec<f64>,
}

impl Cascade {
    /// An integrator of gain `gain_a_per_m_s` in A/(m s).
    pub fn integrator(gain_a_per_m_s: f64) -> Cascade {
        Cascade::new(Vec::new(), vec![libm::log(gain_a_per_m_s)])
    }

    fn new(factors: Vec<Factor>, parameters: Vec<f64>) -> Cascade {
        Cascade {
            factors,
            values: parameters.iter().map(|p| libm::exp(*p)).collect(),
            parameters,
        }
    }

    /// The same cascade with (1 + s/z)/(1 + s/p) as another factor.
    #[must_use]
    pub fn with_zero_pole(mut self, zero_rad_s: f64, pole_rad_s: f64) -> Cascade {
        self.factors.push(Factor::ZeroPole);
        let logs = [zero_rad_s, pole_rad_s].map(libm::log);
        self.parameters.extend(logs);
        Cascade::new(self.factors, self.parameters)
    }

    /// The same cascade with another biquad; frequency in rad/s and damping ratio of its zeros and poles.
    #[must_use]
    pub fn with_biquad(mut self, zeros: (f64, f64), poles: (f64, f64)) -> Cascade {
        self.factors.push(Factor::Biquad);
        let logs = [zeros.0, zeros.1, poles.0, poles.1].map(libm::log);
        self.parameters.extend(logs);
        Cascade::new(self.factors, self.parameters)
    }

    /// The same cascade with other values of its parameters.
    #[must_use]
    pub fn with_parameters(&self, parameters: Vec<f64>) -> Cascade {
        Cascade::new(self.factors.clone(), parameters)
    }

    /// The logarithms of gain, frequencies and damping ratios.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The same cascade with the gain in another ratio.
    pub fn scaled(mut self, ratio: f64) -> Cascade {
        self.parameters[0] += libm::log(ratio);
        Cascade::new(self.factors, self.parameters)
    }

    /// Number of poles.
    pub fn order(&self) -> usize {
        let orders = self.factors.iter().map(|factor| factor.parameters() / 2);
        1 + orders.sum::<usize>()
    }

    /// C(s) in A/m.
    pub fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let mut response = Complex::from(self.values[0]) / s;
        for (factor, values) in self.with_values() {
            response *= match factor {
                Factor::ZeroPole => zero(s, values[0]) / zero(s, values[1]),
                Factor::Biquad => pair(s, values[0], values[1]) / pair(s, values[2], values[3]),
            };
        }
        response
    }

    /// The derivatives of ln C(s) with respect to the parameters.
    pub fn log_gradient(&self, s: Complex<f64>) -> Vec<Complex<f64>> {
        let mut gradient = vec![Complex::new(1.0, 0.0)];
        for (factor, values) in self.with_values() {
            match factor {
                Factor::ZeroPole => {
                    gradient.push(zero_gradient(s, values[0]));
                    gradient.push(-zero_gradient(s, values[1]));
                }
                Factor::Biquad => {
                    gradient.extend(pair_gradient(s, values[0], values[1]));
                    gradient.extend(pair_gradient(s, values[2], values[3]).map(|g| -g));
                }
            }
        }
        gradient
    }

    /// Lower and upper limit of each parameter.
    pub fn bounds(&self, limits: &ParameterLimits) -> Vec<(f64, f64)> {
        let zero = (limits.lowest_rad_s, ZERO_RANGE * limits.pole_rad_s);
        let pole = (limits.lowest_rad_s, limits.pole_rad_s);
        let damping = (limits.pole_damping_ratio, MOST_POLE_DAMPING);
        let mut bounds = vec![GAIN_RANGE];
        for factor in &self.factors {
            let ranges = match factor {
                Factor::ZeroPole => vec![zero, pole],
                Factor::Biquad => vec![zero, ZERO_DAMPING, pole, damping],
            };
            let logs = ranges.iter();
            bounds.extend(logs.map(|(low, high)| (libm::log(*low), libm::log(*high))));
        }
        bounds
    }

    /// The cascade with every value within its limits.
    pub fn within(mut self, limits: &ParameterLimits) -> Cascade {
        let bounds = self.bounds(limits);
        for (value, (low, high)) in self.parameters.iter_mut().zip(bounds) {
            *value = value.clamp(low, high);
        }
        Cascade::new(self.factors, self.parameters)
    }

    /// The cascade whose parameters have the values that [`Cascade::sections`] writes.
    pub fn rounded(mut self) -> Cascade {
        for value in &mut self.parameters[1..] {
            *value = libm::log(rounded(libm::exp(*value)));
        }
        Cascade::new(self.factors, self.parameters)
    }

    /// The sections of a controller file, with seven significant digits. The gain is that of the integrator.
    pub fn sections(&self) -> Vec<SectionSettings> {
        let mut gain = self.values[0] / UM_PER_M;
        let mut sections = Vec::new();
        for (factor, values) in self.with_values() {
            let values: Vec<f64> = values.iter().map(|x| rounded(*x)).collect();
            let (ratio, section) = section(factor, &values);
            gain *= ratio;
            sections.push(section);
        }
        let gain_a_per_um = rounded(gain);
        sections.insert(0, SectionSettings::Integrator { gain_a_per_um });
        sections
    }

    /// Frequency in rad/s and damping ratio of each pair of zeros and poles.
    pub fn pairs(&self) -> Vec<(f64, f64)> {
        let biquads = self
            .with_values()
            .filter(|(factor, _)| *factor == Factor::Biquad);
        let pair = |values: &[f64]| (values[0], values[1]);
        biquads
            .flat_map(|(_, values)| [pair(&values[..2]), pair(&values[2..])])
            .collect()
    }

    /// Each factor with its frequencies and damping ratios.
    fn with_values(&self) -> impl Iterator<Item = (Factor, &[f64])> {
        let mut rest = &self.values[1..];
        self.factors.iter().map(move |factor| {
            let (values, tail) = rest.split_at(factor.parameters());
            rest = tail;
            (*factor, values)
        })
    }
}

/// The gain of a factor over that of its section, and the section.
fn section(factor: Factor, values: &[f64]) -> (f64, SectionSettings) {
    match factor {
        Factor::ZeroPole => {
            let section = SectionSettings::ZeroPole {
                zero_rad_s: values[0],
                pole_rad_s: values[1],
            };
            (values[1] / values[0], section)
        }
        Factor::Biquad => {
            let section = SectionSettings::Biquad {
                zeros_rad_s: values[0],
                zeros_damping_ratio: values[1],
                poles_rad_s: values[2],
                poles_damping_ratio: values[3],
                prewarp_rad_s: None,
            };
            let ratio = values[2] / values[0];
            (ratio * ratio, section)
        }
    }
}

/// The value with seven significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

/// 1 + s/z.
fn zero(s: Complex<f64>, zero: f64) -> Complex<f64> {
    s / zero + 1.0
}

/// d ln(1 + s/z)/d ln z.
fn zero_gradient(s: Complex<f64>, zero: f64) -> Complex<f64> {
    -s / (s + zero)
}

/// 1 + 2 zeta s/w + s^2/w^2.
fn pair(s: Complex<f64>, omega_rad_s: f64, damping_ratio: f64) -> Complex<f64> {
    let x = s / omega_rad_s;
    x * x + x * (2.0 * damping_ratio) + 1.0
}

/// The derivatives of ln(1 + 2 zeta s/w + s^2/w^2) with respect to ln w and ln zeta.
fn pair_gradient(s: Complex<f64>, omega_rad_s: f64, damping_ratio: f64) -> [Complex<f64>; 2] {
    let x = s / omega_rad_s;
    let linear = x * (2.0 * damping_ratio);
    let whole = x * x + linear + 1.0;
    [-(x * x * 2.0 + linear) / whole, linear / whole]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ControllerFile, ControllerText};

    fn cascade() -> Cascade {
        Cascade::integrator(2.5e8)
            .with_zero_pole(90.0, 600.0)
            .with_biquad((520.0, 0.01), (555.0, 0.1))
    }

    #[test]
    fn gradient_is_the_difference_quotient() {
        let (base, step) = (cascade(), 1e-6);
        for w in [3.0, 500.0, 9000.0] {
            let s = Complex::new(0.0, w);
            let gradient = base.log_gradient(s);
            for (i, derivative) in gradient.iter().enumerate() {
                let moved = |by: f64| {
                    let mut parameters = base.parameters.clone();
                    parameters[i] += by;
                    base.with_parameters(parameters).response(s).ln()
                };
                let quotient = (moved(step) - moved(-step)) / (2.0 * step);
                // The central difference errs by step^2 f'''/6, below 1e-8 for the notch of damping 0.01, and by rounding.
                assert!((quotient - derivative).norm() < 1e-7, "{i} at {w}");
            }
        }
    }

    #[test]
    fn sections_have_the_response_of_the_cascade() {
        let base = cascade();
        let file = ControllerFile {
            title: "x".into(),
            section: base.sections(),
        };
        let text = ControllerText {
            name: "x".into(),
            text: toml::to_string(&file).unwrap(),
        };
        let sections = text.sections(5000.0).unwrap();
        for w in [3.0, 519.0, 9000.0] {
            let s = Complex::new(0.0, w);
            let expected = base.response(s);
            let found = crate::continuous_response(&sections, s);
            // Seven digits of each parameter; near the zeros of damping 0.01 an error is 1/0.02 times larger.
            assert!((found / expected - 1.0).norm() < 1e-4, "{w}");
        }
        assert_eq!(base.order(), 4);
    }
}
