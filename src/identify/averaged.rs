//! The power of the noise around a bin, by what averages of H over its neighbours leave: what weighs the blocks of a fit.
//!
//! `H1 = sum w Y conj(U) / sum w |U|^2` over the bins j to either side of a bin, `w_j = cos^2(pi j / (2 h))`, |j| < h. The
//! residual e_k = Y_k - H_k U_k holds the noise, less what the average has taken out of it. With the share `w'_j = w_j
//! |U_j|^2 / A` of each bin, where `A = sum w |U|^2` and `B = sum w^2 |U|^2`,
//!
//! ```text
//! E|e_k|^2 = S (1 - 2 w'_0 + |U_k|^2 B / A^2)
//! ```
//!
//! S is the sum of |e|^2 over the sum of these brackets, over a neighbourhood four times as wide, with weights of the same
//! kind: a sigma made of it is steady to some 13 %. It needs no assumption on the noise but that it changes little over
//! that neighbourhood.

use nalgebra::Complex;

use super::Signals;
use super::blocks::BlockSettings;
use super::spectrum::Spectra;

/// The noise is averaged with weights so many times as wide as those of the response.
pub(super) const NOISE_WIDTH: usize = 4;
/// Input below this part of its root mean square over all bins is rounding, not excitation.
const DEAD_RATIO: f64 = 1e-9;

/// The whole record, bin by bin.
pub(super) struct Record {
    products: Vec<Product>,
    fits: Vec<Fit>,
    bin_hz: f64,
}

impl Record {
    pub(super) fn new(signals: &Signals, settings: &BlockSettings, high: usize) -> Self {
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
    pub(super) fn noise_power(&self, bin: usize, settings: &BlockSettings) -> Option<f64> {
        self.fits[bin].alive.then(|| noise_power(&self.fits, bin, &weights(NOISE_WIDTH * settings.half_width(bin))))
    }
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
    let Spectra { input, output } = Spectra::new(signals);
    let product = |(u, y): (&Complex<f64>, &Complex<f64>)| Product {
        input: *u,
        output: *y,
        uu: u.norm_sqr(),
        yy: y.norm_sqr(),
        yu: y * u.conj(),
    };
    input.iter().zip(&output).map(product).collect()
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
    /// A = sum w |U|^2
    uu: f64,
    /// B = sum w^2 |U|^2
    wuu: f64,
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
        self.uu += w * product.uu;
        self.wuu += w * w * product.uu;
        self.yu += product.yu * w;
    }
}

/// What is left around one bin.
#[derive(Clone, Copy, Default)]
struct Fit {
    /// Whether there is any input.
    alive: bool,
    /// |e|^2
    residual: f64,
    /// E|e|^2 for noise of power 1.
    freedom: f64,
}

impl Fit {
    fn new(sums: &Sums, product: &Product, dead: f64) -> Self {
        if sums.uu <= dead * sums.w {
            return Self { alive: false, residual: product.yy, freedom: 1.0 };
        }
        let share = product.uu / sums.uu;
        Self {
            alive: true,
            residual: (product.output - sums.response() * product.input).norm_sqr(),
            freedom: 1.0 - 2.0 * share + share * (sums.wuu / sums.uu),
        }
    }
}

/// The fits of all bins that an estimate up to bin `high` looks at.
fn fits(products: &[Product], settings: &BlockSettings, high: usize) -> Vec<Fit> {
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
