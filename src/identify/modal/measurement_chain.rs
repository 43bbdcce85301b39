//! The measurement chain through which the mechanics are observed.

use nalgebra::{Complex, DVector};

use crate::config::Config;
use crate::identify::FrfDatum;
use crate::model::plant::{LoopPlant, Mode, SignalPath};
use crate::model::zeros::ModalTerm;

/// A mode far above all frequencies of interest acts as a constant compliance: the contribution of modes above the band.
const FAR_RAD_S: f64 = 1e6;

/// The signal path between set-point and reading, without the mechanics.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasurementChain {
    /// Hold, motor, amplifier and delays of a bench; input in amperes. Exact, aliasing included.
    Bench(SignalPath),
    /// No chain: the input is a force in newtons, or another input unit.
    Direct,
    /// Hold and lag between the recorded input and the force.
    Input(InputPath),
}

/// What lies between the samples of an input and the force, apart from a delay.
///
/// ```text
/// (1 - exp(-s T))/(s T) 1/(1 + s tau)             T the hold, tau the lag
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InputPath {
    /// Time in seconds for which each sample is held; 0 without a hold.
    pub hold_s: f64,
    /// Time constant in seconds of a first-order lag, for example of a current loop; 0 without one.
    pub lag_s: f64,
}

impl InputPath {
    fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let held = s * self.hold_s;
        let hold = if held.norm() > 0.0 {
            (-(-held).exp() + 1.0) / held
        } else {
            Complex::new(1.0, 0.0)
        };
        hold / (s * self.lag_s + 1.0)
    }
}

/// The frequencies at which the model of each datum is evaluated.
pub(super) struct Nodes(Vec<DatumNodes>);

/// Two frequencies that have the first three moments of a datum, or one.
struct DatumNodes(Node, Option<Node>);

struct Node {
    s: Complex<f64>,
    /// exp(s T) of a bench.
    z: Complex<f64>,
    /// exp(-s tau).
    delay: Complex<f64>,
}

impl Node {
    fn new(frequency_hz: f64, period_s: f64, delay_s: f64) -> Node {
        let omega_rad_s = 2.0 * std::f64::consts::PI * frequency_hz;
        Node {
            s: Complex::new(0.0, omega_rad_s),
            z: unit_phasor(omega_rad_s * period_s),
            delay: unit_phasor(-omega_rad_s * delay_s),
        }
    }

    /// A response at this frequency, with the delay.
    fn delayed(&self, response: impl Fn(&Node) -> Complex<f64>) -> Complex<f64> {
        response(self) * self.delay
    }
}

impl DatumNodes {
    fn new(datum: &FrfDatum, period_s: f64, delay_s: f64) -> DatumNodes {
        let (frequency_hz, spread_hz) = (datum.frequency_hz, datum.spread_hz);
        if spread_hz == 0.0 {
            return DatumNodes(Node::new(frequency_hz, period_s, delay_s), None);
        }
        let [low, high] = [frequency_hz - spread_hz, frequency_hz + spread_hz]
            .map(|frequency_hz| Node::new(frequency_hz, period_s, delay_s));
        DatumNodes(low, Some(high))
    }

    /// The mean of a response over the datum, with the delay.
    fn mean(&self, response: impl Fn(&Node) -> Complex<f64>) -> Complex<f64> {
        match &self.1 {
            Some(other) => (self.0.delayed(&response) + other.delayed(&response)) * 0.5,
            None => self.0.delayed(response),
        }
    }
}

/// exp(j angle).
fn unit_phasor(angle: f64) -> Complex<f64> {
    let (sine, cosine) = libm::sincos(angle);
    Complex::new(cosine, sine)
}

impl Nodes {
    /// The mean of a response over each datum, with the delay.
    fn mean(&self, response: impl Fn(&Node) -> Complex<f64>) -> Vec<Complex<f64>> {
        self.0.iter().map(|nodes| nodes.mean(&response)).collect()
    }
}

impl MeasurementChain {
    /// The chain of a bench, with readings that all have the mean age.
    pub fn bench(config: &Config) -> MeasurementChain {
        MeasurementChain::Bench(SignalPath::from(config).with_mean_age())
    }

    /// The nodes of `data` for a model with the delay `delay_s`.
    pub(super) fn nodes(&self, delay_s: f64, data: &[FrfDatum]) -> Nodes {
        let period_s = self.period_s();
        let nodes = data
            .iter()
            .map(|datum| DatumNodes::new(datum, period_s, delay_s));
        Nodes(nodes.collect())
    }

    /// One node at each frequency.
    pub(super) fn nodes_at(&self, delay_s: f64, frequency_hz: &[f64]) -> Nodes {
        let period_s = self.period_s();
        let nodes = frequency_hz
            .iter()
            .map(|frequency_hz| DatumNodes(Node::new(*frequency_hz, period_s, delay_s), None));
        Nodes(nodes.collect())
    }

    /// Sampling period; 0 without sampling.
    fn period_s(&self) -> f64 {
        match self {
            MeasurementChain::Bench(settings) => settings.period_s,
            MeasurementChain::Direct | MeasurementChain::Input(_) => 0.0,
        }
    }

    /// The response of a mode of residue 1 for each datum.
    pub(super) fn mode(
        &self,
        omega_rad_s: f64,
        damping_ratio: f64,
        nodes: &Nodes,
    ) -> Vec<Complex<f64>> {
        let mode = Mode {
            omega_rad_s,
            damping_ratio,
            shape: DVector::zeros(0),
            force_gain: 1.0,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        };
        match self {
            MeasurementChain::Bench(settings) => {
                let plant = LoopPlant::of(settings, &[mode]);
                nodes.mean(|node| plant.response_at(node.z))
            }
            MeasurementChain::Direct => nodes.mean(|node| mode.resonance(node.s)),
            MeasurementChain::Input(path) => {
                nodes.mean(|node| mode.resonance(node.s) * path.response(node.s))
            }
        }
    }

    /// The response of the mechanics alone in m/N: the data without hold, motor, amplifier and delays, and without another
    /// delay of `delay_s`. Aliases are not removed.
    pub(crate) fn mechanics(&self, data: &[FrfDatum], delay_s: f64) -> Vec<Complex<f64>> {
        let chain = self.constant(&self.nodes(delay_s, data));
        data.iter()
            .zip(chain)
            .map(|(datum, chain)| datum.response / chain)
            .collect()
    }

    /// The response of a constant compliance of 1 m/N for each datum.
    pub(super) fn constant(&self, nodes: &Nodes) -> Vec<Complex<f64>> {
        let far = self.mode(FAR_RAD_S, 1.0, nodes);
        far.into_iter()
            .map(|h| h * (FAR_RAD_S * FAR_RAD_S))
            .collect()
    }
}

/// d ln G/d w and d ln G/d zeta of a mode at s = j w: those of the continuous mode, from which sampling deviates by a
/// thousandth.
pub(super) fn log_derivatives(term: &ModalTerm, omega_rad_s: f64) -> [Complex<f64>; 2] {
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
