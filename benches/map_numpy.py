"""Times the CNMP map of `bench model map` beside numpy's batched pencil, in one go.

    python3 benches/map_numpy.py [BENCH]      BENCH: the program, target/release/bench unless given

numpy counts a map of 1000 x 1000 points row by row, np.linalg.eigvals on 1000 pencils of 3 x 3 at a time, on one core.
`bench` runs as a process, bound to one core and to two, with the text for people as its output; the time of a map of
2 x 2 points, starting included, is taken off. Prints microseconds a point, the ratio, and whether both count alike.
"""

import json
import os

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import subprocess
import sys
import time

import numpy as np

SIDE = 1000
BENCH = sys.argv[1] if len(sys.argv) > 1 else "target/release/bench"


def run(side, *more, cores):
    grids = ["--operating-points", f"0%:15%:{side}", "--asymmetries", f"-0.1:0.1:{side}"]
    command = [BENCH, "model", "map", "--config", "chapter2", *grids, *more]
    return subprocess.run(
        command, check=True, capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, cores)
    ).stdout


def settings():
    shown = subprocess.run([BENCH, "config", "show", "--config", "chapter2", "--json"], check=True, capture_output=True)
    return json.loads(shown.stdout)["plant"]


def row(p, point, asymmetries):
    """CNMP pairs at an operating point: N_q^T (K + u M) N_c by Eq. (2-5), with x1 = 0 and motions of x4 = 0."""
    a = 0.6 * point
    second_moment = p["beam_height_m"] * p["beam_thickness_m"] ** 3 / 12
    k = 24 * p["youngs_modulus_pa"] * second_moment / (p["beam_length_m"] ** 3 * (1 - p["poisson_ratio"] ** 2))
    m1, m3, m4 = (p[f"{stage}_stage_mass_kg"] for stage in ("motion", "secondary", "intermediate"))
    k4, n = p["spring_stiffness_n_per_m"], len(asymmetries)
    x = np.array([[1, 0, 0, 0], [1, a, -a, 0], [1, -a, 0, a], [1, a, -2 * a, 0], [1, -a, 0, 2 * a]])
    along = np.array([[0, 1, -1, 0], [0, 0, 1, 0], [0, 1, 0, -1], [0, 0, 0, 1]])
    stiffness = k * along.T @ along + k4 * (np.outer(x[3], x[3]) + np.outer(x[4], x[4]))
    fixed = m1 * np.outer(x[0], x[0]) + m3 * np.outer(x[2], x[2]) + m4 * (np.outer(x[3], x[3]) + np.outer(x[4], x[4]))
    fixed += np.diag([0, m1, 0, m3])
    mass = fixed + (m3 * (1 + asymmetries))[:, None, None] * (np.outer(x[1], x[1]) + np.diag([0, 0, 1, 0]))
    seen = np.eye(4)[:, 1:]
    pushed = np.array([[-a, 1, 0, 0], [2 * a, 0, 1, 0], [0, 0, 0, 1]])
    constant = np.broadcast_to(pushed @ stiffness @ seen, (n, 3, 3))
    u = np.linalg.eigvals(-np.linalg.solve(constant, pushed @ mass @ seen))
    return (np.abs(u.imag) > 1e-7 * np.abs(u)).sum(axis=1) // 2


def best(of, times=3):
    def once():
        start = time.perf_counter()
        of()
        return time.perf_counter() - start

    return min(once() for _ in range(times))


def main():
    p, every = settings(), sorted(os.sched_getaffinity(0))
    points, asymmetries = np.linspace(0, 0.15, SIDE), np.linspace(-0.1, 0.1, SIDE)
    os.sched_setaffinity(0, every[:1])
    numpy_us = best(lambda: [row(p, point, asymmetries) for point in points])
    print(f"numpy {np.__version__}, one core: {numpy_us:.3f} us a point")
    os.sched_setaffinity(0, every)
    for count in (1, 2)[: len(every)]:
        cores = every[:count]
        bench_us = best(lambda: run(SIDE, cores=cores), 5) - best(lambda: run(2, cores=cores), 5)
        print(f"bench model map on {count} core(s): {bench_us:.4f} us a point, {numpy_us / bench_us:.1f} times faster than numpy on one")
    ours = np.array(json.loads(run(200, "--json", cores=every))["cnmp_pairs"])
    points, asymmetries = np.linspace(0, 0.15, 200), np.linspace(-0.1, 0.1, 200)
    theirs = np.array([row(p, point, asymmetries) for point in points])
    print(f"counts that differ on 200 x 200 points: {int((ours != theirs).sum())} of {theirs.size}, {int(theirs.sum())} with CNMP zeros")


if __name__ == "__main__":
    main()
