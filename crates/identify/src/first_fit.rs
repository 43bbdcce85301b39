//! The first fit of a response. A few modes, fitted to a part of its data, show whether the output is clearly of another kind or a lag is
//! missing: many modes would take their place in vain.
//!
//! ```text
//! few modes --describe nothing--> a lag? --no--> another kind? --no--> all modes
//!      '--describe the part-------------------------------------------^
//! ```

use bench_plant::OutputKind;

use crate::fitted_lag::{FittedLag, is_looked_for};
use crate::modal::{FitError, MeasurementChain, ModalFit};
use crate::observation::{Observation, Source};
use crate::other_kind::clear_kind;
use crate::plausibility::{OtherModel, lag_model};

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
    /// The fit of a response that is seen with few modes of a part of its data. A record that has a defect or is cut (`is_sound` is false) has no lag.
    /// `all_modes` fits as many modes as are significant.
    pub(super) fn of(
        seen: &Observation<'_>,
        is_sound: bool,
        all_modes: impl FnOnce() -> Result<ModalFit, FitError>,
    ) -> FirstFit {
        let looks_for_lag = is_sound && is_looked_for(seen);
        if looks_for_lag && let Some(OtherModel { fit, chain, lag }) = lag_model(seen) {
            return FirstFit {
                fit,
                chain,
                lag,
                clear_kind: None,
                source: seen.source,
            };
        }
        let clear_kind = clear_kind(seen);
        let fit = match clear_kind {
            Some(_) => seen.fit.clone(),
            None => all_modes(),
        };
        FirstFit {
            fit,
            chain: seen.chain.clone(),
            lag: None,
            clear_kind,
            source: Source {
                fits_lag: seen.source.fits_lag && !looks_for_lag,
                ..seen.source
            },
        }
    }
}
