"""JSON payloads of one topic, read in columns; a payload that is no JSON object costs only itself."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from pipeline.ingest.spans import Spans

#: A tree of field names; the leaves are the fields asked for.
Tree = dict[str, "Tree"]


def fields_of(payloads: Spans, wanted: list[str]) -> tuple[pl.DataFrame, NDArray[np.bool_]]:
    """Read some fields of all payloads as text.

    Parameters
    ----------
    payloads : Spans
        JSON objects, shape (m,); the byte behind each may be overwritten in ``payloads.buffer``.
    wanted : list of str
        Fields, nested ones with dots.

    Returns
    -------
    text : polars.DataFrame, shape (m, len(wanted))
        Numbers and strings as text, null where the field is absent or null.
    good : ndarray of bool, shape (m,)
        Which payloads are JSON objects.
    """
    tree: Tree = {}
    for name in wanted:
        node = tree
        for part in name.split("."):
            node = node.setdefault(part, {})
    leaves = sum(1 for name in wanted if _at(tree, name) == {})
    # a field that is mapped itself and has mapped fields within cannot be typed for the columns
    table = _fast(payloads, tree, wanted) if leaves == len(wanted) else None
    if table is not None:
        return table, np.ones(len(payloads), dtype=np.bool_)
    return _slow(payloads, wanted)


def _at(tree: Tree, name: str) -> Tree:
    for part in name.split("."):
        tree = tree[part]
    return tree


def _dtype(tree: Tree) -> Any:
    return pl.Struct({name: _dtype(inner) for name, inner in tree.items()}) if tree else pl.String()


def _fast(payloads: Spans, tree: Tree, wanted: list[str]) -> pl.DataFrame | None:
    """Read all payloads as lines of one text; None where one of them is not a plain object of the expected shape."""
    joined = payloads.joined(extra=1).copy()
    if joined.size == 0:
        return None
    # within JSON a line feed is only white space; the byte behind each payload becomes the end of its line
    joined[(joined == 10) | (joined == 13)] = 32
    joined[np.cumsum(payloads.stop - payloads.start + 1) - 1] = 10
    schema = {name: _dtype(inner) for name, inner in tree.items()}
    try:
        # the empty object in front keeps a payload from passing for a compressed file; it is dropped again
        table = pl.read_ndjson(b"{}\n" + joined.tobytes(), schema=schema).slice(1)
    except pl.exceptions.PolarsError:
        return None
    if table.height != len(payloads):
        return None
    columns = []
    for k, name in enumerate(wanted):
        head, *rest = name.split(".")
        column = pl.col(head)
        for part in rest:
            column = column.struct.field(part)
        columns.append(column.alias(f"c{k}"))
    return table.select(columns)


def _slow(payloads: Spans, wanted: list[str]) -> tuple[pl.DataFrame, NDArray[np.bool_]]:
    """Read payload by payload."""
    good = np.zeros(len(payloads), dtype=np.bool_)
    rows: list[list[str | None]] = []
    paths = [name.split(".") for name in wanted]
    for i, payload in enumerate(payloads.binary()):
        try:
            found = json.loads(payload)
        except (ValueError, RecursionError):
            found = None
        good[i] = isinstance(found, dict)
        rows.append([_leaf(found, path) for path in paths])
    schema = {f"c{k}": pl.String for k in range(len(wanted))}
    return pl.DataFrame(rows, schema=schema, orient="row"), good


def _leaf(value: Any, path: list[str]) -> str | None:
    for part in path:
        value = value.get(part) if isinstance(value, dict) else None
    if isinstance(value, str):
        # JSON may spell half a surrogate pair, which no column of text can hold
        return value.encode("utf-8", errors="replace").decode("utf-8")
    return None if value is None else json.dumps(value)
