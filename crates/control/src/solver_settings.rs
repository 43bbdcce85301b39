//! The settings of the interior-point solver (clarabel) for every programme of this module.

use clarabel::solver::DefaultSettings;

/// The default settings without output.
pub(super) fn solver_settings() -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        ..DefaultSettings::default()
    }
}
