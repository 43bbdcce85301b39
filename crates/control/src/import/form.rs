//! The forms in which a file may have a controller.

use super::names;
use super::value::{Value, Variables};

/// The parts of a controller in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// Numerator and denominator.
    Polynomials,
    /// The same, as scipy.signal names them.
    ScipyPolynomials,
    /// Second order sections of scipy.signal.
    Sections,
    /// Zeros, poles and gain.
    Roots,
    /// A, B, C, D.
    Matrices,
}

impl Form {
    const ALL: [Form; 5] = [
        Form::Polynomials,
        Form::ScipyPolynomials,
        Form::Sections,
        Form::Roots,
        Form::Matrices,
    ];

    /// The forms whose required parts are all present.
    pub fn all_of(fields: &Variables) -> impl Iterator<Item = Form> {
        let present = Form::ALL.into_iter().filter(move |form| form.is_in(fields));
        present.collect::<Vec<_>>().into_iter()
    }

    /// The name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Form::Polynomials => "tf",
            Form::ScipyPolynomials => "b and a",
            Form::Sections => "sos",
            Form::Roots => "zpk",
            Form::Matrices => "ss",
        }
    }

    /// The names of its parts; one of each list is used.
    fn parts(self) -> &'static [&'static [&'static str]] {
        match self {
            Form::Polynomials => &[names::NUMERATOR, names::DENOMINATOR],
            Form::ScipyPolynomials => &[names::SCIPY_NUMERATOR, names::SCIPY_DENOMINATOR],
            Form::Sections => &[names::SECTIONS],
            Form::Roots => &[names::ZEROS, names::POLES, names::GAIN],
            Form::Matrices => &[names::A, names::B, names::C],
        }
    }

    /// The names of parts that may be absent.
    fn optional_parts(self) -> &'static [&'static [&'static str]] {
        match self {
            Form::Matrices => &[names::D, names::E],
            _ => &[],
        }
    }

    fn is_in(self, fields: &Variables) -> bool {
        let is_array = |names: &&[&str]| matches!(get(fields, names), Some((_, Value::Numbers(_))));
        // `a` and `b` beside `c` are matrices.
        let is_matrices = self == Form::ScipyPolynomials && get(fields, names::C).is_some();
        self.parts().iter().all(is_array) && !is_matrices
    }

    /// Whether the form uses the field with this name.
    pub fn uses(self, fields: &Variables, name: &str) -> bool {
        let mut parts = self.parts().iter().chain(self.optional_parts());
        parts.any(|names| get(fields, names).is_some_and(|(used, _)| used == name))
    }
}

/// The first field with one of these names.
pub(super) fn get<'a>(
    fields: &'a [(String, Value)],
    names: &[&str],
) -> Option<(&'a str, &'a Value)> {
    let found = fields
        .iter()
        .find(|(name, _)| names.contains(&name.as_str()));
    found.map(|(name, value)| (name.as_str(), value))
}
