"""Where the commands are killed: in a folder, in a bucket, on a Dask cluster; for `kill_torn`."""

from __future__ import annotations

import multiprocessing
import os
import pkgutil
import shutil
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fleet.kill_dask import WORKERS, Mortal
from benchmarks.fleet.torn_jobs import BEGINS, work
from kempf.warehouse.storage.store import Warehouse
from tests.scale.conftest import KEYS
from tests.scale.servers import environment, free_port, running, s3_server

_SERVER = multiprocessing.get_context("forkserver")


def warm_up() -> None:
    """Let every process begin with what the commands import, so that a kill meets the work and no import."""
    rooms = ("kempf.warehouse", "kempf.flows.jobs", "kempf.workbench.cli")
    modules = [one.name for room in rooms for one in pkgutil.walk_packages(_folder(room), f"{room}.")]
    _SERVER.set_forkserver_preload(["pandas", "benchmarks.fleet.torn_jobs", *modules])


def _folder(room: str) -> list[str]:
    return [str(Path(__file__).parents[2].joinpath(*room.split(".")[1:]))]


@dataclass
class Running:
    """One job that is running."""

    process: BaseProcess
    #: When it began, s of the clock by which files are dated.
    since: float
    #: What it prints.
    log: Path

    def ended_well(self) -> bool:
        """Wait for its end."""
        self.process.join()
        return self.process.exitcode == 0


class Place:
    """A local folder; the other places are kinds of it."""

    name = "local"
    #: Whether what is written last can be torn, and whether it is there when the benchmark is called again.
    tears = True
    stays = True
    #: How often a job is done before its time is taken, that time included.
    warm = 1

    def __init__(self, folder: Path, harbour: Path, environ: Mapping[str, str] | None = None) -> None:
        self.folder, self.harbour, self.environ = folder, harbour, dict(environ or {})
        folder.mkdir(parents=True, exist_ok=True)

    def uri(self, name: str) -> str:
        """Return the address of a warehouse."""
        return str(self.folder / name)

    def warehouse(self, name: str) -> Warehouse:
        """Open a warehouse."""
        return Warehouse(self.uri(name))

    def fill(self, name: str, begin: Path | None) -> None:
        """Put a copy of a prepared warehouse in place of what is there, or nothing."""
        shutil.rmtree(self.folder / name, ignore_errors=True)
        if begin is not None:
            shutil.copytree(begin, self.folder / name)

    def start(self, job: str, name: str) -> Running:
        """Start a job on a warehouse, and wait until it begins."""
        log = self.folder / "printed"
        mine, its = _SERVER.Pipe(duplex=False)
        arguments = (job, self.uri(name), self.environ, self.harbour, log, its)
        process = _SERVER.Process(target=work, args=arguments)
        process.start()
        its.close()
        return Running(process, float(mine.recv()), log)

    def kill(self, one: Running, number: int) -> str:
        """Kill a job, the so-manieth time; return what was killed."""
        one.process.kill()
        one.process.join()
        return "run"

    def written(self, name: str, since: float) -> list[float]:
        """Return when files that are no seals were written after some moment, s after it, in order."""
        files = [path for path in (self.folder / name).rglob("*") if path.is_file() and "_seals" not in path.parts]
        return sorted(at - since for at in (path.stat().st_mtime for path in files) if at >= since)


class Bucket(Place):
    """A bucket on an S3 server: an object is put whole or not at all."""

    name = "S3"
    tears = stays = False

    def __init__(self, folder: Path, harbour: Path, stack: ExitStack) -> None:
        from pyarrow import fs

        port = free_port()
        folder.mkdir(parents=True, exist_ok=True)
        stack.enter_context(running(s3_server(port), environment(), folder / "server.log", port=port))
        self.settings = {**KEYS, "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}"}
        super().__init__(folder, harbour, self.settings)
        self.files = fs.S3FileSystem(
            access_key=KEYS["AWS_ACCESS_KEY_ID"],
            secret_key=KEYS["AWS_SECRET_ACCESS_KEY"],
            endpoint_override=self.settings["AWS_ENDPOINT_URL"],
            region="us-east-1",
            scheme="http",
            allow_bucket_creation=True,
        )
        self.files.create_dir("fleet")

    def uri(self, name: str) -> str:
        return f"s3://fleet/{name.replace(' ', '-')}"

    def warehouse(self, name: str) -> Warehouse:
        return Warehouse(self.uri(name), self.settings)

    def fill(self, name: str, begin: Path | None) -> None:
        from pyarrow import fs

        inside = self.uri(name).removeprefix("s3://")
        found = self.files.get_file_info(fs.FileSelector(inside, recursive=True, allow_not_found=True))
        for one in found:
            if one.is_file:
                self.files.delete_file(one.path)
        for path in sorted(begin.rglob("*")) if begin is not None else ():
            parts = path.relative_to(begin).parts  # type: ignore[arg-type]
            if path.is_file() and "_seals" not in parts:  # a bucket has none
                with self.files.open_output_stream("/".join((inside, *parts))) as stream:
                    stream.write(path.read_bytes())

    def written(self, name: str, since: float) -> list[float]:
        return []  # a bucket dates in whole seconds


class OnDask(Place):
    """A local folder on which two Dask workers of one core work; a worker is killed twice, then the run, in turn."""

    name = "Dask"
    warm = 2  # workers import and compile with the first job they get

    def __init__(self, folder: Path, harbour: Path, stack: ExitStack) -> None:
        from benchmarks.fleet.fleet import prefect_server

        folder.mkdir(parents=True, exist_ok=True)
        server = folder / "server"
        shutil.rmtree(server, ignore_errors=True)
        server.mkdir()
        before = dict(os.environ)
        settings = stack.enter_context(prefect_server(server))
        stack.callback(_back_to, before)
        self.mortal = Mortal(server, settings, stack)
        environ = {**settings, "KEMPF_DASK": self.mortal.cluster.address, "PREFECT_LOGGING_LEVEL": "WARNING"}
        super().__init__(folder, harbour, environ)

    def start(self, job: str, name: str) -> Running:
        self.mortal.mend()
        return super().start(job, name)

    def kill(self, one: Running, number: int) -> str:
        victim = number % (1 + WORKERS)
        if victim == WORKERS:
            super().kill(one, number)
        else:
            self.mortal.kill(victim)
            one.process.join()  # it goes on with the other worker
        self.mortal.mend()
        return "run" if victim == WORKERS else "worker"


def _back_to(before: Mapping[str, str]) -> None:
    os.environ.clear()
    os.environ.update(before)


@contextmanager
def opened(name: str, folder: Path, harbour: Path) -> Iterator[Place]:
    """Lend a place by its name: local, S3 or Dask."""
    with ExitStack() as stack:
        if name == "local":
            yield Place(folder / name, harbour)
        elif name == "S3":
            yield Bucket(folder / name, harbour, stack)
        else:
            yield OnDask(folder / name, harbour, stack)


@dataclass
class Prepared:
    """The warehouses that the jobs begin with, in a folder; each is made when it is first asked for."""

    place: Place
    made: dict[str, Path] = field(default_factory=dict)

    def begin(self, name: str | None) -> Path | None:
        """Return the folder of a prepared warehouse."""
        if name is None:
            return None
        path = self.place.folder / name
        whole = path.with_name(f"{name}.made")
        if not whole.exists():
            self.place.fill(name, self.begin(BEGINS[name][0]))
            one = self.place.start(name, name)
            if not one.ended_well():
                raise RuntimeError(f"{name} could not be prepared: {one.log.read_text()[-2000:]}")
            whole.touch()
        return path


def cut_newest(folder: Path, random: np.random.Generator, since: float | None = None) -> str:
    """Cut the end of the file that was written last; return what it is.

    Parameters
    ----------
    since : float, optional
        Only one that was written after this moment, s.
    """
    stats: list[tuple[Any, Path]] = [(path.stat(), path) for path in folder.rglob("*") if path.is_file()]
    files = [(at.st_mtime_ns, str(path), at.st_size) for at, path in stats if at.st_size > 0]
    files = [one for one in files if since is None or one[0] >= 1e9 * since]
    if not files:
        return "nothing"
    _, name, size = max(files)
    with Path(name).open("r+b") as stream:
        stream.truncate(int(random.integers(size)))
    parts = Path(name).relative_to(folder).parts
    if len(parts) == 1:
        return "marker"
    if parts[0] == "raw":
        return "raw"
    return "seal" if "_seals" in parts else "commit" if "_delta_log" in parts else "data"
