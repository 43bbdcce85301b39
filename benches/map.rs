//! Benchmark of a CNMP map: `cargo bench --bench map` prints the time of a map of 1000 x 1000 points on one thread
//! and on two; the time per map in seconds is the time per point in microseconds. `benches/map_numpy.py` measures
//! numpy's batched pencil, for comparison.

use bench_config::{PlantSettings, Source, Sr4dofSettings, load};
use bench_plant::zeros::cnmp_map;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Values along either side.
const SIDE: u32 = 1000;

fn chapter2() -> Sr4dofSettings {
    let source = Source {
        config: Some("chapter2".into()),
        ..Source::default()
    };
    match load(&source).expect("an embedded profile").plant {
        PlantSettings::Sr4dof(settings) => settings,
        other => panic!("chapter2 is an SR4DoF stage, not {}", other.model()),
    }
}

fn grid(from: f64, to: f64) -> Vec<f64> {
    (0..SIDE)
        .map(|k| from + (to - from) * f64::from(k) / f64::from(SIDE - 1))
        .collect()
}

fn map(c: &mut Criterion) {
    let settings = chapter2();
    let (points, asymmetries) = (grid(0.0, 0.15), grid(-0.1, 0.1));
    let mut group = c.benchmark_group("map of 1000 x 1000 points");
    group
        .throughput(Throughput::Elements(u64::from(SIDE * SIDE)))
        .sample_size(10);
    for (name, threads) in [("one thread", 1), ("two threads", 2)] {
        group.bench_function(name, |b| {
            b.iter(|| cnmp_map(&settings, &points, &asymmetries, threads).expect("a map"))
        });
    }
    group.finish();
}

criterion_group!(benches, map);
criterion_main!(benches);
