//! Numbers as they are stored.

use num_complex::Complex;

use crate::bytes::ByteOrder;

/// Format of stored real numbers, which determines their rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 64 bits, 53 of them significant.
    Double,
    /// 32 bits, 24 of them significant.
    Single,
    /// 16 bits, 11 of them significant.
    Half,
}

impl Precision {
    fn significant_bits(self) -> i32 {
        match self {
            Precision::Double => 53,
            Precision::Single => 24,
            Precision::Half => 11,
        }
    }

    /// The distance between neighbouring numbers of this format at `x`: 2^(e - p + 1), where 2^e <= |x| < 2^(e+1) and p is the number of
    /// significant bits. A number is rounded by at most half of it.
    ///
    /// ```
    /// use bench_arrays::Precision;
    /// assert_eq!(Precision::Single.spacing(1.5), f64::from(f32::EPSILON));
    /// assert_eq!(Precision::Double.spacing(-1e3), 512.0 * f64::EPSILON);
    /// ```
    pub fn spacing(self, x: f64) -> f64 {
        if x == 0.0 || !x.is_finite() {
            return 0.0;
        }
        let exponent = (x.to_bits() >> 52 & 0x7ff) as i32 - 1023;
        2_f64.powi(exponent + 1 - self.significant_bits())
    }
}

/// Numbers of one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Real numbers, and the format in which they were stored.
    Real(Vec<f64>, Precision),
    /// Integers, exact.
    Integer(Vec<i64>),
    /// Complex numbers.
    Complex(Vec<Complex<f64>>),
}

impl Numbers {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Numbers::Real(values, _) => values.len(),
            Numbers::Integer(values) => values.len(),
            Numbers::Complex(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// As real numbers; `None` for complex ones.
    pub fn to_real(&self) -> Option<Vec<f64>> {
        match self {
            Numbers::Real(values, _) => Some(values.clone()),
            Numbers::Integer(values) => Some(values.iter().map(|x| *x as f64).collect()),
            Numbers::Complex(_) => None,
        }
    }

    /// As complex numbers.
    pub fn to_complex(&self) -> Vec<Complex<f64>> {
        match self {
            Numbers::Real(values, _) => values.iter().map(|x| Complex::from(*x)).collect(),
            Numbers::Integer(values) => values.iter().map(|x| Complex::from(*x as f64)).collect(),
            Numbers::Complex(values) => values.clone(),
        }
    }

    /// Those of some places; places beyond the end are left out.
    pub(crate) fn at(&self, places: impl Iterator<Item = usize>) -> Numbers {
        match self {
            Numbers::Real(values, precision) => Numbers::Real(picked(values, places), *precision),
            Numbers::Integer(values) => Numbers::Integer(picked(values, places)),
            Numbers::Complex(values) => Numbers::Complex(picked(values, places)),
        }
    }
}

fn picked<T: Copy>(values: &[T], places: impl Iterator<Item = usize>) -> Vec<T> {
    places
        .filter_map(|place| values.get(place).copied())
        .collect()
}

/// What a stored number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    Signed,
    Unsigned,
    Float,
    /// Two floats: real and imaginary part.
    Complex,
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stored {
    pub class: Class,
    /// Bytes: 1, 2, 4 or 8; of a complex number twice 4 or 8.
    pub size: usize,
}

impl Stored {
    pub const fn new(class: Class, size: usize) -> Stored {
        Stored { class, size }
    }

    /// Bytes that it takes in memory.
    pub fn memory_bytes(self) -> u64 {
        match self.class {
            Class::Complex => 16,
            _ => 8,
        }
    }

    /// Numbers that are stored in these items, each of its size.
    pub fn numbers<'a>(
        self,
        order: ByteOrder,
        items: impl Iterator<Item = &'a [u8]> + Clone,
    ) -> Numbers {
        match self.class {
            Class::Complex => {
                Numbers::Complex(items.map(|item| self.complex(order, item)).collect())
            }
            Class::Signed | Class::Unsigned => self.integers(order, items),
            Class::Float => self.reals(order, items, self.precision()),
        }
    }

    /// Real numbers of a format that may be stored in another one.
    pub fn reals<'a>(
        self,
        order: ByteOrder,
        items: impl Iterator<Item = &'a [u8]>,
        precision: Precision,
    ) -> Numbers {
        let values = items.map(|item| self.real(order, item));
        Numbers::Real(values.collect(), precision)
    }

    /// Integers; beyond 2^63 they are real numbers.
    fn integers<'a>(
        self,
        order: ByteOrder,
        items: impl Iterator<Item = &'a [u8]> + Clone,
    ) -> Numbers {
        let integers = items.clone().map(|item| self.integer(order, item));
        match integers.collect() {
            Some(integers) => Numbers::Integer(integers),
            None => self.reals(order, items, Precision::Double),
        }
    }

    fn precision(self) -> Precision {
        match self.size {
            2 => Precision::Half,
            4 => Precision::Single,
            _ => Precision::Double,
        }
    }

    fn integer(self, order: ByteOrder, item: &[u8]) -> Option<i64> {
        let bits = order.bits(item);
        match self.class {
            // Moved to the top and back, so that the sign is that of the highest bit.
            Class::Signed => {
                let unused = 64 - 8 * self.size as u32;
                Some((bits << unused) as i64 >> unused)
            }
            _ => i64::try_from(bits).ok(),
        }
    }

    fn real(self, order: ByteOrder, item: &[u8]) -> f64 {
        let bits = order.bits(item);
        match (self.class, self.size) {
            (Class::Signed, _) => self.integer(order, item).unwrap_or_default() as f64,
            (Class::Unsigned, _) => bits as f64,
            (_, 2) => half(bits as u16),
            (_, 4) => f64::from(f32::from_bits(bits as u32)),
            _ => f64::from_bits(bits),
        }
    }

    fn complex(self, order: ByteOrder, item: &[u8]) -> Complex<f64> {
        let half = Stored::new(Class::Float, self.size / 2);
        let (re, im) = item.split_at(half.size.min(item.len()));
        Complex::new(half.real(order, re), half.real(order, im))
    }
}

/// A number of 16 bits: sign, 5 bits of exponent, 10 of fraction.
fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (
        i32::from(bits >> 10 & 0x1f),
        f64::from(bits & 0x3ff) / 1024.0,
    );
    sign * match exponent {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2_f64.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_of_every_size_and_byte_order_are_exact() {
        let of = |class, order, bytes: &[u8]| {
            Stored::new(class, bytes.len()).numbers(order, bytes.chunks_exact(bytes.len()))
        };
        for (found, expected) in [
            (
                of(Class::Signed, ByteOrder::Little, &(-2_i8).to_le_bytes()),
                -2,
            ),
            (
                of(Class::Signed, ByteOrder::Big, &(-300_i16).to_be_bytes()),
                -300,
            ),
            (
                of(Class::Unsigned, ByteOrder::Big, &60_000_u16.to_be_bytes()),
                60_000,
            ),
            (
                of(Class::Signed, ByteOrder::Little, &i64::MIN.to_le_bytes()),
                i64::MIN,
            ),
            (
                of(
                    Class::Unsigned,
                    ByteOrder::Little,
                    &(1_u64 << 53).to_le_bytes(),
                ),
                1 << 53,
            ),
        ] {
            assert_eq!(found, Numbers::Integer(vec![expected]));
        }
        let large = of(
            Class::Unsigned,
            ByteOrder::Little,
            &(1_u64 << 63).to_le_bytes(),
        );
        assert_eq!(
            large,
            Numbers::Real(vec![2_f64.powi(63)], Precision::Double)
        );
    }

    #[test]
    fn halves_are_those_of_the_standard() {
        for (bits, x) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_953_125),
            (0x0001, 2_f64.powi(-24)),
            (0x7bff, 65504.0),
            (0x7c00, f64::INFINITY),
        ] {
            assert_eq!(half(bits), x);
        }
        assert!(half(0x7e00).is_nan());
    }
}
