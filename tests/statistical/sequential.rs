//! Sequential experiments over the grid of section 5.2.2: no verdict is wrong, and the motion is short.
//!
//! By default a coarse grid with one seed; `BENCH_SEQUENTIAL_SEEDS=5` takes the whole grid of 15 x 10 points with five seeds
//! (with `-- --nocapture` it prints the motion).

use bench_config::Config;
use bench_identify::verdict::Cnmp;
use bench_test_support::identified::{config, truth};
use bench_test_support::seeds::over_seeds;
use bench_test_support::sequences::decided;

/// A point of the grid: operating point as a ratio of L, asymmetry, seed.
type Point = (f64, f64, u64);

struct Outcome {
    point: Point,
    cnmp: Cnmp,
    pairs: usize,
    motion_s: f64,
    shots: usize,
    why: String,
}

/// The stage of a point as in a campaign, at 1 kHz.
fn config_of((operating_point, asymmetry, seed): Point) -> Config {
    let sets = [
        format!("plant.operating_point_m={}", operating_point * 0.0475),
        format!("plant.mass_asymmetry={asymmetry}"),
        format!("sim.seed={seed}"),
        "loop.rate_hz=1000.0".into(),
        "chirp.stop_hz=450.0".into(),
    ];
    config(&sets)
}

fn outcome(point: Point) -> Outcome {
    let config = config_of(point);
    let ended = decided(&config);
    let last = ended.shots.last().expect("a shot");
    Outcome {
        point,
        cnmp: last.cnmp,
        pairs: truth(&config),
        motion_s: ended.motion_s,
        shots: ended.shots.len(),
        why: format!("{:?}: {}", ended.end, last.why),
    }
}

fn points(rows: usize, columns: usize, seeds: u64) -> Vec<Point> {
    let at =
        |low: f64, high: f64, k: usize, n: usize| low + (high - low) * k as f64 / (n - 1) as f64;
    let mut points = Vec::new();
    for seed in 0..seeds {
        for row in 0..rows {
            for column in 0..columns {
                let own = 1 + (seed * 1_000_003) + (row * columns + column) as u64;
                points.push((
                    at(0.0, 0.08, row, rows),
                    at(-0.1, 0.1, column, columns),
                    own,
                ));
            }
        }
    }
    points
}

#[test]
fn no_verdict_is_wrong_and_the_median_motion_is_below_six_seconds() {
    let seeds = std::env::var("BENCH_SEQUENTIAL_SEEDS");
    let seeds = seeds.map(|seeds| seeds.parse().expect("a number of seeds"));
    let points = match seeds {
        Ok(seeds) => points(15, 10, seeds),
        Err(_) => points(5, 4, 1),
    };
    let outcomes = over_seeds(0..points.len() as u64, |k| outcome(points[k as usize]));
    let mut motions: Vec<f64> = outcomes.iter().map(|outcome| outcome.motion_s).collect();
    motions.sort_by(f64::total_cmp);
    let median_s = motions[motions.len() / 2];
    let undecided = outcomes.iter().filter(|o| o.cnmp == Cnmp::Undecided);
    for outcome in undecided.clone() {
        println!(
            "undecided {:?}, {} pairs: {:.2} s, {} shots: {}",
            outcome.point, outcome.pairs, outcome.motion_s, outcome.shots, outcome.why
        );
    }
    println!(
        "{} points, {} undecided, motion: median {median_s:.2} s, in all {:.0} s, at most {:.1} s",
        outcomes.len(),
        undecided.count(),
        motions.iter().sum::<f64>(),
        motions.last().expect("a point")
    );
    for outcome in &outcomes {
        let is_wrong = match outcome.cnmp {
            Cnmp::Detected => outcome.pairs == 0,
            Cnmp::Excluded => outcome.pairs > 0,
            Cnmp::Undecided => false,
        };
        assert!(
            !is_wrong,
            "{:?}, {} pairs, {:?}: {}",
            outcome.point, outcome.pairs, outcome.cnmp, outcome.why
        );
        // Without a residue, at operating point 0, no side of a zero can be known.
        let may_be_open = outcome.point.0 == 0.0;
        assert!(
            outcome.cnmp != Cnmp::Undecided || may_be_open,
            "{:?}: {}",
            outcome.point,
            outcome.why
        );
    }
    assert!((1.0..6.0).contains(&median_s), "{median_s} s");
}
