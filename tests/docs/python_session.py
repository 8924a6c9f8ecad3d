"""One Python session in a folder: what a page types behind ``>>> `` is run as the interactive interpreter runs it.

Run as a script it is that session: a source as a line of JSON comes in, what it printed and its exit code go out.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
import traceback
from pathlib import Path


class PythonSession:
    """A session of its own process, in which what was assigned holds for the sources that follow."""

    def __init__(self, folder: Path) -> None:
        kept = {k: v for k, v in os.environ.items() if not k.startswith(("KEMPF_", "PREFECT_", "POLARS_"))}
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=folder, env=kept
        )

    def run(self, source: str) -> tuple[list[str], int]:
        """Run a source; return the lines it printed, the value of a last expression among them, and 0 or 1."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(json.dumps(source), file=self._process.stdin, flush=True)
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError(f"the session ended at: {source}")
        printed, code = json.loads(answer)
        return [line.rstrip() for line in printed.rstrip().splitlines()], code

    def close(self) -> None:
        """End the session."""
        self._process.communicate()


def main() -> None:
    answers, names = sys.stdout, {"__name__": "__main__"}
    for line in sys.stdin:
        code, printed = 0, io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            try:
                exec(compile(json.loads(line), "<page>", "single"), names)  # noqa: S102 - the page is ours
            except Exception:  # noqa: BLE001 - whatever it is, the page does not show it
                code = 1
                traceback.print_exc()
        print(json.dumps([printed.getvalue(), code]), file=answers, flush=True)


if __name__ == "__main__":
    main()
