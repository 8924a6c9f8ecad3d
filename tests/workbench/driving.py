"""Driving the command line from a test: in this process, or in one of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
#: The parameters of eq. (16), in the order in which they are shown.
HULL = ["a11", "a12", "a21", "a22", "b1", "b2"]
START = "from kempf.workbench.cli import main; main()"


@dataclass(frozen=True)
class Ran:
    """What a command said and with which code it left."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The one JSON document on stdout."""
        return json.loads(self.out)


def kempf(*arguments: object) -> Ran:
    """Run a command in this process."""
    from kempf.workbench.cli.entry import main

    out, err = StringIO(), StringIO()
    code: object = None
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main([str(a) for a in arguments])
        except SystemExit as leaving:
            code = leaving.code
    assert isinstance(code, int)
    return Ran(code, out.getvalue(), err.getvalue())


def environment(**changes: str) -> dict[str, str]:
    """The environment of a process of its own: this repository, no colour asked for or refused."""
    kept = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR", "KEMPF_WAREHOUSE")}
    return {**kept, "PYTHONPATH": str(ROOT), **changes}


def command(*arguments: object) -> list[str | bytes]:
    return [sys.executable, "-c", START, *(a if isinstance(a, bytes) else str(a) for a in arguments)]


def process(*arguments: object, cwd: Path | None = None, **changes: str) -> Ran:
    """Run a command in a process of its own."""
    done = subprocess.run(
        command(*arguments), capture_output=True, env=environment(**changes), cwd=cwd, timeout=120, check=False
    )
    return Ran(done.returncode, done.stdout.decode(), done.stderr.decode())


def refused(ran: Ran, exit_code: int, code: str) -> dict[str, Any]:
    """Check that a command run with --json ended with one clear error and its next step, and return the error."""
    assert ran.code == exit_code, ran
    document = ran.json
    assert set(document) == {"error"}
    error = document["error"]
    assert set(error) == {"code", "message", "details", "next_step"}
    assert error["code"] == code, error
    assert len(error["message"]) > 10 and len(error["next_step"]) > 5
    assert "Traceback" not in ran.err
    return dict(error)


def tree(folder: Path) -> dict[str, str]:
    """Every file under a folder with the hash of its content, every folder with none."""
    return {
        str(path.relative_to(folder)): sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
        for path in sorted(folder.rglob("*"))
    }


def versions(folder: Path) -> dict[str, int]:
    """The newest version of every table of a warehouse."""
    from kempf.warehouse.storage import delta
    from kempf.warehouse.storage.store import Warehouse

    return delta.versions(Warehouse(str(folder)))


def sets(warehouse: Path) -> list[dict[str, Any]]:
    """The parameter sets that are listed."""
    return list(kempf("params", "list", "--warehouse", warehouse, "--json").json)


def one_of(warehouse: Path, estimator: str) -> str:
    """The first set of an estimator."""
    return next(s["parameter_set_id"] for s in sets(warehouse) if s["estimator"] == estimator)
