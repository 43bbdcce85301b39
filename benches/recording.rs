//! Benchmark of recordings: `cargo bench --bench recording` prints ticks per second, written, opened (all checks) and
//! read.

use std::path::Path;
use std::time::Duration;

use bench_recording::{Header, Recorder, Recording};
use bench_rt::record::{LoopMessage, TickRecord};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// Two minutes at 5 kHz.
const TICKS: u64 = 600_000;

fn tick(number: u64) -> TickRecord {
    let t = number as f64 * 2e-4;
    let noise = (number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(53) - 0.5;
    TickRecord {
        tick: number,
        scheduled_ns: number * 200_000,
        position_m: 1e-4 * (30.0 * t).sin() + 1e-8 * noise,
        command_a: 0.2 * (30.0 * t).cos(),
        probe_sequence: number,
        ..TickRecord::default()
    }
}

fn write(path: &Path, ticks: &[LoopMessage]) {
    let header = Header {
        period_s: 2e-4,
        started_ns: 0,
        ..Header::default()
    };
    let mut recorder = Recorder::create(path, &header).expect("temporary file");
    ticks
        .iter()
        .for_each(|tick| recorder.record(tick).expect("room on the disk"));
    recorder.finish(&[]).expect("room on the disk");
}

fn recording(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("bench.mcap");
    let ticks: Vec<LoopMessage> = (0..TICKS).map(|n| LoopMessage::Tick(tick(n))).collect();
    let mut group = c.benchmark_group("recording of 600,000 ticks");
    group
        .throughput(Throughput::Elements(TICKS))
        .sample_size(10)
        .measurement_time(Duration::from_secs(8));
    group.bench_function("write", |b| {
        b.iter(|| {
            let _ = std::fs::remove_file(&path);
            write(&path, &ticks);
        });
    });
    group.bench_function("open", |b| {
        b.iter(|| Recording::open(&path).expect("whole").tick_count())
    });
    let opened = Recording::open(&path).expect("whole");
    let sum = || {
        opened
            .ticks()
            .expect("whole")
            .map(|t| t.expect("whole").position_m)
            .sum::<f64>()
    };
    group.bench_function("read", |b| b.iter(sum));
    group.finish();
}

criterion_group!(benches, recording);
criterion_main!(benches);
