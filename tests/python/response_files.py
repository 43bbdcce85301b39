#!/usr/bin/env python3
"""The frequency response of a stage as other programs write it, by python-control.

    response_files.py FOLDER     writes the files below; prints the modes: hertz, damping ratio, residue in um/(N s^2), one a line

Two modes with residues of opposite signs, in um/N, with a delay of 0.4 ms and errors of 2e-4 of the static response.

    db.csv           f_hz, magnitude (dB re 1 um/N), phase (deg), as numpy.savetxt writes it, without standard deviations
    sigma.csv        the same with the standard deviation of the magnitude
    plain.frd        frequency, dB and degrees, without names
    three.txt        frequency, magnitude and phase in radians, without names
    parts.csv        real and imaginary part
    negative.csv     the other sign
    conjugated.csv   the other sign of the phase
    radians.csv      radians under the heading of degrees
    inverse.csv      N/um: from displacement to force
    own_unit.csv     in counts/V, a thousand times as many
    zero_sigma.csv, negative_sigma.csv   with a standard deviation that no measurement has
"""

import pathlib
import sys

import control
import numpy as np

MODES = [(30.0, 0.008, 0.5e6), (80.0, 0.006, -0.2e6)]
DELAY_S = 4e-4

folder = pathlib.Path(sys.argv[1])
f = np.arange(1.0, 151.0, 0.1)
stage = sum(
    control.tf([r], [1, 2 * zeta * 2 * np.pi * hz, (2 * np.pi * hz) ** 2]) for hz, zeta, r in MODES
)
magnitude, phase, omega = control.frequency_response(stage, 2 * np.pi * f)
rng = np.random.default_rng(11)
sigma = 1e-4 * abs(control.dcgain(stage)) * np.sqrt(2)
noise = sigma * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f)))
h = np.squeeze(magnitude) * np.exp(1j * (np.squeeze(phase) - omega * DELAY_S)) + noise
db, deg = 20 * np.log10(abs(h)), np.degrees(np.unwrap(np.angle(h)))


def write(name, heading, *columns, delimiter=",", comments="# "):
    table = np.column_stack([np.broadcast_to(column, f.shape) for column in columns])
    np.savetxt(folder / name, table, delimiter=delimiter, header=heading, comments=comments if heading else "", fmt="%.10g")


write("db.csv", "f_hz,Magnitude (dB re 1 um/N),Phase (deg)", f, db, deg)
write("sigma.csv", "f_hz,Magnitude (dB re 1 um/N),Phase (deg),magnitude_sigma", f, db, deg, sigma)
write("plain.frd", "", f, db, deg, delimiter="\t")
write("three.txt", "", f, abs(h), np.angle(h), delimiter=" ")
write("parts.csv", "frequency_hz,real_um_per_n,imag_um_per_n", f, h.real, h.imag, comments="")
write("negative.csv", "f_hz,mag_um_per_n,phase_deg", f, abs(h), np.degrees(np.angle(-h)), comments="")
write("conjugated.csv", "f_hz,mag_um_per_n,phase_deg", f, abs(h), -deg, comments="")
write("radians.csv", "f_hz,mag_um_per_n,phase_deg", f, abs(h), np.angle(h), comments="")
write("inverse.csv", "f_hz,mag_n_per_um,phase_deg", f, 1 / abs(h), -deg, comments="")
write("own_unit.csv", "f_hz,|H| [counts/V],phase_deg", f, 1e3 * abs(h), deg, comments="")
write("zero_sigma.csv", "f_hz,mag,phase_deg,sigma", f, abs(h), deg, np.where(f > 2, sigma, 0), comments="")
write("negative_sigma.csv", "f_hz,mag,phase_deg,sigma", f, abs(h), deg, -sigma, comments="")
for mode in MODES:
    print(*map(repr, mode))
