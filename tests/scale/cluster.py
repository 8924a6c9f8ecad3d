"""A Dask cluster of real processes: a scheduler, and workers of one thread each that can die and come back."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from tests.scale.servers import free_port, running, wait_for

#: Command line of Dask on the one core that is named first.
_PINNED = (
    "import os, sys; os.sched_setaffinity(0, {int(sys.argv[1])}); "
    "sys.argv = ['dask', *sys.argv[2:]]; from dask.cli import run_cli; run_cli()"
)


@dataclass(frozen=True)
class Worker:
    process: subprocess.Popen[bytes]
    log: Path


@dataclass
class Cluster:
    """What is started here ends with the `stack`."""

    folder: Path
    env: Mapping[str, str]
    stack: ExitStack
    address: str = field(init=False)
    started: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        port = free_port()
        self.address = f"tcp://127.0.0.1:{port}"
        self.folder.mkdir(exist_ok=True)
        scheduler = [sys.executable, "-m", "dask", "scheduler", "--host", "127.0.0.1", "--port", str(port)]
        self.stack.enter_context(
            running([*scheduler, "--no-dashboard"], self.env, self.folder / "scheduler", port=port)
        )

    def worker(self, core: int | None = None) -> Worker:
        """Start a worker, on one core alone where that is said, and wait until the scheduler knows it."""
        log = self.folder / f"worker{self.started}"
        self.started += 1
        dask = ["-m", "dask"] if core is None else ["-c", _PINNED, str(core)]
        options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", f"{log}.d"]
        command = [sys.executable, *dask, "worker", self.address, *options]
        process = self.stack.enter_context(running(command, self.env, log))
        wait_for(lambda: "Registered to" in log.read_text(), 300.0)
        return Worker(process, log)
