//! The default estimator: H1 over neighbouring bins of the FFT of the whole record.
//!
//! A run begins and ends at rest, so that its whole record transforms without leakage: `Y_k = H(f_k) U_k + N_k` holds
//! bin by bin, with no window and no segments. What is left is to average noise away where H is flat enough for it,
//! over a neighbourhood that grows with frequency as the widths of lightly damped modes do.
//!
//! **Bias.** Near a mode of damping ratio zeta, H is about 1/(1 + j x) with x = (f - f0)/(zeta f0), that is 1 - j x -
//! x^2 + ... at the peak. Weights cos^2 of half-width h = rho f0 have the second moment (1/3 - 2/pi^2) h^2 = (0.3615
//! h)^2, so that the peak comes out low by (0.36 rho / zeta)^2: 0.2 % at zeta = 0.004 and rho = 0.0005. Elsewhere it is
//! less.
//!
//! **Confidence.** The residual e_k = Y_k - H_k U_k holds the noise, less what the fit has taken out of it. With the
//! share
//! `w'_j = w_j |U_j|^2 / A` of each bin in the fit, where `A = sum w |U|^2` and `B = sum w^2 |U|^2`,
//!
//! ```text
//! E|e_k|^2 = S (1 - 2 w'_0 + |U_k|^2 B / A^2),     E|error of H|^2 = S B / A^2
//! ```
//!
//! S, the power of the noise around a bin, is the sum of |e|^2 over the sum of these brackets, over a neighbourhood
//! four times as wide, with weights of the same kind: sigma is then itself steady to some 13 %. It needs no
//! assumption on the noise but that it changes little over that neighbourhood. A line of noise that is narrower (the
//! floor at 5 Hz in a record of ten seconds, say) is spread over it, and sigma comes out too small on the line: record
//! longer.
//!
//! The bias grows as h^2, so that an estimate H' of twice the half-width shows it as (H' - H)/3; its square is added to
//! the variance. It tells at the peaks only: elsewhere the noise hides what little there is.

use nalgebra::Complex;

use super::spectrum::RealFft;
use super::{Frf, FrfPoint, IdentifyError, Signals, band};

/// The noise is averaged with weights so many times as wide as those of the response.
pub(super) const NOISE_WIDTH: usize = 4;
/// Input below this part of its root mean square over all bins is rounding, not excitation.
const DEAD_RATIO: f64 = 1e-9;

/// How the default estimator trades resolution for noise.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatorSettings {
    /// Half-width of the neighbourhood in bins, at least: 2 to 10000.
    pub min_half_width_bins: f64,
    /// Half-width of the neighbourhood as a ratio of frequency, where that is more: 0 to 0.1. Frequencies of the result
    /// are as far apart.
    pub resolution_ratio: f64,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self { min_half_width_bins: 4.0, resolution_ratio: 0.0005 }
    }
}

impl EstimatorSettings {
    /// Whether the settings are within their bounds.
    pub fn check(&self) -> Result<(), IdentifyError> {
        check("min_half_width_bins", self.min_half_width_bins, 2.0, 1e4)?;
        check("resolution_ratio", self.resolution_ratio, 0.0, 0.1)
    }

    /// Half-width of the neighbourhood of a bin, in bins.
    pub(super) fn half_width(&self, bin: usize) -> usize {
        self.min_half_width_bins.max(self.resolution_ratio * bin as f64).round() as usize
    }

    /// The bin after this one at which to report.
    pub(super) fn next(&self, bin: usize) -> usize {
        bin + (self.resolution_ratio * bin as f64).round().max(1.0) as usize
    }
}

fn check(name: &'static str, value: f64, least: f64, most: f64) -> Result<(), IdentifyError> {
    // A NaN compares as false, and so fails.
    if value >= least && value <= most { Ok(()) } else { Err(IdentifyError::Setting { name, value, least, most }) }
}

/// The FRF of a record that begins and ends at rest, at the frequencies of `band_hz` at which there was any input.
///
/// `H1 = sum w Y conj(U) / sum w |U|^2` over the bins j to either side of a bin, `w_j = cos^2(pi j / (2 h))`, |j| < h.
/// The same sums give the coherence |sum w Y conj(U)|^2 / (sum w |U|^2 sum w |Y|^2). See the module for the errors.
///
/// Noise on the input would bias H1 low; the input here is the current that was commanded, which is known exactly.
///
/// # Errors
/// When the signals, the band or the settings allow no estimate: see [`IdentifyError`].
pub fn estimate(signals: &Signals, band_hz: (f64, f64), settings: &EstimatorSettings) -> Result<Frf, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let record = Record::new(signals, settings, *bins.end());
    let grid = core::iter::successors(Some(*bins.start()), |bin| Some(settings.next(*bin)));
    let mut frf = Frf::default();
    for point in grid.take_while(|bin| bins.contains(bin)).filter_map(|bin| record.point(bin, settings)) {
        frf.push(point);
    }
    if frf.is_empty() { Err(IdentifyError::NotExcited { low_hz: band_hz.0, high_hz: band_hz.1 }) } else { Ok(frf) }
}

/// The whole record, bin by bin.
pub(super) struct Record {
    products: Vec<Product>,
    fits: Vec<Fit>,
    bin_hz: f64,
}

impl Record {
    pub(super) fn new(signals: &Signals, settings: &EstimatorSettings, high: usize) -> Self {
        let products = products(signals);
        let fits = fits(&products, settings, high);
        Self { products, fits, bin_hz: signals.rate_hz / signals.len() as f64 }
    }

    /// Every bin below the Nyquist frequency.
    pub(super) fn products(&self) -> &[Product] {
        &self.products
    }

    /// Distance of bins in hertz.
    pub(super) fn bin_hz(&self) -> f64 {
        self.bin_hz
    }

    /// The power of the noise E|N|^2 in a bin, unless the input is dead there.
    pub(super) fn noise_power(&self, bin: usize, settings: &EstimatorSettings) -> Option<f64> {
        self.fits[bin].response?;
        Some(noise_power(&self.fits, bin, &weights(NOISE_WIDTH * settings.half_width(bin))))
    }

    /// The estimate at a bin, unless the input is dead there.
    fn point(&self, bin: usize, settings: &EstimatorSettings) -> Option<FrfPoint> {
        let half_width = settings.half_width(bin);
        let (response, coherence) = self.fits[bin].response?;
        let wider = Sums::around(&self.products, bin, &weights(2 * half_width)).response();
        let bias = drop_of_smoothing(response, wider);
        let noise = noise_power(&self.fits, bin, &weights(NOISE_WIDTH * half_width));
        let variance = noise * self.fits[bin].gain + bias.norm_sqr();
        let (frequency_hz, resolution_hz) = (bin as f64 * self.bin_hz, self.fits[bin].width * self.bin_hz);
        Some(FrfPoint { frequency_hz, response, coherence, variance, resolution_hz })
    }
}

/// What smoothing takes off an estimate, by one of twice the half-width.
pub(super) fn drop_of_smoothing(response: Complex<f64>, wider: Complex<f64>) -> Complex<f64> {
    (wider - response) / 3.0
}

/// What one bin of the record contributes.
#[derive(Clone, Copy)]
pub(super) struct Product {
    input: Complex<f64>,
    output: Complex<f64>,
    /// |U|^2
    pub(super) uu: f64,
    /// |Y|^2
    yy: f64,
    /// Y conj(U)
    pub(super) yu: Complex<f64>,
}

/// The bins below the Nyquist frequency; entry 0, the offset, is there to count from, and never used.
fn products(signals: &Signals) -> Vec<Product> {
    let fft = RealFft::new(signals.len());
    let input = fft.transform(&mut signals.input_a.clone());
    let output = fft.transform(&mut signals.output_without_drift_m());
    let product = |(u, y): (&Complex<f64>, &Complex<f64>)| Product {
        input: *u,
        output: *y,
        uu: u.norm_sqr(),
        yy: y.norm_sqr(),
        yu: y * u.conj(),
    };
    input.iter().zip(&output).take(band::last_bin(signals.len()) + 1).map(product).collect()
}

/// The weights w_0 .. w_(h-1) on either side of a bin.
pub(super) fn weights(half_width: usize) -> Vec<f64> {
    let angle = core::f64::consts::FRAC_PI_2 / half_width as f64;
    (0..half_width).map(|j| libm::cos(angle * j as f64).powi(2)).collect()
}

/// The sums over one neighbourhood.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// sum w
    w: f64,
    /// sum w^2
    ww: f64,
    /// A = sum w |U|^2
    uu: f64,
    /// B = sum w^2 |U|^2
    wuu: f64,
    /// sum w |Y|^2
    yy: f64,
    /// sum w Y conj(U)
    yu: Complex<f64>,
}

impl Sums {
    fn around(products: &[Product], bin: usize, weights: &[f64]) -> Self {
        let reach = weights.len() - 1;
        // Bin 0 holds the probe's offset: no neighbourhood may reach it.
        let low = bin.saturating_sub(reach).max(1);
        let high = (bin + reach).min(products.len() - 1);
        let mut sums = Self::default();
        for (k, product) in products.iter().enumerate().take(high + 1).skip(low) {
            sums.add(weights[k.abs_diff(bin)], product);
        }
        sums
    }

    /// H1; not a number where there was no input.
    fn response(&self) -> Complex<f64> {
        self.yu / self.uu
    }

    fn add(&mut self, w: f64, product: &Product) {
        self.w += w;
        self.ww += w * w;
        self.uu += w * product.uu;
        self.wuu += w * w * product.uu;
        self.yy += w * product.yy;
        self.yu += product.yu * w;
    }
}

/// What is known around one bin, but for the power of the noise.
#[derive(Clone, Copy, Default)]
struct Fit {
    /// H1 and its coherence, unless the input is dead here.
    response: Option<(Complex<f64>, f64)>,
    /// B / A^2: E|error of H|^2 for noise of power 1.
    gain: f64,
    /// |e|^2
    residual: f64,
    /// E|e|^2 for noise of power 1.
    freedom: f64,
    /// (sum w)^2 / sum w^2: equivalent noise bandwidth in bins.
    width: f64,
}

impl Fit {
    fn new(sums: &Sums, product: &Product, dead: f64) -> Self {
        let width = sums.w * sums.w / sums.ww;
        if sums.uu <= dead * sums.w {
            return Self { residual: product.yy, freedom: 1.0, width, ..Self::default() };
        }
        let response = sums.response();
        let gain = sums.wuu / sums.uu / sums.uu;
        let share = product.uu / sums.uu;
        Self {
            response: Some((response, coherence(sums))),
            gain,
            residual: (product.output - response * product.input).norm_sqr(),
            freedom: 1.0 - 2.0 * share + share * (sums.wuu / sums.uu),
            width,
        }
    }
}

/// |sum w Y conj(U)|^2 / (A sum w |Y|^2); an output that is not there is not coherent with anything.
fn coherence(sums: &Sums) -> f64 {
    if sums.yy > 0.0 { (sums.yu.norm() / sums.uu) * (sums.yu.norm() / sums.yy) } else { 0.0 }
}

/// The fits of all bins that an estimate up to bin `high` looks at.
fn fits(products: &[Product], settings: &EstimatorSettings, high: usize) -> Vec<Fit> {
    let power = products[1..].iter().map(|p| p.uu).sum::<f64>() / (products.len() - 1) as f64;
    let dead = DEAD_RATIO * DEAD_RATIO * power;
    let end = (high + NOISE_WIDTH * settings.half_width(high) + 1).min(products.len());
    let mut table = weights(settings.half_width(1));
    let mut fits = vec![Fit::default()];
    for bin in 1..end {
        if table.len() != settings.half_width(bin) {
            table = weights(settings.half_width(bin));
        }
        fits.push(Fit::new(&Sums::around(products, bin, &table), &products[bin], dead));
    }
    fits
}

/// The power of the noise at a bin, from what the fits around it have left over, weighted towards the bin.
fn noise_power(fits: &[Fit], bin: usize, weights: &[f64]) -> f64 {
    let reach = weights.len() - 1;
    let (low, high) = (bin.saturating_sub(reach).max(1), (bin + reach + 1).min(fits.len()));
    let (mut freedom, mut residual) = (0.0, 0.0);
    for (k, fit) in fits.iter().enumerate().take(high).skip(low) {
        let w = weights[k.abs_diff(bin)];
        freedom += w * fit.freedom;
        residual += w * fit.residual;
    }
    residual / freedom
}
