"""The errors a person meets.

Each says what was found, what was expected and what to do next, carries a stable code, and is also a subclass of
the builtin a Python caller would catch. The same object becomes the command line's message and its JSON.
"""

from __future__ import annotations

from typing import Any


class KempfError(Exception):
    """Base of every error that is shown to a person.

    Parameters
    ----------
    code : str
        Stable, machine-readable name of the error, such as ``empty_log``.
    message : str
        What was found and what was expected, one sentence.
    next_step : str
        What the person should do now.
    details : dict, optional
        Facts behind the message, JSON-serialisable.
    """

    exit_code = 1

    def __init__(self, code: str, message: str, next_step: str, details: dict[str, Any] | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.next_step = next_step
        self.details = details or {}

    def as_json(self) -> dict[str, Any]:
        """Return the error as the JSON object of the command line."""
        return {
            "error": {
                "code": self.code,
                "message": self.message,
                "details": self.details,
                "next_step": self.next_step,
            }
        }

    def __str__(self) -> str:
        return f"{self.message} {self.next_step}"


class UsageError(KempfError, ValueError):
    """The request itself is wrong: an option, a unit, a profile."""

    exit_code = 2


class DataRejected(KempfError, ValueError):
    """The data cannot be used as they are."""

    exit_code = 3


class NotFound(KempfError, LookupError):
    """A file, vessel, log, segment or parameter set that does not exist."""

    exit_code = 4


class ThresholdExceeded(KempfError):
    """A check the user asked for, such as ``--fail-above``, did not pass."""

    exit_code = 5
