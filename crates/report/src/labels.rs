//! Frequencies written at some points of a curve in the complex plane.

use nalgebra::Complex;

use super::number::significant;

/// A point of a response: frequency in hertz and value.
pub(super) type ResponsePoint = (f64, Complex<f64>);

/// Of some points the first ones, at most `count`, that are further than `distance` from each other.
pub(super) fn spread(
    points: impl IntoIterator<Item = ResponsePoint>,
    distance: f64,
    count: usize,
) -> Vec<ResponsePoint> {
    let mut spread: Vec<ResponsePoint> = Vec::new();
    for (frequency_hz, h) in points {
        let is_free = spread
            .iter()
            .all(|(_, other)| (h - other).norm() > distance);
        if spread.len() < count && is_free {
            spread.push((frequency_hz, h));
        }
    }
    spread
}

/// A frequency with four digits.
pub(super) fn frequency_text(frequency_hz: f64) -> String {
    format!("{} Hz", significant(frequency_hz, 4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_a_frequency_with_four_digits() {
        for (frequency_hz, text) in [
            (0.5, "0.5000 Hz"),
            (8.0, "8.000 Hz"),
            (29.314, "29.31 Hz"),
            (500.0, "500.0 Hz"),
            (12_345.6, "12346 Hz"),
        ] {
            assert_eq!(frequency_text(frequency_hz), text);
        }
    }

    #[test]
    fn labels_are_apart() {
        let points = (0..100).map(|k| (f64::from(k), Complex::from(f64::from(k))));
        let found: Vec<f64> = spread(points, 9.5, 4).iter().map(|(f, _)| *f).collect();
        assert_eq!(found, [0.0, 10.0, 20.0, 30.0]);
    }
}
