//! The arguments of this process.

/// The arguments of this process after the name of the program. What is not UTF-8 is replaced by U+FFFD: they are shown and
/// sent as text, and no file is opened by them.
pub(super) fn arguments() -> impl Iterator<Item = String> {
    let arguments = std::env::args_os().skip(1);
    arguments.map(|argument| argument.to_string_lossy().into_owned())
}
