"""How the errors of parameters go together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from kempf.workbench.web.draw.svg import drawing, element

_CELL, _LEFT = 38.0, 150.0


def draw_correlation(names: Sequence[str], covariance: Sequence[Sequence[float]]) -> Markup | None:
    """Return the correlation of every two parameters, in hundredths; None where there are fewer than two.

    Parameters
    ----------
    names : sequence of str
    covariance : sequence of sequence of float, shape (n, n)
    """
    matrix = np.array(covariance, dtype=np.float64)
    known = np.flatnonzero(np.diag(matrix) > 0.0) if matrix.size else np.zeros(0, dtype=np.int64)
    if known.size < 2:
        return None
    spread = np.sqrt(np.diag(matrix)[known])
    correlation = matrix[np.ix_(known, known)] / np.outer(spread, spread)
    n = known.size
    parts: list[Markup] = []
    for i in range(n):
        y = _CELL * i + 8.0
        parts.append(element("text", names[known[i]], x=_LEFT - 8.0, y=y + 23.0, text_anchor="end", class_="label"))
        for k in range(i + 1):
            value = float(correlation[i, k])
            x = _LEFT + _CELL * k
            kind = "positive" if value > 0 else "negative"
            parts.append(
                element(
                    "rect", x=x, y=y, width=_CELL - 2, height=_CELL - 2, class_=f"cell {kind}", fill_opacity=abs(value)
                )
            )
            words = f"{100.0 * value:.0f}"
            strong = " inverse" if abs(value) > 0.6 else ""
            parts.append(
                element("text", words, x=x + _CELL / 2 - 1, y=y + 23.0, text_anchor="middle", class_=f"label{strong}")
            )
    return drawing(_LEFT + _CELL * n + 8.0, _CELL * n + 16.0, "Correlation of the parameters, in hundredths", *parts)
