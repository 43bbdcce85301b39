//! `bench tune --frf` and `--campaign` at the process boundary.

use bench_experiment::certificate::sha256;
use bench_test_support::program::{Bench, number};

const QUICK: &str = "--order 4 --without-bound --frequency-tolerance 0 --damping-factor 1";

/// A chirp of 40 s on the simulated stage: its FRF and its recording.
fn chirp(bench: &Bench, options: &str, out: &str) -> (String, String) {
    let answer = bench.json(&format!(
        "chirp --duration 40s --pace virtual --out {out} {options}"
    ));
    let text = |key: &str| answer[key].as_str().expect("a path").to_string();
    (text("frf_csv"), text("recording"))
}

#[test]
fn frf_gives_a_controller_a_certificate_with_its_source_and_a_page() {
    let bench = Bench::new();
    let (frf, _) = chirp(&bench, "", "runs");
    let certificate = bench.json(&format!("tune {QUICK} --frf {frf} --out design"));
    let source = &certificate["frfs"][0];
    assert_eq!(source["file"], frf.as_str());
    assert_eq!(source["sha256"], sha256(&bench.read(&frf)).as_str());
    assert_eq!(source["stability"], "stable");
    assert_eq!(source["cnmp"], "detected");
    assert!(certificate["plants"][0]["error_rms_m"].is_null());
    let lower = number(&source["modulus_margin_lower"]);
    let interval = &source["modulus_margin"];
    assert!(
        lower >= 0.5 && lower < number(&interval["value"]),
        "{source}"
    );
    // The margins of another command with the same response.
    let margins = bench.json(&format!(
        "margins --controller design/controller.toml --frf {frf}"
    ));
    let theirs = number(&margins["measured"]["margins"]["modulus_margin"]["value"]);
    assert!(
        (number(&interval["value"]) / theirs - 1.0).abs() < 1e-3,
        "{theirs}"
    );
    let page = bench.read("design/report.html");
    for part in [
        "Measured responses",
        "FRF 1",
        "What limits the design",
        "prefers-color-scheme:dark",
        &sha256(&bench.read(&frf)),
    ] {
        assert!(page.contains(part), "{part}");
    }
    for external in ["src=\"http", "href=\"http", "url(http"] {
        assert!(!page.contains(external), "{external}");
    }
}

#[test]
fn recordings_are_named_by_their_operating_points_and_refused_twice_or_at_different_rates() {
    let bench = Bench::new();
    let (_, first) = chirp(&bench, "", "a");
    let (_, again) = chirp(&bench, "--seed 7", "b");
    let (_, slow) = chirp(&bench, "--operating-point 4% --set loop.rate_hz=2000", "c");
    bench
        .run(&format!("tune {QUICK} --out d --frf {first} --frf {again}"))
        .is_refused(&[
            "8 % of L, D +10 %",
            "same operating point",
            "chirp.repetitions",
        ]);
    bench
        .run(&format!("tune {QUICK} --out d --frf {first} --frf {slow}"))
        .is_refused(&["5000 Hz", "2000 Hz", "loop.rate_hz"]);
    bench
        .run(&format!("tune {QUICK} --out d --frf {slow}"))
        .is_refused(&["loop.rate_hz", "2000"]);
}

#[test]
fn refuses_options_of_the_model_and_files_that_are_no_responses() {
    let bench = Bench::new();
    bench.write("other.csv", "a,b\n1,2\n");
    bench.write("micrometres.csv", "frequency_hz,magnitude_um_per_a,phase_deg,coherence,magnitude_sigma,phase_sigma_deg,resolution_hz\n");
    let cases: [(&str, &[&str]); 7] = [
        (
            "--frf other.csv --goal rms",
            &["--goal rms", "--goal disturbance"],
        ),
        (
            "--frf other.csv --operating-points 8%",
            &["--operating-points", "--frf"],
        ),
        (
            "--frf other.csv --operating-point 8%",
            &["--operating-point", "--frf"],
        ),
        (
            "--frf other.csv --asymmetry 5%",
            &["--asymmetry", "leave it out"],
        ),
        ("--frf other.csv --campaign there", &["--campaign", "--frf"]),
        (
            "--frf other.csv",
            &["other.csv", "no column of the frequency"],
        ),
        (
            "--frf micrometres.csv",
            &["magnitude_um_per_a", "magnitude_m_per_a"],
        ),
    ];
    for (options, words) in cases {
        bench
            .run(&format!("tune --out d {options}"))
            .is_refused(words);
    }
}

#[test]
fn campaign_without_recordings_is_refused_with_the_option_that_keeps_them() {
    let bench = Bench::new();
    std::fs::create_dir(bench.path("empty")).unwrap();
    let tune = |folder: &str| bench.run(&format!("tune {QUICK} --out d --campaign {folder}"));
    tune("missing").is_refused(&["missing", "campaign.json", "--keep-recordings"]);
    tune("empty").is_refused(&["empty", "campaign.json", "--keep-recordings"]);
    let settings =
        r#"{"format": "bench campaign 1", "operating_points": [0.04, 0.08], "asymmetries": [0.1]}"#;
    bench.write("empty/campaign.json", settings);
    tune("empty").is_refused(&["no recordings", "--keep-recordings"]);
    let short = settings.replace('{', r#"{"method": "until_decided", "#);
    bench.write("empty/campaign.json", short);
    tune("empty").is_refused(&["short chirps", "--single-chirp --keep-recordings"]);
    bench.write("empty/campaign.json", "{}");
    tune("empty").is_refused(&["not the folder of a campaign"]);
}

#[test]
fn campaign_gives_one_controller_for_all_its_points() {
    let bench = Bench::new();
    let points =
        "--operating-points 6%:8%:2 --asymmetries 5%:10%:2 --single-chirp --keep-recordings";
    // The points of a campaign are measured at 1 kHz.
    let sets = "--set chirp.duration_s=30";
    bench.json(&format!("campaign {points} {sets} --out stage"));
    let rate = "--set loop.rate_hz=1000 --set chirp.stop_hz=450";
    let tune = format!("tune {QUICK} {rate} --campaign stage --out design");
    bench
        .run(&format!("{tune} --asymmetry 7%"))
        .is_refused(&["--asymmetry", "+5 %, +10 %"]);
    let certificate = bench.json(&format!("{tune} --asymmetry 10%"));
    let names: Vec<&str> = certificate["frfs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|frf| frf["plant"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["6 % of L, D +10 %", "8 % of L, D +10 %"]);
}
