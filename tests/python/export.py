#!/usr/bin/env python3
"""Whether exported files hold what was recorded, read by programs of other authors (pandas, pyarrow, scipy, pyuff, python-control).

Reads a JSON array of questions on standard input, prints a JSON array of answers. The recording is read with the package `mcap`.
"""

import json
import pathlib
import sys

import numpy
import pandas
import pyarrow.parquet
import pyuff
import scipy.io
from read_recording import make_reader, DecoderFactory

REALS = ("reference_m", "position_m", "requested_a", "command_a")
OPTIONALS = ("actual_a", "raw_position_m", "raw_command_a")
COUNTS = ("tick", "probe_sequence", "validity", "state", "flags", "missed_ticks")
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


def uff58_times(q):
    """The times of the only dataset against tick / rate."""
    s = pyuff.UFF(q["file"]).read_sets()
    s = s[0] if isinstance(s, list) else s
    expected = numpy.arange(len(s["x"])) / q["rate_hz"]
    # Besides, the rounding of the product of increment and number: a few units of the last digit of a double.
    wrong = numpy.abs(s["x"] - expected) > q["allowed_s"] + 4 * numpy.spacing(expected)
    return {"rows": len(s["x"]), "differences": [float(x) for x in s["x"][wrong][:5]]}


def response(q):
    """Frequency in Hz and response, as bench has them in memory."""
    return numpy.array(q["frequency_hz"]), numpy.array(q["real"]) + 1j * numpy.array(q["imaginary"])


def table(q):
    """The columns of the table that `bench chirp` wrote."""
    return pandas.read_csv(q["table"])


def frf_mat(q):
    f, h = response(q)
    columns = table(q)
    w = 2 * numpy.pi * f
    frf = scipy.io.loadmat(q["file"])["frf"][0, 0]
    covariance = numpy.zeros((1, 1, len(f), 2, 2))
    covariance[0, 0, :, 0, 0] = covariance[0, 0, :, 1, 1] = columns["magnitude_sigma"] ** 2
    checks = {
        "Frequency": numpy.array_equal(frf["Frequency"], w[:, None]),
        "ResponseData": numpy.array_equal(frf["ResponseData"], h[None, None, :]),
        "CovarianceData": numpy.array_equal(frf["CovarianceData"], covariance),
        "Coherence": numpy.array_equal(frf["Coherence"][:, 0], columns["coherence"]),
        "ResolutionHz": numpy.array_equal(frf["ResolutionHz"][:, 0], columns["resolution_hz"]),
        "Ts": frf["Ts"].item() == 1 / q["rate_hz"],
    }
    texts = {"FrequencyUnit": "rad/s", "InputName": "current", "InputUnit": "A", "OutputName": "position", "OutputUnit": "m"}
    checks |= {n: frf[n].item() == text for n, text in texts.items()}
    frd = as_documented(q["file"])
    checks["FRD"] = numpy.array_equal(frd.frdata[0, 0], h) and numpy.array_equal(frd.omega, w)
    checks["FRD.dt"] = frd.dt == 1 / q["rate_hz"] and (frd.input_labels, frd.output_labels) == (["current"], ["position"])
    return {"rows": len(w), "differences": [n for n, right in checks.items() if not right]}


def as_documented(path):
    """The FRD that the python block of docs/results.md makes of a file."""
    page = (pathlib.Path(__file__).resolve().parents[2] / "docs" / "results.md").read_text()
    blocks = [block.split("```")[0] for block in page.split("```python\n")[1:]]
    (block,) = (block for block in blocks if "import control" in block)
    names = {}
    exec(block.replace('"response.mat"', repr(path)), names)
    return names["frd"]


def frf_parquet(q):
    expected, found = table(q), pandas.read_parquet(q["file"])
    wrong = [n for n in expected if n not in found or not same_bits(expected[n].to_numpy(), found[n].to_numpy())]
    extra = [n for n in found if n not in expected]
    return {"rows": len(found), "differences": wrong + extra}


def frf_uff58(q):
    f, h = response(q)
    s = pyuff.UFF(q["file"]).read_sets()
    s = s[0] if isinstance(s, list) else s
    checks = {
        "real": numpy.allclose(s["data"].real, h.real, rtol=DIGITS, atol=0),
        "imaginary": numpy.allclose(s["data"].imag, h.imag, rtol=DIGITS, atol=0),
        # Nine digits: half a unit of the last one.
        "frequency": numpy.allclose(s["x"], f, rtol=0.5e-8, atol=0),
        "header": (s["func_type"], s["ordinate_axis_units_lab"].strip(), s["orddenom_axis_units_lab"].strip()) == (4, "m", "A"),
    }
    return {"rows": len(s["x"]), "differences": [n for n, right in checks.items() if not right]}


ANSWERS = {
    "csv": as_csv,
    "parquet": as_parquet,
    "mat": as_mat,
    "uff58": as_uff58,
    "uff58_times": uff58_times,
    "frf_mat": frf_mat,
    "frf_parquet": frf_parquet,
    "frf_uff58": frf_uff58,
}

if __name__ == "__main__":
    json.dump([ANSWERS[q["what"]](q) for q in json.load(sys.stdin)], sys.stdout)
