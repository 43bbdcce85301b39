"""Identifies measured records of others, which are public, with `bench identify` and, as a second estimate, by LSCF.

    python3 -m pip install numpy sdypy-EMA
    python3 benches/real_records.py FOLDER [--bench target/release/bench]

The records are those of the package pyFRF 1.1.1 (J. Slavic, University of Ljubljana, 2019; MIT license), which is fetched from PyPI into
FOLDER: blows of a hammer on a structure with many lightly damped modes, force and acceleration at 51.2 kHz for 1 s, the blow after 1 ms.
The first of five blows overloads the channel of the force and is left out.

`bench identify` gets each blow alone, the band and the kind of the output. LSCF (P. Guillaume et al., 2003, by sdypy-EMA) gets H1 of the
four blows together; its poles are those that most orders from 20 to 60 have in common, with the median over these orders.

For each mode that LSCF has: frequency and damping ratio of LSCF, the mean over the blows of `bench`, the standard deviation over the
blows, and the mean standard deviation that `bench` states. Blows are independent, so both should be alike where the structure does not
change between them.
"""

import argparse
import hashlib
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import urllib.parse
import urllib.request

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np
from sdypy.EMA import Model

ROOT = pathlib.Path(__file__).resolve().parent.parent
INDEX, ARCHIVE = "https://pypi.org/simple/pyfrf/", "pyfrf-1.1.1.tar.gz"
DIGEST = "3616487946ad22e4e04b4fb400a3d69ab71a36df7b107a872269860cbee8acfa"
MEMBER = "pyfrf-1.1.1/data/impact2_response0.lvm"
RATE_HZ = 51_200.0
FIRST_BLOW = 1  # number 0 reaches the limit of the force channel, 2000 N
ORDERS = range(20, 61)
SAME_HZ, SAME_DAMPING = 0.003, 0.3  # ratios within which the poles of two orders are the same


def blows(folder):
    """Force in newtons and acceleration in m/s^2 of each blow, an array of samples."""
    path = folder / "impact2.lvm"
    if not path.exists():
        page = urllib.request.urlopen(INDEX, timeout=60).read().decode()
        address = re.search(rf'href="([^"#]*{re.escape(ARCHIVE)})', page)[1]
        archive = urllib.request.urlopen(urllib.parse.urljoin(INDEX, address), timeout=60).read()
        if hashlib.sha256(archive).hexdigest() != DIGEST:
            sys.exit(f"{ARCHIVE} is not the archive that this script was written for")
        path.write_bytes(tarfile.open(fileobj=io.BytesIO(archive)).extractfile(MEMBER).read())
    # A header of the file, then one of each blow with the names of its columns.
    for part in path.read_text().split("***End_of_Header***")[2:]:
        rows = [line.split("\t")[1:3] for line in part.splitlines()[2:] if re.match(r"\t-?\d", line)]
        yield np.array(rows, dtype=float)


def of_bench(bench, blow, number, band_hz, folder):
    """Rows of frequency, damping ratio and their standard deviations, and the answer."""
    path = folder / f"blow-{number}.csv"
    times = np.arange(len(blow)) / RATE_HZ
    np.savetxt(path, np.column_stack([times, blow]), delimiter=",", header="time_s,force_n,acceleration_m_per_s2", comments="", fmt="%.9g")
    columns = ["--time", "time_s", "--input", "force_n", "--output", "acceleration_m_per_s2", "--output-kind", "acceleration"]
    command = [bench, "identify", str(path), *columns, "--band", f"{band_hz[0]}:{band_hz[1]}", "--json", "--out", str(folder / "results")]
    out = subprocess.run(command, capture_output=True, text=True)
    if out.returncode:
        sys.exit(out.stderr)
    answer = json.loads(out.stdout)
    names = ("frequency_hz", "damping_ratio", "frequency_hz_sigma", "damping_ratio_sigma")
    return np.array([[mode[name] for name in names] for mode in answer["modes"]]).reshape(-1, 4), answer


def response(records):
    """H1 of the records, each of which is at rest at both ends."""
    spectra = [np.fft.rfft(record - record[-2000:].mean(axis=0), axis=0) for record in records]
    force, acceleration = (np.array([spectrum[:, k] for spectrum in spectra]) for k in range(2))
    h1 = np.sum(acceleration * force.conj(), axis=0) / np.sum(abs(force) ** 2, axis=0)
    return np.fft.rfftfreq(len(records[0]), 1 / RATE_HZ)[1:], h1[1:]


def of_lscf(records, band_hz):
    """Rows of frequency, damping ratio, and the part of all orders that have the pole."""
    frequency_hz, accelerance = response(records)
    model = Model(accelerance, frequency_hz, lower=band_hz[0], upper=band_hz[1], pol_order_high=ORDERS[-1], frf_form="accelerance")
    model.get_poles(method="lscf", show_progress=False)
    found = []
    for order in ORDERS:
        poles = np.asarray(model.all_poles[order - 1])
        poles = poles[(poles.imag > 0) & (poles.real < 0)]
        found.append(np.column_stack([abs(poles) / (2 * np.pi), -poles.real / abs(poles)]))
    rows, last = [], found[-1]
    for hz, zeta in last[(last[:, 0] > band_hz[0]) & (last[:, 0] < band_hz[1])]:
        same = []
        for poles in found:
            near = poles[np.argmin(abs(poles[:, 0] - hz))]
            if abs(near[0] / hz - 1) < SAME_HZ and abs(near[1] / zeta - 1) < SAME_DAMPING:
                same.append(near)
        row = [*np.median(same, axis=0), len(same) / len(found)]
        is_known = any(abs(other[0] / row[0] - 1) < SAME_HZ for other in rows)
        if row[2] > 0.5 and not is_known:
            rows.append(row)
    return np.array(sorted(rows)).reshape(-1, 3)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--bench", default=str(ROOT / "target/release/bench"))
    parser.add_argument("--band", default="200:1000", metavar="LOW:HIGH")
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    band_hz = tuple(float(end) for end in chosen.band.split(":"))
    records = list(blows(chosen.folder))[FIRST_BLOW:]
    modes = []
    for number, record in enumerate(records, FIRST_BLOW):
        rows, answer = of_bench(chosen.bench, record, number, band_hz, chosen.folder)
        modes.append(rows)
        print(f"blow {number}: {len(rows)} modes, chi-square {answer['fit_chi2_per_freedom']:.3g}, {answer['cnmp']}: {answer['why'][:300]}")
    print("\nfrequency Hz: LSCF, bench, over the blows, stated    damping ratio: LSCF, bench, over the blows, stated   orders")
    for hz, zeta, part in of_lscf(records, band_hz):
        near = [rows[np.argmin(abs(rows[:, 0] - hz))] for rows in modes if len(rows)]
        near = np.array([row for row in near if abs(row[0] / hz - 1) < 0.01])
        if len(near) < 2:
            print(f"{hz:9.3f}  not found by bench                         {zeta:.5f}                                    {100 * part:4.0f} %")
            continue
        mean, over = near.mean(axis=0), near.std(axis=0, ddof=1)
        frequency = f"{hz:9.3f} {mean[0]:9.3f} {over[0]:7.3f} {mean[2]:7.3f}"
        damping = f"{zeta:.5f} {mean[1]:.5f} {over[1]:.5f} {mean[3]:.5f}"
        print(f"{frequency}      {damping}     {100 * part:4.0f} %  {len(near)} of {len(modes)} blows")


if __name__ == "__main__":
    main()
