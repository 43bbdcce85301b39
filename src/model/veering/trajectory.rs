//! Two close modes along a setting: the zeros of Eq. (4-1) and of the whole plant at each value.

use nalgebra::DVector;
use serde::Serialize;

use super::{CloseModes, Loci, Meeting, ModesAt};
use crate::model::plant::{PlantError, Structure};
use crate::model::zeros::{ModalTerm, Zero, ZeroKind, undamped_zeros};

/// Bisections between two values: a step of the grid over 2^44 is below the rounding of a value.
const BISECTIONS: usize = 44;
/// Modes with a residue below this ratio of the largest do not separate zeros from those of the two modes.
const SILENT_RATIO: f64 = 1e-9;

/// Force and sensor vector: generalised force per newton, and displacement per unit of each degree of freedom.
pub type Ports = [DVector<f64>; 2];

/// The actuator and the probe of the plant's own settings.
pub fn as_configured(at: &ModesAt) -> Ports {
    let structure = at.structure();
    [structure.force.clone(), structure.sensor.clone()]
}

/// The configuration of the zeros of the two modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum ZeroConfiguration {
    /// Two MMP pairs between wu and wv.
    #[serde(rename = "dual MMP")]
    Between,
    /// A CMP-CNMP quartet.
    #[serde(rename = "CMP-CNMP")]
    Quartet,
    /// Any other.
    #[serde(rename = "other")]
    Elsewhere,
}

impl ZeroConfiguration {
    /// `dual MMP`, `CMP-CNMP` or `other`.
    pub fn name(self) -> &'static str {
        match self {
            ZeroConfiguration::Between => "dual MMP",
            ZeroConfiguration::Quartet => "CMP-CNMP",
            ZeroConfiguration::Elsewhere => "other",
        }
    }

    fn of(modes: &CloseModes, zeros: &[Zero]) -> ZeroConfiguration {
        let (wu, wv) = (modes.u.omega_rad_s, modes.v.omega_rad_s);
        let is_between = |w: f64| wu < w && w < wv;
        let between = zeros
            .iter()
            .filter(|zero| zero.kind == ZeroKind::Mmp && is_between(zero.s.im));
        if has_quartet(zeros) {
            ZeroConfiguration::Quartet
        } else if between.count() == 2 {
            ZeroConfiguration::Between
        } else {
            ZeroConfiguration::Elsewhere
        }
    }
}

fn has_quartet(zeros: &[Zero]) -> bool {
    zeros.iter().any(|zero| zero.kind == ZeroKind::Cnmp)
}

/// One value of the setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The value of the setting.
    pub value: f64,
    /// The two modes; `None` where they cross.
    pub modes: Option<CloseModes>,
    /// Zeros of the whole plant without damping.
    pub zeros: Vec<Zero>,
    /// Configuration of the zeros of Eq. (4-1); `None` where the modes cross.
    pub equation: Option<ZeroConfiguration>,
    /// Configuration of the plant's zeros that belong to the two modes: those of a magnitude between the next slower and
    /// the next faster mode that can be observed.
    pub plant: ZeroConfiguration,
}

impl Sample {
    /// The sample of two modes at one value, between a force and a probe.
    pub fn of(
        at: &ModesAt,
        pair: [usize; 2],
        [force, sensor]: Ports,
    ) -> Result<Sample, PlantError> {
        let terms = at.terms(&force, &sensor);
        let zeros = undamped_zeros(&Structure {
            force,
            sensor,
            ..at.structure().clone()
        })?;
        let modes = match at.are_equal(pair) {
            true => None,
            false => CloseModes::of(&terms, pair),
        };
        let equation = match &modes {
            Some(modes) => Some(ZeroConfiguration::of(modes, &modes.zeros()?)),
            None => None,
        };
        let own = own_zeros(&terms, pair, &zeros);
        let plant = match &modes {
            Some(modes) => ZeroConfiguration::of(modes, &own),
            None if has_quartet(&own) => ZeroConfiguration::Quartet,
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

    fn are_opposed(&self) -> bool {
        self.modes.is_some_and(|modes| modes.are_opposed())
    }
}

/// The zeros of a magnitude between the modes next to the two.
fn own_zeros(terms: &[ModalTerm], pair: [usize; 2], zeros: &[Zero]) -> Vec<Zero> {
    let largest = terms
        .iter()
        .map(|term| term.residue_per_kg.abs())
        .fold(0.0, f64::max);
    let is_silent = |term: &ModalTerm| term.residue_per_kg.abs() <= SILENT_RATIO * largest;
    let [i, j] = pair.map(|mode| terms[mode].omega_rad_s);
    let (mut slower, mut faster) = (0.0, f64::INFINITY);
    for (mode, term) in terms.iter().enumerate() {
        let w = term.omega_rad_s;
        if pair.contains(&mode) || is_silent(term) {
            continue;
        }
        if w < i.min(j) {
            slower = f64::max(slower, w);
        } else if w > i.max(j) {
            faster = f64::min(faster, w);
        }
    }
    let is_own = |zero: &&Zero| slower < zero.s.norm() && zero.s.norm() < faster;
    zeros.iter().filter(is_own).copied().collect()
}

/// The two modes over the range.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// The behaviour of the loci where they are closest.
    pub meeting: Meeting,
    /// In the order of the range: those of the loci's path, and further ones between that resolve the ends of quartets.
    pub samples: Vec<Sample>,
    /// Index of the sample where the modes are closest.
    pub closest: usize,
}

impl Trajectory {
    /// The trajectory of two modes along the loci, which are refined where they are closest, between the force and the
    /// probe that `ports` returns at a value.
    pub fn along<E, F>(
        loci: &mut Loci<F>,
        pair: [usize; 2],
        ports: impl Fn(&ModesAt) -> Ports,
    ) -> Result<Trajectory, E>
    where
        E: From<PlantError>,
        F: FnMut(f64) -> Result<Structure, E>,
    {
        let (meeting, at) = loci.meeting(pair)?;
        let closest_value = at.value;
        let path = loci.path().iter();
        let mut samples = path
            .map(|at| Sample::of(at, pair, ports(at)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut sample_at = |value: f64| {
            let at = loci.at(value)?;
            Ok::<Sample, E>(Sample::of(at, pair, ports(at))?)
        };
        let configurations: [Configuration; 2] =
            [|sample| sample.equation, |sample| Some(sample.plant)];
        for configuration in configurations {
            refine(&mut samples, configuration, &mut sample_at)?;
        }
        let is_closest = |sample: &Sample| sample.value == closest_value;
        let closest = samples.iter().position(is_closest).unwrap_or(0);
        Ok(Trajectory {
            meeting,
            samples,
            closest,
        })
    }

    /// The bands of values with a quartet of the plant that belongs to the two modes: from the first to the last sample of
    /// each.
    pub fn bands(&self) -> Vec<[f64; 2]> {
        let is_quartet = |sample: &Sample| sample.plant == ZeroConfiguration::Quartet;
        let runs = self.samples.chunk_by(|a, b| is_quartet(a) == is_quartet(b));
        let bands = runs.filter(|run| is_quartet(&run[0]));
        bands
            .map(|run| [run[0].value, run[run.len() - 1].value])
            .collect()
    }
}

/// The configuration that is examined: of Eq. (4-1) or of the plant.
type Configuration = fn(&Sample) -> Option<ZeroConfiguration>;

/// Adds samples in all steps that hide a quartet.
fn refine<E>(
    samples: &mut Vec<Sample>,
    configuration: Configuration,
    sample_at: &mut impl FnMut(f64) -> Result<Sample, E>,
) -> Result<(), E> {
    let is_rising = samples[0].value < samples[samples.len() - 1].value;
    let mut added = Vec::new();
    for step in samples.windows(2) {
        if hides_quartet([&step[0], &step[1]], configuration) {
            let ends = [&step[0], &step[1]];
            bisect_quartet(ends, configuration, BISECTIONS, &mut added, sample_at)?;
        }
    }
    samples.append(&mut added);
    samples.sort_by(|a, b| match is_rising {
        true => a.value.total_cmp(&b.value),
        false => b.value.total_cmp(&a.value),
    });
    Ok(())
}

/// Whether a quartet begins or ends between two samples, or must appear and vanish there: zeros that leave the range
/// between the modes, with au av < 0 on both sides, can do so only by meeting.
fn hides_quartet(step: [&Sample; 2], configuration: Configuration) -> bool {
    let found = step.map(configuration);
    let is_quartet = found.map(|found| found == Some(ZeroConfiguration::Quartet));
    match is_quartet {
        [false, false] => {
            found[0] != found[1]
                && found.contains(&Some(ZeroConfiguration::Between))
                && step.iter().all(|sample| sample.are_opposed())
        }
        [first, second] => first != second,
    }
}

/// Bisects a step that hides a quartet, to both ends of the quartet's band.
fn bisect_quartet<E>(
    [low, high]: [&Sample; 2],
    configuration: Configuration,
    depth: usize,
    added: &mut Vec<Sample>,
    sample_at: &mut impl FnMut(f64) -> Result<Sample, E>,
) -> Result<(), E> {
    let value = 0.5 * (low.value + high.value);
    if depth == 0 || value == low.value || value == high.value {
        return Ok(());
    }
    let middle = sample_at(value)?;
    added.push(middle.clone());
    for half in [[low, &middle], [&middle, high]] {
        if hides_quartet(half, configuration) {
            bisect_quartet(half, configuration, depth - 1, added, sample_at)?;
        }
    }
    Ok(())
}
