//! A Fourier transform that gives the same bits on every machine: a replay must generate the same multisine.
//!
//! The transforms of the crates choose their kernel by the processor and take their twiddle factors from the platform's libm.
//! This one does neither; it is executed a few times before a run.
//!
//! ```text
//! X_k = sum_n x_n exp(2 pi i k n / N)        N a power of two: Cooley, Tukey
//! k n = (k^2 + n^2 - (k - n)^2)/2            any other N: a convolution (Bluestein)
//! ```

use std::f64::consts::PI;

use nalgebra::Complex;

/// X_k = sum over n of `x[n]` exp(2 pi i k n / N), in place. N is the length, a power of two or 0.
pub fn transform(x: &mut [Complex<f64>]) {
    let n = x.len();
    if n < 2 || !n.is_power_of_two() {
        return;
    }
    let turns: Vec<Complex<f64>> = (0..n / 2)
        .map(|k| turn(2.0 * PI * k as f64 / n as f64))
        .collect();
    reverse_bits(x);
    let mut half = 1;
    while half < n {
        let stride = n / (2 * half);
        for pair in x.chunks_exact_mut(2 * half) {
            let (low, high) = pair.split_at_mut(half);
            for (k, (a, b)) in low.iter_mut().zip(high).enumerate() {
                let turned = *b * turns[k * stride];
                (*a, *b) = (*a + turned, *a - turned);
            }
        }
        half *= 2;
    }
}

/// Moves each element to the place whose index has the bits of its own index in reverse order.
fn reverse_bits(x: &mut [Complex<f64>]) {
    let shift = usize::BITS - x.len().trailing_zeros();
    for k in 0..x.len() {
        let other = k.reverse_bits() >> shift;
        if other > k {
            x.swap(k, other);
        }
    }
}

/// The samples of sum over k of Re(`lines[k]` exp(2 pi i k n / N)) for n = 0 .. N, any N.
pub(super) fn samples(lines: &[Complex<f64>], n: usize) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    let length = (n + lines.len()).next_power_of_two();
    let mut a = vec![Complex::new(0.0, 0.0); length];
    let mut b = a.clone();
    for (k, line) in lines.iter().enumerate() {
        a[k] = line * chirp(k, n);
    }
    for (k, b) in b.iter_mut().enumerate().take(n) {
        *b = chirp(k, n).conj();
    }
    for k in 1..lines.len() {
        b[length - k] = chirp(k, n).conj();
    }
    let product = convolution(a, b);
    (0..n)
        .map(|k| (product[k].conj() * chirp(k, n)).re / length as f64)
        .collect()
}

/// exp(i pi k^2/N); k^2 modulo 2 N, exactly.
fn chirp(k: usize, n: usize) -> Complex<f64> {
    turn(PI * ((k as u128 * k as u128) % (2 * n as u128)) as f64 / n as f64)
}

/// The conjugate of the cyclic convolution of two sequences, times their length: the inverse of a transform is the conjugate of
/// the transform of the conjugate, over the length.
fn convolution(mut a: Vec<Complex<f64>>, mut b: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    transform(&mut a);
    transform(&mut b);
    for (a, b) in a.iter_mut().zip(&b) {
        *a = (*a * b).conj();
    }
    transform(&mut a);
    a
}

/// exp(i angle).
pub(super) fn turn(angle: f64) -> Complex<f64> {
    let (sine, cosine) = libm::sincos(angle);
    Complex::new(cosine, sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(count: usize) -> Vec<Complex<f64>> {
        (0..count)
            .map(|k| turn(k as f64 * k as f64) * (1.0 + k as f64 % 3.0))
            .collect()
    }

    #[test]
    fn samples_are_the_sum_of_the_lines_for_any_length() {
        for (count, n) in [(1, 1), (3, 7), (12, 25), (40, 100), (30, 64), (50, 127)] {
            let lines = lines(count);
            for (at, sample) in samples(&lines, n).into_iter().enumerate() {
                let term = |(k, line): (usize, &Complex<f64>)| {
                    (line * turn(2.0 * PI * ((k * at) % n) as f64 / n as f64)).re
                };
                let sum: f64 = lines.iter().enumerate().map(term).sum();
                // Three transforms of up to 256 numbers: some 10 roundings of a sum of up to 150.
                assert!(
                    (sample - sum).abs() < 150.0 * 1e-14,
                    "{count} lines, sample {at} of {n}: {sample} for {sum}"
                );
            }
        }
    }

    #[test]
    fn transform_preserves_the_power() {
        let mut x = lines(64);
        let power = |x: &[Complex<f64>]| x.iter().map(|x| x.norm_sqr()).sum::<f64>();
        let before = power(&x);
        transform(&mut x);
        assert!((power(&x) / (64.0 * before) - 1.0).abs() < 1e-13);
        transform(&mut []);
        assert!(samples(&[], 3).iter().all(|x| *x == 0.0) && samples(&lines(2), 0).is_empty());
    }
}
