"""Damage done to valid inputs: by bytes, by words, by lines, by whole inputs; every choice from one seeded source."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence

from benchmarks.ingest.fuzzing.corpus import Reader, packed

#: Largest input that is made, bytes: large enough that anything quadratic takes seconds.
LARGEST = 1 << 18

_NUMBER = re.compile(rb"[0-9]+(?:\.[0-9]+)?")
_SENTENCE = re.compile(rb"([$!\\])([^$!*\\\r\n]*)\*[0-9A-Fa-f]{2}")
_EXTREME = (
    b"0",
    b"-1",
    b"1e308",
    b"1e-320",
    b"99999999999999999999999",
    b"0.1234567890123456789",
    b"-0.0",
    b"180.0000001",
)
_INTERESTING = (0, 1, 7, 9, 10, 13, 31, 32, 33, 34, 36, 42, 44, 45, 58, 59, 92, 127, 128, 255)


class Mutator:
    """Makes damaged inputs.

    Parameters
    ----------
    reader : Reader
    words : sequence of bytes
        What inputs are made of.
    seed : int
    """

    def __init__(self, reader: Reader, words: Sequence[bytes], seed: int) -> None:
        self.reader, self.words = reader, list(words)
        self.random = random.Random(seed)  # noqa: S311 - damage, not secrets
        self._ways = (
            self._flip,
            self._set,
            self._delete,
            self._repeat,
            self._insert,
            self._replace,
            self._number,
            self._swap_lines,
            self._cut,
            self._many,
        )

    def next(self, pool: Sequence[tuple[str, bytes]]) -> tuple[str, bytes]:
        """Return one damaged input: a few kinds of damage on top of each other."""
        name, data = self.random.choice(pool)
        if self.random.random() < 0.15:
            other = self.random.choice(pool)[1]
            data = data[: self._place(data)] + other[self._place(other) :]
        for _ in range(self.random.choice((1, 1, 2, 3, 5, 9))):
            data = self.random.choice(self._ways)(data)[:LARGEST]
        if self.reader == "nmea" and self.random.random() < 0.6:
            # damage behind a checksum that fits is what the reader of the fields gets to see
            data = _SENTENCE.sub(_summed, data)
        if self.reader != "profile" and self.random.random() < 0.06:
            name, data = self.random.choice(packed(name, data))
            if self.random.random() < 0.7:
                data = self.random.choice((self._flip, self._cut, self._set))(data)
        return name, data

    def _place(self, data: bytes) -> int:
        return self.random.randint(0, len(data))

    def _span(self, data: bytes) -> tuple[int, int]:
        first = self._place(data)
        return first, min(len(data), first + self.random.choice((1, 2, 4, 8, 40, 400, 4000)))

    def _flip(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for _ in range(self.random.choice((1, 1, 2, 8)) if data else 0):
            changed[self.random.randrange(len(data))] ^= 1 << self.random.randrange(8)
        return bytes(changed)

    def _set(self, data: bytes) -> bytes:
        changed = bytearray(data)
        if data:
            changed[self.random.randrange(len(data))] = self.random.choice(_INTERESTING)
        return bytes(changed)

    def _delete(self, data: bytes) -> bytes:
        first, last = self._span(data)
        return data[:first] + data[last:]

    def _repeat(self, data: bytes) -> bytes:
        first, last = self._span(data)
        return data[:last] + data[first:last] * self.random.choice((1, 2, 10, 100)) + data[last:]

    def _insert(self, data: bytes) -> bytes:
        at = self._place(data)
        return data[:at] + self.random.choice(self.words) + data[at:]

    def _replace(self, data: bytes) -> bytes:
        word, other = self.random.choice(self.words), self.random.choice(self.words)
        return data.replace(word, other, self.random.choice((1, 3, -1))) if word else data

    def _number(self, data: bytes) -> bytes:
        found = list(_NUMBER.finditer(data))
        if not found:
            return data
        one = self.random.choice(found)
        other = self.random.choice((*_EXTREME, one.group() + b"9", one.group()[:-1], b"-" + one.group()))
        return data[: one.start()] + other + data[one.end() :]

    def _swap_lines(self, data: bytes) -> bytes:
        lines = data.splitlines(keepends=True)
        if len(lines) > 1:
            i, j = self.random.randrange(len(lines)), self.random.randrange(len(lines))
            lines[i], lines[j] = lines[j], lines[i]
        return b"".join(lines)

    def _cut(self, data: bytes) -> bytes:
        return data[: self._place(data)] if self.random.random() < 0.7 else data[self._place(data) :]

    def _many(self, data: bytes) -> bytes:
        """Put a word in as often as fits: what is quadratic shows."""
        if self.random.random() < 0.8:
            return data
        word = self.random.choice(self.words) or b" "
        at = self._place(data)
        return data[:at] + word * (self.random.choice((200, 20_000, LARGEST)) // len(word)) + data[at:]


def _summed(found: re.Match[bytes]) -> bytes:
    total = 0
    for byte in found.group(2):
        total ^= byte
    return found.group(1) + found.group(2) + b"*%02X" % total
