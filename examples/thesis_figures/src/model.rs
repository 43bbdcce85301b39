//! A plant as a command takes it: a profile and settings over it.

use nalgebra::Complex;

use super::FigureError;
use bench_config::{Config, PlantSettings, Source, load};
use bench_plant::zeros::{ModalSum, Zero};
use bench_plant::{ModalModel, Structure};

/// A profile and settings over it, from which both the numbers and the printed command come.
#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    profile: Option<&'static str>,
    sets: Vec<String>,
}

/// A mode of a plant that is given by its modes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ModeOf(pub &'static str, pub f64, pub f64, pub f64);

impl Model {
    /// A profile by its name.
    pub fn profile(name: &'static str) -> Model {
        Model {
            profile: Some(name),
            sets: Vec::new(),
        }
    }

    /// The default profile, the stage that was built.
    pub fn stage() -> Model {
        Model::default()
    }

    /// A plant by its modes: name, frequency in rad/s (0: a double integrator), residue in 1/kg, damping ratio.
    pub fn modes(modes: &[ModeOf]) -> Model {
        let mode = |ModeOf(name, w, r, zeta): &ModeOf| {
            format!("{name}={{omega_rad_s={w:?},residue_per_kg={r:?},damping_ratio={zeta:?}}}")
        };
        let modes: Vec<String> = modes.iter().map(mode).collect();
        Model::stage().set(&format!(
            "plant={{model=\"modal\",modes={{{}}}}}",
            modes.join(",")
        ))
    }

    /// Adds a setting, KEY=VALUE.
    pub fn set(mut self, set: &str) -> Model {
        self.sets.push(set.into());
        self
    }

    /// Sets the operating point (ratio of the beam length of 47.5 mm) and the mass asymmetry (ratio).
    pub fn at(self, operating_point: f64, asymmetry: f64) -> Model {
        let point_m = operating_point * 0.0475;
        self.set(&format!("plant.operating_point_m={point_m:?}"))
            .set(&format!("plant.mass_asymmetry={asymmetry:?}"))
    }

    /// `bench WHAT` on this plant, then `more`.
    pub fn command(&self, what: &str, more: &str) -> String {
        let profile = self.profile.map(|name| format!(" --config {name}"));
        let quoted = |set: &String| {
            if set
                .chars()
                .any(|c| !(c.is_ascii_alphanumeric() || "._=+-".contains(c)))
            {
                format!(" --set '{set}'")
            } else {
                format!(" --set {set}")
            }
        };
        let sets: String = self.sets.iter().map(quoted).collect();
        let more = if more.is_empty() {
            String::new()
        } else {
            format!(" {more}")
        };
        format!("bench {what}{}{sets}{more}", profile.unwrap_or_default())
    }

    /// The effective configuration.
    pub fn config(&self) -> Result<Config, FigureError> {
        let source = Source {
            config: self.profile.map(String::from),
            sets: self.sets.clone(),
            ..Source::default()
        };
        Ok(load(&source)?)
    }

    /// The structure.
    pub fn structure(&self) -> Result<Structure, FigureError> {
        Ok(bench_plant::build(&self.config()?.plant)?)
    }

    /// Its modes.
    pub fn modal(&self) -> Result<ModalModel, FigureError> {
        Ok(ModalModel::of(&self.structure()?)?)
    }

    /// The sum of the modes that can be observed.
    pub fn sum(&self) -> Result<ModalSum, FigureError> {
        Ok(ModalSum::visible(&self.modal()?)?)
    }

    /// The plant with one of its settings varied, as `bench model locus --vary KEY` does.
    pub fn varied(&self, key: &str) -> Result<Varied, FigureError> {
        let plant = serde_json::to_value(self.config()?.plant)
            .map_err(|e| FigureError::Run(format!("the plant cannot be written: {e}")))?;
        let pointer = format!("/{}", key.trim_start_matches("plant.").replace('.', "/"));
        Ok(Varied { plant, pointer })
    }
}

/// A plant of which one number varies.
#[derive(Clone, Debug)]
pub(crate) struct Varied {
    plant: serde_json::Value,
    pointer: String,
}

impl Varied {
    /// The structure at a value.
    pub fn structure(&self, value: f64) -> Result<Structure, FigureError> {
        let mut plant = self.plant.clone();
        if let Some(slot) = plant.pointer_mut(&self.pointer) {
            *slot = value.into();
        }
        let settings: PlantSettings = serde_json::from_value(plant).map_err(|e| {
            FigureError::Run(format!("the plant at {} = {value}: {e}", self.pointer))
        })?;
        Ok(bench_plant::build(&settings)?)
    }

    /// The sum of the modes that can be observed, at a value.
    pub fn sum(&self, value: f64) -> Result<ModalSum, FigureError> {
        Ok(ModalSum::visible(&ModalModel::of(
            &self.structure(value)?,
        )?)?)
    }
}

/// Values at equal distances, both ends among them; `count` is at least two.
pub(crate) fn even(from: f64, to: f64, count: usize) -> Vec<f64> {
    let last = (count - 1) as f64;
    (0..count)
        .map(|k| {
            if k + 1 == count {
                to
            } else {
                from + (to - from) * k as f64 / last
            }
        })
        .collect()
}

/// Values at equal ratios, both ends among them.
pub(crate) fn geometric(from: f64, to: f64, count: usize) -> Vec<f64> {
    even(from.ln(), to.ln(), count)
        .into_iter()
        .map(f64::exp)
        .collect()
}

/// Frequencies in rad/s dense enough to show every resonance and antiresonance of a sum.
pub(crate) fn frequencies(
    sum: &ModalSum,
    low_rad_s: f64,
    high_rad_s: f64,
) -> Result<Vec<f64>, FigureError> {
    let poles = sum
        .terms()
        .iter()
        .map(|term| (term.omega_rad_s, term.damping_ratio))
        .filter(|(w, _)| *w > 0.0);
    let zeros = sum.damped_zeros()?;
    let dips = zeros
        .iter()
        .filter(|zero| zero.s.im > 0.0)
        .map(|zero| (zero.s.norm(), zero.s.re.abs() / zero.s.norm()));
    let features: Vec<(f64, f64)> = poles
        .chain(dips)
        .map(|(w, zeta)| (w, zeta.max(1e-4)))
        .collect();
    Ok(bench_control::grid(low_rad_s, high_rad_s, &features))
}

/// G(jw) at such frequencies.
pub(crate) fn response(
    sum: &ModalSum,
    low: f64,
    high: f64,
) -> Result<Vec<(f64, Complex<f64>)>, FigureError> {
    let at = |w: f64| (w, sum.response(Complex::new(0.0, w)));
    Ok(frequencies(sum, low, high)?.into_iter().map(at).collect())
}

/// Zeros without damping as text: kinds by pairs and quartets.
pub(crate) fn kinds(zeros: &[Zero]) -> String {
    bench_plant::zeros::ZeroCounts::of(zeros).to_string()
}
