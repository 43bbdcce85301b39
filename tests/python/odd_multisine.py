#!/usr/bin/env python3
"""A record of a stage with a cubic spring, driven by an odd multisine through a distorting amplifier; without any line of bench.

    odd_multisine.py FILE    writes time_s, current_a (measured), position_m: 12 periods of 1 s at 2 kHz, of lines 4 Hz apart; prints the
                             power of the odd and even distortion of the stage over that of its output, and then rows with frequency (Hz)
                             and residue of each mode

The equations of the modes are integrated with 8 steps of the exact transition of a linear stage in each sample; the force of the spring
is held over a step. The distortion of the stage is the steady response with the spring minus that to the same current without it.
"""

import sys

import numpy as np
import scipy.linalg as la

RATE, PERIOD, PERIODS, STEPS = 2000, 2000, 12, 8
MODES = np.array([[30.0, 0.01, 1.0], [83.0, 0.01, 0.6], [141.0, 0.01, 0.4]])  # Hz, damping ratio, residue
SPRING = 1e12  # N/m^3
LINES = np.arange(5, 250, 4)
NOISE_M, NOISE_A = 30e-9, 1e-5


def transition(hz, zeta):
    """State transition and input column over a step of a held force."""
    w = 2 * np.pi * hz
    whole = np.zeros((3, 3))
    whole[0, 1], whole[1] = 1.0, [-w * w, -2 * zeta * w, 1.0]
    whole = la.expm(whole / (RATE * STEPS))
    return whole[:2, :2], whole[:2, 2]


def simulate(current, spring):
    parts = [transition(hz, zeta) for hz, zeta, _ in MODES]
    a, b = np.stack([p[0] for p in parts]), np.stack([p[1] for p in parts])
    r = MODES[:, 2]
    x, y = np.zeros((len(MODES), 2)), np.zeros(len(current))
    for n, i in enumerate(current):
        y[n] = r @ x[:, 0]
        for _ in range(STEPS):
            force = i - spring * (r @ x[:, 0]) ** 3
            x = np.einsum("kij,kj->ki", a, x) + b * force
    return y


def spectrum(y):
    return np.fft.rfft(y[-PERIOD:])


rng = np.random.default_rng(4)
t = np.arange(PERIOD) / RATE
phase = rng.uniform(0, 2 * np.pi, len(LINES))
command = np.sum(np.cos(2 * np.pi * LINES[:, None] * t + phase[:, None]), axis=0)
command *= 0.5 / np.max(np.abs(command))
current = np.tile(command + 0.05 * command**2 + 0.2 * command**3, PERIODS)
position = simulate(current, SPRING)
stage = spectrum(position) - spectrum(simulate(current, 0.0))
inside = np.arange(LINES[0] + 1, LINES[-1])
odd = inside[(inside % 2 == 1) & (inside % 4 != 1)]
even = inside[inside % 2 == 0]
output = np.sum(np.abs(spectrum(position)[LINES]) ** 2)
# Each excited line has the mean distortion of the lines between them.
ratios = [np.mean(np.abs(stage[k]) ** 2) * len(LINES) / output for k in (odd, even)]
print(*(repr(float(ratio)) for ratio in ratios))
for hz, _, residue in MODES:
    print(hz, residue)
table = np.column_stack(
    [
        np.arange(len(current)) / RATE,
        current + NOISE_A * rng.standard_normal(len(current)),
        position + NOISE_M * rng.standard_normal(len(current)),
    ]
)
np.savetxt(sys.argv[1], table, delimiter=",", header="time_s,current_a,position_m", comments="", fmt="%.9g")
