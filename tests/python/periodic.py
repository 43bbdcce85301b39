"""Response and variance of a periodic record by numpy.

    periodic.py PERIOD SKIP LOW HIGH STEP < SAMPLES   SAMPLES: lines of "input output"; prints line, Re H, Im H, E|error|^2
"""

import sys

import numpy as np

period, skip, low, high, step = map(int, sys.argv[1:])
u, y = np.array(sys.stdin.read().split(), float).reshape(-1, 2).T
starts = range(skip * period, len(u) - 2 * period + 1, period)


def spectra(x):
    straight = []
    for start in starts:
        reach = min(period // 100, start, len(x) - start - period - 1)
        here = x[start - reach : start + reach + 1]
        there = x[start + period - reach : start + period + reach + 1]
        straight.append(x[start : start + period] - np.mean(there - here) * np.arange(period) / period)
    return np.fft.fft(straight, axis=1)[:, low : high + 1 : step]


inputs, outputs = spectra(u), spectra(y)
mean = inputs.mean(axis=0)
response = outputs.mean(axis=0) / mean
variance = np.var(outputs - response * inputs, axis=0, ddof=1) / len(inputs) / abs(mean) ** 2
for row in zip(range(low, high + 1, step), response.real, response.imag, variance):
    print(*map(repr, map(float, row)))
