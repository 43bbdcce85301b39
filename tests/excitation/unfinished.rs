//! A recording whose run did not come to its end is analysed, and nobody can take it for one that did.
use serde_json::Value;

use crate::program::Bench;

/// By the model the stage moves by 460 um, of 500 um that are allowed; the noise of the probe reaches some 100 um now and then.
const TRIPS: &str = "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --operating-point 8% --excitation multisine \
                     --set multisine.period_s=8 --shape model --set shape.travel_m=0.0006 --set interlock.soft_limit_m=0.0005 \
                     --set sim.probe_noise_rms_m=2.3e-5 --json";

fn text(value: &Value) -> &str {
    value
        .as_str()
        .unwrap_or_else(|| panic!("words, not {value}"))
}

#[test]
fn the_recording_of_a_run_that_tripped_says_so_beside_all_that_it_shows() {
    let bench = Bench::new();
    let answer = bench.run(TRIPS);
    assert_eq!(answer.code, 1, "{}", answer.err);
    let ran = answer.json();
    let told = format!("tripped at tick {}", ran["trip"]["tick"]);
    assert!(
        ran["frf_csv"].is_null() && ran["ticks"].as_u64() > Some(40_000),
        "half of the ten periods of 8 s: {ran}"
    );
    let recording = text(&ran["recording"]);
    let answer = bench.run(&format!("identify {recording} --json"));
    assert_eq!(
        answer.code, 3,
        "done, but not of a whole run: {}",
        answer.err
    );
    let shown = answer.json();
    assert_eq!(
        (&shown["outcome"], &shown["trip"]),
        (&ran["outcome"], &ran["trip"]),
        "as the run itself told it"
    );
    // Half of the periods show the modes as well as all do: there is a verdict, and it is not to be had without the trip.
    assert_eq!(shown["cnmp"], "detected", "{}", shown["why"]);
    assert!(text(&shown["why"]).contains(&told), "{}", shown["why"]);
    let page = std::fs::read_to_string(bench.path(text(&shown["report"]))).expect("a page");
    let (said, verdict) = (
        page.find(&told).expect("on the page"),
        page.find("<h2>Modes").expect("modes"),
    );
    assert!(said < verdict, "with the verdict, not after the figures");
    let answer = bench.run(&format!("identify {recording}"));
    let unwrapped = answer.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        unwrapped.starts_with("tripped: ") && unwrapped.contains(text(&ran["trip"]["remedy"])),
        "{}",
        answer.out
    );
}

#[test]
fn the_recording_of_a_whole_run_says_that_it_is_whole_and_a_cut_one_that_it_is_cut() {
    let bench = Bench::new();
    let ran = bench.json(
        "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --duration 20 --operating-point 8%",
    );
    let recording = text(&ran["recording"]);
    let whole = bench.json(&format!("identify {recording} --out results/again"));
    assert!(
        text(&whole["report"]).starts_with("results/again/")
            && bench.path(text(&whole["report"])).exists()
    );
    assert_eq!(
        (&whole["outcome"], &whole["trip"], &whole["why"]),
        (&ran["outcome"], &Value::Null, &ran["why"])
    );
    let bytes = std::fs::read(bench.path(recording)).expect("a recording");
    std::fs::write(bench.path("cut.mcap"), &bytes[..bytes.len() * 3 / 4]).expect("a disk");
    let answer = bench.run("identify cut.mcap --json");
    assert_eq!(answer.code, 3, "{}", answer.err);
    let cut = answer.json();
    assert_eq!(
        (&cut["outcome"], &cut["truncated"]),
        (&"cut_off".into(), &true.into())
    );
    assert!(text(&cut["why"]).contains("cut off"), "{}", cut["why"]);
}

#[test]
fn a_run_whose_recording_carries_no_response_says_where_that_recording_is() {
    let bench = Bench::new();
    // Steps of 0.1 mm: the probe sees nothing of a nanoampere.
    let still = "--set sim.probe_noise_rms_m=0 --set sim.probe_quantisation_m=1e-4 --set loop.rate_hz=1000 --stop 400";
    let answer = bench.run(&format!(
        "chirp --amplitude 1e-9 --duration 10 {still} --out kept"
    ));
    let mut files = std::fs::read_dir(bench.path("kept")).expect("a folder");
    let name = files
        .next()
        .expect("the recording")
        .expect("a name")
        .file_name()
        .to_string_lossy()
        .into_owned();
    assert_eq!(answer.code, 1, "{}", answer.err);
    assert!(
        answer.err.contains("did not see the stage") && answer.err.contains(&name),
        "{name}: {}",
        answer.err
    );
}
