//! Pictures and page: well-formed, labelled, within their frames, and self-contained.

use bench_report::{Chart, Mark, Pen, Row, Scale, ScaleKind, Symbol, colours, sheet_svg};
use proptest::prelude::*;
use serde_json::json;
use thesis_figures::page;

use crate::figures::all::{all, folder};
use crate::figures::{svg, truth};

/// Edges of the frames of a picture, in its units: left, right, top, bottom.
fn frames(picture: &str) -> Vec<[f64; 4]> {
    let frame = |points: &Vec<(f64, f64)>| {
        let xs = points.iter().map(|point| point.0);
        let ys = points.iter().map(|point| point.1);
        [
            xs.clone().fold(f64::MAX, f64::min),
            xs.fold(f64::MIN, f64::max),
            ys.clone().fold(f64::MAX, f64::min),
            ys.fold(f64::MIN, f64::max),
        ]
    };
    svg::points(picture, "polyline", "#5A5A5A")
        .iter()
        .filter(|points| points.len() == 6)
        .map(frame)
        .collect()
}

/// Asserts that all coordinates are finite and on the page, curves and areas are inside a frame, and no text is cut off.
fn assert_within_page_and_frames(what: &str, picture: &str) {
    assert!(
        !picture.contains("NaN") && !picture.contains("inf"),
        "{what}"
    );
    let (width, height) = svg::page_size(picture);
    for words in svg::words(picture) {
        let inside = words.left >= -1.0
            && words.right <= width + 1.0
            && words.top >= -1.0
            && words.bottom <= height + 1.0;
        assert!(
            inside,
            "{what}: {words:?} leaves the page of {width} x {height}"
        );
    }
    let frames = frames(picture);
    assert!(!frames.is_empty(), "{what} has no frame");
    for kind in ["polyline", "polygon"] {
        for points in svg::points(picture, kind, "") {
            assert!(
                points
                    .iter()
                    .all(|(x, y)| (0.0..=width).contains(x) && (0.0..=height).contains(y)),
                "{what}: {points:?}"
            );
            // Lines with eight points and more are curves; shorter ones are legend samples and ticks.
            let within = |frame: &[f64; 4]| {
                points.iter().all(|(x, y)| {
                    *x >= frame[0] - 1.0
                        && *x <= frame[1] + 1.0
                        && *y >= frame[2] - 1.0
                        && *y <= frame[3] + 1.0
                })
            };
            assert!(
                points.len() < 8 || frames.iter().any(within),
                "{what}: a curve leaves its frame"
            );
        }
    }
}

#[test]
fn draws_all_figures_within_page_and_frames() {
    for made in all() {
        if let Some(picture) = made.svg() {
            assert_within_page_and_frames(made.entry.number, picture);
        }
    }
}

#[test]
fn labels_every_axis_with_quantity_and_unit() {
    let without_unit = [
        "|L|",
        "|T|",
        "|S|",
        "N(x)",
        "Real part of L",
        "Imaginary part of L",
        "X",
        "Y",
    ];
    for made in all() {
        let Some(content) = made.content() else {
            continue;
        };
        for chart in content.rows.iter().flat_map(|row| &row.charts) {
            for scale in [&chart.x, &chart.y] {
                let unit = scale.label.contains('(') && scale.label.ends_with(')');
                let of_g = scale.label.contains("part of G")
                    && (chart.heading.contains("m/N") || made.entry.number.starts_with("6-"));
                let plain = without_unit.contains(&scale.label.as_str())
                    || of_g
                    || scale.label.starts_with('Δ');
                assert!(
                    unit || plain,
                    "{}: `{}` has no unit",
                    made.entry.number,
                    scale.label
                );
                assert!(
                    scale.kind != ScaleKind::Blank || scale.label.len() == 1,
                    "{}",
                    made.entry.number
                );
            }
        }
    }
}

#[test]
fn text_outside_frames_does_not_overlap() {
    for made in all() {
        let Some(picture) = made.svg() else {
            continue;
        };
        let frames = frames(picture);
        let inside = |w: &svg::Words| {
            frames
                .iter()
                .any(|f| w.left >= f[0] && w.right <= f[1] && w.top >= f[2] && w.bottom <= f[3])
        };
        let words: Vec<svg::Words> = svg::words(picture)
            .into_iter()
            .filter(|w| !inside(w))
            .collect();
        for (k, a) in words.iter().enumerate() {
            let overlap = |b: &svg::Words| {
                a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom
            };
            if let Some(b) = words[k + 1..].iter().find(|b| overlap(b)) {
                panic!("{}: {a:?} overlaps {b:?}", made.entry.number);
            }
        }
    }
}

#[test]
fn figures_and_page_are_well_formed_by_other_programs() {
    let mut files: Vec<String> = all()
        .iter()
        .filter(|made| made.svg().is_some())
        .map(|made| folder().join(made.entry.file()).display().to_string())
        .collect();
    files.push(folder().join("index.html").display().to_string());
    let Some(answers) = truth::ask_of(
        "pages.py",
        &files.iter().map(|file| json!(file)).collect::<Vec<_>>(),
    ) else {
        return;
    };
    for (file, answer) in files.iter().zip(answers) {
        assert_eq!(answer["errors"], json!([]), "{file}");
        // A figure has curves, texts and frames, the page an anchor for each figure.
        assert!(
            answer["elements"].as_u64().is_some_and(|count| count > 20),
            "{file}: {answer}"
        );
    }
}

#[test]
fn page_is_self_contained_and_has_every_entry() {
    let html = page(all());
    for load in ["src=", "<link", "<script", "@import", "url(", "href=\"http"] {
        assert!(!html.contains(load), "{load}");
    }
    for (at, _) in html.match_indices("http") {
        assert!(
            html[at..].starts_with("http://www.w3.org/2000/svg"),
            "{}",
            &html[at..at + 60]
        );
    }
    for made in all() {
        let id = made.entry.id();
        assert_eq!(html.matches(&format!("id=\"{id}\"")).count(), 1, "{id}");
        assert_eq!(html.matches(&format!("href=\"#{id}\"")).count(), 1, "{id}");
    }
    assert!(html.contains("prefers-color-scheme:dark") && html.contains("Not computed: "));
    assert_eq!(
        std::fs::read_to_string(folder().join("index.html")).expect("the page"),
        html
    );
}

#[test]
fn escapes_svg_characters_in_a_sheet() {
    let chart = Chart::new(
        "<b> & \"c\"",
        Scale::linear("a < b (1)"),
        Scale::linear("y (1)"),
    )
    .line(
        "<i>",
        Pen::solid(colours::BLUE),
        vec![(0.0, 0.0), (1.0, 1.0)],
    )
    .text((0.5, 0.5), (0.0, 0.0), "1 < 2");
    let picture = sheet_svg("T & <t>", "", &[Row::new(200.0, vec![chart])]).expect("a picture");
    assert!(!picture.contains("<b>") && !picture.contains("<i>") && !picture.contains("<t>"));
    assert!(picture.contains("1 &lt; 2") && picture.contains("T &amp; &lt;t&gt;"));
}

#[test]
fn rejects_a_sheet_without_charts() {
    assert!(
        sheet_svg("", "", &[]).is_err()
            && sheet_svg("", "", &[Row::new(100.0, Vec::new())]).is_err()
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn draws_any_values_within_page_and_frames(
        points in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 1..40),
        near in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 1..40),
        logarithmic in any::<bool>(),
        equal in any::<bool>(),
    ) {
        let scale = |label| if logarithmic { Scale::logarithmic(label) } else { Scale::linear(label) };
        let tame = points.iter().map(|(x, y)| (x.clamp(-1e12, 1e12), y.clamp(-1e12, 1e12))).collect::<Vec<_>>();
        let mut chart = Chart::new("any", scale("x (1)"), scale("y (1)"))
            .directed("a", Pen::dashed(colours::BLUE), near.clone())
            .points("b", colours::INK, Symbol::Cross, near.clone())
            .mark(Mark::Area { name: String::new(), colour: colours::GREEN, strength: 0.5, outline: near })
            .line("c", Pen::solid(colours::VERMILION), tame);
        chart.equal = equal && !logarithmic;
        // The axes show the range of the near points only.
        chart.x = chart.x.within(0.1, 3.0);
        chart.y = chart.y.within(0.1, 3.0);
        assert_within_page_and_frames("any", &sheet_svg("Any", "", &[Row::new(220.0, vec![chart.clone(), chart])]).expect("a picture"));
    }
}
