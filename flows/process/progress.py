"""How a long job reports how far it is, without knowing who listens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable


class Progress(Protocol):
    """Called at the start of every piece of work."""

    def __call__(self, done: int, total: int, what: str) -> None:
        """Take notice: ``done`` of ``total`` pieces are finished, ``what`` begins; at the end ``done == total``."""


@dataclass(frozen=True)
class Figures:
    """Where a fit stands after an iteration."""

    #: Counted on from one climb and one model to the next, from 1.
    iteration: int
    #: Which climb of the likelihood it belongs to, from 1.
    climb: int
    log_likelihood: float
    #: Of predictions one step ahead, as a share of the motion, see
    #: `kempf.pipeline.estimate.pooled_fit.one_step_error`; None where it is no number.
    error: float | None
    #: Whether this is where the climbs of a model came to; it counts as a climb by itself.
    fitted: bool = False


@runtime_checkable
class FitProgress(Progress, Protocol):
    """A `Progress` that takes the figures of a fit too; others are called with a sentence of them."""

    def iterated(self, done: int, total: int, what: str, figures: Figures) -> None:
        """Take notice of an iteration of ``what``."""


def silent(done: int, total: int, what: str) -> None:
    """Ignore all progress."""
