//! Margins of random loops against an own discretisation on a dense grid.
//!
//! Plant: P(s) = a/(s + a) sum of r Kf/(s^2 + 2 zeta w s + w^2) by partial fractions c_k/(s - p_k), so that its step response is
//! y(t) = sum c_k/p_k (exp(p_k t) - 1). A set-point held for a period T, sampled after the delay (n + r) T, gives
//!
//! ```text
//! P(z) = z^-n (y((1 - r) T) z^-1 + sum c_k/p_k (1 - exp(-p_k T)) exp(p_k (2 - r) T) z^-2/(1 - exp(p_k T) z^-1))
//! ```
//!
//! Controller: continuous sections at s = (2/T)(z - 1)/(z + 1).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use bench_control::{ClosedLoop, ControllerText, Margins, Section};
use bench_plant::{LoopPlant, Mode, OutputKind, SignalPath};
use bench_test_support::seeds::over_seeds;
use nalgebra::{Complex, DVector};
use rand_core::Rng;
use rand_pcg::Pcg64;

type C = Complex<f64>;

/// Loops of an ordinary run; `BENCH_RANDOM_LOOPS` gives another number.
const LOOPS: u64 = 200;
const FORCE_CONSTANT_N_PER_A: f64 = 10.0;
const UM_PER_M: f64 = 1e6;

struct Random(Pcg64);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    fn log(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }
}

/// A loop and its own discretisation.
struct RandomLoop {
    period_s: f64,
    delay_periods: f64,
    bandwidth_hz: f64,
    modes: Vec<Mode>,
    sections: Vec<Section>,
    /// Poles p_k with c_k/p_k.
    terms: Vec<(C, C)>,
    integrators: usize,
}

fn section(numerator: [f64; 3], denominator: [f64; 3]) -> Section {
    Section {
        numerator,
        denominator,
        prewarp_rad_s: None,
    }
}

impl RandomLoop {
    fn new(seed: u64) -> RandomLoop {
        let mut random = Random(Pcg64::new(u128::from(seed), 0x6d61_7267));
        let rate_hz = random.log(500.0, 20_000.0);
        let nyquist = PI * rate_hz;
        let count = 1 + random.within(0.0, 5.0) as usize;
        let modes = (0..count).map(|i| {
            let range = if i == 0 { (0.01, 0.4) } else { (0.05, 3.5) };
            let w = nyquist * random.log(range.0, range.1);
            let sign = if i > 0 && random.within(0.0, 1.0) < 0.5 {
                -1.0
            } else {
                1.0
            };
            // The compliance of each mode is of the order of 1/w.
            Mode {
                omega_rad_s: w,
                damping_ratio: random.log(1e-4, 1e-1),
                shape: DVector::zeros(0),
                force_gain: sign * random.log(0.01, 1.0) * w * w / (nyquist * nyquist),
                sensor_gain: 1.0,
                floor_gain: 0.0,
            }
        });
        let modes: Vec<Mode> = modes.collect();
        let integrators = [0, 1, 1, 1, 1, 2][random.within(0.0, 6.0) as usize];
        let corner = nyquist * random.log(0.003, 0.3);
        let mut sections = match integrators {
            0 => vec![section([1.0, 0.0, 0.0], [1.0, 1.0 / corner, 0.0])],
            1 => vec![section([1.0, 0.0, 0.0], [0.0, 1.0 / corner, 0.0])],
            // Conditionally stable: two integrators and two zeros.
            _ => vec![
                section([1.0, 2.0 / corner, 0.0], [0.0, 1.0 / corner, 0.0]),
                section([1.0, 2.0 / corner, 0.0], [0.0, 1.0 / corner, 0.0]),
                section([1.0, 0.0, 0.0], [1.0, 0.1 / corner, 0.0]),
            ],
        };
        if random.within(0.0, 1.0) < 0.5 {
            let (w, zero, pole) = (
                nyquist * random.log(0.02, 0.7),
                random.log(1e-3, 0.3),
                random.log(0.05, 0.9),
            );
            sections.push(section(
                [1.0, 2.0 * zero / w, 1.0 / (w * w)],
                [1.0, 2.0 * pole / w, 1.0 / (w * w)],
            ));
        }
        let mut found = RandomLoop {
            period_s: 1.0 / rate_hz,
            delay_periods: random.within(0.0, 1.0).round() + random.within(0.0, 1.5),
            bandwidth_hz: rate_hz * random.log(0.1, 2.0),
            modes,
            sections,
            terms: Vec::new(),
            integrators,
        };
        found.terms = found.partial_fractions();
        let largest = found.largest_resonance(corner);
        let gain = random.log(0.1, 2.0) / largest;
        found.sections[0].numerator = found.sections[0].numerator.map(|c| c * gain);
        found
    }

    fn partial_fractions(&self) -> Vec<(C, C)> {
        let a = TAU * self.bandwidth_hz;
        let mut terms = Vec::new();
        let mut of_amplifier = 0.0;
        for mode in &self.modes {
            let (w, zeta) = (mode.omega_rad_s, mode.damping_ratio);
            let strength = mode.force_gain * mode.sensor_gain * FORCE_CONSTANT_N_PER_A;
            let pole = C::new(-zeta * w, w * (1.0 - zeta * zeta).sqrt());
            let residue = C::from(a * strength) / ((pole + a) * (pole - pole.conj()));
            terms.push((pole, residue / pole));
            terms.push((pole.conj(), (residue / pole).conj()));
            of_amplifier += a * strength / (a * a - 2.0 * zeta * w * a + w * w);
        }
        terms.push((C::from(-a), C::from(of_amplifier / -a)));
        terms
    }

    /// The largest |L| at the resonances and at the corner of the controller, before the gain is set.
    fn largest_resonance(&self, corner: f64) -> f64 {
        let folded = self.folded();
        let places = folded.iter().map(|(w, _)| *w).chain([corner]);
        let nyquist = PI / self.period_s;
        let places = places.map(|w| w.clamp(1e-3 * nyquist, nyquist * (1.0 - 1e-6)));
        places.map(|w| self.gain(w).norm()).fold(0.0, f64::max)
    }

    /// Frequency below half the rate and width of the modes and of the roots of the sections.
    fn folded(&self) -> Vec<(f64, f64)> {
        let turn = TAU / self.period_s;
        let modes = self.modes.iter().map(|mode| {
            let (w, zeta) = (mode.omega_rad_s, mode.damping_ratio);
            let damped = w * (1.0 - zeta * zeta).sqrt() % turn;
            (damped.min(turn - damped), zeta * w)
        });
        let polynomials = self
            .sections
            .iter()
            .flat_map(|s| [s.numerator, s.denominator]);
        let pairs = polynomials.filter(|c| c[2] != 0.0).map(|c| {
            let w = (c[0] / c[2]).sqrt();
            let warped = 2.0 / self.period_s * (w * self.period_s / 2.0).atan();
            (warped, c[1] / (2.0 * c[2] * w) * w)
        });
        modes.chain(pairs).collect()
    }

    /// L at z = exp(j w T).
    fn gain(&self, w: f64) -> C {
        let period_s = self.period_s;
        let z = C::from_polar(1.0, w * period_s);
        let s = C::new(0.0, 2.0 / period_s * (w * period_s / 2.0).tan());
        let law: C = self
            .sections
            .iter()
            .map(|section| section.response(s))
            .product();
        self.plant(z) * law * UM_PER_M
    }

    fn plant(&self, z: C) -> C {
        let whole = self.delay_periods.floor();
        let rest = self.delay_periods - whole;
        let period_s = self.period_s;
        let sum: C = self
            .terms
            .iter()
            .map(|(pole, ratio)| {
                let at = |periods: f64| (pole * (periods * period_s)).exp();
                let first = (at(1.0 - rest) - 1.0) * ratio / z;
                let later = ratio * (C::from(1.0) - at(-1.0)) * at(2.0 - rest);
                first + later / (z * (z - at(1.0)))
            })
            .sum();
        sum * z.powi(-(whole as i32))
    }

    fn closed_loop(&self) -> ClosedLoop {
        let path = SignalPath {
            period_s: self.period_s,
            amplifier_bandwidth_hz: self.bandwidth_hz,
            force_constant_n_per_a: FORCE_CONSTANT_N_PER_A,
            delays_s: vec![self.delay_periods * self.period_s],
            output: OutputKind::Position,
        };
        let plant = LoopPlant::of(&path, &self.modes);
        let (modes, design) = (self.modes.clone(), Box::new(self.sections.clone()));
        ClosedLoop::new(plant, modes, FORCE_CONSTANT_N_PER_A, design).unwrap()
    }

    /// Rising frequencies, dense near each resonance.
    fn dense(&self) -> Vec<f64> {
        let nyquist = PI / self.period_s;
        let mut grid: Vec<f64> = (1..3000).map(|i| nyquist * f64::from(i) / 3000.0).collect();
        grid.extend((0..2400).map(|i| nyquist * 10f64.powf(-f64::from(i) / 240.0)));
        for (centre, width) in self.folded() {
            grid.extend((-420..=420).map(|i| centre + width * (f64::from(i) / 35.0).sinh()));
        }
        grid.retain(|w| *w > 0.0 && *w < nyquist * (1.0 - 1e-9));
        grid.push(nyquist * (1.0 - 1e-9));
        grid.sort_by(f64::total_cmp);
        grid
    }
}

/// Margins by the dense grid.
struct Dense {
    modulus: f64,
    upper_db: Option<f64>,
    lower_db: Option<f64>,
    delay_s: Option<f64>,
    stable: bool,
}

fn golden(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        let (a, b) = (
            low + 0.381_966 * (high - low),
            high - 0.381_966 * (high - low),
        );
        if f(a) < f(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

fn root(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let sign = f(low) > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == sign {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

fn smallest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

impl Dense {
    fn of(random: &RandomLoop) -> Dense {
        let nyquist = PI / random.period_s;
        let mut grid = random.dense();
        let distance = |w: f64| (random.gain(w) + 1.0).norm();
        let values: Vec<f64> = grid.iter().map(|w| distance(*w)).collect();
        let inner = 1..grid.len() - 1;
        let minima = inner.filter(|&i| values[i] <= values[i - 1] && values[i] <= values[i + 1]);
        let minima: Vec<f64> = minima
            .map(|i| golden(&distance, grid[i - 1], grid[i + 1]))
            .collect();
        // |L| that only just passes 1 does so at its maxima and minima.
        let magnitude = |w: f64| random.gain(w).norm();
        let sizes: Vec<f64> = grid.iter().map(|w| magnitude(*w)).collect();
        let inner = 1..grid.len() - 1;
        let extremes = inner.filter_map(|i| {
            let (before, here, after) = (sizes[i - 1], sizes[i], sizes[i + 1]);
            let (from, to) = (grid[i - 1], grid[i + 1]);
            match (here >= before.max(after), here <= before.min(after)) {
                (true, _) => Some(golden(&|w| -magnitude(w), from, to)),
                (_, true) => Some(golden(&magnitude, from, to)),
                (false, false) => None,
            }
        });
        let extremes: Vec<f64> = extremes.collect();
        grid.extend(minima);
        grid.extend(extremes);
        grid.sort_by(f64::total_cmp);
        let gains: Vec<C> = grid.iter().map(|w| random.gain(*w)).collect();
        let at_nyquist = real_end(random.gain(nyquist * (1.0 - 1e-12)));
        let at_zero = (random.integrators == 0).then(|| real_end(random.gain(1e-12 * nyquist)));
        let ends = [Some(at_nyquist), at_zero].into_iter().flatten();
        let least = gains
            .iter()
            .map(|l| (l + 1.0).norm())
            .fold(f64::INFINITY, f64::min);
        let changes =
            (0..grid.len() - 1).filter(|&i| (gains[i].im > 0.0) != (gains[i + 1].im > 0.0));
        let crossings = changes.map(|i| root(&|w| random.gain(w).im, grid[i], grid[i + 1]));
        let reals = crossings.map(|w| random.gain(w).re).chain(ends.clone());
        let margins_db: Vec<f64> = reals
            .filter(|re| *re < 0.0)
            .map(|re| -20.0 * (-re).log10())
            .filter(|db| *db < MAX_GAIN_DB)
            .collect();
        let unit = (0..grid.len() - 1)
            .filter(|&i| (gains[i].norm() > 1.0) != (gains[i + 1].norm() > 1.0))
            .map(|i| root(&|w| random.gain(w).norm() - 1.0, grid[i], grid[i + 1]));
        let delays = unit.map(|w| (PI + random.gain(w).arg()).rem_euclid(TAU) / w);
        let turned: f64 = gains
            .windows(2)
            .map(|p| ((p[1] + 1.0) / (p[0] + 1.0)).arg())
            .sum();
        let turned = turned - random.integrators as f64 * FRAC_PI_2;
        Dense {
            modulus: ends.map(|l| (l + 1.0).abs()).fold(least, f64::min),
            upper_db: smallest(margins_db.iter().copied().filter(|db| *db > 0.0)),
            lower_db: smallest(margins_db.iter().copied().filter(|db| *db < 0.0)),
            delay_s: delays.reduce(f64::min),
            stable: (turned / PI).round() == 0.0,
        }
    }
}

/// Above this gain margin the sign of L is that of rounding.
const MAX_GAIN_DB: f64 = 180.0;

fn real_end(l: C) -> f64 {
    l.re
}

/// What differs between both computations of a loop.
fn differences(seed: u64) -> (f64, Vec<String>) {
    let random = RandomLoop::new(seed);
    let found: Margins = random.closed_loop().margins();
    let dense = Dense::of(&random);
    let ratio = found.modulus_margin / dense.modulus;
    let mut wrong = Vec::new();
    // A loop this close to -1 is decided by rounding.
    let is_decided = dense.modulus > 1e-5;
    if is_decided && found.stable != dense.stable {
        wrong.push(format!("seed {seed}: stable {} by the poles", found.stable));
    }
    if is_decided && (ratio - 1.0).abs() > 0.01 {
        wrong.push(format!(
            "seed {seed}: modulus margin {} for {}",
            found.modulus_margin, dense.modulus
        ));
    }
    let pairs = [
        (
            "upper gain margin",
            found.upper_gain_margin_db,
            dense.upper_db,
        ),
        (
            "lower gain margin",
            found.lower_gain_margin_db,
            dense.lower_db,
        ),
        ("delay margin", found.delay_margin_s, dense.delay_s),
    ];
    for (name, found, expected) in pairs {
        // A margin within rounding of 0 dB may be on either side.
        let near = match (found, expected) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-3 * b.abs().max(1e-6),
            (None, None) => true,
            (Some(a), None) | (None, Some(a)) => a.abs() < 1e-6 && name != "delay margin",
        };
        if !near {
            wrong.push(format!("seed {seed}: {name} {found:?} for {expected:?}"));
        }
    }
    ((ratio - 1.0).abs(), wrong)
}

#[test]
fn margins_of_random_loops_are_those_of_an_own_discretisation_on_a_dense_grid() {
    let loops = std::env::var("BENCH_RANDOM_LOOPS")
        .ok()
        .and_then(|text| text.parse().ok());
    let all = over_seeds(0..loops.unwrap_or(LOOPS), differences);
    let worst = all.iter().map(|(ratio, _)| *ratio).fold(0.0, f64::max);
    let wrong: Vec<&String> = all.iter().flat_map(|(_, wrong)| wrong).collect();
    println!("largest relative difference of the modulus margin {worst:.1e}");
    assert!(
        wrong.is_empty(),
        "{} of {}: {wrong:#?}",
        wrong.len(),
        all.len()
    );
}

fn mode(omega_rad_s: f64, residue_per_kg: f64, damping_ratio: f64) -> Mode {
    Mode {
        omega_rad_s,
        damping_ratio,
        shape: DVector::zeros(0),
        force_gain: residue_per_kg,
        sensor_gain: 1.0,
        floor_gain: 0.0,
    }
}

/// A mode at 620 Hz, damping 2e-4, in a loop of 1 kHz: 1 + L is smallest at its alias near 380 Hz, by an own discretisation with the
/// matrix exponential 0.2062 at 2387.5 rad/s.
#[test]
fn mode_above_half_the_rate_limits_the_modulus_margin_at_its_alias() {
    let modes = vec![
        mode(125.663_706_143_591_72, 5.0, 0.2),
        mode(3_895.574_890_451_343_4, -896.3, 2e-4),
    ];
    let path = SignalPath {
        period_s: 1e-3,
        amplifier_bandwidth_hz: 2000.0,
        force_constant_n_per_a: 10.0,
        delays_s: vec![1e-3],
        output: OutputKind::Position,
    };
    let sections = vec![section([0.006, 0.0, 0.0], [0.0, 1.0, 0.0])];
    let plant = LoopPlant::of(&path, &modes);
    let closed = ClosedLoop::new(plant, modes, 10.0, Box::new(sections)).unwrap();
    let margins = closed.margins();
    assert!(
        (margins.modulus_margin - 0.2062).abs() < 1e-4,
        "{margins:?}"
    );
    assert!(
        (margins.sensitivity_peak_rad_s - 2387.5).abs() < 0.5,
        "{margins:?}"
    );
    assert!(margins.stable && !margins.has_modulus_margin(0.4));
}

/// A plant that settles within a period and C = 1.2 z/(z - 1): L = 1.2/(z - 1), whose only crossing of the negative real axis is the
/// end at z = -1, where L = -0.6.
#[test]
fn gain_margin_at_half_the_rate_is_found() {
    let w = 12_566.370_614_359_172;
    let modes = vec![mode(w, 15_791.367_041_742_973, 0.7)];
    let path = SignalPath {
        period_s: 1e-2,
        amplifier_bandwidth_hz: 5000.0,
        force_constant_n_per_a: 1.0,
        delays_s: vec![0.0],
        output: OutputKind::Position,
    };
    let controller = ControllerText {
        name: "static".into(),
        text: "title = \"t\"\n[tf]\ngain_unit = \"A/um\"\nrate_hz = 100.0\nnumerator = [0.012, 0.0]\ndenominator = [1.0, -1.0]\n".into(),
    };
    let plant = LoopPlant::of(&path, &modes);
    let design = controller.design(100.0).unwrap();
    let margins = ClosedLoop::new(plant, modes, 1.0, design)
        .unwrap()
        .margins();
    let expected_db = -20.0 * 0.6_f64.log10();
    assert!(
        (margins.gain_margin_db.unwrap() - expected_db).abs() < 1e-3,
        "{margins:?}"
    );
    assert!(
        (margins.gain_margin_rad_s.unwrap() - 100.0 * PI).abs() < 1e-6,
        "{margins:?}"
    );
    assert!((margins.modulus_margin - 0.4).abs() < 1e-4, "{margins:?}");
}
