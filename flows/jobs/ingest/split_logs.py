"""Logs of one recording that a recorder split: they follow each other without a pause, and a hint says so.

A manoeuvre that lies in two logs is found in neither, or as a part in each.
"""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

from kempf.warehouse.tables.logs import LogRow

#: Logs that begin so long after another one ends go on with it, ns; a recorder opens the next file at once.
_PAUSE_NS = 2_000_000_000


def hints(rows: Sequence[LogRow]) -> dict[str, str]:
    """Return by the id of the first log of each recording what to do with its parts.

    Parameters
    ----------
    rows : sequence of LogRow
        MCAP logs are looked at: of other formats the parts cannot be put behind each other as they are.
    """
    chains: list[list[LogRow]] = []
    for row in sorted((row for row in rows if row.format == "mcap"), key=lambda row: row.start_utc_ns):
        if chains and 0 <= row.start_utc_ns - chains[-1][-1].end_utc_ns <= _PAUSE_NS:
            chains[-1].append(row)
        else:
            chains.append([row])
    return {chain[0].log_id: _hint([row.file_name for row in chain]) for chain in chains if len(chain) > 1}


def _hint(names: list[str]) -> str:
    listed = " and ".join(names) if len(names) == 2 else f"{names[0]} to {names[-1]}, {len(names)} logs,"
    return (
        f"{listed} follow each other without a pause, as parts of one recording do. A manoeuvre that lies in two of "
        f"them is not found whole: put them behind each other, as with `cat {quote(names[0])} {quote(names[1])}"
        f"{' ...' if len(names) > 2 else ''} > whole.mcap`, and take that in; what the parts hold too counts once."
    )
