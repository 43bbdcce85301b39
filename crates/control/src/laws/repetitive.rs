//! Repetitive control: a disturbance or a reference of a known period is learned from the error of the period before.
//!
//! ```text
//!  v[k] = q (v[k-N-1] + 2 v[k-N] + v[k-N+1])/4 + g e[k-N+d]      e = r - y
//!  u[k] = C (e[k] + v[k])
//! ```
//!
//! N is the period in ticks, d the lead in ticks, which compensates the delay of the loop, g the learning gain, q the forgetting factor,
//! and C a cascade of sections. The mean over three ticks is a low-pass filter without phase. (S. Hara et al., Repetitive control
//! system, IEEE Trans. Automatic Control 33, 1988.)

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ControlLawSettings;
use crate::law::{ControlDesign, ControlLaw, LawInput, LinearLaw, OpenLoopPoles};
use crate::section_settings::{SectionSettings, checked_sections};
use crate::state_space::StateSpace;
use crate::unstable::{MAX_INTEGRATORS, WHY_TWO};
use crate::{Controller, Section, SectionController};

/// A repetitive controller around a cascade of sections.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepetitiveLaw {
    /// Period N in ticks.
    #[schemars(range(min = 4, max = 65536))]
    pub period_ticks: usize,
    /// Lead d in ticks, below the period: about the delay of the closed loop.
    #[schemars(range(min = 0, max = 65535))]
    pub lead_ticks: usize,
    /// Learning gain g.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub learning_gain: f64,
    /// Forgetting factor q; with 1 the mean error is integrated.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub forgetting: f64,
    /// The sections of C, in amperes per micrometre, first to last.
    #[schemars(length(min = 1, max = 32))]
    pub section: Vec<SectionSettings>,
}

impl RepetitiveLaw {
    fn sections(&self) -> Vec<Section> {
        self.section.iter().map(SectionSettings::section).collect()
    }

    /// Whether a constant error grows without bound in the memory.
    fn integrates(&self) -> bool {
        self.forgetting >= 1.0 && self.learning_gain > 0.0
    }
}

impl ControlLawSettings for RepetitiveLaw {
    fn check(&self, rate_hz: f64) -> Result<(), String> {
        if self.lead_ticks >= self.period_ticks {
            return Err(format!(
                "has lead_ticks = {}, which must be below period_ticks = {}",
                self.lead_ticks, self.period_ticks
            ));
        }
        let sections = checked_sections(&self.section, rate_hz);
        let sections = sections.map_err(|why| format!("is refused: {why}"))?;
        let in_sections: usize = sections.iter().map(Section::integrators).sum();
        let count = in_sections + usize::from(self.integrates());
        if count > MAX_INTEGRATORS {
            return Err(format!(
                "has {count} integrators with that of forgetting = 1, but at most {MAX_INTEGRATORS} are allowed: {WHY_TWO}"
            ));
        }
        Ok(())
    }
}

impl ControlDesign for RepetitiveLaw {
    fn law(&self, period_s: f64) -> Box<dyn ControlLaw> {
        let cascade = Controller::new(&self.sections(), period_s);
        Box::new(RunningLaw {
            feedback: SectionController::new(cascade.clone()),
            cascade,
            learned: Memory::new(self.period_ticks + 2),
            errors: Memory::new(self.period_ticks + 1),
            settings: self.clone(),
        })
    }
}

/// The last values of a signal.
struct Memory {
    values: Vec<f64>,
    /// Index of the newest value.
    newest: usize,
}

impl Memory {
    /// Zeros.
    fn new(length: usize) -> Memory {
        Memory {
            values: vec![0.0; length],
            newest: 0,
        }
    }

    fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Replaces the oldest value.
    fn push(&mut self, value: f64) {
        self.newest = (self.newest + 1) % self.values.len();
        self.values[self.newest] = value;
    }

    /// The value before a number of others, 0 for the newest; the number is below the length.
    fn before(&self, others: usize) -> f64 {
        let length = self.values.len();
        self.values[(self.newest + length - others) % length]
    }
}

/// The law with its state.
struct RunningLaw {
    settings: RepetitiveLaw,
    cascade: Controller,
    feedback: SectionController,
    learned: Memory,
    errors: Memory,
}

impl RunningLaw {
    /// v of this tick. The errors have that of this tick already, the learned values end with the tick before.
    fn next_learned(&self) -> f64 {
        let settings = &self.settings;
        let (period, lead) = (settings.period_ticks, settings.lead_ticks);
        let [older, same, newer] = [period, period - 1, period - 2].map(|n| self.learned.before(n));
        settings.forgetting * (older + 2.0 * same + newer) / 4.0
            + settings.learning_gain * self.errors.before(period - lead)
    }
}

impl ControlLaw for RunningLaw {
    fn reset(&mut self, rest_m: f64) {
        self.feedback.reset(rest_m);
        self.learned.clear();
        self.errors.clear();
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        let error_m = input.reference_m - input.position_m;
        self.errors.push(error_m);
        let learned_m = self.next_learned();
        self.learned.push(learned_m);
        self.feedback.update(&LawInput {
            reference_m: input.reference_m + learned_m,
            ..*input
        })
    }

    fn linear(&self) -> Option<Box<dyn LinearLaw>> {
        Some(Box::new(LinearRepetitive {
            settings: self.settings.clone(),
            cascade: self.cascade.clone(),
        }))
    }
}

/// C(z) = (1 + g z^(d-N)/(1 - q (z + 2 + 1/z)/4 z^-N)) times the cascade.
struct LinearRepetitive {
    settings: RepetitiveLaw,
    cascade: Controller,
}

impl LinearLaw for LinearRepetitive {
    fn state_space(&self) -> Option<StateSpace> {
        None
    }

    fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let settings = &self.settings;
        let period = z.powu(settings.period_ticks as u32).inv();
        let mean = (z + 2.0 + z.inv()) * (settings.forgetting / 4.0);
        let learned = period * z.powu(settings.lead_ticks as u32) * settings.learning_gain;
        (learned / (-period * mean + 1.0) + 1.0) * self.cascade.response(z)
    }

    /// Those of the cascade, and 1 with q = 1: the mean over three ticks has a gain of at most 1, so that the other poles of the memory
    /// are inside the unit circle.
    fn open_loop_poles(&self) -> Option<OpenLoopPoles> {
        let cascade = self.cascade.open_loop_poles()?;
        Some(OpenLoopPoles {
            integrators: cascade.integrators + usize::from(self.settings.integrates()),
            ..cascade
        })
    }

    fn roots(&self) -> Vec<Complex<f64>> {
        self.cascade.roots()
    }

    fn delay_ticks(&self) -> usize {
        self.settings.period_ticks
    }
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::{ClosedLoop, StateSpaceLaw};
    use bench_plant::{LoopPlant, Mode, OutputKind, SignalPath};

    fn settings() -> RepetitiveLaw {
        RepetitiveLaw {
            period_ticks: 8,
            lead_ticks: 2,
            learning_gain: 0.5,
            forgetting: 0.9,
            section: vec![SectionSettings::Gain { gain_a_per_um: 2.0 }],
        }
    }

    fn impulse_response(settings: &RepetitiveLaw, ticks: usize) -> Vec<f64> {
        let mut law = settings.law(1e-3);
        law.reset(0.0);
        let reference = |tick| if tick == 0 { 1e-6 } else { 0.0 };
        (0..ticks)
            .map(|tick| {
                law.update(&LawInput {
                    reference_m: reference(tick),
                    ..LawInput::default()
                })
            })
            .collect()
    }

    /// u of an error of 1 um: 2 A at once. v[6] = 0.5 um, after the period less the lead, gives 1 A, and 0.9 (1, 2, 1)/4 of it
    /// returns a period later.
    #[test]
    fn error_returns_after_the_period_less_the_lead() {
        let expected = |tick| match tick {
            0 => 2.0,
            6 => 1.0,
            13 | 15 => 0.225,
            14 => 0.45,
            _ => 0.0,
        };
        for (tick, found) in impulse_response(&settings(), 16).iter().enumerate() {
            assert!((found - expected(tick)).abs() < 1e-12, "{tick}: {found}");
        }
    }

    /// C(z) is the sum of u[k] z^-k, per metre. Outside of the unit circle, at |z| = 1.2, the sum is cut off at 1.2^-400 = 2e-32.
    #[test]
    fn response_is_the_transform_of_the_impulse_response() {
        let law = settings().law(1e-3);
        let linear = law.linear().expect("linear");
        let impulse = impulse_response(&settings(), 400);
        for angle in [0.0, 0.1, 0.7, 2.0, 3.0] {
            let z = Complex::from_polar(1.2, angle);
            let terms = (0..).zip(&impulse).map(|(k, u)| z.powi(-k) * *u);
            let expected = terms.sum::<Complex<f64>>() * 1e6;
            let found = linear.response(z);
            assert!(
                (found - expected).norm() < 1e-9 * expected.norm(),
                "{angle}"
            );
        }
    }

    #[test]
    fn rejects_lead_of_a_period_and_three_integrators() {
        assert_eq!(settings().check(1000.0), Ok(()));
        let late = RepetitiveLaw {
            lead_ticks: 8,
            ..settings()
        };
        assert!(late.check(1000.0).unwrap_err().contains("lead_ticks = 8"));
        let integrator = SectionSettings::Integrator { gain_a_per_um: 1.0 };
        let integrating = RepetitiveLaw {
            forgetting: 1.0,
            section: vec![integrator.clone(), integrator],
            ..settings()
        };
        assert!(
            integrating
                .check(1000.0)
                .unwrap_err()
                .contains("3 integrators")
        );
    }

    /// The same law with shift registers as matrices: v of the last N + 1 ticks, then e of the last N - d.
    fn as_matrices(settings: &RepetitiveLaw, gain_a_per_um: f64) -> StateSpaceLaw {
        let (period, lead) = (settings.period_ticks, settings.lead_ticks);
        let (learned, errors) = (period + 1, period - lead);
        let states = learned + errors;
        let mut output = vec![0.0; states];
        output[period] = settings.forgetting / 4.0;
        output[period - 1] = settings.forgetting / 2.0;
        output[period - 2] = settings.forgetting / 4.0;
        output[states - 1] = settings.learning_gain;
        let mut a = vec![vec![0.0; states]; states];
        a[0] = output.clone();
        for k in (1..learned).chain(learned + 1..states) {
            a[k][k - 1] = 1.0;
        }
        let mut b = vec![0.0; states];
        b[learned] = 1.0;
        let gain = gain_a_per_um * 1e6;
        StateSpaceLaw {
            rate_hz: 1000.0,
            a,
            b_position: b.iter().map(|b| -b).collect(),
            b_reference: b,
            c: output.iter().map(|c| c * gain).collect(),
            d_reference: gain,
            d_position: -gain,
        }
    }

    fn closed(design: Box<dyn ControlDesign>) -> ClosedLoop {
        let path = SignalPath {
            period_s: 1e-3,
            amplifier_bandwidth_hz: 300.0,
            force_constant_n_per_a: 10.0,
            delays_s: vec![1.3e-3],
            output: OutputKind::Position,
        };
        let mode = |omega_rad_s, force_gain| Mode {
            omega_rad_s,
            damping_ratio: 0.03,
            shape: nalgebra::DVector::zeros(1),
            force_gain,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        };
        let modes = vec![mode(150.0, 0.5), mode(900.0, 0.3)];
        let plant = LoopPlant::of(&path, &modes);
        ClosedLoop::new(plant, modes, path.force_constant_n_per_a, design).expect("linear")
    }

    /// Against the eigenvalues of the loop with the law as matrices.
    #[test]
    fn count_of_encirclements_agrees_with_the_eigenvalues() {
        let mut random = Pcg64::seed_from_u64(31);
        let mut uniform = |low: f64, high: f64| {
            low + (high - low) * (random.next_u32() as f64 / f64::from(u32::MAX))
        };
        let mut stable = 0;
        for case in 0..100 {
            let period_ticks = uniform(4.0, 30.0) as usize;
            let gain_a_per_um = 1e-3 * 10_f64.powf(uniform(-1.0, 1.0));
            let settings = RepetitiveLaw {
                period_ticks,
                lead_ticks: (uniform(0.0, 6.0) as usize).min(period_ticks - 1),
                learning_gain: uniform(0.0, 1.0),
                forgetting: if case % 4 == 0 {
                    1.0
                } else {
                    uniform(0.5, 1.0)
                },
                section: vec![SectionSettings::Gain { gain_a_per_um }],
            };
            let by_matrices = closed(Box::new(as_matrices(&settings, gain_a_per_um)));
            let by_curve = closed(Box::new(settings.clone()));
            assert_eq!(
                by_curve.is_stable(),
                by_matrices.is_stable(),
                "{settings:?}"
            );
            stable += usize::from(by_curve.is_stable());
        }
        assert!((20..80).contains(&stable), "{stable}");
    }

    /// A loop that is stable by itself remains so for any period if |q (z + 2 + 1/z)/4 - g z^d T| < 1 at all frequencies (small gain
    /// theorem). The margins include the peaks at w = 2 pi k/(N T).
    #[test]
    fn long_period_is_judged_with_its_peaks() {
        let settings = RepetitiveLaw {
            period_ticks: 4096,
            lead_ticks: 3,
            learning_gain: 0.2,
            forgetting: 0.98,
            section: vec![SectionSettings::Integrator {
                gain_a_per_um: 1e-3,
            }],
        };
        let closed = closed(Box::new(settings.clone()));
        let cascade = self::closed(Box::new(RepetitiveLaw {
            learning_gain: 0.0,
            ..settings
        }));
        let learns = (1..3000).all(|k| {
            let angle = f64::from(k) * 1e-3;
            let complementary = cascade.complementary_sensitivity(angle / 1e-3);
            let learned = Complex::from_polar(0.2, 3.0 * angle) * complementary;
            (learned - 0.98 * 0.5 * (1.0 + angle.cos())).norm() < 1.0
        });
        assert!(learns && cascade.is_stable() && closed.is_stable());
        let margins = closed.margins();
        let rate_rad_s = std::f64::consts::TAU * 1000.0;
        let sensitivity = |k: u32| {
            let loop_gain = closed.sampled_loop(rate_rad_s * f64::from(k) / 4096.0);
            (loop_gain + 1.0).norm()
        };
        let least = (1..2048).map(sensitivity).fold(f64::INFINITY, f64::min);
        assert!(
            margins.modulus_margin <= least,
            "{} {least}",
            margins.modulus_margin
        );
        assert!(margins.modulus_margin > 0.1, "{}", margins.modulus_margin);
    }
}
