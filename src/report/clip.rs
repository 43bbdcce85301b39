//! Lines cut off at a frame, and thinned out to what a screen can show.

use super::curve::{self, Sample};

/// A rectangle in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

/// Points of a line may lie so far beside it that nobody sees it, in pixels.
const UNSEEN: f64 = 0.15;

impl Frame {
    pub fn holds(&self, (x, y): (f64, f64)) -> bool {
        // Half a rounding of the page, so that a point on the frame is in it.
        let slack = 0.06;
        x >= self.left - slack
            && x <= self.right + slack
            && y >= self.top - slack
            && y <= self.bottom + slack
    }

    /// The nearest point of the frame.
    pub fn nearest(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            x.clamp(self.left, self.right),
            y.clamp(self.top, self.bottom),
        )
    }

    /// The pieces of a line inside of the frame, thinned out.
    pub fn pieces(&self, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
        let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut open = false;
        for pair in points.windows(2) {
            let Some((from, to)) = self.segment(pair[0], pair[1]) else {
                open = false;
                continue;
            };
            match pieces.last_mut().filter(|_| open && from == pair[0]) {
                Some(piece) => piece.push(to),
                None => pieces.push(vec![from, to]),
            }
            open = to == pair[1];
        }
        pieces.into_iter().map(|piece| thinned(&piece)).collect()
    }

    /// The part of a segment inside of the frame (Liang and Barsky 1984); `None` where it is all outside or no number.
    fn segment(&self, from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        if !(dx.is_finite() && dy.is_finite()) {
            return None;
        }
        let (mut enters, mut leaves) = (0.0, 1.0);
        let sides = [
            (-dx, from.0 - self.left),
            (dx, self.right - from.0),
            (-dy, from.1 - self.top),
            (dy, self.bottom - from.1),
        ];
        for (towards, room) in sides {
            if towards == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if towards < 0.0 {
                enters = f64::max(enters, room / towards);
            } else {
                leaves = f64::min(leaves, room / towards);
            }
        }
        // Of ends far away the sum is rounded: the frame has the last word.
        let at = |t: f64| self.nearest((from.0 + t * dx, from.1 + t * dy));
        let start = if enters > 0.0 { at(enters) } else { from };
        let end = if leaves < 1.0 { at(leaves) } else { to };
        (enters <= leaves).then_some((start, end))
    }
}

/// A line with as few points as look the same.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let rising = points.windows(2).all(|pair| pair[1].0 >= pair[0].0);
    let width = points[points.len() - 1].0 - points[0].0;
    if rising && points.len() as f64 > 3.0 * width.max(1.0) {
        let sample = |&(x, y): &(f64, f64)| Sample {
            x,
            y,
            band: (y, y),
            faint: false,
            begins: false,
        };
        let samples: Vec<Sample> = points.iter().map(sample).collect();
        return curve::columns(&samples)
            .into_iter()
            .flat_map(|column| column.points)
            .collect();
    }
    simplified(points)
}

/// Douglas and Peucker 1973, without recursion.
fn simplified(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept = vec![false; points.len()];
    let last = points.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let beside = |k: &usize| distance(points[*k], points[from], points[to]);
        let Some(far) = (from + 1..to).max_by(|a, b| beside(a).total_cmp(&beside(b))) else {
            continue;
        };
        if beside(&far) > UNSEEN {
            kept[far] = true;
            open.extend([(from, far), (far, to)]);
        }
    }
    points
        .iter()
        .zip(kept)
        .filter(|(_, kept)| *kept)
        .map(|(point, _)| *point)
        .collect()
}

/// Of a point from the segment between two others.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let square = dx * dx + dy * dy;
    let along = ((point.0 - from.0) * dx + (point.1 - from.1) * dy) / square.max(f64::MIN_POSITIVE);
    let t = along.clamp(0.0, 1.0);
    libm::hypot(point.0 - from.0 - t * dx, point.1 - from.1 - t * dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FRAME: Frame = Frame {
        left: 0.0,
        right: 100.0,
        top: 0.0,
        bottom: 50.0,
    };

    #[test]
    fn a_line_that_leaves_and_comes_back_is_two_pieces_that_end_on_the_frame() {
        let pieces = FRAME.pieces(&[(10.0, 25.0), (10.0, -25.0), (20.0, -25.0), (20.0, 25.0)]);
        assert_eq!(
            pieces,
            [
                vec![(10.0, 25.0), (10.0, 0.0)],
                vec![(20.0, 0.0), (20.0, 25.0)]
            ]
        );
        assert!(FRAME.pieces(&[(-5.0, 10.0), (-5.0, 20.0)]).is_empty());
        assert!(FRAME.pieces(&[(f64::NAN, 10.0), (5.0, 20.0)]).is_empty());
    }

    proptest! {
        #[test]
        fn what_is_drawn_is_inside_and_no_point_inside_is_missed_by_a_pixel(
            points in prop::collection::vec((-50.0..150.0f64, -50.0..100.0f64), 2..40),
        ) {
            let pieces = FRAME.pieces(&points);
            prop_assert!(pieces.concat().iter().all(|point| FRAME.holds(*point)));
            let inside = |&&(x, y): &&(f64, f64)| (0.0..=100.0).contains(&x) && (0.0..=50.0).contains(&y);
            for point in points.iter().filter(inside) {
                let near = |piece: &Vec<(f64, f64)>| piece.windows(2).any(|p| distance(*point, p[0], p[1]) < 1.0);
                prop_assert!(pieces.iter().any(near), "{point:?}");
            }
        }
    }
}
