"""An independent writer of MCAP records, and with it every variant of the format's own conformance suite.

The suite (tests/conformance of the format's repository) crosses seven contents with the features of a file. Its binary
files are not at hand here; they are written anew, record by record from the specification, and `test_conformance` holds
the CRCs that the suite's expectations state for some of them against what is written here.
"""

import struct
import zlib
from itertools import combinations

MAGIC = b"\x89MCAP0\r\n"
#: Features by the suite's abbreviations.
FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")
_PAD = b"\x01\xff\xff"


def record(opcode, content, *, pad=False):
    content += _PAD if pad else b""
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value):
    return struct.pack("<I", len(value)) + value


def mapping(pairs):
    return text(b"".join(pairs))


def schema(number=1, name=b"Example", encoding=b"c", data=b"\x04\x05\x06"):
    return 3, struct.pack("<H", number) + text(name) + text(encoding) + text(data)


def channel(number=1, schema_id=1, topic=b"example", encoding=b"a"):
    return 4, struct.pack("<HH", number, schema_id) + text(topic) + text(encoding) + mapping(
        [text(b"foo") + text(b"bar")]
    )


def message(log_time, publish_time, sequence, data=b"\x01\x02\x03", number=1):
    return 5, struct.pack("<HIQQ", number, sequence, log_time, publish_time) + data


def attachment():
    body = struct.pack("<QQ", 2, 1) + text(b"myFile") + text(b"application/octet-stream")
    body += struct.pack("<Q", 3) + b"\x01\x02\x03"
    return 9, body + struct.pack("<I", zlib.crc32(body))


def metadata():
    return 12, text(b"myMetadata") + mapping([text(b"foo") + text(b"bar")])


#: Times and counters of the ten messages, as the suite has them.
TEN = [(0, 0), (2, 1), (1, 2), (3, 3), (3, 4), (5, 5), (4, 6), (7, 7), (8, 8), (9, 9)]
CONTENTS = {
    "NoData": [],
    "OneMessage": [schema(), channel(), message(2, 1, 10)],
    "OneAttachment": [attachment()],
    "OneMetadata": [metadata()],
    "OneSchemalessMessage": [channel(schema_id=0), message(2, 1, 10)],
    "TenMessages": [schema(), channel(), *(message(t, t, k) for t, k in TEN)],
}


def fits(opcodes, features):
    """Whether the suite has a variant: features that need something only where it is there."""
    need = {"ax": {9}, "mdx": {12}, "rsh": {3}, "rch": {4}, "ch": {3, 4, 5}, "chx": {3, 4, 5}, "mx": {3, 4, 5}}
    if any(f in features and not opcodes & needed for f, needed in need.items()):
        return False
    return "sum" not in features or bool(features & {"chx", "rsh", "rch", "mdx", "ax", "st"})


def variants():
    """Yield name, content and features of every variant."""
    for base, records in CONTENTS.items():
        opcodes = {opcode for opcode, _ in records}
        for n in range(len(FEATURES) + 1):
            for chosen in combinations(FEATURES, n):
                if fits(opcodes, set(chosen)):
                    yield "-".join([base, *sorted(chosen)]), records, set(chosen)


def chunk_record(records, compression=b"", pack=bytes, crc=None):
    """A chunk of records, with its true CRC unless another is given."""
    body = b"".join(record(opcode, content) for opcode, content in records)
    times = [struct.unpack_from("<Q", content, 6)[0] for opcode, content in records if opcode == 5]
    packed = pack(body)
    head = struct.pack(
        "<QQQI", min(times, default=0), max(times, default=0), len(body), zlib.crc32(body) if crc is None else crc
    )
    return record(6, head + text(compression) + struct.pack("<Q", len(packed)) + packed), len(body), len(packed)


def index_records(records, pad=False):
    """The message index of a chunk: one record a channel."""
    at, entries = 0, {}
    for opcode, content in records:
        if opcode == 5:
            number, _, log_time, _ = struct.unpack_from("<HIQQ", content, 0)
            entries.setdefault(number, []).append((log_time, at))
        at += 9 + len(content)
    return {
        number: record(7, struct.pack("<H", number) + mapping([struct.pack("<QQ", *e) for e in own]), pad=pad)
        for number, own in entries.items()
    }


def write(records, features):
    """Write one variant."""
    pad = "pad" in features
    out = MAGIC + record(1, text(b"") + text(b""), pad=pad)
    indexed = {8: b"", 10: b"", 13: b""}
    in_chunk = [r for r in records if r[0] in (3, 4, 5)] if "ch" in features else []
    for opcode, content in records:
        if (opcode, content) in in_chunk:
            continue
        place = len(out)
        out += record(opcode, content, pad=pad and opcode != 5)
        length = len(out) - place
        if opcode == 9 and "ax" in features:
            body = struct.pack("<QQQQQ", place, length, 2, 1, 3) + text(b"myFile") + text(b"application/octet-stream")
            indexed[10] += record(10, body, pad=pad)
        if opcode == 12 and "mdx" in features:
            indexed[13] += record(13, struct.pack("<QQ", place, length) + text(b"myMetadata"), pad=pad)
    if in_chunk:
        place = len(out)
        chunk, size, packed = chunk_record(in_chunk)
        out += chunk
        offsets, behind = [], len(out)
        if "mx" in features:
            for number, index in index_records(in_chunk, pad).items():
                offsets.append(struct.pack("<HQ", number, len(out)))
                out += index
        if "chx" in features:
            start, end = struct.unpack_from("<QQ", chunk, 9)
            body = struct.pack("<QQQQ", start, end, place, len(chunk)) + mapping(offsets)
            body += struct.pack("<Q", len(out) - behind) + text(b"") + struct.pack("<QQ", packed, size)
            indexed[8] += record(8, body, pad=pad)
    out += record(15, struct.pack("<I", zlib.crc32(out)), pad=pad)
    return out + summary(records, features, len(out), indexed, chunks=int(bool(in_chunk)))


def summary(records, features, start, indexed, chunks):
    pad = "pad" in features
    count = {opcode: sum(1 for o, _ in records if o == opcode) for opcode in (3, 4, 5, 9, 12)}
    times = [struct.unpack_from("<Q", content, 6)[0] for opcode, content in records if opcode == 5]
    per_channel = [struct.pack("<HQ", 1, count[5])] if count[5] else []
    groups = {
        3: b"".join(record(o, c, pad=pad) for o, c in records if o == 3) if "rsh" in features else b"",
        4: b"".join(record(o, c, pad=pad) for o, c in records if o == 4) if "rch" in features else b"",
        11: b"",
        13: indexed[13],
        10: indexed[10],
        8: indexed[8],
    }
    if "st" in features:
        body = struct.pack("<QHIIII", count[5], count[3], count[4], count[9], count[12], chunks)
        body += struct.pack("<QQ", min(times, default=0), max(times, default=0)) + mapping(per_channel)
        groups[11] = record(11, body, pad=pad)
    content, offsets = b"", b""
    for opcode, group in groups.items():
        if group:
            offsets += record(14, struct.pack("<BQQ", opcode, start + len(content), len(group)), pad=pad)
            content += group
    offset_start = start + len(content) if "sum" in features else 0
    content += offsets if "sum" in features else b""
    footer = struct.pack("<BQQQ", 2, 20, start if content else 0, offset_start)
    crc = zlib.crc32(content + footer)
    return content + footer + struct.pack("<I", crc) + MAGIC
