"""Lines on stderr that say what a command does, for whoever asks for them by a log level."""

from __future__ import annotations

import logging
import sys

#: Root of the loggers of this package.
NAME = "kempf"


class _Lines(logging.Handler):
    """Writes to stderr as it is at the moment, so that a progress bar and the lines do not tear each other."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one record."""
        try:
            sys.stderr.write(f"{self.format(record)}\n")
        except Exception:  # noqa: BLE001 - a closed stream ends no command
            self.handleError(record)


def show(level: str) -> None:
    """Show what a command does from a level on.

    Parameters
    ----------
    level : {"debug", "info", "warning", "error"}
    """
    lines = _Lines()
    lines.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s", "%H:%M:%S"))
    logger = logging.getLogger(NAME)
    logger.handlers = [lines]
    logger.setLevel(level.upper())
    logger.propagate = False
