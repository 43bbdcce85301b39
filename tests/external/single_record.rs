//! A record without repetition that begins and ends at rest, like every run of the bench.
use bench_identify::Signals;

use crate::external::program::{Bench, near, number};
use crate::external::signals::{STAGE, csv};

const RATE_HZ: f64 = 1000.0;

/// Advances a mode by one sample with a constant force, in eight steps of the fourth-order Runge-Kutta method.
fn step(state: (f64, f64), (hz, zeta, residue): (f64, f64, f64), force: f64) -> (f64, f64) {
    let (w, h) = (std::f64::consts::TAU * hz, 1.0 / RATE_HZ / 8.0);
    let slope = |(x, v): (f64, f64)| (v, residue * force - 2.0 * zeta * w * v - w * w * x);
    let plus = |a: (f64, f64), b: (f64, f64), t: f64| (a.0 + t * b.0, a.1 + t * b.1);
    (0..8).fold(state, |s, _| {
        let a = slope(s);
        let b = slope(plus(s, a, h / 2.0));
        let c = slope(plus(s, b, h / 2.0));
        let d = slope(plus(s, c, h));
        (
            s.0 + h / 6.0 * (a.0 + 2.0 * (b.0 + c.0) + d.0),
            s.1 + h / 6.0 * (a.1 + 2.0 * (b.1 + c.1) + d.1),
        )
    })
}

#[test]
fn sweep_from_rest_to_rest_gives_the_modes_and_the_delay_of_the_hold() {
    let force = |n: usize| {
        let t = n as f64 / RATE_HZ - 1.0;
        let sweep = (std::f64::consts::TAU * (5.0 * t + 0.5 * 15.0 * t * t)).sin();
        if (0.0..10.0).contains(&t) { sweep } else { 0.0 }
    };
    let input: Vec<f64> = (0..20_000).map(force).collect();
    let mut states = STAGE.map(|_| (0.0, 0.0));
    let mut normal = crate::external::signals::normal(5);
    let output = input.iter().map(|force| {
        let position: f64 = states.iter().map(|(x, _)| x).sum();
        states
            .iter_mut()
            .zip(STAGE)
            .for_each(|(state, mode)| *state = step(*state, mode, *force));
        // With less than 1e-7 of noise, the curvature of sin(x)/x over the band exceeds the noise and would be fitted by an additional mode.
        position + 3e-7 * normal()
    });
    let signals = Signals {
        rate_hz: RATE_HZ,
        output: output.collect(),
        input,
    };
    let bench = Bench::new();
    bench.write("data.csv", csv(&signals));
    let answer = bench
        .json("identify data.csv --input force_n --output position_m --time time_s --band 8:150");
    let modes = answer["modes"].as_array().expect("modes");
    assert_eq!(modes.len(), 2, "{answer}");
    for (mode, (hz, zeta, residue)) in modes.iter().zip(STAGE) {
        // The zero-order hold delays the force by half a sample and reduces it by sin(x)/x with x = pi f/rate: 1.3 % at 90 Hz.
        near("frequency", number(&mode["frequency_hz"]), hz, 1e-3 * hz);
        near("damping", number(&mode["damping_ratio"]), zeta, 0.03 * zeta);
        near("residue", number(&mode["residue"]), residue, 0.03 * residue);
    }
    near(
        "delay",
        number(&answer["fit_delay_s"]),
        0.5 / RATE_HZ,
        0.05 / RATE_HZ,
    );
}

/// The stage of the test above with an impulse, for which the response of each mode has a closed form.
#[test]
fn external_record_gets_the_same_plots_and_page_as_a_run() {
    let impulse = |n: usize| if n == 100 { RATE_HZ } else { 0.0 };
    let input: Vec<f64> = (0..20_000).map(impulse).collect();
    let impulse_response = |t: f64| -> f64 {
        let one = |(hz, zeta, residue): (f64, f64, f64)| {
            let w = std::f64::consts::TAU * hz;
            residue / w * (-zeta * w * t).exp() * (w * t).sin()
        };
        if t > 0.0 {
            STAGE.map(one).iter().sum()
        } else {
            0.0
        }
    };
    let mut normal = crate::external::signals::normal(5);
    let output = (0..20_000)
        .map(|n| impulse_response((n as f64 - 100.0) / RATE_HZ) + 3e-7 * normal())
        .collect();
    let bench = Bench::new();
    bench.write(
        "data.csv",
        csv(&Signals {
            rate_hz: RATE_HZ,
            output,
            input,
        }),
    );
    let answer =
        bench.json("identify data.csv --input force_n --output position_m --time time_s --band 8:150 --out seen");
    for kind in ["bode", "coherence", "nyquist", "pole_zero", "stability"] {
        let picture = bench.read(answer["plots"][kind].as_str().expect(kind));
        assert!(
            picture.starts_with("<svg") && !picture.contains("m/A"),
            "{kind}"
        );
    }
    for kind in ["loop", "sensitivity", "linearity"] {
        assert!(answer["plots"][kind].is_null(), "{kind}");
    }
    let page = bench.read(answer["report"].as_str().expect("a page"));
    let verdict = format!("<strong>{}", answer["cnmp"].as_str().expect("a verdict"));
    let words = [
        "force_n to position_m",
        "20000",
        &verdict,
        "<h2>Modes",
        "position_m per force_n and s^2",
        "<svg",
    ];
    let places: Vec<usize> = words
        .iter()
        .map(|words| page.find(words).unwrap_or_else(|| panic!("{words}")))
        .collect();
    assert!(
        places.is_sorted(),
        "the verdict must precede the modes, and the modes the plots: {places:?}"
    );
    let external = page.matches("://").count() - page.matches("http://www.w3.org").count();
    assert_eq!(external, 0, "no external references");
}
