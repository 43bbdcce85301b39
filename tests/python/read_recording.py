"""Reads a recording with the public MCAP and protobuf packages only and prints what it holds as one JSON object.

    pip install mcap mcap-protobuf-support
    python3 tests/python/read_recording.py recordings/RUN.mcap [--values] > run.json

With --values every tick is printed too, its doubles as the 16 hexadecimal digits of their bits.
"""

import json
import struct
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

DOUBLES = ("reference_m", "position_m", "requested_a", "command_a")
OPTIONAL = ("actual_a", "raw_position_m", "raw_command_a")
NUMBERS = ("tick", "scheduled_ns", "woke_ns", "done_ns", "probe_sequence", "probe_age_ns", "flags", "missed_ticks")


def bits(value):
    """The 64 bits of a double: float.hex would lose a NaN's payload."""
    return struct.pack(">d", value).hex()


def name(message, field):
    """The name of an enumeration's value, as the embedded schema has it."""
    return message.DESCRIPTOR.fields_by_name[field].enum_type.values_by_number[getattr(message, field)].name


def row(message):
    """One tick, in the order NUMBERS, DOUBLES, OPTIONAL (None if absent), validity, state."""
    numbers = [getattr(message, n) for n in NUMBERS]
    doubles = [bits(getattr(message, n)) for n in DOUBLES]
    optional = [bits(getattr(message, n)) if message.HasField(n) else None for n in OPTIONAL]
    return numbers + doubles + optional + [name(message, "validity"), name(message, "state")]


def event(message):
    """One event, without the fields that are not set."""
    return {field.name: value for field, value in message.ListFields()}


def read(path, with_values):
    """Everything in the recording; only `decode` looks into messages, by the schema in the file."""
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        seen = {"/loop": [], "/event": [], "/timing": []}
        log_offsets_ns = set()
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            seen[channel.topic].append(decoded)
            if channel.topic == "/loop":
                log_offsets_ns.add(message.log_time - decoded.scheduled_ns)
        attachments = {a.name: len(a.data) for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
    ticks = [m.tick for m in seen["/loop"]]
    return {
        "ticks": len(ticks),
        "first_tick": min(ticks, default=None),
        "last_tick": max(ticks, default=None),
        "gaps": [[a, b] for a, b in zip(ticks, ticks[1:]) if b != a + 1],
        "log_offsets_ns": sorted(log_offsets_ns),
        "events": [event(m) for m in seen["/event"]],
        "timings": [event(m) for m in seen["/timing"]],
        "config_bytes": attachments.get("config.toml"),
        "attachments": attachments,
        "metadata": metadata,
        "values": [row(m) for m in seen["/loop"]] if with_values else None,
    }


if __name__ == "__main__":
    json.dump(read(sys.argv[1], "--values" in sys.argv[2:]), sys.stdout)
