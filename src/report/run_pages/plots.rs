//! The pictures of a record.

use super::{ReportSource, Shown};
use crate::identify::modal::{ModalFit, ModelOrder, UncertainPole};
use crate::identify::verdict::{self, UncertainZero};
use crate::report::{
    Curve, OrderedMode, Place, PoleZeroMap, ReportError, Trace, bode_svg, coherence_svg,
    nyquist_svg, pole_zero_svg, stability_svg,
};

/// The names of all pictures, as files and in JSON; two need modes, two a closed loop, the last a multisine with lines left out.
pub const PLOT_KINDS: [&str; 8] = [
    "bode",
    "coherence",
    "nyquist",
    "pole_zero",
    "stability",
    "loop",
    "sensitivity",
    "linearity",
];
/// The part of a Nyquist plot around two close modes reaches so many of their distances to either side.
const AROUND: f64 = 1.5;
const HERTZ: f64 = 2.0 * std::f64::consts::PI;

/// A picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Its name: one of [`PLOT_KINDS`].
    pub kind: &'static str,
    /// What it is.
    pub heading: &'static str,
    /// How it is read.
    pub caption: String,
    /// The SVG document.
    pub svg: String,
}

/// All pictures that a record has data for.
///
/// # Errors
/// When a response is not sound, or drawing fails.
pub fn pictures(record: &dyn ReportSource) -> Result<Vec<Plot>, ReportError> {
    let shown = record.shown();
    let map = shown.fit.map(|fit| map(&shown, fit));
    let mut all = responses(&shown, map.as_ref())?;
    if let (Some(fit), Some(map)) = (shown.fit, &map) {
        all.push(pole_zero(&shown, map)?);
        all.push(stability(&shown, fit)?);
    }
    all.extend(record.more_pictures()?);
    Ok(all)
}

fn responses(shown: &Shown<'_>, map: Option<&PoleZeroMap>) -> Result<Vec<Plot>, ReportError> {
    let Shown {
        title,
        subtitle,
        unit,
        frf,
        fit,
        ..
    } = shown;
    let frequency_hz = &frf.frequency_hz;
    let fitted = fit.map(|fit| fit.response(&shown.chain, frequency_hz));
    let name = fit.map_or(String::new(), |fit| {
        format!("fit of {} modes", fit.parameters.modes.len())
    });
    let mut traces = vec![Trace {
        name: "measured",
        curve: Curve::Measured(frf),
    }];
    traces.extend(shown.model.map(|response| Trace {
        name: "model",
        curve: Curve::Model {
            frequency_hz,
            response,
        },
    }));
    traces.extend(fitted.as_ref().map(|response| Trace {
        name: &name,
        curve: Curve::Model {
            frequency_hz,
            response,
        },
    }));
    let around = |(low, high): (f64, f64)| {
        let room = AROUND * (high - low);
        ((low - room).max(0.0) / HERTZ, (high + room) / HERTZ)
    };
    let part_hz = map.and_then(PoleZeroMap::close_pair).map(around);
    let picture = |kind, heading, caption: &str, svg| Plot {
        kind,
        heading,
        caption: caption.into(),
        svg,
    };
    Ok(vec![
        picture(
            "bode",
            "Frequency response",
            "Magnitude, phase and coherence: measured with its band of two sigma, and, where there are such, the model of the \
             configuration and the fit of modes to the measurement. Where the band reaches zero the line is faint.",
            bode_svg(*unit, &traces, title, subtitle)?,
        ),
        picture(
            "coherence",
            "Coherence",
            "The share of the output's power that the input explains. Below, what is missing to 1, which noise, \
             leakage and geometry that is not linear leave over.",
            coherence_svg(frf, title, subtitle)?,
        ),
        picture(
            "nyquist",
            "Nyquist plot",
            "The response in the plane, as far as its magnitude is known to two sigma; to the right the closest modes, where \
             circles hold the truth with 95 %. Delay, hold and amplifier turn the curve clockwise with frequency.",
            nyquist_svg(*unit, &traces, part_hz, title, subtitle)?,
        ),
    ])
}

/// Poles and zeros of the fit.
fn map(shown: &Shown<'_>, fit: &ModalFit) -> PoleZeroMap {
    let judged = &shown.verdict.zeros;
    let pole = |pole: UncertainPole| Place {
        s: pole.s,
        covariance: pole.covariance,
    };
    let zero = |zero: &UncertainZero| Place {
        s: zero.s,
        covariance: zero.covariance,
    };
    // A sum whose zeros cannot be found has no verdict either.
    let all = verdict::zeros(fit).unwrap_or_default();
    PoleZeroMap {
        poles: fit.poles().into_iter().map(pole).collect(),
        zeros: judged.iter().map(zero).collect(),
        others: all
            .iter()
            .filter(|other| !judged.contains(other))
            .map(zero)
            .collect(),
        up_to_rad_s: shown.judged_up_to_rad_s,
    }
}

fn pole_zero(shown: &Shown<'_>, map: &PoleZeroMap) -> Result<Plot, ReportError> {
    Ok(Plot {
        kind: "pole_zero",
        heading: "Poles and zeros",
        caption: format!(
            "Of the fit, with damping, above the real axis; hold, amplifier and delays are no part of it. Ellipses hold a zero with \
             95 %, bars through a pole each of its parts. The verdict counts what lies below {:.0} rad/s ({:.1} Hz). Each zero \
             of the verdict is drawn again, enlarged until its ellipse is seen, those nearest to the axis first.",
            map.up_to_rad_s,
            map.up_to_rad_s / HERTZ
        ),
        svg: pole_zero_svg(map, &shown.title, &shown.subtitle)?,
    })
}

fn stability(shown: &Shown<'_>, fit: &ModalFit) -> Result<Plot, ReportError> {
    let mode = |term: &crate::model::zeros::ModalTerm| OrderedMode {
        frequency_hz: term.omega_rad_s / HERTZ,
        damping_ratio: term.damping_ratio,
    };
    let modes = |order: &ModelOrder| order.parameters.modes.iter().map(mode).collect();
    let orders: Vec<Vec<OrderedMode>> = fit.orders.iter().map(modes).collect();
    let fit_hz: Vec<f64> = fit
        .parameters
        .modes
        .iter()
        .map(|term| term.omega_rad_s / HERTZ)
        .collect();
    Ok(Plot {
        kind: "stability",
        heading: "Stability chart",
        caption: "The modes at each order that was found worth its parameters; a mode that is there stays from one order to the \
                  next, one of noise or of the search moves. Rough orders come first: the errors they may leave shrink on the way."
            .into(),
        svg: stability_svg(&orders, &fit_hz, fit.band_hz, &shown.title, &shown.subtitle)?,
    })
}
