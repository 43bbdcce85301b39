"""Writes a record as the files of other programs: the columns of a CSV file with scipy, numpy and pyuff.

usage: record_files.py CSV FOLDER
"""

import sys
from pathlib import Path

import numpy as np
import pyuff
from scipy.io import savemat

NAMES = ["time_s", "force_n", "position_m"]


def mat_files(columns, folder):
    savemat(folder / "row.mat", columns, oned_as="row")
    savemat(folder / "column.mat", columns, oned_as="column", do_compression=True)
    savemat(folder / "struct.mat", {"rec": columns, "note": "run 7"}, do_compression=True)
    matrix = np.column_stack(list(columns.values()))
    savemat(folder / "matrix.mat", {"data": matrix, "fs": 1000.0})
    savemat(folder / "lying.mat", {"data": matrix.T})
    single = dict(columns, time_s=columns["time_s"].astype(np.float32))
    savemat(folder / "single.mat", single)


def numpy_files(columns, folder):
    np.savez(folder / "plain.npz", **columns)
    np.savez_compressed(folder / "compressed.npz", **columns)
    table = np.zeros(len(columns["time_s"]), dtype=[(name, "f8") for name in NAMES])
    for name in NAMES:
        table[name] = columns[name]
    np.save(folder / "structured.npy", table)
    np.savez(folder / "structured.npz", rec=table)
    big = [(name, ">f8") for name in NAMES]
    np.save(folder / "big_endian.npy", table.astype(big))
    matrix = np.column_stack(list(columns.values()))
    np.save(folder / "matrix.npy", matrix)
    np.save(folder / "fortran.npy", np.asfortranarray(matrix))


def dataset(columns, name, node, binary, even):
    return {
        "type": 58,
        "binary": binary,
        "func_type": 1,
        "id1": "NONE",
        "rsp_node": node,
        "rsp_dir": 3,
        "ref_node": 1,
        "ref_dir": 3,
        "abscissa_spacing": even,
        "abscissa_spec_data_type": 17,
        "abscissa_axis_units_lab": "s",
        "ordinate_spec_data_type": 1,
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
        "x": columns["time_s"],
        "data": columns[name],
    }


def universal_files(columns, folder):
    for file, binary, even in [
        ("text.uff", 0, 1),
        ("binary.uff", 1, 1),
        ("uneven.uff", 1, 0),
    ]:
        sets = [dataset(columns, NAMES[node], node, binary, even) for node in (1, 2)]
        # "overwrite" loses the header of a binary dataset.
        pyuff.UFF(str(folder / file)).write_sets(sets, "add")


def main():
    csv, folder = Path(sys.argv[1]), Path(sys.argv[2])
    numbers = np.loadtxt(csv, delimiter=",", skiprows=1)
    columns = {name: numbers[:, k] for k, name in enumerate(NAMES)}
    mat_files(columns, folder)
    numpy_files(columns, folder)
    universal_files(columns, folder)


main()
