//! Universal file format, dataset 58 (function at nodal degree of freedom), ASCII, double precision.
//!
//! Ordinates have the format E20.12 of the standard: 13 significant digits. Abscissas have the 13 columns of the format E13.5, in
//! which a reader takes up to 12 digits. Readers split the lines at fixed columns.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use super::file::Output;
use super::response::Response;
use super::rows::{self, Rows};
use super::sections::Sections;
use super::{ExportError, Quantity, SIGNALS, Signal, Value};
use bench_recording::Recording;
use bench_rt::record::TickRecord;

/// Number of ordinates in a line.
const PER_LINE: u64 = 4;
/// Columns of an ordinate.
const ORDINATE: u64 = 20;
/// Columns of an abscissa.
const ABSCISSA: usize = 13;
/// The line before and after a dataset.
const DELIMITER: &str = "    -1\n";

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
pub(super) fn signals(recording: &Path, file: &File) -> Result<Recording, ExportError> {
    let mut survey = Survey::default();
    let recording = rows::open(recording, &mut survey)?;
    require_regular_times(&recording)?;
    let measured = SIGNALS.iter().zip(survey.measured).filter(|(_, is)| *is);
    let (signals, heads): (Vec<&Signal>, Vec<String>) = measured
        .filter_map(|(signal, _)| {
            let numerator = axis(signal)?;
            Some((signal, head(&recording, &survey, signal, numerator)))
        })
        .unzip();
    let rows = recording.tick_count();
    let data = ORDINATE * rows + rows.div_ceil(PER_LINE) + DELIMITER.len() as u64;
    let lengths = heads.iter().map(|head| head.len() as u64 + data);
    let mut datasets = Datasets {
        sections: Sections::new(file, lengths),
        signals,
        rows: 0,
    };
    for (index, head) in heads.iter().enumerate() {
        datasets.sections.append(index, head.as_bytes())?;
    }
    rows::read(&recording, &mut datasets)?;
    datasets.finish()?;
    Ok(recording)
}

/// The header of the dataset of a signal.
fn head(recording: &Recording, survey: &Survey, signal: &Signal, numerator: Axis) -> String {
    let source = recording.path().file_name().unwrap_or_default();
    let dataset = Dataset {
        name: signal.name,
        source: &source.to_string_lossy(),
        function: TIME_RESPONSE,
        ordinates: REAL_DOUBLE,
        points: recording.tick_count(),
        spacing: EVEN,
        first: survey.first_s.unwrap_or_default(),
        increment: recording.period_s().unwrap_or_default(),
        abscissa: TIME,
        numerator,
        denominator: NO_AXIS,
    };
    dataset.header()
}

/// Writes the ordinates of each dataset.
struct Datasets<'a> {
    sections: Sections<'a>,
    signals: Vec<&'static Signal>,
    /// Ticks so far.
    rows: u64,
}

impl Rows for Datasets<'_> {
    fn push(&mut self, record: &TickRecord) -> Result<(), ExportError> {
        self.rows += 1;
        let end = if self.rows.is_multiple_of(PER_LINE) {
            "\n"
        } else {
            ""
        };
        for (index, signal) in self.signals.iter().enumerate() {
            let ordinate = format!("{:>20}{end}", exponential(signal.number(record), 12));
            self.sections.append(index, ordinate.as_bytes())?;
        }
        Ok(())
    }
}

impl Datasets<'_> {
    /// Ends the last line and the dataset.
    fn finish(mut self) -> Result<(), ExportError> {
        let end = if self.rows.is_multiple_of(PER_LINE) {
            DELIMITER.to_string()
        } else {
            format!("\n{DELIMITER}")
        };
        for index in 0..self.signals.len() {
            self.sections.append(index, end.as_bytes())?;
        }
        self.sections.finish()
    }
}

/// The axis of a signal that gets a dataset.
fn axis(signal: &Signal) -> Option<Axis> {
    match signal.value {
        Value::Real(Quantity::Displacement, _) => Some(DISPLACEMENT),
        Value::Real(Quantity::Current, _) => Some(CURRENT),
        Value::Real(Quantity::Time, _) | Value::Count(_) => None,
    }
}

/// What must be known before the first dataset is written.
#[derive(Default)]
struct Survey {
    /// Time of the first tick in seconds.
    first_s: Option<f64>,
    /// Whether a signal has a measurement in any tick.
    measured: [bool; SIGNALS.len()],
}

impl Rows for Survey {
    fn push(&mut self, record: &TickRecord) -> Result<(), ExportError> {
        self.first_s.get_or_insert(record.scheduled_ns as f64 / 1e9);
        for (measured, signal) in self.measured.iter_mut().zip(&SIGNALS) {
            *measured |= !signal.number(record).is_nan();
        }
        Ok(())
    }
}

/// Refuses a recording with a gap.
fn require_regular_times(recording: &Recording) -> Result<(), ExportError> {
    match recording.gaps().first() {
        Some(gap) => Err(ExportError::Uneven {
            after_tick: gap.after_tick,
            before_tick: gap.before_tick,
        }),
        None => Ok(()),
    }
}

/// One dataset with the complex response at each frequency.
pub(super) fn response(response: &Response<'_>, out: &mut Output) -> Result<(), ExportError> {
    let frf = response.frf;
    let dataset = Dataset {
        name: "position_m / command_a",
        source: response.source,
        function: FREQUENCY_RESPONSE,
        ordinates: COMPLEX_DOUBLE,
        points: frf.len() as u64,
        spacing: UNEVEN,
        first: 0.0,
        increment: 0.0,
        abscissa: FREQUENCY,
        numerator: DISPLACEMENT,
        denominator: CURRENT,
    };
    out.write_all(dataset.header().as_bytes())?;
    for (frequency_hz, response) in frf.frequency_hz.iter().zip(&frf.response) {
        let [re, im] = [response.re, response.im].map(|part| exponential(part, 12));
        writeln!(out, "{}{re:>20}{im:>20}", abscissa(*frequency_hz))?;
    }
    Ok(out.write_all(DELIMITER.as_bytes())?)
}

impl Dataset<'_> {
    /// Records 1 to 11 of the standard.
    fn header(&self) -> String {
        let lines = [self.name, "bench", "NONE", self.source, "NONE"].map(one_line);
        let (function, zero, one) = (self.function, 0, 1);
        let place = format!(" {:<10}{one:10}{one:4}", "NONE");
        let form = format!("{:10}{:10}{:10}", self.ordinates, self.points, self.spacing);
        let [first, increment, z] = [self.first, self.increment, 0.0].map(abscissa);
        let axes = [&self.abscissa, &self.numerator, &self.denominator, &NO_AXIS];
        let records = [
            format!("{DELIMITER}    58"),
            lines.join("\n"),
            format!("{function:5}{zero:10}{zero:5}{zero:10}{place}{place}"),
            format!("{form}{first}{increment}{z}"),
            axes.map(Axis::record).join("\n"),
        ];
        records.join("\n") + "\n"
    }
}

impl Axis {
    fn record(&self) -> String {
        let (Axis(code, label, unit), zero) = (self, 0);
        format!("{code:10}{zero:5}{zero:5}{zero:5} {label:<20} {unit:<20}")
    }
}

/// The text of 13 columns that is nearest to a number: the standard asks for E13.5, a reader takes any form with a decimal point.
/// From 1e-9 to 1e9 it has at least 9 digits.
fn abscissa(number: f64) -> String {
    let exponential = |decimals: usize| format!("{number:.decimals$E}");
    let decimal = |decimals: usize| format!("{number:.decimals$}");
    let candidates = (1..ABSCISSA).flat_map(|decimals| [decimal(decimals), exponential(decimals)]);
    let error = |text: &String| {
        let read: f64 = text.parse().unwrap_or(f64::INFINITY);
        (read - number).abs()
    };
    let fitting = candidates.filter(|text| text.len() <= ABSCISSA);
    let nearest = fitting.min_by(|a, b| error(a).total_cmp(&error(b)));
    format!("{:>ABSCISSA$}", nearest.unwrap_or_default())
}

/// At most 80 printable ASCII characters, as the standard asks.
fn one_line(text: &str) -> String {
    let printable = |c: char| match c {
        ' ' => c,
        c if c.is_ascii_graphic() => c,
        _ => '?',
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn abscissa_has_13_columns_and_the_digits_that_they_hold() {
        for (number, expected) in [
            (0.0, "          0.0"),
            (2e-4, "       2.0E-4"),
            (119.9998, "     119.9998"),
            (1.0 / 4096.0, "2.44140625E-4"),
            (1.0 / 3000.0, "3.33333333E-4"),
            (1000.0 / 3.0, "333.333333333"),
            (f64::MIN_POSITIVE, "2.225074E-308"),
        ] {
            assert_eq!(abscissa(number).trim(), expected.trim());
            assert_eq!(abscissa(number).len(), ABSCISSA);
        }
    }
}
