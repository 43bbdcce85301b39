//! The residual monitor does not trip on a stage that differs from its model: operating points 0 to 10 % of the beam length and
//! asymmetries -10 to +10 %, while the model keeps those of its profile.
//!
//! `BENCH_MONITOR_TICKS=100000000` runs 10^8 ticks, the default is 4 million; `BENCH_MONITOR_SEED` sets the seed, and
//! `BENCH_MONITOR_SHARE` a share `interlock.model_error_share` other than 0.5, to find the margin.

use bench_config::{Config, ExcitationKind, PlantSettings, Source, load};
use bench_experiment::{Plan, closed_loop, run};
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::Trip;
use bench_rt::thread::Pace;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// A closed loop with a smaller modulus margin rings for long after every step: it is the wrong controller for this stage.
const LEAST_MODULUS_MARGIN: f64 = 0.2;

const REFERENCES: [&str; 5] = [
    "kind = \"hold\"",
    "kind = \"step\"\namplitude_m = SIZE\nat_s = 0.2",
    "kind = \"ramp\"\namplitude_m = SIZE\nspeed_m_per_s = 0.001\nat_s = 0.2",
    "kind = \"sine\"\namplitude_m = SIZE\nfrequency_hz = FREQUENCY",
    "kind = \"chirp\"\ntravel_m = SIZE",
];

fn from_environment(name: &str, default: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.and_then(|text| text.parse().ok()).unwrap_or(default)
}

struct Draw(Pcg64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one_of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[(self.0.next_u64() % all.len() as u64) as usize]
    }

    fn profile(&mut self) -> Config {
        let profile = *self.one_of(&["stage", "stage", "stage", "xy", "lab"]);
        let mut sets = vec![format!("sim.seed={}", self.0.next_u64() % 1_000_000)];
        if let Ok(share) = std::env::var("BENCH_MONITOR_SHARE") {
            sets.push(format!("interlock.model_error_share={share}"));
        }
        load(&Source {
            config: Some(profile.into()),
            sets,
            ..Source::default()
        })
        .expect("valid")
    }

    /// An excitation or a closed loop; `None` if the model refuses it.
    fn plan(&mut self, mut config: Config) -> Option<Plan> {
        config.chirp.duration_s = config.chirp.duration_s.min(30.0);
        config.control.duration_s = 4.0;
        if self.between(0.0, 1.0) < 0.5 || config.title.contains("XY") {
            config.excitation.kind = *self.one_of(ExcitationKind::ALL);
            bench_experiment::predicted_extremes(&config).ok()?;
            return Some(Plan::chirp(config));
        }
        let size = format!("{:e}", self.between(1e-6, 100e-6));
        let frequency = format!("{:e}", self.between(0.5, 20.0));
        let reference = self.one_of(&REFERENCES);
        let reference = reference.replace("SIZE", &size);
        let reference = reference.replace("FREQUENCY", &frequency);
        config.control.reference = toml::from_str(&reference).expect("a reference");
        if config.servo.rate_hz == 5000.0 {
            config.control.controller = (*self.one_of(&["slow", "fast"])).into();
        }
        Plan::control(config).ok()
    }

    /// The stage that is there, in place of the modelled one.
    fn actual(&mut self, nominal: &Config) -> Config {
        let mut actual = nominal.clone();
        let point = self.between(0.0, 0.1);
        let asymmetry = self.between(-0.1, 0.1);
        match &mut actual.plant {
            PlantSettings::Sr4dof(plant) => {
                plant.operating_point_m = point * plant.beam_length_m;
                plant.mass_asymmetry = asymmetry;
            }
            PlantSettings::Xy(plant) => plant.operating_point_m = point * plant.beam_length_m,
            PlantSettings::Lumped(_) | PlantSettings::Modal(_) | PlantSettings::Own(_) => {}
        }
        actual
    }
}

fn has_margin(plan: &Plan, actual: &Config) -> bool {
    plan.controller.is_none()
        || closed_loop(actual).is_ok_and(|closed| {
            let margins = closed.margins();
            margins.stable && margins.modulus_margin > LEAST_MODULUS_MARGIN
        })
}

#[test]
fn never_trips_on_a_stage_that_differs_from_its_model() {
    let seed = from_environment("BENCH_MONITOR_SEED", 1);
    let least = from_environment("BENCH_MONITOR_TICKS", 4_000_000);
    println!("seed {seed}");
    let mut draw = Draw(Pcg64::seed_from_u64(seed));
    let (mut ticks, mut runs, mut false_trips) = (0, 0, Vec::new());
    while ticks < least {
        let config = draw.profile();
        let Some(plan) = draw.plan(config) else {
            continue;
        };
        let actual = draw.actual(&plan.config);
        if !has_margin(&plan, &actual) {
            continue;
        }
        let rig = Box::new(SimulatedRig::new(&actual).expect("a rig"));
        let folder = tempfile::tempdir().expect("a temporary folder");
        let ended = run(&plan, rig, Pace::Virtual, folder.path(), &mut |_, _| {});
        let mut ended = ended.expect("a run");
        ticks += ended.totals().expect("a recording").ticks;
        runs += 1;
        if let Some((trip @ Trip::ModelError { .. }, tick)) = ended.end.servo.trip {
            let label = plan.label();
            let control = &plan.config.control;
            false_trips.push(format!(
                "{} {label} {:?} tick {tick}: {trip}, {:?}",
                plan.config.title, control.reference, actual.plant
            ));
        }
    }
    println!("{runs} runs, {ticks} ticks");
    assert!(
        false_trips.is_empty(),
        "{} of {runs}:\n{}",
        false_trips.len(),
        false_trips.join("\n")
    );
}
