"""A document as JSON text."""

from __future__ import annotations

import json
from typing import Any


def json_text(content: Any, *, ascii_only: bool = False) -> str:
    """Return content as JSON without a line end; what is not finite becomes null.

    Parameters
    ----------
    ascii_only : bool, optional
        Write letters beyond ASCII as escapes, for a terminal that has none.

    Examples
    --------
    >>> print(json_text({"ship": "Märta", "k": float("nan")}))
    {
      "ship": "Märta",
      "k": null
    }
    """
    return json.dumps(_finite(content), indent=2, ensure_ascii=ascii_only)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not (abs(value) < float("inf")):
        return None
    return value
