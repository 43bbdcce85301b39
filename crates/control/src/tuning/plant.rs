//! The plants for which one controller is designed: operating points, each with tolerances of its modes.

use super::uncertainty::Uncertainty;
use crate::features::alias;
use bench_plant::{LoopPlant, Mode, SignalPath};

/// A mode whose residue is below this part of the largest one is neither varied nor resolved.
const VISIBLE: f64 = 1e-4;

/// Tolerances of the modes of a plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Relative tolerance of the frequencies: of the first mode, and of all others together.
    pub frequency_ratio: f64,
    /// Factor of the damping ratios of the least damped plant.
    pub damping_factor: f64,
    /// Relative tolerance of the gain, for example of the force constant.
    pub gain_ratio: f64,
}

/// A plant at the end of a signal path, with its modes.
#[derive(Clone, Debug)]
pub struct DesignPlant {
    /// Operating point and variation, for messages.
    pub name: String,
    /// Hold, amplifier, modes, delays.
    pub plant: LoopPlant,
    /// The modes.
    pub modes: Vec<Mode>,
    /// Whether the plant is an operating point itself, and not a variation.
    pub is_nominal: bool,
    /// Largest distance of the true response from that of `plant`, of a plant that was measured.
    pub uncertainty: Uncertainty,
}

impl DesignPlant {
    /// The plant with these modes.
    pub fn new(name: impl Into<String>, path: &SignalPath, modes: Vec<Mode>) -> DesignPlant {
        DesignPlant {
            name: name.into(),
            plant: LoopPlant::of(path, &modes),
            modes,
            is_nominal: true,
            uncertainty: Uncertainty::default(),
        }
    }

    /// The plant, and its variations: the first mode lower and higher, all other modes lower and higher, all modes less damped, the
    /// gain lower and higher.
    pub fn with_tolerances(
        name: &str,
        path: &SignalPath,
        modes: &[Mode],
        tolerances: &Tolerances,
    ) -> Vec<DesignPlant> {
        let variations = variations(modes, tolerances).into_iter();
        let plants = variations.map(|(change, modes)| DesignPlant {
            is_nominal: change.is_empty(),
            ..DesignPlant::new(format!("{name}{change}"), path, modes)
        });
        plants.collect()
    }

    /// Frequency in rad/s and damping ratio of the modes that the probe sees, as they appear below half the rate.
    pub fn sampled_features(&self) -> Vec<(f64, f64)> {
        let period_s = self.plant.period_s();
        let features = self.features().into_iter();
        features.map(|mode| alias(mode, period_s)).collect()
    }

    /// Frequency in rad/s and damping ratio of the modes that the probe sees.
    pub fn features(&self) -> Vec<(f64, f64)> {
        let visible = self
            .modes
            .iter()
            .filter(|mode| is_visible(mode, &self.modes));
        let moving = visible.filter(|mode| mode.omega_rad_s > 0.0);
        moving
            .map(|mode| (mode.omega_rad_s, mode.damping_ratio))
            .collect()
    }
}

/// The modes and their variations, each with a text that names the change; the first one is empty.
pub(super) fn variations(modes: &[Mode], tolerances: &Tolerances) -> Vec<(String, Vec<Mode>)> {
    let (ratio, factor) = (tolerances.frequency_ratio, tolerances.damping_factor);
    let percent = 100.0 * ratio;
    let mut variations = Vec::new();
    for (sign, ratio) in [("-", -ratio), ("+", ratio)] {
        let first = changed(modes, |is_first, mode| {
            mode.omega_rad_s *= if is_first { 1.0 + ratio } else { 1.0 };
        });
        let others = changed(modes, |is_first, mode| {
            mode.omega_rad_s *= if is_first { 1.0 } else { 1.0 + ratio };
        });
        variations.push((format!(", first mode {sign}{percent} %"), first));
        variations.push((format!(", other modes {sign}{percent} %"), others));
    }
    let damped = changed(modes, |_, mode| mode.damping_ratio *= factor);
    variations.push((format!(", damping x {factor}"), damped));
    for (sign, ratio) in [("-", -tolerances.gain_ratio), ("+", tolerances.gain_ratio)] {
        let percent = 100.0 * ratio.abs();
        let scaled = changed(modes, |_, mode| mode.force_gain *= 1.0 + ratio);
        variations.push((format!(", gain {sign}{percent} %"), scaled));
    }
    variations.retain(|(_, varied)| varied.as_slice() != modes);
    variations.insert(0, (String::new(), modes.to_vec()));
    variations
}

/// The modes with a change of those that the probe sees; the flag tells whether it is the first one.
fn changed(modes: &[Mode], change: impl Fn(bool, &mut Mode)) -> Vec<Mode> {
    let mut changed = modes.to_vec();
    let mut is_first = true;
    for (mode, original) in changed.iter_mut().zip(modes) {
        if is_visible(original, modes) && original.omega_rad_s > 0.0 {
            change(is_first, mode);
            is_first = false;
        }
    }
    changed
}

fn is_visible(mode: &Mode, modes: &[Mode]) -> bool {
    let residues = modes.iter().map(|mode| mode.residue_per_kg().abs());
    mode.residue_per_kg().abs() > VISIBLE * residues.fold(0.0, f64::max)
}
