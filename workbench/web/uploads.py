"""Files that a browser sends: counted while they arrive, kept beside the warehouse until a job has taken them in."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import AsyncGenerator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.requests import Request

from kempf.schemas.errors import KempfError, UsageError
from kempf.warehouse.storage.whole_file import keep_newest, whole_file

#: bytes of all files of a form together, files of a form, forms that may arrive at once
MOST_BYTES, MOST_FILES, AT_ONCE = 256 * 2**20, 40, 2
#: bytes that are still taken, and thrown away, of what is too large: a browser shows no answer before it has sent all
_MOST_DRAINED = 4 * 2**30
#: folders of files that no job has taken in yet; the oldest go first
_MOST_KEPT = 20
_BLOCK = 1 << 20


@dataclass(frozen=True)
class Received:
    """A form with files."""

    #: By name; of several of one name the last counts.
    fields: dict[str, str]
    #: By name of the field: the files' names, each below a folder that the hash of its bytes names.
    files: dict[str, list[str]]


@dataclass
class Uploads:
    """The files that arrived.

    Parameters
    ----------
    folder : Path
        Made with the first of them.
    """

    folder: Path
    _arriving: int = field(default=0, init=False)

    async def receive(self, request: Request) -> Received:
        """Return what a form holds, its files stored.

        Raises
        ------
        UsageError
            ``upload_too_large``, ``upload_unreadable``.
        KempfError
            ``uploads_busy``: as many as may are arriving.
        """
        if self._arriving >= AT_ONCE:
            raise KempfError("uploads_busy", f"{self._arriving} uploads are arriving already.", "Try in a moment.")
        self._arriving += 1
        try:
            return await self._parsed(request)
        finally:
            self._arriving -= 1

    async def _parsed(self, request: Request) -> Received:
        parser = MultiPartParser(request.headers, _counted(request), max_files=MOST_FILES, max_fields=20)
        try:
            form = await parser.parse()
        except (MultiPartException, KeyError, AssertionError) as error:
            raise UsageError(
                "upload_unreadable",
                f"What the browser sent is no form with files: {getattr(error, 'message', error)}.",
                f"Send at most {MOST_FILES} files at once, from the page that takes logs in.",
            ) from error
        fields: dict[str, str] = {}
        files: dict[str, list[str]] = {}
        for name, value in form.multi_items():
            if isinstance(value, str):
                fields[name] = value
            elif value.filename:
                files.setdefault(name, []).append(await run_in_threadpool(self._stored, value))
        await form.close()
        await run_in_threadpool(self._forget_the_oldest)
        return Received(fields, files)

    def _stored(self, file: UploadFile) -> str:
        digest = hashlib.sha256()
        for block in iter(lambda: file.file.read(_BLOCK), b""):
            digest.update(block)
        file.file.seek(0)
        to = self.folder / digest.hexdigest() / base_name(file.filename or "")
        with whole_file(to) as passing, passing.open("wb") as target:  # the same file may be arriving twice
            shutil.copyfileobj(file.file, target, _BLOCK)
        return f"{to.parent.name}/{to.name}"

    def store_profile(self, text: str) -> str:
        """Keep a profile that was written on a page as a file, and return its name as of one that was sent."""
        data = text.encode()
        to = self.folder / hashlib.sha256(data).hexdigest() / "profile.yaml"
        with whole_file(to) as passing:
            passing.write_bytes(data)
        self._forget_the_oldest()
        return f"{to.parent.name}/{to.name}"

    def _forget_the_oldest(self) -> None:
        keep_newest(self.folder, "*", _MOST_KEPT)


def base_name(file_name: str) -> str:
    r"""Return the name of a file without the folders that a browser may send with it.

    Examples
    --------
    >>> base_name("../../etc/passwd"), base_name("C:\\trials\\day 1.csv"), base_name("..")
    ('passwd', 'day 1.csv', 'log')
    """
    last = file_name.replace("\\", "/").rpartition("/")[2]
    shown = "".join(letter for letter in last if letter.isprintable())[-120:]
    return shown if shown.strip(". ") else "log"


async def _counted(request: Request) -> AsyncGenerator[bytes, None]:
    """Pass on what arrives; what is too large is refused when all of it has arrived, so that the answer is seen."""
    read = 0
    async for part in request.stream():
        read += len(part)
        if read <= MOST_BYTES:
            yield part
        elif read > _MOST_DRAINED:
            break
    if read > MOST_BYTES:
        raise UsageError(
            "upload_too_large",
            f"{read / 2**20:.0f} MiB were sent; the pages take {MOST_BYTES // 2**20} MiB at once.",
            "Take it in from a terminal, which has no such bound: `kempf ingest LOG --vessel NAME`.",
            {"bytes": read},
        )


def paths_of(state: Path, names: Any) -> list[Path]:
    """Return where the files of a job lie.

    Raises
    ------
    UsageError
        ``upload_gone``.
    """
    paths = [state / "uploads" / name for name in names]
    if not all(path.is_file() for path in paths):
        raise UsageError(
            "upload_gone",
            "What was sent is not kept any more.",
            "Send it again from the page that takes logs in.",
        )
    return paths
