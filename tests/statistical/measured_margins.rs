//! Coverage of the 95 % intervals of margins from measured responses.

use bench_config::{Config, Source, load};
use bench_control::{ClosedLoop, ControllerText};
use bench_experiment::{MeasuredFrf, MeasuredLoopMargins, closed_loop, measured_margins};
use bench_identify::scatter::SigmaSource;
use bench_identify::{Estimate, response};
use bench_plant::LoopPlant;
use bench_rig::simulated;
use bench_test_support::seeds::over_seeds;
use bench_test_support::unrecorded;

const SEEDS: u64 = 200;
/// 60 s of sweep: a run takes about 1/5 s on one core.
const SETS: [&str; 3] = [
    "chirp.duration_s=60",
    "chirp.start_hz=0.5",
    "chirp.quiet_after_s=5",
];

fn config(seed: u64, controller: &str) -> Config {
    let own = [
        format!("sim.seed={}", 5000 + seed),
        format!("control.controller={controller}"),
    ];
    let sets = SETS.iter().map(|set| set.to_string()).chain(own).collect();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("valid")
}

/// The loop of the plant that is simulated, unmodelled modes included.
fn simulated_loop(config: &Config) -> ClosedLoop {
    let modes = simulated::modes(&config.plant, &config.sim).expect("modes");
    let controller = ControllerText::find(&config.control.controller).expect("a controller");
    let design = controller.design(config.servo.rate_hz).expect("a design");
    let plant = LoopPlant::new(config, &modes);
    ClosedLoop::new(plant, modes, config.motor.force_constant_n_per_a, design).expect("linear")
}

/// Name, estimate and truth.
type Compared = (&'static str, Estimate, f64);

/// Name, estimate and truth of each margin and peak.
fn compared(found: &MeasuredLoopMargins, truth: &ClosedLoop) -> Vec<Compared> {
    let (margins, peaks) = (
        found.margins.as_ref().expect("stable"),
        found.peaks.as_ref().expect("stable"),
    );
    let expected = truth.margins();
    let frequencies = truth.frequencies(3.2, 3100.0);
    let peak = |of: &dyn Fn(f64) -> f64| frequencies.iter().map(|w| of(*w)).fold(0.0, f64::max);
    let s = |w: f64| (truth.sampled_loop(w) + 1.0).inv().norm();
    vec![
        (
            "crossover",
            margins.crossover_rad_s.expect("one"),
            expected.crossover_rad_s.expect("one"),
        ),
        (
            "phase margin",
            margins.phase_margin_deg.expect("one"),
            expected.phase_margin_deg.expect("one"),
        ),
        (
            "gain margin",
            margins.gain_margin_db.expect("one"),
            expected.gain_margin_db.expect("one"),
        ),
        (
            "modulus margin",
            margins.modulus_margin,
            expected.modulus_margin,
        ),
        (
            "sensitivity bandwidth",
            margins.sensitivity_bandwidth_rad_s.expect("one"),
            expected.sensitivity_bandwidth_rad_s.expect("one"),
        ),
        (
            "peak of T",
            peaks.complementary_peak,
            peak(&|w| s(w) * truth.sampled_loop(w).norm()),
        ),
        (
            "peak of P S",
            peaks.disturbance_peak_m_per_a,
            peak(&|w| s(w) * truth.sampled_plant(w).norm()),
        ),
    ]
}

fn of_seed(seed: u64, controller: &str) -> Vec<Compared> {
    let config = config(seed, controller);
    let signals = unrecorded::chirp(&config);
    let frf = response(&signals, config.chirp.band_hz(), &config.identify).expect("a response");
    let measured = MeasuredFrf {
        frf,
        recorded: None,
        sigma: SigmaSource::Given,
        cautions: Vec::new(),
    };
    let model = closed_loop(&config).expect("a loop");
    let found = measured_margins(&measured, &model, &config).expect("margins");
    compared(&found, &simulated_loop(&config))
}

/// The number of seeds whose interval contains the truth. Prints mean and RMS of the errors in sigmas.
fn covered(all: &[Vec<Compared>], k: usize) -> u64 {
    let error = |one: &Vec<Compared>| {
        let (_, estimate, truth) = one[k];
        (estimate.value - truth) / estimate.sigma
    };
    let errors: Vec<f64> = all.iter().map(error).collect();
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
    let covered = errors.iter().filter(|error| error.abs() < 1.96).count() as u64;
    let (name, first, truth) = all[0][k];
    println!(
        "{name} {truth:.5}: {covered} of {SEEDS}; sigma {:.1e}, errors: mean {mean:.2} sigma, rms {rms:.2} sigma",
        first.sigma
    );
    covered
}

#[test]
fn intervals_of_margins_contain_the_truth_in_93_to_97_percent_of_the_seeds() {
    let all = over_seeds(0..SEEDS, |seed| of_seed(seed, "fast"));
    let quantities = all[0].len();
    let covered: Vec<u64> = (0..quantities).map(|k| covered(&all, k)).collect();
    // Expected: 190 +- 3.1 of 200 for each; 2.3 standard deviations for one of seven.
    assert!(
        covered.iter().all(|n| (183..=197).contains(n)),
        "{covered:?} of {SEEDS}"
    );
    let share = covered.iter().sum::<u64>() as f64 / (quantities as u64 * SEEDS) as f64;
    assert!((0.93..=0.97).contains(&share), "{share} of all");
}
