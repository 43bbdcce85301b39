//! Feedforward with preview beside ZPETC, for a stage with CNMP zeros, in an independent simulation.

use bench_excitation::command::Taps;
use serde_json::{Value, json};

use crate::command::program::{Bench, near, number};
use crate::command::{plan, truth};

/// Ticks of the reference: 3 s of rest, a move, and 5 s of rest at 5 kHz.
const TICKS: u64 = 40_000;
const REST_TICKS: u64 = 15_000;

fn taps(taps: &Taps) -> Value {
    let taps = taps.as_slice().iter();
    taps.map(|tap| json!([tap.delay_ticks, tap.weight]))
        .collect()
}

/// A move of 50 um in 80 ms: a polynomial of fifth degree with zero speed and acceleration at both ends.
fn smooth_move_m(tick: u64) -> f64 {
    let x = (tick.saturating_sub(REST_TICKS) as f64 / 400.0).min(1.0);
    50e-6 * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
}

/// The figures of docs/feedforward.md.
#[test]
fn preview_tracks_a_stage_with_cnmp_zeros_better_than_zpetc() {
    let plan = plan(&["control.feedforward.kind=inverse"]);
    let filter = plan.command_filter().expect("a command");
    let samples: Vec<f64> = (0..TICKS).map(smooth_move_m).collect();
    let question = json!({
        "config": Bench::new().json("config show"),
        "reference": taps(filter.reference()), "feedforward": taps(filter.feedforward()),
        "samples": samples, "sine_hz": [5.0, 10.0, 20.0],
    });
    let Some(answers) = truth::ask_of("zpetc.py", &[question]) else {
        return;
    };
    let answer = &answers[0];
    // The pair of CNMP zeros near 12.8 +- 530j rad/s (READING of the thesis), and one zero of sampling.
    assert_eq!(answer["zeros_outside"], 3);
    let sines = |method: &str| -> Vec<f64> {
        let sines = answer[method]["sines"].as_array().expect("numbers");
        sines.iter().map(number).collect()
    };
    let (preview, zpetc, feedback) = (sines("preview"), sines("zpetc"), sines("feedback"));
    for k in 0..3 {
        // The ripple of F is 0.1 %, and its taps are cut off at 2e-4.
        assert!(preview[k] < 2e-3, "{preview:?}");
        assert!(preview[k] < zpetc[k] && zpetc[k] < feedback[k], "{answer}");
    }
    // |S| times 1 - (1 - (w/530)^2)^2 at 125.7 rad/s: 0.448 x 0.109.
    near("ZPETC at 20 Hz", zpetc[2], 0.448 * 0.109, 0.002);
    let peak_m = |method: &str| number(&answer[method]["peak_m"]);
    let (preview_m, zpetc_m) = (peak_m("preview"), peak_m("zpetc"));
    assert!(
        preview_m < 0.5 * zpetc_m && zpetc_m < 0.1 * peak_m("feedback"),
        "{answer}"
    );
}
