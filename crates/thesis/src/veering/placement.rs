//! Actuator and probe at other places: each placement tried on the model, and predicted from the quadrant diagram.

use std::cmp::Ordering;

use nalgebra::DVector;
use serde::Serialize;

use super::conditions::c4_1;
use super::trajectory::Ports;
use super::{Meeting, ModesAt, QuadrantDiagram, QuadrantSummary, Sample, ZeroConfiguration};
use bench_plant::zeros::cnmp_pairs;
use bench_plant::{PlantError, Port, PortWeights};

/// Placements with less than this ratio of the present aR are not recommended: the probe hardly measures the controlled motion.
pub const MIN_REMAINDER_RATIO: f64 = 0.1;

/// A placement over a range of values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// Number of values.
    pub values: usize,
    /// Values with CNMP zeros of the two modes.
    pub with_cnmp: usize,
    /// Values with CNMP zeros of any modes.
    pub with_any_cnmp: usize,
    /// Values where C4-1 holds.
    pub alternating: usize,
    /// The largest margin of C4-1: above 0 the signs alternate somewhere, below 0 how far they are from it.
    pub c4_1_margin: f64,
    /// Whether, by the diagram at the veering point, the signs alternate somewhere in the range.
    pub picture_alternates: bool,
    /// Whether the diagram excludes CNMP zeros of the two modes, but the model has them.
    pub differs: bool,
    /// The size of aR at the middle value, in 1/kg: how much of the controlled motion the probe measures.
    pub remainder_per_kg: f64,
}

impl Trial {
    fn of(samples: &[Sample], picture_alternates: bool) -> Trial {
        let conditions = || {
            samples
                .iter()
                .filter_map(|sample| Some(c4_1(&sample.modes?)))
        };
        let margins = conditions().map(|condition| condition.margin);
        let with_cnmp = count(samples, |s| s.plant == ZeroConfiguration::Quartet);
        let middle = samples[samples.len() / 2].modes;
        Trial {
            values: samples.len(),
            with_cnmp,
            with_any_cnmp: count(samples, |sample| cnmp_pairs(&sample.zeros) > 0),
            alternating: conditions().filter(|condition| condition.holds).count(),
            c4_1_margin: margins.fold(f64::NEG_INFINITY, f64::max),
            picture_alternates,
            differs: !picture_alternates && with_cnmp > 0,
            remainder_per_kg: middle.map_or(0.0, |modes| modes.remainder.residue_per_kg.abs()),
        }
    }

    /// Order of preference: no CNMP zeros, then none of the close modes, then signs that are far from alternating.
    fn preference(&self, other: &Trial) -> Ordering {
        let key = |trial: &Trial| {
            (
                trial.with_any_cnmp,
                trial.with_cnmp,
                trial.picture_alternates,
                trial.c4_1_margin,
            )
        };
        key(self)
            .partial_cmp(&key(other))
            .unwrap_or(Ordering::Equal)
    }
}

/// A placement with its trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Placement {
    /// Place of the actuator.
    pub actuator: String,
    /// Place of the probe.
    pub sensor: String,
    /// The trial.
    #[serde(flatten)]
    pub trial: Trial,
}

/// The modes at each value, and the index of the veering point among them.
#[derive(Clone, Debug)]
pub struct Path<'a> {
    /// The modes at each value, the veering point included.
    pub modes: Vec<&'a ModesAt>,
    /// Index of the veering point.
    pub closest: usize,
    /// The two modes.
    pub pair: [usize; 2],
}

impl<'a> Path<'a> {
    /// The modes at the values of a grid, in their order, with those at the veering point.
    pub fn new(mut modes: Vec<&'a ModesAt>, closest: &'a ModesAt, pair: [usize; 2]) -> Path<'a> {
        let is_rising = modes[0].value < modes[modes.len() - 1].value;
        let place = modes.partition_point(|at| {
            if is_rising {
                at.value < closest.value
            } else {
                at.value > closest.value
            }
        });
        if modes.get(place).is_none_or(|at| at.value != closest.value) {
            modes.insert(place, closest);
        }
        Path {
            modes,
            closest: place,
            pair,
        }
    }

    /// Tries actuator and probe at each value. `None` where some value has no response at all.
    fn trial(&self, ports: &[Ports]) -> Result<Option<Trial>, PlantError> {
        let mut values = self.modes.iter().zip(ports);
        if values.any(|(at, ports)| has_no_response(at, ports)) {
            return Ok(None);
        }
        let values = self.modes.iter().zip(ports);
        let samples = values
            .map(|(at, ports)| Sample::of(at, self.pair, ports.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Some(Trial::of(&samples, self.diagram_alternates(ports))))
    }

    /// The diagram at one value, in the frame of the veering point.
    fn diagram(&self, index: usize, ports: &[Ports]) -> QuadrantDiagram {
        let frame = self.modes[self.closest];
        QuadrantDiagram::of(self.modes[index], frame, self.pair, &ports[index])
    }

    /// The diagrams before, at and after the veering point.
    pub fn diagrams(&self, ports: &[Ports]) -> [QuadrantDiagram; 3] {
        let indices = [0, self.closest, self.modes.len() - 1];
        indices.map(|index| self.diagram(index, ports))
    }

    /// Whether the diagram at the veering point alternates while the shapes turn as they do on either side. At a crossing
    /// the shapes do not turn but exchange their places: the diagrams at the neighbouring values are used.
    fn diagram_alternates(&self, ports: &[Ports]) -> bool {
        let (closest, last) = (self.closest, self.modes.len() - 1);
        let starts = if self.modes[closest].are_equal(self.pair) {
            [closest.saturating_sub(1), (closest + 1).min(last)]
        } else {
            [closest, closest]
        };
        starts.into_iter().zip([0, last]).any(|(start, end)| {
            let (start, end) = (self.diagram(start, ports), self.diagram(end, ports));
            start.alternates_over(start.turn_rad(), end.turn_rad())
        })
    }
}

fn has_no_response(at: &ModesAt, [force, sensor]: &Ports) -> bool {
    let terms = at.terms(force, sensor);
    terms.iter().all(|term| term.residue_per_kg == 0.0)
}

fn count(samples: &[Sample], of: impl Fn(&Sample) -> bool) -> usize {
    samples.iter().filter(|sample| of(sample)).count()
}

/// A place as typed, with its meaning; `None` for that of the configuration.
pub type Chosen = Option<(String, PortWeights)>;

/// All placements along a path.
#[derive(Clone, Debug)]
pub struct Placements<'a> {
    path: &'a Path<'a>,
    /// The places of the plant at each value.
    places: &'a [Vec<Port>],
    /// Force and sensor vector of the present placement at each value.
    own: Vec<Ports>,
    /// Names of the present actuator and probe.
    pub names: [String; 2],
}

/// Outcome of all placements.
#[derive(Default)]
struct PlacementTrials {
    /// The placements with a response, best first.
    placements: Vec<Placement>,
    without_response: usize,
    /// Number of placements whose zeros do not converge: nearly all zeros are at infinity, as for a force in Y and a
    /// probe in X.
    not_computed: usize,
}

impl PlacementTrials {
    /// The best placement that satisfies `of` and has at least this remainder.
    fn best(&self, least_per_kg: f64, of: impl Fn(&Placement) -> bool) -> Option<Placement> {
        let mut measured = self
            .placements
            .iter()
            .filter(|one| one.trial.remainder_per_kg >= least_per_kg);
        measured.find(|one| of(one)).cloned()
    }
}

impl<'a> Placements<'a> {
    /// The placements beside the chosen actuator and probe, with the `places` of the plant at each value of the path.
    pub fn new(
        path: &'a Path<'a>,
        places: &'a [Vec<Port>],
        chosen: &[Chosen; 2],
    ) -> Placements<'a> {
        let values = path.modes.iter().zip(places);
        let own: Vec<Ports> = values
            .map(|(at, places)| {
                let structure = at.structure();
                [
                    row_of(&chosen[0], places, &structure.force),
                    row_of(&chosen[1], places, &structure.sensor),
                ]
            })
            .collect();
        let names = [0, 1].map(|which| name_of(&chosen[which], places, &own, which));
        Placements {
            path,
            places,
            own,
            names,
        }
    }

    /// Force and sensor vector of the present placement at each value.
    pub fn own(&self) -> &[Ports] {
        &self.own
    }

    /// The present placement; `None` where it has no response at some value.
    fn present(&self) -> Result<Option<Placement>, PlantError> {
        let trial = self.path.trial(&self.own)?;
        let [actuator, sensor] = self.names.clone();
        Ok(trial.map(|trial| Placement {
            actuator,
            sensor,
            trial,
        }))
    }

    /// All pairs of places, and the present actuator and probe with all places.
    fn all(&self) -> Result<PlacementTrials, PlantError> {
        let mut tried = PlacementTrials::default();
        for [actuator, sensor] in self.pairs() {
            self.try_pair(actuator, sensor, &mut tried)?;
        }
        tried
            .placements
            .sort_by(|a, b| a.trial.preference(&b.trial));
        Ok(tried)
    }

    /// Indices of actuator and probe among the places; `None` is the present one, unless it is one of the places.
    fn pairs(&self) -> Vec<[Option<usize>; 2]> {
        let is_other = |name: &String| !self.places[0].iter().any(|port| port.name == *name);
        let [other_actuator, other_sensor] = self.names.each_ref().map(is_other);
        let places: Vec<Option<usize>> = (0..self.places[0].len()).map(Some).collect();
        let mut pairs = Vec::new();
        for &place in &places {
            pairs.extend(places.iter().map(|&sensor| [place, sensor]));
            pairs.extend(other_sensor.then_some([place, None]));
            pairs.extend(other_actuator.then_some([None, place]));
        }
        pairs
    }

    fn try_pair(
        &self,
        actuator: Option<usize>,
        sensor: Option<usize>,
        tried: &mut PlacementTrials,
    ) -> Result<(), PlantError> {
        let ports: Vec<Ports> = (0..self.own.len())
            .map(|k| [self.row(k, actuator, 0), self.row(k, sensor, 1)])
            .collect();
        match self.path.trial(&ports) {
            Ok(Some(trial)) => tried.placements.push(Placement {
                actuator: self.name(actuator, 0),
                sensor: self.name(sensor, 1),
                trial,
            }),
            Ok(None) => tried.without_response += 1,
            Err(PlantError::NoConvergence { .. }) => tried.not_computed += 1,
            Err(other) => return Err(other),
        }
        Ok(())
    }

    fn row(&self, value: usize, place: Option<usize>, which: usize) -> DVector<f64> {
        match place {
            Some(place) => self.places[value][place].row.clone(),
            None => self.own[value][which].clone(),
        }
    }

    fn name(&self, place: Option<usize>, which: usize) -> String {
        match place {
            Some(place) => self.places[0][place].name.clone(),
            None => self.names[which].clone(),
        }
    }
}

fn row_of(chosen: &Chosen, places: &[Port], configured: &DVector<f64>) -> DVector<f64> {
    match chosen {
        Some((_, weights)) => weights.row(places),
        None => configured.clone(),
    }
}

/// The name of a place whose row is the same at every value, or the text as typed.
fn name_of(chosen: &Chosen, places: &[Vec<Port>], own: &[Ports], which: usize) -> String {
    let is_same = |place: &usize| {
        let mut values = own.iter().zip(places);
        values.all(|(own, places)| (&own[which] - &places[*place].row).amax() < 1e-12)
    };
    match ((0..places[0].len()).find(is_same), chosen) {
        (Some(place), _) => places[0][place].name.clone(),
        (None, Some((text, _))) => text.clone(),
        (None, None) => "as configured".into(),
    }
}

/// The present placement among all others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlacementReport {
    /// Mode numbers, counted from 1 in order of frequency at the first value of the setting.
    pub modes: [usize; 2],
    /// The behaviour of the two where they are closest.
    pub meeting: Meeting,
    /// The value of the setting there.
    pub value: f64,
    /// The quadrants before, at and after the veering point.
    pub pictures: [QuadrantSummary; 3],
    /// The present placement; `null` where it has no response at some value.
    pub here: Option<Placement>,
    /// The best placement of all.
    pub recommended: Option<Placement>,
    /// The best with the present actuator.
    pub best_sensor: Option<Placement>,
    /// The best with the present probe.
    pub best_actuator: Option<Placement>,
    /// All pairs of places, best first, without those that have no response.
    pub trials: Vec<Placement>,
    /// Number of placements without any response.
    pub without_response: usize,
    /// Number of placements whose zeros do not converge.
    pub not_computed: usize,
}

impl PlacementReport {
    /// The report of all placements along a path.
    pub fn of(placements: &Placements, meeting: Meeting) -> Result<PlacementReport, PlantError> {
        let (path, here, tried) = (placements.path, placements.present()?, placements.all()?);
        let diagrams = path.diagrams(&placements.own);
        let [actuator, sensor] = &placements.names;
        let present = here.as_ref().map(|here| here.trial.remainder_per_kg);
        let least = MIN_REMAINDER_RATIO * present.unwrap_or(0.0);
        Ok(PlacementReport {
            modes: path.pair.map(|mode| mode + 1),
            meeting,
            value: path.modes[path.closest].value,
            pictures: diagrams.each_ref().map(QuadrantSummary::from),
            here,
            recommended: tried.best(least, |_| true),
            best_sensor: tried.best(least, |one| one.actuator == *actuator),
            best_actuator: tried.best(least, |one| one.sensor == *sensor),
            trials: tried.placements,
            without_response: tried.without_response,
            not_computed: tried.not_computed,
        })
    }
}
