"""Writes the HDF5 and Parquet files of the unit tests of bench-arrays, with h5py 3.16 and pyarrow 26.

usage: array_files.py crates/arrays/tests/files
"""

import sys
from datetime import datetime, timedelta
from decimal import Decimal
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet

folder = Path(sys.argv[1])


def matlab(group, name, values, kind):
    """A variable as MATLAB stores it: the dimensions from the last one on."""
    group.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_(kind)


with h5py.File(folder / "matlab.mat", "w", userblock_size=512) as file:
    matlab(file, "u", np.array([[0.5, -1.5, 2.5]]).T, "double")
    matlab(file, "square", np.array([[1, 2], [3, 4]], dtype=np.int16).T, "int16")
    matlab(file, "z", np.array([[(1.0, -2.0)], [(3.0, 4.0)]], dtype=[("real", "f8"), ("imag", "f8")]), "double")
    matlab(file, "name", np.array([[ord(c)] for c in "N·m"], dtype=np.uint16), "char")
    matlab(file, "flag", np.array([[1]], dtype=np.uint8), "logical")
    matlab(file, "nothing", np.array([0, 0], dtype=np.uint64), "double")
    file["nothing"].attrs["MATLAB_empty"] = np.uint8(1)
    inner = file.create_group("s/inner")
    matlab(inner, "y", np.array([[7.0], [8.0]], dtype=np.float32), "single")
    own = file.create_dataset("#refs#/a", data=np.array([[1.0]]))
    file.create_dataset("c", data=np.array([[own.ref]], dtype=h5py.ref_dtype)).attrs["MATLAB_class"] = np.bytes_("cell")
    file.create_dataset("s/several", data=np.array([[own.ref], [own.ref]], dtype=h5py.ref_dtype))
with open(folder / "matlab.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")

with h5py.File(folder / "latest.h5", "w", libver="latest") as file:
    numbers = np.arange(40.0)
    file.create_dataset("packed", data=numbers, chunks=(16,), compression="gzip", shuffle=True, fletcher32=True)
    file["packed"].attrs["units"] = "um"
    file.create_dataset("square", data=np.array([[1, 2], [3, 4]], dtype=">i4"))
    file.create_dataset("half", data=np.array([0.5, 1.5], dtype=np.float16))
    file.create_dataset("z", data=np.array([1 - 2j, 3 + 4j], dtype=np.complex64))
    file.create_dataset("on", data=np.array([True, False]))
    table = np.zeros(3, dtype=[("t", "<f8"), ("label", "S4"), ("count", ">u2")])
    table["t"], table["count"] = [0.0, 0.1, 0.2], [5, 6, 7]
    file.create_dataset("run/table", data=table)
    file.create_dataset("note", data="run 7")
    file.create_dataset("cube", data=np.zeros((2, 2, 2)))
    file.create_dataset("time", data=np.arange(3.0)).attrs["units"] = "seconds since 2026-11-28"
    file["run/above"] = file["/"]
    file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/x")
    file["gone"] = h5py.SoftLink("/nowhere")

# A thousand billion numbers, none of which is stored.
with h5py.File(folder / "huge.h5", "w") as file:
    file.create_dataset("u", shape=(10**12,), chunks=(1000,), dtype="f8")

start = datetime(2026, 11, 28, 8, 26, 43)
table = pa.table(
    {
        "t": pa.array([0.0, 0.5, 1.0, 1.5, 2.0]),
        "u": pa.array([0.5, None, -1.5, 2.5, 3.5], type=pa.float32()),
        "count": pa.array([1, 2, 3, 4, None], type=pa.int32()),
        "on": pa.array([True, False, True, True, False]),
        "stamp": pa.array([start + timedelta(microseconds=500 * k) for k in range(5)], type=pa.timestamp("us")),
        "label": pa.array(["a", "b", "c", "d", "e"]),
        "parts": pa.array([[1.0], [2.0], [], [3.0], [4.0]]),
        "price": pa.array([Decimal("1.25")] * 5, type=pa.decimal128(7, 2)),
        "s": pa.array([{"y": 10 + k} for k in range(5)]),
    }
)
pyarrow.parquet.write_table(table, folder / "table.parquet", compression="snappy", row_group_size=3)
