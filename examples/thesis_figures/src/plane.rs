//! Charts in the plane of s: poles, zeros, and where zeros migrate.

use nalgebra::Complex;

use super::FigureError;
use super::model::Varied;
use bench_plant::zeros::{
    KindChange, Locus, LocusPlane, ModalSum, Zero, damped_zeros, undamped_zeros,
};
use bench_report::colours::{BLUE, Colour, GREY, INK};
use bench_report::{Chart, Mark, Pen, Scale, Symbol};

/// A coordinate beyond every frame.
const FAR: f64 = 1e9;

/// A chart of the plane of s in rad/s, with its imaginary and real axis.
pub(crate) fn plane(heading: &str, re: (f64, f64), im: (f64, f64)) -> Chart {
    Chart::new(
        heading,
        Scale::linear("Real part of s (rad/s)").within(re.0, re.1),
        Scale::linear("Imaginary part of s (rad/s)").within(im.0, im.1),
    )
    .line("", Pen::solid(GREY).thin(), vec![(-FAR, 0.0), (FAR, 0.0)])
    .line("", Pen::solid(GREY).thin(), vec![(0.0, -FAR), (0.0, FAR)])
}

/// Poles of a sum in the upper half plane.
pub(crate) fn poles(sum: &ModalSum) -> Vec<(f64, f64)> {
    let pole = |w: f64, zeta: f64| (-zeta * w, w * (1.0 - zeta * zeta).max(0.0).sqrt());
    sum.terms()
        .iter()
        .map(|term| pole(term.omega_rad_s, term.damping_ratio))
        .collect()
}

/// Zeros in the upper half plane, the real axis included.
pub(crate) fn places(zeros: &[Zero]) -> Vec<(f64, f64)> {
    zeros
        .iter()
        .filter(|zero| zero.s.im >= 0.0)
        .map(|zero| (zero.s.re, zero.s.im))
        .collect()
}

/// Which part of the plane is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// All zeros mirrored into the first quadrant.
    Quadrant,
    /// The upper half, of zeros without damping: one track stands for s and -s.
    Upper,
    /// Zeros with damping, each by itself.
    Damped,
}

/// Zeros of a plant over a setting, dense where they meet.
pub(crate) fn locus(
    varied: &Varied,
    plane: LocusPlane,
    values: &[f64],
) -> Result<Locus, FigureError> {
    follow(plane, values, |value| {
        let structure = varied.structure(value)?;
        Ok(if plane == LocusPlane::Undamped {
            undamped_zeros(&structure)?
        } else {
            damped_zeros(&structure)?
        })
    })
}

/// Follows zeros again with more values: close to where they meet, because they move there with the square root of
/// the distance, and where they move far from one value to the next.
pub(crate) fn follow(
    plane: LocusPlane,
    values: &[f64],
    mut zeros: impl FnMut(f64) -> Result<Vec<Zero>, FigureError>,
) -> Result<Locus, FigureError> {
    let mut locus = Locus::follow(plane, values, &mut zeros)?;
    let meetings: Vec<f64> = locus
        .changes
        .iter()
        .flat_map(|change| beside(change.value, values))
        .collect();
    for round in 0..REFINEMENTS {
        let mut all: Vec<f64> = locus
            .values
            .iter()
            .copied()
            .chain(between(&locus))
            .collect();
        if round == 0 {
            all.extend(&meetings);
        }
        locus = Locus::follow(plane, &ordered(all, values), &mut zeros)?;
    }
    Ok(locus)
}

/// Rounds of refinement.
const REFINEMENTS: usize = 3;
/// Largest motion of a zero from one value to the next, as a ratio of its magnitude.
const MAX_MOTION_RATIO: f64 = 0.03;

/// Values to both sides of a meeting, nearer and nearer.
fn beside(value: f64, values: &[f64]) -> Vec<f64> {
    let range = (values[values.len() - 1] - values[0]).abs();
    let size = if value == 0.0 {
        range
    } else {
        value.abs().min(range)
    };
    (2..40)
        .flat_map(|k| [value - size * 0.5f64.powi(k), value + size * 0.5f64.powi(k)])
        .collect()
}

/// Values between those where some zero moved too far.
fn between(locus: &Locus) -> Vec<f64> {
    let far = |k: &usize| {
        let moved = |track: &Vec<Option<Complex<f64>>>| match (track[*k], track[k + 1]) {
            (Some(a), Some(b)) => (a - b).norm() > MAX_MOTION_RATIO * (a.norm() + b.norm()),
            _ => false,
        };
        locus.tracks.iter().any(moved)
    };
    let middle = |k: usize| {
        let (a, b) = (locus.values[k], locus.values[k + 1]);
        if a * b > 0.0 {
            (a * b).sqrt().copysign(a)
        } else {
            0.5 * (a + b)
        }
    };
    (0..locus.values.len() - 1)
        .filter(far)
        .map(middle)
        .collect()
}

/// In the order of `values` and within their ends, each once.
fn ordered(mut all: Vec<f64>, values: &[f64]) -> Vec<f64> {
    let (first, last) = (values[0], values[values.len() - 1]);
    all.retain(|value| (first.min(last)..=first.max(last)).contains(value));
    all.sort_by(f64::total_cmp);
    all.dedup();
    if first > last {
        all.reverse();
    }
    all
}

/// The tracks of a locus as lines of one pen.
pub(crate) fn tracks(mut chart: Chart, name: &str, pen: Pen, locus: &Locus, part: Part) -> Chart {
    let mut name = name;
    for track in &locus.tracks {
        for points in views(track, part) {
            chart = chart.mark(Mark::Line {
                name: name.into(),
                pen,
                points,
                directed: false,
            });
            name = "";
        }
    }
    chart
}

/// A track as it is drawn: without damping, one zero of a pair s, -s represents both.
fn views(track: &[Option<Complex<f64>>], part: Part) -> Vec<Vec<(f64, f64)>> {
    let seen = |of: fn(Complex<f64>) -> (f64, f64)| {
        track
            .iter()
            .map(|s| s.map_or((f64::NAN, f64::NAN), of))
            .collect::<Vec<_>>()
    };
    match part {
        Part::Quadrant => vec![seen(|s| (s.re.abs(), s.im.abs()))],
        Part::Damped => vec![seen(|s| (s.re, s.im))],
        Part::Upper => vec![seen(|s| (s.re, s.im)), seen(|s| (-s.re, -s.im))],
    }
}

/// Where zeros meet, on the axes.
pub(crate) fn changes(chart: Chart, locus: &Locus) -> Chart {
    let finite = |change: &&KindChange| change.s.re.is_finite() && change.s.norm() > 0.0;
    let points: Vec<(f64, f64)> = locus
        .changes
        .iter()
        .filter(finite)
        .map(|c| (c.s.re, c.s.im))
        .collect();
    if points.is_empty() {
        chart
    } else {
        chart.points("zeros meet", INK, Symbol::Dot, points)
    }
}

/// Poles and zeros of one plant.
pub(crate) fn pole_zero(
    chart: Chart,
    names: (&str, &str),
    colour: Colour,
    sum: &ModalSum,
    zeros: &[Zero],
) -> Chart {
    chart
        .points(names.0, INK, Symbol::Cross, poles(sum))
        .points(
            names.1,
            if colour == INK { BLUE } else { colour },
            Symbol::Ring,
            places(zeros),
        )
}
