//! Loops, and the curves that are drawn of them.

use nalgebra::Complex;

use super::super::FigureError;
use super::super::model::Model;
use bench_control::{ClosedLoop, ControllerText};
use bench_plant::{LoopPlant, ModalModel};

/// The loop of a plant with a controller: a name of the program's own, or a file's name and its text.
pub(crate) fn closed_loop(
    model: &Model,
    name: &str,
    text: Option<&str>,
) -> Result<ClosedLoop, FigureError> {
    let config = model.config()?;
    let controller = match text {
        Some(text) => ControllerText {
            name: name.into(),
            text: text.into(),
        },
        None => ControllerText::find(name)?,
    };
    let design = controller.design(config.servo.rate_hz)?;
    let modes = ModalModel::of(&bench_plant::build(&config.plant)?)?.modes;
    let plant = LoopPlant::new(&config, &modes);
    let force_constant_n_per_a = config.motor.force_constant_n_per_a;
    Ok(ClosedLoop::new(
        plant,
        modes,
        force_constant_n_per_a,
        design,
    )?)
}

/// L(jw) in continuous time.
pub(crate) fn open(of: &ClosedLoop, low_rad_s: f64, high_rad_s: f64) -> Vec<(f64, Complex<f64>)> {
    of.frequencies(low_rad_s, high_rad_s)
        .into_iter()
        .filter_map(|w| Some((w, of.continuous_loop(w)?)))
        .collect()
}

/// T = L/(1 + L).
pub(crate) fn closed(open: &[(f64, Complex<f64>)]) -> Vec<(f64, Complex<f64>)> {
    open.iter().map(|(w, l)| (*w, l / (l + 1.0))).collect()
}

/// S = 1/(1 + L).
pub(crate) fn sensitivity(open: &[(f64, Complex<f64>)]) -> Vec<(f64, Complex<f64>)> {
    open.iter().map(|(w, l)| (*w, (l + 1.0).inv())).collect()
}

/// Time in seconds and position after a step of height 1.
pub(crate) fn step(of: &ClosedLoop, seconds: f64) -> Vec<(f64, f64)> {
    let period_s = of.plant().period_s();
    let positions = of.simulate((seconds / period_s).round() as usize, |_| 1.0);
    positions
        .into_iter()
        .enumerate()
        .map(|(k, y)| (k as f64 * period_s, y))
        .collect()
}
