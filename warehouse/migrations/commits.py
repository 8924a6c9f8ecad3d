"""What the commits of every migration share: how much one holds, that nobody comes in between, where it began."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol, TypeVar

from kempf.schemas.errors import KempfError
from kempf.warehouse.store import Warehouse

if TYPE_CHECKING:
    from deltalake import DeltaTable

#: Takes how much of how much is done, and what is done next.
Look = Callable[[int, int, str], None]
#: Rows of one commit: what a writer holds at a time.
MOST_ROWS = 4_000_000


class Counted(Protocol):
    """A piece of a table whose rows are counted."""

    @property
    def rows(self) -> int:
        """How many it has."""


Piece = TypeVar("Piece", bound=Counted)


def batches(todo: Sequence[Piece], most: int, most_rows: int) -> Iterator[list[Piece]]:
    """Yield pieces that are written together, in order.

    Parameters
    ----------
    most, most_rows : int
        Pieces, and rows of several of them, of one commit.
    """
    batch: list[Piece] = []
    for piece in todo:
        if batch and (len(batch) == most or sum(b.rows for b in batch) + piece.rows > most_rows):
            yield batch
            batch = []
        batch.append(piece)
    if batch:
        yield batch


class OfTable(Protocol):
    """What brings one table forward, such as `kempf.warehouse.migrations.by_month`."""

    @property
    def missing(self) -> Callable[[Warehouse, str], Sequence[Counted]]:
        """Returns what is still to be done."""

    @property
    def carry_out(self) -> Callable[[Warehouse, str], Iterator[int]]:
        """Does it; yields how many pieces are done after every commit."""

    @property
    def require_same(self) -> Callable[[Warehouse, str], int]:
        """Compares the rows with those of before, and returns how many parts were compared."""


def carry_out(warehouse: Warehouse, names: Sequence[str], how: OfTable, look: Look) -> dict[str, int]:
    """Bring some tables forward, each compared with what it was.

    Returns
    -------
    dict of str to int
        By table, how many parts were compared; those of which none were are left out.
    """
    compared = {}
    for name in names:
        total = len(how.missing(warehouse, name))
        look(0, max(total, 1), name)
        for done in how.carry_out(warehouse, name):
            look(done, total, name)
        look(0, 1, f"{name}, compared")
        compared[name] = how.require_same(warehouse, name)
    return {name: count for name, count in compared.items() if count}


@contextmanager
def alone(name: str) -> Iterator[None]:
    """Say which table another process committed to, where it did so in between."""
    from deltalake.exceptions import CommitFailedError

    try:
        yield
    except CommitFailedError as error:
        raise overtaken(name) from error


def overtaken(name: str) -> KempfError:
    """Return the error of a table that another process committed to."""
    return KempfError(
        "warehouse_busy",
        f"Another process committed to the table {name} meanwhile.",
        "End whatever else works on the warehouse, then run `kempf migrate` again: it goes on, and nothing is lost.",
        {"table": name},
    )


def version_said(table: DeltaTable, key: str) -> int | None:
    """Return the version that the newest commit which says one says under a key; None where none does."""
    versions = (entry.get(key) for entry in table.history())
    return next((int(version) for version in versions if version is not None), None)
