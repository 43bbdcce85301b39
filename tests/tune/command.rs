//! `bench tune` at its process boundary.

use bench_test_support::program::Bench;

const QUICK: &str =
    "tune --order 3 --operating-points 8% --frequency-tolerance 0 --damping-factor 1";

#[test]
fn written_controller_has_the_certified_margins() {
    let bench = Bench::new();
    let certificate = bench.json(&format!("{QUICK} --set sim.unmodelled=[] --out design"));
    let margins = bench.json("margins --controller design/controller.toml");
    let plant = &certificate["plants"][0];
    for key in ["modulus_margin", "sensitivity_bandwidth_rad_s"] {
        let (ours, theirs) = (plant[key].as_f64().unwrap(), margins[key].as_f64().unwrap());
        // The certificate is the smallest value on a grid, the margins refine it; the bandwidth is interpolated on a grid of 400
        // points per decade.
        assert!(
            (ours / theirs - 1.0).abs() < 2e-3,
            "{key}: {ours} for {theirs}"
        );
    }
    assert_eq!(margins["stable"], true);
    let files = [
        "certificate.json",
        "controller.toml",
        "loop.svg",
        "nyquist.svg",
    ];
    for file in files {
        assert!(bench.path("design").join(file).is_file(), "{file}");
    }
}

#[test]
fn explains_what_limits_the_design() {
    let bench = Bench::new();
    let answer = bench.run(&format!("{QUICK} --explain --out design"));
    assert_eq!(answer.code, 0, "{}", answer.err);
    for part in [
        "slope bandwidth",
        "modulus margin",
        "Requirement that limits",
        "goal",
    ] {
        assert!(answer.out.contains(part), "{part}: {}", answer.out);
    }
}

#[test]
fn rejects_wrong_options_with_a_remedy() {
    let bench = Bench::new();
    let cases = [
        ("--max-sensitivity 0.1", "0.141@10rad/s"),
        ("--max-sensitivity 0.1@10s", "0.141@10rad/s"),
        ("--modulus-margin 1.5", "0.95"),
        ("--modulus-margin nan", "number"),
        ("--damping-factor 0", "0.01"),
        ("--operating-point 8%", "--operating-points"),
        ("--config three-mass --operating-points 8%", "leave it out"),
        ("--order 0", "20"),
    ];
    for (options, part) in cases {
        let answer = bench.run(&format!("tune --out design {options}"));
        assert_eq!(answer.code, 2, "{options}: {}", answer.err);
        assert!(answer.err.contains(part), "{options}: {}", answer.err);
    }
    assert!(bench.files().is_empty());
}
