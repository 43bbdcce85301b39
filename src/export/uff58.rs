//! Universal file format, dataset 58 (function at nodal degree of freedom), ASCII, double precision.
//!
//! Ordinates have the format E20.12 of the standard: 13 significant digits. Abscissas have at most 13 columns and 7 digits. Readers
//! split the lines at fixed columns.

use std::io::Write;

use super::file::Output;
use super::{ExportError, Quantity, SIGNALS, Signal};
use crate::identify::Frf;
use crate::recording::Recording;

/// Number of ordinates in a line.
const PER_LINE: usize = 4;

/// Codes of the standard.
const TIME_RESPONSE: u32 = 1;
const FREQUENCY_RESPONSE: u32 = 4;
const REAL_DOUBLE: u32 = 4;
const COMPLEX_DOUBLE: u32 = 6;
const UNEVEN: u32 = 0;
const EVEN: u32 = 1;

/// A quantity on an axis: code of the standard, label, unit.
struct Axis(u32, &'static str, &'static str);

const UNKNOWN: u32 = 0;
const NO_AXIS: Axis = Axis(UNKNOWN, "NONE", "NONE");
const TIME: Axis = Axis(17, "time", "s");
const FREQUENCY: Axis = Axis(18, "frequency", "Hz");
const DISPLACEMENT: Axis = Axis(8, "displacement", "m");
/// The standard has no code for a current.
const CURRENT: Axis = Axis(UNKNOWN, "current", "A");

/// What the header of a dataset says.
struct Dataset<'a> {
    name: &'a str,
    source: &'a str,
    function: u32,
    ordinates: u32,
    points: u64,
    spacing: u32,
    first: f64,
    increment: f64,
    abscissa: Axis,
    numerator: Axis,
    denominator: Axis,
}

/// A dataset for each displacement and current with a measurement in any tick. A tick without a measurement is `NaN`.
pub(super) fn signals(recording: &Recording, out: &mut Output) -> Result<(), ExportError> {
    let survey = Survey::of(recording)?;
    let source = recording.path().file_name().unwrap_or_default();
    let source = source.to_string_lossy();
    let measured = SIGNALS.iter().zip(survey.measured);
    for (signal, _) in measured.filter(|(_, measured)| *measured) {
        let Some(numerator) = axis(signal.quantity) else {
            continue;
        };
        let dataset = Dataset {
            name: signal.name,
            source: &source,
            function: TIME_RESPONSE,
            ordinates: REAL_DOUBLE,
            points: recording.tick_count(),
            spacing: EVEN,
            first: survey.first_s,
            increment: recording.period_s().unwrap_or_default(),
            abscissa: TIME,
            numerator,
            denominator: NO_AXIS,
        };
        dataset.write_header(out)?;
        write_ordinates(recording, signal, out)?;
        writeln!(out, "    -1")?;
    }
    Ok(())
}

/// The axis of a signal that gets a dataset.
fn axis(quantity: Quantity) -> Option<Axis> {
    match quantity {
        Quantity::Displacement => Some(DISPLACEMENT),
        Quantity::Current => Some(CURRENT),
        Quantity::Time | Quantity::Count => None,
    }
}

/// What must be known before the first dataset is written.
struct Survey {
    first_s: f64,
    /// Whether a signal has a measurement in any tick.
    measured: [bool; SIGNALS.len()],
}

impl Survey {
    /// Reads all ticks; refuses a recording with a gap.
    fn of(recording: &Recording) -> Result<Survey, ExportError> {
        let time_s = |scheduled_ns: u64| scheduled_ns as f64 / 1e9;
        let mut survey = Survey {
            first_s: 0.0,
            measured: [false; SIGNALS.len()],
        };
        let mut before: Option<(u64, u64)> = None;
        for record in recording.ticks()? {
            let record = record?;
            match before {
                None => survey.first_s = time_s(record.scheduled_ns),
                Some((tick, scheduled_ns)) if tick.checked_add(1) != Some(record.tick) => {
                    let time_s = time_s(scheduled_ns);
                    return Err(ExportError::Uneven { time_s });
                }
                Some(_) => {}
            }
            before = Some((record.tick, record.scheduled_ns));
            for (measured, signal) in survey.measured.iter_mut().zip(&SIGNALS) {
                *measured |= !signal.number(&record).is_nan();
            }
        }
        Ok(survey)
    }
}

fn write_ordinates(
    recording: &Recording,
    signal: &Signal,
    out: &mut Output,
) -> Result<(), ExportError> {
    let mut column = 0;
    for record in recording.ticks()? {
        write!(out, "{:>20}", exponential(signal.number(&record?), 12))?;
        column = (column + 1) % PER_LINE;
        if column == 0 {
            writeln!(out)?;
        }
    }
    if column > 0 {
        writeln!(out)?;
    }
    Ok(())
}

/// One dataset with the complex response at each frequency.
pub(super) fn response(frf: &Frf, source: &str, out: &mut Output) -> Result<(), ExportError> {
    let dataset = Dataset {
        name: "position_m / command_a",
        source,
        function: FREQUENCY_RESPONSE,
        ordinates: COMPLEX_DOUBLE,
        points: frf.len() as u64,
        spacing: UNEVEN,
        first: frf.frequency_hz.first().copied().unwrap_or_default(),
        increment: 0.0,
        abscissa: FREQUENCY,
        numerator: DISPLACEMENT,
        denominator: CURRENT,
    };
    dataset.write_header(out)?;
    for (frequency_hz, response) in frf.frequency_hz.iter().zip(&frf.response) {
        let [re, im] = [response.re, response.im].map(|part| exponential(part, 12));
        writeln!(out, "{:>13}{re:>20}{im:>20}", exponential(*frequency_hz, 6))?;
    }
    writeln!(out, "    -1")?;
    Ok(())
}

impl Dataset<'_> {
    /// Records 1 to 11 of the standard.
    fn write_header(&self, out: &mut Output) -> Result<(), ExportError> {
        writeln!(out, "    -1\n    58")?;
        for line in [self.name, "bench", "NONE", self.source, "NONE"] {
            writeln!(out, "{}", one_line(line))?;
        }
        let (function, zero, one) = (self.function, 0, 1);
        let place = format!(" {:<10}{one:10}{one:4}", "NONE");
        writeln!(out, "{function:5}{zero:10}{zero:5}{zero:10}{place}{place}")?;
        let [first, increment, z] =
            [self.first, self.increment, 0.0].map(|number| exponential(number, 6));
        writeln!(
            out,
            "{:10}{:10}{:10}{first:>13}{increment:>13}{z:>13}",
            self.ordinates, self.points, self.spacing
        )?;
        for Axis(code, label, unit) in
            [&self.abscissa, &self.numerator, &self.denominator, &NO_AXIS]
        {
            writeln!(
                out,
                "{code:10}{zero:5}{zero:5}{zero:5} {label:<20} {unit:<20}"
            )?;
        }
        Ok(())
    }
}

/// At most 80 printable ASCII characters, as the standard asks.
fn one_line(text: &str) -> String {
    let printable = |c: char| {
        if c == ' ' || c.is_ascii_graphic() {
            c
        } else {
            '?'
        }
    };
    text.chars().take(80).map(printable).collect()
}

/// As Fortran writes it: `1.5E-04`.
fn exponential(number: f64, decimals: usize) -> String {
    let text = format!("{number:.decimals$e}");
    let Some((mantissa, exponent)) = text.split_once('e') else {
        return text;
    };
    let (sign, digits) = match exponent.strip_prefix('-') {
        Some(digits) => ('-', digits),
        None => ('+', exponent),
    };
    format!("{mantissa}E{sign}{digits:0>2}")
}
