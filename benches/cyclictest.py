"""cyclictest (Debian package rt-tests) with the scheduling of the loop: SCHED_FIFO, locked memory, one thread."""

import re
import subprocess

PRIORITY = 80


def run(rate_hz, seconds):
    """Number of ticks by lateness in whole microseconds, and the largest lateness."""
    command = ["cyclictest", "--mlockall", f"--priority={PRIORITY}", "--threads=1", f"--interval={round(1e6 / rate_hz)}"]
    command += [f"--loops={round(seconds * rate_hz)}", "--quiet", "--histogram=20000"]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    counts = {int(us): int(n) for us, n in re.findall(r"^(\d+)\s+(\d+)$", output, re.MULTILINE) if int(n)}
    return counts, int(re.search(r"Max Latencies:\s*(\d+)", output).group(1))


def quantile(counts, share):
    """The value below which a share of the counts lies, in the middle of its bin of one microsecond."""
    wanted, seen = share * sum(counts.values()), 0
    for value in sorted(counts):
        seen += counts[value]
        if seen >= wanted:
            return value + 0.5
    raise ValueError("no counts")
