//! The verdict of an external record, with what it states beside the modes.

use crate::ClockSkew;
use crate::Frf;
use crate::external_signals::ExternalSignals;
use crate::fitted_lag::FittedLag;
use crate::modal::{FitError, MeasurementChain, ModalFit};
use crate::plausibility::unless_undetermined;
use crate::prepared::Prepared;
use crate::record_check::Ends;
use crate::verdict::{Verdict, VerdictScope, judge};
use bench_plant::PlantError;

/// The caution of a verdict from a record in motion.
const IN_MOTION: &str = "the record begins or ends within its excitation; the transient of the plant was estimated and subtracted";

/// What was done with a record beyond averaging, in the order in which it is told.
pub(super) fn cautions(
    prepared: &Prepared<'_>,
    clock_skew: Option<&ClockSkew>,
    lag: Option<&FittedLag>,
) -> Vec<String> {
    let motion = (prepared.record.ends == Ends::Motion).then(|| IN_MOTION.to_owned());
    let stray_lines = prepared.stray_lines.iter().map(ToString::to_string);
    stray_lines
        .chain(motion)
        .chain(clock_skew.map(ClockSkew::description))
        .chain(lag.map(FittedLag::description))
        .collect()
}

/// The scope of the verdict of a record, which states how long a record must be.
pub(super) fn scope(record: ExternalSignals<'_>, up_to_rad_s: f64) -> VerdictScope {
    VerdictScope {
        // The set-point of a loop may rest at another value than before its motion.
        duration_s: record.reference.is_none().then(|| record.excitation_s()),
        ..VerdictScope::up_to(up_to_rad_s)
    }
}

/// The verdict of a fit, with what else may be the cause of an undecided one; undecided for a reason that is already known.
pub(super) fn judged(
    why: Option<String>,
    frf: &Frf,
    fit: &Result<ModalFit, FitError>,
    chain: &MeasurementChain,
    scope: VerdictScope,
    hint: impl Fn(&Verdict) -> Option<String>,
) -> Result<Verdict, PlantError> {
    if let Some(why) = why {
        return Ok(Verdict::undecided(why));
    }
    let verdict = judge(fit, &frf.data, chain, scope)?;
    let verdict = unless_undetermined(verdict, fit);
    let hint = hint(&verdict).filter(|hint| !verdict.why.contains(hint));
    Ok(verdict.with(hint))
}

pub(super) fn listed(items: &[impl ToString]) -> Option<String> {
    let texts: Vec<String> = items.iter().map(ToString::to_string).collect();
    (!texts.is_empty()).then(|| texts.join("; "))
}
