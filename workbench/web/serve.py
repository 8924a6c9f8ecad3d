"""Serving the pages until somebody ends it."""

from __future__ import annotations

import multiprocessing
import secrets
import socket
from dataclasses import replace
from pathlib import Path

import uvicorn

from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.web.app import create_app
from kempf.workbench.web.jobs.engine_supervisor import EngineSupervisor
from kempf.workbench.web.settings import Settings


def listening(settings: Settings) -> socket.socket:
    """Return a socket that is bound, so that the address can be said before it serves; port 0 takes a free one.

    Raises
    ------
    UsageError
        ``port_in_use``, ``host_unknown``.
    """
    host = settings.host.strip("[]")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    bound = socket.socket(family, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((host, settings.port))
        # whoever follows the address before the pages are served waits, instead of being refused
        bound.listen(128)
    except OSError as error:
        bound.close()
        if isinstance(error, socket.gaierror):
            raise UsageError(
                "host_unknown", f"{settings.host!r} is no address of this machine.", "Give --host 127.0.0.1."
            ) from error
        raise UsageError(
            "port_in_use",
            f"Port {settings.port} of {settings.host} cannot be taken: {error.strerror}.",
            "Choose another with --port, or --port 0 for a free one.",
            {"host": settings.host, "port": settings.port},
        ) from error
    return bound


def with_token(settings: Settings) -> Settings:
    """Return the settings with a token that nobody can guess; none where jobs cannot be forked, as on Windows."""
    if "fork" not in multiprocessing.get_all_start_methods():
        return settings
    return replace(settings, token=secrets.token_urlsafe(24))


def serve(warehouse: Warehouse, settings: Settings, state: Path, bound: socket.socket) -> None:
    """Serve a warehouse's pages on a bound socket until the process is ended.

    Parameters
    ----------
    state : Path
        Folder of the jobs and of what was computed for pages; made where there is none.
    """
    config = uvicorn.Config(
        create_app(warehouse, settings, state), log_level="warning", access_log=False, server_header=False
    )
    supervisor = None
    if settings.token is not None:
        supervisor = EngineSupervisor(state, warehouse)
        supervisor.start()
    try:
        uvicorn.Server(config).run(sockets=[bound])
    finally:
        if supervisor is not None:
            supervisor.stop()
