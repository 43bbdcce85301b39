"""Rigid body and flexible mode of the motor bench, by scipy's least squares with a complex residual.

    motor_bench.py FILE COLUMN    prints value and standard deviation of the rigid body's residue, and of the flexible mode's frequency (Hz),
                                  damping ratio and residue, all in rad per A, and the power of what the model does not describe over that of the
                                  response, the mean over the lines

How it differs from bench on purpose: the drift of a period is taken from the means of its neighbours; the body has viscous friction,
r/(s (s + a)), and no frequency; every line has the same error of 3 % of |H|; errors are scaled by what the fit leaves.
"""

import sys

import numpy as np
from scipy.optimize import least_squares

PERIOD, SKIP = 2500, 2
data = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
lines = np.arange(11, 251)
s = 2j * np.pi * lines


def mean_spectrum(x):
    periods = x.reshape(-1, PERIOD)
    slope = np.gradient(periods.mean(axis=1))[:, None]
    straight = periods - slope * np.arange(PERIOD) / PERIOD
    return np.fft.rfft(straight[SKIP:-1], axis=1).mean(axis=0)[lines]


measured = mean_spectrum(data[sys.argv[2]]) / mean_spectrum(data["current_a"])


def model(p):
    rigid, friction, hz, zeta, flexible, compliance, delay_ms = p
    w = 2 * np.pi * hz
    sum_ = rigid / (s * (s + friction)) + flexible / (s * s + 2 * zeta * w * s + w * w) + compliance * 1e-4
    return sum_ * np.exp(-s * delay_ms * 1e-3)


def left(p):
    error = (measured - model(p)) / (0.03 * abs(measured))
    return np.r_[error.real, error.imag]


start = [100.0, 10.0, 76.0, 0.02, 100.0, 0.0, 0.1]
fits = [least_squares(left, np.array(start) * [1, 1, 1, 1, sign, 1, 1], x_scale=[10, 5, 1, 0.01, 10, 0.1, 0.1]) for sign in (1, -1)]
best = min(fits, key=lambda fit: fit.cost)
covariance = np.linalg.inv(best.jac.T @ best.jac) * 2 * best.cost / (2 * len(lines) - len(start))
for k in (0, 2, 3, 4):
    print(repr(float(best.x[k])), repr(float(np.sqrt(covariance[k, k]))))
print(repr(float(np.mean(abs(measured - model(best.x)) ** 2 / abs(measured) ** 2))), 0.0)
