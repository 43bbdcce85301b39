#!/usr/bin/env python3
"""Whether exported files hold what was recorded, read by programs of other authors (pandas, pyarrow, scipy, pyuff, python-control).

Reads a JSON array of questions on standard input, prints a JSON array of answers. The recording is read with the package `mcap`.
"""

import json
import sys

import control
import numpy
import pandas
import pyarrow.parquet
import pyuff
import scipy.io
from read_recording import make_reader, DecoderFactory

REALS = ("reference_m", "position_m", "requested_a", "command_a")
OPTIONALS = ("actual_a", "raw_position_m", "raw_command_a")
COUNTS = ("tick", "probe_sequence", "validity", "state", "flags")
# E20.12 has 13 significant digits: half a unit of the last one, relative to the smallest mantissa.
DIGITS = 0.5e-12


def recorded(path):
    """Name to array, from the messages of /loop; NaN where a field is absent."""
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        ticks = [m for *_, m in reader.iter_decoded_messages(topics=["/loop"], log_time_order=False)]
    signals = {n: numpy.array([getattr(m, n) for m in ticks]) for n in REALS}
    for n in OPTIONALS:
        signals[n] = numpy.array([getattr(m, n) if m.HasField(n) else numpy.nan for m in ticks])
    for n in COUNTS:
        signals[n] = numpy.array([getattr(m, n) for m in ticks], dtype=numpy.uint64)
    ns = {n: numpy.array([getattr(m, n) for m in ticks]) for n in ("scheduled_ns", "woke_ns", "done_ns", "probe_age_ns")}
    signals["time_s"] = ns["scheduled_ns"] / 1e9
    signals["lateness_s"] = (ns["woke_ns"] - ns["scheduled_ns"]) / 1e9
    signals["compute_s"] = (ns["done_ns"] - ns["woke_ns"]) / 1e9
    signals["probe_age_s"] = ns["probe_age_ns"] / 1e9
    return signals


def same_bits(a, b):
    """Equal doubles including the sign of zero, or both NaN; equal integers."""
    if a.shape != b.shape:
        return False
    if a.dtype.kind != "f":
        return b.dtype.kind in "iu" and bool(numpy.all(a == b))
    both_nan = numpy.isnan(a) & numpy.isnan(b)
    return bool(numpy.all((a == b) & (numpy.signbit(a) == numpy.signbit(b)) | both_nan))


def exact(q, columns):
    """Columns against the recording, bit for bit."""
    truth = recorded(q["recording"])
    names = [] if set(truth) == set(columns) else [f"{sorted(columns)} for {sorted(truth)}"]
    wrong = [n for n in truth if n in columns and not same_bits(truth[n], numpy.asarray(columns[n]))]
    return {"rows": len(columns["time_s"]), "differences": names + wrong}


def as_csv(q):
    types = {n: numpy.uint64 for n in COUNTS}
    table = pandas.read_csv(q["file"], dtype=types)
    return exact(q, {n: table[n].to_numpy() for n in table.columns})


def as_parquet(q):
    table = pandas.read_parquet(q["file"])
    answer = exact(q, {n: table[n].to_numpy() for n in table.columns})
    # pandas makes NaN of null: pyarrow shows that a missing measurement is null.
    nulls = pyarrow.parquet.read_table(q["file"])["actual_a"].null_count
    if nulls != numpy.isnan(recorded(q["recording"])["actual_a"]).sum():
        answer["differences"].append(f"{nulls} nulls")
    return answer


def as_mat(q):
    variables = scipy.io.loadmat(q["file"])
    return exact(q, {n: v[:, 0] for n, v in variables.items() if not n.startswith("__")})


def as_uff58(q):
    truth = recorded(q["recording"])
    sets = pyuff.UFF(q["file"]).read_sets()
    found = {s["id1"].strip(): s for s in sets}
    expected = {n for n in REALS + OPTIONALS if not numpy.isnan(truth[n]).all()}
    differences = [] if set(found) == expected else [f"{sorted(found)} for {sorted(expected)}"]
    for name, s in found.items():
        if not numpy.allclose(s["data"], truth[name], rtol=DIGITS, atol=0, equal_nan=True):
            differences.append(name)
        if not numpy.allclose(s["x"], truth["time_s"], rtol=1e-12, atol=0):
            differences.append(f"time of {name}")
        unit = {"m": "m", "a": "A"}[name.rsplit("_", 1)[1]]
        if (s["func_type"], s["ordinate_axis_units_lab"].strip(), s["abscissa_axis_units_lab"].strip()) != (1, unit, "s"):
            differences.append(f"header of {name}")
    return {"rows": len(sets[0]["data"]), "differences": differences}


def table(q):
    """Frequency, complex response and sigma of a table of a frequency response."""
    f, magnitude, phase, coherence, sigma, _, resolution = numpy.loadtxt(q["table"], delimiter=",", skiprows=1).T
    return f, magnitude * numpy.exp(1j * numpy.radians(phase)), sigma, coherence, resolution


def frf_mat(q):
    f, h, sigma, coherence, resolution = table(q)
    frf = scipy.io.loadmat(q["file"])["frf"][0, 0]
    covariance = numpy.zeros((1, 1, len(f), 2, 2))
    covariance[0, 0, :, 0, 0] = covariance[0, 0, :, 1, 1] = sigma**2
    checks = {
        "Frequency": numpy.array_equal(frf["Frequency"][:, 0], f),
        # Sine and cosine of two libraries differ by some units of the last digit.
        "ResponseData": frf["ResponseData"].shape == (1, 1, len(f)) and numpy.allclose(frf["ResponseData"][0, 0], h, rtol=1e-14, atol=0),
        "CovarianceData": numpy.allclose(frf["CovarianceData"], covariance, rtol=1e-15, atol=0),
        "Coherence": numpy.array_equal(frf["Coherence"][:, 0], coherence),
        "Resolution": numpy.array_equal(frf["Resolution"][:, 0], resolution),
        "Ts": frf["Ts"].item() == 0,
    }
    texts = {"FrequencyUnit": "Hz", "InputName": "current", "InputUnit": "A", "OutputName": "position", "OutputUnit": "m"}
    checks |= {n: frf[n].item() == text for n, text in texts.items()}
    # The three lines of docs/results.md.
    frf = scipy.io.loadmat(q["file"], simplify_cells=True)["frf"]
    w = 2 * numpy.pi * frf["Frequency"]
    frd = control.FRD(frf["ResponseData"], w)
    checks["FRD"] = numpy.allclose(frd(1j * w), h, rtol=1e-14, atol=0)
    return {"rows": len(w), "differences": [n for n, right in checks.items() if not right]}


def frf_uff58(q):
    f, h, *_ = table(q)
    s = pyuff.UFF(q["file"]).read_sets()
    s = s[0] if isinstance(s, list) else s
    error = numpy.abs(s["data"].real - h.real) <= numpy.abs(h.real) * DIGITS + numpy.abs(h) * 1e-14
    error &= numpy.abs(s["data"].imag - h.imag) <= numpy.abs(h.imag) * DIGITS + numpy.abs(h) * 1e-14
    checks = {
        "response": bool(error.all()),
        # Seven digits.
        "frequency": numpy.allclose(s["x"], f, rtol=0.5e-6, atol=0),
        "header": (s["func_type"], s["ordinate_axis_units_lab"].strip(), s["orddenom_axis_units_lab"].strip()) == (4, "m", "A"),
    }
    return {"rows": len(s["x"]), "differences": [n for n, right in checks.items() if not right]}


ANSWERS = {"csv": as_csv, "parquet": as_parquet, "mat": as_mat, "uff58": as_uff58, "frf_mat": frf_mat, "frf_uff58": frf_uff58}

if __name__ == "__main__":
    json.dump([ANSWERS[q["what"]](q) for q in json.load(sys.stdin)], sys.stdout)
