"""The place where everything is kept: a folder, or a bucket reached by the same code.

Knows addresses and bytes; the tables themselves are opened in `delta`. A folder becomes a warehouse by its
marker file, which also says how it is laid out.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import unquote

from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.warehouse.storage import marker as markers
from kempf.warehouse.storage import object_store
from kempf.warehouse.storage.marker import LAYOUT, MARKER, Marker

#: Characters that the readers of the tables give another meaning: escapes, patterns, and = as a partition's folder.
_UNADDRESSABLE = "%=[]*?^|{}" if os.sep == "\\" else "%=[]*?^|{}\\"


@dataclass(frozen=True)
class Warehouse:
    """Address of a warehouse; opening it touches nothing.

    Parameters
    ----------
    uri : str
        A folder, ``file://...`` or ``s3://bucket/prefix``.
    storage_options : mapping of str, optional
        Options of the object store, such as ``AWS_ENDPOINT_URL``; they go before those of the environment, and are
        never stored.
    migrating : bool, optional
        Whether it is opened by what brings it forward: then one of an earlier layout is a warehouse, too.

    Raises
    ------
    UsageError
        ``warehouse_path``: the address is empty or cannot be used.
    """

    uri: str
    storage_options: Mapping[str, str] | None = field(default=None, repr=False, hash=False)
    migrating: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        if not self.uri.strip():
            raise UsageError("warehouse_path", "The address of the warehouse is empty.", "Give --warehouse FOLDER.")
        bad = sorted(set(str(self.folder or self.uri)) & set(_UNADDRESSABLE))
        if bad:
            raise UsageError(
                "warehouse_path",
                f"{self.uri!r} cannot hold a warehouse: its path contains {' '.join(bad)}, which the readers of the "
                "tables take for something else.",
                "Choose a folder without these characters.",
                {"characters": bad},
            )

    @cached_property
    def folder(self) -> Path | None:
        """The local folder, absolute; None for an object store."""
        if "://" in self.uri and not self.uri.startswith("file://"):
            return None
        return Path(self.uri.removeprefix("file://")).expanduser().resolve()

    @cached_property
    def scheme(self) -> str:
        """How it is reached: ``file``, ``s3``, ..."""
        return "file" if self.folder is not None else self.uri.partition("://")[0]

    @cached_property
    def options(self) -> dict[str, str] | None:
        """Storage options as the table format wants them; None for a folder."""
        if self.scheme in object_store.SCHEMES:
            return object_store.options_of(self.storage_options) or None
        return dict(self.storage_options) if self.storage_options else None

    def address(self, *parts: str) -> str:
        """Return the address of something inside, for the table format."""
        root = str(self.folder) if self.folder is not None else self.uri.rstrip("/")
        return "/".join((root, *parts))

    @cached_property
    def _files(self) -> tuple[Any, str]:
        """File system of pyarrow, and the root inside it."""
        from pyarrow import fs

        if self.folder is not None:
            return fs.LocalFileSystem(), self.folder.as_posix()
        try:
            if self.scheme in object_store.SCHEMES and self.options:
                return object_store.file_system(self.options), self.uri.rstrip("/").partition("://")[2]
            files, inside = fs.FileSystem.from_uri(self.uri.rstrip("/"))
        except (ValueError, OSError) as error:  # pyarrow's own errors are subclasses
            raise UsageError(
                "warehouse_path",
                f"{self.uri!r} is no address that can hold a warehouse: {error}",
                "Give a folder, or s3://bucket/prefix.",
                {"uri": self.uri},
            ) from error
        return files, str(inside)

    def read_bytes(self, *parts: str) -> bytes | None:
        """Return the content of a file inside, None where there is none; raises what `opened` raises."""
        with self.opened(*parts) as stream:
            try:
                return None if stream is None else stream.read()
            except OSError as error:
                raise self._unreachable("/".join(parts), error) from error

    @contextmanager
    def opened(self, *parts: str) -> Iterator[BinaryIO | None]:
        """Open a file inside to be read anywhere in it, None where there is none.

        Raises
        ------
        KempfError
            ``warehouse_unreachable``: it may be there, but cannot be read.
        """
        files, root = self._files
        try:
            stream = files.open_input_file("/".join((root, *parts)))
        except (FileNotFoundError, NotADirectoryError):
            yield None
            return
        except OSError as error:
            raise self._unreachable("/".join(parts), error) from error
        with stream:
            yield stream

    def _unreachable(self, path: str, why: object) -> KempfError:
        return KempfError(
            "warehouse_unreachable",
            f"Reading {path} of the warehouse {self.uri} failed: {why}.",
            "Look at the permissions of the folder, or at the address and the credentials of the object store.",
        )

    def files_below(self, *parts: str) -> list[str]:
        """Return the names of all files in a folder inside and in those below it, without their folders, sorted."""
        return sorted(path.rpartition("/")[2] for path in self.paths_below(*parts))

    def paths_below(self, *parts: str) -> list[str]:
        """Return the paths of all files in a folder inside and in those below it, from there on, sorted."""
        from pyarrow import fs

        files, root = self._files
        top = "/".join((root, *parts))
        where = fs.FileSelector(top, recursive=True, allow_not_found=True)
        return sorted(info.path.removeprefix(f"{top}/") for info in files.get_file_info(where) if info.is_file)

    def size_of(self, *parts: str) -> int | None:
        """Return the size of a file inside, bytes; None where there is none."""
        files, root = self._files
        size: int | None = files.get_file_info("/".join((root, *parts))).size
        return size

    def mark_of(self, *parts: str) -> tuple[int, ...] | None:
        """Return numbers that change where a file inside is replaced by another; None where there is none."""
        if self.folder is not None:
            try:
                status = self.folder.joinpath(*parts).stat()
            except OSError:
                return None
            return status.st_ino, status.st_mtime_ns, status.st_size
        files, root = self._files
        info = files.get_file_info("/".join((root, *parts)))
        return None if info.mtime_ns is None else (info.mtime_ns, info.size or 0)

    def write_bytes(self, data: bytes, *parts: str) -> None:
        """Write a file inside, all of it or nothing; raises what `write` raises."""
        self.write([data], *parts)

    def write(self, pieces: Iterable[bytes], *parts: str) -> None:
        """Write a file inside, all of it or nothing: a reader never sees a part, and an error on the way leaves none.

        Raises
        ------
        KempfError
            ``disk_full``; ``warehouse_not_writable``: the folder is protected, ...
        """
        files, root = self._files
        target = "/".join((root, *parts))
        folder, _, name = target.rpartition("/")
        # in a bucket, too: what is cut off there becomes an object all the same, and would stand in a whole one's place
        passing = f"{folder}/.{name}.{secrets.token_hex(8)}"
        try:
            if self.folder is not None:
                files.create_dir(folder, recursive=True)
            try:
                with files.open_output_stream(passing) as stream:
                    for piece in pieces:
                        stream.write(piece)
                if self.folder is not None:
                    _write_through(passing)
                files.move(passing, target)
            except BaseException:
                with contextlib.suppress(OSError):
                    files.delete_file(passing)
                raise
        except OSError as error:
            raise not_writable(self.uri, error) from error

    def delete(self, *parts: str) -> None:
        """Delete a file inside, where it is there."""
        files, root = self._files
        with contextlib.suppress(FileNotFoundError):
            files.delete_file("/".join((root, *parts)))

    def exists(self) -> bool:
        """Return whether a warehouse is there.

        Raises
        ------
        KempfError
            ``warehouse_layout``, ``warehouse_layout_old``, ``warehouse_migrating``: it is there, but of a newer or an
            earlier layout, or on the way to this one; ``warehouse_marker_damaged``.
        """
        if self.folder is None and vars(self).get("_stood"):
            return True  # a bucket is asked once; a folder may be moved away while we look
        marker = self.marker()
        if marker is None:
            return False
        self._refuse_other_layout(marker)
        vars(self)["_stood"] = True
        return True

    def _refuse_other_layout(self, marker: Marker) -> None:
        layouts = {"found": marker.layout, "expected": LAYOUT}
        if marker.layout > LAYOUT:
            raise KempfError(
                "warehouse_layout",
                f"The warehouse {self.uri} has layout {marker.layout}; this version reads layout {LAYOUT}.",
                "Update kempf, or give another folder with --warehouse.",
                layouts,
            )
        if self.migrating:
            return
        if marker.migrating is not None:
            raise KempfError(
                "warehouse_migrating",
                f"The warehouse {self.uri} is being brought from layout {marker.migrating} to layout {marker.layout}, "
                "which is not finished.",
                "Wait where it is going on; `kempf migrate` finishes one that was interrupted.",
                {**layouts, "from": marker.migrating},
            )
        if marker.layout < LAYOUT:
            raise KempfError(
                "warehouse_layout_old",
                f"The warehouse {self.uri} has layout {marker.layout}; this version works with layout {LAYOUT}.",
                "`kempf migrate` brings it forward; nothing is lost.",
                layouts,
            )

    def marker(self) -> Marker | None:
        """Return what marks the warehouse; None where there is none.

        Raises
        ------
        KempfError
            ``warehouse_marker_damaged``.
        """
        data = self.read_bytes(MARKER)
        marker = None if data is None else markers.read(data)
        if data is not None and marker is None:
            raise KempfError(
                "warehouse_marker_damaged",
                f"The file {MARKER} of the warehouse {self.uri} is damaged.",
                "`kempf repair` writes it anew.",
            )
        return marker

    def mark(self, marker: Marker) -> None:
        """Write what marks the warehouse; raises what `write` raises."""
        self.write_bytes(marker.written(), MARKER)

    def reach(self) -> None:
        """Do nothing where the bucket answers, or for a folder; asked after an error that does not tell the difference.

        Raises
        ------
        KempfError
            ``warehouse_unreachable``.
        """
        if self.folder is not None:
            return
        files, root = self._files
        bucket = root.partition("/")[0]
        try:
            there = files.get_file_info(bucket).type.name != "NotFound"
        except OSError as error:
            raise self._unreachable(MARKER, error) from error
        if not there:
            raise self._unreachable(MARKER, f"there is no bucket {bucket!r}")

    def require(self) -> None:
        """Do nothing where a warehouse is there.

        Raises
        ------
        NotFound
            ``no_warehouse``: there is none.
        """
        if not self.exists():
            raise NotFound(
                "no_warehouse",
                f"There is no warehouse at {self.uri}.",
                "Make one with `kempf ingest PATH... --vessel NAME`, or say where it is with --warehouse.",
                {"uri": self.uri},
            )

    def create(self) -> None:
        """Make an empty warehouse where none is; the parents of the folder are made too.

        Raises
        ------
        UsageError
            ``not_a_warehouse``: it is a file, or a folder that holds other things.
        """
        if self.exists():
            return
        if self.folder is not None:
            others = (
                sorted(p.name for p in self.folder.iterdir() if not p.name.startswith("."))
                if self.folder.is_dir()
                else []
            )
            taken = self.folder.exists() and not self.folder.is_dir()
            if (others or taken) and not self.exists():  # another process may have made it meanwhile
                content = f"other files, such as {others[0]!r}" if others else "a file"
                raise UsageError(
                    "not_a_warehouse",
                    f"{self.uri} is no warehouse: found {content}; expected a warehouse or an empty folder.",
                    "Give another folder with --warehouse.",
                    {"uri": self.uri},
                )
        self.mark(Marker(LAYOUT))


def _write_through(path: str) -> None:
    """Wait until a file is on the disk: its name must not come before its bytes where the power fails."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


#: What the system calls a disk, or a share of one, that has no room left.
_FULL = (errno.ENOSPC, errno.EDQUOT)
_FULL_WORDS = ("no space left", "disk quota exceeded", "not enough space")


def not_writable(where: str, error: Exception) -> KempfError:
    """Return the error of a write that failed; a full disk has one of its own.

    Parameters
    ----------
    where : str
        Folder or address that was written to.
    error : Exception
        Of the system, or of the library that wrote.
    """
    if where.startswith("file://"):
        where = unquote(where.removeprefix("file://")).rstrip("/")
    # without the places in a library that it lists below
    message = " ".join(re.sub(r"\x1b\[[0-9;]*m", "", re.split(r"\n\s*0: ", str(error))[0]).split())
    if getattr(error, "errno", None) in _FULL or any(words in message.lower() for words in _FULL_WORDS):
        free = _free_bytes(where)
        return KempfError(
            "disk_full",
            f"There is no room left for {where}"
            + (f": {free} bytes are free on its disk, which was not enough." if free is not None else "."),
            "Make room on it, or move the warehouse to a larger one; then run the same command again: what was "
            "finished is kept, nothing is half in.",
            {"path": where, "free_bytes": free},
        )
    return KempfError(
        "warehouse_not_writable",
        f"Writing to {where} failed: {message}.",
        "Look at the free space and the permissions of the folder, or at the bucket and its credentials; then run the "
        "command again.",
        {"path": where},
    )


def _free_bytes(where: str) -> int | None:
    """Return what a person without special rights may still write there, bytes; None where that is unknown."""
    if "://" in where:
        return None
    path = Path(where)
    with contextlib.suppress(OSError):
        return shutil.disk_usage(next(p for p in (path, *path.parents) if p.exists())).free
    return None
