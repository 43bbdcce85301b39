"""An independent client of the Foxglove protocol follows a run of the daemon and compares it with its recording.

    python3 foxglove_client.py BENCH FOLDER

Prints the number of compared messages of each channel, and how many of them a second client lost that did not read at first. Packages: websockets, protobuf, mcap, mcap-protobuf-support.
"""

import asyncio
import base64
import json
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys

import websockets
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

BENCH, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
# A rate at which a busy machine, too, decodes the messages as fast as they come.
SETTINGS = ["--set", "loop.rate_hz=2000", "--set", "interlock.overruns_per_s=1000000"]
ENVIRONMENT = {**os.environ, "BENCH_SOCKET": str(FOLDER / "bench.sock")}
CHANNELS = {"/loop": "bench.Loop", "/event": "bench.Event", "/timing": "bench.Timing"}
PROTOCOLS = ["foxglove.sdk.v1"]
# Binary message with the data of a subscription; level of a status.
MESSAGE_DATA, ERROR = 1, 2
# Requests to change something, and the capability that a server would need.
REQUESTS = {
    json.dumps({"op": "advertise", "channels": [{"id": 9, "topic": "/loop", "encoding": "json", "schemaName": ""}]}): "clientPublish",
    json.dumps({"op": "setParameters", "parameters": [{"name": "loop.rate_hz", "value": 1}]}): "parameters",
    json.dumps({"op": "fetchAsset", "uri": "file:///etc/hostname", "requestId": 1}): "assets",
}
# Ticks of the loop between two runs whose times are within the run: 10 ms.
MAX_OTHER_TICKS = 20
# Messages of the loop after the run, behind which no message of the run is late.
MORE_MESSAGES = 5000
# Messages for which the second client does not read: more than the queue of the server.
STALLED_TICKS = 25_000


def message_class(channel):
    """The class of the messages of an advertised channel, from its schema."""
    assert channel["encoding"] == channel["schemaEncoding"] == "protobuf", channel
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))


async def subscribe(client):
    """Checks server and channels; returns topic and class of the messages of each subscription."""
    topics, classes = {}, {}
    while len(topics) < len(CHANNELS):
        message = json.loads(await client.recv())
        if message["op"] == "serverInfo":
            assert message["name"] == "bench" and not message.get("capabilities"), message
        for channel in message.get("channels", []):
            assert CHANNELS[channel["topic"]] == channel["schemaName"]
            topics[channel["id"]], classes[channel["id"]] = channel["topic"], message_class(channel)
    subscriptions = [{"id": identity, "channelId": identity} for identity in topics]
    await client.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
    return topics, classes


async def check_read_only(client):
    """The server refuses every request to change something."""
    for request, capability in REQUESTS.items():
        await client.send(request)
        while isinstance(answer := await client.recv(), bytes):
            pass
        answer = json.loads(answer)
        assert answer["op"] == "status" and answer["level"] == ERROR and capability in answer["message"], answer


def stalled_connection(address):
    """A client that reads only when it is asked to; nearly everything waits at the server. It cannot answer pings either."""
    host, port = address.removeprefix("ws://").split(":")
    connection = socket.socket()
    # A small window: what waits in the buffers of the system is then little.
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect((host, int(port)))
    return websockets.connect(address, sock=connection, subprotocols=PROTOCOLS, max_size=None, max_queue=1, ping_interval=None)


def decoded(data, channels):
    """Topic, log time and fields of a message; `None` for all others."""
    if not isinstance(data, bytes) or data[0] != MESSAGE_DATA:
        return None
    topics, classes = channels
    identity, log_ns = struct.unpack_from("<IQ", data, 1)
    return topics[identity], log_ns, fields(classes[identity].FromString(data[13:]))


def fields(message):
    """The values of a message; as text, because a value that is not a number differs from itself, and -0 equals 0."""
    return tuple((field.name, repr(value)) for field, value in message.ListFields())


async def follow(address):
    """Runs a loop; returns the messages that a client received, those of a client that did not read, and the result of the run."""
    received = []
    async with websockets.connect(address, subprotocols=PROTOCOLS, max_size=None, ping_interval=None) as client, stalled_connection(address) as stalled:
        stalled_channels, channels = await subscribe(stalled), await subscribe(client)
        await check_read_only(client)
        command = [BENCH, "control", "--slow", "--pace", "realtime", "--duration", "6s", "--json"] + SETTINGS
        run = await asyncio.create_subprocess_exec(*command, cwd=FOLDER, env=ENVIRONMENT, stdout=subprocess.PIPE)
        output = asyncio.create_task(run.communicate())
        result, after_end = None, 0
        while len(received) < STALLED_TICKS or after_end < MORE_MESSAGES:
            message = decoded(await client.recv(), channels)
            if message:
                received.append(message)
            if output.done() and result is None:
                result = json.loads(output.result()[0])
                end_ns = last_log_ns(FOLDER / result["recording"])
            after_end += bool(message and result and message[1] > end_ns)
        late = await read_until(stalled, stalled_channels, max(log_ns for _, log_ns, _ in received))
    return received, late, result


def last_log_ns(recording):
    """Log time of the last message of a recording."""
    with open(recording, "rb") as stream:
        return make_reader(stream).get_summary().statistics.message_end_time


async def read_until(client, channels, end_ns):
    """The messages that the server still has for a client, until a log time."""
    late = []
    while not late or late[-1][1] < end_ns:
        message = decoded(await client.recv(), channels)
        if message:
            late.append(message)
    return late


def compare(received, recording):
    """Every message of the recording was received, in its order, and during the run nearly no tick that is not in it."""
    with open(recording, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        recorded = [(channel.topic, message.log_time, fields(content)) for _, channel, message, content in reader.iter_decoded_messages()]
    seen = set(received)
    for topic in CHANNELS:
        wanted = [message for message in recorded if message[0] == topic]
        missing = [message for message in wanted if message not in seen]
        assert not missing, f"{topic}: {len(missing)} of {len(wanted)} are missing or differ, first {missing[0]}"
        print(topic, len(wanted))
    ticks = [message for message in recorded if message[0] == "/loop"]
    first_ns, last_ns = ticks[0][1], ticks[-1][1]
    during = [message for message in received if message[0] == "/loop" and first_ns <= message[1] <= last_ns]
    following = iter(during)
    assert all(tick in following for tick in ticks), "the ticks of the run are not in the order of the recording"
    # The last ticks of the loop before the run and the first ones after it may have times of the run, up to 10 ms.
    others = len(during) - len(ticks)
    assert others <= MAX_OTHER_TICKS, f"{others} ticks that are not in the recording were received in the time of the run"


def compare_late(late, received):
    """A client that does not read may lose messages; the others have the values and the order of a client that reads."""
    times = [log_ns for _, log_ns, _ in received]
    late = [message for message in late if times[0] <= message[1] <= max(times)]
    following = iter(received)
    assert late and all(message in following for message in late), "a client that does not read got other messages"
    print("lost", len(received) - len(late))


def check_nothing_dropped():
    """The live view, which feeds the server, has not waited for any client."""
    with socket.socket(socket.AF_UNIX) as daemon:
        daemon.connect(ENVIRONMENT["BENCH_SOCKET"])
        daemon.sendall(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        metrics = daemon.makefile().read()
    assert re.search(r"^bench_live_dropped_total 0$", metrics, re.MULTILINE), metrics


daemon = subprocess.Popen([BENCH, "serve", "--foxglove", "127.0.0.1:0"] + SETTINGS, cwd=FOLDER, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True)
try:
    address = None
    while address is None:
        found = re.search(r"ws://\S+", daemon.stdout.readline())
        address = found and found.group(0)
    received, late, result = asyncio.run(follow(address))
    compare(received, FOLDER / result["recording"])
    compare_late(late, received)
    check_nothing_dropped()
finally:
    daemon.terminate()
    daemon.wait()
