//! A configuration with a plant, a reference and an excitation of another crate.

use bench_config::{ConfigError, Purpose, Source, load, schema, whole};
use bench_excitation::{
    Excitation, ExcitationDesign, Length, Reference, ReferenceContext, ReferenceDesign,
    ReferenceError, SharedSettings,
};
use bench_plant::{Assembly, ModalModel, PlantModel, Structure, build};
use schemars::JsonSchema;
use serde::Deserialize;

#[derive(Deserialize, JsonSchema)]
struct Oscillator {
    #[schemars(range(min = 1e-6, max = 1e6))]
    mass_kg: f64,
    #[schemars(range(min = 1e-6, max = 1e12))]
    stiffness_n_per_m: f64,
}

impl PlantModel for Oscillator {
    fn coordinates(&self) -> Vec<&str> {
        vec!["x"]
    }

    fn undamped(&self) -> Structure {
        let mut parts = Assembly::new(1);
        parts.add_mass(self.mass_kg, &[1.0], &[0.0]);
        parts.add_spring(self.stiffness_n_per_m, &[1.0]);
        parts.into_structure(&[1.0], &[1.0])
    }
}

#[derive(Clone, Copy, Deserialize, JsonSchema)]
struct Pulse {
    #[schemars(range(min = -1.0, max = 1.0))]
    height_m: f64,
}

impl ReferenceDesign for Pulse {
    fn describe(&self) -> String {
        format!("a pulse of {} m", self.height_m)
    }

    fn build(&self, _: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(*self))
    }
}

impl Reference for Pulse {
    fn at_m(&self, tick: u64) -> f64 {
        if tick == 0 { self.height_m } else { 0.0 }
    }
}

#[derive(Clone, Copy, Deserialize, JsonSchema)]
struct Kick {
    #[schemars(range(min = 1, max = 1000))]
    ticks: u64,
}

impl ExcitationDesign for Kick {
    fn describe(&self, _: &SharedSettings<'_>) -> String {
        format!("a kick of {} ticks", self.ticks)
    }

    fn length(&self, _: &SharedSettings<'_>) -> Length {
        Length {
            ticks: self.ticks as f64,
            key: "own_excitation.ticks",
            value: self.ticks as f64,
        }
    }

    fn build(&self, _: &SharedSettings<'_>) -> Box<dyn Excitation> {
        Box::new(*self)
    }
}

impl Excitation for Kick {
    fn current_a(&self, _: u64) -> f64 {
        1e-3
    }

    fn ticks(&self) -> u64 {
        self.ticks
    }
}

const CONFIGURATION: &str = "title = 'own'
[plant]
model = 'oscillator'
mass_kg = 2.0
stiffness_n_per_m = 5e4
[control.reference]
kind = 'pulse'
height_m = 1e-5
[excitation]
kind = 'own'
[own_excitation]
kind = 'kick'
ticks = 100
";

fn loaded(text: &str) -> Result<bench_config::Config, ConfigError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("own.toml");
    std::fs::write(&file, text).expect("a file");
    let config = Some(file.display().to_string());
    load(&Source {
        config,
        purpose: Purpose::Chirp,
        ..Source::default()
    })
}

/// One test, because the kinds are those of the whole process.
#[test]
fn own_plant_reference_and_excitation_are_loaded_checked_and_recorded() {
    let before = loaded(CONFIGURATION)
        .expect_err("unknown kinds")
        .to_string();
    assert!(
        before.contains("choose one of sr4dof, xy, lumped, modal"),
        "{before}"
    );

    assert!(
        before.contains("`own_excitation` belongs to a kind that this program does not know"),
        "{before}"
    );

    bench_plant::register_plant::<Oscillator>("oscillator").expect("new");
    bench_excitation::register_reference::<Pulse>("pulse").expect("new");
    bench_excitation::register_excitation::<Kick>("kick").expect("new");
    assert!(bench_excitation::register_excitation::<Kick>("kick").is_err());
    assert!(bench_plant::register_plant::<Oscillator>("xy").is_err());
    assert!(bench_excitation::register_reference::<Pulse>("sine").is_err());

    let config = loaded(CONFIGURATION).expect("valid");
    assert_eq!(config.plant.model(), "oscillator");
    assert_eq!(config.control.reference.kind(), "pulse");
    assert_eq!(
        config.control.reference.design().describe(),
        "a pulse of 0.00001 m"
    );
    assert_eq!(config.excitation_text(), "a kick of 100 ticks");
    // w^2 = k/m, residue 1/m.
    let model = ModalModel::of(&build(&config.plant).expect("built")).expect("a mode");
    assert!((model.modes[0].omega_rad_s - (5e4_f64 / 2.0).sqrt()).abs() < 1e-9);
    assert!((model.modes[0].residue_per_kg() - 0.5).abs() < 1e-12);

    let recorded = toml::to_string(&config).expect("TOML");
    assert_eq!(whole("recorded", &recorded).expect("read again"), config);

    let heavy = loaded(&CONFIGURATION.replace("mass_kg = 2.0", "mass_kg = 2e7"));
    let why = heavy.expect_err("out of range").to_string();
    assert!(
        why.contains("line 4: `plant.mass_kg` is 20000000 kg; give a value from"),
        "{why}"
    );
    let misspelt = loaded(&CONFIGURATION.replace("height_m", "heigth_m"));
    let why = misspelt.expect_err("unknown key").to_string();
    assert!(why.contains("the nearest is `height_m`"), "{why}");

    let long = loaded(&CONFIGURATION.replace("ticks = 100", "ticks = 1001"));
    let why = long.expect_err("out of range").to_string();
    assert!(why.contains("`own_excitation.ticks` is 1001"), "{why}");
    let (without_table, _) = CONFIGURATION
        .split_once("[own_excitation]")
        .expect("a table");
    let why = loaded(without_table).expect_err("no table").to_string();
    assert!(
        why.contains("`excitation.kind` needs the table [own_excitation]"),
        "{why}"
    );

    let schema = schema().to_string();
    assert!(schema.contains("\"oscillator\"") && schema.contains("\"pulse\""));
}
