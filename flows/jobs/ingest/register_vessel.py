"""The job that gives a vessel a profile."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kempf.flows.jobs.ingest.files import read_profiles
from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels


def set_vessel(warehouse: Warehouse, vessel: str, paths: Sequence[Path]) -> bool:
    """Replace a vessel's current profile by that of some files.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    paths : sequence of Path
        Profile files, at least one.

    Returns
    -------
    bool
        Whether anything changed.

    Raises
    ------
    UsageError
        No file, files that disagree, or a file that names another vessel.
    """
    if not paths:
        raise UsageError("no_profile_given", "No profile was given.", "Add --profile FILE.")
    profile = read_profiles(paths)
    if profile.vessel not in (None, vessel):
        raise UsageError(
            "profiles_disagree",
            f"The profile is of {profile.vessel!r}, not of {vessel!r}.",
            "Give her own profile, or call her by this name.",
            {"profile": profile.vessel, "vessel": vessel},
        )
    return vessels.register(warehouse, vessel, profile.model_copy(update={"vessel": vessel}))
