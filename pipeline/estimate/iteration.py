"""What a fit reports while it runs, iteration by iteration, to whoever listens; no result depends on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Iteration:
    """Where a climb of the likelihood stands."""

    #: From 0, where the climb begins.
    number: int
    log_likelihood: float
    #: One step ahead: see `kempf.pipeline.estimate.pooled_fit.one_step_error`.
    error: float
    #: Runs that it goes over: log-likelihoods of different ones cannot be compared.
    runs: int


class Listener(Protocol):
    """Who hears of it; always from the thread that asked for the fit."""

    def begins(self, what: str) -> None:
        """Take notice that a piece of work begins."""

    def counted(self, done: int, total: int) -> None:
        """Take notice that ``done`` of ``total`` parts of this piece of work are finished."""

    def iterated(self, iteration: Iteration) -> None:
        """Take notice of one iteration of a climb; the next climb begins at number 0 again."""

    def fitted(self, last: Iteration) -> None:
        """Take notice of a model that is fitted: the highest that its climbs came to, as it goes on being used."""


class _Silent:
    """Listens to nothing."""

    def begins(self, what: str) -> None:
        pass

    def counted(self, done: int, total: int) -> None:
        pass

    def iterated(self, iteration: Iteration) -> None:
        pass

    def fitted(self, last: Iteration) -> None:
        pass


SILENT: Listener = _Silent()
