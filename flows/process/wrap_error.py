"""An error that nobody foresaw, as one that can be told."""

from __future__ import annotations

from kempf.schemas.errors import KempfError


def as_told(error: Exception) -> KempfError:
    """Return an error as one that can be told; an unforeseen one keeps its kind and words, and is the cause.

    Parameters
    ----------
    error : Exception

    Examples
    --------
    >>> as_told(ZeroDivisionError("division by zero")).message
    'ZeroDivisionError: division by zero'
    """
    if isinstance(error, KempfError):
        return error
    told = KempfError(
        "internal",
        f"{type(error).__name__}: {error}",
        "This is a fault of kempf: report it with the log it happened on.",
    )
    told.__cause__ = error
    return told
