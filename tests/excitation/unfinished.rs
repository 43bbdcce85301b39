//! Analysis of the recording of an incomplete run: the results state that it is incomplete.
use serde_json::Value;

use crate::excitation::program::Bench;

/// The model predicts a travel of 460 um, and the soft limit is 500 um. Rare peaks of the probe noise reach some 100 um, so that
/// the run trips.
const TRIPS: &str = "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --operating-point 8% --excitation multisine \
                     --set multisine.period_s=8 --shape model --set shape.travel_m=0.0006 --set interlock.soft_limit_m=0.0005 \
                     --set sim.probe_noise_rms_m=2.3e-5 --set interlock.model_error_off=noise --json";

fn text(value: &Value) -> &str {
    value
        .as_str()
        .unwrap_or_else(|| panic!("expected a text, there is {value}"))
}

#[test]
fn analysis_of_tripped_run_reports_the_trip() {
    let bench = Bench::new();
    let answer = bench.run(TRIPS);
    assert_eq!(answer.code, 1, "{}", answer.err);
    let run = answer.json();
    let trip_text = format!("tripped at tick {}", run["trip"]["tick"]);
    assert!(
        run["frf_csv"].is_null() && run["ticks"].as_u64() > Some(40_000),
        "half of the ten periods of 8 s: {run}"
    );
    let recording = text(&run["recording"]);
    let answer = bench.run(&format!("identify {recording} --json"));
    assert_eq!(
        answer.code, 3,
        "exit code 3: analysed, but the run is incomplete: {}",
        answer.err
    );
    let analysed = answer.json();
    assert_eq!(
        (&analysed["outcome"], &analysed["trip"]),
        (&run["outcome"], &run["trip"]),
        "the analysis and the run state the same outcome"
    );
    // Half of the periods suffice for a verdict; the trip is stated with it.
    assert_eq!(analysed["cnmp"], "detected", "{}", analysed["why"]);
    assert!(
        text(&analysed["why"]).contains(&trip_text),
        "{}",
        analysed["why"]
    );
    let page = std::fs::read_to_string(bench.path(text(&analysed["report"]))).expect("a page");
    let (trip, verdict) = (
        page.find(&trip_text).expect("on the page"),
        page.find("<h2>Modes").expect("modes"),
    );
    assert!(trip < verdict, "the trip is stated before the modes");
    let answer = bench.run(&format!("identify {recording}"));
    let unwrapped = answer.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        unwrapped.starts_with("tripped: ") && unwrapped.contains(text(&run["trip"]["remedy"])),
        "{}",
        answer.out
    );
}

#[test]
fn analysis_states_whether_the_recording_is_complete_or_truncated() {
    let bench = Bench::new();
    let run = bench.json(
        "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --duration 20 --operating-point 8%",
    );
    let recording = text(&run["recording"]);
    let whole = bench.json(&format!("identify {recording} --out results/again"));
    assert!(
        text(&whole["report"]).starts_with("results/again/")
            && bench.path(text(&whole["report"])).exists()
    );
    assert_eq!(
        (&whole["outcome"], &whole["trip"], &whole["why"]),
        (&run["outcome"], &Value::Null, &run["why"])
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

/// A logarithmic sweep from 5 to 200 Hz in 20 s, after 1 s of rest, reaches 5 Hz 40^((t - 1 s)/20 s).
fn reached_hz(time_s: f64) -> f64 {
    5.0 * 40_f64.powf((time_s - 1.0) / 20.0)
}

fn frequency_hz(mode: &Value) -> f64 {
    mode["frequency_hz"].as_f64().expect("a frequency")
}

#[test]
fn response_of_a_cut_chirp_ends_where_its_sweep_ended() {
    let bench = Bench::new();
    let run = bench.json(
        "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --sweep logarithmic --duration 20 --set chirp.quiet_before_s=1 \
         --operating-point 8%",
    );
    let bytes = std::fs::read(bench.path(text(&run["recording"]))).expect("a recording");
    let cut_at = |share: f64| {
        let length = (share * bytes.len() as f64) as usize;
        std::fs::write(bench.path("cut.mcap"), &bytes[..length]).expect("a disk");
        bench.run("identify cut.mcap --json")
    };
    let whole = run["modes"].as_array().expect("modes");
    for share in [0.55, 0.7, 0.8] {
        let answer = cut_at(share);
        assert_eq!(answer.code, 3, "{share}: {}", answer.err);
        let cut = answer.json();
        let time_s = cut["ticks"].as_f64().expect("a number") / 1e3;
        let last_hz = cut["fit_band_hz"][1].as_f64().expect("a number");
        // The loop is armed for less than 2 s before the run, and the last 5 % are faded out; data are one bin of 1/T or 0.05 % apart.
        let latest_hz = reached_hz(0.95 * time_s);
        let earliest_hz = 0.999 * reached_hz(0.95 * time_s - 2.0) - 2.0 / time_s;
        let reached = earliest_hz..=latest_hz;
        assert!(
            reached.contains(&last_hz),
            "{share}: {last_hz} Hz, {reached:?}"
        );
        let modes = cut["modes"].as_array().expect("modes");
        let below = whole
            .iter()
            .map(frequency_hz)
            .filter(|hz| *hz < 0.7 * last_hz);
        let mut compared = 0;
        for hz in below {
            let distances = modes.iter().map(|mode| (frequency_hz(mode) - hz).abs());
            let distance_hz = distances.fold(f64::INFINITY, f64::min);
            assert!(distance_hz < 1e-3 * hz, "{share}: {hz} Hz, {modes:?}");
            compared += 1;
        }
        assert!(compared > 0, "{share}: {cut}");
        // The end of the record is no mode: each mode of the band whose sign is certain is one of the run.
        for mode in modes.iter().filter(|mode| mode["sign"] != "?") {
            let hz = frequency_hz(mode);
            if hz > last_hz {
                continue;
            }
            let is_of_run = |of_run: &Value| {
                (frequency_hz(of_run) - hz).abs() < 0.02 * hz && of_run["sign"] == mode["sign"]
            };
            assert!(whole.iter().any(is_of_run), "{share}: {mode}, {whole:?}");
        }
    }
    let answer = cut_at(0.1);
    assert_eq!(answer.code, 1, "{}", answer.out);
    assert!(answer.err.contains("the sweep ended at"), "{}", answer.err);
}

/// The sweep came to its end: the whole band is excited, and nothing is faded out.
#[test]
fn chirp_that_is_cut_after_its_sweep_has_the_whole_band() {
    let bench = Bench::new();
    let run = bench.json(
        "chirp --set loop.rate_hz=1000 --start 5 --stop 200 --duration 20 --set chirp.quiet_after_s=20 --operating-point 8%",
    );
    let bytes = std::fs::read(bench.path(text(&run["recording"]))).expect("a recording");
    std::fs::write(bench.path("cut.mcap"), &bytes[..bytes.len() * 9 / 10]).expect("a disk");
    let answer = bench.run("identify cut.mcap --json");
    assert_eq!(answer.code, 3, "{}", answer.err);
    let cut = answer.json();
    assert_eq!(cut["outcome"], "cut_off");
    // Data are one bin apart, of 1/45 s and 1/40 s; the others are at most 0.05 % wide.
    let [whole, cut] = [&run, &cut].map(|of| of["fit_band_hz"][1].as_f64().expect("a number"));
    assert!((whole - cut).abs() < 0.2, "{whole} and {cut} Hz");
}

#[test]
fn error_without_response_names_the_recording() {
    let bench = Bench::new();
    // The probe has steps of 0.1 mm: the motion by 1 nA is not measurable.
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
        answer.err.contains("does not measure the stage") && answer.err.contains(&name),
        "{name}: {}",
        answer.err
    );
}
