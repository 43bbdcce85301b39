//! Several recordings in one plot.

use bench_identify::Unit;
use bench_report::{ReportError, StepCurve, overlay_bode_svg, overlay_steps_svg};

use crate::report::pictures::{keep, measured, short_and_noisy};
use crate::report::svg;

const FIRST: &str = "#0072B2";
const SECOND: &str = "#D55E00";

#[test]
fn overlays_two_recordings_of_the_stage_with_names_and_different_strokes() {
    let (strong, weak) = (measured(), short_and_noisy());
    let responses = [("monday.mcap", &strong), ("tuesday.mcap", &weak)];
    let svg = overlay_bode_svg(Unit::MetresPerAmpere, &responses, "Two recordings").unwrap();
    keep("overlay-bode.svg", &svg);
    let texts: Vec<String> = svg::words(&svg)
        .into_iter()
        .map(|words| words.text)
        .collect();
    for name in ["monday.mcap (band: ±2σ)", "tuesday.mcap (band: ±2σ)"] {
        assert_eq!(
            texts.iter().filter(|text| *text == name).count(),
            1,
            "{texts:?}"
        );
    }
    // A panel each for magnitude, phase and coherence; the second curve is dashed: 7 and 5 pixels.
    let groups = |text: &str| {
        svg.lines()
            .filter(|line| line.starts_with("<g data-name=") && line.contains(text))
            .count()
    };
    assert_eq!((groups("monday"), groups("tuesday")), (3, 3));
    assert_eq!((groups("data-dash=\"70 50\""), groups("data-dash")), (3, 3));
    assert!(
        !svg::points(&svg, "polygon", FIRST).is_empty()
            && !svg::points(&svg, "polygon", SECOND).is_empty()
    );
}

#[test]
fn overlays_steps_over_one_time_axis() {
    let rise = |rate: f64| -> Vec<(f64, f64)> {
        let times = (0..200).map(|k| f64::from(k) * 1e-3);
        times
            .map(|t| (t, 50e-6 * (1.0 - (-rate * t).exp())))
            .collect()
    };
    let (slow, fast) = (rise(20.0), rise(100.0));
    let curves = [
        StepCurve {
            name: "slow",
            points: &slow,
        },
        StepCurve {
            name: "fast",
            points: &fast,
        },
    ];
    let svg = overlay_steps_svg(&curves, "Two steps").unwrap();
    keep("overlay-steps.svg", &svg);
    assert!(svg.contains("data-x-unit=\"s\"") && svg.contains("data-y-unit=\"µm\""));
    assert!(
        svg.contains("<g data-name=\"slow\">") && svg.contains("<g data-name=\"fast\" data-dash")
    );
    // Both start at the same place; at 0.2 s the slower one lacks exp(-4) of the step, the faster one exp(-20). The axis has
    // a margin of 5 % at each end: 400 pixels of 1.1 steps.
    let solid = svg::points(&svg, "polyline", FIRST).pop().unwrap();
    let dashed = svg::points(&svg, "polyline", SECOND).concat();
    let highest =
        |points: &[(f64, f64)]| points.iter().map(|(_, y)| *y).fold(f64::INFINITY, f64::min);
    let curve: Vec<(f64, f64)> = dashed.into_iter().filter(|(_, y)| *y > 800.0).collect();
    let apart = highest(&solid) - highest(&curve);
    let expected = 4000.0 / 1.1 * (-4.0f64).exp();
    assert!(
        (apart - expected).abs() < 5.0,
        "{apart} instead of {expected}"
    );
}

#[test]
fn refuses_an_overlay_of_nothing() {
    assert_eq!(
        overlay_steps_svg(&[], "").unwrap_err(),
        ReportError::NoTrace
    );
    assert_eq!(
        overlay_bode_svg(Unit::Bare, &[], "").unwrap_err(),
        ReportError::NoTrace
    );
}
