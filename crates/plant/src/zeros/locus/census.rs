//! The followed points of a set of zeros, and their numbers by kind.

use std::fmt;

use nalgebra::Complex;

use super::matching::Point;
use crate::zeros::kinds::{Zero, ZeroCounts, ZeroKind, is_real};

/// The zeros that are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocusPlane {
    /// Zeros of the undamped plant, by u = s^2: one track for a pair, two for a quartet.
    Undamped,
    /// Zeros of the damped plant, each by itself.
    Damped,
}

impl LocusPlane {
    pub(super) fn points(self, zeros: &[Zero]) -> Vec<Complex<f64>> {
        match self {
            LocusPlane::Damped => zeros.iter().map(|zero| zero.s).collect(),
            LocusPlane::Undamped => {
                let one_of_each_pair = zeros.iter().filter(|zero| represents_pair(zero));
                one_of_each_pair.map(square).collect()
            }
        }
    }

    /// The zeros s of a track, continuous: of the two roots, the one nearer to the previous zero; at first the right
    /// or upper one.
    pub(super) fn places(self, track: &[Point]) -> Vec<Option<Complex<f64>>> {
        let mut last: Option<Complex<f64>> = None;
        let mut places = Vec::new();
        for point in track {
            let place = point.map(|point| self.continued(self.root(point), last));
            last = place.or(last);
            places.push(place);
        }
        places
    }

    fn continued(self, root: Complex<f64>, last: Option<Complex<f64>>) -> Complex<f64> {
        let is_turned = last.is_some_and(|last| (last + root).norm() < (last - root).norm());
        if self == LocusPlane::Undamped && is_turned {
            -root
        } else {
            root
        }
    }

    pub(super) fn root(self, point: Complex<f64>) -> Complex<f64> {
        match self {
            LocusPlane::Damped => point,
            LocusPlane::Undamped if point.im == 0.0 && point.re < 0.0 => {
                Complex::new(0.0, (-point.re).sqrt())
            }
            LocusPlane::Undamped => point.sqrt(),
        }
    }

    pub(super) fn census(self, zeros: &[Zero]) -> Census {
        if self == LocusPlane::Undamped {
            return Census::Undamped(ZeroCounts::of(zeros));
        }
        let count = |real: bool, right: bool| {
            zeros
                .iter()
                .filter(|zero| is_real(zero.s) == real && (zero.s.re > 0.0) == right)
                .count()
        };
        Census::Damped(DampedCounts {
            complex_left: count(false, false) / 2,
            complex_right: count(false, true) / 2,
            real_left: count(true, false),
            real_right: count(true, true),
        })
    }
}

fn represents_pair(zero: &Zero) -> bool {
    match zero.kind {
        ZeroKind::Mmp => zero.s.im > 0.0,
        kind => kind.is_non_minimum_phase(),
    }
}

/// s^2, exactly real on the axes.
fn square(zero: &Zero) -> Complex<f64> {
    match zero.kind {
        ZeroKind::Mmp => Complex::new(-zero.s.im * zero.s.im, 0.0),
        ZeroKind::Rnmp => Complex::new(zero.s.re * zero.s.re, 0.0),
        _ => zero.s * zero.s,
    }
}

/// Numbers of zeros by kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Census {
    Undamped(ZeroCounts),
    Damped(DampedCounts),
}

/// Numbers of zeros by half plane; complex ones by conjugate pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct DampedCounts {
    complex_left: usize,
    pub complex_right: usize,
    real_left: usize,
    real_right: usize,
}

impl DampedCounts {
    pub fn real(&self) -> usize {
        self.real_left + self.real_right
    }
}

impl fmt::Display for Census {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Census::Undamped(counts) => counts.fmt(f),
            Census::Damped(counts) => counts.fmt(f),
        }
    }
}

impl fmt::Display for DampedCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            (self.complex_left, "MMP or CMP"),
            (self.complex_right, "CNMP"),
            (self.real_left, "RMP"),
            (self.real_right, "RNMP"),
        ];
        let parts: Vec<String> = parts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| format!("{count} x {name}"))
            .collect();
        f.write_str(&parts.join(" + "))
    }
}

/// The zeros at one value.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub value: f64,
    pub points: Vec<Complex<f64>>,
    pub census: Census,
}
