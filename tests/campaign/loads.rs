//! The required load, against the static equilibrium of the stage with nonlinear constraints.
use bench_config::{Config, PlantSettings, Purpose, Source, Sr4dofSettings, load};
use bench_experiment::campaign::{Load, StageModel};

fn config(sets: &[&str]) -> Config {
    let sets = sets.iter().map(|set| set.to_string()).collect();
    load(&Source {
        sets,
        purpose: Purpose::Chirp,
        ..Source::default()
    })
    .expect("a configuration")
}

fn stage(config: &Config) -> &Sr4dofSettings {
    let PlantSettings::Sr4dof(stage) = &config.plant else {
        panic!("the default plant")
    };
    stage
}

/// Force in Y and rest position in X of a stage held at `y1`: the minimum of the springs' energy over x1, y2, y3, with the constraints
/// x4 = x1 + c (y1 - y2)^2 - c y2^2 and x5 = x1 - c (y1 - y3)^2 + c y3^2, found by an iterative descent.
fn equilibrium(s: &Sr4dofSettings, y1: f64) -> (f64, f64) {
    let c = 0.6 / s.beam_length_m;
    let inertia = s.beam_height_m * s.beam_thickness_m.powi(3) / 12.0;
    let k = 24.0 * s.youngs_modulus_pa * inertia
        / (s.beam_length_m.powi(3) * (1.0 - s.poisson_ratio.powi(2)));
    let k4 = s.spring_stiffness_n_per_m;
    let (mut x1, mut y2, mut y3) = (1e-4, 0.7 * y1, 0.2 * y1);
    let intermediate_stages = |x1: f64, y2: f64, y3: f64| {
        (
            x1 + c * ((y1 - y2).powi(2) - y2 * y2),
            x1 - c * ((y1 - y3).powi(2) - y3 * y3),
        )
    };
    for _ in 0..2000 {
        let (x4, x5) = intermediate_stages(x1, y2, y3);
        // The slopes of x4 and x5 are 2 c ((y1 - y2) + y2) = 2 c y1.
        let slope = 2.0 * c * y1;
        x1 -= 0.3 * (x4 + x5) / 2.0;
        y2 -= 0.3 * (k * (2.0 * y2 - y1) - k4 * x4 * slope) / (2.0 * k + k4 * slope * slope);
        y3 -= 0.3 * (k * (2.0 * y3 - y1) + k4 * x5 * slope) / (2.0 * k + k4 * slope * slope);
    }
    let (x4, x5) = intermediate_stages(x1, y2, y3);
    let force = k * (2.0 * y1 - y2 - y3) + 2.0 * c * k4 * (x4 * (y1 - y2) - x5 * (y1 - y3));
    (force, x1)
}

#[test]
fn required_weight_holds_the_operating_point_without_displacement_in_x() {
    for point_m in [-0.0038, 0.0005, 0.0019, 0.0038] {
        for pulley in [1.0, 0.8] {
            let set = [
                format!("plant.operating_point_m={point_m}"),
                format!("campaign.pulley_ratio={pulley:?}"),
            ];
            let config = config(&[&set[0], &set[1]]);
            let (force_n, x1_m) = equilibrium(stage(&config), point_m);
            // The descent converges to rounding: 1e-16 of lengths of 4 mm and of forces of 34 N.
            assert!(x1_m.abs() < 1e-15, "{x1_m}");
            let model = StageModel::of(&config).expect("a stage");
            let load = model.required_load();
            let expected_kg = force_n / 9.80665 / pulley;
            assert!(
                (load.hung_kg / expected_kg - 1.0).abs() < 1e-9,
                "{} {expected_kg}",
                load.hung_kg
            );
            let loaded_m = model.loaded(&load).operating_point_m;
            assert!((loaded_m / point_m - 1.0).abs() < 1e-12, "{loaded_m}");
        }
    }
    // 34 N at 8 % of L, the weight of 3.5 kg: the weight in the drawing of the thesis is in kilograms, not grams.
    let config = config(&[]);
    let kg = StageModel::of(&config)
        .expect("a stage")
        .required_load()
        .hung_kg;
    assert!((3.0..4.0).contains(&kg), "{kg}");
}

#[test]
fn added_masses_give_the_asymmetry_in_whole_steps_on_one_stage() {
    for built in [-0.02, 0.0, 0.013] {
        for wanted in [-0.1, -0.05, -0.02, 0.0, 0.04, 0.1] {
            let set = [
                format!("plant.mass_asymmetry={wanted:?}"),
                format!("campaign.built_asymmetry={built:?}"),
            ];
            let config = config(&[&set[0], &set[1]]);
            let model = StageModel::of(&config).expect("a stage");
            let load = model.required_load();
            let [m2, m3] = [0.06 * (1.0 + built) + load.on_m2_kg, 0.06 + load.on_m3_kg];
            // Half a step of 0.5 g relative to m3 = 60 g. A mass on m3 makes it slightly larger: 2 % are allowed.
            assert!(
                (m2 / m3 - 1.0 - wanted).abs() <= 0.00025 / 0.06 * 1.02,
                "{built} {wanted} {load:?}"
            );
            assert!(
                load.on_m2_kg * load.on_m3_kg == 0.0,
                "masses on both stages: {load:?}"
            );
            let steps = (load.on_m2_kg + load.on_m3_kg) / 0.0005;
            assert!(
                (steps - steps.round()).abs() < 1e-9,
                "not a whole number of steps: {load:?}"
            );
            let loaded = model.loaded(&load);
            assert!((loaded.secondary_stage_mass_kg - m3).abs() < 1e-15);
            assert!((loaded.mass_asymmetry - (m2 / m3 - 1.0)).abs() < 1e-12);
        }
    }
}

#[test]
fn instructions_state_the_total_and_the_change() {
    let on = |hung_kg, on_m2_kg, on_m3_kg| Load {
        hung_kg,
        on_m2_kg,
        on_m3_kg,
    };
    let first = on(1.736, 0.006, 0.0).instructions(&Load::default());
    assert_eq!(
        first,
        [
            "weight in +Y: 1.736 kg in total (add 1.736 kg)",
            "on stage 2: 6.0 g in total (add 6.0 g)",
            "on stage 3: nothing (unchanged)"
        ]
    );
    let next = on(1.736, 0.0, 0.0035).instructions(&on(1.736, 0.006, 0.0));
    assert_eq!(
        next,
        [
            "weight in +Y: 1.736 kg in total (unchanged)",
            "on stage 2: nothing (remove 6.0 g)",
            "on stage 3: 3.5 g in total (add 3.5 g)"
        ]
    );
    let other = on(-0.5, 0.0, 0.0).instructions(&on(1.0, 0.0, 0.0));
    assert_eq!(
        other[0],
        "remove the weight from the other side; weight in -Y: 0.500 kg in total (add 0.500 kg)"
    );
    assert_eq!(
        on(0.25, 0.0, 0.0).instructions(&on(1.0, 0.0, 0.0))[0],
        "weight in +Y: 0.250 kg in total (remove 0.750 kg)"
    );
    assert_eq!(
        on(0.0, 0.0, 0.0).instructions(&on(-0.5, 0.0, 0.0))[0],
        "weight in -Y: nothing (remove 0.500 kg)"
    );
}
