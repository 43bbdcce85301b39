//! The content of a figure.

use serde::Serialize;

use bench_report::{Chart, Row};

/// A figure or a table: charts, and the text below them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Content {
    /// Description of what is drawn.
    pub drawn: String,
    /// Profile, settings and equations.
    pub settings: Vec<String>,
    /// Values that the thesis does not print, and that were chosen.
    pub assumed: Vec<String>,
    /// The charts.
    pub rows: Vec<Row>,
    /// Comparisons of printed and computed values.
    pub compared: Vec<Comparison>,
    /// Commands that give the numbers, to be run in the folder of the page.
    pub commands: Vec<String>,
    /// Files that the commands need beside the page: name and text.
    pub files: Vec<(String, String)>,
}

impl Content {
    /// A figure with a description of what is drawn.
    pub fn new(drawn: &str) -> Content {
        Content {
            drawn: drawn.into(),
            ..Content::default()
        }
    }

    /// Adds a setting.
    pub fn setting(mut self, text: impl Into<String>) -> Content {
        self.settings.push(text.into());
        self
    }

    /// Adds an assumption.
    pub fn assumed(mut self, text: impl Into<String>) -> Content {
        self.assumed.push(text.into());
        self
    }

    /// Adds a row of charts.
    pub fn row(mut self, height: f64, charts: impl Into<Vec<Chart>>) -> Content {
        self.rows.push(Row::new(height, charts.into()));
        self
    }

    /// Adds a comparison.
    pub fn compare(mut self, comparison: Comparison) -> Content {
        self.compared.push(comparison);
        self
    }

    /// Adds a command.
    pub fn command(mut self, command: impl Into<String>) -> Content {
        self.commands.push(command.into());
        self
    }

    /// Adds a file that a command needs.
    pub fn file(mut self, name: &str, text: &str) -> Content {
        self.files.push((name.into(), text.into()));
        self
    }
}

/// The result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the tolerance.
    Agrees,
    /// Beyond the tolerance.
    Differs,
    /// The thesis prints no value.
    NotPrinted,
}

/// A value as printed and as computed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The quantity.
    pub what: String,
    /// As printed, with its unit.
    pub printed: String,
    /// As computed, with its unit.
    pub computed: String,
    /// Computed minus printed, or a text.
    pub difference: String,
    /// Largest difference that agrees: half of the last printed digit unless the remark says otherwise.
    pub tolerance: Option<f64>,
    /// The result.
    pub verdict: Verdict,
    /// The reason of a difference, or an explanation.
    pub remark: String,
}

impl Comparison {
    /// A number printed with so many decimals.
    pub fn number(
        what: &str,
        printed: f64,
        digits: usize,
        computed: f64,
        unit: &str,
    ) -> Comparison {
        Comparison::within(
            what,
            printed,
            digits,
            computed,
            unit,
            0.5 * 10f64.powi(-(digits as i32)),
        )
    }

    /// A number with another tolerance, in its unit.
    pub fn within(
        what: &str,
        printed: f64,
        digits: usize,
        computed: f64,
        unit: &str,
        tolerance: f64,
    ) -> Comparison {
        let more = digits + 2;
        let difference = computed - printed;
        // A printed digit is rounded either way; the sum of the two is exact to 1e-12 of it.
        let agrees = difference.abs() <= tolerance * (1.0 + 1e-12) + 1e-15 * printed.abs();
        Comparison {
            what: what.into(),
            printed: format!("{} {unit}", signed(printed, digits))
                .trim_end()
                .into(),
            computed: format!("{} {unit}", signed(computed, more))
                .trim_end()
                .into(),
            difference: format!(
                "{}{}",
                if difference >= 0.0 { "+" } else { "" },
                signed(difference, more)
            ),
            tolerance: Some(tolerance),
            verdict: if agrees {
                Verdict::Agrees
            } else {
                Verdict::Differs
            },
            remark: String::new(),
        }
    }

    /// Text: a kind of zeros, a sequence of signs.
    pub fn text(what: &str, printed: &str, computed: &str) -> Comparison {
        let same = printed == computed;
        Comparison {
            what: what.into(),
            printed: printed.into(),
            computed: computed.into(),
            difference: if same { "none" } else { "differs" }.into(),
            tolerance: None,
            verdict: if same {
                Verdict::Agrees
            } else {
                Verdict::Differs
            },
            remark: String::new(),
        }
    }

    /// A statement of the thesis, whether it holds, and the computed evidence.
    pub fn holds(what: &str, printed: &str, holds: bool, computed: &str) -> Comparison {
        let words = Comparison::text(what, "", "");
        Comparison {
            printed: printed.into(),
            computed: computed.into(),
            difference: if holds { "none" } else { "differs" }.into(),
            verdict: if holds {
                Verdict::Agrees
            } else {
                Verdict::Differs
            },
            ..words
        }
    }

    /// A value that the thesis does not print.
    pub fn unprinted(what: &str, computed: impl Into<String>) -> Comparison {
        let words = Comparison::text(what, "", "");
        let (printed, difference) = ("not printed".into(), String::new());
        Comparison {
            printed,
            computed: computed.into(),
            difference,
            verdict: Verdict::NotPrinted,
            ..words
        }
    }

    /// Sets the remark.
    pub fn remark(self, text: &str) -> Comparison {
        Comparison {
            remark: text.into(),
            ..self
        }
    }
}

/// A number with a true minus sign, and no minus before zero.
pub(crate) fn signed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let zero = text.chars().all(|c| !('1'..='9').contains(&c));
    if zero {
        text.replace('-', "")
    } else {
        text.replace('-', "\u{2212}")
    }
}
