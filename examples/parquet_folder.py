#!/usr/bin/env python3
"""Collects recordings of many benches in one folder of Parquet files, and asks DuckDB about all of them.

    pip install mcap mcap-protobuf-support pyarrow duckdb
    python3 examples/parquet_folder.py add FOLDER RECORDING... [--bench NAME]
    python3 examples/parquet_folder.py query FOLDER runs            (or: largest-error, or any text of SQL)

The folder is partitioned as DuckDB, Spark and pyarrow expect it (Hive): FOLDER/TABLE/bench=NAME/date=YYYY-MM-DD/RUN.parquet.
NAME is the host name in the recording unless --bench gives another one; the date is that of the start of the run, UTC; RUN is the
name of the recording without its extension. A recording that is added again replaces its files.

    table                   a row for each
    runs                    recording: kind, outcome, verdict, configuration, metadata, results
    loop, event, timing     message of the channel, with all its fields in SI units; `time` is its log time
    frf                     frequency of RUN_frf.csv, if this file of `bench chirp` or `bench identify` is beside the recording
"""

import argparse
import datetime
import glob
import json
import os
import pathlib
import re
import sys

import duckdb
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

CHANNELS = ("loop", "event", "timing")
TABLES = ("runs", *CHANNELS, "frf")
BATCH_ROWS = 100_000
TIME = pa.field("time", pa.timestamp("ns", tz="UTC"))

QUERIES = {
    # Kind and verdict of every run. `outcome` is null if the recording has no results, as after a power failure.
    "runs": "SELECT bench, started, run, kind, outcome, verdict FROM runs ORDER BY started, bench",
    # Largest position error of the closed loops of a bench on a day. Bit 1 of `flags`: the loop is closed.
    "largest-error": """
        SELECT bench, date, max(abs(reference_m - position_m)) AS largest_error_m,
               arg_max(run, abs(reference_m - position_m)) AS run, count(DISTINCT run) AS runs
        FROM loop JOIN runs USING (bench, date, run)
        WHERE kind = 'control' AND flags & 1 = 1 AND validity = 'valid'
        GROUP BY bench, date ORDER BY bench, date""",
}


class Refused(Exception):
    """An input that cannot be added or queried; the text says why and what to do."""


def arrow_type(field):
    """Arrow type of a protobuf field. An enumeration is stored by the names of its values."""
    kinds = {
        field.CPPTYPE_DOUBLE: pa.float64(), field.CPPTYPE_FLOAT: pa.float32(), field.CPPTYPE_BOOL: pa.bool_(),
        field.CPPTYPE_INT32: pa.int32(), field.CPPTYPE_INT64: pa.int64(), field.CPPTYPE_STRING: pa.string(),
        field.CPPTYPE_UINT32: pa.uint32(), field.CPPTYPE_UINT64: pa.uint64(), field.CPPTYPE_ENUM: pa.string(),
    }  # fmt: skip
    return kinds[field.cpp_type]


def value(message, field):
    """Value of a field; None if it is absent."""
    if field.has_presence and not message.HasField(field.name):
        return None
    number = getattr(message, field.name)
    return field.enum_type.values_by_number[number].name if field.enum_type else number


class TableFile:
    """A Parquet file in the making. Its name appears when it is complete."""

    def __init__(self, path, schema):
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self.partial = path, path.with_suffix(".partial")
        self.writer = pyarrow.parquet.ParquetWriter(self.partial, schema, compression="zstd")

    def write(self, table):
        self.writer.write_table(table)

    def close(self):
        self.writer.close()
        os.replace(self.partial, self.path)


class ChannelTable:
    """The messages of one channel, written in batches so that a long recording fits in memory."""

    def __init__(self, path, run, descriptor):
        self.run, self.fields = run, list(descriptor.fields)
        columns = [pa.field(field.name, arrow_type(field)) for field in self.fields]
        self.schema = pa.schema([pa.field("run", pa.string()), TIME, *columns])
        self.file, self.rows = TableFile(path, self.schema), []

    def add(self, log_time_ns, message):
        self.rows.append([self.run, log_time_ns, *(value(message, field) for field in self.fields)])
        if len(self.rows) == BATCH_ROWS:
            self.flush()

    def flush(self):
        arrays = [pa.array(column, field.type) for column, field in zip(zip(*self.rows), self.schema)]
        self.file.write(pa.table(arrays, schema=self.schema))
        self.rows = []

    def close(self):
        if self.rows:
            self.flush()
        self.file.close()


def run_row(run, metadata, attachments):
    """The row of a recording in the table `runs`."""
    results = json.loads(attachments.get("results.json", b"{}"))
    started = datetime.datetime.fromisoformat(metadata["started"].replace("Z", "+00:00"))
    return {
        "run": run,
        "started": started,
        "kind": metadata.get("run"),
        "host": metadata.get("host"),
        "program": metadata.get("program"),
        "outcome": results.get("outcome"),
        "verdict": results.get("cnmp"),
        "why": results.get("why"),
        "config_toml": attachments.get("config.toml", b"").decode(),
        "metadata_json": json.dumps(metadata),
        "results_json": json.dumps(results),
    }


RUN_SCHEMA = pa.schema(
    [pa.field(name, pa.timestamp("us", tz="UTC") if name == "started" else pa.string())
     for name in ("run", "started", "kind", "host", "program", "outcome", "verdict", "why", "config_toml", "metadata_json", "results_json")]
)  # fmt: skip


def add(folder, recording, bench):
    """Writes the tables of one recording; its name and its partition."""
    with open(recording, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        metadata = next((record.metadata for record in reader.iter_metadata() if record.name == "bench"), None)
        if metadata is None:
            raise Refused("it is not a recording of `bench`: the metadata record `bench` is missing")
        attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        row = run_row(recording.stem, metadata, attachments)
        response = frequency_response(recording)
        partition = f"bench={checked_name(bench or row['host'])}/date={row['started'].date()}"
        path = lambda table: folder / table / partition / f"{recording.stem}.parquet"
        add_channels(reader, recording.stem, path)
    if response is not None:
        file = TableFile(path("frf"), response.schema)
        file.write(response)
        file.close()
    # Written last: a run in this table has all other tables.
    runs = TableFile(path("runs"), RUN_SCHEMA)
    runs.write(pa.Table.from_pylist([row], RUN_SCHEMA))
    runs.close()
    return partition


def add_channels(reader, run, path):
    tables = {}
    for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
        name = channel.topic.removeprefix("/")
        if name not in CHANNELS:
            continue
        if name not in tables:
            tables[name] = ChannelTable(path(name), run, decoded.DESCRIPTOR)
        tables[name].add(message.log_time, decoded)
    for table in tables.values():
        table.close()


def frequency_response(recording):
    """The frequency response beside a recording as a table; None if there is none."""
    csv = recording.with_name(f"{recording.stem}_frf.csv")
    if not csv.exists():
        return None
    remedy = f"write it again with `bench identify {recording}`, or remove it"
    try:
        table = pyarrow.csv.read_csv(csv)
    except pa.ArrowInvalid as error:
        raise Refused(f"its frequency response {csv} is damaged ({error}); {remedy}") from error
    numeric = (pa.types.is_floating, pa.types.is_integer, pa.types.is_null)
    if not all(any(check(field.type) for check in numeric) for field in table.schema):
        raise Refused(f"its frequency response {csv} is damaged (a column is not numeric); {remedy}")
    return table.add_column(0, "run", pa.array([recording.stem] * len(table)))


def checked_name(name):
    """A name of a bench that is safe as name of a folder."""
    if not name or not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", name):
        raise Refused(f"the name `{name}` of the bench has other characters than letters, digits, `.`, `_` and `-`; give a name with --bench")
    return name


def connect(folder):
    """DuckDB with a view for each table that the folder holds."""
    tables = [table for table in TABLES if any((folder / table).glob("*/*/*.parquet"))]
    if not tables:
        raise Refused(f"{folder} holds no tables; add recordings first")
    database = duckdb.connect()
    for table in tables:
        files = str(folder / table / "*/*/*.parquet").replace("'", "''")
        types = "{'bench': VARCHAR, 'date': DATE}"
        database.sql(f"CREATE VIEW {table} AS FROM read_parquet('{files}', hive_types = {types}, union_by_name = true)")
    return database


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    adds = commands.add_parser("add", help="add recordings to a folder")
    adds.add_argument("folder", type=pathlib.Path)
    adds.add_argument("recordings", nargs="+", type=pathlib.Path, metavar="RECORDING")
    adds.add_argument("--bench", metavar="NAME", help="name of the bench [default: the host name in the recording]")
    asks = commands.add_parser("query", help="ask DuckDB about a folder")
    asks.add_argument("folder", type=pathlib.Path)
    asks.add_argument("query", metavar="QUERY", help=f"{', '.join(QUERIES)}, or text of SQL about the tables {', '.join(TABLES)}")
    asks.add_argument("--csv", action="store_true", help="print the answer as CSV")
    return parser.parse_args()


def main():
    chosen = options()
    if chosen.command == "add":
        failed = [recording for recording in chosen.recordings if not added(chosen, recording)]
        sys.exit(1 if failed else 0)
    try:
        answer = connect(chosen.folder).sql(QUERIES.get(chosen.query, chosen.query))
    except (Refused, duckdb.Error) as error:
        sys.exit(f"parquet_folder: {error}")
    if answer is not None and chosen.csv:
        pyarrow.csv.write_csv(answer.to_arrow_table(), sys.stdout.buffer)
    elif answer is not None:
        answer.show(max_width=200, max_rows=1000)


def added(chosen, recording):
    """Whether the recording was added. The next one is added in any case."""
    try:
        print(f"{recording}: {add(chosen.folder, recording, chosen.bench)}")
        return True
    except (OSError, Refused) as error:
        print(f"parquet_folder: {recording}: {error}", file=sys.stderr)
    except Exception as error:  # A damaged file leads to errors of many types in the readers of MCAP, zstd and protobuf.
        print(f"parquet_folder: {recording} cannot be read ({type(error).__name__}: {error}); repair it with `bench recover`", file=sys.stderr)
    for partial in chosen.folder.glob(f"*/*/*/{glob.escape(recording.stem)}.partial"):
        partial.unlink()
    return False


if __name__ == "__main__":
    main()
