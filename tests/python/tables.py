#!/usr/bin/env python3
"""Whether a CSV file and a Parquet file hold the same table, read by programs of other hands (csv, pyarrow).

Reads a JSON array of questions on standard input, prints a JSON array of answers. Questions have `csv` and `parquet`.
"""

import csv
import json
import math
import sys

import pyarrow.parquet


def same(cell, value):
    if value is None or cell == "":
        return cell == "" and value is None
    return float(cell) == value or math.isnan(float(cell)) and math.isnan(value)


def tables(q):
    with open(q["csv"]) as file:
        header, *rows = csv.reader(file)
    table = pyarrow.parquet.read_table(q["parquet"])
    columns = [column.to_pylist() for column in table.columns]
    differences = [] if header == table.column_names else [f"{header} for {table.column_names}"]
    if table.num_rows != len(rows):
        differences.append(f"{len(rows)} rows for {table.num_rows}")
    for number, row in enumerate(rows):
        values = [column[number] for column in columns]
        if not all(same(cell, value) for cell, value in zip(row, values, strict=True)):
            differences.append(f"row {number}: {row} for {values}")
    nulls = any(value is None for column in columns for value in column)
    return {"rows": table.num_rows, "differences": differences[:5], "has_nulls": nulls}


if __name__ == "__main__":
    json.dump([tables(q) for q in json.load(sys.stdin)], sys.stdout)
