//! The spectra of a whole record.

use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::model;
use super::spectra::{ExpectedInput, Place, Spectra};
use super::window::{LocalFit, Window};
use crate::fft::RealFft;
use crate::{EstimatorSettings, Signals};

/// Input below this ratio of its root mean square over all bins is rounding, not excitation.
const NO_INPUT_RATIO: f64 = 1e-9;

/// Input and output of a record, bin by bin below the Nyquist frequency.
pub(super) struct RecordSpectra {
    /// U; exactly zero where the record has no input.
    input: Vec<Complex<f64>>,
    output: Vec<Complex<f64>>,
    bin_hz: f64,
}

impl RecordSpectra {
    /// The spectra of a record, without the drift of its output.
    pub(super) fn of_signals(signals: &Signals) -> Self {
        let fft = RealFft::new(signals.len());
        let input = fft.below_nyquist(signals.input.clone());
        let output = fft.below_nyquist(signals.output_without_drift());
        Self::new(input, output, signals.rate_hz / signals.len() as f64)
    }

    pub(super) fn new(
        mut input: Vec<Complex<f64>>,
        output: Vec<Complex<f64>>,
        bin_hz: f64,
    ) -> Self {
        let power = input[1..].iter().map(|u| u.norm_sqr()).sum::<f64>() / (input.len() - 1) as f64;
        for u in input
            .iter_mut()
            .filter(|u| u.norm_sqr() <= NO_INPUT_RATIO * NO_INPUT_RATIO * power)
        {
            *u = Complex::default();
        }
        Self {
            input,
            output,
            bin_hz,
        }
    }

    /// These spectra with a part of the output subtracted: that of each bin from `first` on.
    pub(super) fn minus(&self, first: usize, part: &[Complex<f64>]) -> Self {
        let mut output = self.output.clone();
        let bins = output.iter_mut().skip(first);
        bins.zip(part).for_each(|(y, part)| *y -= part);
        Self {
            input: self.input.clone(),
            output,
            bin_hz: self.bin_hz,
        }
    }

    /// The spectra from output to input, at the bins that have input.
    pub(super) fn swapped(&self) -> Self {
        let bins = self.input.iter().zip(&self.output);
        let excited = bins.map(|(u, y)| {
            if u.norm_sqr() > 0.0 {
                *y
            } else {
                Complex::default()
            }
        });
        Self {
            input: excited.collect(),
            output: self.input.clone(),
            bin_hz: self.bin_hz,
        }
    }

    /// The bins around a position; bin 0, which holds the probe's offset, is excluded.
    pub(super) fn window(&self, place: Place) -> Window {
        let Place {
            position,
            half_width,
        } = place;
        let low = (position - half_width).floor().max(0.0) as usize + 1;
        let high = ((position + half_width).ceil() as usize - 1).min(self.last_bin());
        let x: Vec<f64> = (low..=high)
            .map(|k| (k as f64 - position) / half_width)
            .collect();
        let root_weight = x
            .iter()
            .map(|x| libm::cos(core::f64::consts::FRAC_PI_2 * x))
            .collect();
        Window {
            first_bin: low,
            x,
            root_weight,
            input: self.input[low..=high].to_vec(),
            output: self.output[low..=high].to_vec(),
        }
    }
}

impl Spectra for RecordSpectra {
    fn bin_hz(&self) -> f64 {
        self.bin_hz
    }

    fn last_bin(&self) -> usize {
        self.input.len() - 1
    }

    fn fit(
        &self,
        place: Place,
        settings: &EstimatorSettings,
        max_poles: usize,
    ) -> Option<LocalFit> {
        Some(model::fit(&self.window(place), settings, max_poles)?.fit)
    }

    fn input_cross(&self, bin: usize) -> Complex<f64> {
        Complex::from(self.input[bin].norm_sqr())
    }

    fn output_cross(&self, bin: usize) -> Complex<f64> {
        self.output[bin] * self.input[bin].conj()
    }

    fn instrument_power(&self, bin: usize) -> f64 {
        self.input[bin].norm_sqr()
    }

    fn expected_inputs(
        &self,
        bins: &RangeInclusive<usize>,
        _: &EstimatorSettings,
    ) -> Vec<ExpectedInput> {
        let crosses = bins.clone().map(|k| self.input_cross(k));
        crosses.map(ExpectedInput::exact).collect()
    }
}
