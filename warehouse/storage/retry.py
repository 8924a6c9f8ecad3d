"""Trying a commit again when another writer came first."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from typing import TypeVar

from kempf.schemas.errors import KempfError

T = TypeVar("T")

ATTEMPTS = 30
FIRST_WAIT_S = 0.02
LONGEST_WAIT_S = 1.0


def with_retry(action: Callable[[], T], sleep: Callable[[float], None] = time.sleep) -> T:
    """Run ``action``; after a lost race for a commit wait a random while and run it again.

    The action must read what it decides upon anew each time. The waiting is random so that writers that collided do
    not collide again; nothing of it is stored.

    Parameters
    ----------
    action : callable
        Reads the table, decides, commits; called up to `ATTEMPTS` times.
    sleep : callable, optional
        Takes seconds.

    Returns
    -------
    object
        What the action returned.

    Raises
    ------
    KempfError
        ``warehouse_busy``: the race was lost every time.
    """
    from deltalake.exceptions import CommitFailedError

    for attempt in range(ATTEMPTS):
        try:
            return action()
        except CommitFailedError as error:
            last = error
            longest = min(LONGEST_WAIT_S, FIRST_WAIT_S * 2.0**attempt)
            sleep(random.uniform(0.1, 1.0) * longest)  # noqa: S311 - no secret, only spreads writers
    raise KempfError(
        "warehouse_busy",
        f"Other writers committed first {ATTEMPTS} times in a row.",
        "Run the command again; nothing was written half.",
        {"last": str(last)},
    ) from last
