//! Two close modes over a setting as reported: veering point, shapes, conditions and propositions.

use serde::Serialize;

use super::conditions::{Condition, c4_1, c4_2};
use super::propositions::{Interval, Prediction, Proposition, Side, p4_1};
use super::remedies::remedies;
use super::{Meeting, ModesAt, Sample, Trajectory, ZeroConfiguration};
use bench_base::units::hz;

/// The veering point of two modes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VeeringPoint {
    /// Mode numbers, counted from 1 in order of frequency at the first value of the setting.
    pub modes: [usize; 2],
    /// The behaviour of the two where they are closest.
    pub meeting: Meeting,
    /// The value of the setting there.
    pub value: f64,
    /// Mean frequency there.
    pub frequency_hz: f64,
    /// Difference of the frequencies there.
    pub gap_hz: f64,
}

impl VeeringPoint {
    /// The veering point of a pair of modes, from 0.
    pub fn new(pair: [usize; 2], meeting: Meeting, at: &ModesAt) -> VeeringPoint {
        VeeringPoint {
            modes: pair.map(|mode| mode + 1),
            meeting,
            value: at.value,
            frequency_hz: hz(at.mean_rad_s(pair)),
            gap_hz: hz(at.gap_rad_s(pair)),
        }
    }
}

/// Shares of the coordinates in the shapes of the two modes: squares of the elements at unit length.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shares {
    /// The value of the setting.
    pub value: f64,
    /// One list for each of the two modes.
    pub shares: [Vec<f64>; 2],
}

impl Shares {
    fn of(at: &ModesAt, pair: [usize; 2]) -> Shares {
        Shares {
            value: at.value,
            shares: pair.map(|mode| at.shares(mode)),
        }
    }
}

/// Frequencies and shapes over a setting, and at the veering point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VeeringReport {
    /// The veering point.
    #[serde(flatten)]
    pub point: VeeringPoint,
    /// MAC of each of the two at the first value (rows) with each at the last (columns).
    pub mac_across: [[f64; 2]; 2],
    /// MAC of each at the first value (rows) with each at the closest point (columns): one half each in a veering.
    pub mac_to_closest: [[f64; 2]; 2],
    /// Shapes at the first value.
    pub before: Shares,
    /// Shapes at the veering point.
    pub closest: Shares,
    /// Shapes at the last value.
    pub after: Shares,
    /// The values of the grid.
    pub values: Vec<f64>,
    /// One list for each mode.
    pub frequencies_hz: Vec<Vec<f64>>,
}

impl VeeringReport {
    /// The report of two modes, from 0, with the modes at the values of the grid.
    pub fn of(
        grid: &[&ModesAt],
        pair: [usize; 2],
        meeting: Meeting,
        closest: &ModesAt,
    ) -> VeeringReport {
        let (first, last) = (grid[0], grid[grid.len() - 1]);
        let mac = |to: &ModesAt| pair.map(|i| pair.map(|j| first.mac(i, to, j)));
        let frequencies = |mode: usize| grid.iter().map(|at| hz(at.omega_rad_s[mode])).collect();
        VeeringReport {
            point: VeeringPoint::new(pair, meeting, closest),
            mac_across: mac(last),
            mac_to_closest: mac(closest),
            before: Shares::of(first, pair),
            closest: Shares::of(closest, pair),
            after: Shares::of(last, pair),
            values: grid.iter().map(|at| at.value).collect(),
            frequencies_hz: (0..first.omega_rad_s.len()).map(frequencies).collect(),
        }
    }
}

/// Validity of the assumptions at the value that is explained.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Assumptions {
    /// A4-2: the larger damping ratio of the two modes.
    pub damping_ratio: f64,
    /// A4-2: that ratio over half the relative distance of the two frequencies.
    pub damping_over_half_gap: Option<f64>,
    /// A4-4: number of mode R, from 1.
    pub mode_r: Option<usize>,
    /// A4-4: the other modes over mode R.
    pub others_ratio: Option<f64>,
    /// A4-4: frequency of mode R over that of the nearer of the two, or the reverse.
    pub nearness_ratio: Option<f64>,
    /// A4-5: the largest deviation from a double integrator between the two modes.
    pub integrator_ratio: Option<f64>,
}

impl Assumptions {
    fn of(at: &ModesAt, pair: [usize; 2], here: &Sample) -> Assumptions {
        let [first, second] = pair.map(|mode| at.damping_ratio(mode));
        let damping_ratio = first.max(second).max(0.0);
        let over_half_gap = damping_ratio / at.relative_gap(pair);
        let remainder = here.modes.map(|modes| modes.remainder);
        Assumptions {
            damping_ratio,
            damping_over_half_gap: Some(over_half_gap).filter(|ratio| ratio.is_finite()),
            mode_r: remainder.and_then(|rest| rest.mode).map(|mode| mode + 1),
            others_ratio: remainder.map(|rest| rest.others_ratio),
            nearness_ratio: remainder.map(|rest| rest.nearness_ratio),
            integrator_ratio: remainder.map(|rest| rest.integrator_ratio),
        }
    }
}

/// Eq. (4-1) and the zeros at one value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionRow {
    /// The value of the setting.
    pub value: f64,
    /// Frequency of mode u.
    pub u_hz: f64,
    /// Frequency of mode v.
    pub v_hz: f64,
    /// aR in 1/kg.
    pub residue_r_per_kg: f64,
    /// au in 1/kg.
    pub residue_u_per_kg: f64,
    /// av in 1/kg.
    pub residue_v_per_kg: f64,
    /// Condition C4-1.
    pub c4_1: Condition,
    /// Condition C4-2.
    pub c4_2: Condition,
    /// Configuration of the zeros of Eq. (4-1).
    pub equation: ZeroConfiguration,
    /// Configuration of the plant's zeros.
    pub plant: ZeroConfiguration,
}

impl ConditionRow {
    fn of(sample: &Sample) -> Option<ConditionRow> {
        let modes = sample.modes?;
        let [residue_r_per_kg, residue_u_per_kg, residue_v_per_kg] = modes.residues_per_kg();
        Some(ConditionRow {
            value: sample.value,
            u_hz: hz(modes.u.omega_rad_s),
            v_hz: hz(modes.v.omega_rad_s),
            residue_r_per_kg,
            residue_u_per_kg,
            residue_v_per_kg,
            c4_1: c4_1(&modes),
            c4_2: c4_2(&modes),
            equation: sample.equation?,
            plant: sample.plant,
        })
    }
}

/// P4-1 at one value, with remedies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// The value of the setting.
    pub value: f64,
    /// Eq. (4-1) and the zeros there.
    pub row: ConditionRow,
    /// P4-1 there.
    pub proposition: Proposition,
    /// How to break or fulfil each condition.
    pub remedies: Vec<String>,
}

impl Explanation {
    fn of(sample: &Sample) -> Option<Explanation> {
        Some(Explanation {
            value: sample.value,
            row: ConditionRow::of(sample)?,
            proposition: p4_1(sample)?,
            remedies: remedies(&sample.modes?),
        })
    }
}

/// Predictions of P4-1 over the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PredictionTally {
    /// Values of the grid where the modes do not cross.
    pub values: usize,
    /// Values where CMP-CNMP zeros are predicted.
    pub appear: usize,
    /// Predictions that the zeros of Eq. (4-1) contradict.
    pub wrong_by_equation: usize,
    /// Predictions that the zeros of the plant contradict.
    pub wrong_by_plant: usize,
}

impl PredictionTally {
    fn of<'a>(samples: impl Iterator<Item = &'a Sample>) -> PredictionTally {
        let mut tally = PredictionTally::default();
        for proposition in samples.filter_map(p4_1) {
            tally.values += 1;
            tally.appear += usize::from(proposition.predicted == Prediction::Appear);
            tally.wrong_by_equation += usize::from(!proposition.agrees_with_equation);
            tally.wrong_by_plant += usize::from(!proposition.agrees_with_plant);
        }
        tally
    }
}

/// One side of the veering point with its propositions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SideReport {
    /// The side.
    pub side: Side,
    /// The interval in which C4-1 holds, from the veering point to the far end; `null` where C4-1 fails at once.
    pub interval: Option<[f64; 2]>,
    /// P4-2, P4-2x and P4-2y.
    pub propositions: [Proposition; 3],
}

impl SideReport {
    fn of(trajectory: &Trajectory, side: Side) -> SideReport {
        let interval = Interval::of(trajectory, side);
        SideReport {
            side,
            interval: interval.range(),
            propositions: interval.propositions(),
        }
    }
}

/// Conditions and propositions for two close modes over a setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionsReport {
    /// The veering point.
    #[serde(flatten)]
    pub point: VeeringPoint,
    /// Bands of values with CNMP zeros of the plant that belong to the two modes, from and to.
    pub cnmp_bands: Vec<[f64; 2]>,
    /// Validity of the assumptions at the value that is explained.
    pub assumptions: Assumptions,
    /// P4-1 at that value; `null` where the modes cross.
    pub here: Option<Explanation>,
    /// Both sides of the veering point.
    pub sides: [SideReport; 2],
    /// Predictions of P4-1 over the grid.
    pub p4_1: PredictionTally,
    /// One row for each value of the grid, without those where the modes cross.
    pub rows: Vec<ConditionRow>,
}

impl ConditionsReport {
    /// The report of a trajectory, with the modes at its veering point, and at the value to explain with their sample.
    pub fn of(
        trajectory: &Trajectory,
        pair: [usize; 2],
        closest: &ModesAt,
        (at, here): (&ModesAt, &Sample),
        grid: &[f64],
    ) -> ConditionsReport {
        let samples = trajectory.samples.iter();
        let on_grid = samples.filter(|sample| grid.contains(&sample.value));
        ConditionsReport {
            point: VeeringPoint::new(pair, trajectory.meeting, closest),
            cnmp_bands: trajectory.bands(),
            assumptions: Assumptions::of(at, pair, here),
            here: Explanation::of(here),
            sides: [Side::Before, Side::After].map(|side| SideReport::of(trajectory, side)),
            p4_1: PredictionTally::of(on_grid.clone()),
            rows: on_grid.filter_map(ConditionRow::of).collect(),
        }
    }
}
