//! Modes R, u and v of the simulated stage with noise, quantisation and unmodelled modes.
use bench_config::{Source, load};
use bench_identify::modal::Estimate;
use bench_plant::UnmodelledMode;
use bench_test_support::identified::{Truth, analysed, config, measurable, model, stands_for};
use bench_test_support::seeds::over_seeds;

#[test]
fn intervals_of_modes_contain_the_truth_in_90_to_98_percent_of_the_seeds() {
    let at = |seed: u64| config(&[format!("sim.seed={}", 1000 + seed)]);
    let truth = measurable(&model(&at(0)), &[]);
    assert_eq!(truth.len(), 3);
    let analyses = over_seeds(0..200, |seed| analysed(&at(seed), &at(seed)));
    for truth in truth {
        let mut covered = [0; 3];
        for analysis in &analyses {
            let modes = analysis.fit.as_ref().expect("modes").modes();
            let mode = stands_for(&modes, truth[0]).expect("the mode");
            let figures = [mode.omega_rad_s, mode.damping_ratio, mode.residue_per_kg];
            let within =
                |(e, t): (Estimate, f64)| usize::from((e.value - t).abs() < 1.96 * e.sigma);
            figures
                .into_iter()
                .zip(truth)
                .map(within)
                .zip(&mut covered)
                .for_each(|(within, covered)| *covered += within);
        }
        println!("{:.3} rad/s: {covered:?} of 200", truth[0]);
        // Expected: 190 +- 3.1 of 200.
        assert!(
            covered.iter().all(|covered| (180..=196).contains(covered)),
            "{truth:?}: {covered:?} of 200"
        );
    }
}

/// The fit also finds the six unmodelled modes of the simulated stage. Three of them are within 0.8 % of 282 Hz, each 1 % wide:
/// only certain sums of their parameters are well determined, so that the minimum is a narrow valley. A search that stops before
/// the minimum adds a spurious mode.
///
/// 8 seeds with 27 estimates each: the probability that one error exceeds 4.5 sigma is 1 in 700.
#[test]
fn finds_modes_closer_than_their_widths_and_no_others() {
    let at = |seed: u64| {
        let sets = [
            "plant.operating_point_m=0.0038",
            "plant.mass_asymmetry=0.1",
            &format!("sim.seed={}", 40 + seed),
        ];
        load(&Source {
            sets: sets.map(String::from).to_vec(),
            ..Source::default()
        })
        .expect("the profile is valid")
    };
    let of = |m: &UnmodelledMode| {
        [
            2.0 * std::f64::consts::PI * m.frequency_hz,
            m.damping_ratio,
            m.residue_per_kg,
        ]
    };
    let unmodelled = at(0).sim.unmodelled;
    let mut truth: Vec<Truth> = measurable(&model(&at(0)), &[])
        .into_iter()
        .chain(unmodelled.iter().map(of))
        .collect();
    truth.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for analysis in over_seeds(0..8, |seed| analysed(&at(seed), &at(seed))) {
        let modes = analysis.fit.expect("modes").modes();
        assert_eq!(modes.len(), truth.len(), "{modes:?}");
        for (mode, truth) in modes.iter().zip(&truth) {
            let figures = [mode.omega_rad_s, mode.damping_ratio, mode.residue_per_kg];
            let in_sigmas = figures
                .iter()
                .zip(truth)
                .map(|(e, t)| ((e.value - t) / e.sigma).abs())
                .fold(0.0, f64::max);
            println!("{:.3} Hz: {in_sigmas:.2} sigma", mode.frequency_hz().value);
            assert!(in_sigmas < 4.5, "{mode:?} for {truth:?}");
        }
    }
}
