//! The time responses of a universal file as variables.

use super::dataset::{Dataset, Function};
use crate::number::Numbers;
use crate::value::{NumericArray, Value, Variables};

/// The time responses, and `time` if they have the same times, or else `NAME.time` for each. Other functions are named.
///
/// A response has the name of its ID line 1, if all of them have different ones, or else of its node and direction, or else of both with
/// its number.
pub(crate) fn records(datasets: &[Dataset]) -> Variables {
    let times: Vec<&Dataset> = datasets
        .iter()
        .filter(|dataset| dataset.function == Function::TimeResponse)
        .collect();
    let names = names(&times);
    let is_common = times
        .windows(2)
        .all(|pair| pair[0].abscissas == pair[1].abscissas);
    let mut variables = Variables::new();
    if let (Some(first), true) = (times.first(), is_common) {
        variables.push(("time".into(), time(first)));
    }
    for (name, dataset) in names.into_iter().zip(&times) {
        if !is_common {
            variables.push((format!("{name}.time"), time(dataset)));
        }
        variables.push((name, array(&dataset.ordinates, dataset.unit.clone())));
    }
    let others = datasets.iter().filter_map(other);
    variables.extend(others);
    variables
}

/// The times are in seconds, if the axis has no other unit.
fn time(dataset: &Dataset) -> Value {
    let unit = dataset.abscissa_unit.clone();
    array(&dataset.abscissas, unit.or(Some("s".into())))
}

fn array(numbers: &Numbers, unit: Option<String>) -> Value {
    Value::Numbers(NumericArray {
        shape: vec![numbers.len()],
        numbers: numbers.clone(),
        unit,
    })
}

fn names(datasets: &[&Dataset]) -> Vec<String> {
    let ids: Vec<String> = datasets.iter().map(|dataset| dataset.id.clone()).collect();
    let places: Vec<String> = datasets
        .iter()
        .map(|dataset| dataset.place.clone())
        .collect();
    if are_different(&ids) {
        ids
    } else if are_different(&places) {
        places
    } else {
        let both = ids.iter().zip(&places).zip(1..);
        let named = both.map(|((id, place), number)| format!("{id} {place} {number}"));
        named.map(|name| name.trim().to_string()).collect()
    }
}

fn are_different(names: &[String]) -> bool {
    let mut sorted: Vec<&String> = names.iter().collect();
    sorted.sort();
    sorted.windows(2).all(|pair| pair[0] != pair[1]) && sorted.iter().all(|name| !name.is_empty())
}

fn other(dataset: &Dataset) -> Option<(String, Value)> {
    let what = match dataset.function {
        Function::TimeResponse => return None,
        Function::FrequencyResponse => "a frequency response, not a time response".into(),
        Function::Other(code) => format!("a function of type {code}, not a time response (1)"),
    };
    Some((dataset.id.clone(), Value::Other(what)))
}
