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
    #: Which climb it belongs to, from 1; where a model's climbs came to is one by itself.
    climb: int
    log_likelihood: float
    #: Of predictions one step ahead, as a share of the motion; see
    #: `kempf.pipeline.estimate.pooled_fit.one_step_error`.
    error: float


@runtime_checkable
class FitProgress(Progress, Protocol):
    """A `Progress` that takes the figures of a fit too; others are called with a sentence of them."""

    def iterated(self, done: int, total: int, what: str, figures: Figures) -> None:
        """Take notice of an iteration of ``what``."""


def silent(done: int, total: int, what: str) -> None:
    """Ignore all progress."""
