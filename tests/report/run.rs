//! Plots and page of a run, written by the program.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use bench_test_support::program::NO_DAEMON;
use serde_json::{Value, json};

use crate::report::{svg, truth};

/// A title with characters that must be escaped.
const TITLE: &str = "a <b> & \"c\"";
const PLOT_KINDS: [&str; 5] = ["bode", "coherence", "nyquist", "pole_zero", "stability"];

struct Run {
    folder: tempfile::TempDir,
    answer: Value,
}

/// The JSON object of a command in a folder.
fn answer_in(folder: &Path, arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_bench"))
        .args(arguments)
        .envs([NO_DAEMON])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

impl Run {
    fn of(arguments: &[&str]) -> Run {
        let folder = tempfile::tempdir().unwrap();
        Run {
            answer: answer_in(folder.path(), arguments),
            folder,
        }
    }

    fn path(&self, relative: &str) -> PathBuf {
        self.folder.path().join(relative)
    }

    fn pictures(&self) -> Vec<(&'static str, String)> {
        let read = |kind| {
            std::fs::read_to_string(self.path(self.answer["plots"][kind].as_str().unwrap()))
                .unwrap()
        };
        PLOT_KINDS.iter().map(|kind| (*kind, read(*kind))).collect()
    }

    fn page(&self) -> String {
        std::fs::read_to_string(self.path(self.answer["report"].as_str().unwrap())).unwrap()
    }
}

/// One chirp for all tests, of a stage with CNMP zeros.
fn run() -> &'static Run {
    static RUN: OnceLock<Run> = OnceLock::new();
    let title = format!("title={}", toml::Value::from(TITLE));
    RUN.get_or_init(|| {
        Run::of(&[
            "chirp",
            "--operating-point",
            "8%",
            "--asymmetry",
            "10%",
            "--set",
            &title,
            "--json",
        ])
    })
}

#[test]
fn writes_plots_and_page_beside_the_recording_under_its_name() {
    let answer = &run().answer;
    let recording = Path::new(answer["recording"].as_str().unwrap());
    let stem = recording.file_stem().unwrap().to_string_lossy();
    let beside = |what: &str| {
        recording
            .with_file_name(format!("{stem}_{what}"))
            .display()
            .to_string()
    };
    for kind in PLOT_KINDS {
        assert_eq!(answer["plots"][kind], beside(&format!("{kind}.svg")));
    }
    assert_eq!(answer["plot"], answer["plots"]["bode"]);
    assert_eq!(answer["report"], beside("report.html"));
}

#[test]
fn identify_replaces_plots_and_page_of_the_run() {
    let run = Run::of(&[
        "chirp",
        "--duration",
        "10",
        "--start",
        "5",
        "--stop",
        "100",
        "--json",
    ]);
    let recording = run.answer["recording"].as_str().unwrap();
    let files = || -> BTreeSet<PathBuf> {
        let entries = std::fs::read_dir(run.path(recording).parent().unwrap()).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    };
    let files_of_the_run = files();
    let page = run.page();
    std::fs::write(run.path(run.answer["report"].as_str().unwrap()), "").unwrap();
    let again = answer_in(run.folder.path(), &["identify", recording, "--json"]);
    assert_eq!(
        (&again["report"], &again["plots"]),
        (&run.answer["report"], &run.answer["plots"])
    );
    assert_eq!(files(), files_of_the_run);
    let verdict = format!("<strong>{}", again["cnmp"].as_str().unwrap());
    assert!(page.contains(&verdict) && run.page().contains(&verdict));
}

/// `bench model modes`: the modes R, u and v are at 29.274, 82.228 and 85.784 Hz.
#[test]
fn page_has_the_frequencies_of_the_modes() {
    let page = run().page();
    for frequency_hz in ["29.27", "82.2", "85.78"] {
        assert!(
            page.contains(&format!("<td class=\"n\">{frequency_hz}")),
            "{frequency_hz}"
        );
    }
}

#[test]
fn subtitle_has_the_amplitude_within_the_band_in_milliamperes() {
    let amplitude =
        "chirp.amplitude=[{frequency_hz=10.0,current_a=0.04},{frequency_hz=40.0,current_a=0.01}]";
    let run = Run::of(&[
        "chirp",
        "--duration",
        "10",
        "--start",
        "20",
        "--stop",
        "40",
        "--set",
        amplitude,
        "--db",
        "--json",
    ]);
    // Straight on logarithmic axes: 40 mA (10/20) = 20 mA at 20 Hz.
    let page = run.page();
    assert!(page.contains(" at 5000 Hz, 10.0 to 20.0 mA"));
    assert!(page.contains("Magnitude (dB re 1 m/A)") && page.contains("|H − fit| (dB re 1 m/A)"));
}

#[test]
fn identify_keeps_existing_results_in_another_folder() {
    let folder = tempfile::tempdir().unwrap();
    let recording = run().path(run().answer["recording"].as_str().unwrap());
    let recording = recording.display().to_string();
    std::fs::create_dir(folder.path().join("out")).unwrap();
    let stem = Path::new(&recording).file_stem().unwrap().to_string_lossy();
    let existing = folder.path().join(format!("out/{stem}_report.html"));
    std::fs::write(&existing, "of another run").unwrap();
    let answer = answer_in(
        folder.path(),
        &["identify", &recording, "--json", "--out", "out"],
    );
    assert_eq!(answer["report"], format!("out/{stem}_report-2.html"));
    assert_eq!(std::fs::read_to_string(existing).unwrap(), "of another run");
}

#[test]
fn labels_axes_with_quantity_and_unit() {
    let labels: [(&str, &[&str]); 5] = [
        (
            "bode",
            &[
                "Magnitude (m/A)",
                "Phase (deg)",
                "Coherence",
                "Frequency (Hz)",
            ],
        ),
        (
            "coherence",
            &[
                "Coherence (ratio)",
                "1 − coherence (ratio)",
                "Frequency (Hz)",
            ],
        ),
        (
            "nyquist",
            &["Real part of H (µm/A)", "Imaginary part of H (µm/A)"],
        ),
        (
            "pole_zero",
            &[
                "Real part of s (rad/s)",
                "Imaginary part of s (rad/s)",
                "imaginary axis",
            ],
        ),
        ("stability", &["Order (number of modes)", "Frequency (Hz)"]),
    ];
    for ((kind, picture), (named, labels)) in run().pictures().iter().zip(labels) {
        assert_eq!(*kind, named);
        for label in labels {
            assert!(picture.contains(label), "{kind}: {label}");
        }
    }
}

#[test]
fn draws_finite_coordinates_within_the_page() {
    for (kind, picture) in run().pictures() {
        for nothing in ["NaN", "inf"] {
            assert!(!picture.contains(nothing), "{kind}: {nothing}");
        }
        // Coordinates are in tenths of a pixel.
        let (width, height) = svg::page_size(&picture);
        let inside = |(x, y): &(f64, f64)| (0.0..=width).contains(x) && (0.0..=height).contains(y);
        for element in ["polyline", "polygon"] {
            assert!(
                svg::points(&picture, element, "")
                    .concat()
                    .iter()
                    .all(inside),
                "{kind}: a {element} leaves the page"
            );
        }
        for words in svg::words(&picture) {
            let within = words.left >= -1.0
                && words.right <= width + 1.0
                && words.top >= -1.0
                && words.bottom <= height + 1.0;
            assert!(within, "{kind}: {words:?}");
        }
    }
}

#[test]
fn every_plot_has_an_opaque_background_and_a_dark_style() {
    for (kind, picture) in run().pictures() {
        assert!(picture.contains("prefers-color-scheme:dark"), "{kind}");
        let (width, height) = svg::page_size(&picture);
        let first = picture
            .lines()
            .find(|line| !line.starts_with("<svg "))
            .expect("something drawn");
        assert!(
            first.starts_with("<rect ") && first.contains("fill=\"#FFFFFF\""),
            "{kind}: {first}"
        );
        let number = |name| svg::attribute(first, name).and_then(|text| text.parse::<f64>().ok());
        // Coordinates are in tenths of a pixel; a difference of one is allowed.
        for (name, whole) in [("x", 0.0), ("y", 0.0), ("width", width), ("height", height)] {
            assert!(
                number(name).is_some_and(|is| (is - whole).abs() <= 1.0),
                "{kind}: {name} in {first}"
            );
        }
    }
}

#[test]
fn plots_and_page_are_well_formed_by_other_programs() {
    let answer = &run().answer;
    let mut files: Vec<Value> = PLOT_KINDS
        .iter()
        .map(|kind| answer["plots"][kind].clone())
        .collect();
    files.push(answer["report"].clone());
    let files: Vec<Value> = files
        .iter()
        .map(|file| json!(run().path(file.as_str().unwrap())))
        .collect();
    let Some(answers) = truth::ask_of("pages.py", &files) else {
        return;
    };
    for (file, answer) in files.iter().zip(answers) {
        assert_eq!(answer["errors"], json!([]), "{file}");
        assert!(
            answer["elements"].as_u64().is_some_and(|count| count > 20),
            "{file}: {answer}"
        );
    }
}

#[test]
fn page_starts_with_verdict_and_reason_and_contains_all_sections() {
    let (page, answer) = (run().page(), &run().answer);
    let at = |text: &str| {
        page.find(text)
            .unwrap_or_else(|| panic!("`{text}` is not on the page"))
    };
    assert_eq!(answer["cnmp"], "detected");
    assert!(at("<strong>detected</strong>") < at(answer["why"].as_str().unwrap()));
    let order = [
        "<strong>",
        "<h2>Modes",
        "<h2>Zeros",
        "<svg",
        "<h2>The loop",
        "<h2>Configuration",
    ]
    .map(at);
    assert!(order.is_sorted(), "{order:?}");
    assert_eq!(page.matches("<svg ").count(), PLOT_KINDS.len());
    let modes = answer["modes"].as_array().unwrap().len();
    let zeros = answer["zeros"].as_array().unwrap().len();
    let tables = &page[at("<h2>Modes")..at("<svg")];
    assert_eq!(
        tables.matches("<tr><td").count(),
        modes + zeros,
        "one row for each mode and zero"
    );
    for text in ["virtual", "CNMP", "±", "prefers-color-scheme:dark"] {
        at(text);
    }
}

#[test]
fn page_is_self_contained_and_escapes_the_title() {
    let all = run().page();
    let (before, rest) = all.split_once("<script>").unwrap();
    let (script, after) = rest.split_once("</script>").unwrap();
    // The markup loads nothing and has no other script.
    let page = format!("{before}{after}");
    for load in ["src=", "<link", "<script", "@import", "url(", "href="] {
        assert!(!page.contains(load), "{load}");
    }
    // Nor does the script. It refers to clip paths of the page itself.
    for load in [
        "src=", "<link", "import", "fetch", "XMLHttp", "href", "http",
    ] {
        assert!(!script.contains(load), "{load}");
    }
    assert_eq!(
        script.matches("url(").count(),
        script.matches("url(#").count()
    );
    for (at, _) in page.match_indices("http") {
        assert!(
            page[at..].starts_with("http://www.w3.org/2000/svg"),
            "{}",
            &page[at..at + 60]
        );
    }
    assert!(page.contains("<h1>a &lt;b&gt; &amp; &quot;c&quot;</h1>") && !page.contains("<b>"));
}

#[test]
fn page_without_modes_has_an_undecided_verdict_and_no_pole_zero_map() {
    // 1 uA moves the stage by less than the noise of the probe.
    let run = Run::of(&[
        "chirp",
        "--amplitude",
        "1e-6",
        "--duration",
        "20",
        "--start",
        "1",
        "--stop",
        "300",
        "--json",
    ]);
    assert_eq!(
        (&run.answer["cnmp"], &run.answer["plots"]["pole_zero"]),
        (&json!("undecided"), &Value::Null)
    );
    let page = run.page();
    assert!(
        page.contains("<strong>undecided</strong>") && !page.contains("<h2>Modes"),
        "{}",
        run.answer["why"]
    );
    assert_eq!(page.matches("<svg ").count(), 3);
}
