//! The literals of Python in the header of an NPY file.

/// Deepest list in a list.
const MAX_DEPTH: usize = 8;

/// A literal.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Literal {
    Text(String),
    Number(usize),
    Flag(bool),
    /// A list or a tuple.
    Items(Vec<Literal>),
    Fields(Vec<(String, Literal)>),
}

impl Literal {
    /// The literal that a text consists of.
    pub fn parse(text: &str) -> Option<Literal> {
        let mut parser = Parser(text);
        let literal = parser.literal(MAX_DEPTH)?;
        parser.0.trim().is_empty().then_some(literal)
    }

    pub fn get(&self, name: &str) -> Option<&Literal> {
        let Literal::Fields(fields) = self else {
            return None;
        };
        let mut fields = fields.iter();
        fields.find(|(key, _)| key == name).map(|(_, value)| value)
    }

    pub fn items(&self) -> Option<&[Literal]> {
        match self {
            Literal::Items(items) => Some(items),
            _ => None,
        }
    }

    pub fn text(&self) -> Option<&str> {
        match self {
            Literal::Text(text) => Some(text),
            _ => None,
        }
    }

    pub fn number(&self) -> Option<usize> {
        match self {
            Literal::Number(number) => Some(*number),
            _ => None,
        }
    }

    pub fn flag(&self) -> Option<bool> {
        match self {
            Literal::Flag(flag) => Some(*flag),
            _ => None,
        }
    }
}

/// The text that is left.
struct Parser<'a>(&'a str);

impl Parser<'_> {
    /// Takes a text if it comes next.
    fn takes(&mut self, text: &str) -> bool {
        self.0 = self.0.trim_start();
        match self.0.strip_prefix(text) {
            Some(rest) => {
                self.0 = rest;
                true
            }
            None => false,
        }
    }

    fn literal(&mut self, depth: usize) -> Option<Literal> {
        let depth = depth.checked_sub(1)?;
        if self.takes("True") {
            Some(Literal::Flag(true))
        } else if self.takes("False") {
            Some(Literal::Flag(false))
        } else if self.takes("(") {
            self.items(")", depth)
        } else if self.takes("[") {
            self.items("]", depth)
        } else if self.takes("{") {
            self.fields(depth)
        } else if self.0.starts_with(['\'', '"']) {
            self.quoted().map(Literal::Text)
        } else {
            self.digits()
        }
    }

    fn items(&mut self, end: &str, depth: usize) -> Option<Literal> {
        let mut items = Vec::new();
        while !self.takes(end) {
            items.push(self.literal(depth)?);
            if !self.takes(",") {
                return self.takes(end).then_some(Literal::Items(items));
            }
        }
        Some(Literal::Items(items))
    }

    fn fields(&mut self, depth: usize) -> Option<Literal> {
        let mut fields = Vec::new();
        while !self.takes("}") {
            self.0 = self.0.trim_start();
            let name = self.quoted()?;
            if !self.takes(":") {
                return None;
            }
            fields.push((name, self.literal(depth)?));
            if !self.takes(",") {
                return self.takes("}").then_some(Literal::Fields(fields));
            }
        }
        Some(Literal::Fields(fields))
    }

    /// A text in quotes. Escapes are left as they are: names with quotes or controls have them.
    fn quoted(&mut self) -> Option<String> {
        let quote = self.0.chars().next().filter(|c| ['\'', '"'].contains(c))?;
        let (text, rest) = self.0[1..].split_once(quote)?;
        self.0 = rest;
        Some(text.into())
    }

    fn digits(&mut self) -> Option<Literal> {
        let end = self.0.find(|c: char| !c.is_ascii_digit());
        let (digits, rest) = self.0.split_at(end.unwrap_or(self.0.len()));
        // Python 2 wrote sizes as in 3L.
        self.0 = rest.strip_prefix('L').unwrap_or(rest);
        digits.parse().ok().map(Literal::Number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_of_a_structured_array_is_parsed() {
        let text = "{'descr': [('t', '<f8'), (\"u\", '>i2', (2,))], 'fortran_order': False, 'shape': (3L,), }   \n";
        let header = Literal::parse(text).expect("a literal");
        assert_eq!(header.get("fortran_order"), Some(&Literal::Flag(false)));
        let three = Literal::Items(vec![Literal::Number(3)]);
        assert_eq!(header.get("shape"), Some(&three));
        let fields = header
            .get("descr")
            .and_then(Literal::items)
            .expect("a list");
        assert_eq!(fields[1].items().map(<[_]>::len), Some(3));
    }

    #[test]
    fn text_that_is_no_literal_is_refused() {
        for text in [
            "",
            "{",
            "{'a'",
            "{'a': }",
            "(1, 2",
            "(1 2)",
            "'a",
            "1 2",
            "-1",
            "99999999999999999999",
            "é",
        ] {
            assert_eq!(Literal::parse(text), None, "{text}");
        }
        assert_eq!(Literal::parse(&"(".repeat(100_000)), None);
    }
}
