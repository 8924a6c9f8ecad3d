"""Compiled functions are compiled anew when something that went into them has changed in another file."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest
from numba.core.dispatcher import Dispatcher

import kempf.pipeline

INNER = """
from kempf.pipeline.compiled import njit

HELD = {held}

@njit(cache=True)
def inner(x):
    return {factor} * x
"""
INSTRUCTIONS = """
from factor import FACTOR
from numba.extending import intrinsic

@intrinsic
def inner(context, x):
    def build(context, builder, sig, args):
        return builder.fmul(args[0], args[0].type(FACTOR))
    return x(x), build
"""
OUTER = """
from kempf.pipeline.compiled import njit
from inner import HELD, inner

@njit(cache=True)
def outer(x):
    return inner(x) + HELD

print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""


def said(folder: Path, held: float, factor: float, before: str = "pass") -> tuple[float, int]:
    """Run `outer` in a process of its own, after a statement: its value, and whether it was found compiled."""
    text = INNER.format(held=held, factor=factor)
    if not (folder / "inner.py").exists() or (folder / "inner.py").read_text() != text:
        (folder / "inner.py").write_text(text)
    return ran(folder, before)


def ran(folder: Path, before: str = "pass") -> tuple[float, int]:
    root = Path(__file__).parents[1]
    command = (
        f"import sys; sys.path[:0] = [{str(root)!r}, {str(folder)!r}]; sys.argv = ['outer']; {before}; import outer"
    )
    # without bytecode: that of a file which was written anew within the same second would be taken for its own
    run = subprocess.run([sys.executable, "-B", "-c", command], capture_output=True, text=True, check=True)
    value, hits = run.stdout.split()
    return float(value), int(hits)


@pytest.mark.parametrize("changed", ["constant", "function"])
def test_a_change_in_another_file_is_compiled_in(tmp_path: Path, changed: str) -> None:
    (tmp_path / "outer.py").write_text(OUTER)
    assert said(tmp_path, 10.0, 2.0) == (12.0, 0)
    assert said(tmp_path, 10.0, 2.0) == (12.0, 1)
    if changed == "constant":
        assert said(tmp_path, 20.0, 2.0) == (22.0, 0)
    else:
        assert said(tmp_path, 10.0, 3.0) == (13.0, 0)


def test_a_constant_of_instructions_of_our_own_is_compiled_in(tmp_path: Path) -> None:
    """The width of a vector is such a one: kept from before, a kernel would write past its arrays."""
    (tmp_path / "inner.py").write_text(INSTRUCTIONS)
    (tmp_path / "outer.py").write_text(OUTER.replace("HELD, ", "").replace(" + HELD", ""))

    def doubled(factor: float) -> tuple[float, int]:
        (tmp_path / "factor.py").write_text(f"FACTOR = {factor}")
        return ran(tmp_path)

    assert doubled(2.0) == (2.0, 0)
    assert doubled(2.0) == (2.0, 1)
    assert doubled(3.0) == (3.0, 0)


def test_a_change_of_the_options_is_compiled_in(tmp_path: Path) -> None:
    """A function compiled under other options of the arithmetic would go on giving other last bits."""
    (tmp_path / "outer.py").write_text(OUTER)
    assert said(tmp_path, 10.0, 2.0) == (12.0, 0)
    other = "import kempf.pipeline.compiled as c; c._OPTIONS += b' '"
    assert said(tmp_path, 10.0, 2.0, other) == (12.0, 0)
    assert said(tmp_path, 10.0, 2.0, other) == (12.0, 1)


def test_no_kernel_takes_its_arithmetic_from_its_caller() -> None:
    """numba hands open options from caller to callee, so that what compiles first would decide the last bits."""
    kernels = {}
    for module in walk_packages(kempf.pipeline.__path__, "kempf.pipeline."):
        for name, value in vars(import_module(module.name)).items():
            if isinstance(value, Dispatcher):
                kernels[f"{value.__module__}.{name}"] = value.targetoptions
    assert "kempf.pipeline.estimate.filters.ekf.extended" in kernels
    left_open = [name for name, options in kernels.items() if "fastmath" not in options or "error_model" not in options]
    assert left_open == []
