"""Figures of a controller file with the stage of the thesis, recomputed with numpy and scipy.

    tune.py CONTROLLER RATE_HZ        prints, for each plant of the list below, modulus margin, slope bandwidth and sensitivity
                                      bandwidth (rad/s), |S| at 10 rad/s, and the largest magnitude of a closed-loop pole

Plants: 10 % of asymmetry, operating points and variations as in PLANTS; the modes of table 5-1 are bounded by the sum of their
magnitudes, each within 3 % of its frequency, with any phase. Zero-order hold and amplifier as one matrix exponential, one period of
delay, the sections by Tustin's rule.
"""

import sys
import tomllib

import numpy as np
import scipy.linalg as sl
import scipy.signal as ss

from stage import AMPLIFIER, FORCE_CONSTANT, UNMODELLED, UNMODELLED_RESIDUES, stage

# Operating point, factor of the first mode's frequency, of the others, of the damping ratios.
PLANTS = [
    (0.00, 1, 1, 1), (0.07, 1, 1, 1), (0.08, 1, 1, 1),
    (0.04, 1, 0.99, 1), (0.04, 1, 1.01, 1), (0.06, 1, 0.99, 1), (0.06, 1, 1.01, 1), (0.08, 1, 0.99, 1), (0.08, 1, 1.01, 1),
    (0.08, 1, 1, 0.7), (0.08, 0.99, 1, 1), (0.08, 1.01, 1, 1), (0.02, 1, 1, 1), (0.04, 1, 1, 1), (0.06, 1, 1, 1),
]


def modes(point, first, others, damping):
    mass, stiffness, force = stage(0.10, point)
    squares, shapes = sl.eigh(stiffness, mass)
    omega = np.sqrt(squares)
    alpha, beta = np.linalg.solve(np.array([[1 / 179, 179], [1 / 520, 520]]) / 2, [0.009, 0.004])
    zeta = (alpha / 2 / omega + beta * omega / 2) * damping
    residue = shapes[0] * (shapes.T @ force)
    seen = np.abs(residue) > 1e-4 * np.abs(residue).max()
    omega, zeta, residue = omega[seen], zeta[seen], residue[seen]
    factors = np.where(np.arange(omega.size) == 0, first, others)
    return omega * factors, zeta, residue


def sampled(omega, zeta, residue, period):
    """Discrete state space from command to reading: amplifier, modes, hold, one period of delay."""
    n = 2 * omega.size
    a = np.zeros((n + 1, n + 1))
    b = np.zeros((n + 1, 1))
    c = np.zeros((1, n + 1))
    a[0, 0], b[0, 0] = -AMPLIFIER, AMPLIFIER
    for k in range(omega.size):
        i = 1 + 2 * k
        a[i, i + 1] = 1
        a[i + 1, i], a[i + 1, i + 1] = -omega[k] ** 2, -2 * zeta[k] * omega[k]
        a[i + 1, 0] = FORCE_CONSTANT * residue[k]
        c[0, i] = 1
    both = sl.expm(np.block([[a, b], [np.zeros((1, n + 2))]]) * period)
    a, b = both[:-1, :-1], both[:-1, -1:]
    # x+ = A x + B u(k - 1)
    a = np.block([[a, b], [np.zeros((1, n + 2))]])
    b = np.vstack([np.zeros((n + 1, 1)), [[1]]])
    return a, b, np.hstack([c, [[0]]])


def polynomials(section):
    kind = section["kind"]
    pair = lambda w, zeta: [1, 2 * zeta * w, w * w]
    if kind == "integrator":
        return [section["gain_a_per_um"]], [1, 0]
    if kind == "zero_pole":
        return [1, section["zero_rad_s"]], [1, section["pole_rad_s"]]
    if kind == "pole":
        return [1], [1, section["pole_rad_s"]]
    if kind == "biquad":
        return (
            pair(section["zeros_rad_s"], section["zeros_damping_ratio"]),
            pair(section["poles_rad_s"], section["poles_damping_ratio"]),
        )
    raise ValueError(kind)


def controller(path, rate):
    with open(path, "rb") as file:
        sections = tomllib.load(file)["section"]
    return [ss.bilinear(*polynomials(section), fs=rate) for section in sections]


def response(system, z):
    """C (z - A)^-1 B by the eigenvalues of A, which are distinct, except for the delay, a factor 1/z."""
    a, b, c = system
    inner, column, row = a[:-1, :-1], a[:-1, -1:], c[:, :-1]
    values, vectors = np.linalg.eig(inner)
    left = (row @ vectors).ravel() * np.linalg.solve(vectors, column).ravel()
    return (left[None, :] / (z[:, None] - values[None, :])).sum(axis=1) / z


def pole_radius(plant, sections):
    """Largest magnitude of the poles of the loop u = -C y."""
    a, b, c = plant
    for number, section in enumerate(sections):
        ca, cb, cc, cd = ss.tf2ss(*section)
        gain = 1e6 if number == 0 else 1.0
        # The controller's section drives what follows: x = [section, rest].
        n, m = ca.shape[0], a.shape[0]
        a = np.block([[ca, np.zeros((n, m))], [b @ cc * gain, a]])
        b = np.vstack([cb, b * cd * gain])
        c = np.hstack([np.zeros((1, n)), c])
    return np.abs(np.linalg.eigvals(a - b @ c)).max()


def bound(w, period):
    z = np.exp(1j * w * period)
    total = np.zeros(w.size)
    for omega, residue in zip(UNMODELLED, UNMODELLED_RESIDUES):
        shifted = [
            np.abs(response(sampled(np.array([omega * f]), np.array([0.005]), np.array([residue]), period), z))
            for f in np.linspace(0.97, 1.03, 61)
        ]
        total += np.max(shifted, axis=0)
    return total


def figures(plant, sections, period):
    omega, zeta, residue = plant
    w = np.unique(np.concatenate(
        [np.geomspace(0.7, np.pi / period * 0.9999, 6000), [10.0]]
        + [x * (1 + y * np.sinh(np.linspace(-6, 6, 400))) for x, y in zip(omega, zeta)]
    ))
    w = w[(w > 0.7) & (w < np.pi / period)]
    z = np.exp(1j * w * period)
    system = sampled(omega, zeta, residue, period)
    c = 1e6 * np.prod([np.polyval(n, z) / np.polyval(d, z) for n, d in sections], axis=0)
    distance = np.abs(1 + response(system, z) * c) - np.abs(c) * bound(w, period)
    slope = w * distance / np.sqrt(2)
    reached = np.minimum.accumulate(slope)
    beyond = np.nonzero(reached < w)[0]
    above = np.nonzero(distance < np.sqrt(2))[0]
    return (
        distance.min(), reached[beyond[0] - 1], w[above[0]],
        1 / distance[w == 10.0][0], pole_radius(system, sections),
    )


def main():
    path, rate = sys.argv[1], float(sys.argv[2])
    sections = controller(path, rate)
    for plant in PLANTS:
        print(*figures(modes(*plant), sections, 1 / rate))


if __name__ == "__main__":
    main()
