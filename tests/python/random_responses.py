#!/usr/bin/env python3
"""Frequency responses of random stages with known modes and zeros, as other programs write them, without any line of bench.

    random_responses.py SEED COUNT FOLDER numbers       writes FOLDER/response-SEED-K.csv for K = 0 .. COUNT - 1; prints the zeros
                                                        re im re im ... in rad/s, one stage a line
    random_responses.py SEED COUNT FOLDER check BENCH   also runs `BENCH identify --frf` on each, and prints verdicts (right, undecided,
                                                        WRONG), signs and how many of the 95 % intervals contain the true value

The stages are those of random_stages.py. Each response has another unit, form (dB and degrees, magnitude and radians, real and imaginary
part), grid (lines of an analyser, stepped sine), sign of the sensor and delay. Its errors are independent, or coupled between
neighbouring lines as by a Hann window. Every second file states its standard deviations.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np

from random_stages import FAMILIES, stage, zeros

UNITS = [("m_per_a", 1.0), ("um_per_n", 1e6), ("mm_per_v", 1e3)]


def response(modes, f, delay):
    s = 2j * np.pi * f
    return sum(r / (s * s + 2 * z * w * s + w * w) for w, z, r in modes) * np.exp(-s * delay)


def coupled(rng, count, taps):
    white = (rng.standard_normal(count + len(taps)) + 1j * rng.standard_normal(count + len(taps))) / np.sqrt(2)
    return np.convolve(white, taps, "full")[len(taps) : len(taps) + count] / np.linalg.norm(taps)


def form(k, f, h, unit):
    """Heading and columns."""
    if k % 3 == 0:
        return f"f_hz,mag_{unit} (dB),phase_deg", [f, 20 * np.log10(abs(h)), np.degrees(np.unwrap(np.angle(h)))]
    if k % 3 == 1:
        return f"omega_rad_s,magnitude_{unit},phase_rad", [2 * np.pi * f, abs(h), np.angle(h)]
    return f"frequency_hz,real_{unit},imag_{unit}", [f, h.real, h.imag]


def measured(rng, k, path):
    modes, (low, high) = stage(rng, FAMILIES[k % len(FAMILIES)])
    if k % 2 == 0:
        f = np.arange(low, high, rng.uniform(0.02, 0.08))
    else:
        f = low * np.exp(np.arange(0, np.log(high / low), rng.uniform(5e-4, 1.5e-3)))
    delay = rng.uniform(0, 1e-3)
    unit, scale = UNITS[k % len(UNITS)]
    sign = -1 if k % 5 == 4 else 1
    true = response(modes, f, delay)
    taps = [0.25, 1.0, 0.25] if k % 4 == 2 else [1.0]
    part = np.exp(rng.uniform(np.log(1e-4), np.log(2e-3)))
    floor = part * abs(np.median(abs(true))) * np.ones(len(f))
    sigma = np.hypot(floor, 0.3 * part * abs(true))
    h = sign * scale * (true + sigma * np.sqrt(2) * coupled(rng, len(f), taps))
    heading, columns = form(k, f, h, unit)
    if k % 2 == 0:
        heading, columns = heading + ",magnitude_sigma", [*columns, scale * sigma]
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=heading, comments="", fmt="%.9e")
    return {"modes": [[w / 2 / np.pi, z, sign * scale * r] for w, z, r in modes], "zeros": zeros(modes), "f": [f[0], f[-1]]}


def cnmp(truth, widened):
    low, high = truth["f"][0] / widened, truth["f"][1] * widened
    return any(z.real > 0 and z.imag > 0 and low <= abs(z) / 2 / np.pi <= high for z in truth["zeros"])


def check(path, truth, bench):
    out = subprocess.run([bench, "identify", "--frf", path, "--out", path + "-results", "--json"], capture_output=True, text=True)
    if out.returncode:
        return "refused", out.stderr.strip(), [], 0
    answer = json.loads(out.stdout)
    verdict = answer["cnmp"]
    if verdict == "undecided":
        result = "undecided"
    elif verdict == "detected":
        result = "right" if cnmp(truth, 1.05) else "WRONG"
    else:
        result = "WRONG" if cnmp(truth, 0.95) else "right"
    inside, wrong_signs = [], 0
    names = ["frequency_hz", "damping_ratio", "residue"]
    for true in truth["modes"]:
        near = min(answer["modes"], key=lambda m: abs(m["frequency_hz"] / true[0] - 1), default=None)
        if near is None or abs(near["frequency_hz"] / true[0] - 1) > 0.02:
            inside.append(None)
            continue
        deviation = [abs(near[name] - value) / near[name + "_sigma"] for name, value in zip(names, true)]
        inside.append([d <= 1.96 for d in deviation])
        certain = abs(near["residue"]) > 1.96 * near["residue_sigma"]
        wrong_signs += certain and near["residue"] * true[2] < 0
    extra = len(answer["modes"]) - len(truth["modes"])
    return result, f"{answer['why'][:110]} ({extra:+d} modes, chi2 {answer['fit_chi2_per_freedom'] or 0:.2f})", inside, wrong_signs


def main():
    seed, count, folder = int(sys.argv[1]), int(sys.argv[2]), pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    totals, inside, missed, wrong_signs = {}, [], 0, 0
    for k in range(count):
        path = str(folder / f"response-{seed}-{k}.csv")
        truth = measured(np.random.default_rng([seed, k]), k, path)
        if sys.argv[4] == "numbers":
            upper = [z for z in truth["zeros"] if z.imag >= 0]
            print(*(repr(float(part)) for z in upper for part in (z.real, z.imag)))
            continue
        result, why, found, signs = check(path, truth, sys.argv[5])
        totals[result] = totals.get(result, 0) + 1
        inside += [row for row in found if row]
        missed += sum(row is None for row in found)
        wrong_signs += signs
        print(k, result, why)
    if sys.argv[4] == "check":
        print(totals, "modes missed", missed, "wrong signs", wrong_signs)
        print("within the 95 % intervals of", len(inside), "modes: frequency, damping, residue", np.mean(inside, axis=0))


if __name__ == "__main__":
    main()
