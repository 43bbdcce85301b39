//! The first fit of a response. A few modes, fitted to a part of its data, show whether the output is clearly of another kind or a lag is
//! missing: many modes would take their place in vain.
//!
//! ```text
//! few modes --not those of a stage--> a lag? --no--> another kind? --no--> complex residues? --no--> all modes
//!      '--those of a stage-------------------------------^
//! ```

use bench_plant::OutputKind;

use crate::complex_residues::{complex_modes, is_clearly_better};
use crate::fitted_lag::{FittedLag, is_looked_for};
use crate::modal::{self, FitError, MeasurementChain, ModalFit, Residues};
use crate::observation::{Observation, Source};
use crate::other_kind::clear_kind;
use crate::part::{PART_MODES, Part};
use crate::plausibility::{OtherModel, lag_model, with_complex_residues};

/// Largest number of real modes of a part that are compared with complex residues.
const MORE_MODES: usize = 2 * PART_MODES;
/// Number of modes so small that a part of the data does not show them, but all data do.
const SMALL_MODES: usize = 2;

/// The modes of a response, or why none can be fitted, and how it was observed.
pub(super) struct FirstFit {
    pub(super) fit: Result<ModalFit, FitError>,
    pub(super) chain: MeasurementChain,
    /// A lag that was fitted.
    pub(super) lag: Option<FittedLag>,
    /// The kind of an output that is clearly of another kind than assumed; the modes are then few.
    pub(super) clear_kind: Option<OutputKind>,
    /// Where the response comes from. No lag is looked for twice.
    pub(super) source: Source,
}

impl FirstFit {
    /// The fit of a response that is seen with few modes of a part of its data. A record that has a defect or is cut (`is_sound` is false) has
    /// neither a lag nor complex residues. `all_modes` fits as many modes as are significant.
    pub(super) fn of(
        seen: &Observation<'_>,
        is_sound: bool,
        all_modes: impl FnOnce() -> Result<ModalFit, FitError>,
    ) -> FirstFit {
        let complex = is_sound.then(|| complex_part(seen.part)).flatten();
        let looks_for_lag = is_sound && is_looked_for(seen);
        if looks_for_lag && let Some(lag) = lag_model(seen) {
            return FirstFit::by(simplest(seen, lag, complex), seen.source);
        }
        let source = Source {
            fits_lag: seen.source.fits_lag && !looks_for_lag,
            ..seen.source
        };
        let clear_kind = clear_kind(seen);
        if clear_kind.is_none()
            && let Some(part) = complex
            && let Some(model) = complex_of_all(seen, part)
        {
            return FirstFit::by(model, source);
        }
        let fit = match clear_kind {
            Some(_) => seen.fit.clone(),
            None => all_modes(),
        };
        FirstFit {
            fit,
            chain: seen.chain.clone(),
            lag: None,
            clear_kind,
            source,
        }
    }

    /// The fit by another model than modes with real residues.
    fn by(OtherModel { fit, chain, lag }: OtherModel, source: Source) -> FirstFit {
        FirstFit {
            fit: Ok(fit),
            chain,
            lag,
            clear_kind: None,
            source,
        }
    }
}

/// A part of the response with complex residues, if they describe it better than real ones. It costs little, and shows whether complex
/// residues of all data are worth their time. A few real ones may be too few for a stage of many modes, so that more are tried.
fn complex_part(part: &Part) -> Option<&ModalFit> {
    let complex = part.complex()?;
    let are_enough = |few: &ModalFit| few.number_of_modes() < PART_MODES;
    if part.few().as_ref().is_ok_and(are_enough) {
        return Some(complex);
    }
    let more = modal::fit_few(&part.data, &part.chain, &Residues::Real, MORE_MODES);
    let is_better = |more: &ModalFit| is_clearly_better(complex, more, part.data.len());
    more.as_ref().map_or(true, is_better).then_some(complex)
}

/// The whole response with complex residues, by about as many modes as a part of it.
fn complex_of_all(seen: &Observation<'_>, part: &ModalFit) -> Option<OtherModel> {
    let max_modes = part.number_of_modes() + SMALL_MODES;
    let complex = complex_modes(&seen.frf.data, seen.chain, max_modes)?;
    with_complex_residues(seen, complex)
}

/// A lag, or complex residues, if a part of the response and the whole one have fewer modes with them.
fn simplest(seen: &Observation<'_>, lag: OtherModel, part: Option<&ModalFit>) -> OtherModel {
    let with_lag = lag.fit.number_of_modes();
    let Some(part) = part.filter(|part| part.number_of_modes() < with_lag) else {
        return lag;
    };
    match complex_of_all(seen, part) {
        Some(complex) if complex.fit.number_of_modes() < with_lag => complex,
        _ => lag,
    }
}
