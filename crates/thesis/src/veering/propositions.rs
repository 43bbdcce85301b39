//! The propositions of section 4.2.3: the prediction from their premises, compared with the computed zeros.
//!
//! | proposition | here | as printed |
//! |---|---|---|
//! | P4-1: CMP-CNMP zeros if and only if C4-1 and C4-2 | exact for Eq. (4-1) at every value. C4-1 follows from C4-2 | the same |
//! | P4-2: C4-1, C4-3, C4-4 give a value with CMP-CNMP zeros | exact for Eq. (4-1), if C4-1 holds *from psi_0 to the veering point* | no range for C4-1. With C4-1 at psi_0 alone it is wrong: where a residue changes its sign between, a zero leaves the range between the modes through a pole |
//! | P4-2x: under C4-3, CMP-CNMP zeros if and only if C4-1 and C4-4 | exact for Eq. (4-1) on the *interval* around the veering point where C4-1 holds | over the whole range "only if" needs C4-1 somewhere, "if" needs it up to the veering point: no single reading gives both |
//! | P4-2y: C4-3 and C4-4y give a value with CMP-CNMP zeros | exact for Eq. (4-1), if au and av keep their signs from psi_0 to the veering point; sufficient, not necessary | "C4-4y implies C4-1" holds at psi_0, not between: the same gap as in P4-2 |
//!
//! The proof of P4-2 in this reading: b2-hat (in the direction of av) is above |b21-hat| at psi_0 and below |b22-hat|
//! at the veering point. All three are continuous between the two, because residues and frequencies are, and
//! au av < 0 keeps |b21-hat| < |b22-hat|. Either b2-hat is between the two at one end, or it passes from above |b22-hat| to
//! below it, and just below it is between them.
//!
//! With the premises as printed (signs at one value only), predictions for random systems of Eq. (4-1) are wrong: 40
//! of about 700 by P4-2, and 40 of 400 by P4-2y. With the reading used here there are no wrong predictions
//! (`tests.rs`). P4-2 and P4-2y are not necessary: fixed frequencies and other residues give zeros without any
//! veering.
//!
//! A plant is not Eq. (4-1). Its own zeros are reported with those of the equation. Where the two differ, Assumptions
//! A4-4 and A4-5 do not hold well enough; [`super::Remainder`] quantifies by how much. Near b22-hat, where zeros meet
//! between the modes, P4-1 errs only at margins up to the ratio of A4-5. Near b21-hat they meet outside, where the
//! other modes are arbitrary, and no local quantity bounds the error. P4-2y needs neither assumption: two zeros
//! between two neighbouring poles whose residues keep their signs can leave only by meeting.

use serde::Serialize;

use super::conditions::{Condition, c4_1, c4_2, c4_3, c4_4, c4_4y};
use super::{Meeting, Sample, Trajectory, ZeroConfiguration};

/// The prediction of premises for CMP-CNMP zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Prediction {
    /// They appear.
    Appear,
    /// They do not.
    Absent,
    /// The proposition makes no statement: it is not a necessary one, and a premise fails.
    Nothing,
}

impl Prediction {
    /// Name of the prediction in JSON and text.
    pub fn name(self) -> &'static str {
        match self {
            Prediction::Appear => "appear",
            Prediction::Absent => "absent",
            Prediction::Nothing => "nothing",
        }
    }

    /// Whether the presence or absence of a quartet contradicts the prediction.
    pub fn is_contradicted_by(self, quartet: bool) -> bool {
        match self {
            Prediction::Appear => !quartet,
            Prediction::Absent => quartet,
            Prediction::Nothing => false,
        }
    }
}

/// A proposition with its premises, and the computed zeros.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proposition {
    /// `P4-1` and so on.
    pub name: &'static str,
    /// The premises with their figures.
    pub premises: Vec<Condition>,
    /// The prediction of the premises.
    pub predicted: Prediction,
    /// Whether Eq. (4-1) has CMP-CNMP zeros where the proposition applies: at the value, or anywhere on the interval.
    pub equation: bool,
    /// Whether the plant has.
    pub plant: bool,
    /// Whether the zeros of Eq. (4-1) agree with the prediction.
    pub agrees_with_equation: bool,
    /// Whether the zeros of the plant agree with it.
    pub agrees_with_plant: bool,
}

impl Proposition {
    fn new(
        name: &'static str,
        premises: Vec<Condition>,
        predicted: Prediction,
        samples: &[&Sample],
    ) -> Proposition {
        let quartet = Some(ZeroConfiguration::Quartet);
        let equation = samples.iter().any(|sample| sample.equation == quartet);
        let plant = samples.iter().any(|sample| Some(sample.plant) == quartet);
        Proposition {
            name,
            premises,
            predicted,
            equation,
            plant,
            agrees_with_equation: !predicted.is_contradicted_by(equation),
            agrees_with_plant: !predicted.is_contradicted_by(plant),
        }
    }
}

fn all_hold(premises: &[Condition]) -> bool {
    premises.iter().all(|premise| premise.holds)
}

/// P4-1 at one value; `None` where the modes cross.
pub fn p4_1(sample: &Sample) -> Option<Proposition> {
    let modes = sample.modes?;
    let premises = vec![c4_1(&modes), c4_2(&modes)];
    let predicted = if all_hold(&premises) {
        Prediction::Appear
    } else {
        Prediction::Absent
    };
    Some(Proposition::new("P4-1", premises, predicted, &[sample]))
}

/// A side of the veering point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
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

/// One side of the veering point: the interval of values next to it where C4-1 holds throughout.
#[derive(Clone, Debug)]
pub struct Interval<'a> {
    /// The side.
    pub side: Side,
    meeting: Meeting,
    closest: &'a Sample,
    /// From the veering point outwards, without those where the modes cross. Empty where C4-1 fails at once.
    samples: Vec<&'a Sample>,
    /// The sample next to the veering point, whether C4-1 holds or not.
    next: Option<&'a Sample>,
}

impl<'a> Interval<'a> {
    /// The interval on one side of a trajectory's veering point.
    pub fn of(trajectory: &'a Trajectory, side: Side) -> Interval<'a> {
        let (samples, closest) = (&trajectory.samples, trajectory.closest);
        let mut apart: Vec<&Sample> = match side {
            Side::Before => samples[..=closest].iter().rev().collect(),
            Side::After => samples[closest..].iter().collect(),
        };
        apart.retain(|sample| sample.modes.is_some());
        let next = apart.first().copied();
        let alternating = apart.into_iter().take_while(|sample| alternates(sample));
        Interval {
            side,
            meeting: trajectory.meeting,
            closest: &samples[closest],
            samples: alternating.collect(),
            next,
        }
    }

    /// The values from the veering point to the far end; `None` where C4-1 fails at the veering point.
    pub fn range(&self) -> Option<[f64; 2]> {
        let far = self.samples.last()?;
        Some([self.closest.value, far.value])
    }

    /// P4-2, P4-2x and P4-2y on this side.
    pub fn propositions(&self) -> [Proposition; 3] {
        let (alternating, close) = (self.condition_c4_1(), self.condition_c4_3());
        let beyond = self.best("C4-4", |sample| Some(c4_4(&sample.modes?)));
        let dual = self.best("C4-4y", |sample| Some(c4_4y(&sample.modes?, &sample.zeros)));
        [
            self.sufficient("P4-2", vec![alternating, close, beyond]),
            self.necessary("P4-2x", close, [alternating, beyond]),
            self.sufficient("P4-2y", vec![close, dual, alternating]),
        ]
    }

    /// A proposition that, under a condition, holds if and only if two others hold.
    fn necessary(
        &self,
        name: &'static str,
        under: Condition,
        [first, second]: [Condition; 2],
    ) -> Proposition {
        let predicted = match (under.holds, first.holds && second.holds) {
            (false, _) => Prediction::Nothing,
            (true, true) => Prediction::Appear,
            (true, false) => Prediction::Absent,
        };
        Proposition::new(name, vec![under, first, second], predicted, &self.samples)
    }

    fn sufficient(&self, name: &'static str, premises: Vec<Condition>) -> Proposition {
        let predicted = if all_hold(&premises) {
            Prediction::Appear
        } else {
            Prediction::Nothing
        };
        Proposition::new(name, premises, predicted, &self.samples)
    }

    /// C4-1 next to the veering point, where the interval begins.
    fn condition_c4_1(&self) -> Condition {
        let modes = self.next.and_then(|sample| sample.modes);
        modes.map_or(failed("C4-1", 0.0), |modes| c4_1(&modes))
    }

    /// C4-3 at the veering point.
    fn condition_c4_3(&self) -> Condition {
        c4_3(self.meeting, self.closest.modes.as_ref())
    }

    /// A condition where its margin on the interval is largest, the veering point itself excluded.
    fn best(
        &self,
        name: &'static str,
        condition: impl Fn(&Sample) -> Option<Condition>,
    ) -> Condition {
        let samples = self.samples.iter();
        let away = samples.filter(|sample| sample.value != self.closest.value);
        let conditions = away.filter_map(|sample| condition(sample));
        conditions.fold(failed(name, -1.0), |best, next| {
            let is_better = (next.holds, next.margin) > (best.holds, best.margin);
            if is_better { next } else { best }
        })
    }
}

fn alternates(sample: &Sample) -> bool {
    sample.modes.is_some_and(|modes| c4_1(&modes).holds)
}

/// A condition that holds nowhere.
fn failed(name: &'static str, margin: f64) -> Condition {
    Condition {
        name,
        holds: false,
        figure: 0.0,
        limits: [0.0, f64::INFINITY],
        margin,
    }
}
