//! Pages of all kinds of runs: command and settings, results, events.

use bench_test_support::program::{Bench, number};
use serde_json::Value;

/// The page that `bench report` writes for a recording alone in a folder, without the files of its analysis.
fn page_of(bench: &Bench, recording: &str) -> String {
    let alone = bench.path("alone");
    std::fs::create_dir_all(&alone).expect("a folder");
    std::fs::copy(bench.path(recording), alone.join("run.mcap")).expect("a copy");
    let report = bench.json("report alone/run.mcap");
    bench.read(report["page"].as_str().expect("a path"))
}

/// The recording whose name ends in this way.
fn recording(bench: &Bench, ending: &str) -> String {
    let entries = std::fs::read_dir(bench.path("recordings")).expect("a folder");
    let mut names = entries.map(|entry| entry.expect("an entry").file_name());
    let found = names.find(|name| name.to_string_lossy().ends_with(ending));
    let found = found.unwrap_or_else(|| panic!("no recording {ending}"));
    format!("recordings/{}", found.to_string_lossy())
}

fn path(run: &Value) -> &str {
    run["recording"].as_str().expect("a path")
}

fn has(page: &str, parts: &[&str]) {
    for part in parts {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn page_shows_name_command_and_settings_that_differ_from_the_profile() {
    let bench = Bench::new();
    let given = [
        "--name",
        "new <flexure>",
        "--note",
        "5 % heavier",
        "--operator",
        "anna",
    ];
    let run = [
        "control",
        "--slow",
        "--duration",
        "1",
        "--seed",
        "4",
        "--json",
    ];
    let made = bench.run_with(run.into_iter().chain(given)).json();
    let page = bench.read(made["report"].as_str().expect("a path"));
    has(
        &page,
        &[
            "<title>new &lt;flexure&gt;</title>",
            "<h1>new &lt;flexure&gt;</h1>",
            "<h2>Command and settings</h2>",
            "bench control --slow --duration 1 --seed 4 --json --name &#39;new &lt;flexure&gt;&#39;",
            "<dd>5 % heavier</dd>",
            "<dd>anna</dd>",
            "<td class=\"n\">sim.seed</td><td class=\"n\">4</td><td class=\"n\">1</td>",
            "<td class=\"n\">control.duration_s</td><td class=\"n\">1.0</td>",
            "<h2>Events</h2>",
            "the program came to its end",
            "@media print",
        ],
    );
    assert!(
        !page.contains("<td class=\"n\">loop.rate_hz</td>"),
        "as in the profile"
    );
    assert_eq!(
        page,
        page_of(&bench, path(&made))
            .replace("run.mcap", path(&made).rsplit('/').next().expect("a name"))
    );
}

#[test]
fn page_of_an_excitation_has_its_analysis_without_other_files() {
    let bench = Bench::new();
    for kind in ["chirp", "multisine", "prbs", "stepped_sine"] {
        let settings = match kind {
            "chirp" => "--duration 10 --start 5 --stop 100",
            "multisine" => "--set multisine.periods=5 --set multisine.period_s=4",
            "prbs" => "--set prbs.periods=5",
            _ => "--set stepped_sine.measure_s=0.2 --start 5 --stop 100",
        };
        let run = bench.json(&format!("chirp --excitation {kind} {settings}"));
        let page = page_of(&bench, path(&run));
        let verdict = format!(
            "<strong>{}</strong>",
            run["cnmp"].as_str().expect("a verdict")
        );
        has(
            &page,
            &[
                &verdict,
                "Command and settings",
                "Frequency response",
                "<h2>The loop</h2>",
                "<h2>Events</h2>",
            ],
        );
    }
}

/// The model predicts a travel of 477 um of a limit of 500 um, and peaks of the noise exceed 80 um, so that the run trips.
#[test]
fn page_of_a_tripped_excitation_begins_with_the_trip_and_its_remedy() {
    let bench = Bench::new();
    let run = bench.run(
        "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --operating-point 8% --excitation multisine \
         --set multisine.period_s=8 --shape model --set shape.travel_m=0.0006 --set interlock.soft_limit_m=0.0005 \
         --set sim.probe_noise_rms_m=2.3e-5 --set interlock.model_error_off=noise --json",
    );
    assert_eq!(run.code, 1, "{}", run.err);
    let run = run.json();
    let page = page_of(&bench, path(&run));
    let remedy = run["trip"]["remedy"].as_str().expect("a text");
    let remedy = format!("Remedy: {}", remedy.replace('\'', "&#39;"));
    let trip = page.find(&remedy).expect("the remedy");
    assert!(page.contains("<strong>tripped</strong>"));
    assert!(trip < page.find("<h2>").expect("sections"));
}

#[test]
fn page_of_a_calibration_has_the_compliance_of_the_command_and_of_the_model() {
    let bench = Bench::new();
    let run = bench.json("calibrate --no-delay");
    let page = page_of(&bench, path(&run));
    let model_um = 1e6 * number(&run["calibration"]["chain"]["model_m_per_a"]);
    let cell = format!("<td class=\"n\">{model_um:.3} µm/A</td>");
    has(
        &page,
        &[
            "<h2>Static steps</h2>",
            &cell,
            "Command and settings",
            "<h2>Signals</h2>",
        ],
    );
}

#[test]
fn page_of_a_stage_check_compares_it_with_the_certificate() {
    let bench = Bench::new();
    let chirp = bench.json("chirp --duration 20 --out chirps");
    let certificate = chirp["certificate"].as_str().expect("a certificate");
    bench.json(&format!(
        "control --slow --duration 1 --certificate {certificate}"
    ));
    let page = page_of(&bench, &recording(&bench, "_stage-check.mcap"));
    has(
        &page,
        &[
            "the stage agrees with the certificate",
            "By the certificate",
            "Phase at",
            "<h2>Signals</h2>",
        ],
    );
}
