"""The program ``kempf`` without the seconds in which a process imports: one that has imported forks for each command.

As a script, ``serve SOCKET`` is that process, which ends with its standard input; ``ask SOCKET ARGUMENT...`` stands
in the shell where ``kempf ARGUMENT...`` would: same folder, environment, streams and exit code.
"""

from __future__ import annotations

import json
import os
import select
import socket
import sys
from importlib import import_module
from pathlib import Path

#: What the commands of the pages import, less what reads the environment as it is imported.
IMPORTED = (
    "kempf.flows.jobs.compare_vessel",
    "kempf.flows.jobs.diagnose_vessel",
    "kempf.flows.jobs.identify_vessel",
    "kempf.flows.jobs.ingest_logs",
    "kempf.flows.jobs.predict_vessel",
    "kempf.workbench.cli.entry",
    "pyarrow.fs",
)


def serve(path: str) -> None:
    """Fork for every command that is asked for, one after the other."""
    for name in IMPORTED:
        import_module(name)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(path)
        listener.listen()
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        while sys.stdin not in select.select([listener, sys.stdin], [], [])[0]:
            caller, _ = listener.accept()
            with caller:
                asked, streams, _, _ = socket.recv_fds(caller, 1 << 20, 3)
                child = os.fork()
                if child == 0:
                    run(json.loads(asked), streams)
                for stream in streams:
                    os.close(stream)
                caller.sendall(str(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])).encode())


def run(asked: dict[str, object], streams: list[int]) -> None:
    """Be the command; does not return."""
    from kempf.workbench.cli import main

    for place, stream in enumerate(streams):
        os.dup2(stream, place)
    # as an interpreter makes them: those of the parent belong to its own streams
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout = os.fdopen(1, "w", closefd=False)
    sys.stderr = os.fdopen(2, "w", buffering=1, errors="backslashreplace", closefd=False)
    os.chdir(str(asked["folder"]))
    os.environ.clear()
    os.environ.update(dict(asked["environment"]))  # type: ignore[call-overload]
    sys.argv = ["kempf", *map(str, asked["arguments"])]  # type: ignore[call-overload]
    code: object = 1
    try:
        main()
        code = 0
    except SystemExit as leaving:
        code = leaving.code or 0
    except BaseException:  # noqa: BLE001 - a fault of our own is shown as the interpreter shows it
        sys.excepthook(*sys.exc_info())
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 1)


def ask(path: str, arguments: list[str]) -> int:
    """Have a command run; return its exit code."""
    asked = {"folder": str(Path.cwd()), "environment": dict(os.environ), "arguments": arguments}
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(path)
        socket.send_fds(server, [json.dumps(asked).encode()], [0, 1, 2])
        return int(server.recv(16) or 1)


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(sys.argv[2])
    else:
        sys.exit(ask(sys.argv[2], sys.argv[3:]))
