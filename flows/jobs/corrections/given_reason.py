"""The reason that a person gives for what cannot be seen from the data."""

from __future__ import annotations

from kempf.schemas.errors import UsageError


def require_reason(reason: str) -> None:
    """Do nothing where a reason says something.

    Raises
    ------
    UsageError
        ``no_reason``: it is blank.
    """
    if not reason.strip():
        raise UsageError("no_reason", "The reason is blank.", "Say why with --reason, for those who come after.")
