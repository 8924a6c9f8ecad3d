"""Progress of a job, written into the queue."""

from __future__ import annotations

import time

from kempf.flows.process.progress import Figures
from kempf.workbench.web.jobs.queue import Queue, Tick

#: ticks of one piece of work are written together where they come quicker: each time costs a commit
_APART_S = 0.2


class JobProgress:
    """A `kempf.flows.process.progress.FitProgress`.

    Parameters
    ----------
    queue : Queue
    name : str
        Id of the job.
    """

    def __init__(self, queue: Queue, name: str) -> None:
        self._queue, self._name = queue, name
        self._waiting: list[Tick] = []
        self._what, self._written = "", 0.0

    def __call__(self, done: int, total: int, what: str) -> None:
        """Take notice of how far the job is."""
        self._take(Tick(0, done, total, what))

    def iterated(self, done: int, total: int, what: str, figures: Figures) -> None:
        """Take notice of an iteration of a fit."""
        self._take(Tick(0, done, total, what, figures))

    def write(self) -> None:
        """Write down what waits."""
        if self._waiting:
            self._queue.tick(self._name, self._waiting)
            self._waiting = []
        self._written = time.monotonic()

    def _take(self, tick: Tick) -> None:
        self._waiting.append(tick)
        if tick.what != self._what or time.monotonic() - self._written >= _APART_S:
            self._what = tick.what
            self.write()
