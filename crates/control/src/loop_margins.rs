//! The margins that the model of a loop and a measured loop have in common.

use serde::Serialize;

/// A frequency at which |L| passes through 1, as numbers of type `Q`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Crossing<Q = f64> {
    /// Frequency in rad/s.
    pub rad_s: Q,
    /// 180 deg + arg L there, within +-180 deg.
    pub phase_margin_deg: Q,
}

/// Margins of a loop, defined in `margins`. Their type `Q` is `f64` by a model and [`Estimate`](bench_base::estimate::Estimate), with a
/// standard deviation, by a measurement. `None` where there is no such crossing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LoopMargins<Q> {
    /// Lowest frequency in rad/s at which |L| falls through 1.
    pub crossover_rad_s: Option<Q>,
    /// Phase margin of smallest magnitude over all crossings of |L| = 1, in degrees.
    pub phase_margin_deg: Option<Q>,
    /// Frequency of this phase margin in rad/s.
    pub phase_margin_rad_s: Option<f64>,
    /// Smallest gain margin over all phase crossover frequencies, in dB.
    pub gain_margin_db: Option<Q>,
    /// Frequency of this gain margin in rad/s.
    pub gain_margin_rad_s: Option<f64>,
    /// Smallest positive gain margin in dB: the loop gain may rise by less.
    pub upper_gain_margin_db: Option<Q>,
    /// Its frequency in rad/s.
    pub upper_gain_margin_rad_s: Option<f64>,
    /// Largest negative gain margin in dB: the loop gain may fall by less.
    pub lower_gain_margin_db: Option<Q>,
    /// Its frequency in rad/s.
    pub lower_gain_margin_rad_s: Option<f64>,
    /// Smallest additional delay in seconds with which L reaches -1.
    pub delay_margin_s: Option<Q>,
    /// The crossing of |L| = 1 at which it does, in rad/s.
    pub delay_margin_rad_s: Option<f64>,
    /// 1/max |S|: the distance of L from -1.
    pub modulus_margin: Q,
    /// 20 log10 max |S|.
    pub sensitivity_peak_db: Q,
    /// Frequency of this peak in rad/s.
    pub sensitivity_peak_rad_s: f64,
    /// Lowest frequency in rad/s at which |S| rises through 1/sqrt(2).
    pub sensitivity_bandwidth_rad_s: Option<Q>,
}
