#!/usr/bin/env python3
"""Computes a tolerance study on the workers of a Dask cluster and prints the joined result as JSON.

    pip install distributed
    python3 examples/dask_study.py --workers 2 --shards 8 -- model study --config xy --vary 'plant.secondary_mass_deviation.*=+-0.15'
    python3 examples/dask_study.py --scheduler tcp://head:8786 --folder /shared/study -- model study ...

The options after `--` are those of `bench model study`. Each shard is one task: `bench model study ... --shard K/N --file FOLDER/K-of-N.study`.
Draw k depends only on the seed and on k, so the output is byte for byte that of `bench model study ... --json` on one machine.

If a worker is lost, Dask gives its shard to another worker, which continues from the file of the shard. The same command started again
continues a study that was interrupted. The folder must have the same path on all workers and on this machine.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys

from distributed import Client, KilledWorker, LocalCluster, as_completed

# The system ends `bench` together with its worker. Otherwise it would hold the lock of the file, and no other worker could continue.
END_WITH_WORKER = ["setpriv", "--pdeathsig", "KILL"]


class ShardFailed(Exception):
    """`bench` refused a shard or did not complete it; the text is its message."""


def compute_shard(command, shard, file):
    """Computes the draws of a shard that are not in its file yet. Runs on a worker."""
    shard_options = ["--shard", shard, "--file", file]
    ended = subprocess.run(END_WITH_WORKER + command + shard_options, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if ended.returncode != 0:
        raise ShardFailed(f"shard {shard}: exit code {ended.returncode}: {ended.stderr.strip()}")
    return shard


def compute_study(client, command, shards, folder):
    """Computes all shards on the cluster; the files of the shards."""
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"{k}/{shards}" for k in range(1, shards + 1)]
    files = [str(folder / f"{k}-of-{shards}.study") for k in range(1, shards + 1)]
    # `pure=False`: a shard is computed although an earlier task of this cluster had the same arguments.
    tasks = client.map(compute_shard, [command] * shards, names, files, pure=False)
    for count, task in enumerate(as_completed(tasks), 1):
        print(f"shard {task.result()} is complete ({count} of {shards})", file=sys.stderr)
    return files


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=positive, help="number of workers on this machine [default: one for each processor]")
    where.add_argument("--scheduler", metavar="ADDRESS", help="scheduler of an existing cluster, such as tcp://head:8786")
    parser.add_argument("--shards", type=positive, default=8, help="number of shards [default: 8]")
    parser.add_argument("--folder", type=pathlib.Path, default="study-shards", help="folder of the shard files [default: study-shards]")
    parser.add_argument("--bench", default="bench", help="the program, on the workers and on this machine [default: bench]")
    parser.add_argument("study", nargs="+", metavar="OPTION", help="after `--`: model study and its options")
    chosen = parser.parse_args()
    if chosen.study[:2] != ["model", "study"]:
        parser.error(f"after `--` the command must begin with `model study`, not `{' '.join(chosen.study[:2])}`")
    return chosen


def positive(text):
    number = int(text)
    if number < 1:
        raise ValueError("less than 1")
    return number


def connect(chosen):
    """A client of the existing cluster, or of a new one on this machine."""
    if chosen.scheduler:
        return Client(chosen.scheduler)
    workers = chosen.workers or os.cpu_count()
    return Client(LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None))


def main():
    chosen = options()
    bench = shutil.which(chosen.bench)
    if bench is None:
        sys.exit(f"dask_study: the program `{chosen.bench}` was not found; give its path with --bench")
    # A cluster starts one process on each processor, so each of them uses one thread.
    threads = [] if "--threads" in chosen.study else ["--threads", "1"]
    command = [os.path.abspath(bench), *chosen.study, *threads]
    try:
        with connect(chosen) as client:
            files = compute_study(client, command, chosen.shards, chosen.folder.resolve())
    except (ShardFailed, KilledWorker, OSError) as failure:
        sys.exit(f"dask_study: {failure}")
    sys.exit(subprocess.run([command[0], "model", "study", "--json", "--join", *files]).returncode)


if __name__ == "__main__":
    main()
