"""Keeps an engine running: one that dies is started again, and what it did is begun anew once."""

from __future__ import annotations

import multiprocessing
import threading
from multiprocessing.process import BaseProcess
from pathlib import Path

from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.web.jobs.engine import run

_PAUSE_S, _LONGEST_S = 0.2, 10.0


class EngineSupervisor:
    """An engine and the thread that watches it.

    Parameters
    ----------
    state : Path
        Folder of the queue.
    warehouse : Warehouse
    """

    def __init__(self, state: Path, warehouse: Warehouse) -> None:
        self._state, self._warehouse = state, warehouse
        self._over = threading.Event()
        self.process: BaseProcess | None = None
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def start(self) -> None:
        """Start the engine."""
        self._begin()
        self._thread.start()

    def stop(self) -> None:
        """End it; a job that runs is begun anew the next time."""
        self._over.set()
        self._thread.join()
        if self.process is not None:
            self.process.terminate()
            self.process.join()

    def _begin(self) -> None:
        # spawned: the server has threads, which a fork would leave behind
        spawned = multiprocessing.get_context("spawn")
        self.process = spawned.Process(target=run, args=(self._state, self._warehouse))
        self.process.start()

    def _watch(self) -> None:
        pause = _PAUSE_S
        while not self._over.wait(pause):
            if self.process is not None and not self.process.is_alive():
                self._begin()
                # one that cannot even begin is not tried all the time
                pause = min(2.0 * pause, _LONGEST_S)
            else:
                pause = max(0.9 * pause, _PAUSE_S)
