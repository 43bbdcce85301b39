//! The frequency response function as measured: value, coherence and confidence at each frequency.

use core::f64::consts::PI;

use nalgebra::Complex;

/// Standard deviation of a phase of which nothing is known: uniform over one turn, pi/sqrt(3) rad = 103.9 deg.
pub const PHASE_SIGMA_LIMIT_RAD: f64 = PI / 1.732_050_807_568_877_2;

/// What the magnitude of a response counts in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// From current to displacement.
    MetresPerAmpere,
    /// A ratio, or in units that a person knows.
    Bare,
}

/// A measured frequency response. All columns have one entry a frequency, frequencies rise, every entry is finite.
///
/// A frequency at which the input had no energy is left out rather than filled in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frf {
    /// Frequencies in hertz.
    pub frequency_hz: Vec<f64>,
    /// H = output / input in metres per ampere; a lag is a negative phase.
    pub response: Vec<Complex<f64>>,
    /// Magnitude-squared coherence, 0 to 1: the share of the output's power that the input explains.
    pub coherence: Vec<f64>,
    /// Standard deviation of |H| in metres per ampere.
    pub magnitude_sigma: Vec<f64>,
    /// Standard deviation of arg H in radians, at most [`PHASE_SIGMA_LIMIT_RAD`].
    pub phase_sigma_rad: Vec<f64>,
    /// Equivalent noise bandwidth in hertz of the weights whose mean the estimate is: the width of the rectangle over
    /// which averaging would lessen noise as much. Anything narrower in the plant is smeared.
    pub resolution_hz: Vec<f64>,
}

/// One frequency of an [`Frf`], before it is split into columns.
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

impl Frf {
    /// Number of frequencies.
    pub fn len(&self) -> usize {
        self.frequency_hz.len()
    }

    /// Whether there is no frequency at all.
    pub fn is_empty(&self) -> bool {
        self.frequency_hz.is_empty()
    }

    /// Half of the frequencies have at least this coherence.
    pub fn median_coherence(&self) -> Option<f64> {
        let mut sorted = self.coherence.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }

    /// The response as it would be `delay_s` earlier: H exp(j w delay).
    pub fn earlier(&self, delay_s: f64) -> Frf {
        let turned =
            |(f, h): (&f64, &Complex<f64>)| h * Complex::from_polar(1.0, 2.0 * PI * f * delay_s);
        let response = self
            .frequency_hz
            .iter()
            .zip(&self.response)
            .map(turned)
            .collect();
        Frf {
            response,
            ..self.clone()
        }
    }

    /// Phase in radians, in (-pi, pi].
    pub fn phase_rad(&self, index: usize) -> f64 {
        wrapped_phase_rad(self.response[index])
    }

    /// Appends a frequency; says no to one whose numbers are not finite.
    ///
    /// The error of H is circular, half its power lies along H and half across: sigma(|H|) = sqrt(E|error|^2 / 2) and
    /// sigma(arg H) = sigma(|H|) / |H|, as long as that is small. It cannot exceed that of a phase that is anywhere.
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
}

/// arg H in (-pi, pi]: the one value that atan2 gives beyond that, -pi (of a negative zero), is pi.
pub fn wrapped_phase_rad(response: Complex<f64>) -> f64 {
    let phase = response.arg();
    if phase <= -PI { PI } else { phase }
}

/// sigma/|H|, up to what can be said of a phase at all (0/0, neither response nor noise, included).
fn phase_sigma_rad(sigma: f64, magnitude: f64) -> f64 {
    if sigma < PHASE_SIGMA_LIMIT_RAD * magnitude {
        sigma / magnitude
    } else {
        PHASE_SIGMA_LIMIT_RAD
    }
}
