//! The unit of a response, as its file states it.

use std::fmt;

use bench_identify::OutputKind;

/// Which units a reader accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum UnitRule {
    /// Metres per ampere, stated or not.
    MetresPerAmpere,
    /// Any, of a displacement.
    Any,
    /// Any, of an output whose kind is stated.
    AnyOutput,
}

/// Unit of a response: that of its output over that of its input, as written in the file.
///
/// | heading | unit |
/// |---|---|
/// | `magnitude_um_per_n` | `um/N` |
/// | `Magnitude (dB re 1 m/A)` | `m/A` |
/// | `real`, with `V/V` in the line of units | `V/V` |
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResponseUnit {
    /// Unit of the output.
    pub output: String,
    /// Unit of the input.
    pub input: String,
}

/// In place of the unit of an output, where only that of the input is stated.
pub(super) const UNSTATED_OUTPUT: &str = "output";
/// In place of the unit of an input, where only that of the output is stated.
pub(super) const UNSTATED_INPUT: &str = "input";

/// Symbols that names of columns write in lower case.
const SYMBOLS: [(&str, &str); 8] = [
    ("a", "A"),
    ("ma", "mA"),
    ("n", "N"),
    ("mn", "mN"),
    ("kn", "kN"),
    ("v", "V"),
    ("mv", "mV"),
    ("kv", "kV"),
];

impl ResponseUnit {
    /// The unit that a name states, or a line of units.
    pub(super) fn stated(name: &str, line_of_units: &str) -> Option<ResponseUnit> {
        let in_name = bracketed(name).map(ResponseUnit::of_text);
        let by_line = ResponseUnit::of_text(line_of_units);
        by_line
            .or_else(|| in_name.flatten())
            .or_else(|| of_words(name))
    }

    /// `um/N`, also after `dB re 1`, `m/s/N` and `V/(m/s)`. A text without a slash is no unit of a ratio.
    fn of_text(text: &str) -> Option<ResponseUnit> {
        const SLASHES: [char; 2] = ['/', '\u{2044}'];
        let text = text.trim();
        let (output, input) = match text.rsplit_once(SLASHES)? {
            (_, input) if input.contains(')') => text.split_once(SLASHES)?,
            parts => parts,
        };
        let output = output.split_whitespace().next_back()?;
        let input = input.trim();
        (!input.is_empty()).then(|| ResponseUnit {
            output: output.into(),
            input: input.into(),
        })
    }

    /// Whether it is metres per ampere, as far as it is stated.
    pub(super) fn is_metres_per_ampere(&self) -> bool {
        const METRES: [&str; 6] = ["m", "metre", "metres", "meter", "meters", UNSTATED_OUTPUT];
        const AMPERES: [&str; 6] = ["a", "amp", "amps", "ampere", "amperes", UNSTATED_INPUT];
        let output = self.output.to_lowercase();
        // `displacement_m` of `mag_displacement_m_per_a`.
        let is_in_metres = output
            .rsplit('_')
            .next()
            .is_some_and(|unit| METRES.contains(&unit));
        is_in_metres && is_one_of(&self.input, &AMPERES)
    }

    /// The unit of a residue, r in s^k r/(s^2 + 2 zeta w s + w^2): that of the response over s^2 for a position, over s for a velocity.
    pub fn of_residue(&self, kind: OutputKind) -> String {
        let ResponseUnit { output, input } = self;
        match kind {
            OutputKind::Position => format!("{output}/({input} s^2)"),
            OutputKind::Velocity => format!("{output}/({input} s)"),
            OutputKind::Acceleration => self.to_string(),
        }
    }
}

impl fmt::Display for ResponseUnit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.output, self.input)
    }
}

/// Whether the unit of an input is one of some words. The name of the quantity may stand beside it, and how its value is taken.
fn is_one_of(text: &str, words: &[&str]) -> bool {
    const BESIDE: [&str; 6] = ["current", "command", "rms", "peak", "pk", "pp"];
    let text = text.to_lowercase();
    let parts = text.split(|c: char| c.is_whitespace() || [',', '_'].contains(&c));
    let mut unit = parts.filter(|part| !part.is_empty() && !BESIDE.contains(part));
    let is_known = unit.next().is_some_and(|first| words.contains(&first));
    is_known && unit.next().is_none()
}

/// What stands in the last pair of brackets.
fn bracketed(name: &str) -> Option<&str> {
    let end = name.rfind([')', ']'])?;
    let begin = name[..end].rfind(['(', '['])?;
    Some(&name[begin + 1..end])
}

/// `um` and `n` of `magnitude_um_per_n`; the first word is that of the quantity.
fn of_words(name: &str) -> Option<ResponseUnit> {
    let name = name.split(['(', '[']).next().unwrap_or(name).trim();
    let name = name.strip_suffix("_db").unwrap_or(name);
    let (output, input) = name.split_once("_per_")?;
    let (_, output) = output.split_once('_')?;
    // Without ` real` of the parts of a complex array.
    let input = input.split_whitespace().next()?;
    Some(ResponseUnit {
        output: symbol(output),
        input: symbol(input),
    })
}

fn symbol(word: &str) -> String {
    let known = SYMBOLS.iter().find(|(name, _)| *name == word);
    known.map_or(word, |(_, symbol)| symbol).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_is_that_of_brackets_words_or_line_of_units() {
        for (name, line, unit) in [
            ("magnitude_um_per_n", "", Some("um/N")),
            (
                "magnitude_angle_rad_per_current_a",
                "",
                Some("angle_rad/current_a"),
            ),
            ("Magnitude (dB re 1 m/A)", "", Some("m/A")),
            ("|G(f)| [\u{b5}m/N]", "", Some("\u{b5}m/N")),
            ("real", "V/V", Some("V/V")),
            ("response", "m/s/N", Some("m/s/N")),
            ("response", "V/(m/s)", Some("V/(m/s)")),
            ("response_m_per_a real", "", Some("m/A")),
            ("mag_um_per_n_db", "", Some("um/N")),
            ("mag_um_per_n (dB)", "dB", Some("um/N")),
            ("mag_db", "dB", None),
            ("magnitude", "", None),
            ("gain ()", "", None),
            ("gain )(", "/", None),
        ] {
            let found = ResponseUnit::stated(name, line);
            let found = found.map(|unit| unit.to_string());
            assert_eq!(found.as_deref(), unit, "{name} {line}");
        }
    }

    #[test]
    fn metres_per_ampere_are_no_other_ratio() {
        for (name, line, is_one) in [
            ("magnitude_m_per_a", "", true),
            ("Magnitude (dB re 1 m/A)", "", true),
            ("|G| [m/A, peak]", "", true),
            ("mag_displacement_m_per_current_a", "", true),
            ("magnitude", "m/A", true),
            ("magnitude", "m/input", true),
            ("magnitude", "mm/input", false),
            ("magnitude", "output/A", true),
            ("magnitude", "output/N", false),
            ("magnitude", "A/m", false),
            ("magnitude", "g/A", false),
            ("magnitude", "m/kN", false),
            ("magnitude", "m/mA", false),
            ("magnitude", "m/s/A", false),
            ("magnitude", "m/(A s)", false),
            ("magnitude", "m/V", false),
            ("magnitude_mm_per_a", "", false),
            ("magnitude (pm/A)", "", false),
        ] {
            let unit = ResponseUnit::stated(name, line).expect(name);
            assert_eq!(unit.is_metres_per_ampere(), is_one, "{name} {line}");
        }
    }

    #[test]
    fn residue_has_the_unit_of_the_response_over_powers_of_a_time() {
        let unit = ResponseUnit::stated("h_um_per_n", "").expect("a unit");
        assert_eq!(unit.of_residue(OutputKind::Position), "um/(N s^2)");
        assert_eq!(unit.of_residue(OutputKind::Velocity), "um/(N s)");
        assert_eq!(unit.of_residue(OutputKind::Acceleration), "um/N");
    }
}
