"""JSON messages, read in columns; a message that is no JSON object costs only itself."""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from kempf.pipeline.ingest.messages.columns import Columns
from kempf.pipeline.ingest.messages.json_walk import ABSENT, NUMBER, OTHER, TEXT, walk
from kempf.pipeline.ingest.spans import Index, Spans
from kempf.pipeline.ingest.text.cells import number

#: Most digits of the place of an element.
_LONGEST_INDEX = 9

#: A tree of field names; the leaves are empty.
Tree = dict[str, "Tree"]


class JsonReader:
    """Reads fields of JSON messages.

    Parameters
    ----------
    wanted : list of str
        Fields, nested ones with dots; a number is an element of a list, counted from 0, or a key that reads so.
    text : list of str
        Those whose text is wanted too where it is no number.
    """

    def __init__(self, wanted: list[str], text: Collection[str] = ()) -> None:
        self._text = [slot for slot, name in enumerate(wanted) if name in text]
        self._paths = [name.split(".") for name in wanted]
        tree: Tree = {}
        for path in self._paths:
            node = tree
            for part in path:
                node = node.setdefault(part, {})
        self._elements = np.array([any(_is_index(part) for part in path) for path in self._paths], dtype=np.bool_)
        self._listed = bool(self._elements.any())
        self._nodes, self._keys = _flat(tree, self._paths)
        #: a JSON schema need not name every field: what is missing shows in the messages
        self.missing: dict[str, str] = {}

    def read(self, payloads: Spans) -> Columns:
        """Return the wanted fields of messages; numbers as text are numbers, null is absent.

        Parameters
        ----------
        payloads : Spans
            Shape (m,).
        """
        m, k = len(payloads), len(self._paths)
        columns = Columns.empty(k, m)
        tokens, value = np.zeros((m, k, 3), dtype=np.int64), np.zeros((m, k))
        walk(
            payloads.buffer, payloads.start, payloads.stop, self._nodes.copy(), self._keys, tokens, value, columns.good
        )
        kind, first, last = tokens[..., 0], tokens[..., 1], tokens[..., 2]
        slow = ~columns.good
        if self._listed:
            # the compiled walk steps over lists
            slow |= (kind[:, self._elements] == ABSENT).any(axis=1)
        parts: dict[int, list[tuple[Index, pl.Series]]] = {slot: [] for slot in self._text}
        for i in np.flatnonzero(slow).tolist():
            payload = payloads.buffer[payloads.start[i] : payloads.stop[i]].tobytes()
            message = _message(payload)
            columns.good[i] = message is not None
            self._slow(message or {}, kind[i], value[i])
            for slot, own in parts.items():
                if isinstance(word := _at(message, self._paths[slot]), str):
                    own.append((np.array([i]), pl.Series([word])))
        value[kind != NUMBER] = np.nan
        for slot in range(k):
            text = np.flatnonzero((kind[:, slot] == TEXT) & columns.good)
            if text.size:
                # ascending, as stretches of one buffer are
                words = Spans(payloads.buffer, first[text, slot], last[text, slot]).text()
                value[text, slot] = number(words)
                if slot in parts:
                    parts[slot].append((text, words.rename("")))
        for slot, own in parts.items():
            if own:
                columns.text[slot] = _in_order(own, np.isnan(value[:, slot]))
        columns.value[:] = value.T
        columns.present[:] = (kind != ABSENT).T & columns.good
        return columns

    def _slow(self, message: dict[str, Any], kind: NDArray[np.int64], value: NDArray[np.float64]) -> None:
        """Take what is wanted from one message that Python's own reader has read."""
        for slot, path in enumerate(self._paths):
            kind[slot], value[slot] = _leaf(_at(message, path))


def _in_order(parts: list[tuple[Index, pl.Series]], odd: NDArray[np.bool_]) -> tuple[Index, pl.Series]:
    """Return numbers of messages and their text, ascending, of those that are odd."""
    at, text = np.concatenate([at for at, _ in parts]), pl.concat([words for _, words in parts])
    order = np.argsort(at)
    order = order[odd[at[order]]]
    return at[order], text.gather(order)


def _message(payload: bytes) -> dict[str, Any] | None:
    """Return a JSON object, None for anything else."""
    message = _parsed(payload)
    if message is None and payload.endswith(b"\0"):
        # that ends a string in C; tried second, for UTF-16 may end so too
        message = _parsed(payload.rstrip(b"\0"))
    return message


def _parsed(payload: bytes) -> dict[str, Any] | None:
    try:
        message = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    return message if isinstance(message, dict) else None


def _is_index(part: str) -> bool:
    """Return whether a part of a path may be the place of an element in a list."""
    return part.isascii() and part.isdigit() and len(part) <= _LONGEST_INDEX


def _at(value: Any, path: list[str]) -> Any:
    """Return what stands at a path, None for nothing."""
    for part in path:
        if isinstance(value, list) and _is_index(part):
            value = value[int(part)] if int(part) < len(value) else None
        else:
            value = value.get(part) if isinstance(value, dict) else None
    return value


def _leaf(value: Any) -> tuple[int, float]:
    """Return what a value is, and the number that it is."""
    if value is None:
        return ABSENT, np.nan
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return OTHER, np.nan
    try:
        read = float(value)
    except (ValueError, OverflowError):
        return OTHER, np.nan
    return NUMBER, read if np.isfinite(read) else np.nan


def _flat(tree: Tree, paths: list[list[str]]) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Lay a tree out as `json_walk.walk` wants it: the children of a node stand behind each other."""
    nodes: list[tuple[Tree, bytes, tuple[str, ...]]] = [(tree, b"", ())]
    slots = {tuple(path): slot for slot, path in enumerate(paths)}
    rows, at = [], 0
    for own, key, path in nodes:
        rows.append((len(nodes), len(nodes) + len(own), at, at + len(key), slots.get(path, -1) if path else -1, -1))
        nodes += [(below, name.encode(), (*path, name)) for name, below in own.items()]
        at += len(key)
    keys = b"".join(key for _, key, _ in nodes)
    return np.array(rows, dtype=np.int64), np.frombuffer(keys or b"\0", dtype=np.uint8)
