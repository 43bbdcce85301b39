//! The information of a shot about the parameters of a fit, and the uncertainty that it leaves.
//!
//! ```text
//! I(f) = 2 Re(conj(J) J^T)/v                       of a datum; J = dH/dtheta, v = E|error of H|^2
//! I(band, T) = T/ln(f2/f1) sum over the band of I(f) (A/A_1)^2 ln(g2/g1)/T_1
//! C' = (C^-1 + I)^-1,   sigma(q)^2 = c^T C' c
//! ```
//!
//! A logarithmic sweep of length T over f1 to f2 stays T/ln(f2/f1) in each interval of ln f. The first shot, with A_1, T_1 and the band g1
//! to g2, gives the noise v at each frequency. (c-optimal design: Pukelsheim, Optimal Design of Experiments, 1993, chapter 2.)

use nalgebra::{Cholesky, Complex, DMatrix, DVector};

use super::shot::Shot;
use bench_excitation::AmplitudeCurve;
use bench_identify::FrfDatum;
use bench_identify::modal::{MeasurementChain, ModalFit, merged};

/// Number of parts of the band, equal in ln f.
const CELLS: usize = 16;

/// The data and the amplitude of the first shot.
pub(super) struct FirstShot {
    pub(super) shot: Shot,
    pub(super) data: Vec<FrfDatum>,
    pub(super) amplitude: AmplitudeCurve,
}

/// Information by frequency, in units of the standard deviations of the fit.
pub(super) struct InformationByFrequency {
    /// Lowest frequency in hertz.
    low_hz: f64,
    /// Width of a cell in ln f.
    cell_width: f64,
    /// Information of each cell for a sweep of one second per unit of ln f.
    cells: Vec<DMatrix<f64>>,
    /// C^-1.
    precision: DMatrix<f64>,
    /// Standard deviation of each parameter.
    scale: DVector<f64>,
}

impl InformationByFrequency {
    /// With the amplitude of the next shot; `None` if the covariance of the fit is singular.
    pub(super) fn of(
        first: &FirstShot,
        chain: &MeasurementChain,
        fit: &ModalFit,
        amplitude: &AmplitudeCurve,
    ) -> Option<InformationByFrequency> {
        let scale = fit.covariance.diagonal().map(f64::sqrt);
        let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
            fit.covariance[(i, j)] / (scale[i] * scale[j])
        });
        let precision = Cholesky::new(scaled)?.inverse();
        let empty = DMatrix::zeros(scale.len(), scale.len());
        let mut information = InformationByFrequency {
            low_hz: first.shot.low_hz,
            cell_width: first.shot.log_width() / CELLS as f64,
            cells: vec![empty; CELLS],
            precision,
            scale,
        };
        let data = merged(&first.data, &fit.parameters);
        let frequency_hz: Vec<f64> = data.iter().map(|datum| datum.frequency_hz).collect();
        let sensitivities = fit.sensitivities(chain, &frequency_hz);
        for (datum, sensitivity) in data.iter().zip(sensitivities) {
            let ln_f = libm::log(datum.frequency_hz);
            let ratio = amplitude.at(ln_f) / first.amplitude.at(ln_f);
            let rate = first.shot.log_width() / first.shot.duration_s;
            information.add(datum, &sensitivity, ratio * ratio * rate);
        }
        Some(information)
    }

    fn add(&mut self, datum: &FrfDatum, sensitivity: &DVector<Complex<f64>>, weight: f64) {
        let cell = libm::log(datum.frequency_hz / self.low_hz) / self.cell_width;
        let cell = (cell.max(0.0) as usize).min(CELLS - 1);
        let weight = 2.0 * weight / datum.variance;
        let scaled = sensitivity.zip_map(&self.scale, |derivative, scale| derivative * scale);
        let (re, im) = (scaled.map(|z| z.re), scaled.map(|z| z.im));
        self.cells[cell] += (&re * re.transpose() + &im * im.transpose()) * weight;
    }

    /// All bands of whole cells, each with its first and its last cell.
    pub(super) fn bands(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..CELLS).flat_map(|first| (first..CELLS).map(move |last| (first, last)))
    }

    /// A shot over a band of cells.
    pub(super) fn shot(&self, (first, last): (usize, usize), duration_s: f64) -> Shot {
        let edge_hz = |cell: usize| self.low_hz * libm::exp(cell as f64 * self.cell_width);
        Shot {
            low_hz: edge_hz(first),
            high_hz: edge_hz(last + 1),
            duration_s,
        }
    }

    /// Covariance of the parameters, in units of their standard deviations, after another shot; `None` if it is singular.
    pub(super) fn covariance_after(
        &self,
        (first, last): (usize, usize),
        duration_s: f64,
    ) -> Option<DMatrix<f64>> {
        let seconds_per_ln_f = duration_s / ((last + 1 - first) as f64 * self.cell_width);
        let mut precision = self.precision.clone();
        for cell in &self.cells[first..=last] {
            precision += cell * seconds_per_ln_f;
        }
        Some(Cholesky::new(precision)?.inverse())
    }

    /// Standard deviation of a quantity with this gradient, for a covariance in units of the standard deviations.
    pub(super) fn sigma(&self, covariance: &DMatrix<f64>, gradient: &DVector<f64>) -> f64 {
        let scaled = gradient.component_mul(&self.scale);
        scaled.dot(&(covariance * &scaled)).max(0.0).sqrt()
    }
}
