//! Identification of a plant under control: reference, command and position together.
//!
//! ```text
//! y = P u + v,    u = C (r - y)         v: what noise and disturbance leave in the position
//! ```
//!
//! The command answers the noise, so that H1 from u to y leans towards -1/C wherever the noise is strong. The reference knows
//! nothing of it, and is the instrument (Söderström, Stoica, System Identification, 1989, section 8; joint input-output with
//! a known reference: van den Hof, Automatica 34, 1998):
//!
//! ```text
//! P = sum w Y conj(R) / sum w U conj(R)       L = sum w Y conj(R) / sum w E conj(R),  E = R - Y
//! T = sum w Y conj(R) / sum w |R|^2           S = sum w E conj(R) / sum w |R|^2
//! ```
//!
//! over neighbouring bins of the whole record, with weights cos^2 over the widths of [`super::blocks()`]. Where the loop is tight, U
//! has the plant's poles as zeros, and what is averaged is 1/P, which has no peak: smoothing takes less off a resonance than
//! in open loop.
//!
//! **Confidence.** With the residual e = Y - P U, whose power around a bin is S_e, A = sum w U conj(R), B = sum w^2 |R|^2,
//!
//! ```text
//! E|error of P|^2 = S_e B/|A|^2        E|e_k|^2 = S_e (1 - 2 Re(w_0 U_k conj(R_k)/A) + |U_k|^2 B/|A|^2)
//! ```
//!
//! where the second, the noise that the estimate has taken out of e, gives S_e from what is left over around the bin.

use nalgebra::Complex;

use super::spectrum::RealFft;
use super::{Block, BlockSettings, Frf, FrfPoint, IdentifyError, Signals, band};

/// The noise is averaged with weights so many times as wide as those of the response.
const NOISE_WIDTH: usize = 4;
/// An instrument below this part of its root mean square over all bins is rounding.
const DEAD_RATIO: f64 = 1e-9;

/// Reference, command and position of a loop that was closed: one sample a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSignals {
    /// Command and position.
    pub signals: Signals,
    /// Reference in metres.
    pub reference_m: Vec<f64>,
}

/// What they show.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// P, from command (A) to position (m).
    pub plant: Frf,
    /// The same without smoothing, for a fit.
    pub blocks: Vec<Block>,
    /// T = P C/(1 + P C), from reference to position.
    pub complementary: Frf,
    /// S = 1/(1 + P C), from reference to error.
    pub sensitivity: Frf,
    /// L = P C, from error to position.
    pub loop_gain: Frf,
}

/// P, T, S and L at the frequencies of `band_hz` at which the reference moved.
///
/// # Errors
/// When the signals, the band or the settings allow no estimate: see [`IdentifyError`].
pub fn estimate(
    loop_signals: &LoopSignals,
    band_hz: (f64, f64),
    settings: &BlockSettings,
) -> Result<Joint, IdentifyError> {
    let signals = &loop_signals.signals;
    settings.check()?;
    signals.check()?;
    let (input, output) = (loop_signals.reference_m.len(), signals.len());
    if input != output {
        return Err(IdentifyError::Lengths { input, output });
    }
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let spectra = Spectra::of(loop_signals);
    let error = difference(&spectra.reference, &spectra.position);
    let (low_hz, high_hz) = band_hz;
    let plant = Instrumental::new(&spectra, &spectra.command, &spectra.position, *bins.end(), settings);
    let frf = |input, output| Instrumental::new(&spectra, input, output, *bins.end(), settings).frf(&bins, settings);
    let joint = Joint {
        plant: plant.frf(&bins, settings),
        blocks: plant.blocks(&bins, settings),
        complementary: frf(&spectra.reference, &spectra.position),
        sensitivity: frf(&spectra.reference, &error),
        loop_gain: frf(&error, &spectra.position),
    };
    if joint.blocks.is_empty() { Err(IdentifyError::NotExcited { low_hz, high_hz }) } else { Ok(joint) }
}

type Spectrum = Vec<Complex<f64>>;

/// The whole record, bin by bin.
struct Spectra {
    reference: Spectrum,
    command: Spectrum,
    position: Spectrum,
    bin_hz: f64,
    /// Power of a bin of the reference that is rounding.
    dead: f64,
}

impl Spectra {
    fn of(loop_signals: &LoopSignals) -> Spectra {
        let signals = &loop_signals.signals;
        let fft = RealFft::new(signals.len());
        let last = band::last_bin(signals.len());
        let of = |samples: &[f64]| {
            let mut spectrum = fft.transform(&mut samples.to_vec());
            spectrum.truncate(last + 1);
            spectrum
        };
        let reference = of(&loop_signals.reference_m);
        // Bin 0 holds where the stage rests.
        let power = reference.iter().skip(1).map(|r| r.norm_sqr()).sum::<f64>() / last as f64;
        Spectra {
            dead: DEAD_RATIO * DEAD_RATIO * power,
            reference,
            command: of(&signals.input_a),
            position: of(&signals.output_m),
            bin_hz: signals.rate_hz / signals.len() as f64,
        }
    }
}

/// The weights w_0 .. w_(h-1) on either side of a bin.
fn weights(half_width: usize) -> Vec<f64> {
    let angle = core::f64::consts::FRAC_PI_2 / half_width as f64;
    (0..half_width).map(|j| libm::cos(angle * j as f64).powi(2)).collect()
}

fn difference(from: &[Complex<f64>], what: &[Complex<f64>]) -> Spectrum {
    from.iter().zip(what).map(|(a, b)| a - b).collect()
}

/// The response from one signal to another, with the reference as instrument.
struct Instrumental<'a> {
    spectra: &'a Spectra,
    input: &'a [Complex<f64>],
    output: &'a [Complex<f64>],
    fits: Vec<Fit>,
}

/// The sums over one neighbourhood.
#[derive(Clone, Copy, Default)]
struct Sums {
    w: f64,
    ww: f64,
    /// A = sum w U conj(R)
    ur: Complex<f64>,
    /// sum w Y conj(R)
    yr: Complex<f64>,
    /// sum w |R|^2
    rr: f64,
    /// B = sum w^2 |R|^2
    wrr: f64,
    /// sum w |Y|^2
    yy: f64,
}

/// What is known around one bin, but for the power of the noise.
#[derive(Clone, Copy, Default)]
struct Fit {
    sums: Sums,
    /// The response, unless the instrument is dead here.
    response: Option<Complex<f64>>,
    /// |e|^2
    residual: f64,
    /// E|e|^2 for noise of power 1.
    freedom: f64,
}

impl Sums {
    /// B/|A|^2: E|error|^2 for noise of power 1.
    fn gain(&self) -> f64 {
        self.wrr / self.ur.norm_sqr()
    }

    fn coherence(&self) -> f64 {
        if self.yy > 0.0 { (self.yr.norm() / self.rr) * (self.yr.norm() / self.yy) } else { 0.0 }
    }
}

impl<'a> Instrumental<'a> {
    fn new(
        spectra: &'a Spectra,
        input: &'a [Complex<f64>],
        output: &'a [Complex<f64>],
        high: usize,
        settings: &BlockSettings,
    ) -> Self {
        let mut this = Instrumental { spectra, input, output, fits: vec![Fit::default()] };
        let end = (high + NOISE_WIDTH * settings.half_width(high) + 1).min(output.len());
        let mut table = weights(settings.half_width(1));
        for bin in 1..end {
            if table.len() != settings.half_width(bin) {
                table = weights(settings.half_width(bin));
            }
            let fit = this.fit(bin, &table);
            this.fits.push(fit);
        }
        this
    }

    fn fit(&self, bin: usize, table: &[f64]) -> Fit {
        let sums = self.around(bin, table);
        if sums.rr <= self.spectra.dead * sums.w || sums.ur.norm_sqr() == 0.0 {
            return Fit { sums, residual: self.output[bin].norm_sqr(), freedom: 1.0, ..Fit::default() };
        }
        let response = sums.yr / sums.ur;
        let (u, r) = (self.input[bin], self.spectra.reference[bin]);
        Fit {
            sums,
            response: Some(response),
            residual: (self.output[bin] - response * u).norm_sqr(),
            freedom: 1.0 - 2.0 * (u * r.conj() / sums.ur).re + u.norm_sqr() * sums.gain(),
        }
    }

    fn around(&self, bin: usize, table: &[f64]) -> Sums {
        let reach = table.len() - 1;
        // Bin 0 holds offsets: no neighbourhood may reach it.
        let (low, high) = (bin.saturating_sub(reach).max(1), (bin + reach).min(self.output.len() - 1));
        (low..=high).fold(Sums::default(), |mut sums, k| {
            self.add(&mut sums, table[k.abs_diff(bin)], k);
            sums
        })
    }

    fn add(&self, sums: &mut Sums, w: f64, bin: usize) {
        let (u, y, r) = (self.input[bin], self.output[bin], self.spectra.reference[bin]);
        sums.w += w;
        sums.ww += w * w;
        sums.ur += u * r.conj() * w;
        sums.yr += y * r.conj() * w;
        sums.rr += w * r.norm_sqr();
        sums.wrr += w * w * r.norm_sqr();
        sums.yy += w * y.norm_sqr();
    }

    /// The power of the noise at a bin, from what is left over around it.
    fn noise_power(&self, bin: usize, settings: &BlockSettings) -> f64 {
        let table = weights(NOISE_WIDTH * settings.half_width(bin));
        let reach = table.len() - 1;
        let near = bin.saturating_sub(reach).max(1)..(bin + reach + 1).min(self.fits.len());
        let (left, freedom) = near.fold((0.0, 0.0), |(left, freedom), k| {
            let w = table[k.abs_diff(bin)];
            (left + w * self.fits[k].residual, freedom + w * self.fits[k].freedom)
        });
        left / freedom
    }

    fn frf(&self, bins: &core::ops::RangeInclusive<usize>, settings: &BlockSettings) -> Frf {
        let grid = core::iter::successors(Some(*bins.start()), |bin| Some(settings.next(*bin)));
        let mut frf = Frf::default();
        for point in grid.take_while(|bin| bins.contains(bin)).filter_map(|bin| self.point(bin, settings)) {
            frf.push(point);
        }
        frf
    }

    fn point(&self, bin: usize, settings: &BlockSettings) -> Option<FrfPoint> {
        let fit = &self.fits[bin];
        let response = fit.response?;
        let wider = self.around(bin, &weights(2 * settings.half_width(bin)));
        // What an average takes off grows with the square of its width: an estimate of twice that shows three times as much.
        let bias = (wider.yr / wider.ur - response) / 3.0;
        let variance = self.noise_power(bin, settings) * fit.sums.gain() + bias.norm_sqr();
        Some(FrfPoint {
            frequency_hz: bin as f64 * self.spectra.bin_hz,
            response,
            coherence: fit.sums.coherence(),
            variance,
            resolution_hz: fit.sums.w * fit.sums.w / fit.sums.ww * self.spectra.bin_hz,
        })
    }

    fn blocks(&self, bins: &core::ops::RangeInclusive<usize>, settings: &BlockSettings) -> Vec<Block> {
        let (mut blocks, mut low) = (Vec::new(), *bins.start());
        while low <= *bins.end() {
            let high = (settings.next(low) - 1).min(*bins.end());
            blocks.extend(self.block(low, high, settings));
            low = high + 1;
        }
        blocks
    }

    /// The response over a few bins: their mean, weighted with U conj(R), whose magnitude stands for its moments.
    fn block(&self, low: usize, high: usize, settings: &BlockSettings) -> Option<Block> {
        let middle = (low + high) / 2;
        self.fits[middle].response?;
        let mut sums = Sums::default();
        (low..=high).for_each(|k| self.add(&mut sums, 1.0, k));
        let weight = |k: usize| (self.input[k] * self.spectra.reference[k].conj()).norm();
        let moment = |of: &dyn Fn(f64) -> f64| {
            let (sum, all) = (low..=high).fold((0.0, 0.0), |(s, w), k| (s + weight(k) * of(k as f64), w + weight(k)));
            sum / all
        };
        let centre = moment(&|k| k);
        let spread = moment(&|k| (k - centre) * (k - centre)).sqrt();
        let variance = self.noise_power(middle, settings) * sums.gain();
        let response = sums.yr / sums.ur;
        let block = Block {
            frequency_hz: centre * self.spectra.bin_hz,
            spread_hz: spread * self.spectra.bin_hz,
            response,
            variance,
        };
        let sound = variance > 0.0 && variance.is_finite() && response.norm().is_finite() && centre.is_finite();
        sound.then_some(block)
    }
}
