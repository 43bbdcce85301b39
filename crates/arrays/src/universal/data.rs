//! The data of a dataset: text, or binary numbers.

use num_complex::Complex;

use super::dataset::{Function, is_delimiter};
use super::header::{Even, Form, Header, number};
use crate::budget::Budget;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;
use crate::number::{Class, Numbers, Precision, Stored};

/// Fewest digits of a step that is rounded: Fortran writes five (`0.33333E-03`). One with fewer digits is exact.
const ROUNDED_DIGITS: usize = 5;

/// Abscissas and ordinates.
pub(super) struct Data {
    pub abscissas: Numbers,
    pub ordinates: Numbers,
}

pub(super) fn read(
    file: &mut Bytes<'_>,
    form: Form,
    header: &Header,
    budget: &mut Budget,
) -> Result<Data, ArraysError> {
    // Up to two numbers of an ordinate, and its abscissa.
    budget.take(header.points, 24)?;
    let data = match form {
        Form::Text => text(file, header),
        Form::Binary(order) => binary(file, order, header),
        Form::OtherBinary => Err(file.damaged("binary numbers of the IEEE format")),
    }?;
    let abscissas = match (data.abscissas, &header.even) {
        (Some(abscissas), _) => abscissas,
        (None, Some(even)) => abscissas(even, header),
        (None, None) => return Err(file.damaged("abscissas")),
    };
    Ok(Data {
        abscissas,
        ordinates: data.ordinates,
    })
}

/// Data as they are written: with abscissas if they are not of equal distance.
struct Written {
    abscissas: Option<Numbers>,
    ordinates: Numbers,
}

/// Abscissas of equal distance.
fn abscissas(even: &Even, header: &Header) -> Numbers {
    let places = (0..header.points).map(|k| k as f64);
    let values: Vec<f64> = match (header.function, rate_hz(even)) {
        (Function::TimeResponse, Some(rate_hz)) => {
            places.map(|k| even.first + k / rate_hz).collect()
        }
        _ => places.map(|k| even.first + k * even.step).collect(),
    };
    Numbers::Real(values, Precision::Double)
}

/// 1/step: of a rounded step (`3.33333e-04`) the number of fewest digits within its rounding. `None` for a step that is exact.
fn rate_hz(even: &Even) -> Option<f64> {
    let text = even.step_text.to_ascii_lowercase().replace('d', "e");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digits = mantissa.bytes().filter(u8::is_ascii_digit);
    let decimals = mantissa
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let exponent: i32 = exponent.parse().ok()?;
    let last_digit = 10_f64.powi(exponent.checked_sub(decimals as i32)?);
    if digits.skip_while(|digit| *digit == b'0').count() < ROUNDED_DIGITS || even.step <= 0.0 {
        return None;
    }
    let (rate_hz, tolerance) = (1.0 / even.step, 0.5 * last_digit / even.step);
    let rounded = (0..17).filter_map(|digits| format!("{rate_hz:.digits$e}").parse::<f64>().ok());
    let mut near = rounded.filter(|rounded| (rounded / rate_hz - 1.0).abs() <= tolerance);
    near.next()
}

/// Numbers of each point: the abscissa, if it has one, and the parts of the ordinate.
fn parts(header: &Header) -> (usize, usize) {
    let abscissas = usize::from(header.even.is_none());
    (abscissas, if header.is_complex { 2 } else { 1 })
}

/// Numbers in text up to the line behind the dataset.
fn text(file: &mut Bytes<'_>, header: &Header) -> Result<Written, ArraysError> {
    let (abscissas, ordinates) = parts(header);
    let each = abscissas + ordinates;
    let stated = "as many numbers as line 7 of a dataset 58 states";
    let count = header.points.checked_mul(each);
    let count = count.ok_or_else(|| file.damaged(stated))?;
    let mut numbers = Vec::new();
    loop {
        let place = *file;
        let line = file.line();
        let line = line.ok_or_else(|| place.damaged("the line -1 behind a dataset 58"))?;
        if is_delimiter(line) {
            break;
        }
        let line = String::from_utf8_lossy(line);
        for word in line.split_whitespace() {
            let number = number(word).ok_or_else(|| place.damaged("a line of numbers"))?;
            if numbers.len() == count {
                return Err(place.damaged(stated));
            }
            numbers.push(number);
        }
    }
    if numbers.len() != count {
        return Err(file.damaged(stated));
    }
    Ok(split(&numbers, abscissas, header.is_complex))
}

fn split(numbers: &[f64], abscissas: usize, is_complex: bool) -> Written {
    let each = abscissas + if is_complex { 2 } else { 1 };
    let points = numbers.chunks_exact(each);
    let ordinates = if is_complex {
        let pairs = points
            .clone()
            .map(|point| Complex::new(point[each - 2], point[each - 1]));
        Numbers::Complex(pairs.collect())
    } else {
        Numbers::Real(
            points.clone().map(|point| point[each - 1]).collect(),
            Precision::Double,
        )
    };
    let abscissas = (abscissas > 0)
        .then(|| Numbers::Real(points.map(|point| point[0]).collect(), Precision::Double));
    Written {
        abscissas,
        ordinates,
    }
}

/// Binary numbers. The number of bytes that a file states is not relied on, as pyuff writes a wrong one: behind the data stands the
/// line -1. Abscissas of double ordinates are single by the standard, and double as pyuff writes them.
fn binary(file: &mut Bytes<'_>, order: ByteOrder, header: &Header) -> Result<Written, ArraysError> {
    let (abscissas, _) = parts(header);
    let size = if header.is_double { 8 } else { 4 };
    let ordinate = if header.is_complex {
        Stored::new(Class::Complex, 2 * size)
    } else {
        Stored::new(Class::Float, size)
    };
    for abscissa_size in [size, 4] {
        let start = abscissas * abscissa_size;
        let each = start + ordinate.size;
        let Some(data) = data_before_end(file, header.points, each) else {
            continue;
        };
        let points = data.chunks_exact(each);
        let abscissa = Stored::new(Class::Float, abscissa_size);
        let written = Written {
            ordinates: ordinate.numbers(order, points.clone().map(|point| &point[start..])),
            abscissas: (start > 0)
                .then(|| abscissa.numbers(order, points.map(|point| &point[..abscissa_size]))),
        };
        file.take(data.len(), "the data of a dataset 58b")?;
        // The rest of the line, and the line behind the dataset.
        while file.line().is_some_and(|line| !is_delimiter(line)) {}
        return Ok(written);
    }
    Err(file
        .damaged("as many numbers as line 7 of a dataset 58b states, and the line -1 behind them"))
}

/// The data of so many points, if the line behind the dataset follows them.
fn data_before_end<'a>(file: &Bytes<'a>, points: usize, each: usize) -> Option<&'a [u8]> {
    let (data, behind) = file.rest().split_at_checked(points.checked_mul(each)?)?;
    let behind = behind.strip_prefix(b"\r").unwrap_or(behind);
    let behind = behind.strip_prefix(b"\n").unwrap_or(behind);
    behind.starts_with(b"    -1").then_some(data)
}
