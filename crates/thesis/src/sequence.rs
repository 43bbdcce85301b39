//! The sequence of signs and the sequence of dominant modes (section 3.2.1).
//!
//! The definitions, read without the thesis's "much larger" and "near":
//!
//! | definition | reading |
//! |---|---|
//! | (1) | At a zero of G on the imaginary axis, a mode becomes dominant whose part has the sign of G above the zero. |
//! | (2) | Among several candidates, those become dominant of which each alone, together with all modes that are not candidates, gives a zero with the same change of sign between the same two resonances. If that leaves several or none: the largest part, or `[DI]` beyond the last resonance. |
//! | (3) | Without a zero of G, a mode becomes dominant only at its own resonance, where its part has no limit. A double integrator resonates at 0, a constant at infinity. |
//! | (4) | The same mode twice counts once. |
//! | (5) | Below the first event, the mode that resonates there dominates. If the event is a zero of G, the modes dominate that have the sign of G before it, by (2) with frequency reversed: one of them, or `[DC]` / `[-DC]`. |

use std::fmt;

use bench_plant::zeros::{ModalSum, ModalTerm, ZeroKind};
use bench_plant::{ModalModel, PlantError, Sign};

/// The signs of the modes that can be observed, lowest frequency first: `+-+`.
pub fn sign_sequence(modal: &ModalModel) -> String {
    let signs = modal.signs().into_iter();
    signs
        .filter(|sign| *sign != Sign::Hidden)
        .map(Sign::symbol)
        .collect()
}

/// The sequence of dominant modes of the undamped plant, `[R]-[u]-[v]`; `[]` where no mode can be observed.
pub fn dominant_sequence(modal: &ModalModel) -> Result<String, PlantError> {
    match ModalSum::visible(modal) {
        Err(PlantError::NoResponse) => Ok("[]".into()),
        sum => Ok(Sequence::of(&sum?)?.to_string()),
    }
}

/// A mode, or several together, that dominates a range of frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dominant {
    /// A mode, by its index among those with a residue, lowest frequency first.
    Mode(usize),
    /// The constant R.
    Constant,
    /// Several modes together below all resonances: `[DC]`, or `[-DC]` where they are negative.
    Dc {
        /// Whether G is positive there.
        positive: bool,
    },
    /// Several modes together above all resonances, as a double integrator: `[DI]`, or `[-DI]` where its residue is negative.
    Di {
        /// Whether its residue is positive (G is negative there).
        positive: bool,
    },
}

/// The dominant modes along rising frequency.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sequence {
    /// One part for each range of frequencies.
    pub dominants: Vec<Dominant>,
    /// Names of modes as in Chapter 3: `u`, `v` of two modes (and `R` for a constant), else `R`, `u`, `v`, `w`, and numbers
    /// from 5.
    slowest_is_r: bool,
}

impl Sequence {
    /// The sequence of a sum without its damping.
    pub fn of(sum: &ModalSum) -> Result<Sequence, PlantError> {
        let events = events(sum)?;
        let mut dominants: Vec<Dominant> = first_dominant(sum, &events)?.into_iter().collect();
        for (index, event) in events.iter().enumerate() {
            let is_last = index + 1 == events.len();
            dominants.push(event.dominant(sum, is_last)?);
        }
        dominants.extend(sum.has_constant().then_some(Dominant::Constant));
        dominants.dedup();
        Ok(Sequence {
            dominants,
            slowest_is_r: !sum.has_constant() && sum.terms().len() != 2,
        })
    }

    /// The names of the parts, without brackets.
    pub fn names(&self) -> Vec<String> {
        self.dominants
            .iter()
            .map(|dominant| self.name(*dominant))
            .collect()
    }

    fn name(&self, dominant: Dominant) -> String {
        match dominant {
            Dominant::Mode(index) => self.mode_name(index),
            Dominant::Constant => "R".into(),
            Dominant::Dc { positive: true } => "DC".into(),
            Dominant::Dc { positive: false } => "-DC".into(),
            Dominant::Di { positive: true } => "DI".into(),
            Dominant::Di { positive: false } => "-DI".into(),
        }
    }

    fn mode_name(&self, index: usize) -> String {
        match index + usize::from(!self.slowest_is_r) {
            0 => "R".into(),
            1 => "u".into(),
            2 => "v".into(),
            3 => "w".into(),
            _ => (index + 1).to_string(),
        }
    }
}

impl fmt::Display for Sequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.names();
        let bracketed: Vec<String> = names.iter().map(|name| format!("[{name}]")).collect();
        f.write_str(&bracketed.join("-"))
    }
}

/// A zero of G on the imaginary axis.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    omega_rad_s: f64,
    positive_after: bool,
}

/// An event along the frequency axis.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// A mode resonates.
    Resonance { omega_rad_s: f64, mode: usize },
    /// G passes through zero.
    Crossing(Crossing),
}

impl Event {
    fn omega_rad_s(&self) -> f64 {
        match self {
            Event::Resonance { omega_rad_s, .. } => *omega_rad_s,
            Event::Crossing(crossing) => crossing.omega_rad_s,
        }
    }

    /// The dominant part above the event.
    fn dominant(&self, sum: &ModalSum, is_last: bool) -> Result<Dominant, PlantError> {
        match self {
            Event::Resonance { mode, .. } => Ok(Dominant::Mode(*mode)),
            Event::Crossing(crossing) => dominant_above(sum, crossing, is_last),
        }
    }
}

fn events(sum: &ModalSum) -> Result<Vec<Event>, PlantError> {
    let terms = sum.terms().iter().enumerate();
    let resonances = terms.map(|(mode, term)| Event::Resonance {
        omega_rad_s: term.omega_rad_s,
        mode,
    });
    let crossings = crossings(sum)?.into_iter().map(Event::Crossing);
    let mut events: Vec<Event> = resonances.chain(crossings).collect();
    events.sort_by(|a, b| a.omega_rad_s().total_cmp(&b.omega_rad_s()));
    Ok(events)
}

/// The zeros of G on the imaginary axis, and whether G is positive above each.
fn crossings(sum: &ModalSum) -> Result<Vec<Crossing>, PlantError> {
    let zeros = sum.undamped_zeros()?;
    let on_axis = zeros
        .iter()
        .filter(|zero| zero.kind == ZeroKind::Mmp && zero.s.im > 0.0);
    let crossings = on_axis.map(|zero| Crossing {
        omega_rad_s: zero.s.im,
        positive_after: slope(sum, zero.s.im) > 0.0,
    });
    Ok(crossings.collect())
}

/// dG/d(w^2) = sum of r/(w_i^2 - w^2)^2.
fn slope(sum: &ModalSum, omega_rad_s: f64) -> f64 {
    let terms = sum.terms().iter();
    terms
        .map(|term| term.part(omega_rad_s).powi(2) / term.residue_per_kg)
        .sum()
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

    fn value(self, sum: &ModalSum, omega_rad_s: f64) -> f64 {
        match self {
            Part::Mode(mode) => sum.terms()[mode].part(omega_rad_s),
            Part::Constant => sum.constant_m_per_n(),
        }
    }
}

/// The two resonances next to a frequency.
struct Range {
    below: f64,
    above: f64,
}

impl Range {
    fn around(sum: &ModalSum, omega_rad_s: f64) -> Range {
        let resonances = || sum.terms().iter().map(|term| term.omega_rad_s);
        let below = resonances().filter(|w| *w < omega_rad_s);
        let above = resonances().filter(|w| *w > omega_rad_s);
        Range {
            below: below.fold(0.0, f64::max),
            above: above.fold(f64::INFINITY, f64::min),
        }
    }

    fn contains(&self, omega_rad_s: f64) -> bool {
        self.below < omega_rad_s && omega_rad_s < self.above
    }
}

/// The parts that may become dominant at a crossing.
struct Takeover {
    /// Candidates of definition (1).
    candidates: Vec<Part>,
    /// Those of them that definition (2a) leaves.
    able: Vec<Part>,
}

impl Takeover {
    /// The candidates with the sign `positive` of G beside a crossing.
    fn new(sum: &ModalSum, crossing: &Crossing, positive: bool) -> Result<Takeover, PlantError> {
        let modes = (0..sum.terms().len()).map(Part::Mode);
        let parts = modes.chain(sum.has_constant().then_some(Part::Constant));
        let (candidates, rest): (Vec<Part>, Vec<Part>) =
            parts.partition(|part| (part.value(sum, crossing.omega_rad_s) > 0.0) == positive);
        let mut able = Vec::new();
        for candidate in &candidates {
            if crosses_alone(sum, crossing, *candidate, &rest)? {
                able.push(*candidate);
            }
        }
        Ok(Takeover { candidates, able })
    }

    /// The only part that can become dominant, if there is exactly one.
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
        let size = |part: &&Part| part.value(sum, omega_rad_s).abs();
        let largest = among.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        // G is zero and changes: it has parts of either sign. Without any there is only the constant.
        largest.map_or(Dominant::Constant, |part| part.dominant())
    }
}

/// Whether one candidate, together with `rest` alone, gives a zero with the same change of sign between the same
/// resonances.
fn crosses_alone(
    sum: &ModalSum,
    crossing: &Crossing,
    candidate: Part,
    rest: &[Part],
) -> Result<bool, PlantError> {
    let range = Range::around(sum, crossing.omega_rad_s);
    let alone = sum_of(sum, rest.iter().chain([&candidate]))?;
    Ok(crossings(&alone)?.iter().any(|other| {
        range.contains(other.omega_rad_s) && other.positive_after == crossing.positive_after
    }))
}

/// The sum of some parts of a sum.
fn sum_of<'a>(
    sum: &ModalSum,
    parts: impl Iterator<Item = &'a Part>,
) -> Result<ModalSum, PlantError> {
    let mut terms: Vec<ModalTerm> = Vec::new();
    let mut constant_m_per_n = 0.0;
    for part in parts {
        match part {
            Part::Mode(mode) => terms.push(sum.terms()[*mode]),
            Part::Constant => constant_m_per_n = sum.constant_m_per_n(),
        }
    }
    ModalSum::new(terms, constant_m_per_n)
}

/// The dominant part above a crossing, definitions (1) and (2).
fn dominant_above(
    sum: &ModalSum,
    crossing: &Crossing,
    is_last: bool,
) -> Result<Dominant, PlantError> {
    let takeover = Takeover::new(sum, crossing, crossing.positive_after)?;
    let omega_rad_s = crossing.omega_rad_s;
    let is_above_all = Range::around(sum, omega_rad_s).above == f64::INFINITY;
    Ok(match takeover.only() {
        Some(part) => part.dominant(),
        None if !(is_above_all && is_last) => takeover.largest(sum, omega_rad_s),
        None if takeover.candidates.contains(&Part::Constant) => Dominant::Constant,
        None => Dominant::Di {
            positive: !crossing.positive_after,
        },
    })
}

/// The dominant part below the first event, definition (5); `None` where a mode resonates there.
fn first_dominant(sum: &ModalSum, events: &[Event]) -> Result<Option<Dominant>, PlantError> {
    let Some(Event::Crossing(crossing)) = events.first() else {
        return Ok(None);
    };
    let positive = !crossing.positive_after;
    let only = Takeover::new(sum, crossing, positive)?.only();
    Ok(Some(only.map_or(Dominant::Dc { positive }, Part::dominant)))
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
    fn examples_of_chapter_3_have_the_sequences_of_the_thesis() {
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
    fn several_modes_together_dominate_as_di_or_dc() {
        // G is positive just above the resonance of v. For w -> infinity, G(jw) = -(sum of residues)/w^2: R + v = -0.5
        // and u + v = -0.5 keep G positive, R + u + v = 1.5 makes it negative. So neither R nor u alone changes
        // the sign, only both together: [DI].
        assert_eq!(
            sequence(&[(0.0, 2.0), (1.0, 2.0), (2.0, -2.5)], 0.0),
            "[R]-[u]-[v]-[DI]"
        );
        // With R = 4, R + v = 1.5 makes G negative: R alone changes the sign.
        assert_eq!(
            sequence(&[(0.0, 4.0), (1.0, 2.0), (2.0, -2.5)], 0.0),
            "[R]-[u]-[v]-[R]"
        );
        // Table 3-4: at w = 0 the parts are u = 1, v = -0.7 and R = -0.8. Neither v nor R alone makes G negative,
        // only both together: [-DC].
        assert_eq!(
            sequence(&[(1.0, 1.0), (2.0, -2.8)], -0.8),
            "[-DC]-[u]-[v]-[R]"
        );
    }

    #[test]
    fn names_of_many_modes_continue_with_numbers() {
        let in_phase: Vec<(f64, f64)> = (1..=6).map(|i| (f64::from(i), 1.0)).collect();
        assert_eq!(sequence(&in_phase, 0.0), "[R]-[u]-[v]-[w]-[5]-[6]");
        assert_eq!(sequence(&[], 1.0), "[R]");
    }
}
