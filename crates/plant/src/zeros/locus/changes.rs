//! The kind of change between two neighbouring samples.

use std::cmp::Ordering;

use nalgebra::Complex;
use serde::Serialize;

use super::census::{Census, LocusPlane, Sample};
use crate::zeros::kinds::{is_real, rectangular};

/// The place where the kinds change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Crossing {
    /// Two pairs meet on the imaginary axis, or a damped zero passes through it.
    #[serde(rename = "imaginary axis")]
    ImaginaryAxis,
    /// Two zeros meet on the real axis.
    #[serde(rename = "real axis")]
    RealAxis,
    /// A pair passes through the origin.
    #[serde(rename = "origin")]
    Origin,
    /// A pair passes through infinity.
    #[serde(rename = "infinity")]
    Infinity,
}

impl Crossing {
    /// Name of the place in the output.
    pub fn name(self) -> &'static str {
        match self {
            Crossing::ImaginaryAxis => "imaginary axis",
            Crossing::RealAxis => "real axis",
            Crossing::Origin => "origin",
            Crossing::Infinity => "infinity",
        }
    }
}

/// A value at which the kinds of the zeros change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindChange {
    /// The value, bisected to some 1e-14 of itself.
    pub value: f64,
    /// The place.
    #[serde(rename = "at")]
    pub crossing: Crossing,
    /// The zero in rad/s, of a conjugate pair the upper one, of mirror images without damping the right one; infinite
    /// where it passes through infinity.
    #[serde(flatten, serialize_with = "rectangular")]
    pub s: Complex<f64>,
    /// The kinds below the value.
    pub before: String,
    /// The kinds above the value.
    pub after: String,
}

/// The change between two samples at neighbouring values.
pub(super) fn change(plane: LocusPlane, low: &Sample, high: &Sample) -> KindChange {
    let (crossing, point) = crossing(low, high);
    let s = plane.root(point);
    KindChange {
        value: 0.5 * (low.value + high.value),
        crossing,
        s: Complex::new(s.re, s.im.abs()),
        before: low.census.to_string(),
        after: high.census.to_string(),
    }
}

fn crossing(low: &Sample, high: &Sample) -> (Crossing, Complex<f64>) {
    match (low.census, high.census) {
        (Census::Undamped(a), Census::Undamped(b)) => match a.quartets.cmp(&b.quartets) {
            Ordering::Equal => through_origin_or_infinity(low),
            Ordering::Less => meeting_of_squares(high),
            Ordering::Greater => meeting_of_squares(low),
        },
        (Census::Damped(a), Census::Damped(b)) => match a.real().cmp(&b.real()) {
            Ordering::Equal if a.complex_right != b.complex_right => {
                (Crossing::ImaginaryAxis, on_imaginary_axis(low))
            }
            Ordering::Equal => through_origin_or_infinity(low),
            // The complex pair is on the side with fewer real zeros. (Through infinity one real zero comes or goes.)
            Ordering::Less => (Crossing::RealAxis, meeting(low)),
            Ordering::Greater => (Crossing::RealAxis, meeting(high)),
        },
        _ => through_origin_or_infinity(low),
    }
}

/// The place where the two squares of a quartet become real: zeros of a positive square meet on the real axis.
fn meeting_of_squares(with_quartet: &Sample) -> (Crossing, Complex<f64>) {
    let square = meeting(with_quartet);
    let is_positive = square.re > 0.0;
    let crossing = if is_positive {
        Crossing::RealAxis
    } else {
        Crossing::ImaginaryAxis
    };
    (crossing, square)
}

/// The complex zero with the least of some measure.
fn nearest(sample: &Sample, measure: impl Fn(&Complex<f64>) -> f64) -> Option<Complex<f64>> {
    let complex = sample.points.iter().filter(|z| !is_real(**z));
    complex
        .min_by(|a, b| measure(a).total_cmp(&measure(b)))
        .copied()
}

/// The real part of the complex zero nearest to the real axis.
fn meeting(sample: &Sample) -> Complex<f64> {
    let nearest = nearest(sample, |z| z.im.abs() / z.norm());
    Complex::new(nearest.map_or(f64::NAN, |z| z.re), 0.0)
}

/// The imaginary part of the complex zero nearest to the imaginary axis.
fn on_imaginary_axis(sample: &Sample) -> Complex<f64> {
    let nearest = nearest(sample, |z| z.re.abs() / z.norm());
    Complex::new(0.0, nearest.map_or(f64::NAN, |z| z.im))
}

/// Origin or infinity, whichever a zero is nearer to.
fn through_origin_or_infinity(sample: &Sample) -> (Crossing, Complex<f64>) {
    let mut sizes: Vec<f64> = sample.points.iter().map(|z| z.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    let middle = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
    let least = sizes.first().copied().unwrap_or(0.0);
    let most = sizes.last().copied().unwrap_or(f64::INFINITY);
    if least * most < middle * middle && least < middle {
        (Crossing::Origin, Complex::new(0.0, 0.0))
    } else {
        (Crossing::Infinity, Complex::new(f64::INFINITY, 0.0))
    }
}
