//! A section as written in a controller file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::section::{Section, SectionError};
use super::unstable::{MAX_INTEGRATORS, WHY_TWO};

/// A section as written in a controller file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum SectionSettings {
    /// K.
    Gain {
        /// K in amperes per micrometre.
        #[schemars(range(min = -1e12, max = 1e12))]
        gain_a_per_um: f64,
    },
    /// K/s.
    Integrator {
        /// K in amperes per micrometre and second.
        #[schemars(range(min = -1e12, max = 1e12))]
        gain_a_per_um: f64,
    },
    /// (s + z)/(s + p): a lead for z < p, a lag for z > p.
    ZeroPole {
        /// z in rad/s.
        #[schemars(range(min = -1e6, max = 1e6))]
        zero_rad_s: f64,
        /// p in rad/s.
        #[schemars(range(min = -1e6, max = 1e6))]
        pole_rad_s: f64,
    },
    /// 1/(s + p).
    Pole {
        /// p in rad/s.
        #[schemars(range(min = -1e6, max = 1e6))]
        pole_rad_s: f64,
    },
    /// w^2/(s^2 + 2 zeta w s + w^2).
    PolePair {
        /// w in rad/s.
        #[schemars(range(min = 1e-6, max = 1e6))]
        omega_rad_s: f64,
        /// zeta.
        #[schemars(range(min = -10.0, max = 10.0))]
        damping_ratio: f64,
    },
    /// (s^2 + 2 zz wz s + wz^2)/(s^2 + 2 zp wp s + wp^2).
    Biquad {
        /// wz in rad/s.
        #[schemars(range(min = 0.0, max = 1e6))]
        zeros_rad_s: f64,
        /// zz.
        #[schemars(range(min = -10.0, max = 10.0))]
        zeros_damping_ratio: f64,
        /// wp in rad/s.
        #[schemars(range(min = 1e-6, max = 1e6))]
        poles_rad_s: f64,
        /// zp.
        #[schemars(range(min = -10.0, max = 10.0))]
        poles_damping_ratio: f64,
        /// Frequency in rad/s at which the discrete section has exactly the continuous response.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(min = 1e-3, max = 1e6))]
        prewarp_rad_s: Option<f64>,
    },
    /// Any section of second order or less, by falling powers of s.
    Coefficients {
        /// Coefficients of the numerator: one to three numbers.
        #[schemars(length(min = 1, max = 3))]
        numerator: Vec<f64>,
        /// Coefficients of the denominator: one to three numbers.
        #[schemars(length(min = 1, max = 3))]
        denominator: Vec<f64>,
        /// Frequency in rad/s at which the discrete section has exactly the continuous response.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(min = 1e-3, max = 1e6))]
        prewarp_rad_s: Option<f64>,
    },
}

/// Sections that no loop can run.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SectionsError {
    /// An invalid section.
    #[error("section {number} {why}")]
    Section {
        /// Number of the section, from 1.
        number: usize,
        /// What is wrong.
        why: SectionError,
    },
    /// A prewarping frequency above half the servo rate.
    #[error(
        "section {number} is prewarped at {prewarp_rad_s} rad/s, but the limit at this servo rate is {limit_rad_s:.1} rad/s; lower the frequency, or raise loop.rate_hz"
    )]
    Prewarp {
        /// Number of the section, from 1.
        number: usize,
        /// As given.
        prewarp_rad_s: f64,
        /// Half the servo rate.
        limit_rad_s: f64,
    },
    /// More integrators than a controller may have.
    #[error(
        "its sections have {count} integrators (poles at s = 0); the limit is {MAX_INTEGRATORS}, because {WHY_TWO}"
    )]
    Integrators {
        /// Their number.
        count: usize,
    },
}

/// The sections of a cascade, checked for a servo rate.
pub fn checked_sections(
    settings: &[SectionSettings],
    rate_hz: f64,
) -> Result<Vec<Section>, SectionsError> {
    let numbered = (1..).zip(settings);
    let checked = numbered.map(|(number, settings)| settings.checked(number, rate_hz));
    let sections: Vec<Section> = checked.collect::<Result<_, _>>()?;
    let count = sections.iter().map(Section::integrators).sum();
    if count > MAX_INTEGRATORS {
        Err(SectionsError::Integrators { count })
    } else {
        Ok(sections)
    }
}

impl SectionSettings {
    /// The section, which has a number in its cascade.
    fn checked(&self, number: usize, rate_hz: f64) -> Result<Section, SectionsError> {
        let section = self.section().checked();
        let section = section.map_err(|why| SectionsError::Section { number, why })?;
        let limit_rad_s = std::f64::consts::PI * rate_hz;
        match section.prewarp_rad_s {
            Some(prewarp_rad_s) if prewarp_rad_s >= limit_rad_s => Err(SectionsError::Prewarp {
                number,
                prewarp_rad_s,
                limit_rad_s,
            }),
            _ => Ok(section),
        }
    }

    /// The continuous section, without checks.
    pub fn section(&self) -> Section {
        let (numerator, denominator) = self.coefficients();
        Section {
            numerator,
            denominator,
            prewarp_rad_s: self.prewarp_rad_s(),
        }
    }

    fn prewarp_rad_s(&self) -> Option<f64> {
        match self {
            SectionSettings::Biquad { prewarp_rad_s, .. }
            | SectionSettings::Coefficients { prewarp_rad_s, .. } => *prewarp_rad_s,
            _ => None,
        }
    }

    /// Numerator and denominator by rising powers of s.
    fn coefficients(&self) -> ([f64; 3], [f64; 3]) {
        use SectionSettings as Kind;
        match *self {
            Kind::Gain { gain_a_per_um: k } => ([k, 0.0, 0.0], [1.0, 0.0, 0.0]),
            Kind::Integrator { gain_a_per_um: k } => ([k, 0.0, 0.0], [0.0, 1.0, 0.0]),
            Kind::ZeroPole {
                zero_rad_s: z,
                pole_rad_s: p,
            } => ([z, 1.0, 0.0], [p, 1.0, 0.0]),
            Kind::Pole { pole_rad_s: p } => ([1.0, 0.0, 0.0], [p, 1.0, 0.0]),
            Kind::PolePair {
                omega_rad_s: w,
                damping_ratio: zeta,
            } => ([w * w, 0.0, 0.0], pair(w, zeta)),
            Kind::Biquad {
                zeros_rad_s: wz,
                zeros_damping_ratio: zz,
                poles_rad_s: wp,
                poles_damping_ratio: zp,
                ..
            } => (pair(wz, zz), pair(wp, zp)),
            Kind::Coefficients {
                ref numerator,
                ref denominator,
                ..
            } => (rising(numerator), rising(denominator)),
        }
    }
}

/// s^2 + 2 zeta w s + w^2 by rising powers.
fn pair(w: f64, zeta: f64) -> [f64; 3] {
    [w * w, 2.0 * zeta * w, 1.0]
}

/// Converts coefficients by falling powers to coefficients by rising powers.
fn rising(falling: &[f64]) -> [f64; 3] {
    let mut rising = [0.0; 3];
    for (slot, c) in rising.iter_mut().zip(falling.iter().rev()) {
        *slot = *c;
    }
    rising
}
