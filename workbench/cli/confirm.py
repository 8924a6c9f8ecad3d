"""Commands that take something out say first what will go, and ask."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import UsageError

if TYPE_CHECKING:
    from kempf.flows.jobs.corrections.affected_sets import Affected

F = TypeVar("F", bound=Callable[..., Any])


def reason_option(function: F) -> F:
    """Add ``--reason``."""
    return click.option("--reason", required=True, metavar="TEXT", help="Why, for those who come after.")(function)


def yes_option(function: F) -> F:
    """Add ``--yes``."""
    return click.option("--yes", is_flag=True, help="Do it without asking.")(function)


def confirm(what: str, *, yes: bool) -> None:
    """Say what will be done and ask whether it should be.

    Parameters
    ----------
    what : str
        What will go, a sentence without its full stop.
    yes : bool
        Whether the answer was given with the command.

    Raises
    ------
    UsageError
        ``not_confirmed``: nobody is there to ask.
    """
    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError("not_confirmed", f"{what}.", "Nothing was done. Say --yes to do it.")
    click.confirm(f"{what}. Go on?", abort=True, err=True)


def what_goes(affected: Affected | None, of: str) -> str:
    """Say what follows where logs count no longer, a sentence without its full stop.

    Parameters
    ----------
    of : str
        What is done, such as "day.csv is removed".
    """
    if affected is None:
        return f"{of}; she has no log"
    sets = f"{counted(len(affected.set_ids), 'parameter set')} superseded"
    current = ", her current one among them" if affected.current else ""
    return (
        f"{of}: {counted(len(affected.logs), 'log')} and {counted(len(affected.segment_ids), 'manoeuvre')} of "
        f"{affected.vessel!r} count no longer, {sets}{current}"
    )
