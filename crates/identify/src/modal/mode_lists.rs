//! The modes of a fit, apart in its band and beyond it.

use super::FittedMode;

/// The modes of a fit, apart those that lie in its band and those beyond it.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeLists {
    /// Between the lowest and the highest fitted frequency, and a free body.
    pub in_band: Vec<FittedMode>,
    /// Elsewhere: they stand for all that lies beyond the band.
    pub outside: Vec<FittedMode>,
}

impl ModeLists {
    /// The modes of a fit between two frequencies in hertz, in their order.
    pub fn new(modes: &[FittedMode], (low_hz, high_hz): (f64, f64)) -> ModeLists {
        let is_in_band = |mode: &FittedMode| {
            let frequency_hz = mode.frequency_hz().value;
            frequency_hz == 0.0 || (low_hz..=high_hz).contains(&frequency_hz)
        };
        let (in_band, outside) = modes.iter().copied().partition(is_in_band);
        ModeLists { in_band, outside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Estimate;

    fn mode_at(frequency_hz: f64) -> FittedMode {
        let estimate = |value: f64| Estimate { value, sigma: 0.01 };
        FittedMode {
            omega_rad_s: estimate(std::f64::consts::TAU * frequency_hz),
            damping_ratio: estimate(0.05),
            residue_per_kg: estimate(-0.5),
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        }
    }

    #[test]
    fn modes_beyond_the_band_are_listed_apart_and_a_free_body_is_not() {
        let modes = [0.0, 4.9, 5.1, 99.0, 101.0, 1700.0].map(mode_at);
        let lists = ModeLists::new(&modes, (5.0, 100.0));
        let hz = |modes: &[FittedMode]| -> Vec<f64> {
            let frequencies = modes.iter().map(|mode| mode.frequency_hz().value);
            frequencies.map(|hz| (10.0 * hz).round() / 10.0).collect()
        };
        assert_eq!(hz(&lists.in_band), [0.0, 5.1, 99.0]);
        assert_eq!(hz(&lists.outside), [4.9, 101.0, 1700.0]);
    }
}
