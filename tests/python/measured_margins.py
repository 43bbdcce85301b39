#!/usr/bin/env python3
"""Margins of a measured FRF and a controller by python-control.

Reads a JSON array of questions on standard input, prints a JSON array of answers. A question has `frf`, the path of a CSV with
the columns of `bench chirp`, and `config`, the object that `bench config show --json` prints. The controller is that of truth.py,
discretised there. python-control interpolates the response by splines.
"""

import json
import sys

import control
import numpy as np
import truth


def answer(question):
    table = np.genfromtxt(question["frf"], delimiter=",", names=True)
    omega = 2 * np.pi * table["frequency_hz"]
    plant = table["magnitude_m_per_a"] * np.exp(1j * np.radians(table["phase_deg"]))
    config = question["config"]
    law = truth.law_response(config, truth.on_circle(config, omega))
    loop = control.FrequencyResponseData(plant * law, omega, smooth=True)
    gain, phase, distance, w_phase, w_gain, w_distance = control.stability_margins(loop, returnall=True)
    decibels = 20 * np.log10(gain)
    least = np.argmin(distance)
    return {
        "crossings_rad_s": sorted(map(float, w_gain)),
        "phase_margin_deg": float(min(phase, key=abs)),
        "gain_margin_db": float(min(decibels, key=abs)),
        "modulus_margin": float(distance[least]),
        "sensitivity_peak_rad_s": float(w_distance[least]),
        "control_peak_a_per_m": float(np.abs(law / (1 + plant * law)).max()),
        "disturbance_peak_m_per_a": float(np.abs(plant / (1 + plant * law)).max()),
        "complementary_peak": float(np.abs(plant * law / (1 + plant * law)).max()),
    }


json.dump([answer(question) for question in json.load(sys.stdin)], sys.stdout)
