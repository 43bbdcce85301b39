//! The form of the error texts: `what is wrong, where, with value and limit; what to do`.

/// Separates what is wrong from what to do.
const SEPARATOR: &str = "; ";

/// The two parts of an error text: what is wrong, and what to do if the text says so. The first separator counts, so the
/// first part contains none; the remedy may contain several instructions.
///
/// ```
/// use bench_base::remedy::split;
///
/// let text = "--at 9 is outside of the range 0 to 5; give a value inside, or change --from and --to";
/// let (what, remedy) = split(text);
/// assert_eq!(what, "--at 9 is outside of the range 0 to 5");
/// assert_eq!(remedy, Some("give a value inside, or change --from and --to"));
/// ```
pub fn split(text: &str) -> (&str, Option<&str>) {
    match text.split_once(SEPARATOR) {
        Some((what, remedy)) => (what, Some(remedy)),
        None => (text, None),
    }
}

/// The error text of the two parts.
pub fn join(what: &str, remedy: &str) -> String {
    format!("{what}{SEPARATOR}{remedy}")
}
