//! The measured band: gaps in it, and bounds by the model outside of it.

use serde::Serialize;

use super::error::MeasuredLoopError;
use super::margins::MeasuredMargins;
use super::measured_loop::MeasuredLoop;
use super::point::ResponsePoint;
use crate::ClosedLoop;
use bench_base::units::hz;

/// Points further apart than this many resolutions have a gap between them.
const GAP_RESOLUTIONS: f64 = 2.0;
/// A bound of |S| outside the band below this is not a peak, whatever |S| is inside.
const NO_PEAK: f64 = 1.1;

/// |L| and |S| in a range of frequencies that was not measured, by the model. The model is used as it is and scaled to the measured
/// response at the end of the band, whichever is worse; its phase is not used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RangeBound {
    /// Lower end of the range in rad/s.
    pub from_rad_s: f64,
    /// Upper end in rad/s.
    pub to_rad_s: f64,
    /// Smallest |L|.
    pub min_loop_gain: f64,
    /// Largest |L|.
    pub max_loop_gain: f64,
    /// Bound of |S|: the largest 1/||L| - 1|. Not finite, `null` in JSON, if |L| may pass through 1.
    pub max_sensitivity: f64,
    /// Measured response over that of the model at the end of the band, in magnitude.
    pub measured_over_model: f64,
}

/// What lies outside the measured band, by the model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OutsideBand {
    /// Below the first measured frequency.
    pub below: RangeBound,
    /// Above the last one, up to half the sampling rate.
    pub above: RangeBound,
}

/// The smallest damping ratio of the modes of a model.
pub fn least_damping_ratio(model: &ClosedLoop) -> f64 {
    let modes = model.modes().iter().filter(|mode| mode.omega_rad_s > 0.0);
    modes.map(|mode| mode.damping_ratio).fold(0.5, f64::min)
}

/// Refuses gaps that may hide a resonance: wider than the resonance with the smallest damping ratio of the stage, and wider than the
/// resolution of the measurement.
///
/// # Errors
/// [`MeasuredLoopError::Gap`].
pub fn check_gaps(
    points: &[ResponsePoint],
    least_damping_ratio: f64,
) -> Result<(), MeasuredLoopError> {
    for pair in points.windows(2) {
        let [from, to] = [pair[0].omega_rad_s, pair[1].omega_rad_s];
        let resolution = pair[0].resolution_rad_s.max(pair[1].resolution_rad_s);
        let width = 2.0 * least_damping_ratio * from;
        if to - from > (GAP_RESOLUTIONS * resolution).max(width) {
            return Err(MeasuredLoopError::Gap {
                from_hz: hz(from),
                to_hz: hz(to),
                width_hz: hz(width),
            });
        }
    }
    Ok(())
}

impl OutsideBand {
    /// The bounds outside of a measured loop.
    pub fn of(measured: &MeasuredLoop<'_>, model: &ClosedLoop) -> OutsideBand {
        let (low, high) = measured.band_rad_s();
        let first = model.lowest_rad_s().min(0.1 * low);
        let last = model.nyquist_rad_s() * (1.0 - 1e-9);
        OutsideBand {
            below: RangeBound::of(model, (first, low), ratio(measured, model, low)),
            above: RangeBound::of(model, (high, last), ratio(measured, model, high)),
        }
    }

    /// Refuses a band without the crossover or the peak of |S|.
    pub fn check(
        &self,
        measured: &MeasuredLoop<'_>,
        margins: &MeasuredMargins,
    ) -> Result<(), MeasuredLoopError> {
        let (low, high) = measured.band_rad_s();
        let [at_low, at_high] = [low, high].map(|w| measured.loop_gain(w).norm());
        let (below, above) = (&self.below, &self.above);
        if below.passes_one() || (at_low > 1.0) != (below.max_loop_gain > 1.0) {
            return Err(MeasuredLoopError::CrossingBelow {
                first_hz: hz(low),
                loop_gain: at_low,
                least: below.min_loop_gain,
                most: below.max_loop_gain,
            });
        }
        let most = above.max_loop_gain.max(at_high);
        if most >= 1.0 {
            let last_hz = hz(high);
            return Err(MeasuredLoopError::CrossingAbove { last_hz, most });
        }
        self.check_peak(measured, margins)
    }

    fn check_peak(
        &self,
        measured: &MeasuredLoop<'_>,
        margins: &MeasuredMargins,
    ) -> Result<(), MeasuredLoopError> {
        let (low, high) = measured.band_rad_s();
        let inside = 1.0 / margins.modulus_margin.value;
        let [below, above] = [self.below, self.above].map(|range| range.max_sensitivity);
        let outside = below.max(above);
        if outside <= inside.max(NO_PEAK) {
            Ok(())
        } else {
            Err(MeasuredLoopError::PeakOutside {
                first_hz: hz(low),
                last_hz: hz(high),
                inside,
                peak_hz: hz(margins.sensitivity_peak_rad_s),
                outside,
            })
        }
    }
}

impl RangeBound {
    fn of(model: &ClosedLoop, (from, to): (f64, f64), ratio: f64) -> RangeBound {
        let none = RangeBound {
            from_rad_s: from,
            to_rad_s: to,
            min_loop_gain: f64::INFINITY,
            max_loop_gain: 0.0,
            max_sensitivity: 0.0,
            measured_over_model: ratio,
        };
        let frequencies = model.frequencies(from, to).into_iter();
        let gains = frequencies.map(|w| model.sampled_loop(w).norm());
        let bound = gains.fold(none, |bound, gain| bound.with(gain).with(ratio * gain));
        RangeBound {
            max_sensitivity: if bound.passes_one() {
                f64::INFINITY
            } else {
                bound.max_sensitivity
            },
            ..bound
        }
    }

    fn with(self, gain: f64) -> RangeBound {
        RangeBound {
            min_loop_gain: self.min_loop_gain.min(gain),
            max_loop_gain: self.max_loop_gain.max(gain),
            max_sensitivity: self.max_sensitivity.max(1.0 / (gain - 1.0).abs()),
            ..self
        }
    }

    /// Whether |L| may pass through 1.
    fn passes_one(&self) -> bool {
        self.min_loop_gain <= 1.0 && self.max_loop_gain >= 1.0
    }
}

/// |P measured/P of the model| at a frequency.
fn ratio(measured: &MeasuredLoop<'_>, model: &ClosedLoop, omega_rad_s: f64) -> f64 {
    (measured.plant(omega_rad_s) / model.sampled_plant(omega_rad_s)).norm()
}
