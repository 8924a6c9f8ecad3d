"""Protobuf messages, read in columns by the descriptor in the file: a FileDescriptorSet, taken apart into fields.

References
----------
Protocol Buffers, https://protobuf.dev/programming-guides/encoding, field_presence and descriptor.proto; MCAP registry,
https://mcap.dev/spec/registry, "protobuf".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.messages.columns import Columns, NoReaderError
from kempf.pipeline.ingest.messages.protobuf_walk import DEEPEST, LENGTH, NARROW, VARINT, WIDE, walk
from kempf.pipeline.ingest.spans import Spans

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
_WIRE = {"f8": WIDE, "u8": WIDE, "i8": WIDE, "f4": NARROW, "u4": NARROW, "i4": NARROW}


class ProtobufReader:
    """Reads fields of protobuf messages of one type.

    Parameters
    ----------
    name : str
        Full name of the message.
    descriptor_set : bytes
        Content of the schema record.
    wanted : list of str
        Fields, nested ones with dots.

    Raises
    ------
    NoReaderError
        The descriptor cannot be read.
    """

    def __init__(self, name: str, descriptor_set: bytes, wanted: list[str]) -> None:
        types = proto_types_of(descriptor_set)
        if f".{name}" not in types:
            raise NoReaderError(f"its descriptor has no message {name}")
        self._kinds = [""] * len(wanted)
        self._parent = np.full(len(wanted), -1, dtype=np.int64)
        self._nodes: list[list[tuple[int, int, int, int]]] = [[]]
        self.missing: dict[str, str] = {}
        below: dict[tuple[str, ...], int] = {(): 0}
        for slot, key in enumerate(wanted):
            if why := self._add(types, f".{name}", tuple(key.split(".")), slot, below):
                self.missing[key] = why
        flat = [row for node in self._nodes for row in node]
        self._rows = np.array(flat, dtype=np.int64).reshape(-1, 4)
        self._row_of = np.cumsum([0] + [len(node) for node in self._nodes]).astype(np.int64)

    def _add(
        self, types: ProtoTypes, name: str, path: tuple[str, ...], slot: int, below: dict[tuple[str, ...], int]
    ) -> str:
        """Add the way to one field to the tree of messages that are entered; return why there is none."""
        if len(path) > DEEPEST:
            return "it is nested too deep"
        chain: list[ProtoField] = []
        for part in path:
            own = types.get(name, {}).get(part)
            if own is None:
                return f"{name[1:] or path[0]} has no field {part}"
            if own.repeated:
                return f"{name[1:]}.{part} is a list of any length"
            chain.append(own)
            name = own.type_name if own.kind == MESSAGE_TYPE else ""
        last = chain[-1]
        if last.kind not in NUMBERS:
            return f"{'.'.join(path)} is not a number"
        for depth, own in enumerate(chain[:-1], start=1):
            if path[:depth] not in below:
                below[path[:depth]] = len(self._nodes)
                self._nodes[below[path[: depth - 1]]].append((own.number, LENGTH, -1, len(self._nodes)))
                self._nodes.append([])
        self._kinds[slot] = NUMBERS[last.kind]
        node = below[path[:-1]]
        self._nodes[node].append((last.number, _WIRE.get(self._kinds[slot], VARINT), slot, 0))
        if last.implicit:
            self._parent[slot] = node
        return ""

    def read(self, payloads: Spans) -> Columns:
        """Return the wanted fields of messages; a proto3 field that is left out is zero where its message is there.

        Parameters
        ----------
        payloads : Spans
            Shape (m,).
        """
        m, k = len(payloads), len(self._kinds)
        columns = Columns.empty(k, m)
        bits = np.zeros((m, k), dtype=np.uint64)
        present = np.zeros((m, k), dtype=np.bool_)
        entered = np.zeros((m, len(self._nodes)), dtype=np.bool_)
        rows, row_of = self._rows, self._row_of
        walk(payloads.buffer, payloads.start, payloads.stop, rows, row_of, bits, present, entered, columns.good)
        for slot, kind in enumerate(self._kinds):
            there = present[:, slot].copy()
            if self._parent[slot] >= 0:
                there |= entered[:, self._parent[slot]]
            there &= columns.good
            columns.present[slot] = there
            if kind:
                columns.value[slot] = np.where(there, _numbers(bits[:, slot], kind), np.nan)
        return columns


def _numbers(bits: NDArray[np.uint64], kind: str) -> NDArray[np.float64]:
    """Return wire values as numbers; of one too long for its kind the lower bits count, and any bit makes a truth."""
    if kind == "bool":
        return np.where(bits != 0, 1.0, 0.0)
    if kind in ("uint32", "int32", "zigzag32"):
        low = bits.astype(np.uint32)
        bits = low.view(np.int32).astype(np.int64).view(np.uint64) if kind == "int32" else low.astype(np.uint64)
    if kind in ("uint", "uint32"):
        return bits.astype(np.float64)
    if kind in ("int", "int32"):
        return bits.view(np.int64).astype(np.float64)
    if kind in ("zigzag", "zigzag32"):
        half = (bits >> np.uint64(1)).view(np.int64)
        return np.where(bits & np.uint64(1) == 1, ~half, half).astype(np.float64)
    dtype = np.dtype(kind)
    return bits.astype(f"<u{dtype.itemsize}").view(dtype.newbyteorder("<")).astype(np.float64)


@dataclass(frozen=True)
class ProtoField:
    """One field of a message."""

    #: number, kind: Field number, and number of the type.
    number: int
    kind: int
    #: Full name of the message, with a dot in front; empty for others.
    type_name: str
    repeated: bool
    #: Whether a field that is absent stands for zero, as those of proto3 without ``optional`` do.
    implicit: bool


#: Full name with a dot in front -> fields by name.
ProtoTypes = dict[str, dict[str, ProtoField]]


def proto_types_of(descriptor_set: bytes) -> ProtoTypes:
    """Return the messages of a FileDescriptorSet."""
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
    descriptor = dict(_fields(content))
    number, kind, label = (descriptor.get(n, 0) for n in (3, 5, 4))
    if not (isinstance(number, int) and isinstance(kind, int)):
        raise NoReaderError("its descriptor is damaged")
    implicit = proto3 and 9 not in descriptor  # a field of a oneof, and an optional one, distinguishes zero from absent
    name, type_name = _text(descriptor.get(1, b"")), _text(descriptor.get(6, b""))
    return name, ProtoField(number, kind, type_name, label == _REPEATED, implicit)


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
