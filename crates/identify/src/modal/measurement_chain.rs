//! The measurement chain through which the mechanics are observed.

use nalgebra::Complex;

use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;
use bench_plant::{FAR_RAD_S, LoopPlant, Mode, OutputKind, PathResponses, SignalPath};

/// The signal path between set-point and reading, without the mechanics.
///
/// A velocity or an acceleration is s or s^2 times the response of the mechanics: modes, R and delay of a fit are those of the position
/// whatever the chain measures, and so is the response that is freed of the chain.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasurementChain {
    /// A command held over each period, amplifier, motor and delays; input in amperes for a bench. Exact, aliasing included.
    Bench(SignalPath),
    /// No chain: the input is a force in newtons, or another input unit, and the output a position.
    Direct,
    /// Lag between the measured input and the force, or a hold that is not a period of the samples; any output. Without aliasing.
    Input(InputPath, OutputKind),
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

/// Aliases, turned by the sampling frequency times a change of the delay, are the same below this angle.
const ALIAS_PHASE_RAD: f64 = 0.1;
/// The angle is smaller by this factor for each derivative of the output: derivatives raise the aliases.
const ALIAS_PHASE_RATIO: f64 = 0.1;
/// A hold that differs from a period by less than this ratio is one: the times of a file are rounded.
const HOLD_ROUNDING: f64 = 1e-6;
/// A lag below this ratio of the hold is none: it turns the response by 3e-4 rad at the Nyquist frequency, which the fitted delay
/// removes, and changes its magnitude by 5e-8. The exact sampling of a much shorter lag is a difference of nearly equal numbers.
const NEGLIGIBLE_LAG: f64 = 1e-4;
/// Advance of a reading that is measured after the step of its sample, as a ratio of the period. It turns the response by 3e-6 rad at
/// the Nyquist frequency, which the fitted delay removes.
const ADVANCE_RATIO: f64 = 1e-6;

impl InputPath {
    /// The chain of signals with this many samples per second. A sample held for its period is observed exactly, aliases included.
    pub fn chain(&self, rate_hz: f64) -> MeasurementChain {
        let held_periods = self.hold_s * rate_hz;
        if (held_periods - 1.0).abs() > HOLD_ROUNDING {
            return MeasurementChain::Input(*self, OutputKind::Position);
        }
        let lag_s = if self.has_lag() { self.lag_s } else { 0.0 };
        MeasurementChain::Bench(SignalPath {
            period_s: self.hold_s,
            // Infinite without a lag.
            amplifier_bandwidth_hz: 1.0 / (2.0 * std::f64::consts::PI * lag_s),
            force_constant_n_per_a: 1.0,
            delays_s: vec![0.0],
            output: OutputKind::Position,
        })
    }

    /// The chain of an acceleration that steps with its input, read after the step; `None` of any other output.
    ///
    /// A held force without a lag steps at the samples, and so does the acceleration: the reading of a sample may have been taken before
    /// its step ([`InputPath::chain`]), as in a loop that reads before it writes, or after it, as in most simulations. Only the data show
    /// which.
    pub fn chain_after_step(&self, rate_hz: f64, output: OutputKind) -> Option<MeasurementChain> {
        let MeasurementChain::Bench(path) = self.chain(rate_hz).observing(output) else {
            return None;
        };
        let steps = output == OutputKind::Acceleration && !self.has_lag();
        steps.then(|| {
            MeasurementChain::Bench(SignalPath {
                delays_s: vec![-ADVANCE_RATIO * path.period_s],
                ..path
            })
        })
    }

    /// Whether the lag of a held input changes its samples.
    fn has_lag(&self) -> bool {
        self.lag_s > NEGLIGIBLE_LAG * self.hold_s
    }

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

/// The frequencies at which the model of each datum is evaluated, with that part of the model that its parameters do not change. A datum
/// has two nodes, one after the other, which have its first three moments, or one.
pub(super) struct Nodes {
    /// The chain, with an additional delay.
    chain: MeasurementChain,
    /// The additional delay: the aliases have it too. Only a change of the delay multiplies the response by exp(-s change).
    delay_s: f64,
    /// Whether each datum has two nodes.
    has_two: Vec<bool>,
    /// j w of each node.
    s: Vec<Complex<f64>>,
    /// The chain at the nodes.
    path: ChainResponses,
    /// The response at the nodes of a mode far above all frequencies.
    far: Vec<Complex<f64>>,
}

/// A response at each node, with the delay of the nodes.
pub(super) struct NodeResponse(Vec<Complex<f64>>);

/// exp(-s change) at each node, for one change of the delay.
pub(super) struct Delays(Vec<Complex<f64>>);

/// The chain at some frequencies.
enum ChainResponses {
    Bench(PathResponses),
    Direct,
    Input(Vec<Complex<f64>>),
}

/// A mode of residue 1, to be observed through a chain.
struct ObservedMode {
    mode: Mode,
    /// The mode at the end of the signal path of a bench.
    plant: Option<LoopPlant>,
}

impl ObservedMode {
    fn responses(&self, s: &[Complex<f64>], chain: &ChainResponses) -> Vec<Complex<f64>> {
        let resonances = s.iter().map(|s| self.mode.resonance(*s));
        match (chain, &self.plant) {
            (ChainResponses::Bench(path), Some(plant)) => plant.responses_along(path),
            (ChainResponses::Input(path), _) => resonances
                .zip(path)
                .map(|(mode, path)| mode * path)
                .collect(),
            (ChainResponses::Bench(_) | ChainResponses::Direct, _) => resonances.collect(),
        }
    }
}

impl ChainResponses {
    fn new(chain: &MeasurementChain, far: &ObservedMode, s: &[Complex<f64>]) -> ChainResponses {
        match (chain, &far.plant) {
            (MeasurementChain::Bench(path), Some(plant)) => {
                let z = s.iter().map(|s| unit_phasor(s.im * path.period_s));
                let z: Vec<Complex<f64>> = z.collect();
                ChainResponses::Bench(plant.path_responses(&z))
            }
            (MeasurementChain::Input(path, output), _) => {
                let at = |s: &Complex<f64>| path.response(*s) * output.factor(*s);
                ChainResponses::Input(s.iter().map(at).collect())
            }
            (MeasurementChain::Bench(_) | MeasurementChain::Direct, _) => ChainResponses::Direct,
        }
    }
}

/// exp(j angle).
pub(super) fn unit_phasor(angle: f64) -> Complex<f64> {
    let (sine, cosine) = libm::sincos(angle);
    Complex::new(cosine, sine)
}

impl Nodes {
    /// The nodes at frequencies with their spreads in hertz, at a chain with an additional delay.
    fn new(
        chain: &MeasurementChain,
        frequencies: impl Iterator<Item = (f64, f64)>,
        delay_s: f64,
    ) -> Nodes {
        let (chain, delay_s) = chain.with_added_delay(delay_s);
        let (mut has_two, mut s) = (Vec::new(), Vec::new());
        for (frequency_hz, spread_hz) in frequencies {
            let mut add = |hz: f64| s.push(Complex::new(0.0, 2.0 * std::f64::consts::PI * hz));
            has_two.push(spread_hz != 0.0);
            add(frequency_hz - spread_hz);
            if spread_hz != 0.0 {
                add(frequency_hz + spread_hz);
            }
        }
        let far = chain.observed(FAR_RAD_S, 1.0);
        let path = ChainResponses::new(&chain, &far, &s);
        // The velocity of such a mode is a pulse after each step, of which samples show nothing: its aliases cancel it. Of modes that
        // are not that far, samples show the compliance.
        let continuous =
            |s: &Complex<f64>| chain.continuous_response(*s, 0.0) / (FAR_RAD_S * FAR_RAD_S);
        let far = match chain.output() {
            OutputKind::Position => far.responses(&s, &path),
            OutputKind::Velocity | OutputKind::Acceleration => s.iter().map(continuous).collect(),
        };
        Nodes {
            chain,
            delay_s,
            has_two,
            s,
            path,
            far,
        }
    }

    /// exp(-s change) at each node, for the change from the delay of the nodes to `delay_s` beyond the given chain.
    pub(super) fn delays(&self, delay_s: f64) -> Delays {
        let change_s = delay_s - self.delay_s;
        let phasors = self.s.iter().map(|s| unit_phasor(-s.im * change_s));
        Delays(phasors.collect())
    }

    /// Whether the aliases of the chain with this delay differ from those of the nodes: by [`ALIAS_PHASE_RAD`] and more.
    pub(super) fn have_other_aliases(&self, delay_s: f64) -> bool {
        let MeasurementChain::Bench(path) = &self.chain else {
            return false;
        };
        if is_advanced(path) {
            return false;
        }
        let sampling_rad_s = 2.0 * std::f64::consts::PI / path.period_s;
        // The whole delay is not negative.
        let least_s = self.delay_s - path.mean_delay_s();
        let turn_rad = (delay_s.max(least_s) - self.delay_s).abs() * sampling_rad_s;
        turn_rad > ALIAS_PHASE_RAD * ALIAS_PHASE_RATIO.powi(path.output.derivatives())
    }

    /// Whether aliases change the derivatives of a mode at the nodes: those of a mode above them, seen through samples.
    pub(super) fn show_aliases_of(&self, term: &ModalTerm) -> bool {
        let last_rad_s = self.s.last().map_or(0.0, |s| s.im);
        matches!(self.path, ChainResponses::Bench(_)) && term.omega_rad_s > last_rad_s
    }

    /// The distance of the pole of a mode above all nodes from them, as a ratio of its frequency: about max(zeta, 1 - w_end/w).
    pub(super) fn relative_distance(&self, term: &ModalTerm) -> f64 {
        let last_rad_s = self.s.last().map_or(0.0, |s| s.im);
        let beyond = 1.0 - last_rad_s / term.omega_rad_s;
        beyond.max(term.damping_ratio)
    }

    /// The response of a mode of residue 1, its own excluded.
    pub(super) fn mode(&self, term: &ModalTerm) -> NodeResponse {
        let mode = self.chain.observed(term.omega_rad_s, term.damping_ratio);
        NodeResponse(mode.responses(&self.s, &self.path))
    }

    /// The response of a mode of rate 1 s/kg, with the numerator s: the derivative by time of that of residue 1. Through the samples of a
    /// bench it is that of the next kind of output; of an acceleration it is 0, see [`MeasurementChain::shows_rates`].
    pub(super) fn mode_rate(&self, term: &ModalTerm) -> NodeResponse {
        if !matches!(self.path, ChainResponses::Bench(_)) {
            let mut rates = self.mode(term);
            let with_s = rates.0.iter_mut().zip(&self.s);
            with_s.for_each(|(rate, s)| *rate *= s);
            return rates;
        }
        let Some(output) = self.chain.output().derivative() else {
            return NodeResponse(vec![Complex::new(0.0, 0.0); self.s.len()]);
        };
        let chain = self.chain.clone().observing(output);
        let mode = chain.observed(term.omega_rad_s, term.damping_ratio);
        NodeResponse(mode.responses(&self.s, &self.path))
    }

    /// The mean of a response over each datum, with the delay.
    pub(super) fn mean(&self, response: &NodeResponse, delays: &Delays) -> Vec<Complex<f64>> {
        self.mean_of(&response.0, delays)
    }

    /// The response of a constant compliance of 1 m/N for each datum.
    pub(super) fn constant(&self, delays: &Delays) -> Vec<Complex<f64>> {
        let far = self.mean_of(&self.far, delays);
        far.into_iter()
            .map(|h| h * (FAR_RAD_S * FAR_RAD_S))
            .collect()
    }

    fn mean_of(&self, response: &[Complex<f64>], delays: &Delays) -> Vec<Complex<f64>> {
        let mut node = 0;
        let mut next = || {
            let delayed = response[node] * delays.0[node];
            node += 1;
            delayed
        };
        let data = self.has_two.iter();
        data.map(|has_two| {
            let first = next();
            if *has_two {
                (first + next()) * 0.5
            } else {
                first
            }
        })
        .collect()
    }
}

impl MeasurementChain {
    /// The chain of a bench, with readings that all have the mean age.
    pub fn bench(path: impl Into<SignalPath>) -> MeasurementChain {
        MeasurementChain::Bench(path.into().with_mean_age())
    }

    /// The same chain with another output.
    #[must_use]
    pub fn observing(self, output: OutputKind) -> MeasurementChain {
        match (self, output) {
            (MeasurementChain::Bench(path), _) => {
                MeasurementChain::Bench(SignalPath { output, ..path })
            }
            (MeasurementChain::Direct, OutputKind::Position) => MeasurementChain::Direct,
            (MeasurementChain::Direct, _) => MeasurementChain::Input(InputPath::default(), output),
            (MeasurementChain::Input(path, _), _) => MeasurementChain::Input(path, output),
        }
    }

    /// Whether the data show complex residues. Of samples of an acceleration by a held force they do not: each step of the force gives an
    /// impulse in the derivative of the acceleration, of which a sample shows nothing or all, by its delay. Those of all modes cancel, but not
    /// those of the modes in the band.
    pub(crate) fn shows_rates(&self) -> bool {
        let is_bench = matches!(self, MeasurementChain::Bench(_));
        !is_bench || self.output() != OutputKind::Acceleration
    }

    /// The period in seconds of samples by a held input, if the chain is that of samples.
    pub(super) fn period_s(&self) -> Option<f64> {
        match self {
            MeasurementChain::Bench(path) => Some(path.period_s),
            MeasurementChain::Direct | MeasurementChain::Input(..) => None,
        }
    }

    /// What is measured.
    pub fn output(&self) -> OutputKind {
        match self {
            MeasurementChain::Bench(path) => path.output,
            MeasurementChain::Direct => OutputKind::Position,
            MeasurementChain::Input(_, output) => *output,
        }
    }

    /// Whether samples show a mode of this frequency in its place: below half of their rate. A chain without samples has none.
    pub(super) fn is_below_nyquist(&self, omega_rad_s: f64) -> bool {
        match self {
            MeasurementChain::Bench(path) => omega_rad_s * path.period_s < std::f64::consts::PI,
            MeasurementChain::Direct | MeasurementChain::Input(..) => true,
        }
    }

    /// The magnitude of a response as a velocity, up to a factor: modes are its peaks.
    pub(super) fn velocity(&self, datum: &FrfDatum) -> f64 {
        let integrations = 1 - self.output().derivatives();
        datum.response.norm() * datum.frequency_hz.powi(integrations)
    }

    /// The chain of a bench with an additional delay, as far as its whole delay is not negative, and the delay that was added. Nothing
    /// is added to the other chains: their delay multiplies the response by exp(-s tau). A reading after the step of its sample remains one.
    fn with_added_delay(&self, delay_s: f64) -> (MeasurementChain, f64) {
        let MeasurementChain::Bench(path) = self else {
            return (self.clone(), 0.0);
        };
        if is_advanced(path) {
            return (self.clone(), 0.0);
        }
        let delayed = path.with_added_delay(delay_s);
        let added_s = delayed.mean_delay_s() - path.mean_delay_s();
        (MeasurementChain::Bench(delayed), added_s)
    }

    /// The nodes of `data`, for delays of about `delay_s` beyond that of the chain.
    pub(super) fn nodes(&self, data: &[FrfDatum], delay_s: f64) -> Nodes {
        let frequencies = data
            .iter()
            .map(|datum| (datum.frequency_hz, datum.spread_hz));
        Nodes::new(self, frequencies, delay_s)
    }

    /// One node at each frequency.
    pub(super) fn nodes_at(&self, frequency_hz: &[f64], delay_s: f64) -> Nodes {
        Nodes::new(self, frequency_hz.iter().map(|hz| (*hz, 0.0)), delay_s)
    }

    /// A mode of residue 1 at this chain.
    fn observed(&self, omega_rad_s: f64, damping_ratio: f64) -> ObservedMode {
        let mode = Mode::unit(omega_rad_s, damping_ratio);
        let plant = match self {
            MeasurementChain::Bench(path) => Some(LoopPlant::of(path, std::slice::from_ref(&mode))),
            MeasurementChain::Direct | MeasurementChain::Input(..) => None,
        };
        ObservedMode { mode, plant }
    }

    /// The response at s = j w from the samples of the command to the force and, with a delay of `delay_s` beyond that of the chain and
    /// the derivatives s^k of its output, from the position to the reading, without aliases: that of a signal that is continuous in time.
    pub(crate) fn continuous_response(&self, s: Complex<f64>, delay_s: f64) -> Complex<f64> {
        let delay = unit_phasor(-s.im * delay_s) * self.output().factor(s);
        match self {
            MeasurementChain::Direct => delay,
            MeasurementChain::Input(path, _) => path.response(s) * delay,
            MeasurementChain::Bench(path) => {
                let bandwidth_rad_s = 2.0 * std::f64::consts::PI * path.amplifier_bandwidth_hz;
                let held = InputPath {
                    hold_s: path.period_s,
                    lag_s: 1.0 / bandwidth_rad_s,
                };
                let delays = path.delays_s.iter();
                let mean: Complex<f64> = delays.map(|delay_s| unit_phasor(-s.im * delay_s)).sum();
                let share = path.force_constant_n_per_a / path.delays_s.len() as f64;
                held.response(s) * mean * share * delay
            }
        }
    }

    /// Data that were measured through this chain without hold, motor, amplifier and delays, as a position whatever the output is, in m/N.
    /// Aliases remain.
    pub(crate) fn without_chain(&self, data: &[FrfDatum], delay_s: f64) -> Vec<Complex<f64>> {
        let freed = data.iter().map(|datum| {
            let s = Complex::new(0.0, datum.omega_rad_s());
            datum.response / self.continuous_response(s, delay_s)
        });
        freed.collect()
    }

    /// The response of the mechanics alone in m/N, a position whatever the output is, of data that were measured through this chain: without hold, motor, amplifier and
    /// delays, and without the aliases that the fit `through_chain`, of the mechanics `fitted`, has at the data.
    ///
    /// ```text
    /// G = (H - alias)/P,    alias = H_fit - P G_fit,    P the chain without aliases
    /// ```
    pub(crate) fn mechanics(
        &self,
        data: &[FrfDatum],
        delay_s: f64,
        fitted: &[Complex<f64>],
        through_chain: &[Complex<f64>],
    ) -> Vec<Complex<f64>> {
        let fits = fitted.iter().zip(through_chain);
        data.iter()
            .zip(fits)
            .map(|(datum, (fitted, through_chain))| {
                let s = Complex::new(0.0, datum.omega_rad_s());
                let chain = self.continuous_response(s, delay_s);
                (datum.response - through_chain) / chain + fitted
            })
            .collect()
    }
}

/// Whether readings are taken after the step of their samples.
fn is_advanced(path: &SignalPath) -> bool {
    path.mean_delay_s() < 0.0
}

/// d ln G/d w and d ln G/d zeta of a mode at s = j w: those of the continuous mode, from which sampling deviates by a
/// thousandth near the mode. Factors s^k of the output do not change them. For a mode far from all data, see
/// [`Nodes::show_aliases_of`].
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
