"""Whether two parameter sets say the same: bit for bit, within a tolerance, or where not.

A set has results (parameters, covariance, noise, fit, ...), the path that led to them (iterations, convergence), and
provenance. Provenance and parent say where a set came from and take no part. Numbers along the path count for
bit-identity only: a gradient of 1e-12 may be 1e-13 on another processor without any result moving.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from kempf.warehouse.storage.canonical import canonical_json, sha256
from kempf.warehouse.tables.parameter_set import ParameterSet, by_name

Verdict = Literal["bit-identical", "equal within tolerance", "different"]

#: Fields of the path; their numbers are not held against a tolerance.
_PATH = ("iterations", "convergence")


@dataclass(frozen=True)
class Difference:
    """One field in which two sets differ."""

    #: Such as ``parameters.a11.value``.
    field: str
    #: stored, rebuilt: JSON leaf of either; None where one lacks the field.
    stored: Any
    rebuilt: Any
    #: Difference over the size of the field (see `differences`); None where it is no pair of numbers.
    relative: float | None

    def as_json(self) -> dict[str, Any]:
        """Return the difference as JSON content."""
        values = {"field": self.field, "stored": self.stored, "rebuilt": self.rebuilt, "relative": self.relative}
        return {k: repr(v) if isinstance(v, float) and not math.isfinite(v) else v for k, v in values.items()}


def content_digest(parameter_set: ParameterSet) -> str:
    """Return the SHA-256 of what a parameter set says, floats bit for bit; provenance, parent and id left out."""
    return sha256(canonical_json(_hex(_content(parameter_set))))


def differences(stored: ParameterSet, rebuilt: ParameterSet, tolerance: float = 0.0) -> list[Difference]:
    """Return the fields in which two sets differ by more than a tolerance, in the order of their names.

    Parameters
    ----------
    stored, rebuilt : ParameterSet
        Two sets of the same inputs.
    tolerance : float, optional
        Largest relative difference that counts as equal. 0 asks for equal bits. The size of a number is the larger
        magnitude of the two; of an estimate at least its standard error; of an entry of the covariance the product of
        the two standard errors.
    """
    ours, theirs = (dict(_leaves(_content(s))) for s in (stored, rebuilt))
    sizes = _sizes(stored)
    disagreements = []
    for name in sorted(ours.keys() | theirs.keys()):
        a, b = ours.get(name, _ABSENT), theirs.get(name, _ABSENT)
        if _same_bits(a, b):
            continue
        relative = _relative(a, b, sizes.get(name, 0.0))
        on_path = name.partition(".")[0].partition("[")[0] in _PATH
        if tolerance > 0 and relative is not None and (on_path or relative <= tolerance):
            continue
        disagreements.append(Difference(name, None if a is _ABSENT else a, None if b is _ABSENT else b, relative))
    return disagreements


def verdict(stored: ParameterSet, rebuilt: ParameterSet, tolerance: float = 1e-9) -> tuple[Verdict, list[Difference]]:
    """Return whether two sets agree, and every field in which their bits differ.

    Parameters
    ----------
    stored, rebuilt : ParameterSet
        Two sets of the same inputs.
    tolerance : float, optional
        As in `differences`.
    """
    all_of_them = differences(stored, rebuilt)
    if not all_of_them:
        return "bit-identical", []
    beyond = differences(stored, rebuilt, tolerance)
    if tolerance > 0 and not beyond:
        return "equal within tolerance", all_of_them
    return "different", beyond


_ABSENT = object()


def _content(s: ParameterSet) -> dict[str, Any]:
    return {
        "vessel": s.vessel,
        "model": {"name": s.model_name, "spec": s.model_spec, "sha256": s.model_sha256},
        "estimator": s.estimator,
        "settings": s.settings,
        "segment_ids": list(s.segment_ids),
        "log_ids": list(s.log_ids),
        "start_utc_ns": s.start_utc_ns,
        "parameters": by_name(s.parameters),
        "discrete": by_name(s.discrete),
        "noise": by_name(s.noise),
        "order": {name: [e.name for e in getattr(s, name)] for name in ("parameters", "discrete", "noise")},
        "covariance_names": list(s.covariance_names),
        "covariance": [list(row) for row in s.covariance],
        "fit": s.fit,
        "iterations": s.iterations,
        "convergence": s.convergence,
        "warnings": list(s.warnings),
    }


def _sizes(s: ParameterSet) -> dict[str, float]:
    groups = {"parameters": s.parameters, "discrete": s.discrete, "noise": s.noise}
    sizes = {f"{group}.{e.name}.value": abs(e.std or 0.0) for group, es in groups.items() for e in es}
    std = [math.sqrt(max(row[i], 0.0)) for i, row in enumerate(s.covariance)]
    return {**sizes, **{f"covariance[{i}][{j}]": a * b for i, a in enumerate(std) for j, b in enumerate(std)}}


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key in value:
            yield from _leaves(value[key], f"{path}.{key}" if path else str(key))
    elif isinstance(value, list):
        yield f"{path}.length", len(value)
        for i, item in enumerate(value):
            yield from _leaves(item, f"{path}[{i}]")
    else:
        yield path, value


def _hex(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _hex(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_hex(item) for item in value]
    return {"bits": value.hex()} if isinstance(value, float) else value


def _same_bits(a: Any, b: Any) -> bool:
    if type(a) is not type(b):
        return False
    return a.hex() == b.hex() if isinstance(a, float) else bool(a == b)


def _relative(a: Any, b: Any, size: float) -> float | None:
    pair = (a, b)
    if any(isinstance(x, bool) or not isinstance(x, (int, float)) for x in pair):
        return None
    if not all(math.isfinite(x) for x in pair):
        return math.inf
    largest = max(abs(a), abs(b), size if math.isfinite(size) else 0.0)
    return abs(a - b) / largest if largest > 0 else 0.0
