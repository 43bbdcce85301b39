//! Two close modes along a setting: the zeros of Eq. (4-1) and of the whole plant at each value.

use nalgebra::DVector;
use serde::Serialize;

use super::{CloseModes, Loci, Meeting, ModesAt};
use bench_plant::zeros::{ModalTerm, Zero, ZeroKind, undamped_zeros};
use bench_plant::{PlantError, Structure};

/// Bisections between two values: a step of the grid over 2^44 is below the rounding of a value.
const BISECTIONS: usize = 44;
/// Modes with a residue below this ratio of the largest do not separate zeros from those of the two modes.
const UNOBSERVED_RATIO: f64 = 1e-9;

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

    /// The configuration of the zeros of two modes; `None` where the modes cross.
    fn of(modes: Option<&CloseModes>, zeros: &[Zero]) -> ZeroConfiguration {
        let [wu, wv] = modes.map_or([0.0; 2], |modes| [modes.u.omega_rad_s, modes.v.omega_rad_s]);
        let is_between =
            |zero: &&Zero| zero.kind == ZeroKind::Mmp && wu < zero.s.im && zero.s.im < wv;
        if zeros.iter().any(|zero| zero.kind == ZeroKind::Cnmp) {
            ZeroConfiguration::Quartet
        } else if zeros.iter().filter(is_between).count() == 2 {
            ZeroConfiguration::Between
        } else {
            ZeroConfiguration::Elsewhere
        }
    }
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
        let modes = at.close_modes(&terms, pair);
        let own = own_zeros(&terms, pair, &zeros);
        let equation = modes.map(|modes| {
            let zeros = modes.zeros()?;
            Ok::<_, PlantError>(ZeroConfiguration::of(Some(&modes), &zeros))
        });
        Ok(Sample {
            value: at.value,
            modes,
            plant: ZeroConfiguration::of(modes.as_ref(), &own),
            equation: equation.transpose()?,
            zeros,
        })
    }

    fn are_opposed(&self) -> bool {
        self.modes.is_some_and(|modes| modes.are_opposed())
    }
}

/// The other modes that can be observed.
fn observed_beside(terms: &[ModalTerm], pair: [usize; 2]) -> impl Iterator<Item = &ModalTerm> {
    let sizes = terms.iter().map(|term| term.residue_per_kg.abs());
    let least = UNOBSERVED_RATIO * sizes.fold(0.0, f64::max);
    let others = terms.iter().enumerate();
    let others = others.filter(move |(mode, _)| !pair.contains(mode));
    others
        .map(|(_, term)| term)
        .filter(move |term| term.residue_per_kg.abs() > least)
}

/// The zeros of a magnitude between the modes next to the two.
fn own_zeros(terms: &[ModalTerm], pair: [usize; 2], zeros: &[Zero]) -> Vec<Zero> {
    let [i, j] = pair.map(|mode| terms[mode].omega_rad_s);
    let others = || observed_beside(terms, pair).map(|term| term.omega_rad_s);
    let slower = others().filter(|w| *w < i.min(j)).fold(0.0, f64::max);
    let faster = others()
        .filter(|w| *w > i.max(j))
        .fold(f64::INFINITY, f64::min);
    let is_own = |zero: &&Zero| slower < zero.s.norm() && zero.s.norm() < faster;
    zeros.iter().filter(is_own).copied().collect()
}

/// The two modes over the range.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// The behaviour of the loci where they are closest.
    pub meeting: Meeting,
    /// Samples in the order of the range: those of the path of the loci, and further ones between them that resolve
    /// the ends of quartets.
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
        let (meeting, closest) = loci.meeting(pair)?;
        let sample = |at: &ModesAt| Sample::of(at, pair, ports(at));
        let path = loci.path().iter();
        let mut samples = path.map(sample).collect::<Result<Vec<_>, _>>()?;
        let mut sample_at = |value: f64| Ok::<Sample, E>(sample(loci.at(value)?)?);
        refine(&mut samples, |sample| sample.equation, &mut sample_at)?;
        refine(&mut samples, |sample| Some(sample.plant), &mut sample_at)?;
        let closest = samples.iter().position(|one| one.value == closest.value);
        Ok(Trajectory {
            meeting,
            samples,
            closest: closest.unwrap_or(0),
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
    let is_falling = samples[0].value > samples[samples.len() - 1].value;
    let mut added = Vec::new();
    for step in samples.windows(2) {
        let ends = [&step[0], &step[1]];
        if hides_quartet(ends, configuration) {
            bisect_quartet(ends, configuration, BISECTIONS, &mut added, sample_at)?;
        }
    }
    samples.append(&mut added);
    samples.sort_by(|a, b| a.value.total_cmp(&b.value));
    if is_falling {
        samples.reverse();
    }
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
