//! The numbers of a controller in a file.

use nalgebra::Complex;

use super::form::get;
use super::select::WHAT_TO_SAVE;
use super::value::{NumericArray, Value, Variables};

/// Largest order of a controller.
pub(super) const MAX_ORDER: usize = 32;

const ONE_INPUT: &str = "save a controller with one input and one output";

fn array<'a>(fields: &'a Variables, names: &[&str]) -> Result<(&'a str, &'a NumericArray), String> {
    match get(fields, names) {
        Some((name, Value::Numbers(array))) => Ok((name, array)),
        Some((name, other)) => Err(format!(
            "`{name}` is {}; save it as an array of numbers",
            other.summary()
        )),
        _ => Err(format!(
            "`{}` is missing; {WHAT_TO_SAVE}",
            names.first().unwrap_or(&"")
        )),
    }
}

fn vector<'a>(
    fields: &'a Variables,
    names: &[&str],
    limit: usize,
) -> Result<(&'a str, &'a [Complex<f64>]), String> {
    let (name, array) = array(fields, names)?;
    let size = array.size();
    let vector = array.vector();
    let vector = vector.ok_or_else(|| format!("`{name}` has the size {size}; {ONE_INPUT}"))?;
    if vector.len() > limit {
        Err(format!(
            "`{name}` has {} numbers, but the limit is {limit} (order {MAX_ORDER}); reduce the order",
            vector.len()
        ))
    } else {
        Ok((name, vector))
    }
}

fn finite(name: &str, number: &Complex<f64>) -> Result<(), String> {
    if number.re.is_finite() && number.im.is_finite() {
        Ok(())
    } else {
        Err(format!("`{name}` contains {number}; save finite numbers"))
    }
}

fn real(name: &str, number: &Complex<f64>) -> Result<f64, String> {
    finite(name, number)?;
    if number.im == 0.0 {
        Ok(number.re)
    } else {
        Err(format!(
            "`{name}` contains the complex number {}{:+}j; save a controller with real coefficients",
            number.re, number.im
        ))
    }
}

/// Coefficients of a polynomial.
pub(super) fn coefficients(fields: &Variables, names: &[&str]) -> Result<Vec<f64>, String> {
    let (name, vector) = vector(fields, names, MAX_ORDER + 1)?;
    if vector.is_empty() {
        return Err(format!("`{name}` is empty; save its coefficients"));
    }
    vector.iter().map(|number| real(name, number)).collect()
}

/// Zeros or poles as `[re, im]`.
pub(super) fn pairs(fields: &Variables, names: &[&str]) -> Result<Vec<[f64; 2]>, String> {
    let (name, vector) = vector(fields, names, MAX_ORDER)?;
    let pair = |root: &Complex<f64>| finite(name, root).map(|()| [root.re, root.im]);
    vector.iter().map(pair).collect()
}

/// One number.
pub(super) fn scalar(fields: &Variables, names: &[&str]) -> Result<f64, String> {
    let (name, array) = array(fields, names)?;
    match array.entries.as_slice() {
        [one] => real(name, one),
        _ => Err(format!(
            "`{name}` has the size {}; {ONE_INPUT}",
            array.size()
        )),
    }
}

/// One number; 0 if it is absent or empty.
pub(super) fn optional_scalar(fields: &Variables, names: &[&str]) -> Result<f64, String> {
    match get(fields, names) {
        Some((_, value)) if !value.is_empty() => scalar(fields, names),
        _ => Ok(0.0),
    }
}

/// A matrix by rows.
pub(super) fn rows(fields: &Variables, names: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    let (name, array) = array(fields, names)?;
    let size = array.size();
    let rows = array.rows();
    let rows = rows.ok_or_else(|| format!("`{name}` has the size {size}; save a matrix"))?;
    let row = |row: &Vec<Complex<f64>>| row.iter().map(|number| real(name, number)).collect();
    rows.iter().map(row).collect()
}

/// A square matrix by rows, of `states` rows if that is given.
pub(super) fn square(
    fields: &Variables,
    names: &[&str],
    states: Option<usize>,
) -> Result<Vec<Vec<f64>>, String> {
    let (name, array) = array(fields, names)?;
    let rows = rows(fields, names)?;
    let expected = states.unwrap_or(rows.len());
    let is_square = rows.len() == expected && rows.iter().all(|row| row.len() == expected);
    match (is_square, expected > MAX_ORDER) {
        (false, _) => Err(format!(
            "`{name}` has the size {} (rows x columns); save a square matrix with as many rows as states",
            array.size()
        )),
        (true, true) => Err(format!(
            "`{name}` has the size {} (rows x columns), but the limit of the order is {MAX_ORDER}; reduce the order",
            array.size()
        )),
        (true, false) => Ok(rows),
    }
}

/// B or C: one number for each state.
pub(super) fn per_state(
    fields: &Variables,
    names: &[&str],
    states: usize,
) -> Result<Vec<f64>, String> {
    let (name, array) = array(fields, names)?;
    match array.vector() {
        Some(vector) if vector.len() == states => {
            vector.iter().map(|number| real(name, number)).collect()
        }
        _ => Err(format!(
            "`{name}` has the size {}, but A has {states} rows; {ONE_INPUT}, with one number in B and in C for each state",
            array.size()
        )),
    }
}
