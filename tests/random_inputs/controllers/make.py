#!/usr/bin/env python3
"""Writes the valid controllers of tests/random_inputs/controllers.rs into the folder of this script."""

from pathlib import Path

import numpy as np
import scipy.io

folder = Path(__file__).parent
tf = {"num": np.array([2.5, 300.0, 4e4]), "den": np.array([1.0, 800.5, 2e5, 0.0]), "Ts": 0.0}
zpk = {"z": np.array([-1.0]), "p": np.array([0.9 + 0.1j, 0.9 - 0.1j, 1.0]), "k": 0.25, "Ts": 1 / 5000}
ss = {"A": np.array([[-30.0, 400.0], [-400.0, -30.0]]), "B": np.array([[0.0], [1.5]]), "C": np.array([[1e3, 0.0]]), "D": 0.5, "Ts": 0.0}
scipy.io.savemat(folder / "tf-compressed.mat", tf, do_compression=True)
scipy.io.savemat(folder / "zpk.mat", zpk)
scipy.io.savemat(folder / "ss-structure.mat", {"C": ss, "note": "text"})
np.savez(folder / "ss.npz", **ss)
np.savez_compressed(folder / "zpk-compressed.npz", **zpk)
