"""Protobuf messages, held against Google's own library as writer and as reader."""

import random

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from hypothesis import strategies as st

from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.pipeline.ingest.messages.protobuf_reader import ProtobufReader
from tests.ingest.test_cdr import spans

TYPES = {
    "double": 1, "float": 2, "int64": 3, "uint64": 4, "int32": 5, "fixed64": 6, "fixed32": 7, "bool": 8, "string": 9,
    "bytes": 12, "uint32": 13, "enum": 14, "sfixed32": 15, "sfixed64": 16, "sint32": 17, "sint64": 18,
}  # fmt: skip
NUMBERS = [name for name in TYPES if name not in ("string", "bytes")]
LIMITS = {
    "int64": (-(2**63), 2**63 - 1), "uint64": (0, 2**64 - 1), "int32": (-(2**31), 2**31 - 1), "fixed64": (0, 2**64 - 1),
    "fixed32": (0, 2**32 - 1), "uint32": (0, 2**32 - 1), "enum": (0, 2), "sfixed32": (-(2**31), 2**31 - 1),
    "sfixed64": (-(2**63), 2**63 - 1), "sint32": (-(2**31), 2**31 - 1), "sint64": (-(2**63), 2**63 - 1), "bool": (0, 1),
}  # fmt: skip


def described(syntax="proto3"):
    """A file of messages with every kind of field, as a descriptor set, and the class that writes them."""
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package="yard", syntax=syntax)
    colour = file.enum_type.add(name="Colour")
    for k in range(3):
        colour.value.add(name=f"C{k}", number=k)
    part = file.message_type.add(name="Part")
    inner = part.nested_type.add(name="Inner")
    for number, name in enumerate(["double", "sint32", "string"], start=1):
        inner.field.add(name=f"f_{name}", number=number, type=TYPES[name], label=1)
    for number, name in enumerate(TYPES, start=1):
        own = part.field.add(name=f"f_{name}", number=number * 5, type=TYPES[name], label=1)
        if name == "enum":
            own.type_name = ".yard.Colour"
    part.field.add(name="inner", number=200, type=11, label=1, type_name=".yard.Part.Inner")
    part.field.add(name="many", number=201, type=1, label=3)
    part.field.add(name="parts", number=202, type=11, label=3, type_name=".yard.Part")
    part.field.add(name="sub", number=203, type=11, label=1, type_name=".yard.Part")
    if syntax == "proto3":
        part.oneof_decl.add(name="_maybe")
        part.field.add(name="maybe", number=2000, type=1, label=1, oneof_index=0, proto3_optional=True)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName("yard.Part"))
    return descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(), made


def fill(message, rng, depth=0):
    for name in TYPES:
        if rng.random() < 0.5:
            continue
        if name in LIMITS:
            low, high = LIMITS[name]
            content = rng.choice([low, high, 0, rng.randint(low, high)])
        else:
            content = {
                "double": rng.uniform(-9, 9),
                "float": 0.5,
                "string": "é" * rng.randrange(200),
                "bytes": b"\0\xff",
            }[name]
        setattr(message, f"f_{name}", content)
    if rng.random() < 0.7:
        message.inner.f_double = rng.choice([0.0, 2.5])
    message.many.extend([1.0] * rng.randrange(3))
    if depth < 3:
        for _ in range(rng.randrange(2)):
            fill(message.parts.add(), rng, depth + 1)
        if rng.random() < 0.5:
            fill(message.sub, rng, depth + 1)


def expected(message, path):
    """What a path holds: a number, or None where its message is not there or where it is known to be unset."""
    *way, last = path.split(".")
    for part in way:
        if not message.HasField(part):
            return None
        message = getattr(message, part)
    if message.DESCRIPTOR.fields_by_name[last].has_presence and not message.HasField(last):
        return None
    return float(getattr(message, last))


PATHS = [f"{way}f_{name}" for way in ("", "sub.", "sub.sub.") for name in NUMBERS]
PATHS += ["inner.f_double", "sub.inner.f_sint32", "sub.sub.sub.inner.f_double"]


@pytest.mark.parametrize("syntax", ["proto2", "proto3"])
def test_every_number_is_what_was_written(syntax):
    schema, made = described(syntax)
    rng = random.Random(4)
    messages = []
    for _ in range(80):
        messages.append(made())
        fill(messages[-1], rng)
    paths = [*PATHS, *(["maybe"] if syntax == "proto3" else [])]
    found = ProtobufReader("yard.Part", schema, paths).read(spans([m.SerializeToString() for m in messages]))
    assert found.good.all()
    for slot, path in enumerate(paths):
        wanted = [expected(message, path) for message in messages]
        assert found.present[slot].tolist() == [number is not None for number in wanted], path
        np.testing.assert_array_equal(found.value[slot], [np.nan if n is None else n for n in wanted])


def test_a_message_that_comes_in_two_parts_is_merged_and_the_last_number_counts():
    schema, made = described()
    first, second = made(f_double=1.0, f_int32=7), made(f_double=2.0)
    first.sub.f_int32 = 3
    second.sub.f_double = 4.0
    both = first.SerializeToString() + second.SerializeToString()
    found = ProtobufReader("yard.Part", schema, ["f_double", "f_int32", "sub.f_int32", "sub.f_double"]).read(
        spans([both])
    )
    assert found.value[:, 0].tolist() == [2.0, 7.0, 3.0, 4.0]


def test_a_number_too_long_for_its_kind_is_cut_as_the_library_cuts_it():
    schema, made = described()
    numbers = {field.name: field.number for field in made.DESCRIPTOR.fields}
    paths = ["f_bool", "f_int32", "f_uint32", "f_sint32"]
    long = [2, 2**31, 2**32 + 5, 2**35 + 7, 2**63 + 1, 2**64 - 1]
    payloads = [b"".join(varint(numbers[p] << 3) + varint(value) for p in paths) for value in long]
    found = ProtobufReader("yard.Part", schema, paths).read(spans(payloads))
    assert found.good.all()
    for i, payload in enumerate(payloads):
        read = made.FromString(payload)
        assert found.value[:, i].tolist() == [float(getattr(read, p)) for p in paths]


def varint(value):
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=60), st.integers(0, 2**32), st.integers(0, 400))
def test_any_bytes_are_read_as_the_library_reads_them_or_refused(tail, seed, cut):
    schema, made = described()
    message = made()
    fill(message, random.Random(seed))
    payloads = [tail, message.SerializeToString()[:cut], message.SerializeToString()[:cut] + tail]
    paths = ["f_double", "sub.f_sint64", "inner.f_double", "f_bool"]
    found = ProtobufReader("yard.Part", schema, paths).read(spans(payloads))
    for i in np.flatnonzero(found.good):
        try:
            read = made.FromString(payloads[i])
        except Exception:  # noqa: BLE001, S112 - text that is no UTF-8, or groups: nothing that a number depends on
            continue
        for slot, path in enumerate(paths):
            wanted = expected(read, path)
            np.testing.assert_equal(found.value[slot, i], np.nan if wanted is None else wanted)


def test_what_is_no_number_is_named_with_why():
    schema, _ = described()
    reader = ProtobufReader("yard.Part", schema, ["f_string", "inner", "many", "parts.f_double", "nope", "inner.nope"])
    assert reader.missing == {
        "f_string": "f_string is not a number",
        "inner": "inner is not a number",
        "many": "yard.Part.many is a list of any length",
        "parts.f_double": "yard.Part.parts is a list of any length",
        "nope": "yard.Part has no field nope",
        "inner.nope": "yard.Part.Inner has no field nope",
    }


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=200), st.integers(0, 1000))
def test_a_descriptor_that_is_none_is_refused(junk, cut):
    schema, _ = described()
    for data in (junk, schema[: cut % len(schema)]):
        with pytest.raises(NoReaderError):
            ProtobufReader("yard.Absent", data, ["f_double"])
