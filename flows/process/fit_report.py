"""What a fit reports of its iterations, handed on as progress of the job."""

from __future__ import annotations

import numpy as np

from kempf.flows.process.progress import Figures, FitProgress, Progress, silent
from kempf.pipeline.estimate.iteration import SILENT, Iteration, Listener

#: pieces that are said to be still to come where nobody knows how many
_TO_COME = 5


def reported_to(progress: Progress, pieces: int | None = None) -> Listener:
    """Return a listener that hands on what a fit reports; it listens to nothing where nobody takes notice.

    Parameters
    ----------
    pieces : int, optional
        How many pieces of work there are, where that is known.
    """
    return SILENT if progress is silent else FitReport(progress, pieces)


class FitReport:
    """A listener.

    Parameters
    ----------
    progress : Progress
        Notified of pieces of work, of their parts, and of iterations: with figures where it takes them, else in words.
    pieces : int, optional
        How many pieces of work there are, where that is known.
    """

    def __init__(self, progress: Progress, pieces: int | None = None) -> None:
        self._progress, self._pieces = progress, pieces
        self._begun, self._what = 0, "fitting"
        self._runs = 0
        self._iteration = self._climb = 0

    @property
    def _far(self) -> tuple[int, int]:
        if self._pieces is None:
            return self._begun, self._begun + _TO_COME
        return max(self._begun - 1, 0), max(self._pieces, self._begun)

    def begins(self, what: str) -> None:
        """Hand on that a piece of work begins."""
        self._begun, self._what = self._begun + 1, what
        self._progress(*self._far, what)

    def counted(self, done: int, total: int) -> None:
        """Hand on how far it is."""
        self._progress(done, total, self._what)

    def iterated(self, iteration: Iteration) -> None:
        """Hand on an iteration; of one over a part of the runs no figures, for they cannot be compared."""
        self._runs = max(self._runs, iteration.runs)
        if iteration.runs == self._runs:
            self._climb += iteration.number == 0
            self._show(iteration, fitted=False)

    def fitted(self, last: Iteration) -> None:
        """Hand on where the climbs of a model came to."""
        self._climb += 1
        self._show(last, fitted=True)

    def _show(self, iteration: Iteration, *, fitted: bool) -> None:
        if not np.isfinite(iteration.log_likelihood):
            return
        self._iteration += 1
        error = float(iteration.error) if np.isfinite(iteration.error) else None
        figures = Figures(self._iteration, self._climb, float(iteration.log_likelihood), error, fitted)
        if isinstance(self._progress, FitProgress):
            self._progress.iterated(*self._far, self._what, figures)
        else:
            self._progress(*self._far, in_words(self._what, figures))


def in_words(what: str, figures: Figures) -> str:
    """Return a line for a terminal.

    Examples
    --------
    >>> in_words("fitting rudder_lag", Figures(7, 2, 1234.52, 0.0314))
    'fitting rudder_lag, iteration 7: log-likelihood 1234.5, error one step ahead 3.14 %'
    """
    error = "" if figures.error is None else f", error one step ahead {100.0 * figures.error:.3g} %"
    return f"{what}, iteration {figures.iteration}: log-likelihood {figures.log_likelihood:.1f}{error}"
