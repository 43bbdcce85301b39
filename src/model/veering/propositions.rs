//! The propositions of section 4.2.3: what their premises foretell, and what the zeros are.
//!
//! | proposition | here | as printed |
//! |---|---|---|
//! | P4-1: CMP-CNMP zeros if and only if C4-1 and C4-2 | exact for Eq. (4-1) at every value. C4-1 follows from C4-2 | the same |
//! | P4-2: C4-1, C4-3, C4-4 give a value with CMP-CNMP zeros | exact for Eq. (4-1), if C4-1 holds *from psi_0 to the veering point* | C4-1 has no place in it. With C4-1 at psi_0 alone it is wrong: a residue that turns on the way lets a zero out between the modes through a pole |
//! | P4-2x: under C4-3, CMP-CNMP zeros if and only if C4-1 and C4-4 | exact for Eq. (4-1) on the *stretch* around the veering point where C4-1 holds | over the whole range "only if" needs C4-1 somewhere, "if" needs it up to the veering point: no one reading gives both |
//! | P4-2y: C4-3 and C4-4y give a value with CMP-CNMP zeros | exact for Eq. (4-1), if au and av keep their signs from psi_0 to the veering point; sufficient, not necessary | "C4-4y implies C4-1" holds at psi_0, not on the way: the same gap as in P4-2 |
//!
//! The proof of P4-2 in this reading: b2-hat (in the direction of av) is above |b21-hat| at psi_0, below |b22-hat| at the
//! veering point, and between the two nothing jumps, as residues and frequencies are continuous and au av < 0 keeps
//! |b21-hat| < |b22-hat|. Either an end is between the two already, or b2-hat passes from above |b22-hat| to below it, and
//! just below it is between them.
//!
//! The premises as printed, with signs at one value only, were wrong for 40 of some 700 random systems of Eq. (4-1) that P4-2 was
//! sure of, and for 40 of 400 of P4-2y; read as here, for none (`properties.rs`). P4-2 and P4-2y are not necessary: fixed
//! frequencies and other residues give zeros without any veering.
//!
//! A plant is not Eq. (4-1). Its own zeros stand beside those of the equation in every answer; where the two differ, the
//! Assumptions A4-4 and A4-5 do not hold well enough, and [`super::Remainder`] says by how much. Towards b22-hat, where zeros
//! meet between the modes, P4-1 errs at no larger margin than A4-5's ratio. Towards b21-hat they meet outside, where the
//! other modes may be anything, and no local figure bounds the error. P4-2y needs neither assumption: two zeros between two
//! poles that stay side by side, with residues that keep their signs, can only leave by meeting.

use super::conditions::{Condition, c4_1, c4_2, c4_3, c4_4, c4_4y};
use super::{Meeting, Sample, Trajectory, ZeroConfiguration};

/// What premises say of CMP-CNMP zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prediction {
    /// They appear.
    Appear,
    /// They do not.
    Absent,
    /// The proposition is silent: it is not a necessary one, and a premise fails.
    Nothing,
}

impl Prediction {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Prediction::Appear => "appear",
            Prediction::Absent => "absent",
            Prediction::Nothing => "nothing",
        }
    }

    /// Whether zeros that are there or not contradict.
    pub fn is_contradicted_by(self, quartet: bool) -> bool {
        match self {
            Prediction::Appear => !quartet,
            Prediction::Absent => quartet,
            Prediction::Nothing => false,
        }
    }
}

/// A proposition with its premises, and the zeros as computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposition {
    /// `P4-1` and so on.
    pub name: &'static str,
    /// Each with its figure.
    pub premises: Vec<Condition>,
    /// What they say.
    pub foretold: Prediction,
    /// Whether Eq. (4-1) has CMP-CNMP zeros where the proposition says so: at the value, or anywhere on the stretch.
    pub equation: bool,
    /// Whether the plant has.
    pub plant: bool,
}

/// P4-1 at one value; `None` where the modes cross.
pub fn p4_1(station: &Sample) -> Option<Proposition> {
    let modes = station.modes?;
    let premises = vec![c4_1(&modes), c4_2(&modes)];
    let foretold = if premises.iter().all(|premise| premise.holds) {
        Prediction::Appear
    } else {
        Prediction::Absent
    };
    let equation = station.equation == Some(ZeroConfiguration::Quartet);
    Some(Proposition {
        name: "P4-1",
        premises,
        foretold,
        equation,
        plant: station.plant == ZeroConfiguration::Quartet,
    })
}

/// On which side of the veering point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From the first value to it.
    Before,
    /// From it to the last value.
    After,
}

impl Side {
    /// `before` or `after`.
    pub fn name(self) -> &'static str {
        match self {
            Side::Before => "before",
            Side::After => "after",
        }
    }
}

/// One side of the veering point: the stretch of values next to it where C4-1 holds without a break.
#[derive(Clone, Debug)]
pub struct Interval<'a> {
    /// Which side.
    pub side: Side,
    meeting: Meeting,
    closest: &'a Sample,
    /// From the veering point outwards, without those where the modes cross. Empty where C4-1 fails at once.
    stations: Vec<&'a Sample>,
    /// The station next to the veering point, whether C4-1 holds or not.
    next: Option<&'a Sample>,
}

impl<'a> Interval<'a> {
    /// Of one side of a course.
    pub fn of(course: &'a Trajectory, side: Side) -> Interval<'a> {
        let outwards: Vec<&Sample> = match side {
            Side::Before => course.stations[..=course.closest].iter().rev().collect(),
            Side::After => course.stations[course.closest..].iter().collect(),
        };
        let apart: Vec<&Sample> = outwards
            .into_iter()
            .filter(|station| station.modes.is_some())
            .collect();
        let alternates = |station: &&&Sample| station.modes.is_some_and(|modes| c4_1(&modes).holds);
        let stations = apart.iter().take_while(alternates).copied().collect();
        let closest = &course.stations[course.closest];
        Interval {
            side,
            meeting: course.meeting,
            closest,
            stations,
            next: apart.first().copied(),
        }
    }

    /// The values from the veering point to the far end; `None` where C4-1 fails at the veering point.
    pub fn range(&self) -> Option<[f64; 2]> {
        self.stations
            .last()
            .map(|far| [self.closest.value, far.value])
    }

    /// P4-2, P4-2x and P4-2y on this side.
    pub fn propositions(&self) -> [Proposition; 3] {
        let (alternating, close) = (self.alternating(), self.close());
        let beyond = self.best(|station| station.modes.map(|modes| c4_4(&modes)), "C4-4");
        let dual = self.best(
            |station| station.modes.map(|modes| c4_4y(&modes, &station.zeros)),
            "C4-4y",
        );
        let holds = |premises: &[Condition]| premises.iter().all(|premise| premise.holds);
        let sufficient = |name, premises: Vec<Condition>| {
            let foretold = if holds(&premises) {
                Prediction::Appear
            } else {
                Prediction::Nothing
            };
            self.proposition(name, premises, foretold)
        };
        let necessary = match (close.holds, holds(&[alternating, beyond])) {
            (false, _) => Prediction::Nothing,
            (true, true) => Prediction::Appear,
            (true, false) => Prediction::Absent,
        };
        [
            sufficient("P4-2", vec![alternating, close, beyond]),
            self.proposition("P4-2x", vec![close, alternating, beyond], necessary),
            sufficient("P4-2y", vec![close, dual, alternating]),
        ]
    }

    fn proposition(
        &self,
        name: &'static str,
        premises: Vec<Condition>,
        foretold: Prediction,
    ) -> Proposition {
        let equation = self
            .stations
            .iter()
            .any(|station| station.equation == Some(ZeroConfiguration::Quartet));
        let plant = self
            .stations
            .iter()
            .any(|station| station.plant == ZeroConfiguration::Quartet);
        Proposition {
            name,
            premises,
            foretold,
            equation,
            plant,
        }
    }

    /// C4-1 next to the veering point, from where the stretch goes on as long as it holds.
    fn alternating(&self) -> Condition {
        let nowhere = Condition {
            name: "C4-1",
            holds: false,
            figure: 0.0,
            limits: [0.0, f64::INFINITY],
            margin: 0.0,
        };
        self.next
            .and_then(|station| station.modes)
            .map_or(nowhere, |modes| c4_1(&modes))
    }

    /// C4-3, of the station next to the veering point where that is a crossing.
    fn close(&self) -> Condition {
        c4_3(self.meeting, self.closest.modes.as_ref())
    }

    /// A condition where its margin on the stretch is largest, other than at the veering point itself.
    fn best(
        &self,
        condition: impl Fn(&Sample) -> Option<Condition>,
        name: &'static str,
    ) -> Condition {
        let nowhere = Condition {
            name,
            holds: false,
            figure: 0.0,
            limits: [0.0, f64::INFINITY],
            margin: -1.0,
        };
        let away = self
            .stations
            .iter()
            .filter(|station| station.value != self.closest.value);
        away.filter_map(|station| condition(station))
            .fold(nowhere, |best, next| {
                if (next.holds, next.margin) > (best.holds, best.margin) {
                    next
                } else {
                    best
                }
            })
    }
}
