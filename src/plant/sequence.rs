//! The sequence of signs and the sequence of dominant modes (section 3.2.1).

use super::{Modal, Sign, Zero, ZeroKind};

/// The signs of the modes that show, slowest first: `+-+`.
pub fn sign_sequence(modal: &Modal) -> String {
    modal.signs().iter().filter(|sign| **sign != Sign::None).map(|sign| sign.symbol()).collect()
}

/// The sequence of dominant modes of the undamped plant, as `[R]-[u]-[v]`: the slowest mode that shows is R, the next are
/// u, v, w; beyond those modes have numbers.
///
/// Along rising frequency a mode takes over where G passes through zero and goes on with that mode's sign (definition 1;
/// of several the largest), and, where nothing passed through zero, before its own resonance (definition 3).
pub fn dominant_sequence(modal: &Modal, undamped: &[Zero]) -> String {
    let signs = modal.signs();
    let visible: Vec<usize> = (0..signs.len()).filter(|&i| signs[i] != Sign::None).collect();
    let Some(&slowest) = visible.first() else { return "[]".into() };
    let mut sequence = vec![largest(modal, &visible, 0.0, None).unwrap_or(slowest)];
    for event in events(modal, &visible, undamped) {
        let dominant = match event {
            Happening::Zero(omega) => largest(modal, &visible, omega, Some(sign_after(modal, &visible, omega))),
            Happening::Pole(mode) => Some(mode),
        };
        if let Some(mode) = dominant.filter(|mode| sequence.last() != Some(mode)) {
            sequence.push(mode);
        }
    }
    let name = |mode: &usize| format!("[{}]", name(visible.iter().position(|i| i == mode).unwrap_or(0)));
    sequence.iter().map(name).collect::<Vec<_>>().join("-")
}

enum Happening {
    Zero(f64),
    Pole(usize),
}

/// Zeros on the imaginary axis and poles, by frequency; a zero that hides an invisible mode is left out.
fn events(modal: &Modal, visible: &[usize], undamped: &[Zero]) -> Vec<Happening> {
    let omega = |mode: usize| modal.modes[mode].omega_rad_s;
    let hidden = |w: f64| (0..modal.modes.len()).any(|i| !visible.contains(&i) && (omega(i) / w - 1.0).abs() < 1e-3);
    let zeros = undamped.iter().filter(|zero| zero.kind == ZeroKind::Mmp && zero.s.im > 0.0).map(|zero| zero.s.im);
    let mut events: Vec<(f64, Happening)> = zeros
        .filter(|w| !hidden(*w))
        .map(|w| (w, Happening::Zero(w)))
        .chain(visible.iter().map(|&i| (omega(i), Happening::Pole(i))))
        .collect();
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    events.into_iter().map(|(_, event)| event).collect()
}

fn undamped_part(modal: &Modal, mode: usize, omega: f64) -> f64 {
    let mode = &modal.modes[mode];
    mode.residue_per_kg() / (mode.omega_rad_s * mode.omega_rad_s - omega * omega)
}

/// The mode of the largest part of G at `omega`, of those with the given sign if there is one.
fn largest(modal: &Modal, visible: &[usize], omega: f64, positive: Option<bool>) -> Option<usize> {
    let part = |mode: usize| undamped_part(modal, mode, omega);
    let fits = |mode: &usize| positive.is_none_or(|positive| (part(*mode) > 0.0) == positive);
    visible.iter().copied().filter(fits).max_by(|&a, &b| part(a).abs().total_cmp(&part(b).abs()))
}

/// Whether the undamped G is positive right above its zero at `omega`: G/j-derivative by its exact slope
/// dG/d(omega) = sum of 2 omega r/(w^2 - omega^2)^2.
fn sign_after(modal: &Modal, visible: &[usize], omega: f64) -> bool {
    let slope = |mode: &usize| {
        let part = undamped_part(modal, *mode, omega);
        2.0 * omega * part * part / modal.modes[*mode].residue_per_kg()
    };
    visible.iter().map(slope).sum::<f64>() > 0.0
}

fn name(index: usize) -> String {
    match index {
        0 => "R".into(),
        1 => "u".into(),
        2 => "v".into(),
        3 => "w".into(),
        _ => (index + 1).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Mode;
    use nalgebra::{Complex, DVector};

    fn modal(parts: &[(f64, f64)]) -> Modal {
        let mode = |&(omega_rad_s, residue): &(f64, f64)| Mode {
            omega_rad_s,
            damping_ratio: 0.001,
            shape: DVector::zeros(1),
            force_gain: residue,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        };
        Modal { modes: parts.iter().map(mode).collect() }
    }

    /// Zeros in u = s^2 of aR/(u + wR^2) + au/(u + wu^2) + av/(u + wv^2), from the quadratic's closed form.
    fn zeros(parts: &[(f64, f64)]) -> Vec<Zero> {
        let [(wr, ar), (wu, au), (wv, av)] = [parts[0], parts[1], parts[2]].map(|(w, a)| (w * w, a));
        let (a, b, c) = (
            ar + au + av,
            ar * (wu + wv) + au * (wr + wv) + av * (wr + wu),
            ar * wu * wv + au * wr * wv + av * wr * wu,
        );
        let root = Complex::new(b * b - 4.0 * a * c, 0.0).sqrt();
        let mmp = |u: Complex<f64>| (u.im == 0.0 && u.re < 0.0).then(|| (-u.re).sqrt());
        let on_axis = [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a)].into_iter().filter_map(mmp);
        on_axis.map(|w| Zero { s: Complex::new(0.0, w), kind: ZeroKind::Mmp }).collect()
    }

    #[test]
    fn the_two_examples_of_fig_3_11_have_the_sequences_of_the_thesis() {
        // Eq. (3-9) without damping: a0 = 0.01 gives dual MMP zeros, a0 = 5 CNMP zeros.
        for (a0, sequence) in [(0.01, "[R]-[u]-[R]-[v]"), (5.0, "[R]-[u]-[v]")] {
            let parts = [(1.0, 1.0), (10.0, -a0), (11.0, a0)];
            let modal = modal(&parts);
            assert_eq!(sign_sequence(&modal), "+-+");
            assert_eq!(dominant_sequence(&modal, &zeros(&parts)), sequence, "a0 = {a0}");
        }
    }
}
