//! A part of a response with what is fitted to it. Many modes would be fitted to what is no sum of modes, and a part shows that at less
//! cost.

use core::cell::OnceCell;

use bench_plant::OutputKind;

use crate::FrfDatum;
use crate::complex_residues::better_complex;
use crate::modal::{self, FitError, MeasurementChain, ModalFit, Residues};

/// Number of data of a part.
const PART_DATA: usize = 400;
/// Largest number of modes that are fitted to a part.
pub(super) const PART_MODES: usize = 8;

/// A part of a response, and the fits of it; each is computed when it is first asked for.
pub(super) struct Part {
    pub(super) data: Vec<FrfDatum>,
    pub(super) chain: MeasurementChain,
    few: OnceCell<Result<ModalFit, FitError>>,
    complex: OnceCell<Option<ModalFit>>,
    /// The only other kind of output of which modes describe the part, with these modes.
    pub(super) other_kind: OnceCell<Option<(OutputKind, ModalFit)>>,
}

impl Part {
    /// A part of the data of a response through a chain.
    pub(super) fn of(data: &[FrfDatum], chain: &MeasurementChain) -> Part {
        Part {
            data: part(data),
            chain: chain.clone(),
            few: OnceCell::new(),
            complex: OnceCell::new(),
            other_kind: OnceCell::new(),
        }
    }

    /// A few modes with real residues.
    pub(super) fn few(&self) -> &Result<ModalFit, FitError> {
        self.few.get_or_init(|| fit_few(&self.data, &self.chain))
    }

    /// Modes with complex residues, if they describe the part better than the few with real ones.
    pub(super) fn complex(&self) -> Option<&ModalFit> {
        let found = self
            .complex
            .get_or_init(|| better_complex(&self.data, &self.chain, self.few()));
        found.as_ref()
    }
}

/// A few modes of a part of some data.
pub(super) fn fit_part(data: &[FrfDatum], chain: &MeasurementChain) -> Result<ModalFit, FitError> {
    fit_few(&part(data), chain)
}

fn fit_few(part: &[FrfDatum], chain: &MeasurementChain) -> Result<ModalFit, FitError> {
    modal::fit_few(part, chain, &Residues::Real, PART_MODES)
}

/// Some of the data, evenly spaced.
pub(super) fn part(data: &[FrfDatum]) -> Vec<FrfDatum> {
    let every = data.len().div_ceil(PART_DATA).max(1);
    data.iter().step_by(every).copied().collect()
}
