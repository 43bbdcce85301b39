//! Quantities as a person types them: `8%`, `3.8mm`, `50um`, `0.1`.

use std::fmt;

/// A number with an optional unit, not yet related to anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// A bare number.
    Bare(f64),
    /// A length in metres, given with a unit.
    Metres(f64),
    /// A ratio, given in per cent.
    Ratio(f64),
}

/// A quantity that cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{text}` is not {expected}")]
pub struct QuantityError {
    text: String,
    expected: &'static str,
}

const LENGTHS: [(&str, f64); 4] = [("nm", 1e-9), ("um", 1e-6), ("mm", 1e-3), ("m", 1.0)];

/// Reads a number with `%`, `nm`, `um`, `mm`, `m` or nothing behind it.
pub fn parse(text: &str) -> Result<Quantity, QuantityError> {
    let expected = "a number, a percentage (8%) or a length (3.8mm, 50um, 0.0038)";
    let fail = || QuantityError {
        text: text.to_string(),
        expected,
    };
    let number = |digits: &str| {
        digits
            .trim()
            .parse::<f64>()
            .ok()
            .filter(|n| n.is_finite())
            .ok_or_else(fail)
    };
    let text = text.trim();
    if let Some(digits) = text.strip_suffix('%') {
        return Ok(Quantity::Ratio(number(digits)? / 100.0));
    }
    match LENGTHS
        .iter()
        .find_map(|(unit, scale)| text.strip_suffix(unit).map(|digits| (digits, scale)))
    {
        Some((digits, scale)) => Ok(Quantity::Metres(number(digits)? * scale)),
        None => Ok(Quantity::Bare(number(text)?)),
    }
}

/// A ratio: `10%` or `0.1`.
pub fn ratio(text: &str) -> Result<f64, QuantityError> {
    match parse(text)? {
        Quantity::Bare(value) | Quantity::Ratio(value) => Ok(value),
        Quantity::Metres(_) => Err(QuantityError {
            text: text.into(),
            expected: "a ratio (10% or 0.1)",
        }),
    }
}

/// A length in metres: `50um` or `5e-5`.
pub fn metres(text: &str) -> Result<f64, QuantityError> {
    match parse(text)? {
        Quantity::Bare(value) | Quantity::Metres(value) => Ok(value),
        Quantity::Ratio(_) => Err(QuantityError {
            text: text.into(),
            expected: "a length (50um or 5e-5, in metres)",
        }),
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Quantity::Bare(value) => write!(f, "{value}"),
            Quantity::Metres(value) => write!(f, "{value} m"),
            Quantity::Ratio(value) => write!(f, "{} %", value * 100.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_ratios_and_bare_numbers_are_told_apart() {
        assert_eq!(parse("8%"), Ok(Quantity::Ratio(0.08)));
        assert_eq!(parse(" 3.8mm "), Ok(Quantity::Metres(3.8 * 1e-3)));
        assert_eq!(parse("50um"), Ok(Quantity::Metres(50.0 * 1e-6)));
        assert_eq!(parse("-0.1"), Ok(Quantity::Bare(-0.1)));
    }

    #[test]
    fn what_is_no_number_is_refused_with_the_text() {
        for text in ["", "mm", "8 apples", "NaN", "inf%", "1e999"] {
            let error = parse(text).unwrap_err().to_string();
            assert!(
                error.contains(text.trim()) && error.contains("3.8mm"),
                "{error}"
            );
        }
        assert!(ratio("3mm").is_err() && metres("3%").is_err());
    }
}
