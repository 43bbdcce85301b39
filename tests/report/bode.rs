//! The Bode plot.

use bench_identify::{Frf, Unit};
use bench_report::{Curve, ReportError, Trace, bode_svg};
use nalgebra::Complex;
use proptest::prelude::*;

use crate::report::pictures::{
    self, bode, flat, frequencies, keep, measured, model, short_and_noisy,
};
use crate::report::stage::SampledPlant;
use crate::report::svg::{self, Words};

const MEASURED: &str = "#0072B2";
const MODEL: &str = "#D55E00";
/// Edges of the panels, in units of the page.
const LEFT: f64 = 780.0;
const RIGHT: f64 = 9_780.0;

/// Heading of a phase that is not unwrapped.
const NOT_UNWRAPPED: &str = "Phase between ±180°, not unwrapped: neighbouring points differ by more than 120°, or are too noisy";

const RUN: &str = "stage · operating point 8 % of L · asymmetry +10 % · chirp 0.1 to 500 Hz in 110 s at 5 kHz · 600 000 ticks, \
                   0 overruns, 0 lost · seed 1 · run-0007.mcap";

fn texts(svg: &str) -> Vec<String> {
    svg::words(svg)
        .into_iter()
        .map(|words| words.text)
        .collect()
}

fn assert_shows(svg: &str, expected: &[&str]) {
    let texts = texts(svg);
    for text in expected {
        assert!(
            texts.iter().any(|shown| shown == text),
            "{text:?} is not among {texts:?}"
        );
    }
}

/// Asserts that no text is cut off or overlaps another text, that no curve leaves the page, and that all coordinates are finite.
fn assert_layout(svg: &str) {
    let (width, height) = svg::page_size(svg);
    let words = svg::words(svg);
    for word in &words {
        let inside =
            word.left >= 0.0 && word.right <= width && word.top >= 0.0 && word.bottom <= height;
        assert!(inside, "{word:?} leaves the page");
    }
    for (k, a) in words.iter().enumerate() {
        assert!(
            words[k + 1..].iter().all(|b| !overlap(a, b)),
            "{a:?} overlaps another text"
        );
    }
    for kind in ["polyline", "polygon"] {
        for (x, y) in svg::points(svg, kind, "").concat() {
            assert!(
                (LEFT..=RIGHT).contains(&x) && (0.0..=height).contains(&y),
                "({x}, {y})"
            );
        }
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

fn overlap(a: &Words, b: &Words) -> bool {
    a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom
}

#[test]
fn labels_axes_with_units_and_names_curves_in_a_legend() {
    let svg = bode(
        "bode-run.svg",
        &measured(),
        Some(&SampledPlant::stage()),
        RUN,
    );
    assert_layout(&svg);
    assert_shows(
        &svg,
        &[
            "FRF from current to displacement",
            "Magnitude (m/A)",
            "Phase (deg)",
            "Coherence",
        ],
    );
    assert_shows(
        &svg,
        &[
            "Frequency (Hz)",
            "1",
            "10",
            "100",
            "10⁻⁴",
            "10⁻⁶",
            "0",
            "measured (band: ±2σ)",
        ],
    );
    assert!(texts(&svg).join(" ").contains("run-0007.mcap"));
}

#[test]
fn plot_of_4000_frequencies_is_smaller_than_400_kilobytes() {
    let frf = measured();
    let svg = bode("bode-run.svg", &frf, Some(&SampledPlant::stage()), RUN);
    println!("{} frequencies in {} bytes", frf.len(), svg.len());
    assert!(
        frf.len() > 4000 && (50_000..400_000).contains(&svg.len()),
        "{} bytes",
        svg.len()
    );
}

#[test]
fn draws_a_peak_narrower_than_a_pixel_to_its_top() {
    let frequency_hz = frequencies(1.0, 1000.0, 100_000);
    let mut response = vec![Complex::from(1e-4); 100_000];
    // The peak is neither the first nor the last of the 112 samples of its pixel column.
    response[50_050] = Complex::from(1e-3);
    let trace = [Trace {
        name: "peak",
        curve: Curve::Model {
            frequency_hz: &frequency_hz,
            response: &response,
        },
    }];
    let svg = bode_svg(Unit::MetresPerAmpere, &trace, "", "").unwrap();
    let curves = svg::points(&svg, "polyline", MODEL);
    // The lines are legend, magnitude and phase. The axis covers 1.12 decades, the peak one decade of it.
    let ys = curves[1].iter().map(|point| point.1);
    let (top, bottom) = ys.fold((f64::MAX, f64::MIN), |(top, bottom), y| {
        (y.min(top), y.max(bottom))
    });
    let frame = svg::points(&svg, "polyline", "#5A5A5A")[0]
        .iter()
        .map(|p| p.1)
        .fold(f64::MIN, f64::max);
    let panel = frame - svg::points(&svg, "polyline", "#5A5A5A")[0][0].1;
    assert!(
        ((bottom - top) / panel - 1.0 / 1.12).abs() < 0.01,
        "{} of {panel}",
        bottom - top
    );
    // The peak is in the middle of the axis.
    let peak = curves[1].iter().find(|point| point.1 == top).unwrap();
    assert!((peak.0 - 5290.0).abs() < 10.0, "{peak:?}");
    assert!(curves[1].len() < 4000);
}

#[test]
fn draws_measured_curve_and_band_within_the_frame() {
    let svg = bode(
        "bode-short-and-noisy.svg",
        &short_and_noisy(),
        Some(&SampledPlant::stage()),
        "8 s at 4 mA and less",
    );
    assert_layout(&svg);
    let frames = svg::points(&svg, "polyline", "#5A5A5A");
    assert_eq!(frames.len(), 3);
    let inside = |point: &(f64, f64), frame: &[(f64, f64)]| {
        point.0 >= frame[0].0
            && point.0 <= frame[1].0
            && point.1 >= frame[0].1
            && point.1 <= frame[2].1
    };
    let legend = 1;
    for points in svg::points(&svg, "polyline", MEASURED).iter().skip(legend) {
        assert!(
            points
                .iter()
                .all(|point| frames.iter().any(|frame| inside(point, frame)))
        );
    }
    // One polygon is in the legend, one around the magnitude, one around each part of the phase, which is too noisy to be unwrapped;
    // coherence has none.
    assert_shows(&svg, &[NOT_UNWRAPPED]);
    assert!(svg::points(&svg, "polygon", MEASURED).len() >= 3);
}

#[test]
fn draws_magnitudes_below_two_sigma_faint_and_ignores_them_in_the_axis() {
    let mut frf = flat();
    for k in 40..60 {
        frf.response[k] = Complex::from(1e-9);
        frf.magnitude_sigma[k] = 1e-9;
    }
    let svg = bode_svg(
        Unit::MetresPerAmpere,
        &[Trace {
            name: "measured",
            curve: Curve::Measured(&frf),
        }],
        "",
        "",
    )
    .unwrap();
    assert!(svg.contains(&format!("opacity=\"0.3\" stroke=\"{MEASURED}\"")));
    assert!(
        !texts(&svg).iter().any(|text| text.contains("10⁻⁹")),
        "{:?}",
        texts(&svg)
    );
}

#[test]
fn axes_cover_at_least_a_decade_and_half_a_turn() {
    let svg = bode("bode-flat.svg", &flat(), None, "all equal");
    assert_layout(&svg);
    assert_shows(
        &svg,
        &[
            "10⁻⁴",
            "5·10⁻⁵",
            "2·10⁻⁴",
            "\u{2212}90",
            "0",
            "90",
            "1",
            "10",
            "100",
        ],
    );
}

/// The phase starts at 0 at the lowest frequency, where the stage follows the current.
#[test]
fn unwraps_the_phase_of_a_non_minimum_phase_stage_from_0_to_below_minus_360_degrees() {
    let svg = bode(
        "bode-run.svg",
        &measured(),
        Some(&SampledPlant::stage()),
        RUN,
    );
    assert_shows(&svg, &["0", "\u{2212}180", "\u{2212}360", "\u{2212}540"]);
    let left = |point: &(f64, f64)| point.0 == LEFT;
    let begins = svg::points(&svg, "polyline", MEASURED)
        .concat()
        .into_iter()
        .filter(left)
        .nth(2)
        .unwrap()
        .1;
    let mut zero = svg::words(&svg)
        .into_iter()
        .filter(|words| words.text == "0")
        .map(|words| (words.top + words.bottom) / 2.0);
    assert!(
        zero.any(|y| (y - begins).abs() < 20.0),
        "begins at {begins}"
    );
}

#[test]
fn draws_a_gap_without_input_and_a_single_frequency_as_a_dot() {
    let mut frf = flat();
    frf.resolution_hz = frf.frequency_hz.iter().map(|f| 0.05 * f).collect();
    let keep_only = |column: &mut Vec<f64>| {
        let kept = |k: usize| k < 40 || k == 50 || k > 60;
        *column = column
            .iter()
            .enumerate()
            .filter(|(k, _)| kept(*k))
            .map(|(_, value)| *value)
            .collect();
    };
    for column in [
        &mut frf.frequency_hz,
        &mut frf.coherence,
        &mut frf.magnitude_sigma,
        &mut frf.phase_sigma_rad,
        &mut frf.resolution_hz,
    ] {
        keep_only(column);
    }
    frf.response.truncate(frf.frequency_hz.len());
    let svg = bode(
        "bode-gap.svg",
        &frf,
        None,
        "no input from 6 to 16 Hz but at one frequency",
    );
    // One line in the legend, and in each of three panels the parts below, in (one point) and above the gap.
    assert_eq!(svg::points(&svg, "polyline", MEASURED).len(), 1 + 3 * 3);
    assert!(svg.matches("<circle").count() >= 3);
}

#[test]
fn dashes_a_model_over_a_measured_curve_but_not_alone() {
    let frf = flat();
    let response = vec![Complex::from(1.5e-4); frf.len()];
    let curve = Curve::Model {
        frequency_hz: &frf.frequency_hz,
        response: &response,
    };
    let model = Trace {
        name: "model",
        curve,
    };
    let alone = bode_svg(Unit::MetresPerAmpere, std::slice::from_ref(&model), "", "").unwrap();
    assert_eq!(svg::points(&alone, "polyline", MODEL).len(), 3);
    let both = bode_svg(
        Unit::MetresPerAmpere,
        &[
            model,
            Trace {
                name: "measured",
                curve: Curve::Measured(&frf),
            },
        ],
        "",
        "",
    )
    .unwrap();
    // The curve is 900 pixels wide in each of two panels, the legend sample 26. A dash of 7 pixels every 12 pixels: 75 + 75 + 3 dashes.
    let dashes = svg::points(&both, "polyline", MODEL);
    assert_eq!(dashes.len(), 153);
    assert!(
        dashes
            .iter()
            .filter(|dash| dash[dash.len() - 1].0 - dash[0].0 == 70.0)
            .count()
            > 145
    );
}

#[test]
fn omits_the_coherence_without_a_measurement() {
    let frequency_hz = frequencies(0.5, 1000.0, 3000);
    let (stage, first) = (
        SampledPlant::stage(),
        SampledPlant::new(&[(183.9, 0.4715, 0.0088)]),
    );
    let (whole, alone) = (model(&stage, &frequency_hz), model(&first, &frequency_hz));
    let curve = |response| Curve::Model {
        frequency_hz: &frequency_hz,
        response,
    };
    let traces = [
        Trace {
            name: "stage",
            curve: curve(&whole),
        },
        Trace {
            name: "first mode",
            curve: curve(&alone),
        },
    ];
    let svg = bode_svg(Unit::MetresPerAmpere, &traces, "Model", "stage, 8 % of L").unwrap();
    keep("bode-models.svg", &svg);
    assert_layout(&svg);
    assert_shows(&svg, &["stage", "first mode", "1000"]);
    assert!(!texts(&svg).contains(&"Coherence".to_owned()));
}

#[test]
fn labels_a_narrow_band() {
    let frequency_hz = frequencies(80.0, 90.0, 500);
    let response = model(&SampledPlant::stage(), &frequency_hz);
    let trace = [Trace {
        name: "close modes",
        curve: Curve::Model {
            frequency_hz: &frequency_hz,
            response: &response,
        },
    }];
    let svg = bode_svg(Unit::MetresPerAmpere, &trace, "Close modes", "").unwrap();
    keep("bode-narrow.svg", &svg);
    assert_layout(&svg);
    assert_shows(&svg, &["80", "82", "84", "86", "88", "90"]);
}

#[test]
fn draws_a_single_frequency() {
    let trace = [Trace {
        name: "one",
        curve: Curve::Model {
            frequency_hz: &[29.3],
            response: &[Complex::from(1e-4)],
        },
    }];
    assert_layout(&bode_svg(Unit::MetresPerAmpere, &trace, "One", "").unwrap());
}

#[test]
fn wraps_long_titles_and_legends_and_escapes_svg_characters() {
    let frf = flat();
    let name = "a measured response with a <long> name & more";
    let traces: Vec<Trace> = (0..5)
        .map(|_| Trace {
            name,
            curve: Curve::Measured(&frf),
        })
        .collect();
    let svg = bode_svg(
        Unit::MetresPerAmpere,
        &traces,
        &"title ".repeat(40),
        &"x".repeat(500),
    )
    .unwrap();
    keep("bode-long.svg", &svg);
    assert_layout(&svg);
    assert!(svg.contains("&lt;long&gt; name &amp; more") && !svg.contains("<long>"));
}

fn draw(curve: Curve) -> ReportError {
    bode_svg(
        Unit::MetresPerAmpere,
        &[Trace { name: "bad", curve }],
        "",
        "",
    )
    .unwrap_err()
}

#[test]
fn rejects_invalid_traces_by_name() {
    let one = [Complex::from(1.0)];
    let two = [Complex::from(1.0), Complex::from(f64::NAN)];
    assert_eq!(
        bode_svg(Unit::MetresPerAmpere, &[], "", "").unwrap_err(),
        ReportError::NoTrace
    );
    assert_eq!(
        draw(Curve::Measured(&Frf::default())),
        ReportError::Empty { name: "bad".into() }
    );
    let error = draw(Curve::Model {
        frequency_hz: &[1.0, 2.0],
        response: &one,
    });
    assert_eq!(
        error.to_string(),
        "trace \"bad\" has 2 frequencies, but a column of 1 values; give each column one value per frequency"
    );
    for frequency_hz in [
        [0.0, 1.0],
        [2.0, 1.0],
        [-1.0, 1.0],
        [f64::NAN, 1.0],
        [1.0, f64::INFINITY],
    ] {
        let error = draw(Curve::Model {
            frequency_hz: &frequency_hz,
            response: &two,
        });
        assert!(matches!(error, ReportError::Frequency { .. }), "{error}");
    }
    let error = draw(Curve::Model {
        frequency_hz: &[1.0, 2.0],
        response: &two,
    });
    assert!(error.to_string().contains("not finite at 2 Hz"), "{error}");
    let error = draw(Curve::Model {
        frequency_hz: &[1.0],
        response: &[Complex::from(0.0)],
    });
    assert_eq!(error, ReportError::NoMagnitude);
    let ragged = Frf {
        coherence: vec![1.0],
        ..flat()
    };
    assert!(matches!(
        draw(Curve::Measured(&ragged)),
        ReportError::Lengths { values: 1, .. }
    ));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn draws_any_finite_response(
        rows in prop::collection::vec((1e-3..1e3_f64, -12.0..2.0_f64, -4.0..4.0_f64, -14.0..3.0_f64, 0.0..1.0_f64), 1..80),
        from_hz in -3.0..3.0_f64,
    ) {
        let mut frf = Frf::default();
        let mut frequency_hz = 10_f64.powf(from_hz);
        for (step, magnitude, phase, sigma, coherence) in rows {
            frequency_hz += step;
            frf.frequency_hz.push(frequency_hz);
            frf.response.push(Complex::from_polar(10_f64.powf(magnitude), phase));
            frf.coherence.push(coherence);
            frf.magnitude_sigma.push(10_f64.powf(sigma));
            frf.phase_sigma_rad.push(10_f64.powf(sigma - magnitude).min(1.8));
            frf.resolution_hz.push(step);
        }
        let model = Curve::Model { frequency_hz: &frf.frequency_hz, response: &frf.response };
        let traces = [Trace { name: "any", curve: Curve::Measured(&frf) }, Trace { name: "model", curve: model }];
        assert_layout(&bode_svg(Unit::MetresPerAmpere, &traces, "Any", "any").unwrap());
    }
}

#[test]
fn draws_the_stage_without_its_model() {
    assert_layout(&pictures::bode("bode-measured.svg", &measured(), None, RUN));
}
