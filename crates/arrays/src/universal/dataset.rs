//! What a dataset 58 contains, and the lines around datasets.

use crate::number::Numbers;

/// What a dataset is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Samples over time.
    TimeResponse,
    /// Response over frequency.
    FrequencyResponse,
    /// Another function, by its code.
    Other(u32),
}

/// A dataset 58.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// What it is.
    pub function: Function,
    /// ID line 1; empty for `NONE`.
    pub id: String,
    /// Response node and direction, as in `2:+Z`.
    pub place: String,
    /// Abscissas, such as times or frequencies.
    pub abscissas: Numbers,
    /// Unit of the abscissas by the label of their axis.
    pub abscissa_unit: Option<String>,
    /// Ordinates: as many numbers.
    pub ordinates: Numbers,
    /// Unit of the ordinates by the label of their axis; of a response that of its numerator.
    pub unit: Option<String>,
    /// Unit of the denominator of a response.
    pub denominator_unit: Option<String>,
}

/// Whether a line stands before or behind a dataset: -1 in columns 5 and 6.
pub(super) fn is_delimiter(line: &[u8]) -> bool {
    let rest = line.strip_prefix(b"    -1");
    rest.is_some_and(|rest| rest.trim_ascii().is_empty())
}
