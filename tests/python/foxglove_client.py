"""An independent client of the Foxglove protocol follows a run of the daemon and compares it with its recording.

    python3 foxglove_client.py BENCH FOLDER

Prints the number of compared messages of each channel. Packages: websockets, protobuf, mcap, mcap-protobuf-support.
"""

import asyncio
import base64
import json
import os
import pathlib
import re
import struct
import subprocess
import sys

import websockets
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

BENCH, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
SETTINGS = ["--set", "loop.rate_hz=5000", "--set", "interlock.overruns_per_s=1000000"]
ENVIRONMENT = {**os.environ, "BENCH_SOCKET": str(FOLDER / "bench.sock")}
CHANNELS = {"/loop": "bench.Loop", "/event": "bench.Event", "/timing": "bench.Timing"}


def message_class(channel):
    """The class of the messages of an advertised channel, from its schema."""
    assert channel["encoding"] == channel["schemaEncoding"] == "protobuf", channel
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))


async def follow(address):
    """Runs a loop; returns the messages of each channel as (log time, fields)."""
    received = {topic: [] for topic in CHANNELS}
    async with websockets.connect(address, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
        topics, classes = {}, {}
        while len(topics) < len(CHANNELS):
            message = json.loads(await socket.recv())
            if message["op"] == "serverInfo":
                assert message["name"] == "bench" and not message.get("capabilities"), message
            for channel in message.get("channels", []):
                assert CHANNELS[channel["topic"]] == channel["schemaName"]
                topics[channel["id"]], classes[channel["id"]] = channel["topic"], message_class(channel)
        subscriptions = [{"id": identity, "channelId": identity} for identity in topics]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        # A client cannot publish: the attempt changes nothing.
        await socket.send(json.dumps({"op": "advertise", "channels": [{"id": 9, "topic": "/loop", "encoding": "json", "schemaName": ""}]}))
        command = [BENCH, "control", "--slow", "--pace", "realtime", "--duration", "3s", "--json"] + SETTINGS
        run = await asyncio.create_subprocess_exec(*command, cwd=FOLDER, env=ENVIRONMENT, stdout=subprocess.PIPE)
        output = asyncio.create_task(run.communicate())
        ended = None
        while ended is None or asyncio.get_running_loop().time() < ended + 1.0:
            if ended is None and output.done():
                ended = asyncio.get_running_loop().time()
            try:
                data = await asyncio.wait_for(socket.recv(), 0.1)
            except TimeoutError:
                continue
            if isinstance(data, bytes) and data[0] == 1:
                identity, log_ns = struct.unpack_from("<IQ", data, 1)
                received[topics[identity]].append((log_ns, classes[identity].FromString(data[13:])))
    return received, json.loads((await output)[0])


def fields(message):
    """The values of a message; the bits of numbers that are not finite differ from themselves, so they become text."""
    return {field.name: repr(value) for field, value in message.ListFields()}


def compare(received, recording):
    with open(recording, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        expected = [(channel.topic, message.log_time, decoded) for _, channel, message, decoded in reader.iter_decoded_messages()]
    for topic in CHANNELS:
        by_time = {}
        for log_ns, message in received[topic]:
            by_time.setdefault(log_ns, []).append(fields(message))
        wanted = [(log_ns, fields(decoded)) for other, log_ns, decoded in expected if other == topic]
        missing = [log_ns for log_ns, values in wanted if values not in by_time.get(log_ns, [])]
        # What is written after the last tick is not part of the loop: the last second of /timing.
        assert len(missing) <= (topic == "/timing"), f"{topic}: {len(missing)} of {len(wanted)} are missing or differ, first at {missing[0]}"
        print(topic, len(wanted) - len(missing))


daemon = subprocess.Popen([BENCH, "serve", "--foxglove", "127.0.0.1:0"] + SETTINGS, cwd=FOLDER, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True)
try:
    address = None
    while address is None:
        found = re.search(r"ws://\S+", daemon.stdout.readline())
        address = found and found.group(0)
    received, result = asyncio.run(follow(address))
    compare(received, FOLDER / result["recording"])
finally:
    daemon.terminate()
    daemon.wait()
