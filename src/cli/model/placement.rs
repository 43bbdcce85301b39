//! `bench model placement`: the quadrants of section 4.2.4, and where to put actuator and probe.

use std::path::{Path, PathBuf};

use nalgebra::DVector;
use serde::Serialize;

use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::conditions::{meeting_pair, veers};
use super::placement_text::text;
use super::sweep::Sweep;
use crate::model::plant::{PlantError, Port, PortWeights, Structure};
use crate::model::veering::{Loci, ModesAt, QuadrantDiagram, Trial, trial};
use crate::report::{QuadrantPanel, quadrants_svg};

/// Placements with less than this of the present aR are not recommended: what is to be controlled hardly shows there.
pub(super) const LEAST_REMAINDER: f64 = 0.1;

/// What varies, and which placements are tried.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// The setting that varies: any number
    #[arg(long, value_name = "KEY", default_value = "plant.operating_point_m", requires_all = ["from", "to"])]
    vary: String,
    /// First value; 3.8mm for a length, 8% for a ratio or of the beam length
    #[arg(
        long,
        value_name = "A",
        default_value = "0.5%",
        allow_hyphen_values = true
    )]
    from: String,
    /// Last value; the veering point has to be between
    #[arg(
        long,
        value_name = "B",
        default_value = "15%",
        allow_hyphen_values = true
    )]
    to: String,
    /// Values at which each placement is tried
    #[arg(long, value_name = "N", default_value_t = 41, value_parser = clap::value_parser!(u32).range(2..=1_000))]
    count: u32,
    /// The two modes, slowest first at the first value [default: the pair that comes closest]
    #[arg(long, value_name = "I,J", value_delimiter = ',')]
    modes: Vec<usize>,
    /// Where the actuator is: a stage or node, or weights as in u=0.117,b=0.56 [default: as configured]
    #[arg(long, value_name = "PLACE")]
    actuator: Option<String>,
    /// Where the probe is, likewise
    #[arg(long, value_name = "PLACE")]
    sensor: Option<String>,
    /// Draw the quadrants before, at and after the veering point to this file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// All that the command says.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub profile: String,
    pub vary: String,
    /// From 1, slowest first at the first value.
    pub modes: [usize; 2],
    pub meeting: &'static str,
    pub value: f64,
    /// Before, at and after the veering point.
    pub pictures: Vec<PictureJson>,
    pub here: Option<TrialJson>,
    /// The best of all, the best with the actuator as it is, the best with the probe as it is.
    pub recommended: Option<TrialJson>,
    pub best_sensor: Option<TrialJson>,
    pub best_actuator: Option<TrialJson>,
    /// All pairs of places, best first; those without any response are left out.
    pub trials: Vec<TrialJson>,
    pub silent: usize,
    /// Those whose zeros do not converge: nearly all at infinity, as a force in Y and a probe in X have them.
    pub not_computed: usize,
    pub svg: Option<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct PictureJson {
    pub value: f64,
    /// How far phi_u has turned from where it is at the veering point.
    pub turn_deg: f64,
    /// Components along phi_u and phi_v, parts of the vector's length.
    pub actuator: [f64; 2],
    pub sensor: [f64; 2],
    /// 1 to 4; `null` on the line between two.
    pub actuator_quadrant: Option<usize>,
    pub sensor_quadrant: Option<usize>,
    /// In which the probe would make the signs alternate.
    pub avoid_quadrant: Option<usize>,
    /// Whether the probe's octant is across the planes of R, u, v from the actuator's.
    pub across: Option<[bool; 3]>,
    pub residues_per_kg: Option<[f64; 3]>,
    /// Of R, u, v.
    pub signs: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct TrialJson {
    pub actuator: String,
    pub sensor: String,
    pub values: usize,
    pub with_cnmp: usize,
    pub with_any_cnmp: usize,
    pub alternating: usize,
    pub c4_1_margin: f64,
    pub picture_alternates: bool,
    pub differs: bool,
    pub remainder_per_kg: f64,
}

/// The modes at each value, with the places there.
struct Tried<'a> {
    path: Vec<&'a ModesAt>,
    ports: Vec<Vec<Port>>,
    closest: usize,
    pair: [usize; 2],
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    let sweep = Sweep {
        bench: &args.bench,
        vary: &args.vary,
        from: &args.from,
        to: &args.to,
        count: args.count,
    };
    let values = sweep.values()?;
    let places = places(&sweep, values[0])?;
    let weights =
        [("--actuator", &args.actuator), ("--sensor", &args.sensor)].map(|(option, text)| {
            text.as_ref()
                .map(|text| {
                    PortWeights::parse(text, &places)
                        .map_err(|why| CliError::Usage(format!("{option} {why}")))
                        .map(|weights| (text.clone(), weights))
                })
                .transpose()
        });
    let [actuator, sensor] = weights;
    let chosen = [actuator?, sensor?];
    let mut loci = Loci::follow(&values, |value| sweep.at(value))?;
    let pair = meeting_pair(&args.modes, &loci)?;
    let (meeting, closest) = loci.meeting(pair)?;
    veers(meeting, closest.value, pair)?;
    let (path, place) = with_closest(&loci, &values, &closest);
    let ports = path
        .iter()
        .map(|at| places_at(&sweep, at.value))
        .collect::<Result<Vec<_>, _>>()?;
    let tried = Tried {
        path,
        ports,
        closest: place,
        pair,
    };
    let report = report(args, &tried, &chosen, meeting.name())?;
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&text(&report))
    }
}

/// The modes at the values of the grid and at the veering point, and the place of that one among them.
fn with_closest<'a, F: FnMut(f64) -> Result<Structure, CliError>>(
    loci: &'a Loci<F>,
    values: &[f64],
    closest: &'a ModesAt,
) -> (Vec<&'a ModesAt>, usize) {
    let mut path: Vec<&ModesAt> = values.iter().map(|value| loci.near(*value)).collect();
    let rising = values[0] < values[values.len() - 1];
    let before = |at: &&ModesAt| {
        if rising {
            at.value < closest.value
        } else {
            at.value > closest.value
        }
    };
    let place = path.partition_point(before);
    if path.get(place).is_none_or(|at| at.value != closest.value) {
        path.insert(place, closest);
    }
    (path, place)
}

/// The places of the plant; a plant given by its modes has none.
fn places(sweep: &Sweep, value: f64) -> Result<Vec<Port>, CliError> {
    let ports = places_at(sweep, value)?;
    match ports.is_empty() {
        true => Err(CliError::Usage(
            "a plant given by its modes has no places for an actuator or a probe; describe it as masses and springs (plant.model = \"lumped\")".into(),
        )),
        false => Ok(ports),
    }
}

fn places_at(sweep: &Sweep, value: f64) -> Result<Vec<Port>, CliError> {
    Ok(crate::model::plant::ports(&sweep.config(value)?.plant))
}

/// What was typed, and what it means.
type Chosen = Option<(String, PortWeights)>;

/// What came of the placements.
#[derive(Default)]
struct Tries {
    done: Vec<(Trial, TrialJson)>,
    silent: usize,
    not_computed: usize,
}

impl Tries {
    fn add(
        &mut self,
        actuator: &str,
        sensor: &str,
        trial: Result<Option<Trial>, PlantError>,
    ) -> Result<(), PlantError> {
        match trial {
            Ok(Some(trial)) => self.done.push((trial, json(actuator, sensor, &trial))),
            Ok(None) => self.silent += 1,
            Err(PlantError::NoConvergence { .. }) => self.not_computed += 1,
            Err(other) => return Err(other),
        }
        Ok(())
    }
}

impl Tried<'_> {
    /// Force and sensor vector at each value.
    fn vectors(
        &self,
        of: impl Fn(&ModesAt, &[Port]) -> [DVector<f64>; 2],
    ) -> Vec<[DVector<f64>; 2]> {
        self.path
            .iter()
            .zip(&self.ports)
            .map(|(at, ports)| of(at, ports))
            .collect()
    }

    fn chosen(&self, [actuator, sensor]: &[Chosen; 2]) -> Vec<[DVector<f64>; 2]> {
        let or = |chosen: &Chosen, ports: &[Port], own: &DVector<f64>| {
            chosen
                .as_ref()
                .map_or_else(|| own.clone(), |(_, weights)| weights.row(ports))
        };
        self.vectors(|at, ports| {
            [
                or(actuator, ports, &at.structure().force),
                or(sensor, ports, &at.structure().sensor),
            ]
        })
    }

    fn trial(&self, vectors: &[[DVector<f64>; 2]]) -> Result<Option<Trial>, PlantError> {
        trial(&self.path, vectors, self.closest, self.pair)
    }

    /// All pairs of places, and the actuator and the probe as they are with all places, best first.
    fn all(&self, names: &[String; 2], own: &[[DVector<f64>; 2]]) -> Result<Tries, CliError> {
        let (ports, mut tries) = (&self.ports[0], Tries::default());
        let row = |k: usize, place: usize| self.ports[k][place].row.clone();
        let vectors =
            |of: &dyn Fn(usize) -> [DVector<f64>; 2]| (0..own.len()).map(of).collect::<Vec<_>>();
        let other = names
            .each_ref()
            .map(|name| !ports.iter().any(|port| port.name == *name));
        for i in 0..ports.len() {
            for j in 0..ports.len() {
                let pair = vectors(&|k| [row(k, i), row(k, j)]);
                tries.add(&ports[i].name, &ports[j].name, self.trial(&pair))?;
            }
            if other[1] {
                let pair = vectors(&|k| [row(k, i), own[k][1].clone()]);
                tries.add(&ports[i].name, &names[1], self.trial(&pair))?;
            }
            if other[0] {
                let pair = vectors(&|k| [own[k][0].clone(), row(k, i)]);
                tries.add(&names[0], &ports[i].name, self.trial(&pair))?;
            }
        }
        tries.done.sort_by(|(a, _), (b, _)| {
            a.rank()
                .partial_cmp(&b.rank())
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        Ok(tries)
    }

    /// The name of a place whose vector is the same at every value, or what it is called otherwise.
    fn name(&self, chosen: &Chosen, own: &[[DVector<f64>; 2]], which: usize) -> String {
        let same = |place: usize| {
            own.iter()
                .zip(&self.ports)
                .all(|(own, ports)| (&own[which] - &ports[place].row).amax() < 1e-12)
        };
        let known = (0..self.ports[0].len())
            .find(|place| same(*place))
            .map(|place| self.ports[0][place].name.clone());
        known
            .or_else(|| chosen.as_ref().map(|(text, _)| text.clone()))
            .unwrap_or_else(|| "as configured".into())
    }
}

fn json(actuator: &str, sensor: &str, trial: &Trial) -> TrialJson {
    TrialJson {
        actuator: actuator.into(),
        sensor: sensor.into(),
        values: trial.values,
        with_cnmp: trial.with_cnmp,
        with_any_cnmp: trial.with_any_cnmp,
        alternating: trial.alternating,
        c4_1_margin: trial.margin,
        picture_alternates: trial.picture,
        differs: trial.differs(),
        remainder_per_kg: trial.remainder_per_kg,
    }
}

fn report(
    args: &Args,
    tried: &Tried,
    chosen: &[Chosen; 2],
    meeting: &'static str,
) -> Result<Report, CliError> {
    let own = tried.chosen(chosen);
    let names = [0, 1].map(|which| tried.name(&chosen[which], &own, which));
    let here = tried
        .trial(&own)?
        .map(|trial| json(&names[0], &names[1], &trial));
    let Tries {
        done,
        silent,
        not_computed,
    } = tried.all(&names, &own)?;
    let trials: Vec<TrialJson> = done.into_iter().map(|(_, json)| json).collect();
    let present = here.as_ref().map_or(0.0, |here| here.remainder_per_kg);
    let best = |fits: &dyn Fn(&TrialJson) -> bool| {
        let shows = |trial: &&TrialJson| trial.remainder_per_kg >= LEAST_REMAINDER * present;
        trials
            .iter()
            .filter(shows)
            .find(|trial| fits(trial))
            .cloned()
    };
    let places = [0, tried.closest, tried.path.len() - 1];
    let pictures: Vec<QuadrantDiagram> = places
        .map(|k| {
            QuadrantDiagram::of(
                tried.path[k],
                tried.path[tried.closest],
                tried.pair,
                &own[k],
            )
        })
        .into();
    if let Some(path) = &args.svg {
        draw(path, args, &pictures, &names)?;
    }
    Ok(Report {
        profile: args.bench.profile().into(),
        vary: args.vary.clone(),
        modes: tried.pair.map(|mode| mode + 1),
        meeting,
        value: tried.path[tried.closest].value,
        pictures: pictures.iter().map(picture_json).collect(),
        here,
        recommended: best(&|_| true),
        best_sensor: best(&|trial| trial.actuator == names[0]),
        best_actuator: best(&|trial| trial.sensor == names[1]),
        trials: trials.clone(),
        silent,
        not_computed,
        svg: args.svg.as_ref().map(|path| path.display().to_string()),
    })
}

fn picture_json(picture: &QuadrantDiagram) -> PictureJson {
    let [actuator_quadrant, sensor_quadrant] = picture.quadrants();
    PictureJson {
        value: picture.value,
        turn_deg: picture.turn_rad().to_degrees(),
        actuator: picture.actuator,
        sensor: picture.sensor,
        actuator_quadrant,
        sensor_quadrant,
        avoid_quadrant: picture.avoid(),
        across: picture.across(),
        residues_per_kg: picture.residues_per_kg,
        signs: picture.signs().map(|signs| signs.iter().collect()),
    }
}

fn draw(
    path: &Path,
    args: &Args,
    pictures: &[QuadrantDiagram],
    names: &[String; 2],
) -> Result<(), CliError> {
    let panel = |(when, picture): (&str, &QuadrantDiagram)| QuadrantPanel {
        title: format!("{when}: {:.6}", picture.value),
        picture: picture.clone(),
    };
    let panels: Vec<QuadrantPanel> = ["before", "at the veering point", "after"]
        .into_iter()
        .zip(pictures)
        .map(panel)
        .collect();
    let title = format!(
        "{}: actuator at {}, probe at {}",
        args.bench.profile(),
        names[0],
        names[1]
    );
    let subtitle = format!(
        "Quadrants of the two close shapes over {} (section 4.2.4)",
        args.vary
    );
    let svg =
        quadrants_svg(&panels, &title, &subtitle).map_err(|e| CliError::Failed(e.to_string()))?;
    let failed = |e: std::io::Error| {
        CliError::Failed(format!(
            "cannot write {}: {e}; free some space or choose another file",
            path.display()
        ))
    };
    std::fs::write(path, svg).map_err(failed)
}
