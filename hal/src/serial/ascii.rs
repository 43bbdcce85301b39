//! Probes that write their values as lines of text: one line, one measurement.
//!
//! Which line is a value is a setting, in the pattern language of [`Settings::line`]. Keyence LK-G over RS-232 [manual LK-G
//! chapter 5, pages 5-5 and 5-6] is [`Settings::keyence_lk_g`]:
//!
//! ```text
//! +01.2345 CR     sign and seven characters, in the unit of the display (mm)
//! XXXXXXXX CR     invalid
//! +FFFFFFF CR     over range;  -FFFFFFF under range
//! ER,MA,01 CR     error: the command it answers, and a number
//! ```
//!
//! What came before the first terminator is never a value: its beginning may have been cut off, and a cut number is still
//! a number.
//!
//! What the protocol cannot know: nothing protects a digit that became another digit, and where the pattern does not fix
//! the size of the value (`{value:8.4}` does), a lost character makes a shorter number.

use super::decoder::{Damage, Decoder, Event, Sample, Window};
use super::error::{SerialError, positive};
use super::pattern::{Decimal, Pattern};

/// Longest line, terminator included.
const LINE_MAX: usize = 128;

/// How a probe writes. Texts may hold the escapes of the pattern language: `\r`, `\n`, `\t`, `\xNN`, `\\`, `\{`.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// A line with a measurement: literals and holes `{value}`, `{value:WIDTH.DECIMALS}`, `{skip}`; `{value}` once.
    pub line: String,
    /// What ends a line.
    pub terminator: String,
    /// Texts in the place of the value that say: not measured.
    pub invalid: Vec<String>,
    /// Texts in the place of the value that say: above the range.
    pub over: Vec<String>,
    /// Texts in the place of the value that say: below the range.
    pub under: Vec<String>,
    /// A line that reports an error: literals, `{skip}`, and `{code}` once.
    pub error: Option<String>,
    /// What the error numbers mean.
    pub error_texts: &'static [(i64, &'static str)],
    /// What to send to get a line; none if the probe speaks by itself.
    pub request: Option<String>,
    /// Metres of one unit of the number: 1e-3 if it is in millimetres.
    pub unit_m: f64,
    /// Metres at the number 0.
    pub offset_m: f64,
    /// Start of the range, metres.
    pub lower_m: f64,
    /// End of the range, metres.
    pub upper_m: f64,
}

impl Settings {
    /// Keyence LK-G showing millimetres with four decimals, sending by itself, with a range of `half_range_m` to both sides.
    pub fn keyence_lk_g(half_range_m: f64) -> Self {
        Self {
            line: "{value:8.4}".into(),
            terminator: "\\r".into(),
            invalid: vec!["XXXXXXXX".into()],
            over: vec!["+FFFFFFF".into()],
            under: vec!["-FFFFFFF".into()],
            error: Some("ER,{skip},{code}".into()),
            error_texts: KEYENCE_ERRORS,
            request: None,
            unit_m: 1e-3,
            offset_m: 0.0,
            lower_m: -half_range_m,
            upper_m: half_range_m,
        }
    }
}

/// Error numbers of the Keyence LK-G [manual, page 5-5].
pub const KEYENCE_ERRORS: &[(i64, &str)] = &[
    (0, "the probe does not know the command"),
    (1, "the probe cannot do this in its present state"),
    (20, "the command has the wrong length"),
    (21, "the command has the wrong number of parameters"),
    (22, "a parameter of the command is not valid"),
    (88, "the probe's controller timed out"),
];

/// The compiled settings, for both sides of the line.
#[derive(Clone, Debug)]
pub struct Writing {
    pub(super) settings: Settings,
    line: Pattern,
    error: Option<Pattern>,
    terminator: Vec<u8>,
    request: Option<Vec<u8>>,
    invalid: Vec<Vec<u8>>,
    over: Vec<Vec<u8>>,
    under: Vec<Vec<u8>>,
}

/// What a probe says in one line: the device's side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statement {
    /// A measurement.
    Metres(f64),
    /// Not measured.
    Invalid,
    /// An error number.
    Error(i64),
}

impl Writing {
    /// Compiles the settings, or says which of them makes no sense.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        positive("unit_m", settings.unit_m)?;
        positive("upper_m - lower_m", settings.upper_m - settings.lower_m)?;
        let words = |name, texts: &[String]| {
            texts
                .iter()
                .map(|text| Pattern::bytes(name, text))
                .collect::<Result<_, _>>()
        };
        let writing = Self {
            line: Pattern::compile("line", &settings.line)?,
            error: settings
                .error
                .as_deref()
                .map(|text| Pattern::compile("error", text))
                .transpose()?,
            terminator: Pattern::bytes("terminator", &settings.terminator)?,
            request: settings
                .request
                .as_deref()
                .map(|text| Pattern::bytes("request", text))
                .transpose()?,
            invalid: words("invalid", &settings.invalid)?,
            over: words("over", &settings.over)?,
            under: words("under", &settings.under)?,
            settings,
        };
        writing.check().map(|()| writing)
    }

    fn check(&self) -> Result<(), SerialError> {
        let refuse = |name, value: &str, wants| {
            Err(SerialError::Setting {
                name,
                value: format!("{value:?}"),
                wants,
            })
        };
        let settings = &self.settings;
        if self.line.holes() != (1, 0) {
            return refuse(
                "line",
                &settings.line,
                "{value} exactly once, and no {code}",
            );
        }
        if self
            .error
            .as_ref()
            .is_some_and(|error| error.holes() != (0, 1))
        {
            return refuse(
                "error",
                settings.error.as_deref().unwrap_or_default(),
                "{code} exactly once, and no {value}",
            );
        }
        if !(1..=4).contains(&self.terminator.len()) {
            return refuse(
                "terminator",
                &settings.terminator,
                "1 to 4 characters, such as \\r or \\r\\n",
            );
        }
        if !settings.offset_m.is_finite() {
            return refuse(
                "offset_m",
                &settings.offset_m.to_string(),
                "a finite number of metres",
            );
        }
        Ok(())
    }

    /// What `line` (without terminator) says; `None` if it fits no pattern.
    fn read(&self, line: &[u8]) -> Option<Event> {
        if let Some(code) = self.error.as_ref().and_then(|error| error.read(line)?.code) {
            let code = Decimal::read(code)
                .filter(|code| code.decimals == 0)?
                .digits;
            let known = self
                .settings
                .error_texts
                .iter()
                .find(|(number, _)| *number == code);
            let words = known.map_or(
                "the probe reports an error; its manual lists the number",
                |(_, words)| words,
            );
            return Some(Event::Fault { code, words });
        }
        let text = self.line.read(line)?.value?;
        let is = |words: &[Vec<u8>]| words.iter().any(|word| word == text);
        let Settings {
            lower_m, upper_m, ..
        } = self.settings;
        if is(&self.invalid) {
            return Some(Event::Fault {
                code: 0,
                words: "the probe cannot measure: no target, or too little light",
            });
        } else if is(&self.over) {
            return Some(Event::OutOfRange(Sample {
                raw: i64::MAX,
                position_m: upper_m,
            }));
        } else if is(&self.under) {
            return Some(Event::OutOfRange(Sample {
                raw: i64::MIN,
                position_m: lower_m,
            }));
        }
        let wanted = self.line.decimals();
        let number = Decimal::read(text)
            .filter(|number| wanted.is_none_or(|wanted| wanted as i32 == number.decimals))?;
        Some(self.event(number))
    }

    fn event(&self, number: Decimal) -> Event {
        let Settings {
            unit_m,
            offset_m,
            lower_m,
            upper_m,
            ..
        } = self.settings;
        let position_m = number.to_f64() * unit_m + offset_m;
        let sample = Sample {
            raw: number.digits,
            position_m: position_m.clamp(lower_m, upper_m),
        };
        if (lower_m..=upper_m).contains(&position_m) {
            Event::Value(sample)
        } else {
            Event::OutOfRange(sample)
        }
    }

    /// The line, with terminator, by which a probe makes `statement`; empty if these settings have no words for it.
    pub fn write(&self, statement: Statement) -> Vec<u8> {
        let line = match statement {
            Statement::Metres(position_m) => self.write_metres(position_m),
            Statement::Invalid => self
                .settings
                .invalid
                .first()
                .and_then(|word| self.line.write(word, 0)),
            Statement::Error(code) => self.error.as_ref().and_then(|error| error.write("", code)),
        };
        line.map_or_else(Vec::new, |line| {
            [line.as_slice(), &self.terminator].concat()
        })
    }

    fn write_metres(&self, position_m: f64) -> Option<Vec<u8>> {
        let Settings {
            unit_m,
            offset_m,
            lower_m,
            upper_m,
            ..
        } = self.settings;
        let number = (position_m - offset_m) / unit_m;
        let (width, decimals) = (
            self.line.width().unwrap_or(0),
            self.line.decimals().unwrap_or(4),
        );
        let text = match (self.settings.over.first(), self.settings.under.first()) {
            (Some(over), _) if position_m > upper_m => over.clone(),
            (_, Some(under)) if position_m < lower_m => under.clone(),
            _ => format!("{number:+0width$.decimals$}"),
        };
        self.line.write(&text, 0)
    }

    /// The request's bytes, if there is one.
    pub fn request(&self) -> Option<&[u8]> {
        self.request.as_deref()
    }
}

/// Decodes the lines of one probe.
#[derive(Debug)]
pub struct Ascii {
    writing: Writing,
    window: Window<LINE_MAX>,
    damage: Damage,
    /// Whether the beginning of the present line has been seen.
    whole: bool,
    message_bytes: u32,
}

impl Ascii {
    /// A decoder that has heard nothing yet.
    pub fn new(settings: Settings) -> Result<Self, SerialError> {
        let writing = Writing::new(settings)?;
        let (window, damage) = (Window::default(), Damage::default());
        Ok(Self {
            writing,
            window,
            damage,
            whole: false,
            message_bytes: 0,
        })
    }

    fn take_line(&mut self, out: &mut dyn FnMut(Event)) {
        let line = self.window.held();
        let text = &line[..line.len() - self.writing.terminator.len()]; // the caller saw the terminator
        let event = self.writing.read(text).filter(|_| self.whole);
        let bytes = self.window.clear();
        self.whole = true;
        match event {
            None => self.damage.add(bytes, out),
            Some(event) => {
                self.damage.end(out);
                self.message_bytes = bytes;
                out(event);
                out(Event::AnswerEnd);
            }
        }
    }
}

impl Decoder for Ascii {
    fn feed(&mut self, bytes: &[u8], out: &mut dyn FnMut(Event)) {
        for &byte in bytes {
            if !self.window.push(byte) {
                // Too long for a line: its beginning goes, so it will not be one, and its end is still looked for.
                self.window.drop_front(1);
                self.window.push(byte);
                self.damage.add(1, out);
                self.whole = false;
            }
            if self.window.held().ends_with(&self.writing.terminator) {
                self.take_line(out);
            }
        }
    }

    fn reset(&mut self, out: &mut dyn FnMut(Event)) {
        let begun = self.window.clear();
        self.damage.add(begun, out);
        self.damage.end(out);
        self.whole = self.writing.request.is_some(); // after a request on a silent line a line begins
    }

    fn request(&self) -> Option<&[u8]> {
        self.writing.request()
    }

    fn message_bytes(&self) -> u32 {
        self.message_bytes
    }
}
