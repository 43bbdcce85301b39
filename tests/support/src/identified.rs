//! A chirp of the simulated stage with its analysis, and the true modes and zeros of the model.
use bench_config::{Config, Source, load};
use bench_experiment::{Analysis, Plan};
use bench_identify::modal::FittedMode;
use bench_plant::ModalModel;
use bench_plant::zeros::{cnmp_pairs, damped_zeros};

use crate::simulated;

/// The default stage, identified at 1 kHz as in section 5.2.2.
pub fn config(sets: &[String]) -> Config {
    let sets = std::iter::once("loop.rate_hz=1000".to_string())
        .chain(sets.iter().cloned())
        .collect();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("the profile is valid")
}

/// Analyses a chirp with `config`, using the configuration `assumed`.
pub fn analysed(config: &Config, assumed: &Config) -> Analysis {
    simulated::analysed(&Plan::chirp(config.clone()), assumed).expect("an analysis")
}

/// CNMP pairs of the model with damping.
pub fn truth(config: &Config) -> usize {
    cnmp_pairs(&damped_zeros(&bench_plant::build(&config.plant).expect("a model")).expect("zeros"))
}

/// w (rad/s), zeta and residue (1/kg) of a mode.
pub type Truth = [f64; 3];

/// The modes of the model, slowest first.
pub fn model(config: &Config) -> Vec<Truth> {
    let modal =
        ModalModel::of(&bench_plant::build(&config.plant).expect("a model")).expect("modes");
    modal
        .modes
        .iter()
        .map(|m| [m.omega_rad_s, m.damping_ratio, m.residue_per_kg()])
        .collect()
}

/// The fitted mode nearest to a mode of the model, if it is within 0.5 % of its frequency.
pub fn stands_for(modes: &[FittedMode], omega_rad_s: f64) -> Option<FittedMode> {
    let off = |mode: &&FittedMode| (mode.omega_rad_s.value / omega_rad_s - 1.0).abs();
    modes
        .iter()
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .filter(|mode| off(mode) < 5e-3)
        .copied()
}

/// The expected result of a fit with these modes. The fourth mode of the default stage, at 22.9 Hz, has 6e-6 of R's residue and is seldom
/// measured. A fit without it assigns its static compliance to mode R: r_R + r_4 (w_R/w_4)^2.
pub fn measurable(model: &[Truth], modes: &[FittedMode]) -> Vec<Truth> {
    let is_measured =
        |[w, _, residue]: &&Truth| residue.abs() > 1e-3 || stands_for(modes, *w).is_some();
    let (mut measured, others): (Vec<Truth>, Vec<Truth>) = model.iter().partition(is_measured);
    let first = measured
        .iter_mut()
        .find(|[_, _, residue]| residue.abs() > 1e-3);
    let [first_w, _, first_residue] = first.expect("a mode with a residue");
    for [w, _, residue] in others {
        *first_residue += residue * (*first_w / w).powi(2);
    }
    measured
}
