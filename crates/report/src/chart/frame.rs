//! The frame of a chart: lines are clipped at it and simplified.

use super::Points;
use super::series::thinned;

/// A rectangle in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

/// Distance in pixels by which a simplified line may miss a point.
const MAX_LINE_ERROR: f64 = 0.15;
/// Half a rounding of the page, so that a point on the frame counts as inside.
const HALF_ROUNDING: f64 = 0.06;

impl Frame {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn contains(&self, (x, y): (f64, f64)) -> bool {
        (self.left - HALF_ROUNDING..=self.right + HALF_ROUNDING).contains(&x)
            && (self.top - HALF_ROUNDING..=self.bottom + HALF_ROUNDING).contains(&y)
    }

    /// The nearest point of the frame.
    pub fn nearest(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            x.clamp(self.left, self.right),
            y.clamp(self.top, self.bottom),
        )
    }

    /// The parts of a line inside the frame, simplified.
    pub fn clipped(&self, points: &[(f64, f64)]) -> Vec<Points> {
        let mut parts: Vec<Points> = Vec::new();
        let mut open = false;
        for pair in points.windows(2) {
            let Some((from, to)) = self.segment(pair[0], pair[1]) else {
                open = false;
                continue;
            };
            match parts.last_mut().filter(|_| open && from == pair[0]) {
                Some(part) => part.push(to),
                None => parts.push(vec![from, to]),
            }
            open = to == pair[1];
        }
        parts.iter().map(|part| reduced(part)).collect()
    }

    /// The part of a segment inside the frame (Liang and Barsky 1984); `None` outside, and for ends that are not finite.
    fn segment(&self, from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        if !(dx.is_finite() && dy.is_finite()) {
            return None;
        }
        let sides = [
            (-dx, from.0 - self.left),
            (dx, self.right - from.0),
            (-dy, from.1 - self.top),
            (dy, self.bottom - from.1),
        ];
        let (enters, leaves) = inside(sides)?;
        // The sum is rounded if an end is far away: the nearest point of the frame corrects it.
        let at = |t: f64| self.nearest((from.0 + t * dx, from.1 + t * dy));
        let start = if enters > 0.0 { at(enters) } else { from };
        let end = if leaves < 1.0 { at(leaves) } else { to };
        Some((start, end))
    }
}

/// Parameters at which a segment enters and leaves; each side has the speed towards it and the distance from it.
fn inside(sides: [(f64, f64); 4]) -> Option<(f64, f64)> {
    let (mut enters, mut leaves) = (0.0, 1.0);
    for (speed, distance) in sides {
        if speed < 0.0 {
            enters = f64::max(enters, distance / speed);
        } else if speed > 0.0 {
            leaves = f64::min(leaves, distance / speed);
        } else if distance < 0.0 {
            return None;
        }
    }
    (enters <= leaves).then_some((enters, leaves))
}

/// A line with fewer points that looks the same.
fn reduced(points: &[(f64, f64)]) -> Points {
    let rising = points.windows(2).all(|pair| pair[1].0 >= pair[0].0);
    let width = points[points.len() - 1].0 - points[0].0;
    let dense = points.len() as f64 > 3.0 * width.max(1.0);
    if rising && dense {
        thinned(points)
    } else {
        simplified(points)
    }
}

/// Douglas and Peucker 1973, without recursion.
fn simplified(points: &[(f64, f64)]) -> Points {
    let last = points.len() - 1;
    let mut kept = vec![0, last];
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        if let Some(far) = farthest(points, from, to) {
            kept.push(far);
            open.extend([(from, far), (far, to)]);
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|k| points[k]).collect()
}

/// The point between two others that is farthest from their segment, if the distance is visible.
fn farthest(points: &[(f64, f64)], from: usize, to: usize) -> Option<usize> {
    let distances = (from + 1..to).map(|k| (k, distance(points[k], points[from], points[to])));
    let far = distances.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (far.1 > MAX_LINE_ERROR).then_some(far.0)
}

/// Distance of a point from the segment between two others.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (px, py) = (point.0 - from.0, point.1 - from.1);
    let square = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
    let t = ((px * dx + py * dy) / square).clamp(0.0, 1.0);
    libm::hypot(px - t * dx, py - t * dy)
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
    fn clips_a_line_that_leaves_and_returns_into_two_parts() {
        let parts = FRAME.clipped(&[(10.0, 25.0), (10.0, -25.0), (20.0, -25.0), (20.0, 25.0)]);
        let expected = [
            vec![(10.0, 25.0), (10.0, 0.0)],
            vec![(20.0, 0.0), (20.0, 25.0)],
        ];
        assert_eq!(parts, expected);
        assert!(FRAME.clipped(&[(-5.0, 10.0), (-5.0, 20.0)]).is_empty());
        assert!(FRAME.clipped(&[(f64::NAN, 10.0), (5.0, 20.0)]).is_empty());
    }

    proptest! {
        #[test]
        fn clips_to_the_frame_and_keeps_inner_points_within_a_pixel(
            points in prop::collection::vec((-50.0..150.0f64, -50.0..100.0f64), 2..40),
        ) {
            let parts = FRAME.clipped(&points);
            prop_assert!(parts.concat().iter().all(|point| FRAME.contains(*point)));
            let inside = |&&(x, y): &&(f64, f64)| (0.0..=100.0).contains(&x) && (0.0..=50.0).contains(&y);
            for point in points.iter().filter(inside) {
                let near = |part: &Points| part.windows(2).any(|p| distance(*point, p[0], p[1]) < 1.0);
                prop_assert!(parts.iter().any(near), "{point:?}");
            }
        }
    }
}
