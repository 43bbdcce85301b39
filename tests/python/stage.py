"""The stage of the thesis (SR4DoF at 8 % of L, 10 % of asymmetry) from its masses and beams, for comparison.

    stage.py modes                    prints omega (rad/s), residue (1/kg) and damping ratio of each mode, slowest first
    stage.py response < FREQUENCIES   prints real and imaginary part (m/A) of the plant sampled at 5 kHz, at each frequency (Hz)

Equation (2-5) with the dimensions of the stage that was built; Rayleigh damping through 0.009 at 179 rad/s and 0.004 at
520 rad/s; after these the unmodelled modes of table 5-1. Current loop 1 kHz, first order; zero-order hold of the whole chain
as one matrix exponential; one tick of delay.
"""

import sys

import numpy as np
import scipy.linalg as sl

PERIOD = 2e-4
FORCE_CONSTANT = 11.12
AMPLIFIER = 2 * np.pi * 1000
UNMODELLED = np.array([235.1, 237.8, 272.8, 281.4, 282.0, 283.6]) * 2 * np.pi
UNMODELLED_RESIDUES = np.array([0.018, -0.025, 0.041, -0.017, 0.035, -0.04])


def stage(asymmetry, operating_point):
    length, thickness, height = 47.5e-3, 0.625e-3, 25.4e-3
    m1, m3, m4, m5 = 0.4, 0.06, 0.8, 0.8
    k4 = k5 = 36e3
    young, poisson = 6.9e10, 0.33
    k = 24 * young * height * thickness**3 / 12 / (length**3 * (1 - poisson**2))
    m2, a = m3 * (1 + asymmetry), 0.6 * operating_point
    mass = np.array([
        [m1 + m2 + m3 + m4 + m5, a * (m2 + m4 - m3 - m5), -a * (m2 + 2 * m4), a * (m3 + 2 * m5)],
        [a * (m2 + m4 - m3 - m5), m1 + a * a * (m2 + m3 + m4 + m5), -a * a * (m2 + 2 * m4), -a * a * (m3 + 2 * m5)],
        [-a * (m2 + 2 * m4), -a * a * (m2 + 2 * m4), m2 + a * a * m2 + 4 * a * a * m4, 0],
        [a * (m3 + 2 * m5), -a * a * (m3 + 2 * m5), 0, m3 + a * a * m3 + 4 * a * a * m5],
    ])
    stiffness = np.array([
        [k4 + k5, a * (k4 - k5), -2 * a * k4, 2 * a * k5],
        [a * (k4 - k5), 2 * k + a * a * (k4 + k5), -2 * a * a * k4 - k, -2 * a * a * k5 - k],
        [-2 * a * k4, -2 * a * a * k4 - k, 4 * a * a * k4 + 2 * k, 0],
        [2 * a * k5, -2 * a * a * k5 - k, 0, 4 * a * a * k5 + 2 * k],
    ])
    return mass, stiffness, np.array([1, a, -2 * a, 0])


def modes():
    mass, stiffness, force = stage(0.10, 0.08)
    squares, shapes = sl.eigh(stiffness, mass)
    omega = np.sqrt(squares)
    alpha, beta = np.linalg.solve(np.array([[1 / 179, 179], [1 / 520, 520]]) / 2, [0.009, 0.004])
    residue = shapes[0] * (shapes.T @ force)
    damping = alpha / 2 / omega + beta * omega / 2
    return np.c_[
        np.r_[omega, UNMODELLED],
        np.r_[residue, UNMODELLED_RESIDUES],
        np.r_[damping, np.full(6, 0.005)],
    ]


def response(frequency_hz):
    table = modes()
    size = 2 * len(table) + 1
    a, b, c = np.zeros((size, size)), np.zeros((size, 1)), np.zeros(size)
    a[0, 0], b[0] = -AMPLIFIER, AMPLIFIER
    for i, (omega, residue, damping) in enumerate(table):
        x, v = 1 + 2 * i, 2 + 2 * i
        a[x, v], a[v, x], a[v, v], a[v, 0] = 1, -omega**2, -2 * damping * omega, FORCE_CONSTANT
        c[x] = residue
    step = sl.expm(np.block([[a, b], [np.zeros((1, size + 1))]]) * PERIOD)
    f, g = step[:-1, :-1], step[:-1, -1]
    z = np.exp(2j * np.pi * frequency_hz * PERIOD)
    return np.array([c @ np.linalg.solve(x * np.eye(size) - f, g) / x for x in z])


if __name__ == "__main__":
    if sys.argv[1] == "modes":
        rows = modes()
    else:
        h = response(np.array(sys.stdin.read().split(), float))
        rows = np.c_[h.real, h.imag]
    for row in rows:
        print(*map(repr, map(float, row)))
