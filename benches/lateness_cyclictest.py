"""Compares the lateness of the loop with that of cyclictest, in one go.

    python3 benches/lateness_cyclictest.py [SECONDS] [BENCH]

For 1, 2 and 5 kHz, the loop of `bench control` on the simulated stage and cyclictest (Debian package rt-tests) run in
turns, ROUNDS of each, with SCHED_FIFO 80, locked memory and SECONDS (default 300) in total each. Lateness is the time from the
scheduled to the actual start of a tick. Prints in microseconds the median over the rounds of p50 and p99, the largest maximum,
and the ratios. Run it on an idle machine.
"""

import json
import statistics
import subprocess
import sys
import tempfile

import cyclictest

RATES_HZ = (1000, 2000, 5000)
ROUNDS = 5
SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 300.0
BENCH = sys.argv[2] if len(sys.argv) > 2 else "target/release/bench"


def bench_round(rate_hz, seconds, folder):
    """p50, p99 and maximum of the loop in microseconds, and how it was scheduled."""
    command = [BENCH, "control", "--slow", "--pace", "realtime", "--duration", f"{seconds}s", "--json", "--out", folder]
    command += ["--set", f"loop.rate_hz={rate_hz}", "--set", f"loop.priority={cyclictest.PRIORITY}"]
    command += ["--set", "interlock.overruns_per_s=1000"]  # a stall of the machine is measured; it does not end the run
    answer = subprocess.run(command, capture_output=True, text=True)
    if answer.returncode not in (0, 3):  # 3: ticks were missed
        sys.exit(f"{' '.join(command)}\n{answer.stdout}{answer.stderr}")
    result = json.loads(answer.stdout)
    timing = result["timing"]
    lateness = timing["lateness_ns"]
    scheduling = {name: timing[name] for name in ("policy", "memory_locked", "idle_states_off", "cpu")}
    return [lateness[name] / 1e3 for name in ("p50", "p99", "max")], scheduling


def cyclictest_round(rate_hz, seconds):
    """p50, p99 and maximum of cyclictest in microseconds."""
    counts, largest = cyclictest.run(rate_hz, seconds)
    return [cyclictest.quantile(counts, 0.5), cyclictest.quantile(counts, 0.99), largest]


def over_rounds(rounds):
    """Medians of p50 and p99, and the largest maximum."""
    p50, p99, largest = zip(*rounds)
    return [statistics.median(p50), statistics.median(p99), max(largest)]


def compare(rate_hz, folder):
    ours, theirs = [], []
    for _ in range(ROUNDS):
        figures, scheduling = bench_round(rate_hz, SECONDS / ROUNDS, folder)
        ours.append(figures)
        theirs.append(cyclictest_round(rate_hz, SECONDS / ROUNDS))
    for name, a, b in zip(("p50", "p99", "max"), over_rounds(ours), over_rounds(theirs)):
        print(f"{rate_hz:5d} Hz  {name:4s} loop {a:9.1f} us   cyclictest {b:9.1f} us   ratio {a / b:.2f}", flush=True)
    return scheduling


with tempfile.TemporaryDirectory() as folder:
    for rate_hz in RATES_HZ:
        print(f"        scheduling of the loop: {compare(rate_hz, folder)}", flush=True)
