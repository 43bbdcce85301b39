//! The sequence of signs and the sequence of dominant modes (section 3.2.1).
//!
//! How the definitions are read, so that no "much larger" and no "near" is left in them:
//!
//! | definition | here |
//! |---|---|
//! | (1) | at a zero of G on the imaginary axis a mode takes over whose part has the sign that G has after it |
//! | (2) | of several such modes those that would do it alone, with all modes that are no candidates, between the same two resonances; of several or none of these the largest part, or `[DI]` beyond the last resonance |
//! | (3) | without a zero of G a mode takes over at its own resonance only, where its part is beyond all bounds; a double integrator is one at 0, a constant at infinity |
//! | (4) | the same mode twice is once |
//! | (5) | below the first event the mode that resonates there dominates; if it is a zero of G, the modes that hold the sign before it, by (2) with frequency reversed: one of them, or `[DC]` / `[-DC]` |

use super::{ModalSum, ModalTerm, ZeroKind};
use crate::model::plant::{ModalModel, PlantError, Sign};

/// The signs of the modes that show, slowest first: `+-+`.
pub fn sign_sequence(modal: &ModalModel) -> String {
    modal
        .signs()
        .iter()
        .filter(|sign| **sign != Sign::Hidden)
        .map(|sign| sign.symbol())
        .collect()
}

/// The sequence of dominant modes of the undamped plant in words, `[R]-[u]-[v]`; `[]` where no mode shows.
pub fn dominant_sequence(modal: &ModalModel) -> Result<String, PlantError> {
    match ModalSum::visible(modal) {
        Err(PlantError::NoResponse) => Ok("[]".into()),
        sum => Ok(Sequence::of(&sum?)?.to_string()),
    }
}

/// What dominates a range of frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dominant {
    /// A mode, by its place among those with a residue, slowest first.
    Mode(usize),
    /// The constant R.
    Constant,
    /// Several modes together, below all resonances: `[DC]`, or `[-DC]` where they are negative.
    Dc {
        /// Whether G is positive there.
        positive: bool,
    },
    /// Several modes together, above all resonances, as a double integrator: `[DI]`, or `[-DI]` where its residue is negative.
    Di {
        /// Whether its residue is positive (G is negative there).
        positive: bool,
    },
}

/// What dominates, along rising frequency.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// The parts that dominate, each range one.
    pub dominants: Vec<Dominant>,
    names: Names,
}

/// Names of modes as in Chapter 3: `u`, `v` of two (and `R` for a constant), else `R`, `u`, `v`, `w`, and numbers from 5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Names {
    slowest_is_r: bool,
}

impl Sequence {
    /// The sequence of a sum without its damping.
    pub fn of(sum: &ModalSum) -> Result<Sequence, PlantError> {
        let events = events(sum)?;
        let mut dominants: Vec<Dominant> = Vec::new();
        dominants.extend(start(sum, &events)?);
        for (index, event) in events.iter().enumerate() {
            let dominant = match *event {
                Event::Resonance { mode, .. } => Dominant::Mode(mode),
                Event::Crossing {
                    omega_rad_s,
                    positive_after,
                } => {
                    let place = Place::of(sum, omega_rad_s);
                    let takers = takers(sum, &place, omega_rad_s, positive_after)?;
                    match takers.only() {
                        Some(part) => part.dominant(),
                        None if place.above == f64::INFINITY && index + 1 == events.len() => {
                            top(&takers, positive_after)
                        }
                        None => takers.largest(sum, omega_rad_s),
                    }
                }
            };
            dominants.push(dominant);
        }
        if sum.constant_m_per_n() != 0.0 {
            dominants.push(Dominant::Constant);
        }
        dominants.dedup();
        let slowest_is_r = sum.constant_m_per_n() == 0.0 && sum.terms().len() != 2;
        Ok(Sequence {
            dominants,
            names: Names { slowest_is_r },
        })
    }

    /// The names of the parts, without brackets.
    pub fn names(&self) -> Vec<String> {
        self.dominants
            .iter()
            .map(|dominant| self.names.of(*dominant))
            .collect()
    }
}

impl std::fmt::Display for Sequence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bracketed: Vec<String> = self
            .names()
            .iter()
            .map(|name| format!("[{name}]"))
            .collect();
        f.write_str(&bracketed.join("-"))
    }
}

impl Names {
    fn of(self, dominant: Dominant) -> String {
        let mode = |index: usize| match index + usize::from(!self.slowest_is_r) {
            0 => "R".to_string(),
            1 => "u".to_string(),
            2 => "v".to_string(),
            3 => "w".to_string(),
            _ => (index + 1).to_string(),
        };
        match dominant {
            Dominant::Mode(index) => mode(index),
            Dominant::Constant => "R".into(),
            Dominant::Dc { positive } => if positive { "DC" } else { "-DC" }.into(),
            Dominant::Di { positive } => if positive { "DI" } else { "-DI" }.into(),
        }
    }
}

/// What happens along the frequency axis.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// A mode resonates.
    Resonance { omega_rad_s: f64, mode: usize },
    /// G passes through zero.
    Crossing {
        omega_rad_s: f64,
        positive_after: bool,
    },
}

impl Event {
    fn omega_rad_s(&self) -> f64 {
        let (Event::Resonance { omega_rad_s, .. } | Event::Crossing { omega_rad_s, .. }) = *self;
        omega_rad_s
    }
}

fn events(sum: &ModalSum) -> Result<Vec<Event>, PlantError> {
    let modes = sum
        .terms()
        .iter()
        .enumerate()
        .map(|(mode, term)| Event::Resonance {
            omega_rad_s: term.omega_rad_s,
            mode,
        });
    let crossings = crossings(sum)?;
    let zeros = crossings
        .into_iter()
        .map(|(omega_rad_s, positive_after)| Event::Crossing {
            omega_rad_s,
            positive_after,
        });
    let mut events: Vec<Event> = modes.chain(zeros).collect();
    events.sort_by(|a, b| a.omega_rad_s().total_cmp(&b.omega_rad_s()));
    Ok(events)
}

/// The zeros of G on the imaginary axis in rad/s, and whether G is positive above each: the sign of its slope
/// dG/d(w^2) = sum of r/(w_i^2 - w^2)^2.
fn crossings(sum: &ModalSum) -> Result<Vec<(f64, bool)>, PlantError> {
    let slope = |omega: f64| {
        sum.terms()
            .iter()
            .map(|t| t.part(omega).powi(2) / t.residue_per_kg)
            .sum::<f64>()
    };
    let zeros = sum.undamped_zeros()?;
    let on_axis = zeros
        .iter()
        .filter(|zero| zero.kind == ZeroKind::Mmp && zero.s.im > 0.0);
    Ok(on_axis
        .map(|zero| (zero.s.im, slope(zero.s.im) > 0.0))
        .collect())
}

/// A mode or the constant.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Mode(usize),
    Constant,
}

impl Part {
    fn dominant(self) -> Dominant {
        match self {
            Part::Mode(mode) => Dominant::Mode(mode),
            Part::Constant => Dominant::Constant,
        }
    }

    fn at(self, sum: &ModalSum, omega_rad_s: f64) -> f64 {
        match self {
            Part::Mode(mode) => sum.terms()[mode].part(omega_rad_s),
            Part::Constant => sum.constant_m_per_n(),
        }
    }
}

/// Between which two resonances a frequency lies.
struct Place {
    below: f64,
    above: f64,
}

impl Place {
    fn of(sum: &ModalSum, omega_rad_s: f64) -> Place {
        let resonances = || sum.terms().iter().map(|term| term.omega_rad_s);
        Place {
            below: resonances()
                .filter(|w| *w < omega_rad_s)
                .fold(0.0, f64::max),
            above: resonances()
                .filter(|w| *w > omega_rad_s)
                .fold(f64::INFINITY, f64::min),
        }
    }

    fn holds(&self, omega_rad_s: f64) -> bool {
        self.below < omega_rad_s && omega_rad_s < self.above
    }
}

/// Candidates of definition (1), and those of them that definition (2a) leaves.
struct Takers {
    candidates: Vec<Part>,
    able: Vec<Part>,
}

impl Takers {
    fn only(&self) -> Option<Part> {
        match (self.candidates.as_slice(), self.able.as_slice()) {
            ([one], _) | (_, [one]) => Some(*one),
            _ => None,
        }
    }

    fn largest(&self, sum: &ModalSum, omega_rad_s: f64) -> Dominant {
        let among = if self.able.is_empty() {
            &self.candidates
        } else {
            &self.able
        };
        let size = |part: &&Part| part.at(sum, omega_rad_s).abs();
        // G is zero and moves: it has parts of either sign. Without any, the constant would be all there is.
        among
            .iter()
            .max_by(|a, b| size(a).total_cmp(&size(b)))
            .map_or(Dominant::Constant, |part| part.dominant())
    }
}

/// Who can give G its sign beside the crossing at `omega_rad_s`, where `positive` is that sign.
fn holders(sum: &ModalSum, omega_rad_s: f64, positive: bool) -> (Vec<Part>, Vec<Part>) {
    let modes = (0..sum.terms().len()).map(Part::Mode);
    let all = modes.chain((sum.constant_m_per_n() != 0.0).then_some(Part::Constant));
    all.partition(|part| (part.at(sum, omega_rad_s) > 0.0) == positive)
}

/// Definitions (1) and (2a) for the crossing at `omega_rad_s`: who takes over.
fn takers(
    sum: &ModalSum,
    place: &Place,
    omega_rad_s: f64,
    positive_after: bool,
) -> Result<Takers, PlantError> {
    let (candidates, rest) = holders(sum, omega_rad_s, positive_after);
    let able = able(sum, &candidates, &rest, place, positive_after)?;
    Ok(Takers { candidates, able })
}

/// The candidates that, alone with the rest, cross in the same sense between the same resonances.
fn able(
    sum: &ModalSum,
    candidates: &[Part],
    rest: &[Part],
    place: &Place,
    positive_after: bool,
) -> Result<Vec<Part>, PlantError> {
    let mut able = Vec::new();
    for candidate in candidates {
        let parts = || rest.iter().chain([candidate]);
        let terms: Vec<ModalTerm> = parts().filter_map(|part| term(sum, *part)).collect();
        let constant = if parts().any(|part| *part == Part::Constant) {
            sum.constant_m_per_n()
        } else {
            0.0
        };
        let crossings = crossings(&ModalSum::new(terms, constant)?)?;
        if crossings
            .iter()
            .any(|(omega, after)| place.holds(*omega) && *after == positive_after)
        {
            able.push(*candidate);
        }
    }
    Ok(able)
}

fn term(sum: &ModalSum, part: Part) -> Option<ModalTerm> {
    match part {
        Part::Mode(mode) => Some(sum.terms()[mode]),
        Part::Constant => None,
    }
}

/// Who dominates below the first event; nobody is named where a double integrator does, its resonance at 0 is the first event.
fn start(sum: &ModalSum, events: &[Event]) -> Result<Option<Dominant>, PlantError> {
    let Some(Event::Crossing {
        omega_rad_s,
        positive_after,
    }) = events.first().copied()
    else {
        return Ok(None);
    };
    let place = Place::of(sum, omega_rad_s);
    let (candidates, rest) = holders(sum, omega_rad_s, !positive_after);
    let able = able(sum, &candidates, &rest, &place, positive_after)?;
    let only = Takers { candidates, able }.only();
    Ok(Some(only.map_or(
        Dominant::Dc {
            positive: !positive_after,
        },
        Part::dominant,
    )))
}

/// Who dominates beyond the last crossing, where several could.
fn top(takers: &Takers, positive_after: bool) -> Dominant {
    if takers.candidates.contains(&Part::Constant) {
        Dominant::Constant
    } else {
        Dominant::Di {
            positive: !positive_after,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(parts: &[(f64, f64)], constant: f64) -> String {
        let terms = parts
            .iter()
            .map(|(w, r)| ModalTerm::undamped(*w, *r))
            .collect();
        Sequence::of(&ModalSum::new(terms, constant).unwrap())
            .unwrap()
            .to_string()
    }

    #[test]
    fn the_examples_of_chapter_3_have_the_sequences_of_the_thesis() {
        // Eq. (3-4): -0.5 is the MMP case, -5 the RMP-RNMP case.
        assert_eq!(sequence(&[(1.0, 1.0), (10.0, -0.5)], 0.0), "[u]-[v]-[u]");
        assert_eq!(sequence(&[(1.0, 1.0), (10.0, -5.0)], 0.0), "[u]-[v]");
        // Eq. (3-9) with a_u = -a0: dual MMP zeros, CMP-CNMP zeros, two pairs of RMP-RNMP zeros.
        for (a0, expected) in [
            (0.01, "[R]-[u]-[R]-[v]"),
            (5.0, "[R]-[u]-[v]"),
            (22.0, "[R]-[u]-[v]"),
        ] {
            assert_eq!(
                sequence(&[(1.0, 1.0), (10.0, -a0), (11.0, a0)], 0.0),
                expected,
                "a0 = {a0}"
            );
        }
    }

    #[test]
    fn several_modes_together_are_an_abstract_one() {
        // Above both resonances neither R nor u alone turns v's sign: u + v and R + v are positive at infinity, all three
        // are not. -2.5 + 2 > ... the sums of residues decide: R + v = -0.5, u + v = -0.5, R + u + v = 1.5.
        assert_eq!(
            sequence(&[(0.0, 2.0), (1.0, 2.0), (2.0, -2.5)], 0.0),
            "[R]-[u]-[v]-[DI]"
        );
        // With more of R it does so alone.
        assert_eq!(
            sequence(&[(0.0, 4.0), (1.0, 2.0), (2.0, -2.5)], 0.0),
            "[R]-[u]-[v]-[R]"
        );
        // Table 3-4: at low frequency v and R are each too small to hold the sign against u.
        assert_eq!(
            sequence(&[(1.0, 1.0), (2.0, -2.8)], -0.8),
            "[-DC]-[u]-[v]-[R]"
        );
    }

    #[test]
    fn the_names_of_many_modes_go_on_with_numbers() {
        let in_phase: Vec<(f64, f64)> = (1..=6).map(|i| (f64::from(i), 1.0)).collect();
        assert_eq!(sequence(&in_phase, 0.0), "[R]-[u]-[v]-[w]-[5]-[6]");
        assert_eq!(sequence(&[], 1.0), "[R]");
    }
}
