"""What comes out of a warehouse is data: nothing in the house can take it for code."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: What turns stored bytes into running code.
FORBIDDEN = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "jsonpickle"}
CALLED = {"eval", "exec", "__reduce__", "full_load", "unsafe_load", "read_pickle", "to_pickle"}


def faults(path: Path) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name.partition(".")[0] for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [(node.module or "").partition(".")[0]]
        elif isinstance(node, ast.Call):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            names = [called] if called in CALLED and not isinstance(node.func, ast.Attribute) else []
            names += [called] if called in CALLED - {"eval", "exec"} else []
            names += [k.arg for k in node.keywords if k.arg == "allow_pickle" and getattr(k.value, "value", True)]
        found += [
            f"{path.relative_to(ROOT)}:{node.lineno}: {n}" for n in names if n in FORBIDDEN | CALLED | {"allow_pickle"}
        ]
    return found


def test_nothing_stored_is_ever_run() -> None:
    rooms = ("schemas", "pipeline", "warehouse", "flows", "workbench")
    files = [path for room in rooms for path in (ROOT / room).rglob("*.py")]
    assert len(files) > 200
    assert [fault for path in files for fault in faults(path)] == []


def test_the_flows_keep_no_pickled_results() -> None:
    fleet = import_module("kempf.flows.fleet.flows")
    from prefect import Flow, Task

    kept = [one for one in vars(fleet).values() if isinstance(one, (Flow, Task))]
    assert len(kept) >= 4
    for one in kept:
        serializer = getattr(one.result_serializer, "type", one.result_serializer)
        assert not one.persist_result or serializer in ("json", "compressed/json"), one.name
