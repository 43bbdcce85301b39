//! Hold and lag of an input, as they are printed.

use bench_identify::modal::InputPath;
use bench_identify::{FittedLag, InputKind};
use serde::Serialize;

use super::table::labelled;

/// A line with what the input is, if that is stated.
pub(super) fn input_kind_text(kind: Option<InputKind>) -> String {
    kind.map_or_else(String::new, |kind| labelled("input is", kind.name()))
}

/// Hold and lag of the input of an external record or response, as JSON has them.
#[derive(Debug, Serialize)]
pub(super) struct InputPathReport {
    hold_s: f64,
    input_lag_s: f64,
    /// Standard deviation of a lag that was fitted; null of a stated one, and of none.
    input_lag_s_sigma: Option<f64>,
}

impl InputPathReport {
    pub(super) fn new(path: InputPath, fitted: Option<FittedLag>) -> InputPathReport {
        InputPathReport {
            hold_s: path.hold_s,
            input_lag_s: path.lag_s,
            input_lag_s_sigma: fitted.map(|lag| lag.lag_s.sigma),
        }
    }

    /// A line with hold and lag, if there are any.
    pub(super) fn text(&self) -> String {
        if self.hold_s == 0.0 && self.input_lag_s == 0.0 {
            return String::new();
        }
        let (hold_ms, lag_ms) = (1e3 * self.hold_s, 1e3 * self.input_lag_s);
        let fitted = match self.input_lag_s_sigma {
            Some(sigma) => format!(
                " (fitted, ± {:.4} ms)",
                1e3 * bench_identify::SIGMAS_95 * sigma
            ),
            None => String::new(),
        };
        labelled(
            "input",
            &format!("held for {hold_ms:.4} ms, lag {lag_ms:.4} ms{fitted}"),
        )
    }
}
