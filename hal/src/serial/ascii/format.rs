//! The compiled form of a line: reads and writes it.

use super::super::decoder::{Event, Sample};
use super::super::error::{SerialError, positive};
use super::pattern::{Decimal, Pattern};
use super::settings::Settings;

/// The compiled settings, for both sides of the line.
#[derive(Clone, Debug)]
pub struct LineFormat {
    settings: Settings,
    line: Pattern,
    error: Option<Pattern>,
    terminator: Vec<u8>,
    request: Option<Vec<u8>>,
    invalid: Vec<Vec<u8>>,
    over: Vec<Vec<u8>>,
    under: Vec<Vec<u8>>,
}

/// Content of a line that a probe sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// A measurement in metres.
    Position(f64),
    /// Not measured.
    Invalid,
    /// An error number.
    Error(i64),
}

impl LineFormat {
    /// Compiles the settings. The error names the setting that is invalid.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        check_scale(&settings)?;
        Ok(Self {
            line: value_pattern(&settings.line)?,
            error: settings.error.as_deref().map(error_pattern).transpose()?,
            terminator: terminator(&settings.terminator)?,
            request: settings.request.as_deref().map(request).transpose()?,
            invalid: texts("invalid", &settings.invalid)?,
            over: texts("over", &settings.over)?,
            under: texts("under", &settings.under)?,
            settings,
        })
    }

    /// The bytes that end a line.
    pub(super) fn terminator(&self) -> &[u8] {
        &self.terminator
    }

    /// The bytes of the request, if there is one.
    pub fn request(&self) -> Option<&[u8]> {
        self.request.as_deref()
    }

    /// A position far above the range.
    pub(super) fn out_of_range_m(&self) -> f64 {
        let Settings {
            lower_m, upper_m, ..
        } = self.settings;
        upper_m + 2.0 * (upper_m - lower_m)
    }

    /// The event of `line` (without terminator); `None` if it matches no pattern.
    pub(super) fn read(&self, line: &[u8]) -> Option<Event> {
        match self.error_code(line) {
            Some(code) => self.error_event(code),
            None => self.value_event(self.line.read(line)?.value?),
        }
    }

    fn error_code<'a>(&self, line: &'a [u8]) -> Option<&'a [u8]> {
        self.error.as_ref()?.read(line)?.code
    }

    fn error_event(&self, code: &[u8]) -> Option<Event> {
        let number = Decimal::read(code).filter(|number| number.decimals == 0)?;
        let code = number.digits;
        let mut known = self.settings.error_texts.iter();
        let text = known.find(|(known, _)| *known == code).map_or(
            "the probe reports an error; see its manual for the number",
            |(_, text)| text,
        );
        Some(Event::Fault { code, text })
    }

    fn value_event(&self, text: &[u8]) -> Option<Event> {
        if contains(&self.invalid, text) {
            Some(Event::Fault {
                code: 0,
                text: "the probe cannot measure: no target, or too little light",
            })
        } else if contains(&self.over, text) {
            Some(out_of_range(i64::MAX, self.settings.upper_m))
        } else if contains(&self.under, text) {
            Some(out_of_range(i64::MIN, self.settings.lower_m))
        } else {
            self.number_event(Decimal::read(text)?)
        }
    }

    fn number_event(&self, number: Decimal) -> Option<Event> {
        let wanted = self.line.decimals();
        if wanted.is_some_and(|wanted| wanted as i32 != number.decimals) {
            return None;
        }
        let Settings {
            unit_m,
            offset_m,
            lower_m,
            upper_m,
            ..
        } = self.settings;
        let raw = number.digits;
        let position_m = number.to_f64() * unit_m + offset_m;
        if (lower_m..=upper_m).contains(&position_m) {
            Some(Event::Value(Sample { raw, position_m }))
        } else {
            Some(out_of_range(raw, position_m.clamp(lower_m, upper_m)))
        }
    }

    /// The line, with terminator, in which a probe sends `output`; empty if the settings have no text for it.
    pub fn write(&self, output: Output) -> Vec<u8> {
        let line = match output {
            Output::Position(position_m) => self.write_position(position_m),
            Output::Invalid => self.write_invalid(),
            Output::Error(code) => self.error.as_ref().and_then(|error| error.write("", code)),
        };
        let with_terminator = |line: Vec<u8>| [line.as_slice(), &self.terminator].concat();
        line.map_or_else(Vec::new, with_terminator)
    }

    fn write_position(&self, position_m: f64) -> Option<Vec<u8>> {
        let settings = &self.settings;
        let text = match (settings.over.first(), settings.under.first()) {
            (Some(over), _) if position_m > settings.upper_m => over.clone(),
            (_, Some(under)) if position_m < settings.lower_m => under.clone(),
            _ => self.number((position_m - settings.offset_m) / settings.unit_m),
        };
        self.line.write(&text, 0)
    }

    fn number(&self, number: f64) -> String {
        let width = self.line.width().unwrap_or(0);
        let decimals = self.line.decimals().unwrap_or(4);
        format!("{number:+0width$.decimals$}")
    }

    fn write_invalid(&self) -> Option<Vec<u8>> {
        let text = self.settings.invalid.first()?;
        self.line.write(text, 0)
    }
}

fn out_of_range(raw: i64, position_m: f64) -> Event {
    Event::OutOfRange(Sample { raw, position_m })
}

fn contains(texts: &[Vec<u8>], text: &[u8]) -> bool {
    texts.iter().any(|known| known == text)
}

fn check_scale(settings: &Settings) -> Result<(), SerialError> {
    positive("unit_m", settings.unit_m)?;
    positive("upper_m - lower_m", settings.upper_m - settings.lower_m)?;
    if settings.offset_m.is_finite() {
        return Ok(());
    }
    Err(SerialError::Setting {
        name: "offset_m",
        value: settings.offset_m.to_string(),
        expected: "a finite number of metres",
    })
}

fn value_pattern(text: &str) -> Result<Pattern, SerialError> {
    let pattern = Pattern::compile("line", text)?;
    match pattern.count_fields() {
        (1, 0) => Ok(pattern),
        _ => Err(refused("line", text, "{value} exactly once, and no {code}")),
    }
}

fn error_pattern(text: &str) -> Result<Pattern, SerialError> {
    let pattern = Pattern::compile("error", text)?;
    match pattern.count_fields() {
        (0, 1) => Ok(pattern),
        _ => Err(refused(
            "error",
            text,
            "{code} exactly once, and no {value}",
        )),
    }
}

fn terminator(text: &str) -> Result<Vec<u8>, SerialError> {
    let bytes = Pattern::bytes("terminator", text)?;
    match bytes.len() {
        1..=4 => Ok(bytes),
        _ => Err(refused(
            "terminator",
            text,
            "1 to 4 characters, such as \\r or \\r\\n",
        )),
    }
}

fn request(text: &str) -> Result<Vec<u8>, SerialError> {
    Pattern::bytes("request", text)
}

fn texts(name: &'static str, texts: &[String]) -> Result<Vec<Vec<u8>>, SerialError> {
    texts
        .iter()
        .map(|text| Pattern::bytes(name, text))
        .collect()
}

fn refused(name: &'static str, text: &str, expected: &'static str) -> SerialError {
    let value = format!("{text:?}");
    SerialError::Setting {
        name,
        value,
        expected,
    }
}
