"""``import kempf`` costs next to nothing, and hands out what it says."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import version

import pytest

import kempf
from kempf.schemas import errors

HEAVY = {
    "numba",
    "prefect",
    "deltalake",
    "matplotlib",
    "polars",
    "numpy",
    "scipy",
    "pydantic",
    "pyarrow",
    "yaml",
    "click",
}


def loaded_by(statement: str) -> set[str]:
    """Top-level packages that a fresh interpreter has after a statement."""
    code = f"import sys\n{statement}\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    return set(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split())


def test_import_kempf_imports_nothing_heavy() -> None:
    found = loaded_by("import kempf; kempf.KempfError")
    assert "kempf" in found
    assert not found & HEAVY


def test_opening_a_warehouse_imports_neither_kernels_nor_tables() -> None:
    found = loaded_by("import kempf; kempf.open('nowhere')")
    assert "polars" in found
    assert not found & {"numba", "prefect", "deltalake", "matplotlib", "scipy"}


def test_import_kempf_takes_no_time() -> None:
    def microseconds() -> int:
        command = [sys.executable, "-X", "importtime", "-c", "import kempf"]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stderr
        (found,) = re.findall(r"\|\s+(\d+) \| kempf$", output, flags=re.MULTILINE)
        return int(found)

    # the best of three: others may be at work on the machine
    assert min(microseconds() for _ in range(3)) < 100_000


def test_what_is_handed_out_is_there() -> None:
    assert kempf.__version__ == version("kempf")
    assert kempf.KempfError is errors.KempfError
    assert set(kempf.__all__) <= set(dir(kempf))
    for name in kempf.__all__:
        assert getattr(kempf, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        kempf.opne  # noqa: B018


def test_what_computes_starts_without_the_slow_half_of_scipy() -> None:
    # what they need of it is in pipeline/distributions.py and pipeline/channels/recursion.py
    jobs = (
        *("ingest.ingest_logs", "identify.identify_vessel", "identify.pool_vessel", "compare.compare_vessel"),
        *("diagnose.diagnose_vessel", "predict.checked_prediction"),
    )
    code = "import sys; " + "; ".join(f"import kempf.flows.jobs.{job}" for job in jobs) + "; print(*sys.modules)"
    found = set(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split())
    assert "scipy.special" in found
    assert not found & {"scipy.stats", "scipy.signal", "scipy.ndimage", "prefect", "matplotlib"}
