//! Frequency response functions as measured: value, coherence and standard deviations at each frequency.

use core::f64::consts::PI;

use nalgebra::Complex;

/// Largest standard deviation of a phase, that of a uniform distribution over one turn: pi/sqrt(3) rad = 103.9 deg.
pub const PHASE_SIGMA_LIMIT_RAD: f64 = PI / 1.732_050_807_568_877_2;

/// Unit of the magnitude of a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres per ampere: from current to displacement.
    MetresPerAmpere,
    /// A ratio, or the units of the columns of an external record.
    Bare,
}

/// A measured frequency response. All columns have one entry per frequency; frequencies rise; every entry is finite.
///
/// A frequency at which the input had no energy is omitted. The errors of neighbouring points are correlated where the points are closer
/// than the resolution; those of [`Frf::data`] are independent.
///
/// ```
/// use bench_identify::{Frf, FrfPoint};
///
/// let mut frf = Frf::default();
/// let added = frf.push(FrfPoint {
///     frequency_hz: 29.3,
///     response: nalgebra::Complex::new(0.0, -3.4e-4),
///     coherence: 0.999,
///     variance: 2e-12,
///     resolution_hz: 0.1,
/// });
/// assert_eq!(frf.band_hz(), (29.3, 29.3));
/// assert!(added && (frf.phase_rad(0).to_degrees() + 90.0).abs() < 1e-12);
/// // sigma(|H|) = sqrt(variance/2)
/// assert!((frf.magnitude_sigma[0] - 1e-6).abs() < 1e-18);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frf {
    /// Frequencies in hertz.
    pub frequency_hz: Vec<f64>,
    /// H = output/input in metres per ampere; a lag is a negative phase.
    pub response: Vec<Complex<f64>>,
    /// Magnitude-squared coherence, 0 to 1: the ratio of the output's power that the input explains.
    pub coherence: Vec<f64>,
    /// Standard deviation of |H| in metres per ampere.
    pub magnitude_sigma: Vec<f64>,
    /// Standard deviation of arg H in radians, at most [`PHASE_SIGMA_LIMIT_RAD`].
    pub phase_sigma_rad: Vec<f64>,
    /// Equivalent noise bandwidth of the estimator in hertz: the width of the rectangular average with the same noise
    /// reduction. Features of the plant that are narrower are smeared.
    pub resolution_hz: Vec<f64>,
    /// The same response without smoothing, for a fit; frequencies rise. Empty if it was not estimated from samples, as that of a CSV
    /// file, or if the record has no noise.
    pub data: Vec<FrfDatum>,
}

/// One frequency of an [`Frf`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrfPoint {
    /// Frequency in hertz.
    pub frequency_hz: f64,
    /// H in metres per ampere.
    pub response: Complex<f64>,
    /// Magnitude-squared coherence, 0 to 1.
    pub coherence: f64,
    /// E|error of H|^2 in (m/A)^2.
    pub variance: f64,
    /// See [`Frf::resolution_hz`].
    pub resolution_hz: f64,
}

/// One datum of a response for a parametric fit: the mean response over a few neighbouring bins. The errors of different data are
/// independent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrfDatum {
    /// Mean frequency of the bins in hertz, weighted with the power of the input.
    pub frequency_hz: f64,
    /// Standard deviation of the bins' frequencies about their mean, with the same weights, in hertz.
    pub spread_hz: f64,
    /// Mean of H in metres per ampere.
    pub response: Complex<f64>,
    /// E|error of the response|^2 in (m/A)^2.
    pub variance: f64,
}

/// The points of several responses of the same plant, each where its standard deviation is the smallest, and the data of all;
/// frequencies rise.
pub fn best_of(frfs: &[Frf]) -> Frf {
    let mut points: Vec<(usize, usize)> = Vec::new();
    for (which, frf) in frfs.iter().enumerate() {
        let best = (0..frf.len()).filter(|index| is_best(frfs, which, *index));
        points.extend(best.map(|index| (which, index)));
    }
    let hz = |(which, index): (usize, usize)| frfs[which].frequency_hz[index];
    points.sort_by(|a, b| hz(*a).total_cmp(&hz(*b)));
    points.dedup_by(|a, b| hz(*a) <= hz(*b));
    let mut best = Frf::default();
    for (which, index) in points {
        best.take_from(&frfs[which], index);
    }
    best.data = frfs.iter().flat_map(|frf| &frf.data).copied().collect();
    best.data
        .sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    best
}

/// Whether no other response has a smaller standard deviation at the frequency of a point, within its band.
fn is_best(frfs: &[Frf], which: usize, index: usize) -> bool {
    let (hz, sigma) = (
        frfs[which].frequency_hz[index],
        frfs[which].magnitude_sigma[index],
    );
    let others = frfs.iter().enumerate().filter(|(other, _)| *other != which);
    let mut sigmas = others.filter_map(|(_, frf)| frf.magnitude_sigma_at(hz));
    sigmas.all(|other| sigma <= other)
}

impl FrfDatum {
    /// The datum with an error that is a ratio of its response added to its noise.
    pub(crate) fn with_relative_error(&self, ratio: f64) -> FrfDatum {
        FrfDatum {
            variance: self.variance + ratio * ratio * self.response.norm_sqr(),
            ..*self
        }
    }

    /// Angular frequency in rad/s.
    pub fn omega_rad_s(&self) -> f64 {
        2.0 * PI * self.frequency_hz
    }
}

/// The data with an error that is a ratio of the response added to their noise.
pub(crate) fn with_relative_error(data: &[FrfDatum], ratio: f64) -> Vec<FrfDatum> {
    let increased = data.iter().map(|datum| datum.with_relative_error(ratio));
    increased.collect()
}

impl Frf {
    /// Number of frequencies.
    pub fn len(&self) -> usize {
        self.frequency_hz.len()
    }

    /// Whether there are no frequencies.
    pub fn is_empty(&self) -> bool {
        self.frequency_hz.is_empty()
    }

    /// Lowest and highest frequency in hertz; 0 and 0 without frequencies.
    pub fn band_hz(&self) -> (f64, f64) {
        let ends = [self.frequency_hz.first(), self.frequency_hz.last()];
        let [from_hz, to_hz] = ends.map(|hz| hz.copied().unwrap_or_default());
        (from_hz, to_hz)
    }

    /// Median of the coherence over the frequencies.
    pub fn median_coherence(&self) -> Option<f64> {
        let mut sorted = self.coherence.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }

    /// The points of a band, limits included, without data for a fit.
    pub fn between_hz(&self, low_hz: f64, high_hz: f64) -> Frf {
        let mut within = Frf::default();
        for (k, hz) in self.frequency_hz.iter().enumerate() {
            if (low_hz..=high_hz).contains(hz) {
                within.take_from(self, k);
            }
        }
        within
    }

    /// The response with a delay removed from its phases: H exp(j w delay).
    pub fn without_delay(&self, delay_s: f64) -> Frf {
        let advanced =
            |f: f64, h: Complex<f64>| h * Complex::from_polar(1.0, 2.0 * PI * f * delay_s);
        let points = self.frequency_hz.iter().zip(&self.response);
        let data = self.data.iter().map(|datum| FrfDatum {
            response: advanced(datum.frequency_hz, datum.response),
            ..*datum
        });
        Frf {
            response: points.map(|(f, h)| advanced(*f, *h)).collect(),
            data: data.collect(),
            ..self.clone()
        }
    }

    /// Standard deviation of |H| at the point below a frequency within the band; `None` outside.
    fn magnitude_sigma_at(&self, frequency_hz: f64) -> Option<f64> {
        let after = self.frequency_hz.partition_point(|hz| *hz <= frequency_hz);
        let is_last = self.frequency_hz.last() == Some(&frequency_hz);
        let is_within = after < self.len() || is_last;
        let before = after.checked_sub(1).filter(|_| is_within)?;
        self.magnitude_sigma.get(before).copied()
    }

    /// Appends another response, of higher frequencies.
    pub fn append(&mut self, other: Frf) {
        self.frequency_hz.extend(other.frequency_hz);
        self.response.extend(other.response);
        self.coherence.extend(other.coherence);
        self.magnitude_sigma.extend(other.magnitude_sigma);
        self.phase_sigma_rad.extend(other.phase_sigma_rad);
        self.resolution_hz.extend(other.resolution_hz);
        self.data.extend(other.data);
    }

    /// Appends a point of another response.
    fn take_from(&mut self, other: &Frf, index: usize) {
        self.frequency_hz.push(other.frequency_hz[index]);
        self.response.push(other.response[index]);
        self.coherence.push(other.coherence[index]);
        self.magnitude_sigma.push(other.magnitude_sigma[index]);
        self.phase_sigma_rad.push(other.phase_sigma_rad[index]);
        self.resolution_hz.push(other.resolution_hz[index]);
    }

    /// Phase in radians, in (-pi, pi].
    pub fn phase_rad(&self, index: usize) -> f64 {
        wrapped_phase_rad(self.response[index])
    }

    /// Appends a frequency; returns false and appends nothing if a number is not finite.
    ///
    /// The error of H is circular, half its power lies along H and half across it: sigma(|H|) = sqrt(E|error|^2 / 2) and
    /// sigma(arg H) = sigma(|H|) / |H| as long as that is small; it is limited to [`PHASE_SIGMA_LIMIT_RAD`].
    pub fn push(&mut self, point: FrfPoint) -> bool {
        let sigma = (point.variance / 2.0).sqrt();
        let magnitude = point.response.norm();
        if !(sigma.is_finite() && magnitude.is_finite() && point.coherence.is_finite()) {
            return false;
        }
        self.frequency_hz.push(point.frequency_hz);
        self.response.push(point.response);
        self.coherence.push(point.coherence.clamp(0.0, 1.0));
        self.magnitude_sigma.push(sigma);
        self.phase_sigma_rad.push(phase_sigma_rad(sigma, magnitude));
        self.resolution_hz.push(point.resolution_hz);
        true
    }

    /// Appends points; those with a number that is not finite are omitted.
    pub(super) fn extend(&mut self, points: impl IntoIterator<Item = FrfPoint>) {
        for point in points {
            self.push(point);
        }
    }

    /// The response, or an error if it has no frequencies.
    pub(super) fn excited(self, band_hz: (f64, f64)) -> Result<Frf, super::IdentifyError> {
        if self.is_empty() {
            Err(super::IdentifyError::not_excited(band_hz))
        } else {
            Ok(self)
        }
    }

    /// The response, or an error if it has no data for a fit.
    pub(super) fn with_data(self, band_hz: (f64, f64)) -> Result<Frf, super::IdentifyError> {
        if self.data.is_empty() {
            Err(super::IdentifyError::not_excited(band_hz))
        } else {
            Ok(self)
        }
    }
}

/// arg H in (-pi, pi]: -pi, which atan2 returns for a negative zero, becomes pi.
pub fn wrapped_phase_rad(response: Complex<f64>) -> f64 {
    let phase = response.arg();
    if phase <= -PI { PI } else { phase }
}

/// sigma/|H|, limited; the limit also applies to 0/0 (neither response nor noise).
fn phase_sigma_rad(sigma: f64, magnitude: f64) -> f64 {
    if sigma < PHASE_SIGMA_LIMIT_RAD * magnitude {
        sigma / magnitude
    } else {
        PHASE_SIGMA_LIMIT_RAD
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_data(frequencies_hz: &[f64]) -> Frf {
        let data = frequencies_hz.iter().map(|hz| FrfDatum {
            frequency_hz: *hz,
            spread_hz: 0.0,
            response: Complex::new(1.0, 0.0),
            variance: 1e-6,
        });
        Frf {
            data: data.collect(),
            ..Frf::default()
        }
    }

    #[test]
    fn best_of_several_responses_has_the_data_of_all_in_rising_order() {
        let best = best_of(&[of_data(&[1.0, 3.0]), of_data(&[2.0, 3.0])]);
        let frequencies: Vec<f64> = best.data.iter().map(|datum| datum.frequency_hz).collect();
        assert_eq!(frequencies, [1.0, 2.0, 3.0, 3.0]);
    }

    #[test]
    fn data_without_a_delay_are_advanced_by_it() {
        // 50 ms at 5 Hz are a quarter of a turn.
        let without = of_data(&[5.0]).without_delay(0.05);
        assert!((without.data[0].response - Complex::new(0.0, 1.0)).norm() < 1e-12);
    }
}
