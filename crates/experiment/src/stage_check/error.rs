//! Why a loop is not closed after the check of its stage.

use super::figures::{PhaseComparison, StaticComparison};

/// A stage that does not agree with the certificate. Each text is `what is wrong; remedy`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StageCheckError {
    /// The stage moves in the other direction.
    #[error(
        "the stage moves against the direction of the certificate: the static compliance is {:.3e} m/A, and that of the certificate {:.3e} m/A; check the leads of the motor and the side of the probe, then repeat `bench chirp`",
        .0.measured_m_per_a, .0.certified_m_per_a
    )]
    Reversed(StaticComparison),
    /// Another static compliance.
    #[error(
        "the static compliance is {:.4e} m/A, and that of the certificate {:.4e} m/A: they differ by more than {:.1} %; check stage, load, springs and scale of the probe, or repeat `bench chirp`",
        .0.measured_m_per_a, .0.certified_m_per_a, 100.0 * .0.limit_ratio
    )]
    Compliance(StaticComparison),
    /// Another phase near the crossover.
    #[error(
        "at {:.2} Hz the phase of the stage is {:.1} deg, and that of the certificate {:.1} deg: they differ by more than {:.1} deg; check whether load and stage are those of the certificate, or repeat `bench chirp`",
        .0.frequency_hz, .0.measured_deg, .0.certified_deg, .0.limit_deg
    )]
    Phase(PhaseComparison),
    /// Too much noise to tell another stage.
    #[error(
        "{what} has too much noise for a comparison with the certificate; look for vibration and the noise of the probe (`bench doctor`), or repeat `bench chirp` with a larger amplitude"
    )]
    Inconclusive {
        /// What cannot be compared.
        what: String,
    },
    /// The certificate or the loop leaves nothing to compare.
    #[error(
        "the certificate has no static response, or the loop has no crossover in its band, so that the stage cannot be checked; repeat `bench chirp` with a --start below a fifth of the first mode and a --stop above the crossover"
    )]
    NothingToCompare,
    /// The record of the shot cannot be evaluated.
    #[error("the recording of the stage check cannot be evaluated: {0}; repeat the run")]
    Record(String),
}
