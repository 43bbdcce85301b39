//! Benchmark of the analysis of a default chirp with 600,500 ticks: `cargo bench --bench identify` prints the time of
//! Welch's estimator, of the local one, and of the whole analysis of `bench chirp`, including modes and verdict.
//! `benches/welch_scipy.py` measures scipy's csd with as many samples, for comparison.

use bench_test_support::unrecorded;

use bench_config::{Config, Source, load};
use bench_identify::modal::{MeasurementChain, fit};
use bench_identify::verdict::{Certainty, Verdict, VerdictInput, verdict};
use bench_identify::{Estimator, EstimatorSettings, FrfDatum, local, welch};
use criterion::{Criterion, criterion_group, criterion_main};

/// Samples of a segment.
const SEGMENT: usize = 16_384;
const BAND_HZ: (f64, f64) = (0.1, 500.0);
/// Number of frequencies of the logarithmic grid.
const FREQUENCIES: usize = 2000;

fn config() -> Config {
    let sets = ["plant.operating_point_m=0.0038", "plant.mass_asymmetry=0.1"]
        .map(String::from)
        .to_vec();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("the profile is valid")
}

fn judged(frf_data: &[FrfDatum], config: &Config) -> Verdict {
    let chain = MeasurementChain::bench(config);
    let fit = fit(frf_data, &chain).expect("modes");
    verdict(&VerdictInput {
        fit: &fit,
        chain: &chain,
        frf_data,
        up_to_rad_s: 650.0,
        expected_modes: Some(3),
        certainty: Certainty::ONE_LOOK,
        duration_s: None,
    })
    .expect("zeros")
}

fn identify(c: &mut Criterion) {
    let config = config();
    let signals = unrecorded::chirp(&config);
    let settings = EstimatorSettings {
        frequencies: Some(FREQUENCIES),
        ..EstimatorSettings::default()
    };
    let mut group = c.benchmark_group("identify");
    group.sample_size(10);
    group.bench_function("welch", |b| {
        b.iter(|| welch::estimate(&signals, BAND_HZ, SEGMENT, Estimator::H1).expect("excited"))
    });
    group.bench_function("local, 2000 frequencies", |b| {
        b.iter(|| local::estimate(&signals, BAND_HZ, &settings).expect("excited"))
    });
    group.bench_function("local, modes and verdict", |b| {
        b.iter(|| {
            let frf = local::estimate(&signals, BAND_HZ, &settings).expect("excited");
            let verdict = judged(&frf.data, &config);
            (frf, verdict)
        })
    });
    group.finish();
}

criterion_group!(benches, identify);
criterion_main!(benches);
