"""The loop with many clients of the daemon, beside the same loop alone and cyclictest, in one go.

    python3 benches/daemon_load.py [SECONDS] [BENCH]

`bench control` at 5 kHz in real time runs alone for SECONDS/2 (default of SECONDS: 600), then in a daemon for SECONDS, while 20
clients follow the samples, one of which reads nothing, and 200 requests a second are made. cyclictest (Debian package rt-tests)
runs for SECONDS/2. What runs for SECONDS/2 runs in two halves, before and after the daemon. All with SCHED_FIFO 80 and locked
memory. Run it on an idle machine.
"""

import http.client
import json
import os
import re
import selectors
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import cyclictest

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
BENCH = os.path.abspath(sys.argv[2] if len(sys.argv) > 2 else "target/release/bench")
RATE_HZ = 5000
CLIENTS, REQUESTS_PER_S = 20, 200
PATHS = ("/api/v1/state", "/api/v1/runs", "/api/v1/recordings", "/api/v1/response", "/metrics")
# A stall of the machine is measured; it does not end the run.
SETTINGS = ["--set", f"loop.rate_hz={RATE_HZ}", "--set", f"loop.priority={cyclictest.PRIORITY}", "--set", "interlock.overruns_per_s=1000"]


def control(seconds, folder, connect):
    """Results of a loop with the slow controller."""
    command = [BENCH, "control", "--slow", "--pace", "realtime", "--duration", f"{seconds}s", "--json", "--out", folder]
    answer = subprocess.run(command + ["--connect", connect] + SETTINGS, capture_output=True, text=True)
    if answer.returncode not in (0, 3):  # 3: ticks were missed
        sys.exit(f"{' '.join(command)}\n{answer.stdout}{answer.stderr}")
    return json.loads(answer.stdout)


def figures(result):
    lateness = result["timing"]["lateness_ns"]
    return {
        "p50": lateness["p50"] / 1e3, "p99": lateness["p99"] / 1e3, "max": lateness["max"] / 1e3,
        "not served": 1e6 * result["overruns"] / result["ticks"], "lost records": result["lost_records"],
    }


def cyclictest_figures(seconds):
    counts, largest = cyclictest.run(RATE_HZ, seconds)
    # As the loop counts: a tick that is k periods late has missed k ticks; cyclictest counts it once.
    late = sum(n * int(us * 1e-6 * RATE_HZ) for us, n in counts.items())
    return {
        "p50": cyclictest.quantile(counts, 0.5), "p99": cyclictest.quantile(counts, 0.99), "max": largest,
        "not served": 1e6 * late / sum(counts.values()), "lost records": 0,
    }


class Clients:
    """Clients that follow the samples, and requests."""

    def __init__(self, port):
        self.port, self.ends = port, False
        self.sockets = [self.follow() for _ in range(CLIENTS)]
        self.read_bytes, self.requests, self.refused = 0, 0, 0
        self.threads = [threading.Thread(target=self.read), threading.Thread(target=self.ask)]
        for thread in self.threads:
            thread.start()

    def follow(self):
        opened = socket.create_connection(("127.0.0.1", self.port))
        lines = ["GET /api/v1/live HTTP/1.1", f"Host: 127.0.0.1:{self.port}", "Upgrade: websocket", "Connection: Upgrade",
                 "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Version: 13", "", ""]
        opened.sendall("\r\n".join(lines).encode())
        if b" 101 " not in opened.recv(64):
            sys.exit("the daemon does not upgrade the connection")
        return opened

    def read(self):
        """All but the first client read."""
        selector = selectors.DefaultSelector()
        for opened in self.sockets[1:]:
            selector.register(opened, selectors.EVENT_READ)
        while not self.ends:
            for key, _ in selector.select(0.5):
                self.read_bytes += len(key.fileobj.recv(1 << 16))

    def ask(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.port)
        begun = time.monotonic()
        while not self.ends:
            connection.request("GET", PATHS[self.requests % len(PATHS)])
            answer = connection.getresponse()
            answer.read()
            self.refused += answer.status != 200
            self.requests += 1
            time.sleep(max(0.0, begun + self.requests / REQUESTS_PER_S - time.monotonic()))

    def end(self):
        self.ends = True
        for thread in self.threads:
            thread.join()
        for opened in self.sockets:
            opened.close()


def memory_and_descriptors(pid):
    with open(f"/proc/{pid}/status") as status:
        kilobytes = int(re.search(r"VmRSS:\s+(\d+)", status.read()).group(1))
    return kilobytes / 1e3, len(os.listdir(f"/proc/{pid}/fd"))


def daemon_round(seconds, folder):
    socket_path = os.path.join(folder, "bench.sock")
    command = [BENCH, "serve", "--socket", socket_path, "--listen", "127.0.0.1:0", "--out", os.path.join(folder, "recordings")]
    daemon = subprocess.Popen(command + SETTINGS, stdout=subprocess.PIPE, text=True)
    port = None
    while port is None:
        found = re.search(r"http://127\.0\.0\.1:(\d+)", daemon.stdout.readline())
        port = found and int(found.group(1))
    clients = Clients(port)
    samples, ends = [], threading.Event()

    def watch():
        while not ends.wait(seconds / 60):
            samples.append(memory_and_descriptors(daemon.pid))

    watcher = threading.Thread(target=watch)
    watcher.start()
    result = control(seconds, folder, socket_path)
    ends.set()
    watcher.join()
    clients.end()
    daemon.terminate()
    daemon.wait()
    # The first tenth fills buffers: ten minutes of history.
    rest = samples[len(samples) // 10:]
    print(f"requests: {clients.requests / seconds:.1f} per second, {clients.refused} refused; samples: {clients.read_bytes / seconds / 1e6:.2f} MB/s")
    for name, column in (("memory in MB", 0), ("file descriptors", 1)):
        values = [sample[column] for sample in rest]
        print(f"daemon, {name}: first {values[0]:.1f}, last {values[-1]:.1f}, largest {max(values):.1f}")
    return result


with tempfile.TemporaryDirectory() as folder:
    alone, theirs = [], []
    alone.append(figures(control(SECONDS / 4, folder, "none")))
    theirs.append(cyclictest_figures(SECONDS / 4))
    result = daemon_round(SECONDS, folder)
    served = figures(result)
    alone.append(figures(control(SECONDS / 4, folder, "none")))
    theirs.append(cyclictest_figures(SECONDS / 4))
    scheduling = {name: result["timing"][name] for name in ("policy", "memory_locked", "idle_states_off", "cpu")}
    print(f"scheduling of the loop: {scheduling}")
    for name in served:
        unit = "us" if name in ("p50", "p99", "max") else "of 10^6" if name == "not served" else ""
        columns = [served[name]] + [statistics.mean(rounds[name] for rounds in group) for group in (alone, theirs)]
        print(f"{name:13s} with clients {columns[0]:9.2f}   alone {columns[1]:9.2f}   cyclictest {columns[2]:9.2f} {unit}")
