//! The plan of a study: a plant, the settings that vary, and the number of draws.

use std::ops::Range;
use std::str::FromStr;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::counter::Counter;
use super::{Deviation, StudyError, Tolerance};
use bench_base::nearest::nearest;
use bench_config::{Config, PlantSettings, validate};

/// Settings that may vary at once: the classes of all pairs of them take less than 40 MB.
const MOST_VARIED: usize = 64;
/// Largest number of draws: their counts take less than 1 GB.
const MOST_DRAWS: u64 = 100_000_000;

/// A setting that varies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Varied {
    /// Its dotted path.
    pub key: String,
    /// Its value in the configuration.
    pub nominal: f64,
    /// The deviation that is added.
    #[serde(flatten)]
    pub deviation: Deviation,
}

/// All settings that determine the counts of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The nominal plant.
    pub plant: PlantSettings,
    /// The settings that vary, in the order of the tolerances and, within one, of the configuration.
    pub varied: Vec<Varied>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of draws.
    pub draws: u64,
    /// Whether the zeros with damping are counted as well.
    pub damped: bool,
}

/// The part of a study that one process computes, `index` of `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Number of the part, from 1.
    pub index: u64,
    /// Number of parts.
    pub count: u64,
}

impl Shard {
    /// The whole study.
    pub const WHOLE: Shard = Shard { index: 1, count: 1 };

    /// Its draws: the I-th of N parts, whose sizes differ by one draw at most.
    pub fn draws(&self, plan: &Plan) -> Range<u64> {
        // 128 bits hold the product of any two 64-bit numbers.
        let limit =
            |part: u64| (u128::from(plan.draws) * u128::from(part) / u128::from(self.count)) as u64;
        limit(self.index - 1)..limit(self.index)
    }
}

impl FromStr for Shard {
    type Err = StudyError;

    fn from_str(text: &str) -> Result<Shard, StudyError> {
        let parts = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        let shard = parts.map(|(index, count)| Shard { index, count });
        shard
            .filter(Shard::is_valid)
            .ok_or_else(|| StudyError::Shard(text.into()))
    }
}

impl Shard {
    pub(super) fn is_valid(&self) -> bool {
        (1..=self.count).contains(&self.index)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// The varied settings of one draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// The values.
    pub values: Vec<f64>,
    /// The probability of a smaller value, from 0 to 1.
    pub ranks: Vec<f64>,
}

impl Plan {
    /// A plan for a configuration. Refuses a nominal plant that cannot be analysed, and a tolerance one end of which is out
    /// of range: draws left out for that reason would bias the probabilities.
    pub fn new(
        config: &Config,
        tolerances: &[Tolerance],
        draws: u64,
        damped: bool,
    ) -> Result<Plan, StudyError> {
        if !(1..=MOST_DRAWS).contains(&draws) {
            return Err(StudyError::Plan(format!(
                "{draws} draws are not possible; give --draws from 1 to {MOST_DRAWS}"
            )));
        }
        let varied = varied(&config.plant, tolerances)?;
        let plan = Plan {
            plant: config.plant.clone(),
            varied,
            seed: config.sim.seed,
            draws,
            damped,
        };
        plan.check(config)?;
        Ok(plan)
    }

    /// A counter for the values of the varied settings.
    pub(super) fn counter(&self) -> Counter<'_> {
        let keys = self.varied.iter().map(|one| one.key.as_str());
        Counter::new(&self.plant, keys, self.damped)
    }

    fn check(&self, config: &Config) -> Result<(), StudyError> {
        let mut counter = self.counter();
        let nominal: Vec<f64> = self.varied.iter().map(|one| one.nominal).collect();
        counter.count(&nominal).map_err(|why| {
            StudyError::Plan(format!("the nominal plant cannot be analysed: {why}"))
        })?;
        for (index, one) in self.varied.iter().enumerate() {
            for end in one.deviation.ends() {
                let mut values = nominal.clone();
                values[index] += end;
                let plant = counter.plant(&values);
                plant
                    .and_then(|plant| check_plant(config, plant))
                    .map_err(|why| out_of_range(&one.key, values[index], &why))?;
            }
        }
        Ok(())
    }

    /// The values of the varied settings, from draw `first` on.
    ///
    /// One sequence of PCG (XSL RR 128/64) serves the whole study: with n settings, draw k takes the 2 n numbers from 2 n k
    /// on, and the generator jumps there.
    pub fn from_draw(&self, first: u64) -> impl Iterator<Item = Drawn> + '_ {
        let mut bits = Pcg64::seed_from_u64(self.seed);
        bits.advance(2 * self.varied.len() as u128 * u128::from(first));
        std::iter::repeat_with(move || self.drawn(&mut bits))
    }

    fn drawn(&self, bits: &mut Pcg64) -> Drawn {
        let drawn = self.varied.iter().map(|one| {
            let pair = [uniform(bits), uniform(bits)];
            let (deviation, rank) = one.deviation.drawn(pair);
            (one.nominal + deviation, rank)
        });
        let (values, ranks) = drawn.unzip();
        Drawn { values, ranks }
    }
}

fn check_plant(config: &Config, plant: PlantSettings) -> Result<(), String> {
    let config = Config {
        plant,
        ..config.clone()
    };
    validate(&config).map_err(|error| error.to_string())
}

fn out_of_range(key: &str, value: f64, why: &str) -> StudyError {
    StudyError::Plan(format!(
        "the tolerance of `{key}` reaches {value}, which is refused; narrow it, or move the nominal value: {why}"
    ))
}

/// Uniform in [0, 1), in steps of 2^-53.
fn uniform(bits: &mut Pcg64) -> f64 {
    (bits.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

fn varied(plant: &PlantSettings, tolerances: &[Tolerance]) -> Result<Vec<Varied>, StudyError> {
    let settings = settings(plant);
    let mut varied: Vec<Varied> = Vec::new();
    for tolerance in tolerances {
        for (key, nominal) in matching_settings(tolerance, &settings)? {
            if varied.iter().any(|one| one.key == *key) {
                let why = format!("`{key}` varies already; give each setting once");
                return Err(tolerance.wrong(why));
            }
            varied.push(Varied {
                key: key.clone(),
                nominal,
                deviation: tolerance.deviation(key, nominal, plant.beam_length_m())?,
            });
        }
    }
    check_count(varied.len())?;
    Ok(varied)
}

fn check_count(varied: usize) -> Result<(), StudyError> {
    match varied {
        0 => Err(StudyError::Plan(
            "nothing varies; give --vary KEY=TOLERANCE, as in plant.mass_asymmetry=+-0.02".into(),
        )),
        1..=MOST_VARIED => Ok(()),
        _ => Err(StudyError::Plan(format!(
            "{varied} settings would vary, the limit is {MOST_VARIED}; choose fewer"
        ))),
    }
}

/// The numeric settings that a tolerance applies to, with their values.
fn matching_settings<'a>(
    tolerance: &Tolerance,
    settings: &'a [(String, Value)],
) -> Result<Vec<(&'a String, f64)>, StudyError> {
    let quantities = settings.iter().filter(|(_, value)| value.is_f64());
    let matching_settings: Vec<(&String, f64)> = quantities
        .filter(|(key, _)| tolerance.matches(key))
        .filter_map(|(key, value)| Some((key, value.as_f64()?)))
        .collect();
    if matching_settings.is_empty() {
        Err(tolerance.wrong(no_matching_setting(tolerance, settings)))
    } else {
        Ok(matching_settings)
    }
}

/// The reason why a tolerance applies to no numeric setting.
fn no_matching_setting(tolerance: &Tolerance, settings: &[(String, Value)]) -> String {
    let mut keys = settings.iter().map(|(key, _)| key.as_str());
    let pattern = tolerance.pattern();
    if let Some(key) = keys.clone().find(|key| tolerance.matches(key)) {
        return format!("`{key}` is not a quantity; choose a quantity");
    }
    if !pattern.starts_with("plant.") {
        return format!(
            "`{pattern}` is not a setting of the plant; choose a setting that begins with `plant.`"
        );
    }
    let hint = nearest(pattern, &mut keys).unwrap_or("plant");
    format!(
        "`{pattern}` is not a setting of this plant; check the spelling (the nearest is `{hint}`)"
    )
}

/// All settings of a plant, with their dotted paths.
fn settings(plant: &PlantSettings) -> Vec<(String, Value)> {
    let plant = serde_json::to_value(plant).unwrap_or_default();
    let mut found = Vec::new();
    leaves("plant", &plant, &mut found);
    found
}

fn leaves(path: &str, value: &Value, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(entries) => entries
            .iter()
            .for_each(|(key, value)| leaves(&format!("{path}.{key}"), value, found)),
        leaf => found.push((path.into(), leaf.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Source, load};

    fn plan(draws: u64, seed: u64) -> Plan {
        let source = Source {
            config: Some("xy".into()),
            sets: vec![format!("sim.seed={seed}")],
            ..Source::default()
        };
        let tolerances = [
            "plant.secondary_mass_deviation.*=+-0.15",
            "plant.*_stage_mass_kg=normal:1%",
        ];
        let tolerances: Vec<Tolerance> = tolerances
            .iter()
            .map(|text| text.parse().unwrap())
            .collect();
        Plan::new(&load(&source).unwrap(), &tolerances, draws, false).unwrap()
    }

    #[test]
    fn draws_do_not_depend_on_the_first_draw() {
        let plan = plan(100, 7);
        assert_eq!(plan.varied.len(), 8 + 3);
        let whole: Vec<Drawn> = plan.from_draw(0).take(100).collect();
        for first in [1, 17, 99] {
            let part: Vec<Drawn> = plan.from_draw(first).take(100 - first as usize).collect();
            assert_eq!(part, whole[first as usize..]);
        }
    }

    #[test]
    fn draws_have_the_distribution_and_are_independent() {
        const N: usize = 100_000;
        let (plan, other) = (plan(N as u64, 1), plan(N as u64, 2));
        let columns = |plan: &Plan| {
            let drawn: Vec<Drawn> = plan.from_draw(0).take(N).collect();
            (0..11)
                .map(|j| drawn.iter().map(|d| d.ranks[j] - 0.5).collect::<Vec<f64>>())
                .collect::<Vec<_>>()
        };
        let (here, there) = (columns(&plan), columns(&other));
        let product =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / N as f64;
        for (i, a) in here.iter().enumerate() {
            // A uniform rank has the mean 0 (after subtracting 1/2) and the variance 1/12. For N ranks, sigma of the
            // mean is sqrt(1/12/N), of a product of two ranks 1/12/sqrt(N), of the variance sqrt(1/80 -
            // 1/144)/sqrt(N). The tolerance is 5 sigma.
            let (root, ones) = ((N as f64).sqrt(), vec![1.0; N]);
            assert!(product(a, &ones).abs() < 5.0 * (1.0 / 12.0f64).sqrt() / root);
            assert!(
                (product(a, a) - 1.0 / 12.0).abs()
                    < 5.0 * (1.0 / 80.0 - 1.0 / 144.0f64).sqrt() / root
            );
            for b in here[..i].iter().chain(&there) {
                assert!(product(a, b).abs() < 5.0 / 12.0 / root);
            }
        }
        let masses: Vec<f64> = plan
            .from_draw(0)
            .take(N)
            .map(|d| d.values[8] / plan.varied[8].nominal - 1.0)
            .collect();
        let sigma = (masses.iter().map(|x| x * x).sum::<f64>() / N as f64).sqrt();
        // The sigma of a sigma is sigma/sqrt(2 N).
        assert!(
            (sigma - 0.01).abs() < 5.0 * 0.01 / (2.0 * N as f64).sqrt(),
            "{sigma}"
        );
    }

    #[test]
    fn shards_cover_every_draw_once() {
        for (draws, count) in [
            (1, 1),
            (10, 3),
            (7, 7),
            (3, 5),
            (20_000, 8),
            (100_000_000, 999_983),
        ] {
            let plan = plan(draws, 1);
            let mut next = 0;
            for index in 1..=count {
                let part = Shard { index, count }.draws(&plan);
                assert_eq!(part.start, next);
                assert!(part.end - part.start <= draws / count + 1);
                next = part.end;
            }
            assert_eq!(next, draws);
        }
        for text in ["3/2", "0/2", "1/0", "1", "a/b", "-1/2", "1/2/3", ""] {
            assert_eq!(text.parse::<Shard>(), Err(StudyError::Shard(text.into())));
        }
    }
}
