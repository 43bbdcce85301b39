//! Two close modes along a setting: what Eq. (4-1) and the whole plant have of zeros at each value.

use nalgebra::DVector;

use super::{CloseModes, Loci, Meeting, ModesAt};
use crate::model::plant::{PlantError, Structure};
use crate::model::zeros::{ModalTerm, Zero, ZeroKind, undamped_zeros};

/// Bisections between two values: a step of the grid over 2^44 is below the rounding of a value.
const BISECTIONS: usize = 44;
/// Modes with a residue below this ratio of the largest do not part zeros from those of the two modes.
const SILENT_RATIO: f64 = 1e-9;

/// The actuator and the probe of the plant's own settings: generalised force per newton, and displacement per unit of each
/// degree of freedom.
pub fn as_configured(at: &ModesAt) -> [DVector<f64>; 2] {
    [at.structure().force.clone(), at.structure().sensor.clone()]
}

/// How the zeros of the two modes lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZeroConfiguration {
    /// Two MMP pairs between wu and wv.
    Between,
    /// A CMP-CNMP quartet.
    Quartet,
    /// Any other way.
    Elsewhere,
}

/// One value of the setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The setting.
    pub value: f64,
    /// The two modes; `None` where they cross.
    pub modes: Option<CloseModes>,
    /// Zeros of the whole plant without damping.
    pub zeros: Vec<Zero>,
    /// How the zeros of Eq. (4-1) lie; `None` where the modes cross.
    pub equation: Option<ZeroConfiguration>,
    /// How the plant's zeros lie that belong to the two modes: those of a magnitude between the next slower and the next
    /// faster mode that shows.
    pub plant: ZeroConfiguration,
}

/// The two modes over the range.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// What the loci do where they are closest.
    pub meeting: Meeting,
    /// In the order of the range; those of the loci's path, and what it takes between to see quartets that come and go.
    pub stations: Vec<Sample>,
    /// The station where the modes are closest.
    pub closest: usize,
}

impl Trajectory {
    /// The course of two modes along the loci, which are refined where they are closest, between the force and the probe
    /// that `ports` gives at a value.
    pub fn along<E, F>(
        loci: &mut Loci<F>,
        pair: [usize; 2],
        ports: impl Fn(&ModesAt) -> [DVector<f64>; 2],
    ) -> Result<Trajectory, E>
    where
        E: From<PlantError>,
        F: FnMut(f64) -> Result<Structure, E>,
    {
        let (meeting, at) = loci.meeting(pair)?;
        let closest_value = at.value;
        let mut stations = loci
            .path()
            .iter()
            .map(|at| station(at, pair, ports(at)))
            .collect::<Result<Vec<_>, _>>()?;
        let rising = stations[0].value < stations[stations.len() - 1].value;
        let lies: [Lies; 2] = [|station| station.equation, |station| Some(station.plant)];
        for lie in lies {
            let steps: Vec<[Sample; 2]> = stations
                .windows(2)
                .map(|step| [step[0].clone(), step[1].clone()])
                .collect();
            for step in steps.iter().filter(|step| hides(step, lie)) {
                fill(step, lie, BISECTIONS, &mut stations, &mut |value| {
                    let at = loci.at(value)?;
                    station(at, pair, ports(at)).map_err(E::from)
                })?;
            }
            stations.sort_by(|a, b| {
                if rising {
                    a.value.total_cmp(&b.value)
                } else {
                    b.value.total_cmp(&a.value)
                }
            });
        }
        let closest = stations
            .iter()
            .position(|station| station.value == closest_value)
            .unwrap_or(0);
        Ok(Trajectory {
            meeting,
            stations,
            closest,
        })
    }

    /// The bands of values with a quartet of the plant that belongs to the two modes: from the first to the last station of
    /// each.
    pub fn bands(&self) -> Vec<[f64; 2]> {
        let quartet = |station: &Sample| station.plant == ZeroConfiguration::Quartet;
        let runs = self
            .stations
            .chunk_by(|a, b| quartet(a) == quartet(b))
            .filter(|run| quartet(&run[0]));
        runs.map(|run| [run[0].value, run[run.len() - 1].value])
            .collect()
    }
}

/// The station of two modes at one value, between a force and a probe.
pub fn station(
    at: &ModesAt,
    pair: [usize; 2],
    [force, sensor]: [DVector<f64>; 2],
) -> Result<Sample, PlantError> {
    let terms = at.terms(&force, &sensor);
    let zeros = undamped_zeros(&Structure {
        force,
        sensor,
        ..at.structure().clone()
    })?;
    let modes = if at.are_equal(pair) {
        None
    } else {
        CloseModes::of(&terms, pair)
    };
    let equation = modes
        .map(|modes| Ok::<_, PlantError>(lie(&modes, modes.zeros()?.iter())))
        .transpose()?;
    let belonging = belonging(&terms, pair, &zeros);
    let plant = match &modes {
        Some(modes) => lie(modes, belonging.into_iter()),
        None if belonging.iter().any(|zero| zero.kind == ZeroKind::Cnmp) => {
            ZeroConfiguration::Quartet
        }
        None => ZeroConfiguration::Elsewhere,
    };
    Ok(Sample {
        value: at.value,
        modes,
        zeros,
        equation,
        plant,
    })
}

fn lie<'a>(modes: &CloseModes, zeros: impl Iterator<Item = &'a Zero> + Clone) -> ZeroConfiguration {
    let between = |w: f64| modes.u.omega_rad_s < w && w < modes.v.omega_rad_s;
    if zeros.clone().any(|zero| zero.kind == ZeroKind::Cnmp) {
        ZeroConfiguration::Quartet
    } else if zeros
        .filter(|zero| zero.kind == ZeroKind::Mmp && between(zero.s.im))
        .count()
        == 2
    {
        ZeroConfiguration::Between
    } else {
        ZeroConfiguration::Elsewhere
    }
}

/// The zeros whose magnitude is between the modes next to the two.
fn belonging<'a>(terms: &[ModalTerm], pair: [usize; 2], zeros: &'a [Zero]) -> Vec<&'a Zero> {
    let largest = terms
        .iter()
        .map(|term| term.residue_per_kg.abs())
        .fold(0.0, f64::max);
    let shows = |(mode, term): &(usize, &ModalTerm)| {
        !pair.contains(mode) && term.residue_per_kg.abs() > SILENT_RATIO * largest
    };
    let [i, j] = pair.map(|mode| terms[mode].omega_rad_s);
    let others = || {
        terms
            .iter()
            .enumerate()
            .filter(shows)
            .map(|(_, term)| term.omega_rad_s)
    };
    let slower = others().filter(|w| *w < i.min(j)).fold(0.0, f64::max);
    let faster = others()
        .filter(|w| *w > i.max(j))
        .fold(f64::INFINITY, f64::min);
    zeros
        .iter()
        .filter(|zero| slower < zero.s.norm() && zero.s.norm() < faster)
        .collect()
}

/// Which zeros are looked at.
type Lies = fn(&Sample) -> Option<ZeroConfiguration>;

/// Whether between two stations a quartet begins or ends, or must have come and gone: from two zeros between the modes to
/// none, with au av < 0 on both sides, they do not come but by meeting.
fn hides(step: &[Sample; 2], lie: Lies) -> bool {
    let lies = [lie(&step[0]), lie(&step[1])];
    let opposed = |station: &Sample| station.modes.is_some_and(|modes| modes.are_opposed());
    match lies
        .iter()
        .filter(|lie| **lie == Some(ZeroConfiguration::Quartet))
        .count()
    {
        0 => {
            lies[0] != lies[1]
                && lies.contains(&Some(ZeroConfiguration::Between))
                && step.iter().all(opposed)
        }
        count => count == 1,
    }
}

/// Bisects a step for what it hides, to both ends of a quartet's band.
fn fill<E>(
    step: &[Sample; 2],
    lie: Lies,
    depth: usize,
    found: &mut Vec<Sample>,
    at: &mut impl FnMut(f64) -> Result<Sample, E>,
) -> Result<(), E> {
    let [low, high] = step;
    let value = 0.5 * (low.value + high.value);
    if depth == 0 || value == low.value || value == high.value {
        return Ok(());
    }
    let middle = at(value)?;
    found.push(middle.clone());
    for half in [[low.clone(), middle.clone()], [middle, high.clone()]] {
        if hides(&half, lie) {
            fill(&half, lie, depth - 1, found, at)?;
        }
    }
    Ok(())
}
