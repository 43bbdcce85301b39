//! A transfer function as a cascade of sections, and the control law that runs it.

use nalgebra::Complex;

use super::boundary::check_sides;
use super::check::{Agreement, agreement};
use super::domain::Domain;
use super::error::TransferError;
use super::given::{self, Given};
use super::pairing;
use super::roots::Factors;
use super::settings::{GainUnit, TransferSettings};
use crate::controller::{Controller, SectionController};
use crate::law::{ControlDesign, ControlLaw};
use crate::{Biquad, Section};
use bench_base::units::UM_PER_M;

/// A transfer function as sections in amperes per micrometre.
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade {
    /// The sections: coefficients by rising powers of s or z.
    pub sections: Vec<Section>,
    /// Zeros, poles and gain, in the unit of the original.
    pub factors: Factors,
    /// The variable of the sections.
    pub domain: Domain,
    /// How well the sections agree with the original.
    pub agreement: Agreement,
}

/// Two servo rates are equal if they differ by less than this ratio: a period in a file is often rounded to nine digits.
const SAME_RATE: f64 = 1e-9;

impl Cascade {
    /// Converts a transfer function, and compares the response of the sections with that of the original.
    ///
    /// ```
    /// use bench_control::{Cascade, GainUnit, TfSettings, TransferSettings};
    ///
    /// // 2 (s + 3)/(s (s + 50)) A/um
    /// let settings = TransferSettings::Tf(TfSettings {
    ///     gain_unit: GainUnit::AmperesPerMicrometre,
    ///     rate_hz: None,
    ///     numerator: vec![2.0, 6.0],
    ///     denominator: vec![1.0, 50.0, 0.0],
    /// });
    /// let cascade = Cascade::of(&settings)?;
    /// assert_eq!(cascade.sections.len(), 2);
    /// assert!(cascade.agreement.difference < 1e-14);
    /// # Ok::<(), bench_control::TransferError>(())
    /// ```
    ///
    /// # Errors
    /// Numbers that are not finite or of the wrong size, an improper or unstable transfer function, and one whose response the
    /// sections do not reproduce.
    pub fn of(settings: &TransferSettings) -> Result<Cascade, TransferError> {
        let domain = Domain::of_rate(settings.rate_hz());
        let unit = per_micrometre(settings.gain_unit());
        let given = Given::of(settings)?;
        let mut failed = TransferError::NoResponse;
        for factors in given.located(domain)? {
            match Cascade::of_factors(&given, factors, unit, domain) {
                Ok(cascade) => return Ok(cascade),
                Err(why) => failed = why,
            }
        }
        Err(failed)
    }

    fn of_factors(
        given: &Given,
        factors: Factors,
        unit: f64,
        domain: Domain,
    ) -> Result<Cascade, TransferError> {
        given::check(&factors, domain)?;
        let sections = pairing::sections(&factors, unit, domain);
        check_sides(&factors, &sections, domain)?;
        let agreement = agreement(given, &factors, &sections, unit, domain)?;
        Ok(Cascade {
            sections,
            factors,
            domain,
            agreement,
        })
    }

    /// The control law of a loop at `rate_hz`. The sections of a discrete transfer function run as they are; continuous ones are
    /// discretised by Tustin's rule.
    ///
    /// # Errors
    /// The transfer function is discrete, for another rate.
    pub fn design(self, rate_hz: f64) -> Result<Box<dyn ControlDesign>, TransferError> {
        match self.domain {
            Domain::Continuous => Ok(Box::new(self.sections)),
            Domain::Discrete {
                rate_hz: designed_hz,
            } if (designed_hz / rate_hz - 1.0).abs() > SAME_RATE => Err(TransferError::Rate {
                designed_hz,
                loop_hz: rate_hz,
            }),
            Domain::Discrete { .. } => Ok(Box::new(DiscreteDesign::of(&self.sections))),
        }
    }

    /// C(s) or C(z) of the sections in amperes per micrometre at a frequency.
    pub fn response(&self, omega_rad_s: f64) -> Complex<f64> {
        let v = self.domain.point(omega_rad_s);
        self.sections
            .iter()
            .map(|section| section.response(v))
            .product()
    }
}

fn per_micrometre(unit: GainUnit) -> f64 {
    match unit {
        GainUnit::AmperesPerMicrometre => 1.0,
        GainUnit::AmperesPerMetre => 1.0 / UM_PER_M,
    }
}

/// A discrete controller that was designed for the servo rate.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscreteDesign {
    controller: Controller,
}

impl DiscreteDesign {
    /// The design of sections in z.
    fn of(sections: &[Section]) -> DiscreteDesign {
        let biquads = sections.iter().map(biquad).collect();
        DiscreteDesign {
            controller: Controller::of_biquads(biquads),
        }
    }
}

impl ControlDesign for DiscreteDesign {
    fn law(&self, _period_s: f64) -> Box<dyn ControlLaw> {
        Box::new(SectionController::new(self.controller.clone()))
    }
}

/// The section in z as a section in z^-1, with the same response.
fn biquad(section: &Section) -> Biquad {
    let (n, d) = (section.numerator, section.denominator);
    match section.poles().len() {
        0 => Biquad::new([n[0], 0.0, 0.0], [d[0], 0.0, 0.0]),
        1 => Biquad::new([n[1], n[0], 0.0], [d[1], d[0], 0.0]),
        _ => Biquad::new([n[2], n[1], n[0]], [d[2], d[1], d[0]]),
    }
}
