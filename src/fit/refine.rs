//! Maximum likelihood: the parameters of a sum of modes that make the weighted squares of what is left least.
//!
//! ```text
//! H(f) = exp(-j w tau) (R V_0(f) + sum of r_k V(f; w_k, zeta_k))        V: a mode of residue 1 through the view
//! chi^2 = sum over blocks of 2 |H_b - H(f_b)|^2 / v_b                    v_b = E|error|^2
//! ```
//!
//! by Levenberg and Marquardt's steps in ln w, ln zeta, r, R, tau. With v known, chi^2 has its mean at 2 N less the number of
//! parameters, and the inverse of J^T W J is their covariance.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use super::view::{View, slopes};
use crate::identify::Block;
use crate::zeros::Term;

/// Steps at most.
const STEPS: usize = 60;
/// A step that would lower chi^2 by less is none: a hundredth of what noise does to one parameter.
const NOTHING: f64 = 0.01;
/// ln w and ln zeta change at most so much in a step.
const LARGEST: [f64; 2] = [0.02, 0.7];
/// Bounds of a damping ratio.
const DAMPING: (f64, f64) = (1e-6, 2.0);

/// A sum of modes seen late.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    /// The modes; one of w = 0 is a free body.
    pub modes: Vec<Term>,
    /// R: the compliance in m/N that modes above the band leave in it.
    pub remainder_m_per_n: f64,
    /// tau: how much later than the view all this answers, in seconds.
    pub delay_s: f64,
}

/// One parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Entry {
    /// w of a mode.
    Omega(usize),
    /// zeta of a mode.
    Damping(usize),
    /// r of a mode.
    Residue(usize),
    /// R.
    Remainder,
    /// tau.
    Delay,
}

impl Parameters {
    /// What is free, in the order of a covariance.
    pub(crate) fn entries(&self) -> Vec<Entry> {
        let of = |k: usize| match self.modes[k].omega_rad_s == 0.0 {
            true => vec![Entry::Residue(k)],
            false => vec![Entry::Omega(k), Entry::Damping(k), Entry::Residue(k)],
        };
        let modes = (0..self.modes.len()).flat_map(of);
        modes.chain([Entry::Remainder, Entry::Delay]).collect()
    }

    /// These, moved by a step in the coordinates of the fit; none that leaves what is possible.
    fn moved(&self, entries: &[Entry], step: &DVector<f64>) -> Parameters {
        let mut next = self.clone();
        for (entry, step) in entries.iter().zip(step.iter()) {
            let within = |largest: f64| step.clamp(-largest, largest).exp();
            match *entry {
                Entry::Omega(k) => next.modes[k].omega_rad_s *= within(LARGEST[0]),
                Entry::Damping(k) => {
                    let damping = self.modes[k].damping_ratio * within(LARGEST[1]);
                    next.modes[k].damping_ratio = damping.clamp(DAMPING.0, DAMPING.1);
                }
                Entry::Residue(k) => next.modes[k].residue_per_kg += step,
                Entry::Remainder => next.remainder_m_per_n += step,
                Entry::Delay => next.delay_s += step,
            }
        }
        next
    }
}

/// The model at some parameters, and what its parts are.
pub(super) struct Seen {
    /// Of each mode, with residue 1, late.
    parts: Vec<Vec<Complex<f64>>>,
    /// Of the constant compliance, late.
    constant: Vec<Complex<f64>>,
    /// What the blocks have beyond the model.
    pub left: Vec<Complex<f64>>,
    /// chi^2.
    pub chi2: f64,
}

impl Seen {
    pub(super) fn of(parameters: &Parameters, view: &View<'_>, blocks: &[Block]) -> Seen {
        let nodes = view.nodes(parameters.delay_s, blocks);
        let part = |m: &Term| view.mode((m.omega_rad_s, m.damping_ratio), &nodes);
        let parts: Vec<_> = parameters.modes.iter().map(part).collect();
        let constant = view.constant(&nodes);
        let left: Vec<_> = (0..blocks.len())
            .map(|b| {
                let modes: Complex<f64> =
                    parameters.modes.iter().zip(&parts).map(|(mode, part)| part[b] * mode.residue_per_kg).sum();
                blocks[b].response - modes - constant[b] * parameters.remainder_m_per_n
            })
            .collect();
        let chi2 = left.iter().zip(blocks).map(|(e, block)| 2.0 * e.norm_sqr() / block.variance).sum();
        Seen { parts, constant, left, chi2 }
    }

    /// How block `b` of the model changes with each parameter, in the order of [`Parameters::entries`].
    fn slopes(&self, parameters: &Parameters, b: usize, block: &Block, slopes_out: &mut Vec<Complex<f64>>) {
        let omega = 2.0 * std::f64::consts::PI * block.frequency_hz;
        slopes_out.clear();
        for (mode, part) in parameters.modes.iter().zip(&self.parts) {
            if mode.omega_rad_s != 0.0 {
                let [by_omega, by_damping] = slopes(mode, omega);
                let moved = part[b] * mode.residue_per_kg;
                slopes_out.push(moved * by_omega * mode.omega_rad_s);
                slopes_out.push(moved * by_damping * mode.damping_ratio);
            }
            slopes_out.push(part[b]);
        }
        slopes_out.push(self.constant[b]);
        slopes_out.push((self.left[b] - block.response) * Complex::new(0.0, omega));
    }

    /// J^T W J and J^T W e.
    fn normal(&self, parameters: &Parameters, blocks: &[Block]) -> (DMatrix<f64>, DVector<f64>) {
        let n = parameters.entries().len();
        let (mut square, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let (mut row, mut scaled) = (Vec::with_capacity(n), vec![[0.0; 2]; n]);
        for (b, block) in blocks.iter().enumerate() {
            let weight = (2.0 / block.variance).sqrt();
            self.slopes(parameters, b, block, &mut row);
            scaled.iter_mut().zip(&row).for_each(|(scaled, slope)| *scaled = [slope.re * weight, slope.im * weight]);
            let left = self.left[b] * weight;
            for (i, [re, im]) in scaled.iter().enumerate() {
                right[i] += re * left.re + im * left.im;
                // Columns lie together: the lower triangle, column by column.
                let column = &mut square.column_mut(i);
                for (j, [other_re, other_im]) in scaled.iter().enumerate().skip(i) {
                    column[j] += re * other_re + im * other_im;
                }
            }
        }
        square.fill_upper_triangle_with_lower_triangle();
        (square, right)
    }
}

/// Where the steps end, the last of which lowers chi^2 by less than `coarse` of it: the parameters, and what is left of the
/// blocks there.
pub(super) fn refine(start: Parameters, view: &View<'_>, blocks: &[Block], coarse: f64) -> (Parameters, Seen) {
    if start.modes.is_empty() {
        let seen = Seen::of(&start, view, blocks);
        return (start, seen);
    }
    let entries = start.entries();
    let (mut best, mut damping) = (start, 1e-3);
    let mut seen = Seen::of(&best, view, blocks);
    let mut normal = seen.normal(&best, blocks);
    for _ in 0..STEPS {
        let Some(step) = step(&normal, damping) else { break };
        let next = best.moved(&entries, &step);
        let there = Seen::of(&next, view, blocks);
        let gained = seen.chi2 - there.chi2;
        if gained.is_finite() && gained >= 0.0 {
            let done = gained < NOTHING + coarse * there.chi2 && damping < 1.0;
            (best, seen, damping) = (next, there, (damping * 0.1f64).max(1e-9));
            if done {
                break;
            }
            normal = seen.normal(&best, blocks);
        } else if damping > 1e8 || normal.1.dot(&step) < NOTHING {
            break;
        } else {
            damping *= 10.0;
        }
    }
    (best, seen)
}

/// (A + damping diag A)^-1 b, in coordinates of a unit diagonal; nothing if A is not what it should be.
fn step((square, right): &(DMatrix<f64>, DVector<f64>), damping: f64) -> Option<DVector<f64>> {
    let (scale, scaled) = scaled(square)?;
    let mut ridge = scaled;
    for i in 0..ridge.nrows() {
        ridge[(i, i)] += damping;
    }
    let solved = Cholesky::<f64, Dyn>::new(ridge)?.solve(&right.component_mul(&scale));
    Some(solved.component_mul(&scale))
}

/// 1/sqrt of the diagonal, and the matrix with a diagonal of 1.
fn scaled(square: &DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let diagonal = square.diagonal();
    if !diagonal.iter().all(|d| d.is_finite() && *d > 0.0) {
        return None;
    }
    let scale = diagonal.map(|d| 1.0 / d.sqrt());
    let scaled = DMatrix::from_fn(square.nrows(), square.ncols(), |i, j| square[(i, j)] * scale[i] * scale[j]);
    Some((scale, scaled))
}

/// The covariance of w (rad/s), zeta, r (1/kg) of each mode, R (m/N) and tau (s), in the order of [`Parameters::entries`];
/// `None` where the data do not determine them.
pub(super) fn covariance(parameters: &Parameters, seen: &Seen, blocks: &[Block]) -> Option<DMatrix<f64>> {
    let entries = parameters.entries();
    let (scale, unit) = scaled(&seen.normal(parameters, blocks).0)?;
    let inverse = Cholesky::<f64, Dyn>::new(unit)?.inverse();
    let natural = |i: usize| {
        scale[i]
            * match entries[i] {
                Entry::Omega(k) => parameters.modes[k].omega_rad_s,
                Entry::Damping(k) => parameters.modes[k].damping_ratio,
                _ => 1.0,
            }
    };
    Some(DMatrix::from_fn(entries.len(), entries.len(), |i, j| inverse[(i, j)] * natural(i) * natural(j)))
}
