//! What a record shows, whoever made it.

use nalgebra::Complex;

use super::Plot;
use crate::identify::modal::{MeasurementChain, ModalFit};
use crate::identify::verdict::Verdict;
use crate::identify::{Frf, Unit};
use crate::report::ReportError;

/// What every record that was analysed has.
#[derive(Clone, Debug)]
pub struct Shown<'a> {
    /// What was measured.
    pub title: String,
    /// From what to what, how, and when.
    pub subtitle: String,
    /// Of the response.
    pub unit: Unit,
    /// Of a residue.
    pub residue_unit: String,
    /// The response as measured.
    pub frf: &'a Frf,
    /// By the model at the same frequencies, if there is one.
    pub model: Option<&'a [Complex<f64>]>,
    /// The chain through which the modes were measured.
    pub chain: MeasurementChain,
    /// The modes, if there are any.
    pub fit: Option<&'a ModalFit>,
    /// What they say of CNMP zeros.
    pub verdict: &'a Verdict,
    /// Modes and zeros up to here count for the verdict, in rad/s.
    pub judged_up_to_rad_s: f64,
}

/// A record that was analysed: of a run of the bench, or of other hands.
pub trait ReportSource {
    /// What every record has.
    fn shown(&self) -> Shown<'_>;

    /// The record, in a few words.
    fn record(&self) -> String;

    /// The numbers that the verdict rests on beside those of every record, by their names.
    fn evidence(&self) -> Vec<(String, String)>;

    /// Pictures beside those of every record.
    fn more_pictures(&self) -> Result<Vec<Plot>, ReportError>;

    /// Sections of the page before the pictures, and behind them.
    fn sections(&self) -> (String, String);
}
