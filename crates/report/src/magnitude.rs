//! The axis of magnitudes: logarithmic, or in decibels.

use super::chart::{Scale, SeriesPoint};
use bench_identify::Unit;

/// Spacing and numbers of the axis of a magnitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MagnitudeAxis {
    /// Logarithmic, in the unit of the magnitude.
    #[default]
    Logarithmic,
    /// Linear in 20 lg of the magnitude in its SI unit.
    Decibels,
}

/// The unit of a magnitude and its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MagnitudeScale {
    unit: Unit,
    axis: MagnitudeAxis,
}

impl MagnitudeScale {
    pub const fn new(unit: Unit, axis: MagnitudeAxis) -> MagnitudeScale {
        MagnitudeScale { unit, axis }
    }

    /// The axis of a quantity between two magnitudes above 0.
    pub fn axis(self, quantity: &str, (low, high): (f64, f64)) -> Scale {
        let unit = match (self.axis, self.unit) {
            (MagnitudeAxis::Logarithmic, Unit::MetresPerAmpere) => " (m/A)",
            (MagnitudeAxis::Logarithmic, Unit::Bare) => "",
            (MagnitudeAxis::Decibels, Unit::MetresPerAmpere) => " (dB re 1 m/A)",
            (MagnitudeAxis::Decibels, Unit::Bare) => " (dB)",
        };
        let label = format!("{quantity}{unit}");
        let scale = match self.axis {
            MagnitudeAxis::Logarithmic => Scale::logarithmic(&label),
            MagnitudeAxis::Decibels => Scale::linear(&label),
        };
        scale.within(self.value(low), self.value(high))
    }

    /// A magnitude as a value of the axis; 0 is at its lower end.
    pub fn value(self, magnitude: f64) -> f64 {
        match self.axis {
            MagnitudeAxis::Logarithmic => magnitude,
            MagnitudeAxis::Decibels => 20.0 * libm::log10(magnitude.max(f64::MIN_POSITIVE)),
        }
    }

    /// A point whose magnitude and band become values of the axis.
    pub fn point(self, point: SeriesPoint) -> SeriesPoint {
        let (low, high) = point.band;
        SeriesPoint {
            y: self.value(point.y),
            band: (self.value(low), self.value(high)),
            ..point
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_is_minus_20_decibels() {
        let scale = MagnitudeScale::new(Unit::MetresPerAmpere, MagnitudeAxis::Decibels);
        assert!((scale.value(0.1) + 20.0).abs() < 1e-12);
        assert!(scale.value(0.0) < -6000.0 && scale.value(-1.0).is_finite());
        let axis = scale.axis("Magnitude", (1e-6, 1e-3));
        let (low, high) = axis.range.unwrap();
        assert!((low + 120.0).abs() < 1e-9 && (high + 60.0).abs() < 1e-9);
        assert_eq!(axis.label, "Magnitude (dB re 1 m/A)");
    }
}
