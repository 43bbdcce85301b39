//! Modes that appear twice, because the stage changed during the record.
//!
//! A stage whose stiffness or mass changes, by temperature or load, has frequencies of which each changes by the same ratio. A response over
//! the whole record is about that of the stage before and after, each in part:
//!
//! ```text
//! each mode appears at w and at (1 + d) w, with the same d for all, and residues of the same sign
//! ```
//!
//! Such modes describe the response to its noise, but they are not those of the stage. Close modes of a stage have each their own distance.

use bench_base::decimal::Decimal;

use crate::modal::{FittedMode, ModalFit};

/// The largest change of a frequency: two modes that are farther apart are taken for two.
const MAX_CHANGE: f64 = 0.03;
/// Distances are the same if they differ by less than this part. Those of 10 records with a known change differ by up to 4 %.
const SAME_DISTANCE: f64 = 0.06;
/// At least as many modes appear twice.
const MIN_PAIRS: usize = 2;
/// A residue of more standard deviations is that of a mode.
const CERTAIN_SIGMAS: f64 = 3.0;
/// A mode with a peak below this ratio of the highest one may be without a second one, which is not found.
const MIN_PEAK_RATIO: f64 = 0.01;

/// Modes that appear twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChangedModes {
    pairs: usize,
    /// d.
    change_ratio: f64,
}

impl ChangedModes {
    /// Those of a fit, if each high mode within the band appears twice.
    pub(super) fn of(fit: &ModalFit) -> Option<ChangedModes> {
        let (low_hz, high_hz) = fit.band_hz;
        let mut modes = fit.modes();
        modes.retain(|mode| (low_hz..=high_hz).contains(&mode.frequency_hz().value));
        let certain: Vec<&FittedMode> = modes.iter().filter(|mode| is_certain(mode)).collect();
        let distances = (1..certain.len()).flat_map(|k| {
            let upper = certain[k];
            certain[..k].iter().map(|lower| distance(lower, upper))
        });
        distances
            .filter(|change_ratio| *change_ratio <= MAX_CHANGE)
            .find_map(|change_ratio| pairs_at(&modes, &certain, change_ratio))
    }

    /// What was found, with what to do about it.
    pub(super) fn description(&self) -> String {
        format!(
            "each of {} modes appears twice, the second time at a frequency higher by {:.2} %, as those of a stage that changes during the record, by temperature or load; repeat the record when the stage is settled, or make it shorter",
            self.pairs,
            Decimal(100.0 * self.change_ratio)
        )
    }
}

/// The modes that appear twice at this distance, if each high one does.
fn pairs_at(
    modes: &[FittedMode],
    certain: &[&FittedMode],
    change_ratio: f64,
) -> Option<ChangedModes> {
    let is_pair = |lower: &FittedMode, upper: &FittedMode| {
        let is_same = (distance(lower, upper) / change_ratio - 1.0).abs() < SAME_DISTANCE;
        is_same && !are_opposite(lower, upper)
    };
    let has_second = |mode: &FittedMode| {
        modes
            .iter()
            .any(|other| is_pair(mode, other) || is_pair(other, mode))
    };
    let highest = certain.iter().map(|mode| peak(mode)).fold(0.0, f64::max);
    // Two modes closer than that describe one of those that appear.
    let near = SAME_DISTANCE * change_ratio;
    let is_split = |mode: &FittedMode| {
        let close = modes
            .iter()
            .filter(|other| distance(other, mode).abs() < near);
        close.count() > 1
    };
    let mut high = certain
        .iter()
        .filter(|mode| peak(mode) >= MIN_PEAK_RATIO * highest && !is_split(mode));
    let mut lower: Vec<&FittedMode> = modes
        .iter()
        .filter(|mode| modes.iter().any(|upper| is_pair(mode, upper)))
        .collect();
    lower.dedup_by(|next, mode| distance(mode, next) < near);
    let pairs = lower.len();
    let are_changed = pairs >= MIN_PAIRS && high.all(|mode| has_second(mode));
    are_changed.then_some(ChangedModes {
        pairs,
        change_ratio,
    })
}

/// By how much a frequency is higher, as a ratio of the lower one.
fn distance(lower: &FittedMode, upper: &FittedMode) -> f64 {
    upper.omega_rad_s.value / lower.omega_rad_s.value - 1.0
}

fn is_certain(mode: &FittedMode) -> bool {
    mode.residue_per_kg.value.abs() > CERTAIN_SIGMAS * mode.residue_per_kg.sigma
}

/// Whether both residues are certain and have opposite signs.
fn are_opposite(a: &FittedMode, b: &FittedMode) -> bool {
    let product = a.residue_per_kg.value * b.residue_per_kg.value;
    is_certain(a) && is_certain(b) && product < 0.0
}

/// |r|/(2 zeta w^2).
fn peak(mode: &FittedMode) -> f64 {
    let (w, zeta) = (mode.omega_rad_s.value, mode.damping_ratio.value);
    mode.residue_per_kg.value.abs() / (2.0 * zeta * w * w)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use bench_plant::zeros::ModalTerm;
    use nalgebra::Complex;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::FrfDatum;
    use crate::modal::{MeasurementChain, fit};

    /// Frequencies in hertz with residues in 1/kg.
    type Modes = [(f64, f64)];

    const STAGE: &Modes = &[(20.0, 1.0), (45.0, -0.7), (80.0, 1.5)];
    /// Standard deviation of the noise in units of the static response of the first mode.
    const NOISE_RATIO: f64 = 1e-3;

    /// The modes of a stage of which this part responds with frequencies that are higher by this ratio.
    fn changed(part: f64, change_ratio: f64) -> Vec<(f64, f64)> {
        let modes = STAGE.iter().flat_map(|(hz, residue)| {
            [
                (*hz, (1.0 - part) * residue),
                (hz * (1.0 + change_ratio), part * residue),
            ]
        });
        modes.collect()
    }

    /// What is found in the response of modes with damping ratios of 0.5 %, from 5 to 110 Hz.
    fn found(modes: &Modes) -> Option<ChangedModes> {
        let mut random = Pcg64::seed_from_u64(7);
        let mut uniform = || ((random.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64;
        let sigma = NOISE_RATIO / (TAU * 20.0).powi(2);
        let mut noise = || {
            let magnitude = (-uniform().ln()).sqrt();
            Complex::from_polar(sigma * magnitude, TAU * uniform())
        };
        let datum = |k: u32| {
            let frequency_hz = 0.05 * f64::from(k);
            let s = Complex::new(0.0, TAU * frequency_hz);
            let terms = modes.iter().map(|(hz, residue_per_kg)| {
                let mode = ModalTerm {
                    omega_rad_s: TAU * hz,
                    damping_ratio: 0.005,
                    residue_per_kg: *residue_per_kg,
                };
                mode.resonance(s) * mode.residue_per_kg
            });
            FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response: terms.sum::<Complex<f64>>() + noise(),
                variance: sigma * sigma,
            }
        };
        let data: Vec<FrfDatum> = (100..2200).map(datum).collect();
        let fit = fit(&data, &MeasurementChain::Direct).expect("modes");
        ChangedModes::of(&fit)
    }

    #[test]
    fn stage_that_changes_has_each_mode_twice() {
        for (part, change_ratio) in [(0.3, 0.012), (0.5, 0.006), (0.1, 0.025)] {
            let found = found(&changed(part, change_ratio));
            let found = found.unwrap_or_else(|| panic!("{part} {change_ratio}"));
            assert_eq!(found.pairs, 3, "{part} {change_ratio}");
            // One of the pairs decides which ratio is stated, and the others agree with it.
            let deviation = found.change_ratio / change_ratio - 1.0;
            assert!(deviation.abs() < SAME_DISTANCE, "{found:?}");
        }
    }

    #[test]
    fn stage_of_close_modes_is_none_that_changes() {
        assert_eq!(found(STAGE), None);
        // Distances of 1.0, 1.2 and 1.4 %.
        let pairs = [(20.0, 0.5), (45.0, -0.4), (80.0, 0.8)];
        let with_others = |distances: [f64; 3]| -> Vec<(f64, f64)> {
            let others = pairs.iter().zip(distances);
            let others = others.map(|((hz, residue), distance)| (hz * (1.0 + distance), *residue));
            pairs.iter().copied().chain(others).collect()
        };
        assert_eq!(found(&with_others([0.010, 0.012, 0.014])), None);
        // The same distance, but one mode alone.
        let mut alone = changed(0.4, 0.012);
        alone.pop();
        assert_eq!(found(&alone), None);
        // The same distance, but residues of opposite signs.
        let mut opposite = changed(0.4, 0.012);
        opposite[1].1 *= -1.0;
        assert_eq!(found(&opposite), None);
    }
}
