//! The controllers that the program delivers: recomputed with numpy and scipy, and with the margins of the program.

use bench_test_support::program::Bench;
use bench_test_support::python;

/// Indices of the operating points of 0, 2, 4, 6 and 8 % of L among the plants of `tune.py`.
const OPERATING_POINTS: [usize; 5] = [0, 12, 13, 14, 2];

/// A line of `tune.py`.
struct Figures {
    modulus_margin: f64,
    slope_bandwidth_rad_s: f64,
    pole_radius: f64,
}

fn recomputed(name: &str, rate_hz: &str) -> Option<Vec<Figures>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/bench-config/controllers/");
    let file = format!("{folder}{name}.toml");
    let lines = python::numbers("tune.py", &[&file, rate_hz], "")?;
    let figures = lines.into_iter().map(|line| Figures {
        modulus_margin: line[0],
        slope_bandwidth_rad_s: line[1],
        pole_radius: line[4],
    });
    Some(figures.collect())
}

#[test]
fn stage_disturbance_rejects_five_times_more_than_the_fast_controller_at_every_operating_point() {
    let Some(figures) = recomputed("stage-disturbance", "5000") else {
        return;
    };
    for (index, plant) in figures.iter().enumerate() {
        // The bound of the unmodelled modes is sampled at 61 frequencies there, at other ones here: 1 % of |C| U, which is at most
        // 0.5 where the distance is 0.5.
        assert!(
            plant.modulus_margin > 0.495,
            "{index}: {}",
            plant.modulus_margin
        );
        assert!(plant.pole_radius < 1.0, "{index}: {}", plant.pole_radius);
    }
    for index in OPERATING_POINTS {
        // The fast controller has 48.6 rad/s.
        let slope_rad_s = figures[index].slope_bandwidth_rad_s;
        assert!(
            (5.0 * 48.6..350.0).contains(&slope_rad_s),
            "{index}: {slope_rad_s}"
        );
    }
}

#[test]
fn lab_disturbance_has_a_modulus_margin_of_one_half_at_every_operating_point() {
    let bench = Bench::new();
    for point in ["0%", "2%", "4%", "6%", "8%"] {
        let command = "margins --config lab --controller lab-disturbance --operating-point";
        let margins = bench.json(&format!("{command} {point}"));
        let modulus_margin = margins["modulus_margin"].as_f64().unwrap();
        assert!(
            (0.4995..1.0).contains(&modulus_margin),
            "{point}: {modulus_margin}"
        );
        assert_eq!(margins["stable"], true, "{point}");
    }
}
