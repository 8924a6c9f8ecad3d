"""A document as JSON text."""

from __future__ import annotations

import json
from typing import Any

from kempf.warehouse.storage.canonical import plain


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
    return json.dumps(plain(content), indent=2, ensure_ascii=ascii_only)
