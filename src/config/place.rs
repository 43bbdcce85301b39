//! Where a key stands in a text.

use toml::de::{DeTable, DeValue};

/// The line (from 1) of the dotted `path` in `text`, or of the innermost table on the way that is there.
pub(super) fn line_of(text: &str, path: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut found = None;
    let mut parts = path.split('.').peekable();
    while let Some(part) = parts.next() {
        let (key, value) = table
            .iter()
            .find(|(key, _)| key.get_ref().as_ref() == part)?;
        found = Some(key.span().start);
        let mut value = value.get_ref();
        while let DeValue::Array(items) = value {
            let Some(item) = parts
                .peek()
                .and_then(|n| n.parse::<usize>().ok())
                .and_then(|n| items.get(n))
            else {
                break;
            };
            parts.next();
            found = Some(item.span().start);
            value = item.get_ref();
        }
        match value {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    found.map(|offset| 1 + text[..offset.min(text.len())].matches('\n').count())
}

#[cfg(test)]
mod tests {
    use super::line_of;

    const TEXT: &str = "a = 1\n[b]\nc = 2\n[[d]]\ne = 1\n[[d]]\ne = 2\n";

    #[test]
    fn the_line_of_a_key_is_that_of_the_file() {
        assert_eq!(line_of(TEXT, "a"), Some(1));
        assert_eq!(line_of(TEXT, "b.c"), Some(3));
        assert_eq!(line_of(TEXT, "d.1.e"), Some(7));
    }

    #[test]
    fn a_key_that_is_not_there_has_no_line() {
        assert_eq!(line_of(TEXT, "z"), None);
        assert_eq!(line_of(TEXT, "b.z"), None);
        assert_eq!(line_of("not toml [", "a"), None);
    }
}
