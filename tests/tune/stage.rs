//! Designs for the stage of the thesis, small enough for every test run.

use bench_base::progress::Progress;
use bench_config::{Config, Source, load};
use bench_control::tuning::{
    Design, DesignOptions, DesignTask, Effort, Goal, MarginDisc, NamedPlant, Requirements,
    RigModel, SensitivityLimit, Tolerances, TuneError, design,
};

pub fn config(sets: &[&str]) -> Config {
    config_of("stage", sets)
}

fn config_of(profile: &str, sets: &[&str]) -> Config {
    load(&Source {
        config: Some(profile.into()),
        sets: sets.iter().map(|set| set.to_string()).collect(),
        ..Source::default()
    })
    .unwrap()
}

pub fn requirements(goal: Goal) -> Requirements {
    Requirements::new(goal, 0.5)
}

/// A design of order 4 for the configured operating point with its tolerances, with little effort.
pub fn task(config: &Config, requirements: Requirements) -> DesignTask {
    let plant = NamedPlant::of("8 % of L", &config.plant).unwrap();
    DesignTask::new(&RigModel::from(config), &[plant], options(requirements)).unwrap()
}

pub fn options(requirements: Requirements) -> DesignOptions {
    DesignOptions {
        requirements,
        tolerances: Tolerances {
            frequency_ratio: 0.01,
            damping_factor: 0.7,
            gain_ratio: 0.0,
        },
        unmodelled_ratio: 0.03,
        order: 4,
        effort: Effort {
            kept: 1,
            grown: 2,
            steps: 40,
            final_steps: 40,
        },
        seed: 3,
    }
}

/// The message with which a design for the stage of a profile is refused.
fn refused(profile: &str, sets: &[&str]) -> String {
    let config = config_of(profile, sets);
    let plant = NamedPlant::of("the plant", &config.plant).unwrap();
    let task = DesignTask::new(
        &RigModel::from(&config),
        &[plant],
        options(requirements(Goal::Disturbance)),
    )
    .unwrap();
    design(&task, &Progress::default()).unwrap_err().to_string()
}

fn designed(requirements: Requirements) -> Result<Design, TuneError> {
    design(&task(&config(&[]), requirements), &Progress::default())
}

#[test]
fn design_keeps_the_modulus_margin_at_all_plants_and_the_limits_at_the_operating_point() {
    let limited = Requirements {
        max_sensitivity: vec![SensitivityLimit {
            magnitude: 0.5,
            omega_rad_s: 10.0,
        }],
        max_control_sensitivity_a_per_m: Some(1e5),
        ..requirements(Goal::Bandwidth)
    };
    let found = designed(limited).unwrap();
    assert_eq!(found.figures.len(), 6);
    for figures in &found.figures {
        // Half of the reserve of 0.1 % with which the search designs.
        assert!(
            figures.stable && figures.modulus_margin > 0.4995,
            "{figures:?}"
        );
        assert!(
            figures.control_sensitivity_a_per_um < 0.1 * 1.0005,
            "{figures:?}"
        );
    }
    assert!(
        found.figures[0].sensitivity_at_10_rad_s < 0.5 * 1.001,
        "{:?}",
        found.figures[0]
    );
}

#[test]
fn equal_seeds_give_equal_designs() {
    let [first, second] =
        [(); 2].map(|()| designed(requirements(Goal::Disturbance)).unwrap().cascade);
    assert_eq!(first, second);
}

#[test]
fn rms_goal_gives_a_smaller_error_than_the_goal_disturbance() {
    let rms = designed(requirements(Goal::Rms)).unwrap();
    let disturbance = designed(requirements(Goal::Disturbance)).unwrap();
    let error_m = |design: &Design| design.figures[0].error_rms_m.unwrap();
    assert!(error_m(&rms) < error_m(&disturbance));
    // The thesis measured 0.066 um with its slow controller, with |S| near 1 at 70 Hz, where most of the floor vibrates. No loop with this
    // modulus margin has |S| below 0.3 there, with the first mode at 29 Hz and a sensitivity bandwidth below 70 Hz.
    assert!(
        (0.02e-6..0.06e-6).contains(&error_m(&rms)),
        "{}",
        error_m(&rms)
    );
}

#[test]
fn limits_that_exclude_each_other_are_named() {
    // |S| <= 0.001 at 100 rad/s is far beyond what a modulus margin of 0.5 allows with modes at 517 and 539 rad/s and order 4.
    let impossible = Requirements {
        max_sensitivity: vec![SensitivityLimit {
            magnitude: 1e-3,
            omega_rad_s: 100.0,
        }],
        ..requirements(Goal::Disturbance)
    };
    let message = designed(impossible).unwrap_err().to_string();
    for part in [
        "order 4",
        "limit of |S|",
        "modulus margin",
        "conflicts with",
        "; relax",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn design_keeps_gain_and_phase_margin_at_all_plants() {
    let disc = MarginDisc::of(0.5, Some(2.5), Some(40f64.to_radians())).unwrap();
    let limited = Requirements {
        margin_disc: disc,
        ..requirements(Goal::Disturbance)
    };
    let found = designed(limited).unwrap();
    for figures in &found.figures {
        let (gain, phase_deg) = (
            figures.gain_margin.unwrap(),
            figures.phase_margin_deg.unwrap(),
        );
        // 0.1 % of reserve on the grid of the search, and the crossings are interpolated.
        assert!((2.49..20.0).contains(&gain), "{figures:?}");
        assert!((39.8..120.0).contains(&phase_deg), "{figures:?}");
    }
    let free = designed(requirements(Goal::Disturbance)).unwrap();
    assert!(found.attained < free.attained);
}

#[test]
fn design_keeps_the_limit_of_the_rms_current() {
    // With the whole effort, since a poor design without the limit can have a larger error than a good one with it.
    let mut task = task(&config(&[]), requirements(Goal::Rms));
    task.effort = Effort::default();
    let free = design(&task, &Progress::default()).unwrap();
    let limit_a = 0.7 * free.figures[0].current_rms_a.unwrap();
    let limited = Requirements {
        max_current_rms_a: Some(limit_a),
        ..requirements(Goal::Rms)
    };
    let found = designed(limited).unwrap();
    let figures = &found.figures[0];
    // The sum over the grid of the search differs from that over the fine grid.
    assert!(
        (0.5 * limit_a..1.01 * limit_a).contains(&figures.current_rms_a.unwrap()),
        "{figures:?} for {limit_a} A"
    );
    assert!(figures.error_rms_m > free.figures[0].error_rms_m);
}

#[test]
fn gain_tolerance_adds_two_plants_that_keep_the_margin() {
    let config = config(&[]);
    let plant = NamedPlant::of("8 % of L", &config.plant).unwrap();
    let mut options = options(requirements(Goal::Disturbance));
    options.tolerances.gain_ratio = 0.1;
    let task = DesignTask::new(&RigModel::from(&config), &[plant], options).unwrap();
    let found = design(&task, &Progress::default()).unwrap();
    assert_eq!(found.figures.len(), 8);
    let names: Vec<&str> = found.figures.iter().map(|f| f.plant.as_str()).collect();
    assert!(names.contains(&"8 % of L, gain +10 %") && names.contains(&"8 % of L, gain -10 %"));
    assert!(
        found
            .figures
            .iter()
            .all(|f| f.stable && f.modulus_margin > 0.4995)
    );
}

#[test]
fn refuses_a_stage_without_a_spring_to_ground() {
    let message = refused("four-mass", &[]);
    assert!(
        message.contains("frequency zero") && message.contains("spring to ground"),
        "{message}"
    );
}

#[test]
fn refuses_a_negative_static_compliance() {
    let message = refused(
        "three-mass",
        &[
            "plant.nodes.u.sensor=-0.1148",
            "plant.nodes.v.sensor=-0.0733",
            "plant.nodes.b.sensor=-0.6873",
        ],
    );
    assert!(
        message.contains("negative") && message.contains("sign"),
        "{message}"
    );
}

/// The modes have damping ratios of 0.001: resonances and the zeros near them are narrower than the grid of the search.
#[test]
fn finds_a_controller_for_a_stage_with_little_damping() {
    let config = config_of("chapter2", &[]);
    let plant = NamedPlant::of("5 % of L", &config.plant).unwrap();
    let options = options(requirements(Goal::Disturbance));
    let task = DesignTask::new(&RigModel::from(&config), &[plant], options).unwrap();
    let found = design(&task, &Progress::default()).unwrap();
    assert!(found.misses_margin(0.5).is_none(), "{:?}", found.figures);
    assert!(found.figures.iter().all(|figures| figures.stable));
}
