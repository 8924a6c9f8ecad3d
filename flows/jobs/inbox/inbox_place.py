"""Whose the files of an inbox are: by their folder, by its profile, or by the patterns in the vessels' profiles."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatch
from shlex import quote

from kempf.flows.jobs.state.former_vessel import FormerVessel
from kempf.flows.jobs.state.unknown_vessel import no_vessel
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.sources.source_folder import SourceFile


@dataclass(frozen=True, eq=False)
class FilePlace:
    """Whose a file is, and what its folder says beside her stored profile."""

    vessel: str
    given: VesselProfile | None = None


@dataclass(frozen=True, eq=False)
class Register:
    """What decides whose a file is."""

    #: Stored profiles of the known vessels, by name.
    known: Mapping[str, VesselProfile]
    #: What the folders' own profiles say, by folder.
    of_folder: Mapping[str, VesselProfile]
    #: Whether the folder of a vessel that is not known makes one.
    new_vessels: bool = False
    #: Vessels that count no longer, by name: no folder makes one of them again.
    former: Mapping[str, FormerVessel] = field(default_factory=dict)

    def place(self, file: SourceFile) -> FilePlace:
        """Return whose a file is.

        Raises
        ------
        NotFound
            ``no_vessel``: its folder has no vessel's name, ``not_placed``: nothing says whose it is;
            ``vessel_renamed``, ``vessel_removed``: its folder, or the profile in it, names one that counts no longer.
        UsageError
            ``several_vessels``: the patterns of several are those of its name.
        """
        folder_profile = self.of_folder.get(file.folder)
        if folder_profile is not None and folder_profile.vessel is not None:
            if folder_profile.vessel in self.former:
                raise self._for_a_former_one(file, folder_profile.vessel)
            return FilePlace(folder_profile.vessel, folder_profile)
        if file.folder in self.known or (file.folder and self.new_vessels and file.folder not in self.former):
            return FilePlace(file.folder, folder_profile)
        fit = sorted(name for name, profile in self.known.items() if _fits(profile, file))
        if len(fit) > 1:
            raise UsageError(
                "several_vessels",
                f"The patterns of {', '.join(map(repr, fit))} all fit {file.path}.",
                "Make the patterns under `inbox` in their profiles tell them apart, or release it with "
                "`kempf logs release FILE --vessel NAME`.",
                {"path": file.path, "vessels": fit},
            )
        if fit:
            return FilePlace(fit[0], folder_profile)
        raise self._not_placed(file)

    def _not_placed(self, file: SourceFile) -> KempfError:
        release = "`kempf logs release FILE --vessel NAME`"
        if not file.folder:
            return NotFound(
                "not_placed",
                f"{file.path} lies in no vessel's folder, and no vessel's profile has a pattern for it under `inbox`.",
                f"Move it into its vessel's folder, write a pattern into her profile, or release it with {release}.",
                {"path": file.path},
            )
        if file.folder in self.former:
            return self._for_a_former_one(file, file.folder)
        return no_vessel(
            file.folder,
            self.known,
            f"Rename the folder, put her profile.yaml into it if she is new, or release it with {release}.",
        )

    def _for_a_former_one(self, file: SourceFile, vessel: str) -> KempfError:
        former, profile = self.former[vessel], self.of_folder.get(file.folder)
        message = f"{file.path} is for the vessel {vessel!r}, which {former.words}."
        if former.now is None:
            return former.refused(
                message,
                f"`kempf vessels set {quote(vessel)} --profile FILE` brings her back; else take the file out of the "
                "inbox, or leave it alone with `kempf logs dismiss FILE --reason TEXT`.",
            )
        line = f"`vessel: {json.dumps(former.now, ensure_ascii=False)}`"
        if profile is not None and profile.vessel == vessel:
            follow = f"Write {line} into the profile of the folder {file.folder!r}."
        else:
            follow = f"Rename the folder to {former.now!r}, or put a profile.yaml with {line} into it."
        again = f"`kempf logs release FILE --vessel {quote(vessel)} --new-vessel`"
        return former.refused(message, f"{follow} If another ship has the old name now, {again} makes her.")


def _fits(profile: VesselProfile, file: SourceFile) -> bool:
    patterns = profile.inbox or ()
    return any(fnmatch(file.path, pattern) or fnmatch(file.name, pattern) for pattern in patterns)
