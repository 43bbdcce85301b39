"""Times Welch's estimator beside scipy's csd, in one go.

    cargo bench --bench identify -- welch && python3 benches/welch_scipy.py

Both take 600,500 samples of input and output, Hann windows of 16,384 samples, half overlapped, no detrending, on one core:
scipy computes the three spectra that an H1 with coherence takes (csd, and welch of both). Prints the medians and the ratio.
"""

import json
import os

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import statistics
import sys
import time
from pathlib import Path

import numpy as np
import scipy.signal as ss

SAMPLES, SEGMENT, RATE_HZ = 600_500, 16_384, 5000.0
OURS = Path("target/criterion/identify/welch/new/estimates.json")


def scipys(u, y):
    began = time.perf_counter()
    options = {"fs": RATE_HZ, "nperseg": SEGMENT, "detrend": False}
    ss.csd(u, y, **options), ss.welch(u, **options), ss.welch(y, **options)
    return time.perf_counter() - began


if not OURS.exists():
    sys.exit(f"{OURS} is missing: run `cargo bench --bench identify -- welch` first, in the folder of the repository")
rng = np.random.default_rng(1)
u, y = rng.standard_normal((2, SAMPLES))
theirs = statistics.median(scipys(u, y) for _ in range(15))
ours = json.loads(OURS.read_text())["median"]["point_estimate"] * 1e-9
print(f"scipy {theirs * 1e3:.1f} ms, bench {ours * 1e3:.1f} ms: {theirs / ours:.1f} times")
