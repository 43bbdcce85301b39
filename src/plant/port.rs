//! Where a force may act and a probe may look.

use nalgebra::DVector;

/// A displacement of some stage: row^T z. A force along it is the generalised force row.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Of the stage or node, with the axis where it has two: `x4`, `y_ms`, `m2`.
    pub name: String,
    /// Over the degrees of freedom; of all zeros where it cannot move.
    pub row: DVector<f64>,
}

impl Port {
    pub(super) fn new(name: &str, row: &[f64]) -> Port {
        Port { name: name.into(), row: DVector::from_row_slice(row) }
    }
}
