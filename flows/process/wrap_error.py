"""Wrap unexpected exceptions as errors of the house."""

from __future__ import annotations

from kempf.schemas.errors import KempfError


def wrapped(error: Exception) -> KempfError:
    """Return an error of the house as it is, any other wrapped: with its kind and words, and as the cause.

    Examples
    --------
    >>> wrapped(ZeroDivisionError("division by zero")).message
    'ZeroDivisionError: division by zero'
    """
    if isinstance(error, KempfError):
        return error
    wrapping = KempfError(
        "internal",
        f"{type(error).__name__}: {error}",
        "This is a fault of kempf: report it with the log it happened on.",
    )
    wrapping.__cause__ = error
    return wrapping
