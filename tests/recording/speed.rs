//! Figures: `cargo test --test recording speed -- --ignored --nocapture`
use std::time::Instant;

use bench::recording::Recording;

use crate::common::{run, write};

const TICKS: u64 = 600_000;

#[test]
#[ignore = "a measurement of this machine"]
fn two_minutes_at_5_khz_are_written_in_under_a_second_and_read_in_half() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("speed.mcap");
    let published = run(TICKS);

    let start = Instant::now();
    let totals = write(&path, &published);
    let writing_s = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let recording = Recording::open(&path).expect("just written");
    let opening_s = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let sum: f64 = recording.ticks().expect("just written").map(|t| t.expect("just written").position_m).sum();
    let streaming_s = start.elapsed().as_secs_f64();

    let bytes = path.metadata().expect("just written").len();
    let rate = |s: f64| TICKS as f64 / s / 1e6;
    println!("write  {writing_s:.3} s, {:.2} M ticks/s", rate(writing_s));
    println!("open   {opening_s:.3} s, {:.2} M ticks/s", rate(opening_s));
    println!("stream {streaming_s:.3} s, {:.2} M ticks/s", rate(streaming_s));
    println!("size   {:.1} bytes/tick, digest {:016x}", bytes as f64 / TICKS as f64, totals.loop_digest);
    assert!(sum.is_finite());
    assert!(writing_s < 1.0 && opening_s < 0.5 && streaming_s < 0.5);
}
