//! Amperes and the counts of a drive: per mille of a reference current.
//!
//! Target 0x6071 and actual value 0x6077 are i16 in per mille of rated torque (CiA 402-2); for a motor whose force is
//! proportional to its current this is per mille of rated current 0x6075. Some drives refer them to the maximum 0x6072, which is
//! itself in per mille of rated. One count of a 4 A drive is 4 mA. The resulting current therefore differs from the requested
//! one, and a recording must contain the resulting one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The current that 1000 counts of the target stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reference {
    /// The rated current, 0x6075.
    #[default]
    Rated,
    /// The maximum 0x6072, per mille of the rated current.
    Maximum,
}

/// Converts between amperes and counts.
///
/// ```
/// let scale = bench_hal::can::scale::Scale::new(4.0, 3.0).unwrap();
/// assert_eq!(scale.counts(1.0), 250);          // 1 A of 4 A
/// assert_eq!(scale.amperes(scale.counts(0.9999)), 1.0); // one count is 4 mA
/// assert_eq!(scale.counts(-9.0), -750);        // limited to 3 A
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    reference_a: f64,
    limit: i16,
}

impl Scale {
    /// A scale in which 1000 counts are `reference_a`, limited to +-`limit_a`. `None` unless both are positive and finite, and the
    /// limit is at least one count.
    pub fn new(reference_a: f64, limit_a: f64) -> Option<Scale> {
        let is_valid =
            reference_a.is_finite() && reference_a > 0.0 && limit_a.is_finite() && limit_a > 0.0;
        // Rounded down, so that the limit is not exceeded; 1e-9 compensates for the rounding of the division.
        let limit = (limit_a / reference_a * 1000.0 + 1e-9).floor();
        (is_valid && limit >= 1.0).then_some(Scale {
            reference_a,
            limit: limit.min(f64::from(i16::MAX)) as i16,
        })
    }

    /// The nearest count within the limit; 0 if `current_a` is not a number.
    pub fn counts(&self, current_a: f64) -> i16 {
        let counts = (current_a / self.reference_a * 1000.0).round() as i16; // `as` saturates and turns NaN into 0
        counts.clamp(-self.limit, self.limit)
    }

    /// The current of a count, in amperes.
    pub fn amperes(&self, counts: i16) -> f64 {
        f64::from(counts) * self.reference_a / 1000.0
    }

    /// The current of one count, in amperes.
    pub fn step_a(&self) -> f64 {
        self.reference_a / 1000.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rejects_invalid_scales() {
        for (reference_a, limit_a) in [
            (0.0, 1.0),
            (-1.0, 1.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
            (1.0, 0.0005),
        ] {
            assert_eq!(
                Scale::new(reference_a, limit_a),
                None,
                "{reference_a} {limit_a}"
            );
        }
    }

    #[test]
    fn nan_is_zero_current() {
        let scale = Scale::new(4.0, 4.0).unwrap();
        assert_eq!(scale.counts(f64::NAN), 0);
        assert_eq!(
            (scale.counts(f64::INFINITY), scale.counts(f64::NEG_INFINITY)),
            (1000, -1000)
        );
    }

    proptest! {
        #[test]
        fn quantisation_is_half_a_count_at_most_and_the_limit_holds(
            reference_a in 0.01..100.0, share in 0.01..5.0, current_a in -500.0..500.0,
        ) {
            let limit_a = reference_a * share;
            let scale = Scale::new(reference_a, limit_a).unwrap();
            let given_a = scale.amperes(scale.counts(current_a));
            prop_assert!(given_a.abs() <= limit_a * (1.0 + 1e-9));
            if current_a.abs() <= limit_a - scale.step_a() {
                prop_assert!((given_a - current_a).abs() <= 0.5000001 * scale.step_a());
            }
            prop_assert_eq!(scale.counts(given_a), scale.counts(current_a), "a given current is given again");
            prop_assert_eq!(scale.counts(-current_a), -scale.counts(current_a));
        }
    }
}
