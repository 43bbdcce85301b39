//! `bench tune` for stages that were not used when it was written.

use bench_base::progress::Progress;
use bench_config::{Config, Source, load};
use bench_control::tuning::{
    Design, DesignOptions, DesignTask, Effort, Goal, NamedPlant, Requirements, RigModel,
    Tolerances, TuneError, design,
};
use rand_core::Rng;
use rand_pcg::Pcg64;

const STAGES: u64 = 20;
const MODULUS_MARGIN: f64 = 0.5;

fn uniform(random: &mut Pcg64, low: f64, high: f64) -> f64 {
    let share = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    low + (high - low) * share
}

/// A stage of Chapter 5 with other masses, springs, beams, asymmetry, damping and operating point.
fn random_stage(seed: u64) -> Config {
    let mut random = Pcg64::new(u128::from(seed), 0x6865_6c64);
    let mut between = |low, high| uniform(&mut random, low, high);
    let sets = [
        format!("plant.mass_asymmetry={}", between(-0.2, 0.2)),
        format!("plant.motion_stage_mass_kg={}", between(0.25, 0.6)),
        format!("plant.intermediate_stage_mass_kg={}", between(0.5, 1.2)),
        format!("plant.secondary_stage_mass_kg={}", between(0.04, 0.09)),
        format!("plant.spring_stiffness_n_per_m={}", between(15e3, 80e3)),
        format!("plant.beam_thickness_m={}", between(0.5e-3, 0.75e-3)),
        format!("plant.operating_point_m={}", between(0.0, 0.0038)),
        format!(
            "plant.damping={{kind=\"uniform\",ratio={}}}",
            0.002 * 10f64.powf(between(0.0, 1.0))
        ),
    ];
    load(&Source {
        sets: sets.to_vec(),
        ..Source::default()
    })
    .unwrap()
}

fn profile(name: &str) -> Config {
    load(&Source {
        config: Some(name.into()),
        ..Source::default()
    })
    .unwrap()
}

fn designed(config: &Config) -> Result<Design, TuneError> {
    let plant = NamedPlant::of("the plant", &config.plant).unwrap();
    let options = DesignOptions {
        requirements: Requirements::new(Goal::Disturbance, MODULUS_MARGIN),
        tolerances: Tolerances {
            frequency_ratio: 0.01,
            damping_factor: 0.7,
            gain_ratio: 0.05,
        },
        unmodelled_ratio: 0.03,
        order: 5,
        effort: Effort {
            kept: 1,
            grown: 2,
            steps: 40,
            final_steps: 60,
        },
        seed: 1,
    };
    let task = DesignTask::new(&RigModel::from(config), &[plant], options).unwrap();
    design(&task, &Progress::default())
}

/// The poles of every loop lie inside the unit circle, and the margin holds on the fine grid at all plants.
fn assert_robust(design: &Design, stage: &str) {
    assert!(design.figures.iter().all(|f| f.stable), "{stage}");
    assert!(
        design.misses_margin(MODULUS_MARGIN).is_none(),
        "{stage}: {:?}",
        design.figures
    );
    assert!(design.attained > 1.0, "{stage}: {}", design.attained);
}

#[test]
fn random_stages_have_a_robust_controller() {
    for seed in 0..STAGES {
        let design = designed(&random_stage(seed)).unwrap();
        assert_robust(&design, &format!("seed {seed}"));
    }
}

#[test]
fn xy_stage_has_a_robust_controller() {
    assert_robust(&designed(&profile("xy")).unwrap(), "xy");
}

#[test]
fn stage_of_an_own_file_has_a_robust_controller() {
    let template = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/bench-config/templates/modal.toml"
    );
    assert_robust(&designed(&profile(template)).unwrap(), "modal.toml");
}
