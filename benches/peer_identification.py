"""Identifies the same external records with `bench identify`, with sdypy-EMA (pyFRF, LSCF, LSFD) and by vector fitting, and prints one
table.

    python3 -m pip install numpy scipy sdypy-EMA pyFRF
    python3 benches/peer_identification.py [--stages 12] [--seed 1] [--bench target/release/bench] [--motor-bench FILE.csv]

The records are those of tests/python/random_stages.py, which has no line of either program: 2 to 6 modes with signed residues, a
held and delayed command, a current loop of 1 kHz, white noise, quantisation, one sweep. With --motor-bench, also the record of a
motor bench (20 periods of a multisine; columns current_a, motor_angle_rad, load_angle_rad); its reference is the scipy fit of
tests/python/motor_bench.py.

How each program is used:

- `bench identify` gets the columns, and for the random stages the hold and the lag of the current loop. Nothing else is set.
- sdypy-EMA has no automatic choice of order and poles, no delay and no hold. It gets the best that an operator could choose, with
  the truth at hand: the excited band; the response without the true hold, delay and current loop (`path`); receptance or accelerance;
  the model order up to 100; at this order the stable pole nearest to each true pole; residues with or without the terms of modes
  outside of the band. Of all combinations the one with the smallest sum of relative errors of poles and residues is taken. So its
  errors are a lower limit of what an operator without the truth gets.
- Vector fitting (vector_fitting.py) gets the same response, and the best choice as well: of the number of poles, from that of the true
  modes to three more, and of the weight of the response, |H|^0, |H|^-0.5 or |H|^-1.

Errors are relative, and the largest of all modes that were found in the excited band. `signs` counts residues with the wrong sign, and
before `?` those of `bench` whose 95 % confidence interval contains both signs; these are not counted as wrong. The verdict is whether
there is a CNMP pair in the band: the others have none, so it is that of the zeros of their modes, which cannot be undecided. Time is
processor time: of `bench identify` as a whole with its plots and report, and of the one chosen combination of the others (of sdypy-EMA
with all orders up to the chosen one) without reading the file and without the search.
"""

import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from importlib.metadata import version

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np
from pyFRF import FRF
from sdypy.EMA import Model

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCRIPTS = ROOT / "tests/python"
sys.path.insert(0, str(SCRIPTS))
import random_stages  # noqa: E402
import vector_fitting  # noqa: E402

warnings.filterwarnings("ignore", message="f_upper .* is outside")  # sdypy-EMA cuts the response one line below the limit itself
LAG_S = 1 / random_stages.LOOP_RAD_S
MAX_ORDER = 100
MAX_MORE_POLES = 3
MAX_SIGN_ERROR = 0.025  # beyond it the 95 % confidence interval of the residue contains both signs
MOTOR_PERIOD, MOTOR_SKIP, MOTOR_RATE_HZ, MOTOR_BAND_HZ = 2500, 2, 2500.0, (11.0, 250.0)
HEADER = ("stage", "program", "modes", "frequency", "damping", "residue", "signs", "verdict", "time s", "chosen by hand")
WIDTHS = (18, 14, 5, 11, 9, 9, 5, 10, 6, 0)


class Truth:
    """Modes in the excited band, as rows of (w in rad/s, zeta, residue), and whether there is a CNMP pair in the band."""

    def __init__(self, name, modes, band_hz):
        inside = [band_hz[0] <= w / (2 * np.pi) <= band_hz[1] for w, _, _ in modes]
        self.name, self.band_hz, self.modes = name, band_hz, np.array(modes)[inside]
        self.cnmp = has_cnmp(random_stages.zeros(np.array(modes)), band_hz)


def has_cnmp(zeros, band_hz):
    hz = np.abs(zeros) / (2 * np.pi)
    return bool(np.any((zeros.real > 0) & (zeros.imag > 1e-6 * np.abs(zeros)) & (hz >= band_hz[0]) & (hz <= band_hz[1])))


def poles(modes):
    w, zeta, _ = np.reshape(modes, (-1, 3)).T
    return w * (-zeta + 1j * np.sqrt(1 - zeta**2))


def nearest(candidates, truth):
    """Index of the candidate nearest to each true pole, each one used once; -1 if there are too few."""
    distance = np.abs(candidates[:, None] - truth[None, :])
    chosen = np.full(len(truth), -1)
    for _ in range(min(distance.shape)):
        k, mode = np.unravel_index(np.argmin(distance), distance.shape)
        chosen[mode] = k
        distance[k, :] = distance[:, mode] = np.inf
    return chosen


def errors(found, expected):
    """The largest relative errors of frequency, damping and residue of all pairs of modes; NaN without a pair."""
    if len(found) == 0:
        return np.full(3, np.nan)
    return np.max(np.abs(np.array(found) / expected - 1), axis=0)


# bench ----------------------------------------------------------------------------------------------------------------


def of_bench(bench, file, truth, options, folder):
    begin = children_s()
    answer = subprocess.run([bench, "identify", str(file), *options, "--json", "--out", str(folder)], capture_output=True, text=True)
    seconds = children_s() - begin
    if answer.returncode != 0:
        sys.exit(f"bench identify {file}: {answer.stderr}")
    answer = json.loads(answer.stdout)
    modes = answer["modes"]
    rows = np.reshape([[2 * np.pi * mode["frequency_hz"], mode["damping_ratio"], mode["residue"]] for mode in modes], (-1, 3))
    chosen = nearest(poles(rows), poles(truth.modes))
    expected = truth.modes[chosen >= 0]
    found = chosen[chosen >= 0]
    certain = np.array([modes[k]["sign_error_probability"] < MAX_SIGN_ERROR for k in found], dtype=bool)
    wrong = np.sum((np.sign(rows[found, 2]) != np.sign(expected[:, 2])) & certain)
    uncertain = "" if np.all(certain) else f" {np.sum(~certain)}?"
    verdict = {"detected": True, "excluded": False}.get(answer["cnmp"])
    return {
        "program": "bench",
        "found": f"{len(found)}/{len(truth.modes)}",
        "errors": errors(rows[found], expected),
        "signs": f"{wrong}{uncertain}",
        "verdict": "undecided" if verdict is None else right(verdict, truth),
        "seconds": seconds,
        "by_hand": ", ".join(option[2:] for option in options if option in ("--hold", "--input-lag", "--period")),
    }


def children_s():
    """Processor time of all ended child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def right(verdict, truth):
    return "right" if verdict == truth.cnmp else "WRONG"


# sdypy-EMA ------------------------------------------------------------------------------------------------------------


def response(rate_hz, inputs, outputs):
    """H1 of pyFRF over whole records without a window: rows are measurements, at rest at both ends or periods."""
    samples = inputs.shape[1]
    lengths = {"fft_len": samples, "nperseg": samples, "noverlap": 0}
    estimate = FRF(int(rate_hz), exc=inputs, resp=outputs, exc_type="f", resp_type="d", window="none", **lengths)
    return estimate.get_f_axis(), np.squeeze(estimate.get_FRF("H1", "receptance"))


def path_to_force(f_hz, rate_hz):
    """Response of hold, delay of one period, and current loop of the random stages."""
    s = 2j * np.pi * f_hz
    return np.sinc(f_hz / rate_hz) * np.exp(-1.5 * s / rate_hz) / (1 + s * LAG_S)


def model_of(f_hz, receptance, band_hz, form, max_order):
    frf = receptance if form == "receptance" else -((2 * np.pi * f_hz) ** 2) * receptance
    model = Model(frf, f_hz, lower=band_hz[0], upper=band_hz[1], pol_order_high=max_order, frf_form=form)
    model.get_poles(method="lscf", show_progress=False)
    return model


def modes_at(model, order, truth, terms):
    """Of an order, rows (w, zeta, residue) of the stable poles nearest to the true ones, and for which true modes there is one."""
    candidates = model.all_poles[order]
    usable = np.flatnonzero((candidates.imag > 0) & (candidates.real < 0))
    chosen = nearest(candidates[usable], poles(truth.modes))
    has = chosen >= 0
    if not np.any(has):
        return np.zeros((0, 3)), has
    model.pole_ind = [[order, usable[k]] for k in chosen[has]]
    _, residues = model.get_constants(method="lsfd_proportional", lower_r=terms, upper_r=terms)
    picked = candidates[usable[chosen[has]]]
    return np.column_stack([np.abs(picked), -picked.real / np.abs(picked), residues[0]]), has


def cost(rows, expected):
    """Sum of the distances of poles, relative to the half-width of the resonance, and of relative errors of residues."""
    distance = np.abs(poles(rows) - poles(expected)) / (expected[:, 1] * expected[:, 0])
    return np.sum(distance) + np.sum(np.abs(rows[:, 2] / expected[:, 2] - 1))


def best_choice(f_hz, receptance, truth):
    """Form, order and terms of the combination that has most modes and is nearest to the truth."""
    choices = []
    for form in ("receptance", "accelerance"):
        model = model_of(f_hz, receptance, truth.band_hz, form, MAX_ORDER)
        for order in range(len(model.all_poles)):
            for terms in (True, False):
                rows, has = modes_at(model, order, truth, terms)
                if len(rows):
                    choices.append((-len(rows), cost(rows, truth.modes[has]), form, order, terms))
    return min(choices)[2:]


def of_peer(rate_hz, inputs, outputs, path, truth):
    f_hz, receptance = response(rate_hz, inputs, outputs)
    form, order, terms = best_choice(f_hz[1:], receptance[1:] / path(f_hz[1:]), truth)
    begin = time.process_time()
    f_hz, receptance = response(rate_hz, inputs, outputs)
    model = model_of(f_hz[1:], receptance[1:] / path(f_hz[1:]), truth.band_hz, form, order + 1)
    rows, has = modes_at(model, order, truth, terms)
    expected = truth.modes[has]
    seconds = time.process_time() - begin
    wrong = int(np.sum(np.sign(rows[:, 2]) != np.sign(expected[:, 2])))
    return {
        "program": "sdypy-EMA",
        "found": f"{len(rows)}/{len(truth.modes)}",
        "errors": errors(rows, expected),
        "signs": str(wrong),
        "verdict": right(has_cnmp(random_stages.zeros(rows), truth.band_hz), truth),
        "seconds": seconds,
        "by_hand": f"band, path, order {order + 1}, poles, {form}{', terms' if terms else ''}",
    }


# vector fitting -------------------------------------------------------------------------------------------------------


def modes_by_vector_fitting(f_hz, receptance, truth, count, exponent):
    """Rows (w, zeta, residue) of the poles nearest to the true ones, and for which true modes there is one."""
    weight = np.abs(receptance) ** -exponent
    candidates = vector_fitting.poles(f_hz, receptance, count, weight)
    residues = vector_fitting.real_residues(f_hz, receptance, candidates, weight)
    chosen = nearest(candidates, poles(truth.modes))
    has = chosen >= 0
    picked = candidates[chosen[has]]
    return np.column_stack([np.abs(picked), -picked.real / np.abs(picked), residues[chosen[has]]]), has


def of_vector_fitting(rate_hz, inputs, outputs, path, truth):
    def in_band():
        f_hz, receptance = response(rate_hz, inputs, outputs)
        inside = (f_hz >= truth.band_hz[0]) & (f_hz <= truth.band_hz[1])
        return f_hz[inside], receptance[inside] / path(f_hz[inside])

    data = in_band()
    choices = []
    for more in range(MAX_MORE_POLES + 1):
        for exponent in (0.0, 0.5, 1.0):
            rows, has = modes_by_vector_fitting(*data, truth, len(truth.modes) + more, exponent)
            choices.append((-len(rows), cost(rows, truth.modes[has]), len(truth.modes) + more, exponent))
    count, exponent = min(choices)[2:]
    begin = time.process_time()
    rows, has = modes_by_vector_fitting(*in_band(), truth, count, exponent)
    expected = truth.modes[has]
    seconds = time.process_time() - begin
    return {
        "program": "vector fitting",
        "found": f"{len(rows)}/{len(truth.modes)}",
        "errors": errors(rows, expected),
        "signs": str(int(np.sum(np.sign(rows[:, 2]) != np.sign(expected[:, 2])))),
        "verdict": right(has_cnmp(random_stages.zeros(rows), truth.band_hz), truth),
        "seconds": seconds,
        "by_hand": f"band, path, {count} poles, weight |H|^-{exponent:g}",
    }


# table ----------------------------------------------------------------------------------------------------------------


def line(cells):
    return "  ".join(str(cell).ljust(width) for cell, width in zip(cells, WIDTHS)).rstrip()


def print_row(truth, result):
    frequency, damping, residue = (f"{100 * part:.3g} %" for part in result["errors"])
    cells = (truth.name, result["program"], result["found"], frequency, damping, residue, result["signs"], result["verdict"])
    print(line((*cells, f"{result['seconds']:.2f}", result["by_hand"])), flush=True)


def of_program(results, program):
    """The results of one program, in the order of the stages."""
    return [result for result in results if result["program"] == program]


def wrong_signs(result):
    """Number of wrong signs, without the uncertain ones."""
    return int(result["signs"].split()[0])


def print_summary(results):
    for program in ("bench", "sdypy-EMA", "vector fitting"):
        own = of_program(results, program)
        all_errors = np.array([result["errors"] for result in own])
        frequency, damping, residue = (f"{100 * part:.3g} %" for part in np.nanmedian(all_errors, axis=0))
        verdicts = [result["verdict"] for result in own]
        counts = ", ".join(f"{verdicts.count(word)} {word}" for word in ("right", "undecided", "WRONG"))
        seconds = np.median([result["seconds"] for result in own])
        medians = f"{frequency} frequency, {damping} damping, {residue} residue, {seconds:.2f} s"
        print(f"{program}, {len(own)} stages: medians {medians}; verdicts: {counts}")
        ratios = all_errors / [result["errors"] for result in of_program(results, "bench")]
        frequency, damping, residue = (f"{ratio:.3g}" for ratio in np.nanmedian(ratios, axis=0))
        complete = sum(len(set(result["found"].split("/"))) == 1 for result in own)
        print(f"    errors over those of bench on the same stage, medians: {frequency} frequency, {damping} damping, {residue} residue")
        print(f"    all modes found: {complete} stages; wrong signs: {sum(wrong_signs(result) for result in own)}")


def random_stage(k, chosen, folder):
    """All results for one random stage."""
    family = random_stages.FAMILIES[k % len(random_stages.FAMILIES)]
    file = folder / f"stage-{k}.csv"
    facts = random_stages.record(np.random.default_rng([chosen.seed, k]), family, file)
    modes = [(2 * np.pi * hz, zeta, residue) for hz, zeta, residue in facts["modes"]]
    truth = Truth(f"{k} {family}", modes, facts["excited_hz"])
    options = "--input command_a --output position_m --time time_s --hold zoh --input-lag".split() + [f"{LAG_S}s"]
    data = np.loadtxt(file, delimiter=",", skiprows=1)
    rate_hz = facts["rate_hz"]
    own = of_bench(chosen.bench, file, truth, options, folder / "results")
    record = (rate_hz, data[None, :, 1], data[None, :, 2], lambda f_hz: path_to_force(f_hz, rate_hz), truth)
    return truth, (own, of_peer(*record), of_vector_fitting(*record))


def motor_side(column, chosen, folder):
    """All results for the flexible mode at one side of the motor bench. The rigid body has no frequency in the band."""
    fit = [sys.executable, SCRIPTS / "motor_bench.py", chosen.motor_bench, column]
    printed = subprocess.run(fit, capture_output=True, text=True, check=True)
    _, hz, zeta, residue, _ = (float(row.split()[0]) for row in printed.stdout.splitlines())
    truth = Truth(f"motor bench, {column.split('_')[0]}", [(2 * np.pi * hz, zeta, residue)], MOTOR_BAND_HZ)
    options = ["--input", "current_a", "--output", column, "--time", "time_s", "--period", str(MOTOR_PERIOD)]
    data = np.genfromtxt(chosen.motor_bench, delimiter=",", names=True)
    own = of_bench(chosen.bench, chosen.motor_bench, truth, options, folder / "results")
    inputs, outputs = (periods(data[name]) for name in ("current_a", column))
    record = (MOTOR_RATE_HZ, inputs, outputs, lambda f_hz: 1.0, truth)
    # One mode has no zeros: there is no verdict to compare.
    return truth, tuple({**result, "verdict": "-"} for result in (own, of_peer(*record), of_vector_fitting(*record)))


def periods(signal):
    """The settled periods, each without its drift: the slope is that between the means of its neighbours."""
    rows = signal.reshape(-1, MOTOR_PERIOD)
    slope = np.gradient(rows.mean(axis=1))[:, None]
    return (rows - slope * np.arange(MOTOR_PERIOD) / MOTOR_PERIOD)[MOTOR_SKIP:-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stages", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bench", default=str(ROOT / "target/release/bench"))
    parser.add_argument("--motor-bench", type=pathlib.Path, metavar="FILE.csv")
    chosen = parser.parse_args()
    program = subprocess.run([chosen.bench, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    print(f"{program}; sdypy-EMA {version('sdypy-EMA')}, pyFRF {version('pyFRF')}; seed {chosen.seed}\n\n{line(HEADER)}")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        results = []
        for k in range(chosen.stages):
            truth, of_stage = random_stage(k, chosen, folder)
            for result in of_stage:
                print_row(truth, result)
            results += of_stage
        print_summary(results)
        for column in ("motor_angle_rad", "load_angle_rad") if chosen.motor_bench else ():
            truth, of_side = motor_side(column, chosen, folder)
            for result in of_side:
                print_row(truth, result)


if __name__ == "__main__":
    main()
