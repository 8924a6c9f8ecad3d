"""What was read of one log until it is stored: in memory where it came in one part, else in files beside."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.read import read_parts
from kempf.pipeline.ingest.readings import LogReadings, Readings, Tally
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import not_writable

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True)
class Spooled:
    """A log in files, a pair of them for each part; `kempf.pipeline.ingest.readings.LogReadings`."""

    tally: Tally
    notes: tuple[str, ...]
    format: str
    lost: tuple[LostStretch, ...]
    readings: tuple[Path, ...]
    rejected: tuple[Path, ...]

    def lazy(self) -> pl.LazyFrame:
        """Return the readings, for those who want some columns of them."""
        import polars as pl

        return pl.scan_parquet(list(self.readings), glob=False)

    def frames(self) -> Iterator[pl.DataFrame]:
        """Yield the readings, part by part."""
        return _each(self.readings)

    def rejections(self) -> Iterator[pl.DataFrame]:
        """Yield what was refused, part by part."""
        return _each(self.rejected)


def _each(paths: tuple[Path, ...]) -> Iterator[pl.DataFrame]:
    import polars as pl

    for path in paths:
        yield pl.read_parquet(path, glob=False)


@contextmanager
def spooled(name: str, log: LogFile, profile: VesselProfile) -> Iterator[LogReadings]:
    """Read a log, and hold no more of a long one in memory than a part.

    Parameters
    ----------
    name, log, profile
        See `kempf.pipeline.ingest.read.read_parts`.

    Yields
    ------
    LogReadings
        Until the end of the ``with``.

    Raises
    ------
    KempfError
        The log cannot be read (`kempf.pipeline.ingest.read.read_parts`), or there is no room beside it (``disk_full``).
    """
    parts = read_parts(name, log, profile)
    first = next(parts)
    second = next(parts, None)
    if second is None:
        yield first
        return
    with TemporaryDirectory(prefix="kempf-log-", ignore_cleanup_errors=True) as folder:
        parts = chain([first, second], parts)
        del first, second
        yield _written(parts, Path(folder))


def _written(parts: Iterator[Readings], folder: Path) -> Spooled:
    """Write parts down, and hold none of them."""
    tally, readings, rejected = Tally(), list[Path](), list[Path]()
    for part in parts:
        tally += part.tally
        for paths, frame, kind in ((readings, part.frame, "readings"), (rejected, part.rejected, "rejected")):
            paths.append(folder / f"{kind}-{len(paths):06d}.parquet")
            try:
                frame.write_parquet(paths[-1])
            except OSError as error:
                raise not_writable(str(folder), error) from error
    # what is known at the end of the log stands in its last part
    return Spooled(tally, part.notes, part.format, part.lost, tuple(readings), tuple(rejected))
