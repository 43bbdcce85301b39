//! Through what the mechanics are seen.

use nalgebra::{Complex, DVector};

use crate::config::Config;
use crate::identify::FrfDatum;
use crate::model::plant::{LoopPlant, Mode};
use crate::model::zeros::ModalTerm;

/// A mode so far above everything that it is a constant: what modes above the band leave in it.
const FAR_RAD_S: f64 = 1e6;

/// What stands between set-point and reading beside the mechanics.
#[derive(Clone, Copy, Debug)]
pub enum MeasurementChain<'a> {
    /// Hold, motor, amplifier and the delays of a bench; input in amperes. Exact, what sampling folds back included.
    Bench(&'a Config),
    /// Nothing: input in newtons, or in a unit that takes its place.
    Bare,
}

/// Where a block is looked at: at two frequencies that share its moments, or at the one that it has.
pub(super) struct Nodes(Vec<(Node, Option<Node>)>);

struct Node {
    s: Complex<f64>,
    /// exp(s T) of a bench.
    z: Complex<f64>,
    /// exp(-s tau).
    late: Complex<f64>,
}

impl Nodes {
    /// The mean of a response over each block, late.
    fn over(&self, response: impl Fn(&Node) -> Complex<f64>) -> Vec<Complex<f64>> {
        let late = |node: &Node| response(node) * node.late;
        let mean = |(one, other): &(Node, Option<Node>)| match other {
            Some(other) => (late(one) + late(other)) * 0.5,
            None => late(one),
        };
        self.0.iter().map(mean).collect()
    }
}

impl MeasurementChain<'_> {
    /// Where `frf_data` are looked at, `delay_s` later.
    pub(super) fn nodes(&self, delay_s: f64, frf_data: &[FrfDatum]) -> Nodes {
        let turn = |angle: f64| {
            let (sine, cosine) = libm::sincos(angle);
            Complex::new(cosine, sine)
        };
        let period_s = match self {
            MeasurementChain::Bench(config) => config.servo.period_s(),
            MeasurementChain::Bare => 0.0,
        };
        let node = |hz: f64| {
            let omega_rad_s = 2.0 * std::f64::consts::PI * hz;
            let s = Complex::new(0.0, omega_rad_s);
            Node {
                s,
                z: turn(omega_rad_s * period_s),
                late: turn(-omega_rad_s * delay_s),
            }
        };
        let of = |block: &FrfDatum| match block.spread_hz {
            0.0 => (node(block.frequency_hz), None),
            spread_hz => (
                node(block.frequency_hz - spread_hz),
                Some(node(block.frequency_hz + spread_hz)),
            ),
        };
        Nodes(frf_data.iter().map(of).collect())
    }

    /// The response of a mode of residue 1 over each block.
    pub(super) fn mode(
        &self,
        (omega_rad_s, damping_ratio): (f64, f64),
        nodes: &Nodes,
    ) -> Vec<Complex<f64>> {
        let shape = DVector::zeros(0);
        let mode = Mode {
            omega_rad_s,
            damping_ratio,
            shape,
            force_gain: 1.0,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        };
        match self {
            MeasurementChain::Bench(config) => {
                let chain = LoopPlant::with_mean_age(config, &[mode]);
                nodes.over(|node| chain.response_at(node.z))
            }
            MeasurementChain::Bare => nodes.over(|node| mode.resonance(node.s)),
        }
    }

    /// What the frf_data show of the mechanics alone, in m/N: hold, motor, amplifier and delays taken out, and `delay_s` more.
    /// What sampling folds back stays.
    pub fn mechanics(&self, frf_data: &[FrfDatum], delay_s: f64) -> Vec<Complex<f64>> {
        let constant = self.constant(&self.nodes(delay_s, frf_data));
        frf_data
            .iter()
            .zip(constant)
            .map(|(block, constant)| block.response / constant)
            .collect()
    }

    /// The response of a constant compliance of 1 m/N over each block.
    pub(super) fn constant(&self, nodes: &Nodes) -> Vec<Complex<f64>> {
        self.mode((FAR_RAD_S, 1.0), nodes)
            .into_iter()
            .map(|h| h * (FAR_RAD_S * FAR_RAD_S))
            .collect()
    }
}

/// d ln G/d w and d ln G/d zeta of a mode at s = j w: those of the continuous mode, which sampling alters by what it folds
/// back, a part in a thousand of a slope.
pub(super) fn slopes(term: &ModalTerm, omega_rad_s: f64) -> [Complex<f64>; 2] {
    let (s, w, zeta) = (
        Complex::new(0.0, omega_rad_s),
        term.omega_rad_s,
        term.damping_ratio,
    );
    let resonance = term.resonance(s);
    [
        -resonance * (s * (2.0 * zeta) + 2.0 * w),
        -resonance * s * (2.0 * w),
    ]
}
