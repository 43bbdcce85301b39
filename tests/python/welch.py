"""Welch spectra by scipy, for comparison.

    welch.py RATE SEGMENT < SAMPLES   SAMPLES: lines of "input output"; prints frequency, S_uu, S_yy, Re S_uy, Im S_uy
"""

import sys

import numpy as np
import scipy.signal as ss

rate, segment = float(sys.argv[1]), int(sys.argv[2])
u, y = np.array(sys.stdin.read().split(), float).reshape(-1, 2).T
f, suu = ss.welch(u, rate, nperseg=segment)
_, syy = ss.welch(y, rate, nperseg=segment)
_, suy = ss.csd(u, y, rate, nperseg=segment)
for row in np.c_[f, suu, syy, suy.real, suy.imag]:
    print(*map(repr, map(float, row)))
