//! The line of a key in a text.

use std::iter::Peekable;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The line (from 1) of the dotted `path` in `text`, or of the innermost table of the path that exists.
pub fn line_of(text: &str, path: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut found = None;
    let mut parts = path.split('.').peekable();
    while let Some(part) = parts.next() {
        let mut entries = table.iter();
        let (key, value) = entries.find(|(key, _)| key.get_ref().as_ref() == part)?;
        let (start, value) = item(value, &mut parts).unwrap_or((key.span().start, value.get_ref()));
        found = Some(start);
        match value {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found.map(|offset| 1 + text[..offset.min(text.len())].matches('\n').count())
}

/// The item of an array that the next parts of a path name, with its offset.
fn item<'v, 'p>(
    value: &'v Spanned<DeValue<'v>>,
    parts: &mut Peekable<impl Iterator<Item = &'p str>>,
) -> Option<(usize, &'v DeValue<'v>)> {
    let mut found = None;
    let mut value = value.get_ref();
    while let DeValue::Array(items) = value {
        let index = parts.peek().and_then(|part| part.parse::<usize>().ok());
        let Some(item) = index.and_then(|index| items.get(index)) else {
            break;
        };
        parts.next();
        value = item.get_ref();
        found = Some((item.span().start, value));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::line_of;

    const TEXT: &str = "a = 1\n[b]\nc = 2\n[[d]]\ne = 1\n[[d]]\ne = 2\n";

    #[test]
    fn finds_the_line_of_a_key() {
        assert_eq!(line_of(TEXT, "a"), Some(1));
        assert_eq!(line_of(TEXT, "b.c"), Some(3));
        assert_eq!(line_of(TEXT, "d.1.e"), Some(7));
    }

    #[test]
    fn missing_key_has_no_line() {
        assert_eq!(line_of(TEXT, "z"), None);
        assert_eq!(line_of(TEXT, "b.z"), None);
        assert_eq!(line_of("not toml [", "a"), None);
    }
}
