"""Writes a record as the files of other programs: the columns of a CSV file with scipy, numpy, h5py, pyarrow and pyuff.

usage: record_files.py CSV FOLDER
"""

import sys
from pathlib import Path

import h5py
import numpy as np
import pyarrow
import pyarrow.parquet
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


def matlab_dataset(group, name, values):
    """A column as `save` of MATLAB with `-v7.3` writes it: the dimensions from the last one on, packed in chunks."""
    stored = group.create_dataset(name, data=np.atleast_2d(values), chunks=True, compression="gzip", compression_opts=3)
    stored.attrs["MATLAB_class"] = np.bytes_("double")


def hdf5_files(columns, folder):
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Thu Nov 26 12:40:48 2026 HDF5 schema 1.00 ."
    with h5py.File(folder / "v73.mat", "w", userblock_size=512) as file:
        rec = file.create_group("rec")
        rec.attrs["MATLAB_class"] = np.bytes_("struct")
        for name in NAMES:
            matlab_dataset(rec, name, columns[name])
        matlab_dataset(file, "data", np.array(list(columns.values())))
        text = file.create_dataset("note", data=np.array([[ord(c)] for c in "run 7"], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        cell = file.create_dataset("#refs#/a", data=np.array([[1.0]]))
        references = file.create_dataset("cell", data=np.array([[cell.ref]], dtype=h5py.ref_dtype))
        references.attrs["MATLAB_class"] = np.bytes_("cell")
    with open(folder / "v73.mat", "r+b") as file:
        file.write(header.ljust(116) + bytes(8) + b"\x00\x02IM")
    with h5py.File(folder / "plain.h5", "w", libver="latest") as file:
        for name in NAMES:
            file.create_dataset(name, data=columns[name], chunks=True, compression="gzip", shuffle=True, fletcher32=True)
    with h5py.File(folder / "structured.h5", "w") as file:
        table = np.zeros(len(columns["time_s"]), dtype=[(name, ">f8") for name in NAMES])
        for name in NAMES:
            table[name] = columns[name]
        file.create_dataset("rec", data=table)
        file["again"] = h5py.SoftLink("/rec")
        file["round"] = file["/"]
    with h5py.File(folder / "matrix.h5", "w") as file:
        file.create_dataset("data", data=np.column_stack(list(columns.values())))


def parquet_files(columns, folder):
    for file, compression in [("snappy.parquet", "snappy"), ("zstd.parquet", "zstd"), ("gzip.parquet", "gzip")]:
        table = pyarrow.table(columns)
        pyarrow.parquet.write_table(table, folder / file, compression=compression, row_group_size=1500)
    start = np.datetime64("2026-11-28T08:26:43", "ns")
    stamps = start + np.rint(columns["time_s"] * 1e9).astype("timedelta64[ns]")
    table = pyarrow.table(dict(columns, time_s=stamps))
    pyarrow.parquet.write_table(table, folder / "stamps.parquet")


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


def labview_files(columns, folder):
    """Measurement files as the specification of National Instruments describes them: without a column of times, and with one and a decimal comma."""
    time, force, position = (columns[name] for name in NAMES)
    step = time[1] - time[0]
    for file, with_times, decimal in [("steps.lvm", "No", "."), ("comma.lvm", "One", ",")]:
        head = [
            "LabVIEW Measurement\t",
            "Separator\tTab",
            f"Decimal_Separator\t{decimal}",
            "Multi_Headings\tNo",
            f"X_Columns\t{with_times}",
            "***End_of_Header***\t",
            "\t",
            "Channels\t2\t\t",
            f"Samples\t{len(time)}\t{len(time)}\t",
            "Y_Unit_Label\tNewton\tMeter\t",
            "X_Dimension\tTime\tTime\t",
            f"X0\t{time[0]:.16E}\t{time[0]:.16E}\t",
            f"Delta_X\t{step:.6E}\t{step:.6E}\t",
            "***End_of_Header***\t\t\t",
            f"X_Value\t{NAMES[1]}\t{NAMES[2]}\tComment",
        ]
        times = [f"{t:.9g}" if with_times == "One" else "" for t in time]
        rows = [f"{t}\t{u!r}\t{y!r}" for t, u, y in zip(times, force.tolist(), position.tolist())]
        head = [line if line.startswith("Decimal") else line.replace(".", decimal) for line in head]
        text = [*head, *(row.replace(".", decimal) for row in rows)]
        (folder / file).write_bytes("".join(line + "\r\n" for line in text).encode())


def main():
    csv, folder = Path(sys.argv[1]), Path(sys.argv[2])
    numbers = np.loadtxt(csv, delimiter=",", skiprows=1)
    columns = {name: numbers[:, k] for k, name in enumerate(NAMES)}
    mat_files(columns, folder)
    numpy_files(columns, folder)
    hdf5_files(columns, folder)
    parquet_files(columns, folder)
    universal_files(columns, folder)
    labview_files(columns, folder)


main()
