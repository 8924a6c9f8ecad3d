"""Real processes for the tests: each in a group of its own, its port waited for, killed with all its children."""

from __future__ import annotations

import gzip
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def s3_server(port: int) -> list[str]:
    """The command that starts an S3 server of the tests' own."""
    return [sys.executable, "-m", "tests.scale.s3_server", str(port)]


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def environment(**more: str) -> dict[str, str]:
    """The environment of a process: the one of the tests without anybody's settings, and what is given."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("KEMPF_", "PREFECT_", "AWS_", "DASK_"))}
    path = os.pathsep.join((str(Path(sys.executable).parent), kept.get("PATH", "")))
    beside = os.pathsep.join((str(ROOT), *filter(None, (kept.get("PYTHONPATH"),))))
    return {**kept, "PATH": path, "PYTHONPATH": beside, "NO_COLOR": "1", **more}


@contextmanager
def running(
    command: list[str],
    env: Mapping[str, str],
    log: Path,
    *,
    port: int | None = None,
    within_s: float = 300.0,
    cwd: Path = ROOT,
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a process, wait until it listens, and end it with its whole group."""
    with log.open("wb") as out:
        process = subprocess.Popen(
            command, env=dict(env), cwd=cwd, stdout=out, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            if port is not None:
                wait_for(lambda: listens(port) or ended(process, log), within_s)
            yield process
        finally:
            kill(process)


def listens(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


def ended(process: subprocess.Popen[bytes], log: Path) -> bool:
    if process.poll() is not None:
        raise RuntimeError(f"{process.args} ended: {log.read_text(errors='replace')[-2000:]}")
    return False


def kill(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(timeout=30)


def wait_for(reached, within_s: float = 60.0, every_s: float = 0.1) -> None:
    until = time.monotonic() + within_s
    while not reached():
        assert time.monotonic() < until, f"not reached within {within_s} s"
        time.sleep(every_s)


@contextmanager
def receiver() -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Lend an address, and what is posted to it as JSON."""
    received: list[dict[str, Any]] = []
    with _server(lambda path, body: received.append(json.loads(body))) as url:
        yield f"{url}/alarm", received


@contextmanager
def received_text() -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Lend an address, and what is posted or put below it as text, each with its path."""
    received: list[tuple[str, str]] = []
    with _server(lambda path, body: received.append((path, body.decode()))) as url:
        yield url, received


@contextmanager
def _server(take: Callable[[str, bytes], None]) -> Iterator[str]:
    class Receiver(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            take(self.path, gzip.decompress(body) if self.headers.get("Content-Encoding") == "gzip" else body)
            self.send_response(204)
            self.end_headers()

        do_PUT = do_POST  # noqa: N815 - as the server looks for it

        def log_message(self, *arguments: Any) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Receiver)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
