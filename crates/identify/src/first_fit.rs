//! The first fit of a response. A few modes, fitted to a part of its data, show whether the output is clearly of another kind or a lag is
//! missing: many modes would take their place in vain.
//!
//! ```text
//! few modes --not those of a stage--> a lag? --no--> another kind? --no--> complex residues? --no--> all modes
//!      '--those of a stage--------------------------------------------------------------------------^
//! ```

use core::cell::LazyCell;

use bench_plant::OutputKind;

use crate::complex_residues::{better_complex, complex_modes, is_clearly_better};
use crate::fitted_lag::{FittedLag, is_looked_for};
use crate::modal::{FitError, MeasurementChain, ModalFit};
use crate::observation::{Observation, PART_MODES, Source, describes, part};
use crate::other_kind::clear_kind;
use crate::plausibility::{OtherModel, lag_model, with_complex_residues};

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
        // Complex residues of a part cost little, and show whether those of all data are worth their time.
        let complex = is_sound.then(|| complex_part(seen)).flatten();
        let most = complex
            .as_ref()
            .map_or(usize::MAX, ModalFit::number_of_modes);
        let looks_for_lag = is_sound && is_looked_for(seen);
        let lag = match looks_for_lag.then(|| lag_model(seen)).flatten() {
            Some(lag) if lag.number_of_modes() <= most => return FirstFit::by(lag, seen.source),
            lag => lag,
        };
        let source = Source {
            fits_lag: seen.source.fits_lag && !looks_for_lag,
            ..seen.source
        };
        let clear_kind = clear_kind(seen);
        let all_modes = LazyCell::new(all_modes);
        if clear_kind.is_none() {
            let complex = complex.and_then(|_| complex_of_all(seen, &all_modes));
            if let Some(model) = complex.or(lag) {
                return FirstFit::by(model, source);
            }
        }
        let fit = match clear_kind {
            Some(_) => seen.fit.clone(),
            None => all_modes.clone(),
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

/// A part of the response with complex residues, if they describe it better than a few real ones.
fn complex_part(seen: &Observation<'_>) -> Option<ModalFit> {
    better_complex(&part(&seen.frf.data), seen.chain, seen.fit)
}

/// The whole response with complex residues. As many real ones as are allowed for a part may describe it because the stage has more, so that
/// they are compared with `all_modes`.
fn complex_of_all<F: FnOnce() -> Result<ModalFit, FitError>>(
    seen: &Observation<'_>,
    all_modes: &LazyCell<Result<ModalFit, FitError>, F>,
) -> Option<OtherModel> {
    let data = &seen.frf.data;
    let complex = complex_modes(data, seen.chain, PART_MODES)?;
    let may_have_more = |few: &ModalFit| describes(few) && few.number_of_modes() == PART_MODES;
    let is_better = |real: &ModalFit| is_clearly_better(&complex, real, data.len());
    if seen.fit.as_ref().is_ok_and(may_have_more) && !all_modes.as_ref().map_or(true, is_better) {
        return None;
    }
    with_complex_residues(seen, complex)
}
