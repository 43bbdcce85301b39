//! Through what the mechanics are seen.

use nalgebra::{Complex, DVector};

use crate::config::Config;
use crate::identify::Block;
use crate::plant::{Chain, Mode};
use crate::zeros::Term;

/// A mode so far above everything that it is a constant: what modes above the band leave in it.
const FAR_RAD_S: f64 = 1e6;

/// What stands between set-point and reading beside the mechanics.
#[derive(Clone, Copy, Debug)]
pub enum View<'a> {
    /// Hold, motor, amplifier and the delays of a bench; input in amperes. Exact, what sampling folds back included.
    Bench(&'a Config),
    /// Nothing: input in newtons, or in a unit that takes its place.
    Bare,
}

impl View<'_> {
    /// The response of a mode of residue 1, `delay_s` later, over each block.
    pub(super) fn mode(
        &self,
        (omega_rad_s, damping_ratio): (f64, f64),
        delay_s: f64,
        blocks: &[Block],
    ) -> Vec<Complex<f64>> {
        let shape = DVector::zeros(0);
        let mode = Mode { omega_rad_s, damping_ratio, shape, force_gain: 1.0, sensor_gain: 1.0, floor_gain: 0.0 };
        match self {
            View::Bench(config) => {
                let chain = Chain::of_mean_age(config, &[mode]);
                over(blocks, |w| chain.response(w) * late(w, delay_s))
            }
            View::Bare => over(blocks, |w| mode.resonance(Complex::new(0.0, w)) * late(w, delay_s)),
        }
    }

    /// What the blocks show of the mechanics alone, in m/N: hold, motor, amplifier and delays taken out, and `delay_s` more.
    /// What sampling folds back stays.
    pub fn mechanics(&self, blocks: &[Block], delay_s: f64) -> Vec<Complex<f64>> {
        let constant = self.constant(delay_s, blocks);
        blocks.iter().zip(constant).map(|(block, constant)| block.response / constant).collect()
    }

    /// The response of a constant compliance of 1 m/N, `delay_s` later, over each block.
    pub(super) fn constant(&self, delay_s: f64, blocks: &[Block]) -> Vec<Complex<f64>> {
        self.mode((FAR_RAD_S, 1.0), delay_s, blocks).into_iter().map(|h| h * (FAR_RAD_S * FAR_RAD_S)).collect()
    }
}

fn late(omega_rad_s: f64, delay_s: f64) -> Complex<f64> {
    if delay_s == 0.0 { Complex::new(1.0, 0.0) } else { Complex::from_polar(1.0, -omega_rad_s * delay_s) }
}

/// The mean over each block: at two frequencies that share its moments.
fn over(blocks: &[Block], response: impl Fn(f64) -> Complex<f64>) -> Vec<Complex<f64>> {
    let at = |block: &Block| {
        let omega = |f: f64| 2.0 * std::f64::consts::PI * f;
        if block.spread_hz == 0.0 {
            return response(omega(block.frequency_hz));
        }
        let sides = [-1.0, 1.0].map(|side| response(omega(block.frequency_hz + side * block.spread_hz)));
        (sides[0] + sides[1]) * 0.5
    };
    blocks.iter().map(at).collect()
}

/// d ln G/d w and d ln G/d zeta of a mode at s = j w: those of the continuous mode, which sampling alters by what it folds
/// back, a part in a thousand of a slope.
pub(super) fn slopes(term: &Term, omega_rad_s: f64) -> [Complex<f64>; 2] {
    let (s, w, zeta) = (Complex::new(0.0, omega_rad_s), term.omega_rad_s, term.damping_ratio);
    let resonance = (s * s + s * (2.0 * zeta * w) + w * w).inv();
    [-resonance * (s * (2.0 * zeta) + 2.0 * w), -resonance * s * (2.0 * w)]
}
