"""The process that does the jobs, each in a process forked from it: what a fit needs is loaded once.

It only loads and forks: a pool of threads that had begun before would not be there after.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from importlib import import_module
from pathlib import Path

from kempf.flows.process.wrap_error import wrapped
from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.web.jobs.job_progress import JobProgress
from kempf.workbench.web.jobs.kinds import KINDS, Work
from kempf.workbench.web.jobs.queue import RUNNING, Job, Queue

_PAUSE_S = 0.1
#: what a fit needs, and takes seconds to load
_HEAVY = (
    *("identify.vessel_model", "compare.compare_vessel", "diagnose.diagnose_vessel"),
    *("predict.checked_prediction", "reprocess.reprocess_vessel"),
)


def run(state: Path, warehouse: Warehouse) -> None:
    """Do jobs until the process that started this one is gone.

    Parameters
    ----------
    state : Path
        Folder of the queue and of what is kept.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is for the server, which ends this
    parent, queue = os.getppid(), Queue(state / "jobs.sqlite")
    for name in queue.running():  # of an engine before this one
        queue.died(name)
    for name in _HEAVY:
        import_module(f"kempf.flows.jobs.{name}")
    forked = multiprocessing.get_context("fork")
    while os.getppid() == parent:
        job = queue.take()
        if job is None:
            time.sleep(_PAUSE_S)
            continue
        process = forked.Process(target=_work, args=(state, warehouse, job))
        process.start()
        while process.is_alive():
            process.join(_PAUSE_S)
            if os.getppid() != parent or queue.get(job.id).state != RUNNING:
                # commits are whole or not there: nothing is half in
                process.kill()
                process.join()
        queue.died(job.id)  # one that has ended in any way stays as it is


def _end_with(engine: int) -> None:
    while os.getppid() == engine:
        time.sleep(_PAUSE_S)
    os._exit(1)


def _work(state: Path, warehouse: Warehouse, job: Job) -> None:
    queue, engine = Queue(state / "jobs.sqlite"), os.getppid()
    # a job outlives no engine: the next one begins it anew, and two would do it at once
    threading.Thread(target=_end_with, args=(engine,), daemon=True).start()
    progress = JobProgress(queue, job.id)
    try:
        result = KINDS[job.kind].do(Work(warehouse, state, job.arguments, progress))
        progress.write()
    except Exception as error:  # noqa: BLE001 - the last place where it can be reported
        failure = wrapped(error)
        progress.write()
        if failure.code == "internal":
            traceback.print_exception(failure, file=sys.stderr)
        queue.fail(job.id, failure)
    else:
        queue.finish(job.id, result)
