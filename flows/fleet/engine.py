"""How Prefect is set up here, and what runs the tasks of a flow: threads, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
import os
from typing import Any

# Before prefect is imported: nothing leaves the machine.
os.environ.setdefault("DO_NOT_TRACK", "1")
os.environ.setdefault("PREFECT_SERVER_ANALYTICS_ENABLED", "false")
# A busy machine needs longer than Prefect's 20 s to start the server of a run.
os.environ.setdefault("PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS", "180")

from kempf.flows.process.configuration import log_level, setting

if (_level := log_level()) is not None and not logging.getLogger("kempf").handlers:
    # what jobs log goes to the run; a command shows it itself
    os.environ.setdefault("PREFECT_LOGGING_EXTRA_LOGGERS", "kempf")
    os.environ.setdefault("PREFECT_LOGGING_LEVEL", _level.upper())
    # a thread of a job knows no run
    os.environ.setdefault("PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW", "ignore")

from prefect.context import FlowRunContext
from prefect.task_runners import ThreadPoolTaskRunner

from kempf.flows.process.cores import usable
from kempf.schemas.errors import UsageError
from kempf.schemas.settings import VARIABLES

#: Setting: address of a Dask scheduler whose workers share the batches, such as ``tcp://10.0.0.5:8786``.
DASK_SETTING = VARIABLES["dask"]


def task_runner(address: str | None = None) -> Any:
    """Return what runs the batches: threads of this process, or the workers of a Dask cluster.

    Parameters
    ----------
    address : str, optional
        Of the scheduler; what `DASK_SETTING` says by default, and threads where it says nothing.

    Raises
    ------
    UsageError
        ``dask_absent``: a scheduler is named, but prefect-dask is not installed.
    """
    address = address if address is not None else setting("dask")
    if not address:
        # the compiled likelihood and the readers run outside the interpreter's lock: one thread a core
        return ThreadPoolTaskRunner(max_workers=usable())
    try:
        from prefect_dask.task_runners import DaskTaskRunner
    except ImportError as error:
        raise UsageError(
            "dask_absent",
            f"{DASK_SETTING} names the Dask scheduler {address}, but prefect-dask is not installed.",
            f"Install it with `pip install 'kempf[dask]'`, or unset {DASK_SETTING}.",
            {"address": address},
        ) from error
    return DaskTaskRunner(address=address)


def workers() -> int:
    """Return how many batches the running flow's engine works on at once."""
    context = FlowRunContext.get()
    client = getattr(context.task_runner, "client", None) if context else None
    return sum(client.nthreads().values()) if client else usable()
