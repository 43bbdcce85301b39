//! Pictures of results of the model, written by `--svg` and `--html`.

use bench_report::{CnmpMap, map_svg};
use bench_test_support::program::Bench;
use serde_json::json;

use crate::report::{svg, truth};

/// A command with the labels of its axes and the number of its named curves.
struct Drawn {
    command: &'static str,
    labels: &'static [&'static str],
    curves: usize,
    shows: &'static [&'static str],
}

/// What a command prints.
fn text(bench: &Bench, arguments: &str) -> String {
    let answer = bench.run(arguments);
    assert_eq!(answer.code, 0, "bench {arguments}: {}", answer.err);
    answer.out
}

fn curves(picture: &str) -> usize {
    picture.matches("data-name=").count() - picture.matches("data-name=\"\"").count()
}

fn assert_drawn(drawn: &Drawn) {
    let bench = Bench::new();
    let text = text(
        &bench,
        &format!("{} --svg a.svg --html a.html", drawn.command),
    );
    assert!(text.contains("picture in a.svg and a.html"), "{text}");
    let files = [json!(bench.path("a.svg")), json!(bench.path("a.html"))];
    for answer in truth::ask_of("pages.py", &files).unwrap_or_default() {
        assert_eq!(answer["errors"], json!([]), "{}", drawn.command);
    }
    let (picture, page) = (bench.read("a.svg"), bench.read("a.html"));
    let words: Vec<String> = svg::words(&picture).into_iter().map(|w| w.text).collect();
    for label in drawn.labels.iter().chain(drawn.shows) {
        let shown = words.iter().any(|text| text.contains(label));
        assert!(shown, "{}: {label} is not among {words:?}", drawn.command);
    }
    assert_eq!(curves(&picture), drawn.curves, "{}", drawn.command);
    assert!(!picture.contains("NaN") && !picture.contains("inf"));
    let title = &words[0];
    let heading = page
        .split("<h1>")
        .nth(1)
        .and_then(|rest| rest.split("</h1>").next());
    let begins =
        heading.is_some_and(|heading| heading.starts_with(title.split('\'').next().unwrap()));
    assert!(begins, "{heading:?} is not {title}");
    assert!(page.contains("<figcaption>") && page.contains("<script>"));
}

#[test]
fn map_shows_regions_over_operating_point_and_asymmetry() {
    assert_drawn(&Drawn {
        command: "model map --operating-points 0%:15%:16 --asymmetries -10%:10%:21",
        labels: &["Operating point Y1o/L (%)", "Mass asymmetry m2/m3 − 1 (%)"],
        curves: 0,
        shows: &["no CNMP zeros", "1 pair of CNMP zeros"],
    });
}

/// Three tracks, each drawn in the plane and, by its real and its imaginary part, over the setting; and the changes of kind.
#[test]
fn locus_shows_zeros_in_the_plane_with_the_parameter() {
    assert_drawn(&Drawn {
        command: "model locus --vary plant.operating_point_m --from 0% --to 15% --count 61",
        labels: &[
            "Real part of s (rad/s)",
            "Imaginary part of s (rad/s)",
            "plant.operating_point_m (m)",
        ],
        curves: 3 * 3 + 1,
        shows: &["ring", "zero 1"],
    });
}

/// Two close modes, and all four beside them; the closest approach is a point.
#[test]
fn veering_shows_frequencies_over_the_parameter() {
    assert_drawn(&Drawn {
        command: "model veering",
        labels: &["Natural frequency (Hz)", "plant.operating_point_m (m)"],
        curves: 2 + 1 + 4,
        shows: &["closest: gap"],
    });
}

/// The response and the part of each of three modes with a residue, whole and at the beginning.
#[test]
fn step_shows_the_response_and_the_part_of_each_mode() {
    assert_drawn(&Drawn {
        command: "model step",
        labels: &["Time since the step (ms)", "Displacement (µm/N)"],
        curves: 2 * (1 + 3),
        shows: &["response", "part of the mode at 29.27 Hz"],
    });
}

/// Bars are areas, which are no curves; the intervals of the bars have one name.
#[test]
fn study_shows_a_histogram_and_sobol_indices() {
    assert_drawn(&Drawn {
        command: "model study --vary plant.mass_asymmetry=+-10% --vary plant.operating_point_m=+-5% --draws 2000",
        labels: &[
            "Number of pairs of CNMP zeros",
            "Probability (%)",
            "Share of the variance (%)",
        ],
        curves: 1,
        shows: &["plant.mass_asymmetry", "plant.operating_point_m", "Sobol"],
    });
}

/// Bode plot: L, three marks of margins in two panels with their names (|L| = 1, gain margin, phase margin). Each of two Nyquist plots:
/// L, |L| = 1, -1 and the three margins. Sensitivities: |S|, |T|, peak and bandwidth.
#[test]
fn margins_show_the_loop_with_its_margins() {
    assert_drawn(&Drawn {
        command: "margins --fast",
        labels: &[
            "Magnitude",
            "Phase (deg)",
            "Real part of L",
            "Imaginary part of L",
            "Frequency (Hz)",
        ],
        curves: 4 + 2 * 6 + 4,
        shows: &["phase margin", "gain margin", "modulus margin", "-1"],
    });
}

/// The asymmetry rises upward: with pairs at the larger asymmetry only, their cell is the upper one.
#[test]
fn map_has_the_larger_asymmetry_above() {
    let map = CnmpMap {
        operating_points: &[0.08],
        asymmetries: &[0.1, -0.1],
        pairs: &[vec![1, 0]],
    };
    let svg = map_svg(&map, "Map", "").unwrap();
    let centre = |colour: &str| -> f64 {
        let cells = svg::points(&svg, "polygon", colour);
        // The sample of the legend is small.
        let size = |cell: &[(f64, f64)]| (cell[2].0 - cell[0].0).abs();
        let largest = cells.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        let corners = largest.expect("a cell");
        corners.iter().map(|(_, y)| y).sum::<f64>() / corners.len() as f64
    };
    let (one_pair, no_pair) = (centre("#56B4E9"), centre("#EAEAEA"));
    assert!(one_pair < no_pair, "{one_pair} {no_pair}");
}

/// Labels along a track are apart: no two of them overlap.
#[test]
fn locus_labels_do_not_overlap() {
    let bench = Bench::new();
    for vary in [
        "--vary plant.operating_point_m --from 0% --to 15%",
        "--vary plant.mass_asymmetry --from -10% --to 10%",
    ] {
        text(
            &bench,
            &format!("model locus {vary} --count 61 --svg a.svg"),
        );
        let picture = bench.read("a.svg");
        let marks: String = picture
            .split("data-at=")
            .skip(1)
            .map(|part| {
                part.split_once('\n')
                    .unwrap()
                    .1
                    .split("</g>")
                    .next()
                    .unwrap()
            })
            .collect();
        let labels = svg::words(&marks);
        assert!((2..=6).contains(&labels.len()), "{}", labels.len());
        for (k, a) in labels.iter().enumerate() {
            for b in &labels[k + 1..] {
                let apart =
                    a.right < b.left || b.right < a.left || a.bottom < b.top || b.bottom < a.top;
                assert!(apart, "{} and {}", a.text, b.text);
            }
        }
    }
}

#[test]
fn rejects_one_file_for_two_pictures() {
    let bench = Bench::new();
    let answer = bench.run("model step --svg a --html ./a");
    assert_eq!(answer.code, 2);
    assert!(
        answer.err.contains("--svg and --html are both a"),
        "{}",
        answer.err
    );
    assert!(bench.files().is_empty());
}

#[test]
fn nothing_is_drawn_without_an_option() {
    let bench = Bench::new();
    let text = text(&bench, "model step");
    assert!(!text.contains("picture in"), "{text}");
    assert!(bench.files().is_empty());
}
