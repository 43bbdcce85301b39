#!/usr/bin/env python3
"""Records of random stages with known zeros, without any line of bench.

    random_stages.py SEED COUNT FOLDER           writes FOLDER/stage-SEED-K.csv (time_s, command_a, position_m) for K = 0 .. COUNT - 1;
                                                 prints one JSON object a line: file, modes, zeros, excited band, noise, rate
    random_stages.py SEED COUNT FOLDER numbers   prints the zeros alone instead, re im re im ... in rad/s, one stage a line

A stage is G(s) = sum of r_k/(s^2 + 2 zeta_k w_k s + w_k^2). The command is held over a period, delayed by one, and passes a
current loop of first order with 1 kHz. Its response is computed exactly: every pole of G(s)/(1 + s/w_c) is a recursion of first
order. White noise and quantisation are added.

The zeros are the finite eigenvalues of the pencil [A - s I, b; c, 0] in modal coordinates, with time scaled: no polynomial.
"""

import json
import pathlib
import sys

import numpy as np
import scipy.linalg as la
from scipy.signal import lfilter

LOOP_RAD_S = 2 * np.pi * 1000
QUANTUM_M = 30e-9
FAMILIES = ["close_pair", "spread", "collocated", "real_zero"]


def zeros(modes, remainder=0.0):
    """The zeros in rad/s; modes are rows of (w, zeta, r)."""
    w, zeta, r = np.array(modes).T
    scale = np.exp(np.mean(np.log(w)))
    w, r = w / scale, r / np.max(np.abs(r))
    n = len(w)
    A, b, c = np.zeros((2 * n, 2 * n)), np.zeros(2 * n), np.zeros(2 * n)
    for k in range(n):
        A[2 * k, 2 * k + 1], A[2 * k + 1, 2 * k] = w[k], -w[k]
        A[2 * k + 1, 2 * k + 1] = -2 * zeta[k] * w[k]
        b[2 * k + 1] = np.sqrt(abs(r[k]) / w[k])
        c[2 * k] = np.sign(r[k]) * np.sqrt(abs(r[k]) / w[k])
    left = np.block([[A, b[:, None]], [c[None, :], np.array([[remainder]])]])
    right = np.zeros_like(left)
    right[: 2 * n, : 2 * n] = np.eye(2 * n)
    values = la.eigvals(left, right)
    values = values[np.isfinite(values)]
    return scale * values[np.abs(values) < 1e4]


def output(modes, command, rate):
    """The position at each tick for a command that is held and delayed by one period."""
    period = 1 / rate
    delayed = np.concatenate([[0.0], command[:-1]])
    loop = lambda s: LOOP_RAD_S / (s + LOOP_RAD_S)
    total = np.zeros(len(command))
    at_loop_pole = 0.0
    for w, zeta, r in modes:
        damped = w * np.sqrt(1 - zeta * zeta)
        pole = complex(-zeta * w, damped)
        residue = r / (2j * damped) * loop(pole)
        total += 2 * np.real(residue * state(pole, delayed, period))
        at_loop_pole += r / (LOOP_RAD_S**2 - 2 * zeta * w * LOOP_RAD_S + w * w)
    return total + LOOP_RAD_S * at_loop_pole * np.real(state(-LOOP_RAD_S, delayed, period))


def state(pole, held, period):
    """x of dx/dt = pole x + u for a held input, at each tick."""
    factor = np.exp(pole * period)
    gain = np.expm1(pole * period) / pole
    return lfilter([0.0, gain], [1.0, -factor], held.astype(complex))


def sweep(rate, seconds, low, high, amplitude):
    """A linear sweep with faded ends, at rest for 1 s before and 4 s after."""
    t = np.arange(int(seconds * rate)) / rate
    fade = min(1.0, 0.05 * seconds)
    window = np.clip(np.minimum(t, seconds - t) / fade, 0, 1)
    window = 0.5 - 0.5 * np.cos(np.pi * window)
    phase = 2 * np.pi * (low * t + (high - low) * t * t / (2 * seconds))
    return np.concatenate([np.zeros(int(rate)), amplitude * window * np.sin(phase), np.zeros(int(4 * rate))])


def separated(rng, count, low, high, ratio):
    while True:
        f = np.sort(np.exp(rng.uniform(np.log(low), np.log(high), count)))
        if np.all(f[1:] / f[:-1] > ratio):
            return f


def draw(rng, family):
    """Rows of (hertz, zeta, r over its largest magnitude)."""
    count = int(rng.integers(2, 7))
    if family == "close_pair":
        first, centre = rng.uniform(12, 40), rng.uniform(60, 150)
        gap = np.exp(rng.uniform(np.log(0.005), np.log(0.08)))
        more = centre * separated(rng, count - 3, 1.25, 1.7, 1.03) if count > 3 else []
        f = np.concatenate([[first, centre * (1 - gap / 2), centre * (1 + gap / 2)], more])
        pair = rng.uniform(0.15, 1.0, 2) * rng.choice([-1, 1], 2)
        r = np.concatenate([[1.0], pair, 0.3 * rng.uniform(0.1, 1, len(more)) * rng.choice([-1, 1], len(more))])
    elif family == "real_zero":
        f = separated(rng, 2, 15, 120, 1.3)
        r = np.array([1.0, -rng.uniform(1.1, (f[1] / f[0]) ** 2 * 0.9)])
    else:
        f = separated(rng, count, 15, 160, 1.06)
        r = rng.uniform(0.15, 1.0, count)
        r *= 1 if family == "collocated" else rng.choice([-1, 1], count)
    zeta = np.exp(rng.uniform(np.log(0.003), np.log(0.02), len(f)))
    return np.column_stack([f, zeta, r / np.max(np.abs(r))])


def stage(rng, family):
    """Modes in SI units, with no zero on the axis, and the excited band in hertz."""
    while True:
        rows = draw(rng, family)
        high = rows[-1, 0] * rng.uniform(1.3, 2.2)
        low = rng.uniform(1, 5)
        modes = np.column_stack([2 * np.pi * rows[:, 0], rows[:, 1], rows[:, 2]])
        static = np.sum(np.abs(modes[:, 2]) / modes[:, 0] ** 2)
        modes[:, 2] *= rng.uniform(50e-6, 300e-6) / static
        at = zeros(modes)
        if np.all(np.abs(at.real) > 5e-4 * np.abs(at)):
            return modes, (low, high)


def record(rng, family, path):
    modes, (low, high) = stage(rng, family)
    rate = float(rng.choice([r for r in (1000, 2000, 5000) if r > 3 * high]))
    seconds = float(rng.choice([20, 40, 120] if rate < 5000 else [20, 40, 60]))
    noise = float(np.exp(rng.uniform(np.log(60e-9), np.log(1e-6))))
    amplitude = float(rng.uniform(0.02, 0.1))
    command = sweep(rate, seconds, low, high, amplitude)
    position = output(modes, command, rate) + noise * rng.standard_normal(len(command))
    position = QUANTUM_M * np.round(position / QUANTUM_M)
    write(path, rate, command, position)
    return truth(modes, family, path) | {
        "excited_hz": [low, high], "noise_m": noise, "rate_hz": rate, "seconds": seconds, "amplitude_a": amplitude,
    }  # fmt: skip


def truth(modes, family, path):
    at = [z for z in zeros(modes) if z.imag >= 0]
    return {
        "file": str(path),
        "family": family,
        "modes": [[w / (2 * np.pi), zeta, r] for w, zeta, r in modes],
        "zeros": sorted([[z.real, z.imag if abs(z.imag) > 1e-9 * abs(z) else 0.0] for z in at], key=lambda z: np.hypot(*z)),
    }


def write(path, rate, command, position):
    times = np.arange(len(command)) / rate
    with open(path, "w") as file:
        file.write("time_s,command_a,position_m\n")
        file.writelines(f"{t:.7g},{u:.9g},{y:.9g}\n" for t, u, y in zip(times, command, position))


def main():
    seed, count, folder = int(sys.argv[1]), int(sys.argv[2]), pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        stage_truth = record(rng, FAMILIES[k % len(FAMILIES)], folder / f"stage-{seed}-{k}.csv")
        if sys.argv[4:] == ["numbers"]:
            print(*[part for zero in stage_truth["zeros"] for part in zero], flush=True)
        else:
            print(json.dumps(stage_truth), flush=True)


if __name__ == "__main__":
    main()
