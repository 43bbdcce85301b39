"""Hostile clients without a token, and how fast a stop takes effect meanwhile. Prints the figures; the exit code is 1 if one is missed.

    python3 tests/python/hostile_clients.py [--bench BENCH] [--stops N] [--dead-folder]

A daemon on the simulated stage runs closed loops, one after the other. At the same time there are 60 viewers that never end their
messages, 256 connections from four addresses (silent ones, slow heads and bodies, viewers and downloads that read nothing), a flood of
requests and a flood of connections. Each loop is stopped over TCP, without a token, from one of the addresses of the attackers.
With `--dead-folder` (as root, with FUSE) the file system of the recordings stops answering; then state and stop must still be served.
"""

import argparse
import base64
import ctypes
import http.client
import json
import os
import re
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

ADDRESSES = [f"127.0.0.{last}" for last in range(1, 5)]
MAX_GROWTH_MB = 10.0
MAX_MEDIAN_S, MAX_STOP_S = 0.05, 0.5
LOOP = {"command": "control", "slow": True, "pace": "realtime", "duration": "60s"}
SETTINGS = ["--set", "loop.rate_hz=1000", "--set", "chirp.stop_hz=200", "--set", "interlock.overruns_per_s=1000000"]


class Daemon:
    def __init__(self, bench, folder):
        self.socket = os.path.join(folder, "bench.sock")
        command = [bench, "serve", "--listen", "127.0.0.1:0", "--socket", self.socket, "--out", os.path.join(folder, "recordings")]
        log = os.path.join(folder, "log")
        self.process = subprocess.Popen(command + SETTINGS, stdout=subprocess.PIPE, stderr=open(log, "w"), text=True)
        for line in self.process.stdout:
            found = re.search(r"http://127\.0\.0\.1:(\d+)", line)
            if found:
                self.port = int(found.group(1))
                break
        else:
            sys.exit(f"the daemon did not start: {open(log).read()}")
        threading.Thread(target=self.process.stdout.read, daemon=True).start()

    def ask(self, method, path, body=None, lease=None):
        """Over the socket of this machine, which the attackers do not reach."""
        stream = socket.socket(socket.AF_UNIX)
        stream.settimeout(30)
        stream.connect(self.socket)
        headers = {"Content-Type": "application/json", **({"Bench-Lease": lease} if lease else {})}
        # In one part: a daemon that refuses the head may close the connection before the body is sent.
        text = "" if body is None else json.dumps(body)
        head = [f"{method} /api/v1{path} HTTP/1.1", "Host: localhost", f"Content-Length: {len(text)}"]
        head += [f"{name}: {value}" for name, value in headers.items()]
        stream.sendall("\r\n".join([*head, "", text]).encode())
        answer = http.client.HTTPResponse(stream)
        answer.begin()
        text = answer.read()
        stream.close()
        return answer.status, json.loads(text) if text else None

    def memory_mb(self):
        """After a run of the loop: the smallest values within 3 s, from 5 s after its end on. The threads that analyse a run have a low
        priority, and return its memory, some 8 MB, only after a while."""
        time.sleep(5)
        samples = []
        for _ in range(30):
            samples.append(self.memory_now_mb())
            time.sleep(0.1)
        return {name: min(sample[name] for sample in samples) for name in samples[0]}

    def memory_now_mb(self):
        with open(f"/proc/{self.process.pid}/status") as status:
            found = re.findall(r"(VmRSS|RssAnon):\s+(\d+)", status.read())
        return {name: int(kilobytes) / 1e3 for name, kilobytes in found}


def connect(port, address="127.0.0.1"):
    return socket.create_connection(("127.0.0.1", port), timeout=10, source_address=(address, 0))


def web_socket(opened, path="/api/v1/live"):
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [f"GET {path} HTTP/1.1", "Host: 127.0.0.1", "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}",
             "Sec-WebSocket-Version: 13", "", ""]
    opened.sendall("\r\n".join(lines).encode())
    return opened


class Events(threading.Thread):
    """The times at which the loop leaves the state `running`, as a viewer at the socket of this machine sees them."""

    def __init__(self, daemon):
        super().__init__(daemon=True)
        self.stream = socket.socket(socket.AF_UNIX)
        self.stream.connect(daemon.socket)
        self.bytes = web_socket(self.stream).makefile("rb")
        while self.bytes.readline() != b"\r\n":
            pass
        self.stopped = threading.Event()
        self.time = 0.0
        self.start()

    def run(self):
        while True:
            head = self.bytes.read(2)
            if len(head) < 2:
                return
            length = head[1]
            if length >= 126:
                length = int.from_bytes(self.bytes.read(2 if length == 126 else 8), "big")
            payload = self.bytes.read(length)
            if head[0] & 15 != 1:
                continue
            message = json.loads(payload)
            if message["type"] == "event" and message["kind"] == "state" and message["text"].startswith("running -> "):
                self.time = time.monotonic()
                self.stopped.set()


class Attack:
    """Threads that attack until the end; every error only begins the next attempt."""

    def __init__(self, daemon):
        self.port, self.ends, self.attempts = daemon.port, False, {}
        attacks = [self.fragments] * 4 + [self.slow] * 4 + [self.requests] * 2 + [self.connections]
        self.threads = [threading.Thread(target=self.repeat, args=(attack, n)) for n, attack in enumerate(attacks)]
        for thread in self.threads:
            thread.start()

    def repeat(self, attack, number):
        while not self.ends:
            try:
                attack(ADDRESSES[number % 4])
            except OSError:
                time.sleep(0.02)
            self.attempts[attack.__name__] = self.attempts.get(attack.__name__, 0) + 1

    def fragments(self, address):
        """15 viewers of each address with a message that does not end."""
        piece = b"z" * 1_000_000
        frame = bytes([0x80 | 127]) + struct.pack(">Q", len(piece)) + bytes(4) + piece
        viewers = [web_socket(connect(self.port, address)) for _ in range(15)]
        try:
            for n in range(60):
                for viewer in viewers:
                    viewer.sendall(bytes([0 if n else 1]) + frame)
        finally:
            for viewer in viewers:
                viewer.close()

    def slow(self, address):
        """64 connections of each address: silent, with slow heads and bodies, and with answers that are not read."""
        heads = [
            b"", b"P", b"GET /api/v1/state HTTP/1.1\r\nX: " + b"x" * 7_500,  # a head may have 8 KiB
            b"POST /api/v1/lease HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100000\r\n\r\n" + b"{" * 1000,
            b"GET /api/v1/openapi.json HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 50,
            b"GET /api/v1/recordings HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 50,
            b"GET /api/v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        ]
        opened = []
        try:
            for n in range(64):
                stream = connect(self.port, address)
                opened.append(stream)
                if n % 8 == 7:
                    web_socket(stream, "/api/v1/live?history=true")
                else:
                    stream.sendall(heads[n % 8])
            for _ in range(30):
                time.sleep(0.1)
                if self.ends:
                    return
        finally:
            for stream in opened:
                stream.close()

    def requests(self, address):
        stream = connect(self.port, address)
        for _ in range(100):
            stream.sendall(b"GET /api/v1/state HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 10)
            stream.recv(1 << 16)
        stream.close()

    def connections(self, address):
        for _ in range(100):
            connect(self.port, address).close()

    def end(self):
        self.ends = True
        for thread in self.threads:
            thread.join()


def wait(what, is_reached, seconds=60):
    end = time.monotonic() + seconds
    while not is_reached():
        if time.monotonic() > end:
            sys.exit(f"not within {seconds} s: {what}")
        time.sleep(0.05)


def start_loop(daemon, lease):
    daemon.ask("POST", "/resume", {}, lease)  # needed after a stop
    status, run = daemon.ask("POST", "/runs", LOOP, lease)
    if status != 202:
        sys.exit(f"the loop was not queued: {status} {run}")
    wait("the loop runs", lambda: daemon.ask("GET", "/state")[1]["loop"]["state"] == "running")
    return run["id"]


def send_stop(daemon, address):
    """A stop without a token; its body is never complete. Returns the time of sending."""
    begun = time.monotonic()
    stream = connect(daemon.port, address)
    stream.sendall(b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 20\r\n\r\n{")
    return begun, stream


def stop_time_s(daemon, events, lease, address):
    """From sending a stop to the end of `running`."""
    run = start_loop(daemon, lease)
    time.sleep(0.3)  # until the stage moves
    events.stopped.clear()
    begun, stream = send_stop(daemon, address)
    if not events.stopped.wait(15):
        sys.exit(f"a stop from {address} had no effect within 15 s")
    stream.close()
    wait("the run has ended", lambda: daemon.ask("GET", f"/runs/{run}")[1]["phase"] == "finished")
    return events.time - begun


def renew(daemon, lease, ends):
    while not ends.wait(3):
        daemon.ask("PUT", "/lease", None, lease)


def attacked(daemon, stops):
    """Growth of the memory in MB, and the times of the stops in s."""
    lease = daemon.ask("POST", "/lease", {"operator": "anna"})[1]["lease"]
    ends = threading.Event()
    threading.Thread(target=renew, args=(daemon, lease, ends), daemon=True).start()
    events = Events(daemon)
    for path in ("/openapi.json", "/recordings", "/response", "/config", "/runs"):
        daemon.ask("GET", path)
    for _ in range(3):
        quiet_s = stop_time_s(daemon, events, lease, ADDRESSES[0])
    before = daemon.memory_mb()
    attack = Attack(daemon)
    time.sleep(3)
    times_s = [stop_time_s(daemon, events, lease, ADDRESSES[n % 4]) for n in range(stops)]
    during = daemon.memory_mb()
    attack.end()
    ends.set()
    print(f"attempts: {attack.attempts}; a stop without attackers took {quiet_s * 1e3:.1f} ms")
    return {name: during[name] - before[name] for name in before}, times_s


def dead_folder(daemon, folder):
    """A file system without answers is mounted over the recordings. Returns the slowest of 20 states and stops in s."""
    fuse = os.open("/dev/fuse", os.O_RDWR)
    libc = ctypes.CDLL(None, use_errno=True)
    options = f"fd={fuse},rootmode=40000,user_id=0,group_id=0".encode()
    recordings = os.path.join(folder, "recordings").encode()
    if libc.mount(b"dead", recordings, b"fuse", 0, options) != 0:
        sys.exit(f"FUSE cannot be used: {os.strerror(ctypes.get_errno())}")
    try:
        request = os.read(fuse, 1 << 17)
        unique = struct.unpack_from("<Q", request, 8)[0]
        # FUSE_INIT of protocol 7.31 is answered, nothing else.
        init = struct.pack("<IIIIHHIIHHI28x", 7, 31, 65536, 0, 12, 10, 65536, 1, 32, 0, 0)
        os.write(fuse, struct.pack("<IiQ", 16 + len(init), 0, unique) + init)
        return asked_with_dead_folder(daemon)
    finally:
        libc.umount2(recordings, 2)
        os.close(fuse)


def asked_with_dead_folder(daemon):
    hung = []
    for path in ["/api/v1/recordings", "/api/v1/recordings/a.mcap", "/api/v1/recordings/a.mcap/results",
                 "/api/v1/report?files=a.mcap", "/api/v1/model", "/metrics"] * 4:
        stream = connect(daemon.port)
        stream.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n".encode())
        hung.append(stream)
    time.sleep(1)
    slowest_s = 0.0
    for _ in range(20):
        for method, path in (("GET", "/state"), ("POST", "/stop")):
            begun = time.monotonic()
            if daemon.ask(method, path)[0] != 200:
                sys.exit(f"{path} is not served")
            slowest_s = max(slowest_s, time.monotonic() - begun)
    hung[0].settimeout(30)
    print(f"the list of recordings is answered with {hung[0].recv(12).decode()[9:]}")
    return slowest_s


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bench", default="target/release/bench")
    parser.add_argument("--stops", type=int, default=20)
    parser.add_argument("--dead-folder", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        daemon = Daemon(os.path.abspath(options.bench), folder)
        try:
            growth, times_s = attacked(daemon, options.stops)
            slowest_s = dead_folder(daemon, folder) if options.dead_folder else 0.0
            is_alive = daemon.process.poll() is None
        finally:
            daemon.process.terminate()
            try:
                code = daemon.process.wait(20)
            except subprocess.TimeoutExpired:
                daemon.process.kill()
                code = daemon.process.wait()
    median_s = statistics.median(times_s)
    print(f"memory: {', '.join(f'{name} grew by {mb:.1f} MB' for name, mb in growth.items())} (limit {MAX_GROWTH_MB} MB)")
    print(f"{len(times_s)} stops: median {median_s * 1e3:.1f} ms, longest {max(times_s) * 1e3:.1f} ms "
          f"(limits {MAX_MEDIAN_S * 1e3:.0f} and {MAX_STOP_S * 1e3:.0f} ms)")
    if options.dead_folder:
        print(f"folder without answers: state and stop within {slowest_s * 1e3:.1f} ms")
    print(f"the daemon ended with {code}")
    is_good = is_alive and max(growth.values()) < MAX_GROWTH_MB and median_s < MAX_MEDIAN_S and max(times_s) < MAX_STOP_S
    sys.exit(0 if is_good and slowest_s < MAX_STOP_S else 1)


if __name__ == "__main__":
    main()
