"""Who takes the cores: segments and vessels do, the linear algebra below them does not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from kempf.flows.process.cores import usable

_AT_NUMPY = """
import os, sys
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print("numpy begins with", os.environ.get("OPENBLAS_NUM_THREADS"), flush=True)
            os._exit(0)
sys.meta_path.insert(0, Watch())
import {module}
"""


@pytest.mark.parametrize(
    "module",
    [
        "kempf.flows.fleet.flows",
        "kempf.flows.jobs.reprocess.reprocess_vessel",
        "kempf.flows.jobs.compare.compare_vessel",
    ],
)
@pytest.mark.parametrize("wanted", [None, "3"])
def test_numpy_begins_with_one_thread_unless_asked_otherwise(module: str, wanted: str | None) -> None:
    env = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    if wanted:
        env["OPENBLAS_NUM_THREADS"] = wanted
    done = subprocess.run(
        [sys.executable, "-c", _AT_NUMPY.format(module=module)],
        env=env,
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert done.stdout.split("\n")[0] == f"numpy begins with {wanted or 1}", done.stderr


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system does not bind processes to cores")
def test_a_process_bound_to_one_core_uses_one() -> None:
    bound = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})"
    asked = f"{bound}; from kempf.flows.process.cores import usable; print(usable())"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout == "1\n"
    assert usable() == len(os.sched_getaffinity(0))
