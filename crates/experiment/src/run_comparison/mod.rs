//! Recorded runs compared with a reference run: modes, verdict, static compliance and figures of the loop.
//!
//! ```text
//! Recording -> RunResult (analysis, figures) -.
//!                                              > Comparison: differences from the first run, Holm's test over all of them
//! Recording -> RunResult --------------------'
//! ```
//!
//! A recording is analysed (`run_result`); its modes are paired with those of the reference (`mode_pairs`, `modes`), its figures are
//! compared (`figures`), and all of them are tested together (`difference`).

mod difference;
mod figures;
mod mode_pairs;
mod modes;
mod run_result;

use serde::Serialize;

use bench_config::{SettingDifference, differences};

pub use difference::{Difference, FAMILY_FALSE_ALARM};
pub use figures::{Figure, FigureDifference};
pub(crate) use mode_pairs::{probability_of_difference, same_mode};
pub use modes::{ModeDifference, ModeDifferences};
pub use run_result::{RunHead, RunResult, distinguish};

/// The correction for multiple comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Correction {
    /// The step-down test of Holm.
    Holm,
}

/// Runs compared with the first one.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// The first run.
    pub reference: RunHead,
    /// The other runs, each with its differences from the first.
    pub others: Vec<RunDifferences>,
    /// The correction for multiple comparisons.
    pub correction: Correction,
    /// Probability that noise alone makes any of the tested differences significant.
    pub family_false_alarm: f64,
    /// Number of tested differences.
    pub tested: usize,
    /// Number of those that are significant.
    pub significant: usize,
}

/// The differences of a run from the reference run.
#[derive(Clone, Debug, Serialize)]
pub struct RunDifferences {
    /// The run.
    #[serde(flatten)]
    pub run: RunHead,
    /// Modes and static compliance, if both runs have modes.
    #[serde(flatten)]
    pub modes: ModeDifferences,
    /// Whether the signs of the residues differ; `None` if a run has none.
    pub signs_differ: Option<bool>,
    /// Whether the verdicts on CNMP zeros differ; `None` if a run has none.
    pub verdict_differs: Option<bool>,
    /// Figures of the loop and its timing.
    pub figures: Vec<FigureDifference>,
    /// The settings that differ.
    pub settings: Vec<SettingDifference>,
}

/// Why runs cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ComparisonError {
    /// Fewer than two.
    #[error("one recording cannot be compared; give two or more")]
    One,
    /// Neither modes nor a closed loop in common.
    #[error(
        "{reference} and {other} have nothing in common that can be compared: {why}; give two recordings of chirps, or two of \
         `bench control`"
    )]
    NothingCommon {
        /// The reference run.
        reference: String,
        /// The other run.
        other: String,
        /// The reason.
        why: String,
    },
}

impl Comparison {
    /// Compares runs with the first one. The runs are taken as independent: their noise has nothing in common.
    ///
    /// # Errors
    /// When there are fewer than two, or a run has neither modes nor figures of a loop in common with the first.
    pub fn of(runs: &[RunResult]) -> Result<Comparison, ComparisonError> {
        let (first, others) = runs.split_first().ok_or(ComparisonError::One)?;
        if others.is_empty() {
            return Err(ComparisonError::One);
        }
        let others = others.iter().map(|other| compared(first, other));
        let mut others = others.collect::<Result<Vec<_>, _>>()?;
        let tested: Vec<&mut Difference> =
            others.iter_mut().flat_map(RunDifferences::tested).collect();
        let count = tested.len();
        difference::mark_significant(tested);
        let significant = others.iter_mut().flat_map(RunDifferences::tested);
        let significant = significant.filter(|found| found.significant).count();
        Ok(Comparison {
            reference: first.head(),
            others,
            correction: Correction::Holm,
            family_false_alarm: FAMILY_FALSE_ALARM,
            tested: count,
            significant,
        })
    }
}

impl RunDifferences {
    /// The differences whose significance is tested. Two values without error are equal by definition, as the frequencies of free
    /// bodies.
    fn tested(&mut self) -> Vec<&mut Difference> {
        let modes = self.modes.modes.iter_mut();
        let modes = modes.flat_map(ModeDifference::tested);
        let compliance = self.modes.static_compliance_m_per_n.iter_mut();
        let all = modes.chain(compliance);
        all.filter(|found| found.difference.sigma > 0.0).collect()
    }
}

fn compared(reference: &RunResult, other: &RunResult) -> Result<RunDifferences, ComparisonError> {
    let fits = (reference.fit(), other.fit());
    let modes = match fits {
        (Some(reference), Some(other)) => ModeDifferences::of(reference, other),
        _ => ModeDifferences::default(),
    };
    let have_modes = fits.0.is_some() && fits.1.is_some();
    let have_loops = reference.control.is_some() && other.control.is_some();
    if !have_modes && !have_loops {
        return Err(ComparisonError::NothingCommon {
            reference: reference.label.clone(),
            other: other.label.clone(),
            why: why_nothing(reference, other),
        });
    }
    let (first, second) = (reference.head(), other.head());
    Ok(RunDifferences {
        signs_differ: differ(first.signs, second.signs.clone()),
        verdict_differs: differ(first.cnmp, second.cnmp),
        run: second,
        modes,
        figures: figures::figures(reference, other),
        settings: differences(&other.config, &reference.config),
    })
}

fn differ<T: PartialEq>(first: Option<T>, second: Option<T>) -> Option<bool> {
    Some(first? != second?)
}

fn why_nothing(reference: &RunResult, other: &RunResult) -> String {
    let reasons = [reference, other].map(|run| match &run.why {
        Some(why) => format!("{}: {why}", run.label),
        None => format!("{} is a run of kind {}", run.label, run.kind.name()),
    });
    reasons.join("; ")
}
