"""What each vessel's results rest on, read by a few reads of whole tables instead of many reads a vessel.

A vessel whose state is the one that her last reprocessing left has nothing to do: the same bytes, profile and code
give the same sets. The state is compared by its digest, never by a time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import kempf.warehouse as storage
from kempf import flows
from kempf.warehouse.code import code_version
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json, sha256
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.equivalents import Codes, codes_of

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class VesselState:
    """What the results of one vessel rest on now."""

    vessel: str
    #: Of her current profile; blank where she has none.
    profile_sha256: str = ""
    #: log_ids, ingest_ids: Her logs by their bytes, and how each was last read; sorted.
    log_ids: tuple[str, ...] = ()
    ingest_ids: tuple[str, ...] = ()
    #: Her parameter sets, sorted.
    set_ids: tuple[str, ...] = ()
    #: What her aliases point to, sorted.
    aliases: tuple[tuple[str, str], ...] = ()
    #: What was said of manoeuvres in her logs, in order.
    corrections: tuple[str, ...] = ()
    #: Notes that state a draught, in order.
    draughts: tuple[str, ...] = ()
    #: Fingerprints under which the present code goes on in the warehouse.
    codes: Codes | None = None

    @property
    def inputs(self) -> tuple[str, tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
        """What reprocessing starts from and does not change itself."""
        return self.profile_sha256, self.log_ids, self.corrections, self.draughts

    @property
    def digest(self) -> str:
        """SHA-256 of the state and of the code that is responsible for it, 64 hex digits."""
        codes = vars(self.codes) if self.codes else None
        content = [self.vessel, *self.inputs, self.ingest_ids, self.set_ids, self.aliases, codes]
        return sha256(canonical_json([responsible_code(), *content]))


def responsible_code() -> list[str]:
    """Return the fingerprints of the code that makes segments and sets, and of the code that decides which are made."""
    return [code_version.fingerprint("segment"), *code_of_sets()]


def code_of_sets() -> list[str]:
    """Return the fingerprints of the code that makes parameter sets, and of the code that puts warnings beside them."""
    return [code_version.fingerprint("estimate"), deciding_code()]


@cache
def deciding_code() -> str:
    """Return the fingerprint of the code that decides what is made of what, and how it is kept."""
    return code_version.fingerprint_of_packages(flows, storage)


def fleet_state(warehouse: Warehouse, vessels: Iterable[str] | None = None) -> dict[str, VesselState]:
    """Return the state of some vessels or of all, from seven reads.

    Parameters
    ----------
    vessels : iterable of str, optional
        Also those that the warehouse does not know; all of its vessels by default.

    Returns
    -------
    dict of str to VesselState
        By vessel, sorted by name.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    import polars as pl

    names = None if vessels is None else sorted(set(vessels))
    where: Where = {} if names is None else {"vessel_key": [vessel_key(name) for name in names]}

    def rows(table: str, *columns: str) -> pl.DataFrame:
        return delta.read(warehouse, table, where, ("vessel", *columns))

    newest = pl.all().sort_by("revision").last()
    counts = pl.col("removed").is_null()
    profiles = rows("vessels", "revision", "profile_sha256", "removed").group_by("vessel").agg(newest).filter(counts)
    ingests = rows("logs", "log_id", "revision", "ingest_id", "removed").group_by("vessel", "log_id").agg(newest)
    current = ingests.filter(counts)
    log_ids, ingest_ids = _by_vessel(current, "log_id"), _by_vessel(current, "ingest_id")
    sets = _by_vessel(rows("parameter_sets", "parameter_set_id"), "parameter_set_id")
    pointers = _by_vessel(rows("aliases", "alias", "parameter_set_id"), "alias", "parameter_set_id")
    corrections: dict[str, list[str]] = defaultdict(list)
    for row in delta.read(warehouse, "corrections").sort("number").rows(named=True):
        corrections[row["log_id"]].append(canonical_json(row))
    draughts: dict[str, list[str]] = defaultdict(list)
    for note in delta.read(warehouse, "notes", where).sort("number").rows(named=True):
        if note["draught_m"] is not None:
            draughts[note["vessel"]].append(canonical_json(note))
    codes = codes_of(warehouse)
    hashes = dict(profiles.select("vessel", "profile_sha256").rows())
    states = {}
    for name in sorted(hashes) if names is None else names:
        (held,), (read_as,), (set_ids,) = (of.get(name, ([],)) for of in (log_ids, ingest_ids, sets))
        states[name] = VesselState(
            name,
            hashes.get(name, ""),
            tuple(held),
            tuple(read_as),
            tuple(set_ids),
            tuple(zip(*pointers.get(name, ([], [])), strict=True)),
            tuple(correction for log_id in held for correction in corrections.get(log_id, ())) if corrections else (),
            tuple(draughts.get(name, ())),
            codes,
        )
    return states


def _by_vessel(frame: pl.DataFrame, *columns: str) -> dict[str, tuple[list[str], ...]]:
    """Return the values of columns by vessel, in the order of the rows sorted by them."""
    grouped = frame.sort(columns).group_by("vessel", maintain_order=True).agg(columns)
    return {row[0]: row[1:] for row in grouped.rows()}
