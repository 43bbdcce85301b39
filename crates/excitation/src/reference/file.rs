//! A reference from a CSV file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError};
use crate::waveform::Reference;
use bench_base::numeric::is_within;

/// A CSV file with the columns `time_s,reference_m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileReference {
    /// Path of the file.
    pub path: String,
}

impl ReferenceDesign for FileReference {
    fn describe(&self) -> String {
        format!("the file {}", self.path)
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        let text = context.file.unwrap_or_default();
        Ok(Box::new(Table::parse(&self.path, text, context.period_s)?))
    }

    fn check_file(
        &self,
        context: &ReferenceContext<'_>,
        soft_limit_m: f64,
    ) -> Result<(), ReferenceError> {
        let text = context.file.unwrap_or_default();
        let points = (1..).zip(text.lines().map(point));
        let mut points = points.filter_map(|(line, point)| Some((line, point?.1)));
        match points.find(|(_, value_m)| !is_within(value_m.abs(), soft_limit_m)) {
            None => Ok(()),
            Some((line, reference_m)) => Err(ReferenceError::Travel {
                path: self.path.clone(),
                line,
                reference_m,
                limit_m: soft_limit_m,
            }),
        }
    }

    fn can_identify(&self) -> bool {
        true
    }

    fn path(&self) -> Option<&str> {
        Some(&self.path)
    }
}

/// Points of a file, joined by straight lines; the first value before them, the last one after.
struct Table {
    points: Vec<(f64, f64)>,
    period_s: f64,
}

impl Table {
    fn parse(path: &str, text: &str, period_s: f64) -> Result<Table, ReferenceError> {
        match points(text) {
            Ok(points) => Ok(Table { points, period_s }),
            Err((line, why)) => Err(ReferenceError::Line {
                path: path.into(),
                line,
                why,
            }),
        }
    }
}

/// The points of a file; for an invalid one, the number of the line and what is wrong with it.
fn points(text: &str) -> Result<Vec<(f64, f64)>, (usize, String)> {
    let mut points = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let is_header = number == 1 && line.trim() == "time_s,reference_m";
        if !is_header && !line.trim().is_empty() {
            push_point(line, &mut points).map_err(|why| (number, why))?;
        }
    }
    if points.is_empty() {
        Err((1, "the file has no point".into()))
    } else {
        Ok(points)
    }
}

fn push_point(line: &str, points: &mut Vec<(f64, f64)>) -> Result<(), String> {
    let point = point(line).ok_or_else(|| format!("`{line}` is not two finite numbers"))?;
    if points.last().is_some_and(|before| before.0 >= point.0) {
        return Err(format!(
            "the time {} s is not after the one before",
            point.0
        ));
    }
    points.push(point);
    Ok(())
}

fn point(line: &str) -> Option<(f64, f64)> {
    let (time, value) = line.split_once(',')?;
    Some((finite_number(time)?, finite_number(value)?))
}

fn finite_number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|x: &f64| x.is_finite())
}

impl Reference for Table {
    fn at_m(&self, tick: u64) -> f64 {
        let time_s = tick as f64 * self.period_s;
        let after = self.points.partition_point(|(t, _)| *t <= time_s);
        match (
            after.checked_sub(1).and_then(|i| self.points.get(i)),
            self.points.get(after),
        ) {
            (Some(&(t0, r0)), Some(&(t1, r1))) => r0 + (r1 - r0) * (time_s - t0) / (t1 - t0),
            (Some(&(_, r)), None) | (None, Some(&(_, r))) => r,
            (None, None) => 0.0,
        }
    }
}
