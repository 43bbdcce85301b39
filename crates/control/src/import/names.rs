//! The names under which programs save the parts and properties of a controller.

/// Numerator of a ratio of polynomials.
pub(super) const NUMERATOR: &[&str] = &["num", "numerator", "Numerator"];
/// Denominator of a ratio of polynomials.
pub(super) const DENOMINATOR: &[&str] = &["den", "denominator", "Denominator"];
/// Numerator as scipy.signal names it.
pub(super) const SCIPY_NUMERATOR: &[&str] = &["b"];
/// Denominator as scipy.signal names it.
pub(super) const SCIPY_DENOMINATOR: &[&str] = &["a"];
/// Second order sections of scipy.signal.
pub(super) const SECTIONS: &[&str] = &["sos"];
/// Zeros.
pub(super) const ZEROS: &[&str] = &["z", "zeros", "Z"];
/// Poles.
pub(super) const POLES: &[&str] = &["p", "poles", "P"];
/// Gain of zeros and poles.
pub(super) const GAIN: &[&str] = &["k", "gain", "K"];
/// Matrices.
pub(super) const A: &[&str] = &["A", "a"];
/// Input matrix.
pub(super) const B: &[&str] = &["B", "b"];
/// Output matrix.
pub(super) const C: &[&str] = &["C", "c"];
/// Feedthrough.
pub(super) const D: &[&str] = &["D", "d"];
/// Matrix of the derivatives.
pub(super) const E: &[&str] = &["E", "e"];
/// Sampling period.
pub(super) const PERIOD: &[&str] = &["Ts", "dt"];
/// Sampling rate in hertz.
pub(super) const RATE: &[&str] = &["fs", "Fs"];

/// How zeros and poles are written in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RootList {
    /// Numbers and `[re, im]` pairs.
    Pairs,
    /// The same, or a cell of MATLAB with one element.
    Cell,
}

impl RootList {
    /// The list with this name, if it contains roots.
    pub fn of(name: &str) -> Option<RootList> {
        match name {
            "Z" | "P" => Some(RootList::Cell),
            _ if ZEROS.contains(&name) || POLES.contains(&name) => Some(RootList::Pairs),
            _ => None,
        }
    }
}

/// What a field beside the parts of a controller is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Property {
    /// A name, a remark or another content without effect on the response.
    Remark,
    /// A delay at input or output.
    Delay,
    /// A property that the program does not use; it has no effect if it is 0 or empty.
    ZeroOnly,
    /// The unit of time.
    TimeUnit,
    /// The variable of the polynomials.
    Variable,
    /// The unit of the input.
    InputUnit,
    /// The unit of the output.
    OutputUnit,
    /// A name that is not known.
    Unknown,
}

const REMARKS: &[&str] = &[
    "name",
    "notes",
    "note",
    "userdata",
    "inputname",
    "outputname",
    "inputgroup",
    "outputgroup",
    "statename",
    "statepath",
    "stateunit",
    "inputlabels",
    "outputlabels",
    "statelabels",
    "displayformat",
    "scaled",
    "title",
    "description",
    "comment",
    "comments",
    "author",
    "date",
];

impl Property {
    /// The property with this name, in capitals or not, with underscores or without.
    pub fn of(name: &str) -> Property {
        let name = name.to_lowercase().replace('_', "");
        match name.as_str() {
            "inputdelay" | "outputdelay" | "iodelay" => Property::Delay,
            "internaldelay" | "samplinggrid" | "offsets" => Property::ZeroOnly,
            "timeunit" => Property::TimeUnit,
            "variable" => Property::Variable,
            "inputunit" => Property::InputUnit,
            "outputunit" => Property::OutputUnit,
            name if REMARKS.contains(&name) => Property::Remark,
            _ => Property::Unknown,
        }
    }
}
