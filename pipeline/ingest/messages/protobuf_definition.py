"""A protobuf schema record, which is a FileDescriptorSet, taken apart into messages and their fields.

References
----------
Protocol Buffers, https://protobuf.dev/programming-guides/encoding and descriptor.proto; MCAP registry,
https://mcap.dev/spec/registry, "protobuf".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kempf.pipeline.ingest.messages.columns import NoReaderError

#: Number of a field type -> how its wire value is read; types that hold no number are not here.
NUMBERS = {
    1: "f8",
    2: "f4",
    3: "int",
    4: "uint",
    5: "int32",
    6: "u8",
    7: "u4",
    8: "bool",
    13: "uint32",
    14: "int32",
    15: "i4",
    16: "i8",
    17: "zigzag32",
    18: "zigzag",
}
MESSAGE_TYPE = 11
_REPEATED = 3

#: Most messages and fields of one schema.
_MOST = 100_000


@dataclass(frozen=True)
class ProtoField:
    """One field of a message.

    Attributes
    ----------
    number, kind : int
        Field number, and number of the type.
    type_name : str
        Full name of the message, with a dot in front; empty for others.
    repeated : bool
    implicit : bool
        Whether a field that is absent stands for zero, as those of proto3 without ``optional`` do.
    """

    number: int
    kind: int
    type_name: str
    repeated: bool
    implicit: bool


#: Full name with a dot in front -> fields by name.
ProtoTypes = dict[str, dict[str, ProtoField]]


def proto_types_of(descriptor_set: bytes) -> ProtoTypes:
    """Return the messages of a FileDescriptorSet.

    Raises
    ------
    NoReaderError
        The bytes are no such set.
    """
    types: ProtoTypes = {}
    for number, file in _fields(descriptor_set):
        if number != 1 or not isinstance(file, bytes):
            continue
        parts = list(_fields(file))
        package = next((_text(v) for n, v in parts if n == 2), "")
        proto3 = any(n == 12 and v == b"proto3" for n, v in parts)
        for part, content in parts:
            if part == 4 and isinstance(content, bytes):
                _message(types, content, f".{package}" if package else "", proto3)
    return types


def _message(types: ProtoTypes, content: bytes, scope: str, proto3: bool) -> None:
    parts = list(_fields(content))
    name = f"{scope}.{next((_text(v) for n, v in parts if n == 1), '')}"
    if len(types) > _MOST or scope.count(".") > 64:
        raise NoReaderError("its descriptor is too large")
    types[name] = dict(_field(v, proto3) for n, v in parts if n == 2 and isinstance(v, bytes))
    for number, nested in parts:
        if number == 3 and isinstance(nested, bytes):
            _message(types, nested, name, proto3)


def _field(content: bytes, proto3: bool) -> tuple[str, ProtoField]:
    told = dict(_fields(content))
    number, kind, label = (told.get(n, 0) for n in (3, 5, 4))
    if not (isinstance(number, int) and isinstance(kind, int)):
        raise NoReaderError("its descriptor is damaged")
    implicit = proto3 and 9 not in told  # a field of a oneof, and an optional one, tells zero from absent
    return _text(told.get(1, b"")), ProtoField(number, kind, _text(told.get(6, b"")), label == _REPEATED, implicit)


def _text(value: bytes | int) -> str:
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else ""


def _fields(content: bytes) -> Iterator[tuple[int, bytes | int]]:
    """Yield field number and value of a message: a whole number, or bytes."""
    at = 0
    while at < len(content):
        tag, at = _varint(content, at)
        number, wire = tag >> 3, tag & 7
        if wire == 0:
            value, at = _varint(content, at)
            yield number, value
            continue
        if wire == 2:
            length, at = _varint(content, at)
        elif wire in (1, 5):
            length = 8 if wire == 1 else 4
        else:
            raise NoReaderError("its descriptor is damaged")
        if at + length > len(content):
            raise NoReaderError("its descriptor is damaged")
        yield number, content[at : at + length]
        at += length


def _varint(content: bytes, at: int) -> tuple[int, int]:
    value = 0
    for k in range(10):
        if at + k >= len(content):
            break
        value |= (content[at + k] & 0x7F) << (7 * k)
        if content[at + k] < 0x80:
            return value, at + k + 1
    raise NoReaderError("its descriptor is damaged")
