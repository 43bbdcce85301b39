//! The deviation of a setting: as typed, and as a distribution.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::StudyError;
use bench_base::quantity::{Dimension, Quantity, QuantityError};

/// Limit of a normal deviation in standard deviations: two values in 10^9 lie beyond it and are set to it.
const NORMAL_END: f64 = 6.0;

/// The distribution of a setting's deviation from its nominal value, in the setting's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "distribution", rename_all = "snake_case")]
pub enum Deviation {
    /// Uniform between two limits.
    Uniform {
        /// The lower limit.
        low: f64,
        /// The upper limit.
        high: f64,
    },
    /// Gaussian about the nominal value, cut off at 6 sigma.
    Normal {
        /// Its standard deviation.
        sigma: f64,
    },
}

impl Deviation {
    /// Its limits.
    pub fn ends(&self) -> [f64; 2] {
        match *self {
            Deviation::Uniform { low, high } => [low, high],
            Deviation::Normal { sigma } => [-NORMAL_END * sigma, NORMAL_END * sigma],
        }
    }

    /// The deviation and its rank, the probability of a smaller one, from two independent numbers, uniform in [0, 1).
    ///
    /// A normal deviation follows Box and Muller, sqrt(-2 ln(1 - a)) cos(2 pi b).
    pub(super) fn drawn(&self, [a, b]: [f64; 2]) -> (f64, f64) {
        match *self {
            Deviation::Uniform { low, high } => (low + (high - low) * a, a),
            Deviation::Normal { sigma } => {
                let unit = libm::sqrt(-2.0 * libm::log(1.0 - a))
                    * libm::cos(2.0 * std::f64::consts::PI * b);
                let unit = unit.clamp(-NORMAL_END, NORMAL_END);
                (
                    sigma * unit,
                    0.5 * libm::erfc(-unit * std::f64::consts::FRAC_1_SQRT_2),
                )
            }
        }
    }
}

/// The settings that deviate, and the distribution: `KEY=uniform:LOW:HIGH`, `KEY=normal:SIGMA`, or `KEY=+-LIMIT` for a uniform one.
///
/// The deviation is added to the nominal value. A percentage of an operating point is of the beam length, of a ratio of 1,
/// and of any other setting of its nominal value. `*` in the key matches any part of a name between dots.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    text: String,
    pattern: String,
    amounts: Amounts,
}

const USAGE: &str = "not a tolerance; write KEY=uniform:LOW:HIGH, KEY=normal:SIGMA or KEY=+-LIMIT, as in plant.secondary_stage_mass_kg=+-2%";

#[derive(Clone, Debug, PartialEq)]
enum Amounts {
    Symmetric(Quantity),
    Uniform(Quantity, Quantity),
    Normal(Quantity),
}

impl FromStr for Tolerance {
    type Err = StudyError;

    fn from_str(text: &str) -> Result<Tolerance, StudyError> {
        let parsed = text.split_once('=').ok_or_else(|| USAGE.to_string());
        let parsed = parsed.and_then(|(pattern, amounts)| Ok((pattern, amounts.parse()?)));
        let text = text.to_string();
        match parsed {
            Err(why) => Err(StudyError::Tolerance { text, why }),
            Ok((pattern, amounts)) => Ok(Tolerance {
                pattern: pattern.trim().into(),
                amounts,
                text,
            }),
        }
    }
}

impl FromStr for Amounts {
    type Err = String;

    fn from_str(text: &str) -> Result<Amounts, String> {
        let signs = ["+-", "±"];
        let limit = signs.iter().find_map(|sign| text.trim().strip_prefix(sign));
        if let Some(limit) = limit {
            return Ok(Amounts::Symmetric(quantity(limit)?));
        }
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        match parts.as_slice() {
            ["uniform", low, high] => Ok(Amounts::Uniform(quantity(low)?, quantity(high)?)),
            ["normal", sigma] => Ok(Amounts::Normal(quantity(sigma)?)),
            _ => Err(USAGE.into()),
        }
    }
}

fn quantity(text: &str) -> Result<Quantity, String> {
    text.parse()
        .map_err(|error: QuantityError| error.to_string())
}

impl Tolerance {
    /// The key; it may contain `*`.
    pub fn pattern(&self) -> &str {
        &self.pattern
    }

    /// Whether the tolerance applies to this key.
    pub fn matches(&self, key: &str) -> bool {
        let (patterns, parts) = (self.pattern.split('.'), key.split('.'));
        patterns.clone().count() == parts.clone().count()
            && patterns.zip(parts).all(|(p, part)| glob(p, part))
    }

    /// The deviation of one of its settings from a nominal value, on a plant with beams of this length.
    ///
    /// # Errors
    /// The range is empty, the unit is not that of the setting, or the deviation is a percentage of zero.
    pub fn deviation(
        &self,
        key: &str,
        nominal: f64,
        beam_length_m: Option<f64>,
    ) -> Result<Deviation, StudyError> {
        let amount = |quantity| self.amount(key, nominal, beam_length_m, quantity);
        match &self.amounts {
            Amounts::Symmetric(limit) => {
                let limit = amount(limit)?;
                self.uniform(key, -limit, limit)
            }
            Amounts::Uniform(low, high) => self.uniform(key, amount(low)?, amount(high)?),
            Amounts::Normal(sigma) => self.normal(key, amount(sigma)?),
        }
    }

    fn uniform(&self, key: &str, low: f64, high: f64) -> Result<Deviation, StudyError> {
        if low < high {
            return Ok(Deviation::Uniform { low, high });
        }
        Err(self.wrong(format!(
            "the tolerance of `{key}` is empty: from {low} to {high}; give a lower and a higher limit"
        )))
    }

    fn normal(&self, key: &str, sigma: f64) -> Result<Deviation, StudyError> {
        if sigma > 0.0 {
            return Ok(Deviation::Normal { sigma });
        }
        Err(self.wrong(format!(
            "the standard deviation of `{key}` is {sigma}; give one above zero"
        )))
    }

    fn amount(
        &self,
        key: &str,
        nominal: f64,
        beam_length_m: Option<f64>,
        quantity: &Quantity,
    ) -> Result<f64, StudyError> {
        let has_reference =
            key == Quantity::OPERATING_POINT || Dimension::of_key(key) == Dimension::Ratio;
        match quantity.percentage().filter(|_| !has_reference) {
            Some(_) if nominal == 0.0 => Err(self.wrong(format!(
                "a percentage of `{key}` is of its nominal value, which is 0; give the deviation in the unit of the setting"
            ))),
            Some(share) => Ok(share * nominal.abs()),
            None => quantity
                .for_setting(key, beam_length_m)
                .map_err(|error| self.wrong(error.to_string())),
        }
    }

    /// A refusal of this tolerance.
    pub fn wrong(&self, why: String) -> StudyError {
        StudyError::Tolerance {
            text: self.text.clone(),
            why,
        }
    }
}

/// Whether `text` is `pattern`, in which a `*` matches any characters.
fn glob(pattern: &str, text: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == text,
        Some((head, tail)) => text.strip_prefix(head).is_some_and(|rest| {
            let ends = rest.char_indices().map(|(at, _)| at).chain([rest.len()]);
            ends.into_iter().any(|at| glob(tail, &rest[at..]))
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deviation(text: &str, key: &str, nominal: f64) -> Result<Deviation, StudyError> {
        text.parse::<Tolerance>()
            .unwrap()
            .deviation(key, nominal, Some(0.05))
    }

    #[test]
    fn percentages_are_of_beam_length_one_or_nominal_value() {
        let uniform = |low, high| Ok(Deviation::Uniform { low, high });
        assert_eq!(deviation("k=uniform:-0.5:2", "k", 7.0), uniform(-0.5, 2.0));
        assert_eq!(deviation("k=+-50%", "k", -3.0), uniform(-0.5, 0.5));
        assert_eq!(deviation("k = ±2", "k", 0.0), uniform(-2.0, 2.0));
        assert_eq!(
            deviation("y_m=uniform:-1mm:0.5", "y_m", 0.0),
            uniform(-1e-3, 0.5)
        );
        let point = deviation("*=+-5%", "plant.operating_point_m", 0.004);
        assert_eq!(point, uniform(-0.05 * 0.05, 0.05 * 0.05));
        assert_eq!(deviation("m_kg=+-50%", "m_kg", -3.0), uniform(-1.5, 1.5));
        let quarter = Ok(Deviation::Normal { sigma: 1.0 });
        assert_eq!(deviation("m_kg=normal:25%", "m_kg", 4.0), quarter);
    }

    #[test]
    fn a_star_matches_part_of_one_name() {
        let tolerance: Tolerance = "plant.*.s*=+-1".parse().unwrap();
        for (key, good) in [
            ("plant.a.s", true),
            ("plant.a.sL", true),
            ("plant.a.gL", false),
            ("plant.a.b.sL", false),
        ] {
            assert_eq!(tolerance.matches(key), good, "{key}");
        }
    }

    #[test]
    fn rejects_invalid_tolerance() {
        for text in [
            "k",
            "k=",
            "k=uniform:1",
            "k=uniform:1:x",
            "k=normal:",
            "k=gauss:1",
            "k=+-",
            "k=uniform:1:2:3",
        ] {
            let error = text.parse::<Tolerance>().unwrap_err().to_string();
            assert!(error.contains(text), "{error}");
        }
    }

    #[test]
    fn rejects_tolerance_without_effect_or_with_a_wrong_unit() {
        for (text, word) in [
            ("k=uniform:1:1", "empty"),
            ("k=uniform:2:1", "empty"),
            ("k=+-0", "empty"),
            ("k=normal:0", "above zero"),
            ("k=normal:-1", "above zero"),
            ("k=+-1mm", "a length in m"),
            ("m_kg=+-5%", "nominal value"),
        ] {
            let key = text.split('=').next().expect("a key");
            let error = deviation(text, key, 0.0).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains(text), "{error}");
        }
    }

    #[test]
    fn ranks_are_those_of_the_distributions() {
        let uniform = Deviation::Uniform {
            low: -1.0,
            high: 3.0,
        };
        assert_eq!(uniform.drawn([0.25, 0.9]), (0.0, 0.25));
        let normal = Deviation::Normal { sigma: 2.0 };
        // sqrt(-2 ln(1 - a)) = 1 at a = 1 - exp(-1/2); the normal distribution function at 1 is 0.8413447460685429.
        let one = 1.0 - (-0.5f64).exp();
        for (b, value, rank) in [
            (0.0, 2.0, 0.841_344_746_068_542_9),
            (0.5, -2.0, 0.158_655_253_931_457_05),
            (0.25, 0.0, 0.5),
        ] {
            let drawn = normal.drawn([one, b]);
            assert!(
                (drawn.0 - value).abs() < 1e-14 && (drawn.1 - rank).abs() < 1e-14,
                "{drawn:?}"
            );
        }
        // Ten roundings of 1e-16 at the largest number below 1.
        assert_eq!(normal.drawn([1.0 - f64::EPSILON / 2.0, 0.0]).0, 12.0);
    }
}
