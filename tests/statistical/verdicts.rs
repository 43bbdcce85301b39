//! Verdicts on the simulated stage at random operating points and asymmetries: none is wrong, and few are undecided.

use bench_config::Config;
use bench_experiment::Analysis;
use bench_identify::modal::Estimate;
use bench_identify::verdict::Cnmp;
use bench_test_support::identified::{analysed, config, model, stands_for, truth};
use bench_test_support::synthetic::normal;

/// Random points in the range of section 5.2.2: operating point from 0 to 8 % of L, asymmetry from -10 to +10 %.
fn points(count: usize, seed: u64) -> Vec<Vec<String>> {
    let mut normal = normal(seed);
    let mut uniform = move || {
        (normal() / 12.0 + 0.5)
            .clamp(0.0, 1.0)
            .mul_add(997.0, 0.31)
            .fract()
    };
    let set = |name: &str, value: f64| format!("{name}={value}");
    let point = |k| {
        let (y, d) = (uniform() * 0.08 * 0.0475, uniform() * 0.2 - 0.1);
        vec![
            set("plant.operating_point_m", y),
            set("plant.mass_asymmetry", d),
            set("sim.seed", f64::from(k)),
        ]
    };
    (0..count as u32).map(point).collect()
}

/// Numbers of points with the verdicts detected, excluded and undecided; asserts that none is wrong.
fn tally(count: usize, seed: u64, more: &[&str]) -> [usize; 3] {
    let mut tally = [0; 3];
    for mut sets in points(count, seed) {
        sets.extend(more.iter().map(|set| set.to_string()));
        let config = config(&sets);
        let analysis = analysed(&config, &config);
        if more.is_empty() {
            assert_modes_match(&config, &analysis);
        }
        let (verdict, pairs) = (analysis.verdict, truth(&config));
        let index = match verdict.cnmp {
            Cnmp::Detected => 0,
            Cnmp::Excluded => 1,
            Cnmp::Undecided => 2,
        };
        assert!(
            index == 2 || (index == 0) == (pairs > 0),
            "{sets:?}: {pairs} pairs, {verdict:?}"
        );
        tally[index] += 1;
    }
    tally
}

/// Every mode of the model whose residue exceeds five sigma is found, within 0.05 % of its frequency, 5 % of its damping ratio and 3 % of
/// its residue, with the correct sign. If such a mode is missing, the reason of the verdict states it.
fn assert_modes_match(config: &Config, analysis: &Analysis) {
    let modes = analysis.fit.as_ref().expect("modes").modes();
    let sigma = modes
        .iter()
        .map(|mode| mode.residue_per_kg.sigma)
        .fold(0.0, f64::max);
    for [omega, damping, residue] in model(config) {
        let Some(mode) = stands_for(&modes, omega) else {
            let is_reported_or_small =
                analysis.verdict.why.contains("are found") || residue.abs() < 5.0 * sigma;
            assert!(
                is_reported_or_small,
                "{omega} rad/s, {residue} 1/kg: {:?}",
                analysis.verdict.why
            );
            continue;
        };
        if residue.abs() < 5.0 * mode.residue_per_kg.sigma {
            continue;
        }
        let off = |e: Estimate, truth: f64| (e.value / truth - 1.0).abs();
        assert!(off(mode.omega_rad_s, omega) < 5e-4, "{omega}: {mode:?}");
        // For a small mode the bound is four sigma.
        assert!(
            off(mode.damping_ratio, damping)
                < 0.05_f64.max(4.0 * mode.damping_ratio.sigma / damping),
            "{mode:?}"
        );
        let known = 4.0 * mode.residue_per_kg.sigma / residue.abs();
        assert!(
            off(mode.residue_per_kg, residue) < 0.03_f64.max(known),
            "{residue}: {mode:?}"
        );
        assert_eq!(mode.sign() == '+', residue > 0.0);
    }
}

#[test]
fn default_chirp_gives_no_wrong_and_few_undecided_verdicts() {
    let [detected, excluded, undecided] = tally(24, 1, &[]);
    assert!(
        detected >= 3 && excluded >= 8 && undecided <= 6,
        "{detected} {excluded} {undecided}"
    );
}

#[test]
fn low_current_short_duration_or_large_noise_give_no_wrong_verdicts() {
    let half = "chirp.amplitude=[{frequency_hz=0.1,current_a=0.2},{frequency_hz=8.0,current_a=0.2},{frequency_hz=20.0,current_a=0.05},{frequency_hz=45.0,current_a=0.05},{frequency_hz=70.0,current_a=0.5}]";
    for more in [
        &[half][..],
        &["chirp.duration_s=11", "chirp.fade_in_s=0.5"],
        &["sim.probe_noise_rms_m=1e-6"],
    ] {
        let [detected, excluded, _] = tally(8, 2, more);
        // At least half of the points are decided, because undecided verdicts are never wrong.
        assert!(detected + excluded >= 4, "{more:?}: {detected} {excluded}");
    }
}
