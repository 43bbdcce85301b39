//! `bench identify --reference`: a stage in a loop, with the closed form of its modes.
use std::f64::consts::TAU;
use std::fmt::Write;

use nalgebra::Complex;

use crate::external::program::{Bench, number};
use crate::external::signals::normal;

/// Modes: hertz, damping ratio, residue. The zero is at -2.058 +- 194.31j rad/s.
const STAGE: [(f64, f64, f64); 2] = [(12.0, 0.02, 1.0), (38.0, 0.01, 0.6)];
const RATE_HZ: f64 = 500.0;
const COLUMNS: &str =
    "identify loop.csv --time time_s --input force_n --output pos_m --hold zoh --out results";

/// A loop with the force f = 2000 e + 8 (e[k] - e[k-1])/T, e = r - y, and a swept set-point of 1 mm from 3 to 60 Hz: with the pole p of a
/// mode, x[k + 1] = a x[k] + (a - 1)/p f[k], a = exp(p T), and its position r Im x/Im p. The noise is 3 um.
fn loop_csv() -> String {
    let mut noise = normal(5);
    let poles =
        STAGE.map(|(hz, zeta, _)| Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * TAU * hz);
    let mut states = [Complex::new(0.0, 0.0); 2];
    let mut previous = 0.0;
    let mut text = "time_s,ref_m,force_n,pos_m\n".to_string();
    for k in 0..15_000 {
        let t = f64::from(k) / RATE_HZ - 1.0;
        let ends = (t.min(26.0 - t) / 0.5).clamp(0.0, 1.0);
        let reference = 1e-3 * (TAU * (3.0 + 28.5 * t / 26.0) * t).sin() * ends;
        let positions = states.iter().zip(poles).zip(STAGE);
        let position: f64 = positions.map(|((x, p), mode)| mode.2 * x.im / p.im).sum();
        let measured = position + 3e-6 * noise();
        let error = reference - measured;
        let force = 2000.0 * error + 8.0 * RATE_HZ * (error - previous);
        previous = error;
        for (x, p) in states.iter_mut().zip(poles) {
            let a = (p / RATE_HZ).exp();
            *x = a * *x + (a - 1.0) / p * force;
        }
        writeln!(text, "{},{reference:e},{force:e},{measured:e}", t + 1.0).expect("a text");
    }
    text
}

#[test]
fn identifies_closed_loop_with_reference() {
    let bench = Bench::new();
    bench.write("loop.csv", loop_csv());
    let answer = bench.json(&format!("{COLUMNS} --reference ref_m"));
    assert_eq!(answer["reference"], "ref_m");
    assert_eq!(answer["cnmp"], "excluded", "{}", answer["why"]);
    let modes = answer["modes"].as_array().expect("modes");
    assert_eq!(modes.len(), 2, "{modes:?}");
    for (mode, (hz, zeta, residue)) in modes.iter().zip(STAGE) {
        for (name, truth) in [
            ("frequency_hz", hz),
            ("damping_ratio", zeta),
            ("residue", residue),
        ] {
            let sigma = number(&mode[format!("{name}_sigma")]);
            assert!(
                (number(&mode[name]) - truth).abs() < 5.0 * sigma,
                "{name}: {mode}"
            );
            assert!(sigma < 1e-2 * truth, "{name}: {mode}");
        }
    }
    let text = bench.run(&format!("{COLUMNS} --reference ref_m")).out;
    assert!(
        text.contains("reference  `ref_m`, of a closed loop"),
        "{text}"
    );
    let page = answer["report"].as_str().expect("a page");
    let page = bench.read(page);
    assert!(page.contains("Reference of the closed loop"), "{page}");
}

#[test]
fn reference_is_null_without_the_option() {
    let bench = Bench::new();
    bench.write("loop.csv", loop_csv());
    let answer = bench.json(COLUMNS);
    assert!(answer["reference"].is_null(), "{}", answer["reference"]);
}

#[test]
fn reference_that_is_another_column_or_none_is_refused() {
    let bench = Bench::new();
    let constant = "0,0,1,2\n0.002,0,2,1\n".repeat(100);
    let lines = constant.lines().enumerate().map(|(k, line)| {
        let cells = line.split_once(',').map_or("", |(_, cells)| cells);
        format!("{},{cells}\n", k as f64 / RATE_HZ)
    });
    let rows: String = lines.collect();
    bench.write("loop.csv", format!("time_s,ref_m,force_n,pos_m\n{rows}"));
    for (option, words) in [
        ("--reference force_n", &["`force_n` is selected twice"][..]),
        ("--reference pos_m", &["`pos_m` is selected twice"]),
        ("--reference time_s", &["`time_s` is selected twice"]),
        (
            "--reference ref",
            &["no column `ref`", "time_s, ref_m, force_n, pos_m"],
        ),
        (
            "--reference ref_m",
            &["the reference is 0 at every one of 200 samples"],
        ),
        (
            "--reference ref_m --period 50",
            &[
                "--reference is not used with --period",
                "leave out --reference",
            ],
        ),
    ] {
        let answer = bench.run(&format!("{COLUMNS} {option}"));
        assert_ne!(answer.code, 0, "{option}");
        for word in words {
            assert!(answer.err.contains(word), "`{word}`: {}", answer.err);
        }
    }
    let answer = bench.run("identify loop.mcap --reference ref_m");
    answer.is_refused(&["--input"]);
}
