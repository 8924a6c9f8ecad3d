"""The jobs that end a quarantine: a file is ingested as a person says, or dismissed for good."""

from __future__ import annotations

from dataclasses import replace

from kempf.flows.jobs.inbox.take_inbox import Placed, take
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome, settle_vessel
from kempf.schemas.errors import DataRejected, KempfError, NotFound, UsageError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.sources.source_folder import SourceFolder
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import inbox
from kempf.warehouse.tables.inbox import InboxFile


def release(
    warehouse: Warehouse,
    name: str,
    vessel: str | None = None,
    given: VesselProfile | None = None,
    *,
    new_vessel: bool = False,
) -> IngestOutcome:
    """Ingest a file that is in quarantine.

    Parameters
    ----------
    name : str
        Its address, or the end of it.
    vessel : str, optional
        Whose it is; else the profile says so, or it is whose it was taken for.
    given : VesselProfile, optional
        Laid over the stored profile of the vessel.
    new_vessel : bool, optional
        Whether a vessel of this name that is not known yet is made.

    Raises
    ------
    NotFound
        ``not_in_quarantine``, ``no_such_file``, ``no_vessel``.
    UsageError
        ``no_vessel_named``, ``profiles_disagree``, ``ambiguous_file``.
    KempfError
        It cannot be read: it stays in quarantine, for this reason.
    """
    held = inbox.by_name(warehouse, name)
    whose = vessel or (given.vessel if given else None) or held.vessel
    settled, profile = settle_vessel(warehouse, whose, given, new_vessel=new_vessel)
    parent, _, path = held.address.rpartition("/")
    folder = SourceFolder(parent, warehouse.storage_options)
    row, outcome = take(warehouse, folder, Placed(folder.file(path), settled, profile), by_hand=True)
    inbox.record(warehouse, [row])
    if outcome is None:
        raise _still_in(row)
    return outcome


def dismiss(warehouse: Warehouse, name: str, reason: str) -> InboxFile:
    """Leave a file that is in quarantine alone for good; it is looked at again only where it is written anew.

    Parameters
    ----------
    name : str
        Its address, or the end of it.
    reason : str
        Why, for those who come after.

    Raises
    ------
    NotFound
        ``not_in_quarantine``.
    UsageError
        ``ambiguous_file``, ``no_reason``.
    """
    if not reason.strip():
        raise UsageError("no_reason", "The reason is blank.", "Say with --reason why this file is no log.")
    row = replace(inbox.by_name(warehouse, name), outcome="dismissed", message=reason, next_step=None)
    inbox.record(warehouse, [row])
    return row


def _still_in(row: InboxFile) -> KempfError:
    """Return why a file stays in quarantine."""
    kind = NotFound if row.code == "no_such_file" else DataRejected
    return kind(row.code or "internal", row.message or "", row.next_step or "", {"path": row.address})
