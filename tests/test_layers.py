"""The house stands: imports run one way, only the doors touch the world outside, plant and estimator share nothing."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

#: What each layer may import of the house.
BELOW = {
    "schemas": {"schemas"},
    "pipeline": {"pipeline", "schemas"},
    "warehouse": {"warehouse", "pipeline", "schemas"},
    "flows": {"flows", "warehouse", "pipeline", "schemas"},
    "workbench": {"workbench", "flows", "warehouse", "pipeline", "schemas"},
}
#: What each room may import of the others beside it. Of the pipeline's the simulator knows none and none knows it: an
#: error that both share would hide itself. No room imports one that imports it.
ROOMS = {
    "pipeline": {
        "compiled": set(),
        "distributions": set(),
        "ingest": {"compiled"},
        "channels": set(),
        "segment": {"channels"},
        "model": {"compiled", "channels"},
        "estimate": {"compiled", "distributions", "channels", "model"},
        "predict": {"channels", "model", "estimate"},
        "compare": {"distributions", "channels", "estimate", "predict"},
        "shooting": {"compiled", "channels", "model", "estimate"},
        "diagnose": {"distributions", "channels", "model", "estimate", "predict", "compare", "shooting"},
        "manoeuvre": {"compiled", "distributions", "channels", "segment", "model", "estimate"},
        "next_trial": {"distributions", "channels", "model", "estimate", "manoeuvre"},
        "steering": {"channels", "model", "estimate"},
        "history": {"distributions", "channels"},
        "simulate": set(),
    },
    "pipeline/ingest/mcap": {
        "container": set(),
        "topics": {"container"},
        "times": {"container", "topics"},
        "part": {"container", "times"},
        "decode": {"container", "topics", "times", "part"},
    },
    "pipeline/segment": {
        "settings": set(),
        "particulars": set(),
        "figure": set(),
        "lateral": set(),
        "rudder": {"settings"},
        "zigzags": {"settings", "particulars", "rudder"},
        "circles": {"settings", "particulars", "figure", "rudder"},
        "spirals": {"settings", "figure", "rudder"},
        "find_circles_and_spirals": {"settings", "rudder", "zigzags", "circles", "spirals"},
        "corrections": {"zigzags"},
    },
    "pipeline/diagnose": {
        "settings": set(),
        "split": set(),
        "screening": {"split"},
        "steps": {"settings", "screening"},
        "verdicts": {"settings", "split", "screening", "steps"},
        "evidence": {"screening", "steps", "verdicts"},
        "stretches": {"settings", "screening", "steps", "verdicts"},
    },
    "flows/jobs": {
        "state": set(),
        "ingest": {"state"},
        "inbox": {"state", "ingest"},
        "corrections": {"state", "ingest"},
        "identify": {"state", "ingest"},
        "compare": {"ingest", "identify"},
        "diagnose": {"identify", "compare"},
        "steering": {"identify"},
        "predict": {"ingest", "identify", "compare", "diagnose"},
        "reprocess": {"state", "ingest", "identify"},
        "repair": {"state", "ingest"},
        "demo": {"ingest", "identify", "reprocess"},
    },
    "warehouse": {
        "storage": set(),
        "code": {"storage"},
        "sources": {"storage"},
        "tables": {"storage", "code"},
        "queries": {"storage", "tables"},
        "upkeep": {"storage", "tables"},
    },
}
#: What the warehouse may know of the pipeline: the types that it stores.
STORED = tuple(f"kempf.pipeline.ingest.{name}." for name in ("decoded", "readings", "log_file"))
#: Libraries with one door, and the files that are it.
DOORS = {
    "prefect": ("flows/fleet/alarms.py", "flows/fleet/engine.py", "flows/fleet/flows.py", "flows/fleet/hooks.py"),
    "deltalake": ("warehouse/",),
    "click": ("workbench/",),
    "rich": ("workbench/",),
    "matplotlib": ("workbench/figures/",),
}
#: What opens a file or reaches outside, by name of the function or method, and the modules that exist for it.
OPENS = {
    *("open", "read_text", "read_bytes", "write_text", "write_bytes", "mkdir", "unlink", "touch"),
    *("memmap", "fromfile", "tofile", "savez", "savetxt", "loadtxt", "genfromtxt"),
    *("sink_parquet", "write_parquet", "write_csv", "scan_parquet", "scan_csv", "scan_delta", "write_delta"),
}
#: The files that read what is shipped with the code, by importlib.resources: the catalogue is data that is part of it.
READS_ITS_OWN_PACKAGE = ("schemas/effects/__init__.py", "schemas/instrument_noise/__init__.py")
OUTSIDE = {"os", "pathlib", "shutil", "tempfile", "subprocess", "socket", "urllib", "requests", "glob"}


def imported(path: str, tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every module that a file imports, wherever in it, with the line."""
    package = ["kempf", *path.removesuffix(".py").split("/")[:-1]]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*start, *([node.module] if node.module else [])])
            # `from pipeline import simulate` imports a module as well
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and _name(node.func) in ("import_module", "__import__") and node.args:
            name = node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
            yield node.lineno, str(name.value) if isinstance(name, ast.Constant) else "?"


def _name(function: ast.expr) -> str:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def within(module: str, room: str) -> bool:
    return module == room or module.startswith(room + ".")


def faults(path: str, source: str) -> list[str]:
    """What a file does that its layer may not, each with its line."""
    tree = ast.parse(source)
    layer = path.partition("/")[0]
    found = [f"{path}:{line}: {fault}" for line, module in imported(path, tree) for fault in wrong(path, layer, module)]
    if layer in ("pipeline", "schemas") and path not in READS_ITS_OWN_PACKAGE:
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and _name(node.func) in OPENS:
                found.append(f"{path}:{node.lineno}: {layer} calls {_name(node.func)}")
    return found


def wrong(path: str, layer: str, module: str) -> Iterator[str]:
    """Why a file may not import a module, nothing where it may."""
    top, _, rest = module.partition(".")
    if top == "?":
        yield "imports what nobody can tell"
    if top in BELOW:
        yield f"{module} goes by the name kempf.{module}"
    if top in DOORS and not path.startswith(DOORS[top]):
        yield f"{module} has another door"
    if layer == "pipeline" and top in OUTSIDE:
        yield f"pipeline reaches outside with {module}"
    if top != "kempf":
        return
    other, _, inner = rest.partition(".")
    if other in BELOW and other not in BELOW[layer]:
        yield f"{layer} imports {module}"
    if layer == "warehouse" and other == "pipeline" and inner and not module.startswith(STORED):
        yield f"the warehouse stores no {module}"
    for house, rooms in ROOMS.items():
        here, there = arrow(house, path, module)
        if here in rooms and there in rooms and there != here and there not in rooms[here]:
            yield f"{house}/{here} imports {module}"


def arrow(house: str, path: str, module: str) -> tuple[str, str]:
    """From which room of a house to which an import goes; blank outside of it."""
    return _room(house, path.removesuffix(".py")), _room(house, module.removeprefix("kempf.").replace(".", "/"))


def _room(house: str, place: str) -> str:
    """The room of a house that a file or module is in; blank outside of it."""
    return place.removeprefix(house + "/").partition("/")[0] if place.startswith(house + "/") else ""


def sources() -> list[str]:
    return sorted(p.relative_to(ROOT).as_posix() for layer in BELOW for p in (ROOT / layer).rglob("*.py"))


def test_every_layer_is_there():
    assert {path.split("/")[0] for path in sources()} == set(BELOW)
    assert len(sources()) > 80


@pytest.mark.parametrize("house", ROOMS)
def test_every_room_has_its_place(house):
    rooms = {_room(house, path.removesuffix(".py")) for path in sources()} - {"", "__init__"}
    assert rooms == set(ROOMS[house])


@pytest.mark.parametrize("house", ROOMS)
def test_every_arrow_between_rooms_is_used(house):
    found = {
        arrow(house, path, module)
        for path in sources()
        if path.startswith(house)
        for _, module in imported(path, ast.parse(read(path)))
    }
    assert {(here, there) for here, rooms in ROOMS[house].items() for there in rooms} <= found


def test_no_room_imports_one_that_imports_it():
    for rooms in ROOMS.values():
        sorter = TopologicalSorter(rooms)
        assert set(sorter.static_order()) == set(rooms)


@pytest.mark.parametrize("layer", BELOW)
def test_a_layer_imports_only_what_is_below_it_and_keeps_its_doors(layer):
    found = [fault for path in sources() if path.startswith(layer + "/") for fault in faults(path, read(path))]
    assert found == []


def read(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize("path", READS_ITS_OWN_PACKAGE)
def test_what_reads_its_own_package_opens_nothing_else(path):
    tree = ast.parse(read(path))
    opened = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and _name(n.func) in OPENS]
    assert [ast.unparse(n.func) for n in opened] == ["_FOLDER.joinpath(file).read_text"]
    assert "_FOLDER = files(__name__)" in read(path)
    assert not any(within(m, top) for _, m in imported(path, tree) for top in OUTSIDE)


def test_only_the_fleet_knows_prefect():
    knows = [p for p in sources() if any(within(m, "prefect") for _, m in imported(p, ast.parse(read(p))))]
    assert knows == ["flows/fleet/alarms.py", "flows/fleet/engine.py", "flows/fleet/flows.py", "flows/fleet/hooks.py"]


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("schemas/a.py", "import kempf.pipeline.ingest.read"),
        ("pipeline/a.py", "from kempf.warehouse.tables import raw"),
        ("pipeline/a.py", "from pipeline.ingest import read"),
        ("pipeline/a.py", "def f():\n    from kempf.flows.process.progress import silent"),
        ("pipeline/a.py", "import deltalake"),
        ("pipeline/a.py", "def f(x):\n    return open(x)"),
        ("pipeline/a.py", "def f(x):\n    return x.read_bytes()"),
        ("pipeline/a.py", "from pathlib import Path"),
        ("pipeline/a.py", "import prefect"),
        ("pipeline/simulate/a.py", "from kempf.pipeline.model import ship"),
        ("pipeline/simulate/a.py", "from kempf.pipeline import estimate"),
        ("pipeline/simulate/a.py", "from ..segment import find"),
        ("pipeline/estimate/a.py", "if True:\n    from kempf.pipeline.simulate.trial import Trial"),
        ("pipeline/estimate/a.py", "from .. import simulate"),
        ("pipeline/estimate/a.py", "from kempf.pipeline.predict.free_run import FreeRun"),
        ("pipeline/predict/a.py", "from kempf.pipeline import diagnose"),
        ("pipeline/predict/a.py", "from kempf.pipeline.compare.misfit import where"),
        ("pipeline/compare/a.py", "from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis"),
        ("pipeline/channels/a.py", "from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags"),
        ("pipeline/segment/rudder/a.py", "from kempf.pipeline.segment.zigzags.zigzag import Zigzag"),
        ("pipeline/diagnose/screening/a.py", "from kempf.pipeline.diagnose.verdicts.verdict import verdict"),
        ("pipeline/ingest/mcap/container/a.py", "from kempf.pipeline.ingest.mcap.decode import decode"),
        ("warehouse/a.py", "from kempf.flows.jobs.ingest import files"),
        ("warehouse/a.py", "from kempf.pipeline.estimate import estimators"),
        ("warehouse/a.py", "import kempf.workbench"),
        ("flows/a.py", "from kempf.workbench.terminal import number"),
        ("warehouse/storage/a.py", "from kempf.warehouse.tables import logs"),
        ("warehouse/tables/a.py", "from kempf.warehouse.queries.standing import standing_ids"),
        ("flows/jobs/ingest/a.py", "from kempf.flows.jobs.inbox.take_inbox import take_inbox"),
        ("flows/jobs/identify/a.py", "from kempf.flows.jobs.diagnose import add_effect"),
        ("flows/a.py", "from prefect import flow"),
        ("flows/a.py", "from importlib import import_module\nimport_module('kempf.workbench.cli')"),
        ("flows/a.py", "from importlib import import_module\nimport_module(f'kempf.workbench.{1}')"),
        ("flows/a.py", "import importlib\nimportlib.import_module(name)"),
        ("workbench/a.py", "import prefect.artifacts"),
        ("workbench/a.py", "import deltalake"),
    ],
)
def test_the_checker_catches_a_violation(path, source):
    assert len(faults(path, source)) >= 1


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("workbench/a.py", "import kempf.flows.fleet, kempf.warehouse.tables.raw, kempf.schemas.errors, click"),
        ("flows/fleet/flows.py", "from prefect import flow"),
        ("warehouse/a.py", "from kempf.pipeline.ingest.readings import Readings\nimport deltalake"),
        ("pipeline/simulate/a.py", "from kempf.pipeline.simulate.trial import Trial\nimport numpy"),
        ("pipeline/manoeuvre/a.py", "from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags"),
    ],
)
def test_the_checker_lets_good_imports_pass(path, source):
    assert faults(path, source) == []
