"""Designs a controller with `bench tune` and with mixed sensitivity (python-control, slycot), and compares both in one go.

    python3 -m pip install control slycot
    python3 benches/controller_design.py [BENCH]      BENCH: the program, target/release/bench unless given

All controllers are evaluated by the same code (tests/python/tune.py): the sampled plant at 5 kHz with hold, amplifier and one
period of delay, at 15 operating points and variations, with the unmodelled modes at their most unfavourable phase. Rows: the fast
controller of the thesis, `bench tune` at the orders 8 and 11, mixed sensitivity for the stage at 8 % of L, and for two operating
points the same with a heavier weight on K S. Columns: order, smallest modulus margin of all plants, slope bandwidth and sensitivity
bandwidth at the five operating points (smallest, rad/s), largest magnitude of a closed-loop pole, processor time of the design.

Mixed sensitivity minimises the H-infinity norm of [W1 S; W2 K S] for the stage at 8 % of L alone: it knows neither the other
operating points nor the phase-free bound, which W2 approximates. wb of W1 is raised by bisection while the norm is below 1.
"""

import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time
import warnings

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[threads] = "1"

import control
import numpy as np
import scipy.signal as ss

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/python"))
import tune  # noqa: E402
from stage import AMPLIFIER, FORCE_CONSTANT  # noqa: E402

BENCH = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "target/release/bench")
RATE = 5000.0
warnings.simplefilter("ignore", FutureWarning)  # mixsyn of python-control calls its own deprecated functions
PERIOD = 1 / RATE
OPERATING_POINTS = [0, 12, 13, 14, 2]
UM = 1e6


def continuous_plant(point):
    """Current command to position in um: amplifier, modes, and 1.5 periods of delay as a Pade approximation of order 2."""
    omega, zeta, residue = tune.modes(point, 1, 1, 1)
    stage = sum(
        control.ss(control.tf([UM * FORCE_CONSTANT * r], [1, 2 * z * w, w * w])) for w, z, r in zip(omega, zeta, residue)
    )
    amplifier = control.ss(control.tf([AMPLIFIER], [1, AMPLIFIER]))
    delay = control.ss(control.tf(*control.pade(1.5 * PERIOD, 2)))
    return stage * amplifier * delay


def mixed_sensitivity(plant, effort):
    """The controller of the largest wb whose norm is below 1. W1 = (s/2 + wb)/(s + 1e-4 wb): |S| <= 2, and a slope below wb.
    W2 has a peak of `effort` um/A over the unmodelled modes, 235 to 284 Hz, and a twentieth of it elsewhere."""
    low, high, best = 5.0, 5.0, None
    centre = 2 * np.pi * 260

    def synthesised(wb):
        w1 = control.ss(control.tf([0.5, wb], [1, 1e-4 * wb]))
        w2 = control.ss(control.tf(
            [effort / 20, effort / 20 * 4 * centre, effort / 20 * centre**2], [1, 0.2 * centre, centre**2]
        ))
        try:
            k, _, (gamma, _) = control.mixsyn(plant, w1=w1, w2=w2)
        except Exception:  # slycot reports a failed synthesis by several exceptions
            return None
        return k if gamma <= 1 else None

    while (k := synthesised(high)) is not None and high < 3000:
        low, best, high = high, k, 1.3 * high
    for _ in range(8):
        middle = (low * high) ** 0.5
        k = synthesised(middle)
        if k is None:
            high = middle
        else:
            low, best = middle, k
    return best


def discrete(k):
    return ss.cont2discrete((k.A, k.B, k.C, k.D), PERIOD, method="bilinear")[:4]


def state_space(path):
    """The sections of a controller file in series, in A/um."""
    a, b, c, d = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.eye(1)
    for section in tune.controller(path, RATE):
        na, nb, nc, nd = ss.tf2ss(*section)
        a = np.block([[a, np.zeros((a.shape[0], na.shape[0]))], [nb @ c, na]])
        b = np.vstack([b, nb @ d])
        c, d = np.hstack([nd @ c, nc]), nd @ d
    return a, b, c, d


GRID = np.unique(np.concatenate([np.geomspace(0.7, np.pi / PERIOD, 4000), np.linspace(1400, 1850, 2000)]))
BOUND = tune.bound(GRID, PERIOD)


def figures(number, law):
    omega, zeta, residue = tune.modes(*tune.PLANTS[number])
    a, b, c, d = law
    w = np.unique(np.concatenate(
        [np.geomspace(0.7, np.pi / PERIOD * 0.9999, 6000)]
        + [x * (1 + y * np.sinh(np.linspace(-6, 6, 400))) for x, y in zip(omega, zeta)]
    ))
    w = w[(w > 0.7) & (w < np.pi / PERIOD)]
    z = np.exp(1j * w * PERIOD)
    resolvent = np.linalg.solve(z[:, None, None] * np.eye(a.shape[0]) - a, np.broadcast_to(b, (z.size, *b.shape)))
    k = UM * ((c @ resolvent)[:, 0, 0] + d[0, 0])
    pa, pb, pc = system = tune.sampled(omega, zeta, residue, PERIOD)
    distance = np.abs(1 + tune.response(system, z) * k) - np.abs(k) * np.interp(w, GRID, BOUND)
    slope = np.minimum.accumulate(w * distance / np.sqrt(2))
    beyond, above = np.nonzero(slope < w)[0], np.nonzero(distance < np.sqrt(2))[0]
    closed = np.block([[pa - pb @ (UM * d) @ pc, pb @ (UM * c)], [-b @ pc, a]])
    return (
        distance.min(), slope[max(beyond[0] - 1, 0)], w[above[0]], np.abs(np.linalg.eigvals(closed)).max(),
    )


def row(name, law, seconds):
    rows = np.array([figures(number, law) for number in range(len(tune.PLANTS))])
    operating = rows[OPERATING_POINTS]
    order = law[0].shape[0]
    print(
        f"{name:38} {order:5d} {rows[:, 0].min():8.3f} {operating[:, 1].min():8.1f} {operating[:, 2].min():8.1f} "
        f"{rows[:, 3].max():9.6f} {seconds:8.1f}"
    )


def tuned(order, folder):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    out = f"{folder}/order{order}"
    command = [BENCH, "tune", "--order", str(order), "--without-bound", "--out", out]
    subprocess.run(command, check=True, capture_output=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    row(f"bench tune --order {order}", state_space(f"{out}/controller.toml"), seconds)


def main():
    print(f"{'controller':38} {'order':>5} {'margin':>8} {'slope':>8} {'band':>8} {'pole':>9} {'time s':>8}")
    row("fast controller of the thesis", state_space(ROOT / "bench-config/controllers/fast.toml"), 0.0)
    for name, effort in (("mixed sensitivity, W2 up to 30 um/A", 30.0), ("mixed sensitivity, W2 up to 200 um/A", 200.0)):
        start = time.process_time()
        k = mixed_sensitivity(continuous_plant(0.08), effort)
        seconds = time.process_time() - start
        if k is None:
            print(f"{name:38} no controller with norm below 1")
        else:
            row(name, discrete(k), seconds)
    with tempfile.TemporaryDirectory() as folder:
        for order in (8, 11):
            tuned(order, folder)


main()
