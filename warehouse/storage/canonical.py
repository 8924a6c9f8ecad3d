"""One text for one value: the JSON that is stored, compared and hashed.

Sorted keys, no blanks, floats by their shortest exact decimal form, so that equal bits give equal text and back.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

#: most of what is read back from a table
_AS_IT_IS = frozenset({str, int, bool, type(None)})


def plain(value: Any, *, name_non_finite: bool = False) -> Any:
    """Return ``value`` as JSON knows it: dict, list, str, int, float, bool or None.

    Parameters
    ----------
    value : object
        Nested mappings, sequences, numpy scalars and arrays, and JSON's own types.
    name_non_finite : bool, optional
        Whether NaN and the infinities become ``"nan"``, ``"inf"``, ``"-inf"`` (so that their hashes differ) or,
        the default, null (JSON has no other word).

    Raises
    ------
    TypeError
        Something else stands in it.

    Examples
    --------
    >>> plain({"b": (1, float("nan"))})
    {'b': [1, None]}
    """
    exact = type(value)
    # what is read back from a table, which is nearly all, needs no search for what it might be
    if exact in _AS_IT_IS or (exact is float and math.isfinite(value)):
        return value
    if exact is dict or exact is list:
        return _container(value, name_non_finite)
    for kind in (str, int):
        if isinstance(value, kind):
            return kind(value)
    if isinstance(value, float):
        named = repr(float(value)) if name_non_finite else None
        return float(value) if math.isfinite(value) else named
    if hasattr(value, "tolist"):  # numpy scalar or array
        return plain(value.tolist(), name_non_finite=name_non_finite)
    return _container(value, name_non_finite)


def _container(value: Any, name_non_finite: bool) -> dict[str, Any] | list[Any]:
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise TypeError(f"the keys of a JSON object are text, found {[k for k in value if not isinstance(k, str)]}")
        return {
            str(key): item if type(item) in _AS_IT_IS else plain(item, name_non_finite=name_non_finite)
            for key, item in value.items()
        }
    if isinstance(value, Sequence) and not isinstance(value, (bytes, bytearray)):
        return [item if type(item) in _AS_IT_IS else plain(item, name_non_finite=name_non_finite) for item in value]
    raise TypeError(f"{type(value).__name__} cannot be written as JSON")


def canonical_json(value: Any, *, name_non_finite: bool = False) -> str:
    """Return the one JSON text of ``value``, see `plain`.

    Examples
    --------
    >>> canonical_json({"b": 0.1, "a": [1, None]})
    '{"a":[1,null],"b":0.1}'
    """
    tree = plain(value, name_non_finite=name_non_finite)
    return json.dumps(tree, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def sha256(text: str) -> str:
    """Return the SHA-256 of a text in UTF-8, 64 hex digits."""
    return hashlib.sha256(text.encode()).hexdigest()
