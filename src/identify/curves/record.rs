//! A whole record, bin by bin.

use nalgebra::Complex;

use super::bins::Bins;
use super::curve::{self, Fitted, Window};
use crate::identify::spectrum::Spectra;
use crate::identify::{EstimatorSettings, Signals};

/// Input below this part of its root mean square over all bins is rounding, not excitation.
const DEAD_RATIO: f64 = 1e-9;

/// The bins of a record.
pub(super) struct Record {
    /// U; zero where the input is dead.
    input: Vec<Complex<f64>>,
    output: Vec<Complex<f64>>,
    bin_hz: f64,
}

impl Record {
    pub(super) fn new(signals: &Signals) -> Self {
        Self::of(
            Spectra::new(signals),
            signals.rate_hz / signals.len() as f64,
        )
    }

    pub(super) fn of(Spectra { mut input, output }: Spectra, bin_hz: f64) -> Self {
        let power = input[1..].iter().map(|u| u.norm_sqr()).sum::<f64>() / (input.len() - 1) as f64;
        for u in input
            .iter_mut()
            .filter(|u| u.norm_sqr() <= DEAD_RATIO * DEAD_RATIO * power)
        {
            *u = Complex::default();
        }
        Self {
            input,
            output,
            bin_hz,
        }
    }

    /// From output to input, where there is an input.
    pub(super) fn swapped(&self) -> Self {
        let alive = |(u, y): (&Complex<f64>, &Complex<f64>)| {
            if u.norm_sqr() > 0.0 {
                *y
            } else {
                Complex::default()
            }
        };
        Self {
            input: self.input.iter().zip(&self.output).map(alive).collect(),
            output: self.input.clone(),
            bin_hz: self.bin_hz,
        }
    }

    /// The bins around a place; bin 0, which holds the probe's offset, is never among them.
    pub(super) fn window(&self, place: f64, half_width: f64) -> Window {
        let low = (place - half_width).floor().max(0.0) as usize + 1;
        let high = ((place + half_width).ceil() as usize - 1).min(self.last_bin());
        let x: Vec<f64> = (low..=high)
            .map(|k| (k as f64 - place) / half_width)
            .collect();
        let root = x
            .iter()
            .map(|x| libm::cos(core::f64::consts::FRAC_PI_2 * x))
            .collect();
        Window {
            x,
            root,
            input: self.input[low..=high].to_vec(),
            output: self.output[low..=high].to_vec(),
        }
    }
}

impl Bins for Record {
    fn bin_hz(&self) -> f64 {
        self.bin_hz
    }

    fn last_bin(&self) -> usize {
        self.input.len() - 1
    }

    fn fit(&self, place: f64, half_width: f64, settings: &EstimatorSettings) -> Option<Fitted> {
        Some(curve::fit(&self.window(place, half_width), settings)?.fitted)
    }

    fn drive(&self, bin: usize) -> Complex<f64> {
        Complex::from(self.input[bin].norm_sqr())
    }

    fn cross(&self, bin: usize) -> Complex<f64> {
        self.output[bin] * self.input[bin].conj()
    }

    fn power(&self, bin: usize) -> f64 {
        self.input[bin].norm_sqr()
    }
}
