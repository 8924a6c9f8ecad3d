"""A folder or bucket that logs arrive in: what lies there, and how it is opened. Nothing in it is changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.warehouse.sources.folder_walk import walk
from kempf.warehouse.storage import object_store


@dataclass(frozen=True)
class SourceFile:
    """One file of it, as its storage shows it."""

    #: A path, or s3://bucket/key.
    address: str
    #: Below the folder, with slashes.
    path: str
    size_bytes: int
    #: When it was last written, by the clock of its storage.
    modified_utc_ns: int

    @property
    def name(self) -> str:
        """Without its folder."""
        return self.path.rpartition("/")[2]

    @property
    def folder(self) -> str:
        """First folder of its path; blank where it lies at the top."""
        return self.path.partition("/")[0] if "/" in self.path else ""


@dataclass(frozen=True)
class Listing:
    """What lies in a folder that logs arrive in."""

    #: Sorted by path; hidden ones are left out.
    files: tuple[SourceFile, ...]
    #: Paths of links that lead nowhere, such as onto a share that is not mounted.
    dangling: tuple[str, ...] = ()
    #: Paths at which a folder was not entered, as it is listed under another path already.
    not_entered: tuple[str, ...] = ()
    #: Paths whose names are no text, with escapes.
    misnamed: tuple[str, ...] = ()


@dataclass(frozen=True)
class SourceFolder:
    """Address of a folder that logs arrive in.

    Parameters
    ----------
    uri : str
        A folder, ``file://...`` or ``s3://bucket/prefix``.
    storage_options : mapping of str, optional
        Options of the object store, see `kempf.warehouse.storage.object_store.options_of`.

    Raises
    ------
    UsageError
        ``inbox_path``: the address cannot be used.
    """

    uri: str
    storage_options: Mapping[str, str] | None = field(default=None, repr=False, hash=False)

    def __post_init__(self) -> None:
        if not self.uri.strip():
            raise UsageError(
                "inbox_path", "The address of the inbox is empty.", "Give a folder, or s3://bucket/prefix.", {}
            )

    @cached_property
    def address(self) -> str:
        """The address without a slash at its end; a local one as a whole path."""
        if "://" in self.uri and not self.uri.startswith("file://"):
            return self.uri.rstrip("/")
        return str(Path(self.uri.removeprefix("file://")).expanduser().resolve())

    @cached_property
    def _files(self) -> tuple[Any, str]:
        """File system of pyarrow, and the root inside it."""
        from pyarrow import fs

        scheme, beyond, inside = self.address.partition("://")
        if not beyond:
            return fs.LocalFileSystem(), self.address
        try:
            options = object_store.options_of(self.storage_options)
            if scheme in object_store.SCHEMES and options:
                return object_store.file_system(options), inside
            files, root = fs.FileSystem.from_uri(self.address)
        except (ValueError, OSError) as error:  # pyarrow's own errors are subclasses
            raise UsageError(
                "inbox_path",
                f"{self.uri!r} is no address of an inbox: {error}",
                "Give a folder, or s3://bucket/prefix.",
                {"uri": self.uri},
            ) from error
        return files, str(root)

    def list(self) -> Listing:
        """Return its files, those in folders below it too; no folder is entered twice, whatever links lead to it.

        Raises
        ------
        NotFound
            ``no_inbox``: there is no such folder.
        UsageError
            ``inbox_path``: it is a file.
        KempfError
            ``inbox_unreadable``.
        """
        from pyarrow import fs

        files, root = self._files
        try:
            kind = files.get_file_info(root).type
            if kind == fs.FileType.File:
                raise UsageError(
                    "inbox_path",
                    f"{self.uri} is a file; an inbox is a folder with one folder a vessel.",
                    "Give the folder, or take this one file in with `kempf ingest PATH --vessel NAME`.",
                    {"uri": self.uri},
                )
            if kind == fs.FileType.NotFound:
                raise NotFound(
                    "no_inbox",
                    f"There is no folder at {self.uri}.",
                    "Check the address; an inbox is a folder, or s3://bucket/prefix, with one folder a vessel.",
                    {"uri": self.uri},
                )
            if "://" not in self.address:
                return self._walked()
            listing = files.get_file_info(fs.FileSelector(root, recursive=True))
        except OSError as error:
            raise KempfError(
                "inbox_unreadable",
                f"The inbox {self.uri} cannot be listed: {error}.",
                "Look at its permissions, or at the address and the credentials of the object store.",
                {"uri": self.uri},
            ) from error
        listed = []
        for info in listing:
            path = info.path[len(root) :].lstrip("/")
            if info.type != fs.FileType.File or any(part.startswith(".") for part in path.split("/")):
                continue
            listed.append(SourceFile(f"{self.address}/{path}", path, info.size or 0, info.mtime_ns or 0))
        return Listing(tuple(sorted(listed, key=lambda file: file.path)))

    def _walked(self) -> Listing:
        """Return what lies in a folder of this machine."""
        walked = walk(Path(self.address))
        files = (
            SourceFile(f"{self.address}/{path}", path, status.st_size, status.st_mtime_ns)
            for path, status in sorted(walked.files.items())
        )
        return Listing(
            tuple(files),
            *(tuple(sorted(paths)) for paths in (walked.dangling, walked.not_entered, walked.misnamed)),
        )

    def file(self, path: str) -> SourceFile:
        """Return one of its files.

        Raises
        ------
        NotFound
            ``no_such_file``: it is not there, or no longer.
        KempfError
            ``file_unreadable``.
        """
        from pyarrow import fs

        files, root = self._files
        address = f"{self.address}/{path}"
        try:
            info = files.get_file_info(f"{root}/{path}")
        except OSError as error:
            raise _unreadable(address, error) from error
        if info.type != fs.FileType.File:
            raise _gone(address)
        return SourceFile(address, path, info.size or 0, info.mtime_ns or 0)

    @contextmanager
    def opened(self, file: SourceFile) -> Iterator[BinaryIO]:
        """Open one of its files to be read anywhere in it.

        Raises
        ------
        NotFound
            ``no_such_file``: it is there no longer.
        KempfError
            ``file_unreadable``.
        """
        files, root = self._files
        try:
            stream = files.open_input_file(f"{root}/{file.path}")
        except FileNotFoundError as error:
            raise _gone(file.address) from error
        except OSError as error:
            raise _unreadable(file.address, error) from error
        with stream:
            yield stream


def _gone(address: str) -> NotFound:
    return NotFound(
        "no_such_file",
        f"There is no file at {address} any more.",
        "Put it back into the inbox, or dismiss it with `kempf logs dismiss`.",
        {"path": address},
    )


def _unreadable(address: str, error: OSError) -> KempfError:
    return KempfError(
        "file_unreadable",
        f"Reading {address} failed: {error}.",
        "Look at the file's permissions, or at the credentials of the object store.",
        {"path": address},
    )
