"""Warehouses of earlier versions are brought forward by ``kempf migrate``, also by one that is killed on the way.

``layout_2_warehouse.tar.xz`` was written by the last version of layout 2 (commit e4b330e): three short logs of a
simulated ferry, of which one was removed, a correction, a note, her parameter sets; with it is what that version
answered. ``layout_3_warehouse.tar.xz`` was written likewise by the last version of layout 3 (commit c0cc142): four
short logs of two ferries, of which one was purged; one ferry was renamed, the other was identified twice.
``earlier_warehouse.tar.xz`` is of layout 2 and much older, see ``test_earlier_warehouse.py``.
"""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import tarfile
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

import kempf as kempf_package
from kempf.flows.fleet import flows
from kempf.flows.jobs.inbox.take_inbox import take_inbox
from kempf.schemas.errors import KempfError
from kempf.warehouse.sources.source_folder import SourceFolder
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.storage.keys import earlier_key, vessel_key
from kempf.warehouse.storage.marker import LAYOUT, Marker
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets
from kempf.warehouse.upkeep.migrations.chain import forward
from tests.flows.content import LASTING, seen
from tests.workbench.driving import environment, kempf, refused, tree

HERE = Path(__file__).parent
#: The layout of each.
PACKED = {"layout_2_warehouse": 2, "earlier_warehouse": 2, "layout_3_warehouse": 3}
#: Those that came with what their version answered, and a set of each.
ANSWERED = {"layout_2_warehouse": "ps-0125542db53c6969", "layout_3_warehouse": "ps-e260d1a268aa6402"}


def unpacked(name: str, folder: Path) -> Path:
    with tarfile.open(HERE / f"{name}.tar.xz") as packed:
        packed.extractall(folder, filter="data")
    return folder


@pytest.fixture(scope="module", params=PACKED)
def packed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return unpacked(request.param, tmp_path_factory.mktemp("packed") / request.param) / "warehouse"


@pytest.fixture
def place(packed: Path, tmp_path: Path) -> Path:
    return copytree(packed, tmp_path / "w")


@pytest.fixture
def since(packed: Path) -> int:
    """The layout that the packed one has."""
    return PACKED[packed.parent.name]


@pytest.fixture(scope="module", params=ANSWERED)
def brought(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The warehouse of the last version of a layout, brought forward, with what it answered in ``answers.json``."""
    folder = unpacked(request.param, tmp_path_factory.mktemp("brought") / request.param)
    assert kempf("migrate", "--yes", "--warehouse", folder / "warehouse").code == 0
    return folder


def content(warehouse: Warehouse) -> dict[str, list[str]]:
    """What a warehouse says, but for keys, the month that readings had not, and what aliases of before are called."""
    found = seen(warehouse)
    for row in (row for rows in found.values() for row in rows):
        row.pop("vessel_key", None)
    for name in ("readings", "rejected"):
        for row in found[name]:
            row.pop("month", None)
    del found["aliases"]
    found["raw"] = [row for row in found["raw"] if len(row["name"]) == 64]
    return {name: sorted(rows) for name, rows in as_texts(found).items()}


def as_texts(found: dict[str, list[dict[str, Any]]]) -> dict[str, list[str]]:
    """Rows as they are compared: what is no number is not equal to itself."""
    return {name: [json.dumps(row, sort_keys=True) for row in rows] for name, rows in found.items()}


def end_state(place: Path) -> dict[str, Any]:
    """What there is in the end, but for names of files and numbers of versions."""
    warehouse = Warehouse(str(place))
    tables = [delta.open_table(warehouse, name) for name in ("readings", "segments")]
    uris = [uri for table in tables if table is not None for uri in table.file_uris()]
    said = as_texts(seen(warehouse))
    beside = {path.name: path.read_bytes() for path in (place / "raw").rglob("*.json")}
    folders = sorted({uri.rpartition("/")[0].removeprefix(str(place)) for uri in uris})
    unsealed = {name: seals.unsealed(place / name) for name in delta.versions(warehouse)}
    return {"said": said, "beside": beside, "folders": folders, "unsealed": unsealed, "marker": warehouse.marker()}


def test_it_says_first_what_it_will_do_and_asks(place: Path, since: int) -> None:
    before = tree(place)
    error = refused(kempf("migrate", "--warehouse", place, "--json"), 2, "not_confirmed")
    assert f"from layout {since} to 4: " in error["message"]
    assert "get keys that read as their vessels' names" in error["message"]
    old = refused(kempf("segments", "--warehouse", place, "--json"), 1, "warehouse_layout_old")
    assert old["details"] == {"found": since, "expected": 4} and "kempf migrate" in old["next_step"]
    for command in ("verify", "repair", "compact", "reprocess"):
        refused(kempf(command, "--warehouse", place, "--json"), 1, old["code"])
    assert tree(place) == before


def test_everything_is_there_after(place: Path, since: int) -> None:
    warehouse = Warehouse(str(place))
    then = content(forward(warehouse))
    done = kempf("migrate", "--yes", "--warehouse", place, "--json")
    assert done.code == 0 and (done.json["from"], done.json["to"]) == (since, LAYOUT), done
    assert content(warehouse) == then and set(LASTING) - {"aliases"} <= then.keys()
    assert kempf("verify", "--warehouse", place).out.strip() == "all is well"
    assert warehouse.marker() == Marker(LAYOUT)
    after = tree(place)
    again = kempf("migrate", "--warehouse", place)
    assert again.code == 0 and again.out.strip() == "nothing to do: the warehouse has layout 4"
    assert tree(place) == after
    assert kempf("reprocess", "--warehouse", place).code == 0


def test_every_command_answers_as_before(brought: Path) -> None:
    answers = json.loads((brought / "answers.json").read_text(encoding="utf-8"))
    assert len(answers) > 20 and {"segments", "vessels list", "segments corrections"} <= answers.keys()
    for command, answer in answers.items():
        # a blank in a name is written as _ there
        words = [word.replace("_", " ") for word in command.split()]
        done = kempf(*words, "--warehouse", brought / "warehouse", "--json")
        assert done.code == 0, (command, done)
        if command.startswith("vessels show"):
            assert answer.pop("partition", None) in (None, f"vessel_key={earlier_key(words[2])}")
            assert done.json["partition"] == f"vessel_key={vessel_key(words[2])}"
        found = done.json
        if command.startswith("doctor"):
            # a later doctor looks at more
            known = {check["check"] for check in answer["checks"]}
            found["checks"] = [check for check in found["checks"] if check["check"] in known]
        # what is computed anew goes with the code of today, what is stored does not
        same(found, answer, command, 0.02 if command.startswith("compare") else 1e-9)


def same(found: Any, wanted: Any, where: str, within: float) -> None:
    """Compare answers; what this version has to say beyond is allowed, and the last digits of what is computed."""
    if isinstance(wanted, dict):
        for key, value in wanted.items():
            assert key in found, (where, key)
            same(found[key], value, f"{where} {key}", within)
    elif isinstance(wanted, list):
        assert len(found) == len(wanted), where
        for k, (one, other) in enumerate(zip(found, wanted, strict=True)):
            same(one, other, f"{where} {k}", within)
    elif isinstance(wanted, float):
        # what is near nothing is compared by its size: degrees to a hundredth or two, SI units to a thousandth
        least = (
            1e-12
            if within < 1e-6
            else 0.02
            if any(unit in where for unit in ("deg", "rms_display", "rms_told"))
            else 1e-3
        )
        assert math.isclose(found, wanted, rel_tol=within, abs_tol=least), (where, found, wanted)
    else:
        assert found == wanted, where


def test_a_set_is_built_again_with_the_same_values(brought: Path) -> None:
    warehouse = Warehouse(str(brought / "warehouse"))
    name = ANSWERED[brought.name]
    stored = parameter_sets.get(warehouse, name)
    done = kempf("rerun", name, "--warehouse", warehouse.uri, "--json")
    assert done.json["parameter_set_id"] == name == stored.parameter_set_id
    # other code or packages than those of then may move what follows from the bytes
    if not done.json["code_changed"] and not done.json["packages_changed"]:
        assert done.code == 0 and done.json["verdict"] == "bit-identical", done


def test_notebook_and_flows_say_the_same(place: Path, tmp_path: Path) -> None:
    (tmp_path / "inbox" / "ferry").mkdir(parents=True)
    (tmp_path / "inbox" / "ferry" / "day.csv").write_text("time,heading\n", "utf-8")
    inbox = SourceFolder(str(tmp_path / "inbox"))
    for ask in (
        kempf_package.open(str(place)).vessels,
        lambda: flows.reprocess.fn(str(place)),
        lambda: take_inbox(Warehouse(str(place)), inbox, settle_s=0.0),
    ):
        with pytest.raises(KempfError) as caught:
            ask()
        assert caught.value.code == "warehouse_layout_old" and "kempf migrate" in caught.value.next_step


def test_what_is_purged_after_is_gone_from_the_files_of_before_too(tmp_path: Path) -> None:
    place = unpacked("earlier_warehouse", tmp_path) / "warehouse"
    assert kempf("migrate", "--yes", "--warehouse", place).code == 0
    log, other = kempf("logs", "list", "--warehouse", place, "--json").json
    ingest = {row.log_id: row.ingest_id for row in logs.current(Warehouse(str(place)))}
    done = kempf("purge", log["log_id"], "--reason", "end of the charter", "--yes", "--warehouse", place)
    assert done.code == 0, done
    files = [path.parent.name for path in (place / "readings").rglob("part-*.parquet")]
    assert f"ingest_id={ingest[log['log_id']]}" not in files and f"ingest_id={ingest[other['log_id']]}" in files
    assert kempf("verify", "--warehouse", place).out.strip() == "all is well"


#: Brings a warehouse forward a commit a log, and dies before the so-many-th time that it would write; without a number
#: it counts them.
DYING = """
import os, signal, sys
from kempf.flows.jobs.repair.migrate_warehouse import migrate
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.upkeep.migrations import by_month, by_name, commits
from kempf.warehouse.storage.store import Warehouse

by_month.MOST_LOGS = by_name.MOST_FOLDERS = 1
count, last = 0, int(sys.argv[2])

def dying(write):
    def wrapped(*arguments, **named):
        global count
        count += 1
        if count == last:
            os.kill(os.getpid(), signal.SIGKILL)
        return write(*arguments, **named)
    return wrapped

for owner, name in (
    *((commits, name) for name in ("append_alone", "describe_alone", "exchange_alone")),
    *((delta, "replace"), (seals, "_write"), (Warehouse, "write")),
):
    setattr(owner, name, dying(getattr(owner, name)))
migrate(Warehouse(sys.argv[1]))
print(count)
"""


def dying(place: Path, number: int) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", DYING, str(place), str(number)]
    return subprocess.run(command, capture_output=True, text=True, env=environment(), check=False, timeout=120)


#: Before the first write (0), before the last one (1), and between.
KILLED = {
    "layout_2_warehouse": (0.0, 0.3, 0.6, 1.0),
    "earlier_warehouse": (0.5,),
    "layout_3_warehouse": (0.3, 0.6, 1.0),
}


@pytest.mark.parametrize("name", PACKED)
def test_one_that_is_killed_is_finished_by_the_next(name: str, tmp_path: Path) -> None:
    packed = unpacked(name, tmp_path) / "warehouse"
    whole = dying(copytree(packed, tmp_path / "whole"), 0)
    writes = int(whole.stdout)
    wanted = end_state(tmp_path / "whole")
    for number in (1 + round(part * (writes - 1)) for part in KILLED[name]):
        place = copytree(packed, tmp_path / f"killed-{number}")
        assert dying(place, number).returncode == -signal.SIGKILL
        if number > 1:
            error = refused(kempf("logs", "list", "--warehouse", place, "--json"), 1, "warehouse_migrating")
            assert "kempf migrate" in error["next_step"]
        done = kempf("migrate", "--yes", "--warehouse", place)
        assert done.code == 0, (number, done)
        assert end_state(place) == wanted, number
        assert kempf("verify", "--warehouse", place).code == 0
