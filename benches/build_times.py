#!/usr/bin/env python3
"""Processor time from an edit to its answer, and of the first builds of a clone.

usage: benches/build_times.py [REVISION]...

Each revision (default: HEAD) is cloned into a temporary folder and built there, so that nothing is shared. Processor time is
that of cargo and of all its children, user and system; a busy machine makes it longer by some 10 to 30 %, because two
threads share a core. The largest memory is that of one process.
"""

import pathlib
import resource
import shlex
import subprocess
import sys
import tempfile

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent

# Title, file that is edited before the command, command.
CASES = [
    ("clone: release build and a chirp", None, "cargo run --release -q -- chirp"),
    ("clone: build of the tests", None, "cargo test -q --no-run"),
    ("clone: run of the tests", None, "cargo test -q"),
    ("edit in identify: its unit tests", "crates/identify/src/frf.rs", "cargo test -q -p bench-identify --lib"),
    ("edit in rt: safety tests", "crates/rt/src/lib.rs", "cargo test -q --test operation safety::"),
    ("edit of the page: program", "crates/daemon/src/page/scope.js", "cargo run -q -- --version"),
    ("edit in own_bench: program", "examples/own_bench/src/damped_integral.rs", "cargo run -q -p own-bench -- --version"),
]


def processor_time_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measured(clone, command):
    """Processor time of a command in seconds; None if it fails."""
    start_s = processor_time_s()
    answer = subprocess.run(shlex.split(command), cwd=clone, stdout=subprocess.DEVNULL)
    if answer.returncode != 0:
        return None
    return processor_time_s() - start_s


def edit(path):
    """A new line at the top: all lines of the file have new numbers, so that its code is compiled again."""
    path.write_text("\n" + path.read_text())


def measure(revision):
    with tempfile.TemporaryDirectory() as folder:
        clone = pathlib.Path(folder) / "bench"
        subprocess.run(["git", "clone", "-q", REPOSITORY, clone], check=True)
        subprocess.run(["git", "checkout", "-q", revision], cwd=clone, check=True)
        for title, file, command in CASES:
            if file is not None:
                if not (clone / file).exists():
                    print(f"{title:36} this revision has no {file}", flush=True)
                    continue
                # The program and the tests of the case exist before the edit.
                measured(clone, command)
                edit(clone / file)
            time_s = measured(clone, command)
            text = "failed" if time_s is None else f"{time_s:8.1f} s"
            print(f"{title:36} {text}", flush=True)
    largest_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"{'largest memory of a process':36} {largest_mb:8.0f} MB", flush=True)


def main():
    for revision in sys.argv[1:] or ["HEAD"]:
        print(f"-- {revision}", flush=True)
        measure(revision)


if __name__ == "__main__":
    main()
