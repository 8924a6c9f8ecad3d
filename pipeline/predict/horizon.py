"""How far ahead a model predicts: one step, some seconds, or freely with no measurement at all."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from kempf.schemas.errors import UsageError

Kind = Literal["one step", "ahead", "free run", "free run, fitted to legs"]


@dataclass(frozen=True)
class Horizon:
    """A horizon."""

    #: As it is asked for: ``1``, ``10s``, ``free``, ``legs``.
    name: str
    #: What the prediction takes of the measurements; fitted to legs: with other parameters than the likelihood's.
    kind: Kind
    #: Of ``ahead``.
    seconds: float | None = None

    @property
    def runs_freely(self) -> bool:
        """Whether the prediction takes no measurement in."""
        return self.kind in ("free run", "free run, fitted to legs")

    @property
    def words(self) -> str:
        """As a person reads it."""
        return self.kind if self.seconds is None else f"{self.seconds:g} s ahead"


def horizon_of(text: str) -> Horizon:
    """Return the horizon that a text asks for.

    Raises
    ------
    UsageError
        ``horizon_unknown``.

    Examples
    --------
    >>> horizon_of("10s").seconds, horizon_of("free").words
    (10.0, 'free run')
    """
    asked = text.strip().lower()
    if asked == "1":
        return Horizon("1", "one step")
    if asked == "free":
        return Horizon("free", "free run")
    if asked == "legs":
        return Horizon("legs", "free run, fitted to legs")
    seconds = re.fullmatch(r"(\d+(?:\.\d+)?) ?s", asked)
    if seconds and isfinite(float(seconds[1])) and float(seconds[1]) > 0.0:
        return Horizon(f"{float(seconds[1]):g}s", "ahead", float(seconds[1]))
    raise UsageError(
        "horizon_unknown",
        f"--horizon {text[:40]!r} is none; expected 1 (one step), a time such as 10s or 60s, free, or legs.",
        "Write for instance --horizon 60s.",
    )
