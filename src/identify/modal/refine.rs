//! Maximum likelihood: the parameters of a sum of modes that make the weighted squares of what is left least.
//!
//! ```text
//! H(f) = exp(-j w tau) (R V_0(f) + sum of r_k V(f; w_k, zeta_k))        V: a mode of residue 1 through the view
//! chi^2 = sum over frf_data of 2 |H_b - H(f_b)|^2 / v_b                    v_b = E|error|^2
//! ```
//!
//! by Levenberg and Marquardt's steps in ln w, ln zeta and tau, after each of which r and R, in which H is linear, are solved
//! for (G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; L. Kaufman, BIT 15 (1975) 49): of modes closer than their
//! widths only certain sums are well known, and steps in all parameters at once crawl along that valley. The damping
//! follows what a step gains over what it promised (H. B. Nielsen, IMM-REP-1999-05, Technical University of Denmark). With v
//! known, chi^2 has its mean at 2 N less the number of parameters, and the inverse of J^T W J is their covariance.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use super::normal::Normal;
use super::view::{MeasurementChain, slopes};
use crate::identify::FrfDatum;
use crate::model::zeros::ModalTerm;

/// Steps at most.
const STEPS: usize = 60;
/// A step that would lower chi^2 by less is none: a hundredth of what noise does to one parameter.
const NOTHING: f64 = 0.01;
/// The damping of the first step, in coordinates of a unit diagonal.
const FIRST_DAMPING: f64 = 1e-3;
/// And that of any, at least.
const LEAST_DAMPING: f64 = 1e-9;
/// The damping falls at most to so much of itself in a step.
const LOWERED: f64 = 0.1;
/// ln w and ln zeta change at most so much in a step.
const LARGEST: [f64; 2] = [0.02, 0.7];
/// Bounds of a damping ratio.
const DAMPING: (f64, f64) = (1e-6, 2.0);

/// A sum of modes seen late.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    /// The modes; one of w = 0 is a free body.
    pub modes: Vec<ModalTerm>,
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

impl Entry {
    /// Whether the model is linear in it.
    fn is_linear(self) -> bool {
        matches!(self, Entry::Residue(_) | Entry::Remainder)
    }
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

    /// These with the residues and R of `linear`, in this order.
    fn with_linear(&self, linear: &DVector<f64>) -> Parameters {
        let mut next = self.clone();
        next.modes
            .iter_mut()
            .zip(linear.iter())
            .for_each(|(mode, r)| mode.residue_per_kg = *r);
        next.remainder_m_per_n = linear[self.modes.len()];
        next
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
    /// What the frf_data have beyond the model.
    pub left: Vec<Complex<f64>>,
    /// chi^2.
    pub chi2: f64,
}

impl Seen {
    pub(super) fn of(
        parameters: &Parameters,
        view: &MeasurementChain<'_>,
        frf_data: &[FrfDatum],
    ) -> Seen {
        let mut seen = Seen::parts_of(parameters, view, frf_data);
        seen.look(parameters, frf_data);
        seen
    }

    /// The same with the residues and R with which chi^2 is least, if the frf_data tell them apart.
    fn settled(
        parameters: Parameters,
        view: &MeasurementChain<'_>,
        frf_data: &[FrfDatum],
    ) -> (Parameters, Seen) {
        let mut seen = Seen::parts_of(&parameters, view, frf_data);
        let settled = match seen.linear(frf_data) {
            Some(linear) => parameters.with_linear(&linear),
            None => parameters,
        };
        seen.look(&settled, frf_data);
        (settled, seen)
    }

    fn parts_of(
        parameters: &Parameters,
        view: &MeasurementChain<'_>,
        frf_data: &[FrfDatum],
    ) -> Seen {
        let nodes = view.nodes(parameters.delay_s, frf_data);
        let part = |m: &ModalTerm| view.mode((m.omega_rad_s, m.damping_ratio), &nodes);
        let parts = parameters.modes.iter().map(part).collect();
        Seen {
            parts,
            constant: view.constant(&nodes),
            left: Vec::new(),
            chi2: f64::NAN,
        }
    }

    /// What these parts, of the sizes of `parameters`, leave.
    fn look(&mut self, parameters: &Parameters, frf_data: &[FrfDatum]) {
        let left = |(b, block): (usize, &FrfDatum)| {
            let modes: Complex<f64> = parameters
                .modes
                .iter()
                .zip(&self.parts)
                .map(|(mode, part)| part[b] * mode.residue_per_kg)
                .sum();
            block.response - modes - self.constant[b] * parameters.remainder_m_per_n
        };
        self.left = frf_data.iter().enumerate().map(left).collect();
        self.chi2 = self
            .left
            .iter()
            .zip(frf_data)
            .map(|(e, block)| 2.0 * e.norm_sqr() / block.variance)
            .sum();
    }

    /// The residues and R with which chi^2 is least: by normal equations in a unit diagonal, as an error of theirs is seen in
    /// the chi^2 of the step, which is then none.
    fn linear(&self, frf_data: &[FrfDatum]) -> Option<DVector<f64>> {
        let mut normal = Normal::of_size(self.parts.len() + 1);
        let mut row = Vec::with_capacity(self.parts.len() + 1);
        for (b, block) in frf_data.iter().enumerate() {
            row.clear();
            row.extend(
                self.parts
                    .iter()
                    .chain([&self.constant])
                    .map(|part| part[b]),
            );
            normal.add(&row, block.response, (2.0 / block.variance).sqrt());
        }
        normal.solve(|_| 0.0)
    }

    /// How block `b` of the model changes with each parameter, in the order of [`Parameters::entries`].
    fn slopes(
        &self,
        parameters: &Parameters,
        b: usize,
        block: &FrfDatum,
        slopes_out: &mut Vec<Complex<f64>>,
    ) {
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
    fn normal(&self, parameters: &Parameters, frf_data: &[FrfDatum]) -> Normal {
        let mut normal = Normal::of_size(parameters.entries().len());
        let mut row = Vec::with_capacity(normal.right.len());
        for (b, block) in frf_data.iter().enumerate() {
            self.slopes(parameters, b, block, &mut row);
            normal.add(&row, self.left[b], (2.0 / block.variance).sqrt());
        }
        normal
    }
}

/// Where the steps end, the last of which lowers chi^2 by less than `coarse` of it: the parameters, and what is left of the
/// frf_data there.
pub(super) fn refine(
    start: Parameters,
    view: &MeasurementChain<'_>,
    frf_data: &[FrfDatum],
    coarse: f64,
) -> (Parameters, Seen) {
    if start.modes.is_empty() {
        let seen = Seen::of(&start, view, frf_data);
        return (start, seen);
    }
    let entries = start.entries();
    let (mut best, mut seen) = Seen::settled(start, view, frf_data);
    let mut damping = Damping::first();
    let mut normal = seen.normal(&best, frf_data);
    for _ in 0..STEPS {
        let Some(step) = normal.solve(|i| {
            if entries[i].is_linear() {
                0.0
            } else {
                damping.now
            }
        }) else {
            break;
        };
        let (next, there) = Seen::settled(best.moved(&entries, &step), view, frf_data);
        let (gained, promised) = (seen.chi2 - there.chi2, normal.promised(&step));
        if gained.is_finite() && gained >= 0.0 {
            let done = gained < NOTHING + coarse * there.chi2 && damping.now < 1.0;
            (best, seen) = (next, there);
            if done {
                break;
            }
            damping.lower(gained / promised);
            normal = seen.normal(&best, frf_data);
        } else if damping.now > 1e8 || promised < NOTHING {
            break;
        } else {
            damping.raise();
        }
    }
    (best, seen)
}

/// What keeps a step short, in coordinates of a unit diagonal.
struct Damping {
    now: f64,
    raised_by: f64,
}

impl Damping {
    fn first() -> Self {
        Self {
            now: FIRST_DAMPING,
            raised_by: 2.0,
        }
    }

    /// After a step that gained such a share of what it promised: the less, the more it promised too much.
    fn lower(&mut self, share: f64) {
        let factor = (1.0 - (2.0 * share - 1.0).powi(3)).clamp(LOWERED, 2.0);
        *self = Self {
            now: (self.now * factor).max(LEAST_DAMPING),
            raised_by: 2.0,
        };
    }

    /// After a step that gained nothing: twice, then four times, then eight times as much.
    fn raise(&mut self) {
        *self = Self {
            now: self.now * self.raised_by,
            raised_by: 2.0 * self.raised_by,
        };
    }
}

/// The covariance of w (rad/s), zeta, r (1/kg) of each mode, R (m/N) and tau (s), in the order of [`Parameters::entries`];
/// `None` where the data do not determine them.
pub(super) fn covariance(
    parameters: &Parameters,
    seen: &Seen,
    frf_data: &[FrfDatum],
) -> Option<DMatrix<f64>> {
    let entries = parameters.entries();
    let (scale, unit) = seen.normal(parameters, frf_data).scaled()?;
    let inverse = Cholesky::<f64, Dyn>::new(unit)?.inverse();
    let natural = |i: usize| {
        scale[i]
            * match entries[i] {
                Entry::Omega(k) => parameters.modes[k].omega_rad_s,
                Entry::Damping(k) => parameters.modes[k].damping_ratio,
                _ => 1.0,
            }
    };
    Some(DMatrix::from_fn(entries.len(), entries.len(), |i, j| {
        inverse[(i, j)] * natural(i) * natural(j)
    }))
}
