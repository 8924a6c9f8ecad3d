"""What each vessel's results rest on, read by a few reads of whole tables instead of many reads a vessel.

A vessel whose state is the one that her last reprocessing left has nothing to do: the same bytes, profile and code
give the same sets. The state is compared by its digest, never by a time.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import kempf.warehouse as storage
from kempf import flows
from kempf.warehouse import code_version, delta
from kempf.warehouse.canonical import canonical_json, sha256
from kempf.warehouse.keys import vessel_key
from kempf.warehouse.store import Warehouse

#: Sorted, so that the order of rows in the tables does not count.
_Rows = Sequence[Mapping[str, Any]]


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

    @property
    def inputs(self) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
        """What reprocessing starts from and does not change itself."""
        return self.profile_sha256, self.log_ids, self.corrections

    @property
    def digest(self) -> str:
        """SHA-256 of the state and of the code that is responsible for it, 64 hex digits."""
        content = [self.vessel, *self.inputs, self.ingest_ids, self.set_ids, self.aliases]
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
    """Return the state of some vessels or of all, from five reads.

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
    asked = None if vessels is None else sorted(set(vessels))
    where = {} if asked is None else {"vessel_key": [vessel_key(name) for name in asked]}

    def rows(table: str, *columns: str) -> dict[str, list[dict[str, Any]]]:
        found: dict[str, list[dict[str, Any]]] = defaultdict(list)
        frame = delta.read(warehouse, table, where, ("vessel", *columns))
        for row in frame.sort(frame.columns, nulls_last=True).rows(named=True):
            found[row["vessel"]].append(row)
        return found

    profiles = {
        name: found
        for name, found in rows("vessels", "revision", "profile_sha256", "removed").items()
        if not found[-1]["removed"]
    }
    ingests = rows("logs", "revision", "log_id", "ingest_id", "removed")
    sets = rows("parameter_sets", "parameter_set_id")
    pointers = rows("aliases", "alias", "parameter_set_id")
    said: dict[str, list[str]] = defaultdict(list)
    for row in delta.read(warehouse, "corrections").sort("number").rows(named=True):
        said[row["log_id"]].append(canonical_json(row))
    names = sorted(profiles) if asked is None else asked
    return {
        name: _state(name, profiles.get(name, ()), ingests[name], sets[name], pointers[name], said) for name in names
    }


def _state(
    vessel: str, profiles: _Rows, ingests: _Rows, sets: _Rows, pointers: _Rows, said: Mapping[str, Sequence[str]]
) -> VesselState:
    last = {row["log_id"]: row for row in ingests}  # the highest revision stays
    current = {log_id: row["ingest_id"] for log_id, row in last.items() if row["removed"] is None}
    return VesselState(
        vessel,
        profiles[-1]["profile_sha256"] if profiles else "",
        tuple(sorted(current)),
        tuple(sorted(current.values())),
        tuple(row["parameter_set_id"] for row in sets),
        tuple((row["alias"], row["parameter_set_id"]) for row in pointers),
        tuple(one for log_id in sorted(current) for one in said.get(log_id, ())),
    )
