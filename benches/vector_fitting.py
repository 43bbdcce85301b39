"""Vector fitting of one response: poles by iterated linear least squares, in its relaxed form.

    sigma(s) H(s) = sum c_k/(s - a_k) + d,    sigma(s) = sum c'_k/(s - a_k) + d'

is linear in c, d, c' and d'. The zeros of sigma are better poles than the a_k, and replace them. Sources: Gustavsen and Semlyen,
"Rational approximation of frequency domain responses by vector fitting", IEEE Transactions on Power Delivery 14 (1999), 1052-1061;
Gustavsen, "Improving the pole relocating properties of vector fitting", the same 21 (2006), 1587-1592.
"""

import numpy as np
import scipy.linalg as la

ITERATIONS = 20
START_DAMPING = 0.01


def poles(f_hz, response, count, weight):
    """Up to `count` poles with positive imaginary part, in rad/s; unstable ones are mirrored, real ones are left out."""
    scale = 2 * np.pi * np.max(f_hz)
    s = 2j * np.pi * f_hz / scale
    imag = np.linspace(np.min(s.imag), np.max(s.imag), count + 2)[1:-1]
    at = imag * (1j - START_DAMPING)
    for _ in range(ITERATIONS):
        at = relocated(s, response, at, weight)
    return at * scale


def basis(s, at):
    """Columns of real and imaginary parts of the residues of conjugate pairs of poles."""
    upper, lower = 1 / (s[:, None] - at), 1 / (s[:, None] - at.conj())
    return np.hstack([upper + lower, 1j * (upper - lower)])


def relocated(s, response, at, weight):
    """The zeros of sigma."""
    count = 2 * len(at)
    of_sigma = np.column_stack([basis(s, at), np.ones(len(s))])
    rows = weight[:, None] * np.hstack([of_sigma, -response[:, None] * of_sigma])
    # Of all multiples of sigma the one whose real parts have the mean 1.
    mean = np.concatenate([np.zeros(count + 1), np.mean(of_sigma.real, axis=0)]) * la.norm(weight * response)
    matrix = np.vstack([rows.real, rows.imag, mean])
    right = np.zeros(len(matrix))
    right[-1] = la.norm(weight * response)
    size = la.norm(matrix, axis=0)
    solution = la.lstsq(matrix / size, right)[0] / size
    real, imag, constant = np.split(solution[count + 1 :], [len(at), count])
    a, b, c = np.zeros((count, count)), np.zeros(count), np.zeros(count)
    for k, pole in enumerate(at):
        a[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        b[2 * k], c[2 * k], c[2 * k + 1] = 2, real[k], imag[k]
    zeros = la.eigvals(a - np.outer(b, c) / constant)
    upper = zeros[zeros.imag > 0]
    return -abs(upper.real) + 1j * upper.imag


def real_residues(f_hz, response, at, weight):
    """Residues r of modes r/((s - a)(s - a*)) and a constant, by least squares."""
    s = 2j * np.pi * f_hz
    modes = 1 / ((s[:, None] - at) * (s[:, None] - at.conj()))
    rows = weight[:, None] * np.column_stack([modes, np.full(len(s), np.mean(abs(modes)))])
    matrix, right = np.vstack([rows.real, rows.imag]), np.concatenate([(weight * response).real, (weight * response).imag])
    size = la.norm(matrix, axis=0)
    return (la.lstsq(matrix / size, right)[0] / size)[: len(at)]
