"""ROS 2 messages in CDR, read in columns: from the fields that are wanted to a short program that a compiled loop runs.

References
----------
OMG, DDS-XTypes 1.3 (formal/2020-02-04), 7.4.1: plain CDR version 1. Primitives are aligned to their size, counted from
behind the four bytes of the encapsulation; a string has its length, the closing zero included, in front of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.messages.cdr_definition import PRIMITIVES, Field, Types, full_name, types_of
from kempf.pipeline.ingest.messages.cdr_walk import DEEPEST, END, LOOP, PICK, READ, SEQUENCE, SKIP, STRING, walk
from kempf.pipeline.ingest.messages.columns import Columns, NoReaderError
from kempf.pipeline.ingest.spans import Spans

#: Longest program, steps.
_LONGEST = 20_000


class CdrReader:
    """Reads fields of ROS 2 messages of one type.

    Parameters
    ----------
    name : str
        Of the schema.
    definition : str
        Its text, with the definitions that it refers to.
    wanted : list of str
        Fields, nested ones with dots.

    Raises
    ------
    NoReaderError
        The definition cannot be read, or a field cannot be reached.
    """

    def __init__(self, name: str, definition: str, wanted: list[str]) -> None:
        types = types_of(name, definition)
        if full_name(name, "") not in types:
            raise NoReaderError(f"the type {name} is not defined")
        program = _program_for(types, name, wanted)
        self._steps, self._kinds, self._closed = program.table(), program.kinds, program.closed
        self.missing = program.missing

    def read(self, payloads: Spans) -> Columns:
        """Return the wanted fields of messages.

        Parameters
        ----------
        payloads : Spans
            With their encapsulation, shape (m,).
        """
        m, k = len(payloads), len(self._kinds)
        columns = Columns.empty(k, m)
        bits, present = np.zeros((m, k), dtype=np.uint64), np.zeros((m, k), dtype=np.bool_)
        walk(payloads.buffer, payloads.start, payloads.stop, self._steps, self._closed, bits, present, columns.good)
        for slot, kind in enumerate(self._kinds):
            if kind:
                dtype = np.dtype(kind)
                raw = bits[:, slot].astype(f"<u{dtype.itemsize}").view(dtype.newbyteorder("<"))
                columns.present[slot] = present[:, slot] & columns.good
                columns.value[slot] = np.where(columns.present[slot], raw.astype(np.float64), np.nan)
        return columns


@dataclass
class CdrProgram:
    """How to walk through one message."""

    #: ``(SKIP, align, bytes)``, ``(READ, align, bytes, slot)``, ``(STRING,)``, ``(SEQUENCE, align, bytes)``, ``(PICK,
    #: align, bytes, slot, index)`` before a sequence, ``(LOOP, count or -1, place behind its end)`` and ``(END,)``.
    steps: list[tuple[int, ...]] = field(default_factory=list)
    #: numpy's name of the type of each slot, empty where the definition has no such number.
    kinds: list[str] = field(default_factory=list)
    #: Wanted fields that are no number of the message, each with why.
    missing: dict[str, str] = field(default_factory=dict)
    #: Whether the program reaches the end of the message.
    closed: bool = True

    def table(self) -> NDArray[np.int64]:
        """Return the steps as an array, shape (s, 5)."""
        table = np.zeros((len(self.steps), 5), dtype=np.int64)
        for row, step in zip(table, self.steps, strict=True):
            row[: len(step)] = step
        return table


class _StopError(Exception):
    """From here on the message cannot be walked through; says why."""


def _program_for(types: Types, name: str, wanted: list[str]) -> CdrProgram:
    """Compile the walk through a message."""
    program = CdrProgram(kinds=[""] * len(wanted))
    slots = {tuple(key.split(".")): slot for slot, key in enumerate(wanted)}
    reasons = {path: _no_number(types, full_name(name, ""), path) for path in slots}
    program.missing = {".".join(path): why for path, why in reasons.items() if why}
    missing = {path for path, why in reasons.items() if why}
    try:
        _message(program, types, full_name(name, ""), {p: s for p, s in slots.items() if p not in missing}, 0)
    except _StopError as why:
        left = [".".join(p) for p, s in slots.items() if p not in missing and not program.kinds[s]]
        if left:
            raise NoReaderError(f"its field {left[0]} cannot be reached: {why}") from why
        program.closed = False
        depth = sum((s[0] == LOOP) - (s[0] == END) for s in program.steps)
        if depth:
            raise NoReaderError(str(why)) from why
    return program


def _no_number(types: Types, name: str, path: tuple[str, ...]) -> str:
    """Return why a path names no number of a message, nothing where it names one."""
    own = {f.name: f for f in types.get(name, ())}.get(path[0])
    if own is None:
        return f"{name} has no field {path[0]}"
    whole, rest, why = f"{name}.{path[0]}", path[1:], ""
    if own.count is not None:
        if not rest or not rest[0].isdigit():
            why = f"{whole} is a list: its elements are {path[0]}.0, {path[0]}.1 and so on"
        elif own.count >= 0 and int(rest[0]) >= own.count:
            why = f"{whole} has {own.count} elements"
        elif own.count < 0 and own.kind not in PRIMITIVES:
            why = f"{whole} is a list of any length of messages"
        rest = rest[1:]
    if why:
        return why
    if own.kind in types:
        return _no_number(types, own.kind, rest) if rest else f"{whole} is a message, not a number"
    if own.kind not in PRIMITIVES:
        return f"{whole} is text"
    return f"{whole} is a number, without {rest[0]}" if rest else ""


Slots = dict[tuple[str, ...], int]


def _message(program: CdrProgram, types: Types, name: str, slots: Slots, depth: int) -> None:
    if depth > DEEPEST:
        raise _StopError(f"{name} is nested in itself")
    fields = types[name] or (Field("structure_needs_at_least_one_member", "uint8", None),)
    for own in fields:
        within = {path[1:]: slot for path, slot in slots.items() if path[0] == own.name}
        if own.count is None:
            _value(program, types, own, within, depth)
        elif own.count < 0:
            _sequence(program, types, own, within, depth)
        else:
            _array(program, types, own, within, depth)


def _value(program: CdrProgram, types: Types, own: Field, within: Slots, depth: int) -> None:
    if own.kind in PRIMITIVES:
        size = np.dtype(PRIMITIVES[own.kind]).itemsize
        if not within:
            _skip(program, size, size)
        for first, slot in enumerate(within.values()):
            assert first == 0, "one path is one slot"
            program.kinds[slot] = PRIMITIVES[own.kind]
            _add(program, READ, size, size, slot)
    elif own.kind == "string":
        _add(program, STRING)
    elif own.kind == "wstring":
        raise _StopError(f"{own.name} is a wide string")
    else:
        _message(program, types, own.kind, within, depth + 1)


def _array(program: CdrProgram, types: Types, own: Field, within: Slots, depth: int) -> None:
    count = own.count or 0
    if own.kind in PRIMITIVES:
        size = np.dtype(PRIMITIVES[own.kind]).itemsize
        at = 0
        for index, slot in sorted((int(path[0]), slot) for path, slot in within.items()):
            if index > at:
                _skip(program, size, (index - at) * size)
            program.kinds[slot] = PRIMITIVES[own.kind]
            _add(program, READ, size, size, slot)
            at = index + 1
        if count > at:
            _skip(program, size, (count - at) * size)
        return
    element = Field(own.name, own.kind, None)
    last = max((int(path[0]) for path in within), default=-1)
    for index in range(last + 1):
        _value(program, types, element, {p[1:]: s for p, s in within.items() if int(p[0]) == index}, depth)
    if count > last + 1:
        _loop(program, types, element, count - last - 1, depth)


def _sequence(program: CdrProgram, types: Types, own: Field, within: Slots, depth: int) -> None:
    if own.kind in PRIMITIVES:
        size = np.dtype(PRIMITIVES[own.kind]).itemsize
        for path, slot in within.items():
            program.kinds[slot] = PRIMITIVES[own.kind]
            _add(program, PICK, size, size, slot, min(int(path[0]), 1 << 40))
        _add(program, SEQUENCE, size, size)
        return
    _loop(program, types, Field(own.name, own.kind, None), -1, depth)


def _loop(program: CdrProgram, types: Types, element: Field, count: int, depth: int) -> None:
    place = len(program.steps)
    _add(program, LOOP, count, 0)
    _value(program, types, element, {}, depth + 1)
    _add(program, END)
    program.steps[place] = (LOOP, count, len(program.steps))


def _skip(program: CdrProgram, align: int, size: int) -> None:
    """Add a skip; one that is aligned like the last one is made one with it."""
    last = program.steps[-1] if program.steps else (END,)
    if last[0] == SKIP and last[1] == align:
        program.steps[-1] = (SKIP, align, last[2] + size)
    else:
        _add(program, SKIP, align, size)


def _add(program: CdrProgram, *step: int) -> None:
    if len(program.steps) >= _LONGEST:
        raise _StopError("its definition is too long")
    program.steps.append(step)
