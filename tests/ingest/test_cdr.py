"""ROS 2 messages in CDR, held against the format's own Python package as writer and as reader."""

import random
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

from kempf.pipeline.ingest.messages.cdr_definition import types_of
from kempf.pipeline.ingest.messages.cdr_reader import CdrReader
from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.pipeline.ingest.spans import Spans, as_bytes
from tests.ingest.ros_definitions import DEFINITIONS, joined


def spans(payloads, gap=b"\xaa\xbb\xcc"):
    """Payloads behind each other, each at a place that is aligned to nothing."""
    start, stop, data = [], [], b""
    for payload in payloads:
        data += gap
        start.append(len(data))
        data += payload
        stop.append(len(data))
    return Spans(as_bytes(data), np.array(start, dtype=np.int64), np.array(stop, dtype=np.int64))


def filled(types, name, rng):
    """A message with random content, and its numbers by path."""
    message, numbers = {}, {}
    for field in types[name]:
        if field.count is None:
            message[field.name], own = value(types, field.kind, rng)
            numbers |= {(field.name, *path): number for path, number in own.items()}
            continue
        n = rng.randrange(4) if field.count < 0 else field.count
        message[field.name] = []
        for k in range(n):
            element, own = value(types, field.kind, rng)
            message[field.name].append(element)
            if field.count >= 0 or field.kind not in types:
                numbers |= {(field.name, str(k), *path): number for path, number in own.items()}
        if field.kind == "uint8" and field.count < 0:
            message[field.name] = bytes(message[field.name])
    return message, numbers


def value(types, kind, rng):
    if kind == "string":
        return "ab\u00e9"[: rng.randrange(4)] * rng.randrange(3), {}
    if kind in types:
        if not types[kind]:
            return {"structure_needs_at_least_one_member": 0}, {}
        return filled(types, kind, rng)
    if kind == "bool":
        number = rng.random() < 0.5
    elif kind.startswith("float"):
        number = rng.choice([rng.uniform(-1e3, 1e3), 0.0, float("inf")])
        number = struct.unpack("<f", struct.pack("<f", number))[0] if kind == "float32" else number
    else:
        low = 0 if kind.startswith(("u", "b", "c")) else -(2 ** min(int(kind.removeprefix("int")) - 1, 52))
        number = rng.randint(low, 2 ** min(int("".join(c for c in kind if c.isdigit()) or 8) - 1, 53) - 1)
    return number, {(): number}


@pytest.mark.parametrize("name", sorted(DEFINITIONS))
def test_every_number_of_every_message_is_what_was_written(name):
    definition = DEFINITIONS[name]
    types = types_of(name, definition)
    own = name.replace("/msg/", "/")
    rng = random.Random(name)
    written = [filled(types, own, rng) for _ in range(40)]
    write = serialize_dynamic(name, definition)[name]
    payloads = [bytes(write(message)) for message, _ in written]
    wanted = sorted({path for _, numbers in written for path in numbers})
    rng.shuffle(wanted)
    found = CdrReader(name, definition, [".".join(path) for path in wanted]).read(spans(payloads))
    assert found.good.all()
    for slot, path in enumerate(wanted):
        expected = [numbers.get(path) for _, numbers in written]
        assert found.present[slot].tolist() == [number is not None for number in expected]
        np.testing.assert_array_equal(
            found.value[slot], [np.nan if number is None else float(number) for number in expected]
        )


@pytest.mark.parametrize(
    "name", ["yard_msgs/msg/Everything", "sensor_msgs/msg/JointState", "sensor_msgs/msg/NavSatFix"]
)
def test_a_message_that_is_cut_anywhere_is_refused(name):
    definition = DEFINITIONS[name]
    types = types_of(name, definition)
    message, _ = filled(types, name.replace("/msg/", "/"), random.Random(3))
    payload = bytes(serialize_dynamic(name, definition)[name](message))
    reader = CdrReader(name, definition, [])
    cut = reader.read(spans([payload[:n] for n in range(len(payload) + 1)]))
    assert cut.good.tolist() == [False] * len(payload) + [True]
    longer = reader.read(spans([payload + bytes(n) for n in (3, 7, 8, 100)]))
    assert longer.good.tolist() == [True, True, False, False]


def test_both_byte_orders_and_no_other_representation():
    payloads = [
        b"\x00\x01\x00\x00" + struct.pack("<bxhi", -1, -2, 3),
        b"\x00\x00\x00\x00" + struct.pack(">bxhi", -1, -2, 3),
    ]
    payloads += [bytes([0, kind, 0, 0]) + payloads[0][4:] for kind in (2, 3, 6, 7, 8, 9, 10, 11, 255)]
    found = CdrReader("a/B", "int8 a\nint16 b\nint32 c", ["a", "b", "c"]).read(spans(payloads))
    assert found.good.tolist() == [True, True] + [False] * 9
    assert found.value[:, :2].T.tolist() == [[-1, -2, 3]] * 2


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(max_size=120), max_size=20), st.sampled_from(sorted(DEFINITIONS)))
def test_any_bytes_are_read_like_the_library_reads_them_or_refused(payloads, name):
    payloads = [b"\x00\x01\x00\x00" + payload for payload in payloads]
    definition = DEFINITIONS[name]
    path = {"std_msgs/msg/Float64": "data", "yard_msgs/msg/Everything": "last"}.get(name, "header.stamp.sec")
    reader = CdrReader(name, definition, [path])
    found = reader.read(spans(payloads))
    decode = generate_dynamic(name, definition)[name]
    for i in np.flatnonzero(found.good):
        message = decode(payloads[i])
        if not reader.missing:
            for part in path.split("."):
                message = getattr(message, part)
            np.testing.assert_equal(found.value[0, i], float(message))


def test_what_is_no_number_is_named_with_why():
    reader = CdrReader(
        "a/msg/B",
        joined("C c\nC[] cs\nstring s\nfloat64[3] f\nfloat64[] g\nfloat64 x", ("a/C", "int8 d")),
        ["c", "cs.0.d", "s", "f", "f.3", "g", "nope", "c.nope", "x.y", "g.7"],
    )
    assert reader.missing == {
        "c": "a/B.c is a message, not a number",
        "cs.0.d": "a/B.cs is a list of any length of messages",
        "s": "a/B.s is text",
        "f": "a/B.f is a list: its elements are f.0, f.1 and so on",
        "f.3": "a/B.f has 3 elements",
        "g": "a/B.g is a list: its elements are g.0, g.1 and so on",
        "nope": "a/B has no field nope",
        "c.nope": "a/C has no field nope",
        "x.y": "a/B.x is a number, without y",
    }


@pytest.mark.parametrize(
    ("definition", "why"),
    [
        ("Other o", "a/Other, which is not defined"),
        ("float64 = x", "a line that is no field"),
        ("B b\nfloat64 x", "nested in itself"),
        ("wstring w\nfloat64 x", "x cannot be reached: w is a wide string"),
        ("float64 " + "x" * (1 << 20), "more than 1048576 characters"),
        (joined("C[30000] c\nfloat64 x", ("a/C", "D[2] d\nstring s"), ("a/D", "int8 e\nstring s")), None),
        (
            joined(
                "A a\nfloat64 x",
                *[(f"a/{chr(65 + k)}", f"{chr(66 + k)}[9] a\n{chr(66 + k)} b\n" * 9) for k in range(9)],
                ("a/J", "int8 a"),
            ),
            "too long",
        ),
    ],
)
def test_a_definition_that_cannot_be_walked_is_refused_with_why(definition, why):
    if why is None:
        assert CdrReader("a/msg/B", definition, ["x"]).missing == {}
        return
    with pytest.raises(NoReaderError, match=why):
        CdrReader("a/msg/B", definition, ["x"])


def test_what_lies_behind_a_wide_string_does_not_matter_to_what_lies_before_it():
    reader = CdrReader("a/msg/B", "float64 x\nwstring w", ["x"])
    found = reader.read(spans([b"\x00\x01\x00\x00" + struct.pack("<d", 1.5) + b"whatever"]))
    assert found.good.all() and found.value[0, 0] == 1.5
