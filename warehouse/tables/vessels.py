"""Vessels and the versions of their profiles; the latest registered is the current one."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kempf.schemas.errors import NotFound
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import quoted, require_apart, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse


@dataclass(frozen=True)
class VesselVersion:
    """One version of a vessel's profile."""

    vessel: str
    revision: int
    profile_sha256: str
    profile: VesselProfile


def register(warehouse: Warehouse, vessel: str, profile: VesselProfile) -> bool:
    """Make a profile the current one of a vessel; no commit where it is already.

    Returns
    -------
    bool
        Whether anything changed.
    """
    return bool(register_all(warehouse, [(vessel, profile)]))


def register_all(
    warehouse: Warehouse, profiles: Sequence[tuple[str, VesselProfile]]
) -> tuple[tuple[str, VesselProfile], ...]:
    """Make each profile in turn the current one of its vessel, in at most one commit.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    profiles : sequence of (str, VesselProfile)
        Name of the vessel and profile; of several for one vessel the last stays current, all are kept.

    Returns
    -------
    tuple of (str, VesselProfile)
        Those that were not current when their turn came.

    Raises
    ------
    UsageError
        ``vessel_name``; ``vessel_key_taken``: another vessel has the folders that this name would have.
    """
    keys = {vessel: vessel_key(vessel) for vessel, _ in profiles}
    if not keys:
        return ()

    def attempt() -> tuple[tuple[str, VesselProfile], ...]:
        with delta.ensured(warehouse, "vessels") as table:
            known = delta.rows(table, "vessels").sort("revision").rows(named=True)
            last = {
                row["vessel"]: (row["revision"], row["profile_json"] if row["removed"] is None else None)
                for row in known
            }  # the highest revision stays
            require_apart([*((row["vessel_key"], row["vessel"]) for row in known), *((k, v) for v, k in keys.items())])
            rows: list[dict[str, Any]] = []
            changed = []
            for vessel, profile in profiles:
                revision, stored = last.get(vessel, (0, None))
                if stored == profile.canonical_json():
                    continue
                last[vessel] = (revision + 1, profile.canonical_json())
                changed.append((vessel, profile))
                rows.append(
                    {
                        "vessel_key": keys[vessel],
                        "vessel": vessel,
                        "revision": revision + 1,
                        "profile_sha256": profile.sha256,
                        "profile_json": profile.canonical_json(),
                        "removed": None,
                    }
                )
            if rows:
                named = (f"(vessel_key = {quoted(row['vessel_key'])} AND revision = {row['revision']})" for row in rows)
                delta.replace(table, "vessels", rows, " OR ".join(named))
            return tuple(changed)

    return with_retry(attempt)


def remove(warehouse: Warehouse, vessel: str, reason: str) -> bool:
    """Let a vessel count no longer; her profiles are kept. Her logs are to be removed before.

    Returns
    -------
    bool
        Whether she counted before; else there is no commit.
    """
    key = vessel_key(vessel)

    def attempt() -> bool:
        with delta.ensured(warehouse, "vessels") as table:
            rows = delta.rows(table, "vessels", {"vessel_key": key}).sort("revision").rows(named=True)
            if not rows or rows[-1]["removed"] is not None:
                return False
            row = {**rows[-1], "revision": rows[-1]["revision"] + 1, "removed": reason}
            delta.replace(table, "vessels", [row], f"vessel_key = {quoted(key)} AND revision = {row['revision']}")
            return True

    return with_retry(attempt)


def bring_back(warehouse: Warehouse, vessel: str) -> bool:
    """Let a vessel that was removed count again, with the profile that was her last.

    Returns
    -------
    bool
        Whether she had been removed; else nothing changes.
    """
    if vessel not in removed(warehouse):
        return False
    last = [version for version in all_versions(warehouse) if version.vessel == vessel][-1]
    return register(warehouse, vessel, last.profile)


def _last_rows(warehouse: Warehouse, where: Where, columns: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Return the last row of every vessel that was not removed, by name, sorted."""
    last = _every_last_row(warehouse, where, columns)
    return {vessel: row for vessel, row in last.items() if row["removed"] is None}


def _every_last_row(warehouse: Warehouse, where: Where, columns: Sequence[str]) -> dict[str, dict[str, Any]]:
    wanted = (*columns, "vessel", "revision", "removed") if columns else ()
    rows = delta.read(warehouse, "vessels", where, wanted).sort("vessel", "revision").rows(named=True)
    return {row["vessel"]: row for row in rows}


def removed(warehouse: Warehouse) -> dict[str, str]:
    """Return why each vessel that counts no longer was removed, by name, sorted; none where there is no warehouse."""
    if not warehouse.exists():
        return {}
    last = _every_last_row(warehouse, {}, ("vessel_key",))
    return {vessel: row["removed"] for vessel, row in last.items() if row["removed"] is not None}


def names(warehouse: Warehouse) -> list[str]:
    """Return the names of all vessels, sorted."""
    return list(_last_rows(warehouse, {}, ("vessel_key",)))


def profiles(warehouse: Warehouse) -> dict[str, VesselProfile]:
    """Return the current profile of every vessel, by name, sorted; none where there is no warehouse."""
    if not warehouse.exists():
        return {}
    return {vessel: _version(row).profile for vessel, row in _last_rows(warehouse, {}).items()}


def versions(warehouse: Warehouse, vessel: str) -> list[VesselVersion]:
    """Return every version of a vessel's profile, the current one last.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    rows = delta.read(warehouse, "vessels", {"vessel_key": vessel_key(vessel)}).sort("revision")
    if rows.height == 0 or rows["removed"][-1] is not None:
        raise _no_vessel(vessel, names(warehouse))
    return [_version(row) for row in rows.rows(named=True)]


def all_versions(warehouse: Warehouse) -> list[VesselVersion]:
    """Return every version of every vessel's profile, those of removed ones too, sorted by vessel and revision.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    return [_version(row) for row in delta.read(warehouse, "vessels").sort("vessel", "revision").rows(named=True)]


def current(warehouse: Warehouse, vessel: str) -> VesselProfile:
    """Return the current profile of a vessel.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    return versions(warehouse, vessel)[-1].profile


def current_hashes(warehouse: Warehouse, vessel: str | None = None) -> dict[str, str]:
    """Return the hash of the current profile by vessel, of one or of all; one that is not known is left out.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    where = {} if vessel is None else {"vessel_key": vessel_key(vessel)}
    return {name: row["profile_sha256"] for name, row in _last_rows(warehouse, where, ("profile_sha256",)).items()}


def require(warehouse: Warehouse, vessel: str) -> None:
    """Do nothing where the vessel is known.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    versions(warehouse, vessel)


def get(warehouse: Warehouse, profile_sha256: str) -> VesselProfile:
    """Return a profile by its hash.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_profile``.
    """
    frame = delta.read(warehouse, "vessels", {"profile_sha256": profile_sha256})
    if frame.height == 0:
        raise NotFound(
            "no_profile",
            f"No vessel has a profile with the hash {profile_sha256!r}.",
            "List the profiles with `kempf vessels show NAME`.",
            {"profile_sha256": profile_sha256},
        )
    return _version(frame.sort("vessel", "revision").row(0, named=True)).profile


def _version(row: Mapping[str, Any]) -> VesselVersion:
    profile = VesselProfile.model_validate(json.loads(row["profile_json"]))
    return VesselVersion(row["vessel"], row["revision"], row["profile_sha256"], profile)


def _no_vessel(vessel: str, known: list[str]) -> NotFound:
    return NotFound(
        "no_vessel",
        f"There is no vessel {vessel!r}; known: {', '.join(known) or 'none'}.",
        "Give one of these with --vessel, or ingest her logs with `kempf ingest PATH... --vessel NAME --new-vessel`.",
        {"vessel": vessel, "known": known},
    )
