//! The power of the noise over frequency, of what curves leave.

use super::bins::Bins;
use super::settings::EstimatorSettings;

/// What curves leave is averaged with weights so many times as wide as theirs.
const NOISE_WIDTH: f64 = 2.0;

/// What is known of the noise at one place.
struct Rest {
    place: f64,
    /// sum w |e|^2
    residual: f64,
    /// The same, expected for noise of power 1.
    freedom: f64,
}

/// The noise along a band.
pub(super) struct NoiseFloor {
    rests: Vec<Rest>,
}

impl NoiseFloor {
    /// The noise between two places, and somewhat beyond.
    pub(super) fn of(
        bins: &impl Bins,
        (low, high): (f64, f64),
        settings: &EstimatorSettings,
    ) -> Self {
        Self {
            rests: left(bins, (low, high), settings),
        }
    }

    /// E|N|^2 in a bin around a place, weighted towards it.
    pub(super) fn power(&self, place: f64, half_width: f64) -> f64 {
        let reach = NOISE_WIDTH * half_width;
        let low = self
            .rests
            .partition_point(|rest| rest.place <= place - reach);
        let near = self.rests[low..]
            .iter()
            .take_while(|rest| rest.place < place + reach);
        let (residual, freedom) = near.fold((0.0, 0.0), |(residual, freedom), rest| {
            let w = libm::cos(core::f64::consts::FRAC_PI_2 * (rest.place - place) / reach).powi(2);
            (residual + w * rest.residual, freedom + w * rest.freedom)
        });
        residual / freedom
    }
}

/// What the curves of `settings` leave, half-width by half-width.
fn left(bins: &impl Bins, (low, high): (f64, f64), settings: &EstimatorSettings) -> Vec<Rest> {
    let reach = |place: f64| NOISE_WIDTH * settings.half_width(place, bins.bin_hz());
    let mut place = (low - reach(low)).max(1.0);
    let end = (high + reach(high)).min(bins.last_bin() as f64);
    let mut rests = Vec::new();
    while place <= end {
        let half_width = settings.half_width(place, bins.bin_hz());
        let fitted = bins.fit(place, half_width, settings);
        rests.extend(fitted.map(|f| Rest {
            place,
            residual: f.residual,
            freedom: f.freedom,
        }));
        place += half_width;
    }
    rests
}
