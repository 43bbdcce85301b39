//! The pictures of a run.

use nalgebra::Complex;

use super::AnalysedRun;
use crate::fit::{ModalFit, Order, UncertainPole, View};
use crate::identify::Unit;
use crate::identify::linearity::Linearity;
use crate::report::{
    Curve, LevelLines, OrderedMode, Place, PoleZeroMap, ReportError, Trace, bode_svg, coherence_svg, levels_svg,
    nyquist_svg, pole_zero_svg, response_svg, stability_svg,
};
use crate::session::ClosedResponses;
use crate::verdict::{self, UncertainZero};

/// The names of all pictures, as files and in JSON; two need modes, two a closed loop, the last a multisine with lines left out.
pub const KINDS: [&str; 8] =
    ["bode", "coherence", "nyquist", "pole_zero", "stability", "loop", "sensitivity", "linearity"];
/// The part of a Nyquist plot around two close modes reaches so many of their distances to either side.
const AROUND: f64 = 1.5;
const HERTZ: f64 = 2.0 * std::f64::consts::PI;

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Its name: one of [`KINDS`].
    pub kind: &'static str,
    /// What it is.
    pub heading: &'static str,
    /// How it is read.
    pub caption: String,
    /// The SVG document.
    pub svg: String,
}

/// All pictures that the run has data for.
///
/// # Errors
/// When a response is not sound, or drawing fails.
pub fn pictures(run: &AnalysedRun<'_>) -> Result<Vec<Picture>, ReportError> {
    let fit = run.analysis.fit.as_ref().ok();
    let map = fit.map(|fit| map(run, fit));
    let mut all = responses(run, fit, map.as_ref())?;
    if let (Some(fit), Some(map)) = (fit, &map) {
        all.push(pole_zero(run, map)?);
        all.push(stability(run, fit)?);
    }
    if let Some(closed) = &run.analysis.closed {
        all.extend(around(run, closed)?);
    }
    if let Some(linearity) = &run.analysis.linearity {
        all.push(levels(run, linearity)?);
    }
    Ok(all)
}

fn responses(
    run: &AnalysedRun<'_>,
    fit: Option<&ModalFit>,
    map: Option<&PoleZeroMap>,
) -> Result<Vec<Picture>, ReportError> {
    let (analysis, title, subtitle) = (run.analysis, &run.config.title, run.subtitle());
    let frequency_hz = &analysis.frf.frequency_hz;
    let fitted = fit.map(|fit| fit.response(&View::Bench(run.config), frequency_hz));
    let name = fit.map_or(String::new(), |fit| format!("fit of {} modes", fit.parameters.modes.len()));
    let mut traces = vec![
        Trace { name: "measured", curve: Curve::Measured(&analysis.frf) },
        Trace { name: "model", curve: Curve::Model { frequency_hz, response: &analysis.model } },
    ];
    traces
        .extend(fitted.as_ref().map(|response| Trace { name: &name, curve: Curve::Model { frequency_hz, response } }));
    let around = |(low, high): (f64, f64)| {
        let room = AROUND * (high - low);
        ((low - room).max(0.0) / HERTZ, (high + room) / HERTZ)
    };
    let part_hz = map.and_then(PoleZeroMap::close_pair).map(around);
    let picture = |kind, heading, caption: &str, svg| Picture { kind, heading, caption: caption.into(), svg };
    Ok(vec![
        picture(
            "bode",
            "Frequency response",
            "Magnitude, phase and coherence from current set-point to displacement: measured with its band of two sigma, the model of \
             the configuration, and the fit of modes to the measurement. Where the band reaches zero the line is faint.",
            bode_svg(&traces, title, &subtitle)?,
        ),
        picture(
            "coherence",
            "Coherence",
            "The share of the displacement's power that the current explains. Below, what is missing to 1, which noise, \
             leakage and geometry that is not linear leave over.",
            coherence_svg(&analysis.frf, title, &subtitle)?,
        ),
        picture(
            "nyquist",
            "Nyquist plot",
            "The response in the plane, as far as its magnitude is known to two sigma; to the right the closest modes, where \
             circles hold the truth with 95 %. Delay, hold and amplifier turn the curve clockwise with frequency.",
            nyquist_svg(&traces, part_hz, title, &subtitle)?,
        ),
    ])
}

/// The loop and its sensitivities, measured over model.
fn around(run: &AnalysedRun<'_>, closed: &ClosedResponses) -> Result<[Picture; 2], ReportError> {
    let frequency_hz = &closed.loop_gain.frequency_hz;
    let by_model = |of: fn(Complex<f64>) -> Complex<f64>| closed.model_loop.iter().map(|l| of(*l)).collect::<Vec<_>>();
    let (sensitivity, complementary) = (by_model(|l| (l + 1.0).inv()), by_model(|l| l / (l + 1.0)));
    let measured = |name, frf| Trace { name, curve: Curve::Measured(frf) };
    let model = |name, response| Trace { name, curve: Curve::Model { frequency_hz, response } };
    let picture = |kind, heading, caption: &str, traces: &[Trace]| {
        let subtitle = format!("the loop as sampled, with hold, amplifier and delay;\n{}", run.occasion());
        let svg = response_svg(Unit::Bare, traces, &run.config.title, &subtitle)?;
        Ok(Picture { kind, heading, caption: caption.into(), svg })
    };
    Ok([
        picture(
            "loop",
            "Loop",
            "L = P C from error to displacement, measured with its band of two sigma, and by the model.",
            &[measured("L measured", &closed.loop_gain), model("L by the model", &closed.model_loop)],
        )?,
        picture(
            "sensitivity",
            "Sensitivities",
            "S from reference to error and T from reference to displacement. The peak of S is the inverse of the modulus margin.",
            &[
                measured("S measured", &closed.sensitivity),
                measured("T measured", &closed.complementary),
                model("S by the model", &sensitivity),
                model("T by the model", &complementary),
            ],
        )?,
    ])
}

/// Output, noise and distortion, line by line.
fn levels(run: &AnalysedRun<'_>, linearity: &Linearity) -> Result<Picture, ReportError> {
    let harmonics = &linearity.harmonics;
    let periods = harmonics.periods;
    let lines = LevelLines { output: &harmonics.excited, odd: &harmonics.odd, even: &harmonics.even, periods };
    Ok(Picture {
        kind: "linearity",
        heading: "Distortion and noise",
        caption: format!(
            "RMS of the displacement a line, of the mean of {periods} periods: at the lines that were excited, and at the odd and even \
             ones that were left out, averaged over neighbours. Without distortion these lie on the noise of the mean. {}.",
            linearity.whole.words()
        ),
        svg: levels_svg(&lines, &run.config.title, &run.subtitle())?,
    })
}

/// Poles and zeros of the fit.
fn map(run: &AnalysedRun<'_>, fit: &ModalFit) -> PoleZeroMap {
    let judged = &run.analysis.verdict.zeros;
    let pole = |pole: UncertainPole| Place { s: pole.s, covariance: pole.covariance };
    let zero = |zero: &UncertainZero| Place { s: zero.s, covariance: zero.covariance };
    // A sum whose zeros cannot be found has no verdict either.
    let all = verdict::zeros(fit).unwrap_or_default();
    PoleZeroMap {
        poles: fit.poles().into_iter().map(pole).collect(),
        zeros: judged.iter().map(zero).collect(),
        others: all.iter().filter(|other| !judged.contains(other)).map(zero).collect(),
        up_to_rad_s: run.analysis.judged_up_to_rad_s,
    }
}

fn pole_zero(run: &AnalysedRun<'_>, map: &PoleZeroMap) -> Result<Picture, ReportError> {
    Ok(Picture {
        kind: "pole_zero",
        heading: "Poles and zeros",
        caption: format!(
            "Of the fit, with damping, above the real axis; hold, amplifier and delays are no part of it. Ellipses hold a zero with \
             95 %, bars through a pole each of its parts. The verdict counts what lies below {:.0} rad/s ({:.1} Hz). Each zero \
             of the verdict is drawn again, enlarged until its ellipse is seen, those nearest to the axis first.",
            map.up_to_rad_s,
            map.up_to_rad_s / HERTZ
        ),
        svg: pole_zero_svg(map, &run.config.title, &run.subtitle())?,
    })
}

fn stability(run: &AnalysedRun<'_>, fit: &ModalFit) -> Result<Picture, ReportError> {
    let mode = |term: &crate::zeros::Term| OrderedMode {
        frequency_hz: term.omega_rad_s / HERTZ,
        damping_ratio: term.damping_ratio,
    };
    let modes = |order: &Order| order.parameters.modes.iter().map(mode).collect();
    let orders: Vec<Vec<OrderedMode>> = fit.orders.iter().map(modes).collect();
    let fit_hz: Vec<f64> = fit.parameters.modes.iter().map(|term| term.omega_rad_s / HERTZ).collect();
    Ok(Picture {
        kind: "stability",
        heading: "Stability chart",
        caption: "The modes at each order that was found worth its parameters; a mode that is there stays from one order to the \
                  next, one of noise or of the search moves. Rough orders come first: the errors they may leave shrink on the way."
            .into(),
        svg: stability_svg(&orders, &fit_hz, fit.band_hz, &run.config.title, &run.subtitle())?,
    })
}
