"""Damages and rewrites recordings with the public package `mcap` only.

    pip install mcap
    python3 tests/python/damage.py flips RUN.mcap SEED COUNT    JSON: COUNT damages, and what is intact after each
    python3 tests/python/damage.py rewrite RUN.mcap NEW.mcap zstd|lz4|none|unchunked
    python3 tests/python/damage.py external NEW.mcap
    python3 tests/python/damage.py old_reading RUN.mcap NEW.mcap TICK AGE_NS
"""

import io
import json
import random
import sys

from mcap.reader import SeekingReader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

LOOP = "/loop"


def chunk_at(data, offset):
    """The chunk record at an offset; an error if it is not intact."""
    stream = StreamReader(io.BytesIO(data[offset:]), skip_magic=True, emit_chunks=True, validate_crcs=True)
    record = next(stream.records)
    return record if isinstance(record, Chunk) else None


def loop_ticks(data, index, channel, decode):
    """The ticks in one chunk; none if python's reader refuses it."""
    try:
        chunk = chunk_at(data, index.chunk_start_offset)
        records = breakup_chunk(chunk, validate_crc=True)
    except Exception:  # any refusal, whatever the damage makes of it
        return []
    return [decode(r.data).tick for r in records if isinstance(r, Message) and r.channel_id == channel]


def flips(path, seed, count):
    """Bits to flip, each with the ticks that are in no intact chunk after it."""
    original = open(path, "rb").read()
    summary = SeekingReader(io.BytesIO(original)).get_summary()
    (channel,) = [c for c in summary.channels.values() if c.topic == LOOP]
    schema = summary.schemas[channel.schema_id]
    decode = DecoderFactory().decoder_for(channel.message_encoding, schema)
    ticks = {i.chunk_start_offset: loop_ticks(original, i, channel.id, decode) for i in summary.chunk_indexes}
    generator = random.Random(seed)
    found = []
    for _ in range(count):
        byte, bit = generator.randrange(len(original)), generator.randrange(8)
        damaged = bytearray(original)
        damaged[byte] ^= 1 << bit
        absent = []
        for index in summary.chunk_indexes:
            begin = index.chunk_start_offset
            if begin <= byte < begin + index.chunk_length:
                intact = loop_ticks(bytes(damaged), index, channel.id, decode)
                absent += sorted(set(ticks[begin]) - set(intact))
        found.append({"byte": byte, "bit": bit, "absent": absent})
    return {"flips": found, "ticks": sum(map(len, ticks.values()))}


def rewrite(path, to, way):
    """The same messages, attachments and metadata, as python's writer writes them."""
    options = {
        "zstd": {},  # its default
        "lz4": {"compression": CompressionType.LZ4},
        "none": {"compression": CompressionType.NONE},
        "unchunked": {"use_chunking": False},
    }[way]
    with open(path, "rb") as stream, open(to, "wb") as out:
        reader = SeekingReader(stream, validate_crcs=True)
        writer = Writer(out, **options)
        writer.start()
        for m in reader.iter_metadata():
            writer.add_metadata(m.name, m.metadata)
        for a in reader.iter_attachments():
            writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        channels = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()


def external(to):
    """A file of another program: zstd, no channel of this one."""
    with open(to, "wb") as out:
        writer = Writer(out)
        writer.start()
        schema = writer.register_schema("none", "jsonschema", b"{}")
        channel = writer.register_channel("/imu", "json", schema)
        for time in range(1000):
            writer.add_message(channel, time, json.dumps({"t": time}).encode(), time)
        writer.finish()


def old_reading(path, to, tick, age_ns):
    """The same recording, in which the reading of one tick has another age."""
    with open(path, "rb") as stream, open(to, "wb") as out:
        reader = SeekingReader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        writer = Writer(out)
        writer.start()
        for m in reader.iter_metadata():
            writer.add_metadata(m.name, m.metadata)
        for a in reader.iter_attachments():
            writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        channels = {}
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
            data = message.data
            if channel.topic == LOOP and decoded.tick == tick:
                decoded.probe_age_ns = age_ns
                data = decoded.SerializeToString()
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        writer.finish()


if __name__ == "__main__":
    what, *rest = sys.argv[1:]
    if what == "flips":
        json.dump(flips(rest[0], int(rest[1]), int(rest[2])), sys.stdout)
    elif what == "rewrite":
        rewrite(*rest)
    elif what == "external":
        external(*rest)
    elif what == "old_reading":
        old_reading(rest[0], rest[1], int(rest[2]), int(rest[3]))
