//! Variables in a JSON object: numbers, arrays of numbers, and arrays of `[re, im]` pairs for zeros and poles.

use nalgebra::Complex;
use serde_json::Value as Json;

use super::names::RootList;
use super::value::{MAX_ENTRIES, NumericArray, Value, Variables};
use crate::import_error::FormatError;

/// The variables of a JSON object.
pub(super) fn variables(bytes: &[u8]) -> Result<Variables, FormatError> {
    let failed = |why: String| FormatError::Json(why);
    let json: Json = serde_json::from_slice(bytes).map_err(|e| failed(e.to_string()))?;
    match json {
        Json::Object(entries) => Ok(fields(entries)),
        _ => Err(failed("the text is not an object".into())),
    }
}

fn fields(entries: serde_json::Map<String, Json>) -> Variables {
    // serde_json limits the depth.
    let entries = entries.into_iter();
    entries
        .map(|(name, json)| (name.clone(), value(&name, json)))
        .collect()
}

fn value(name: &str, json: Json) -> Value {
    match json {
        Json::Object(entries) => Value::Fields(fields(entries)),
        Json::Number(number) => number.as_f64().map_or_else(
            || Value::Other("a number out of range".into()),
            |x| Value::Numbers(NumericArray::scalar(x)),
        ),
        Json::Array(items) => {
            let array = match RootList::of(name) {
                _ if is_ambiguous(name, &items) => {
                    return Value::Other("one pair of numbers, which may be a complex root or two real ones (write real roots as a list of numbers)".into());
                }
                Some(_) => root_list(&items),
                None => numbers(&items),
            };
            array.map_or_else(
                || Value::Other("an array whose entries are not numbers, or whose rows have different lengths".into()),
                Value::Numbers,
            )
        }
        Json::Null => Value::Empty,
        Json::Bool(flag) => Value::Flag(flag),
        Json::String(text) => Value::Text(text),
    }
}

/// Whether `[[a, 0]]` is the cell `{[a 0]}` of `jsonencode(get(C))`, or the real root `a`.
fn is_ambiguous(name: &str, items: &[Json]) -> bool {
    let is_cell = RootList::of(name) == Some(RootList::Cell);
    let [Json::Array(pair)] = items else {
        return false;
    };
    is_cell && pair.len() == 2 && pair[1].as_f64() == Some(0.0)
}

/// Zeros or poles: numbers and `[re, im]` pairs.
fn root_list(items: &[Json]) -> Option<NumericArray> {
    let root = |item: &Json| match item.as_array().map(Vec::as_slice) {
        None => item.as_f64().map(|re| Complex::new(re, 0.0)),
        Some([re, im]) => Some(Complex::new(re.as_f64()?, im.as_f64()?)),
        Some(_) => None,
    };
    let entries: Vec<Complex<f64>> = items.iter().map(root).collect::<Option<_>>()?;
    limited(vec![entries.len()], &entries)
}

/// A vector, or a matrix by rows.
fn numbers(items: &[Json]) -> Option<NumericArray> {
    let row = |item: &Json| match item {
        Json::Array(row) => row.iter().map(Json::as_f64).collect(),
        _ => item.as_f64().map(|x| vec![x]),
    };
    let rows: Vec<Vec<f64>> = items.iter().map(row).collect::<Option<_>>()?;
    let columns = rows.first().map_or(0, Vec::len);
    if rows.iter().any(|row| row.len() != columns) {
        return None;
    }
    let is_vector = items.iter().all(|item| !item.is_array());
    let shape = if is_vector {
        vec![rows.len()]
    } else {
        vec![rows.len(), columns]
    };
    let entries = rows.iter().flatten().map(|x| Complex::new(*x, 0.0));
    limited(shape, &entries.collect::<Vec<_>>())
}

fn limited(shape: Vec<usize>, entries: &[Complex<f64>]) -> Option<NumericArray> {
    (entries.len() <= MAX_ENTRIES).then(|| NumericArray::from_rows(shape, entries))
}
