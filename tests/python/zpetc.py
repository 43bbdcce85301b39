#!/usr/bin/env python3
"""Tracking error of a feedforward with preview beside that of ZPETC, computed without any line of bench.

Reads a JSON array of questions on standard input, prints a JSON array of answers. Every question has `config` (the object that
`bench config show --json` prints), the taps `reference` and `feedforward` of the command of bench ([delay in ticks, weight] each), and
`samples`, a reference in metres at each tick that begins and ends at rest. The answer has, for preview, for ZPETC and for the feedback
alone, the largest error in metres (`peak_m`) and the error of a sine at each of `sine_hz` over its amplitude (`sines`).

The plant is that of truth.py: matrices as printed, sampled by one exponential. With P the sampled plant, C the law and S = 1/(1 + P C), the
position behind the filters F (reference) and U (current) is y = S (P U + P C F) r.

ZPETC (M. Tomizuka, Journal of Dynamic Systems, Measurement, and Control 109, 1987): P = z^-d B+ B-/A, where B- contains the zeros on or
outside the unit circle. The current cancels A and B+, and replaces 1/B-(z) by B-(1/z)/B-(1)^2, so that P U = |B-|^2/B-(1)^2: no phase, but
a gain that is not 1. The loop follows the reference itself, F = 1.
"""

import json
import sys

import numpy as np
import scipy.linalg as la

import truth


def zeros(config):
    """Finite zeros of the sampled plant without its delay: (F - z, g; C, 0) is singular."""
    F, g, C = truth.sampled(config, False)
    n = len(F)
    pencil, mass = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    pencil[:n, :n], pencil[:n, n], pencil[n, :n] = F, g, C
    mass[:n, :n] = np.eye(n)
    found = la.eigvals(pencil, mass)
    return found[np.isfinite(found) & (np.abs(found) < 1e4)]


def responses(q, omega):
    """r -> y of preview, ZPETC and feedback alone, at frequencies above 0."""
    config = q["config"]
    z = truth.on_circle(config, omega)
    P = truth.sampled_plant(config, omega, False)
    S = truth.sensitivity(config, omega)
    filtered = lambda taps: sum(weight * z**-delay for delay, weight in taps)
    # S P C = 1 - S.
    preview = S * P * filtered(q["feedforward"]) + (1 - S) * filtered(q["reference"])
    outside = [b for b in zeros(config) if np.abs(b) >= 1]
    gain = np.abs(np.prod([(z - b) / (1 - b) for b in outside], axis=0)) ** 2
    return {"preview": preview, "zpetc": S * gain + (1 - S), "feedback": 1 - S}


def answer(q):
    rate = q["config"]["loop"]["rate_hz"]
    samples = np.array(q["samples"])
    # There and back: periodic without a jump.
    whole = np.concatenate([samples, samples[::-1]])
    spectrum = np.fft.rfft(whole)
    omega = 2 * np.pi * np.fft.rfftfreq(len(whole), 1 / rate)[1:-1]
    sines = 2 * np.pi * np.array(q["sine_hz"])
    courses, at_sines = responses(q, omega), responses(q, sines)
    found = {}
    for name in courses:
        error = np.zeros_like(spectrum)
        error[1:-1] = (1 - courses[name]) * spectrum[1:-1]
        found[name] = {
            "peak_m": float(np.abs(np.fft.irfft(error, len(whole))[: len(samples)]).max()),
            "sines": [float(x) for x in np.abs(1 - at_sines[name])],
        }
    found["zeros_outside"] = int(sum(np.abs(b) >= 1 for b in zeros(q["config"])))
    return found


if __name__ == "__main__":
    print(json.dumps([answer(q) for q in json.load(sys.stdin)]))
