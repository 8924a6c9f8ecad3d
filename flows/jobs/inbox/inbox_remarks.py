"""What is strange about an inbox itself, whatever lies in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from kempf.schemas.enumeration import counted
from kempf.warehouse.sources.source_folder import Listing
from kempf.warehouse.tables import inbox
from kempf.warehouse.tables.inbox import InboxFile


def remarks(root: str, listing: Listing, before: Mapping[str, InboxFile]) -> Iterator[str]:
    """Yield what a person should know of an inbox as it is found, a sentence or two each.

    Parameters
    ----------
    root : str
        Address of the inbox.
    before : mapping of str to InboxFile
        What was known of its files before this run, by address.
    """
    were = sum(row.outcome != "gone" for row in before.values())
    if were and not listing.files and not inbox.was_empty(root, before):
        yield (
            f"The inbox is empty, where {counted(were, 'file')} lay before. If nobody took them away, look whether its "
            "share is mounted and its address is right."
        )
    for paths, one, several in (
        (
            listing.dangling,
            "link leads nowhere; look whether its share is mounted",
            "links lead nowhere; look whether their share is mounted",
        ),
        (
            listing.not_entered,
            "folder is looked through under another path already, and is not entered again",
            "folders are looked through under other paths already, and are not entered again",
        ),
        (
            listing.misnamed,
            "file or folder has a name that is no UTF-8 text, and is left out; rename it",
            "files or folders have names that are no UTF-8 text, and are left out; rename them",
        ),
    ):
        if paths:
            yield f"{len(paths)} {one if len(paths) == 1 else several}: {_some(paths)}."


def _some(paths: Sequence[str]) -> str:
    return f"{', '.join(paths[:5])}{' ...' if paths[5:] else ''}"
