//! Two close modes and the remainder of all others, as the sum of Eq. (4-1):
//!
//! ```text
//!   G(s) = aR/s^2 + au/(s^2 + wu^2) + av/(s^2 + wv^2),   wv > wu > 0
//! ```
//!
//! The thesis assumes one mode R for all others (A4-4), and that mode to be a double integrator (A4-5). No stage fulfils
//! either exactly. Here aR is the residue of the double integrator that equals all other modes together at w0 = sqrt(wu wv),
//!
//! ```text
//!   aR = -w0^2 (sum over the others of ri/(wi^2 - w0^2))
//! ```
//!
//! which is the residue of mode R where both assumptions hold. Where they do not, it is that of the sum of the modes
//! to first order in the gap: within the narrow band between two close modes, the response of the others is nearly
//! constant.
//! [`Remainder`] quantifies how far each assumption holds.

use bench_plant::PlantError;
use bench_plant::zeros::{ModalSum, ModalTerm, Zero};

/// Two modes, and the others as a double integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloseModes {
    /// The slower of the two.
    pub u: ModalTerm,
    /// The faster.
    pub v: ModalTerm,
    /// All others.
    pub remainder: Remainder,
}

/// All other modes, evaluated at w0 between the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remainder {
    /// aR in 1/kg.
    pub residue_per_kg: f64,
    /// Mode R: the mode with the largest part at w0, by its index; `None` where no other mode has any.
    pub mode: Option<usize>,
    /// Assumption A4-4: the sum of the other modes there over the part of mode R; 0 where it is alone.
    pub others_ratio: f64,
    /// Assumption A4-4: wR/wu of a mode R below the two, wv/wR of one above; 0 is the best separation.
    pub nearness_ratio: f64,
    /// Assumption A4-5: deviation of the others' sum from the double integrator at wu or wv, as a ratio of it.
    pub integrator_ratio: f64,
}

impl CloseModes {
    /// The two modes of `pair`, in either order; `None` where their frequencies are equal or one is 0.
    pub fn of(terms: &[ModalTerm], pair: [usize; 2]) -> Option<CloseModes> {
        let [i, j] = pair.map(|mode| terms[mode]);
        let (u, v) = if i.omega_rad_s < j.omega_rad_s {
            (i, j)
        } else {
            (j, i)
        };
        let apart = 0.0 < u.omega_rad_s && u.omega_rad_s < v.omega_rad_s;
        apart.then(|| CloseModes {
            u,
            v,
            remainder: Remainder::of(terms, pair, [u.omega_rad_s, v.omega_rad_s]),
        })
    }

    /// The residues aR, au, av in 1/kg.
    pub fn residues_per_kg(&self) -> [f64; 3] {
        [
            self.remainder.residue_per_kg,
            self.u.residue_per_kg,
            self.v.residue_per_kg,
        ]
    }

    /// wv^2 - wu^2 over wu^2.
    pub fn spread_ratio(&self) -> f64 {
        let (wu, wv) = (self.u.omega_rad_s, self.v.omega_rad_s);
        (wv - wu) * (wv + wu) / (wu * wu)
    }

    /// b2-hat of Eq. (4-9) in 1/kg, where the printed w_D is read as wv - wu.
    pub fn b2_per_kg(&self) -> f64 {
        self.spread_ratio() * self.residues_per_kg().iter().sum::<f64>()
    }

    /// |b21-hat| and |b22-hat| of Eq. (4-10) in 1/kg, the smaller first. They are critical only where au av < 0.
    pub fn critical_b2_per_kg(&self) -> [f64; 2] {
        let root = |term: &ModalTerm| {
            term.residue_per_kg.abs().sqrt() * (term.omega_rad_s / self.u.omega_rad_s)
        };
        let (ru, rv) = (root(&self.u), root(&self.v));
        [(rv - ru) * (rv - ru), (rv + ru) * (rv + ru)]
    }

    /// b2-hat in the direction of av: positive where the parabola of Eq. (4-3) opens towards Pu and Pv.
    pub fn signed_b2_per_kg(&self) -> f64 {
        self.b2_per_kg() * self.v.residue_per_kg.signum()
    }

    /// Whether au av < 0, so that b21-hat and b22-hat exist.
    pub fn are_opposed(&self) -> bool {
        self.u.residue_per_kg * self.v.residue_per_kg < 0.0
    }

    /// Zeros of Eq. (4-1), as eigenvalues of a pencil, independent of the formulae of this chapter.
    pub fn zeros(&self) -> Result<Vec<Zero>, PlantError> {
        let remainder = ModalTerm::undamped(0.0, self.remainder.residue_per_kg);
        ModalSum::new(vec![remainder, self.u, self.v], 0.0)?.undamped_zeros()
    }
}

impl Remainder {
    fn of(terms: &[ModalTerm], pair: [usize; 2], [wu, wv]: [f64; 2]) -> Remainder {
        let others = Others { terms, pair };
        let middle = (wu * wv).sqrt();
        let residue_per_kg = others.integrator_per_kg(middle);
        let largest = others.largest(middle);
        let deviation = |w: f64| (others.integrator_per_kg(w) / residue_per_kg - 1.0).abs();
        Remainder {
            residue_per_kg,
            mode: largest.map(|(mode, _)| mode),
            others_ratio: largest.map_or(0.0, |(_, term)| others.ratio_to(term, middle)),
            nearness_ratio: largest.map_or(0.0, |(_, term)| nearness(term, [wu, wv])),
            integrator_ratio: if residue_per_kg == 0.0 {
                0.0
            } else {
                deviation(wu).max(deviation(wv))
            },
        }
    }
}

/// All modes beside the two.
struct Others<'a> {
    terms: &'a [ModalTerm],
    pair: [usize; 2],
}

impl<'a> Others<'a> {
    fn terms(&self) -> impl Iterator<Item = (usize, &'a ModalTerm)> {
        let terms = self.terms.iter().enumerate();
        terms.filter(|(mode, _)| !self.pair.contains(mode))
    }

    /// Their sum at a frequency.
    fn part(&self, omega_rad_s: f64) -> f64 {
        self.terms().map(|(_, term)| term.part(omega_rad_s)).sum()
    }

    /// The residue of the double integrator that equals their sum at a frequency.
    fn integrator_per_kg(&self, omega_rad_s: f64) -> f64 {
        -omega_rad_s * omega_rad_s * self.part(omega_rad_s)
    }

    /// Ratio of the response of all other modes to the response of `term` at `omega_rad_s`.
    fn ratio_to(&self, term: &ModalTerm, omega_rad_s: f64) -> f64 {
        let part = term.part(omega_rad_s);
        ((self.part(omega_rad_s) - part) / part).abs()
    }

    /// The mode with the largest part at a frequency, if any has one.
    fn largest(&self, omega_rad_s: f64) -> Option<(usize, &'a ModalTerm)> {
        let part = |term: &ModalTerm| term.part(omega_rad_s);
        self.terms()
            .max_by(|a, b| part(a.1).abs().total_cmp(&part(b.1).abs()))
            .filter(|(_, term)| part(term) != 0.0)
    }
}

/// wR/wu of a mode R below the two, wv/wR of one above.
fn nearness(term: &ModalTerm, [wu, wv]: [f64; 2]) -> f64 {
    let w = term.omega_rad_s;
    if w < wu { w / wu } else { wv / w }
}
