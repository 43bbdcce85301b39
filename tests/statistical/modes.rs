//! Modes R, u and v of the simulated stage, with its noise, its quantisation and its unmodelled modes.
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use bench::config::{Source, UnmodelledMode, load};
use bench::experiment::Analysis;
use bench::identify::modal::Estimate;
use bench_test_support::identified::{Truth, analysed, config, model, stands_for};

/// On both cores.
fn both(count: u64, of: impl Fn(u64) -> Analysis + Sync) -> Vec<Analysis> {
    let (next, all) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= count {
                        break;
                    }
                    let analysis = of(seed);
                    all.lock().expect("no panic").push(analysis);
                }
            });
        }
    });
    all.into_inner().expect("no panic")
}

/// The fourth mode of the model, at 22.9 Hz, has 6e-6 of R's residue: nobody can see it, and R's takes over its static
/// compliance, r_R + r_4 (w_R/w_4)^2, two of its own sigma.
fn as_seen(modes: &[Truth]) -> Vec<Truth> {
    let (shown, unseen): (Vec<Truth>, Vec<Truth>) = modes
        .iter()
        .partition(|[_, _, residue]| residue.abs() > 1e-3);
    let taken_over = |w: f64| {
        unseen
            .iter()
            .map(|[w4, _, r4]| r4 * (w / w4).powi(2))
            .sum::<f64>()
    };
    let first = shown[0][0];
    shown
        .into_iter()
        .map(|[w, zeta, r]| [w, zeta, if w == first { r + taken_over(w) } else { r }])
        .collect()
}

#[test]
fn intervals_of_95_percent_hold_frequency_damping_and_residue_in_90_to_98_percent_of_200_seeds() {
    let at = |seed: u64| config(&[format!("sim.seed={}", 1000 + seed)]);
    let truth = as_seen(&model(&at(0)));
    assert_eq!(truth.len(), 3);
    let analyses = both(200, |seed| analysed(&at(seed), &at(seed)));
    for truth in truth {
        let mut held = [0; 3];
        for analysis in &analyses {
            let modes = analysis.fit.as_ref().expect("modes").modes();
            let mode = stands_for(&modes, truth[0]).expect("seen");
            let figures = [mode.omega_rad_s, mode.damping_ratio, mode.residue_per_kg];
            let within =
                |(e, t): (Estimate, f64)| usize::from((e.value - t).abs() < 1.96 * e.sigma);
            figures
                .into_iter()
                .zip(truth)
                .map(within)
                .zip(&mut held)
                .for_each(|(within, held)| *held += within);
        }
        println!("{:.3} rad/s: {held:?} of 200", truth[0]);
        // 190 +- 3.1 of 200.
        assert!(
            held.iter().all(|held| (180..=196).contains(held)),
            "{truth:?}: {held:?} of 200"
        );
    }
}

/// The six unmodelled modes of the simulated stage are there as well, three of them within 0.8 % of 282 Hz, each 1 % wide:
/// only certain sums of theirs are well known, and a search that crawls along such a valley ends beside it, with a mode more
/// than there is.
///
/// 8 seeds of 27 figures: one is beyond 4.5 of its errors once in 700.
#[test]
fn modes_closer_than_their_widths_are_found_and_no_other() {
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
    let mut truth: Vec<Truth> = as_seen(&model(&at(0)))
        .into_iter()
        .chain(unmodelled.iter().map(of))
        .collect();
    truth.sort_by(|a, b| a[0].total_cmp(&b[0]));
    for analysis in both(8, |seed| analysed(&at(seed), &at(seed))) {
        let modes = analysis.fit.expect("modes").modes();
        assert_eq!(modes.len(), truth.len(), "{modes:?}");
        for (mode, truth) in modes.iter().zip(&truth) {
            let figures = [mode.omega_rad_s, mode.damping_ratio, mode.residue_per_kg];
            let off = figures
                .iter()
                .zip(truth)
                .map(|(e, t)| ((e.value - t) / e.sigma).abs())
                .fold(0.0, f64::max);
            println!("{:.3} Hz: {off:.2} sigma", mode.frequency_hz().value);
            assert!(off < 4.5, "{mode:?} for {truth:?}");
        }
    }
}
