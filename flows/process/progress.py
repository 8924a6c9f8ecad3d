"""How a long job reports how far it is, without knowing who listens."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Called at the start of every piece of work."""

    def __call__(self, done: int, total: int, what: str) -> None:
        """Take notice: ``done`` of ``total`` pieces are finished, ``what`` begins; at the end ``done == total``."""


def silent(done: int, total: int, what: str) -> None:
    """Ignore all progress."""
